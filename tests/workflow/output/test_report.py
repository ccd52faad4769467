"""Tests of the report of a finished run: complete, self-contained, and safe for any case."""

import base64
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from types import NoneType

import h5py
import pytest
from matplotlib.figure import Figure

from tests.workflow.conftest import invoke, manifest_has_all
from tests.workflow.scenes import BALL
from workflow.analyses import contact, time, vibration, vibration_wear, wear
from workflow.analyses.contact.output.layout import ContactContents as ContactContents
from workflow.analyses.time.outcome import MotionContents as TimeContents
from workflow.analyses.vibration.output.outcome import VibrationContents as VibrationContents
from workflow.analyses.vibration_wear.output.outcome import VibrationWearContents as WornContents
from workflow.analyses.wear.output.layout import WearContents as WearContents
from workflow.case.text.readable import readable
from workflow.case.text.typeset import exact_percent, given, number, typeset
from workflow.errors import UserError
from workflow.layout.declared import Layout
from workflow.pictures.drawing import write_figures
from workflow.pictures.panels import widen
from workflow.report.run_page import AT_ONCE, _warnings
from workflow.report.writing import write_report
from workflow.runs import run as running
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.output.results import ResultsWriter, read_contents
from workflow.shell.output.summary import counted_from_first

TITLE = 'Ball <script>alert("1")</script> & a "flat"'
EXPECT = """\
assumed: [friction]
expect:
  - {quantity: states.-1.P, value: 400 N, tolerance: 1e-6, kind: closed_form, source: "given <b>"}
  - {quantity: states.-1.peak_pressure, value: 1 GPa, tolerance: 1 %, kind: earlier, source: none}
  - {quantity: states.7.P, value: 1 N, tolerance: 1 %, kind: earlier, source: none}
"""
CASE = BALL.replace("title: Ball", f"title: '{TITLE}'") + EXPECT
QUIET = "output.paraview=false", "output.figures=false"
# Elements that have no end.
VOID = {"meta", "img", "wbr"}


class Page(HTMLParser):
    """Parser of a report: closed elements, texts by their heading, links, and images."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.reported: dict[str, str] = {}
        self.links: list[str] = []
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
    settings = [part for entry in overrides for part in ("--set", entry)]
    ended = invoke("run", folder / "case.yaml", "--out", folder / "out", *settings)
    assert ended.exit_code == 0, ended.stderr
    return folder / "out"


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """Return a run with figures of two formats."""
    folder = tmp_path_factory.mktemp("drawn")
    return run(folder, "output.paraview=false", "output.figures=[svg, pdf]")


def test_page_tells_all_of_a_run_and_needs_nothing_else(drawn):
    text = (drawn / "report.html").read_text("utf-8")
    page = Page(text)
    assert manifest_has_all(drawn)
    assert page.reported[TITLE]
    assert "script" not in page.tags
    assert all(link.startswith("#") for link in page.links)
    assert all(image.startswith("data:image/svg+xml;base64,") for image in page.images)
    assert not re.search(r"https?://|url\(|@import", re.sub(r"base64,[^\"]*", "", text))
    assert "1441 MPa" in page.reported["Results"].replace("\N{NO-BREAK SPACE}", " ")
    expected = page.reported["Expectations"]
    assert ("met" in expected, "missed" in expected, "7 is missing" in expected) == (True,) * 3
    assert "given <b>" in expected
    assert "1 of 3 expectations met" in page.reported[TITLE]
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


def test_figures_are_the_same_bytes_for_the_same_results(drawn, tmp_path):
    contents = read_contents(drawn / "results.h5", ContactContents)
    reported = contact.ANALYSIS.pictures, contents, drawn / "results.h5", tmp_path
    (path,) = write_figures(*reported, ["profiles"], formats=("pdf",))
    assert path.read_bytes() == (drawn / "figures" / path.name).read_bytes()


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


def test_a_page_that_fails_does_not_lose_the_run(tmp_path, monkeypatch):
    def fail(*reported):
        raise KeyError("number")

    monkeypatch.setattr(running, "write_page", fail)
    summary = OutputFolder(run(tmp_path, *QUIET)).read_summary()
    (warning,) = summary["warnings"]
    assert warning.startswith("report.html: not written (KeyError: 'number')")


def test_no_page_of_what_is_no_finished_run(drawn, tmp_path):
    with pytest.raises(UserError, match=r"no run of fretscale here"):
        write_report(tmp_path)
    for name in ("case.yaml", "summary.json", "results.h5", "manifest.json"):
        (tmp_path / name).write_bytes((drawn / name).read_bytes())
    (tmp_path / "results.h5").write_bytes(b"other")
    with pytest.raises(UserError, match=r"results\.h5: differs from the run"):
        write_report(tmp_path)
    (tmp_path / "summary.json").write_text("{}", encoding="utf-8")
    with pytest.raises(UserError, match="damaged, or of an older version"):
        write_report(tmp_path)
    (tmp_path / "summary.json").unlink()
    with pytest.raises(UserError, match="this run is not finished; start it again"):
        write_report(tmp_path)


CONTENTS = {
    contact: ContactContents(True, 3),
    time: TimeContents({"loop": ("00000", "00002")}, ("stiffness",), True),
    vibration: VibrationContents(("00000",), (), False, True),
    vibration_wear: WornContents(True),
    wear: WearContents(("left",), ("blade", "disk"), 2, life=("left",)),
}


@pytest.mark.parametrize("analysis", CONTENTS, ids=lambda module: module.__name__)
def test_results_say_what_they_hold(analysis, tmp_path):
    path, contents = tmp_path / "results.h5", CONTENTS[analysis]
    with h5py.File(path, "w") as file:
        ResultsWriter(file, Layout({})).put_contents(contents)
    kind = analysis.ANALYSIS.pictures().contents
    assert read_contents(path, kind) == contents
    other = next(c for c in CONTENTS.values() if type(c) is not kind)
    with h5py.File(path, "w") as file:
        ResultsWriter(file, Layout({})).put_contents(other)
    with pytest.raises(UserError, match="of another version; run the case again"):
        read_contents(path, kind)
    with h5py.File(path, "w"):
        pass
    with pytest.raises(UserError, match="has no contents list"):
        read_contents(path, kind)
    assert kind is not NoneType


READABLE = [
    ((0.00283, "mm", 0.013), "2.83 µm"),
    ((0.00283456, "mm"), "2.835 µm"),
    ((875e-6, "mm", 0.15), "0.88 µm"),
    ((367.2, "MPa", 0.05), "370 MPa"),
    ((-31352.7, "N"), "-31.35 kN"),
    ((1.3e7, "N mm"), "13 kJ"),
    ((628.318530718, "rad/s"), "6000 rpm"),
    ((0.25 * 3.141592653589793, "rad"), "45 deg"),
    ((1e-8, "1/MPa"), "10000 µm³/J"),
    ((115000.0, "MPa"), "115 GPa"),
    ((4.43e-9, "t/mm^3"), "4430 kg/m³"),
    ((447326.6, "1"), "447300"),
    ((2180967.0, "1"), "2180967"),
    ((0.0309, "1", None, "%"), "3.09 %"),
    ((105000.0, "N/mm", None, "N/um"), "105 N/µm"),
    ((0.0, "mm", 0.1), "0 mm"),
    ((0.0, "N mm"), "0 J"),
    ((3e-7, "1/(N*mm)"), "0.3 1/kJ"),
    ((3e-7, "1/mm"), "3·10⁻⁷ 1/mm"),
    ((99.97, "MPa", 3.0), "100 MPa"),
    ((float("nan"), "mm"), "not a number"),
    ((float("inf"), "1"), "infinite"),
]


@pytest.mark.parametrize(("number", "text"), READABLE, ids=[text for _, text in READABLE])
def test_numbers_are_told_as_people_read_them(number, text):
    assert str(readable(*number)) == text


TYPESET = [
    ("-3.5 um at [-1, 1], (-2)", "−3.5 µm at [−1, 1], (−2)"),
    ("1e+06 N and 1.3e-05 mm^2", "10⁶ N and 1.3·10⁻⁵ mm²"),
    ("26.9% of 1500 um^3/J", "26.9\N{NO-BREAK SPACE}% of 1500 µm³/J"),
    ("body-2 of run_1e5 in 2019-11-05, 1-3", "body-2 of run_1e5 in 2019-11-05, 1-3"),
    ("states.-1.P, exp(-rate E)", "states.-1.P, exp(-rate E)"),
]


@pytest.mark.parametrize(("text", "printed"), TYPESET, ids=[text for text, _ in TYPESET])
def test_sentences_are_printed_with_signs_and_units(text, printed):
    assert typeset(text) == printed


def test_long_numbers_are_grouped_and_names_of_files_are_not():
    assert [number(text) for text in ("2180967", "-12345.6 N", "2500 J", "mesh_20000")] == [
        "2,180,967",
        "−12,345.6 N",
        "2500 J",
        "mesh_20000",
    ]
    assert [given(text) for text in ("10000, -1e5", "20191105.csv", "40000 cycles")] == [
        "10000, -1e5",
        "20191105.csv",
        "40,000 cycles",
    ]
    assert [exact_percent(share) for share in (1e-6, 0.02, 0.0)] == ["0.0001 %", "2.0 %", "0 %"]


def test_expectations_are_named_by_the_results_they_are_of(drawn):
    reported = Page((drawn / "report.html").read_text("utf-8")).reported["Expectations"]
    assert "after the last increment: largest pressure" in reported
    assert counted_from_first({"a": [{"b": 1}, {"b": 2}]}, "a.-1.b") == "a.1.b"
    assert counted_from_first({"a": [1]}, "a.-3.b") == "a.-3.b"


def test_warnings_that_places_share_are_told_once():
    shared = [f"the half-space under {force} N: too coarse by -1 um" for force in (17, 87)]
    reported = _warnings([*shared, "left: worn through", "nothing: of many words: here"])
    assert reported.count("too coarse by −1 µm") == 1
    assert "the half-space under 17 N; the half-space under 87 N" in reported
    assert "<strong>left</strong>: worn through" in reported


def test_an_axis_is_not_filled_by_noise():
    axis = Figure().subplots()
    axis.plot([0.0, 1.0], [5.0, 5.0 + 1e-9])
    widen(axis, 0.1)
    assert axis.get_ylim() == pytest.approx((4.95, 5.05))
    axis.set_yscale("log")
    axis.set_ylim(1.0, 1.0001)
    widen(axis, 0.1)
    low, high = axis.get_ylim()
    assert (high / low, low * high) == pytest.approx((1.1, 1.0001))
    axis.set_ylim(1.0, 3.0)
    widen(axis, 0.1)
    assert axis.get_ylim() == (1.0, 3.0)
