"""Tests of the report of a finished run: complete, self-contained, and safe for any case."""

import base64
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from types import NoneType

import h5py
import pytest

from tests.workflow.command_line import command
from tests.workflow.conftest import invoke, manifest_has_all
from tests.workflow.scenes import BALL
from workflow.analyses import contact, time, vibration, vibration_wear, wear
from workflow.analyses.contact.output.layout import ContactContents as ContactContents
from workflow.analyses.time.outcome import MotionContents as TimeContents
from workflow.analyses.vibration.output.outcome import VibrationContents as VibrationContents
from workflow.analyses.vibration_wear.output.outcome import VibrationWearContents as WornContents
from workflow.analyses.wear.output.layout import WearContents as WearContents
from workflow.case.text.readable import readable
from workflow.errors import UserError
from workflow.layout.declared import Layout
from workflow.report.page import title_of
from workflow.report.run_page import AT_ONCE
from workflow.report.writing import write_report
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.output.results import ResultsWriter, read_contents

TITLE = 'Ball <script>alert("1")</script> & a "flat"'
EXPECT = """\
assumed: [friction]
expect:
  - {quantity: states.-1.P, value: 400 N, tolerance: 1e-6, kind: closed_form, source: "given <b>"}
  - {quantity: states.-1.peak_pressure, value: 1 GPa, tolerance: 1.255 %, kind: earlier, source: no}
  - {quantity: states.7.P, value: 1 N, tolerance: 1 %, kind: earlier, source: none}
"""
CASE = BALL.replace("title: Ball", f"title: '{TITLE}'") + EXPECT
QUIET = "output.paraview=false", "output.figures=false"
# Elements that have no end.
VOID = {"meta", "img", "wbr"}


class Page(HTMLParser):
    """Parser of a report: closed elements, texts by their heading, links, names, and images."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.reported: dict[str, str] = {}
        self.links: list[str] = []
        self.names: list[str] = []
        self.images: list[str] = []
        self.tags: set[str] = set()
        self._heading = ""
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        given = dict(attrs)
        self.links += [given[name] for name in ("href", "action") if name in given]
        self.names += [given["id"]] if "id" in given else []
        self.images += [given["src"]] if "src" in given else []
        assert not [name for name in given if name.startswith("on")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] in ("h1", "h2"):
            self._heading = data
        self.reported[self._heading] = self.reported.get(self._heading, "") + data


def run(folder: Path, *overrides: str) -> Path:
    """Return the folder of a finished run of the case."""
    folder.mkdir(exist_ok=True)
    (folder / "case.yaml").write_text(CASE, encoding="utf-8")
    ended = command("run", folder / "case.yaml", "--out", folder / "out", overrides=overrides)
    assert ended.exit_code == 0, ended.stderr
    return folder / "out"


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """Return a run with figures of two formats."""
    folder = tmp_path_factory.mktemp("drawn")
    return run(folder, "output.paraview=false", "output.figures=[svg, pdf]")


def test_the_page_is_complete_and_self_contained(drawn):
    text = (drawn / "report.html").read_text("utf-8")
    page = Page(text)
    assert manifest_has_all(drawn)
    assert page.reported[TITLE]
    assert "script" not in page.tags
    assert set(page.links) <= {f"#{name}" for name in page.names}
    assert len(set(page.names)) == len(page.names)
    sections = set(page.names) - {"summary"}
    assert {f"#{name}" for name in sections} <= set(page.links)
    titles = [title_of(base64.b64decode(image.split(",")[1]).decode()) for image in page.images]
    assert all(title in page.reported["Contents"] for title in titles)
    assert all(image.startswith("data:image/svg+xml;base64,") for image in page.images)
    assert not re.search(r"https?://|url\(|@import", re.sub(r"base64,[^\"]*", "", text))
    assert "1441 MPa" in page.reported["Results"].replace("\N{NO-BREAK SPACE}", " ")
    expected = page.reported["Expectations"]
    assert ("met" in expected, "missed" in expected, "7 is missing" in expected) == (True,) * 3
    assert "given <b>" in expected
    assert "1.255 %" in expected.replace("\N{NO-BREAK SPACE}", " ")
    assert "1 of 3 expectations met" in page.reported["Summary"]
    assert "115 GPa" in page.reported["The case"]
    assert "friction" in page.reported["The case"]
    assert (drawn / "case.yaml").read_text("utf-8") in page.reported["The case file"]
    assert "numpy" in page.reported["Methods"]
    seconds = json.loads((drawn / "summary.json").read_text("utf-8"))["seconds"]
    reported = [name for name in seconds if name in page.reported["Time"]]
    assert reported == [name for name, spent in seconds.items() if spent >= AT_ONCE]
    assert f"all{sum(seconds.values()):,.1f} s" in page.reported["Time"]


def test_figures_are_of_the_formats_asked_for_and_those_of_the_page(drawn):
    figures = sorted(path.name for path in (drawn / "figures").iterdir())
    assert figures == ["maps.pdf", "maps.svg", "profiles.pdf", "profiles.svg"]
    images = Page((drawn / "report.html").read_text("utf-8")).images
    within = [base64.b64decode(image.partition(",")[2]).decode("utf-8") for image in images]
    for name in ("profiles", "maps"):
        whole = (drawn / "figures" / f"{name}.svg").read_text("utf-8")
        assert re.sub(r"\s*<metadata>.*</metadata>", "", whole, flags=re.DOTALL) in within


def test_page_is_made_anew_from_the_folder_alone(drawn):
    before = (drawn / "report.html").read_bytes()
    (drawn / "report.html").unlink()
    assert invoke("report", drawn).exit_code == 0
    assert (drawn / "report.html").read_bytes() == before
    assert manifest_has_all(drawn)
    OutputFolder(drawn).read_summary()


def test_a_run_that_draws_or_reports_nothing(tmp_path):
    out = run(tmp_path / "plain", *QUIET)
    page = Page((out / "report.html").read_text("utf-8"))
    assert page.images == []
    assert "drew no figures" in page.reported["Figures"]
    out = run(tmp_path / "silent", *QUIET, "output.report=false")
    assert not (out / "report.html").exists()
    elsewhere = tmp_path / "deep" / "page.html"
    assert write_report(out, elsewhere) == elsewhere
    assert Page(elsewhere.read_text("utf-8")).images
    assert not (out / "report.html").exists()


CONTENTS = {
    contact: ContactContents(True, 3),
    time: TimeContents({"loop": ("00000", "00002")}, ("stiffness",), True),
    vibration: VibrationContents(("00000",), (), False, True),
    vibration_wear: WornContents(True),
    wear: WearContents(("left",), ("blade", "disk"), 2, life=("left",)),
}


@pytest.mark.parametrize("analysis", CONTENTS, ids=lambda module: module.__name__)
def test_results_list_their_contents(analysis, tmp_path):
    path, contents = tmp_path / "results.h5", CONTENTS[analysis]
    with h5py.File(path, "w") as file:
        ResultsWriter(file, Layout({})).put_contents(contents)
    kind = analysis.ANALYSIS.pictures().contents
    assert read_contents(path, kind) == contents
    other = next(c for c in CONTENTS.values() if type(c) is not kind)
    with h5py.File(path, "w") as file:
        ResultsWriter(file, Layout({})).put_contents(other)
    with pytest.raises(UserError, match="another version"):
        read_contents(path, kind)
    with h5py.File(path, "w"):
        pass
    with pytest.raises(UserError, match="has no contents list"):
        read_contents(path, kind)
    assert kind is not NoneType


READABLE = [
    # The second digit of the error is the last one: ± 0.037 µm, ± 0.16 kN, ± 0.10 and ± 370 mm.
    ((0.00283, "mm", 0.013), "2.830 µm"),
    ((-31352.7, "N", 0.005), "-31.35 kN"),
    ((9.9996, "1", 0.00998), "10.00"),
    ((9.99996, "mm", 0.005), "10.000 mm"),
    ((123.456, "mm", 3.0), "120 mm"),
    # Few digits remain of a very large error, and not too many of a very small one.
    ((0.5, "1", 5.0), "0.50"),
    ((2.0 / 3.0, "1", 1e-12), "0.666667"),
    # A given number has all its digits, one of unknown error has four.
    ((1234.56, "1", 0.0), "1234.56"),
    ((-31352.7, "N"), "-31.35 kN"),
    ((628.318530718, "rad/s"), "6000 rpm"),
    ((1e-8, "1/MPa"), "10000 µm³/J"),
    ((4.43e-9, "t/mm^3"), "4430 kg/m³"),
    ((0.0309, "1", None, "%"), "3.09 %"),
    ((3e-7, "1/mm"), "3·10⁻⁷ 1/mm"),
    ((float("nan"), "mm"), "not a number"),
]


@pytest.mark.parametrize(("number", "text"), READABLE, ids=[text for _, text in READABLE])
def test_numbers_are_rounded_and_have_everyday_units(number, text):
    assert str(readable(*number)) == text
