"""Measured surfaces are read from every kind of file, refused with a place, and used in contact."""

import builtins
import re
import warnings
from pathlib import Path

import h5py
import numpy as np
import pytest

from sa_solver import Grid
from sa_solver.surfaces.scans import Scan, resampled
from tests.workflow.files import scan_corpus
from tests.workflow.scenes import BALL
from workflow.analyses.wear.structures.bodies.model import source_of
from workflow.case.files.input_files import InputFileError
from workflow.case.files.scan_files import ENDINGS, PROFILOMETER, WRITTEN, read_scan, write_scan
from workflow.errors import CaseError, UserError
from workflow.kinds import load_case, parse_case, template

PITCH = 0.004, 0.005
BARE = {"unit": "um", "pitch": PITCH}


@pytest.fixture(scope="module")
def scan():
    """Return roughness of 0.3 µm about 5 µm, with a few missing points."""
    heights = 5e-3 + 3e-4 * np.random.default_rng(0).normal(size=(40, 30))
    heights[3, 4] = heights[-1, -1] = np.nan
    return Scan(heights, PITCH)


@pytest.mark.parametrize("ending", WRITTEN)
def test_profilometer_files_come_back(scan, ending, tmp_path):
    """Formats that the library writes are read by it and by us: heights and pitch to 1e-6."""
    import surfalize

    paths = [tmp_path / f"theirs{ending}", tmp_path / f"ours{ending}"]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of steps that differ
        surfalize.Surface(1e3 * scan.heights.T, *(1e3 * p for p in PITCH)).save(str(paths[0]))
    write_scan(paths[1], scan)
    if ending == ".sur":
        assert "µ".encode() not in paths[1].read_bytes()[:512]  # of which others make "Âµ"
        with pytest.raises(UserError, match="single height"):
            write_scan(paths[1], Scan(0.0 * scan.heights, PITCH))
    for path in paths:
        got = read_scan(str(path), None, None)
        np.testing.assert_array_equal(got.measured, scan.measured)
        error = np.nanmax(np.abs(got.heights - scan.heights)) / np.nanstd(scan.heights)
        assert error < 1e-6
        assert got.pitch == pytest.approx(scan.pitch, rel=1e-6)


def corpus(folder, name, content):
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.mark.parametrize("name", [*scan_corpus.BINARY, *scan_corpus.TEXT, *scan_corpus.BARE])
def test_what_instruments_write_has_its_heights_and_pitch(name, tmp_path):
    """Each supported format, packed from its description, is read to 4-byte rounding."""
    content, unit, pitch = scan_corpus.BARE.get(name, (None, None, None))
    if content is None:
        content = {**scan_corpus.BINARY, **scan_corpus.TEXT}[name]
    beside = pitch and tuple(1e-3 * step for step in pitch)
    got = read_scan(str(corpus(tmp_path, name, content)), unit, beside)
    whole = name.endswith(scan_corpus.WITHOUT_GAPS)
    lines = scan_corpus.WHOLE if whole else scan_corpus.LINES
    np.testing.assert_allclose(1e3 * got.heights, lines.T, rtol=1e-6, atol=1e-6)
    assert got.pitch == pytest.approx((1e-3 * scan_corpus.DX, 1e-3 * scan_corpus.DY), rel=1e-6)


def test_all_formats_of_instruments_are_in_the_corpus_and_the_documentation():
    packed = {"." + name.split(".")[1] for name in scan_corpus.BINARY}
    assert packed == set(PROFILOMETER)
    text = (Path(__file__).parents[3] / "docs" / "guides" / "surfaces.md").read_text("utf-8")
    files = text[text.index("- **Files of") : text.index("- **Refused as damaged")]
    refused = {".nms", ".zmg", ".zon"}
    assert set(re.findall(r"`(\.\w+)`", files)) == {*ENDINGS, *refused}


@pytest.mark.parametrize("name", scan_corpus.REFUSED)
def test_what_cannot_be_read_is_refused_with_reason_and_remedy(name, tmp_path):
    content, *words = scan_corpus.REFUSED[name]
    with pytest.raises(InputFileError) as refused:
        read_scan(str(corpus(tmp_path, name, content)), None, None)
    (line,) = str(refused.value).splitlines()
    assert all(word in line for word in words), line


def test_bare_heights_and_tables_come_back(scan, tmp_path):
    microns = 1e3 * scan.heights
    np.save(tmp_path / "s.npy", microns)
    np.savez(tmp_path / "s.npz", other=0, z=microns)
    np.savetxt(tmp_path / "s.csv", microns, delimiter=",", fmt="%.17g")
    with h5py.File(tmp_path / "s.h5", "w") as file:
        file["a/z"] = microns
    for name in ("s.npy", "s.npz:z", "s.csv", "s.h5:a/z"):
        got = read_scan(str(tmp_path / name), **BARE)
        np.testing.assert_allclose(got.heights, scan.heights, rtol=1e-14)
        assert got.pitch == PITCH
    # Points in any order, each with the unit of its heading; one that is missing is left out.
    rows = [
        f"{4.0 * i},{0.005 * j:.3f},{'' if (i, j) == (3, 4) else repr(float(z))}"
        for (i, j), z in np.ndenumerate(microns)
    ]
    np.random.default_rng(1).shuffle(rows)
    table = "x [um],y [mm],z [um]\n" + "\n".join(row for row in rows if not row.endswith("nan"))
    (tmp_path / "p.csv").write_text(table, encoding="utf-8")
    got = read_scan(str(tmp_path / "p.csv"), None, None)
    np.testing.assert_allclose(got.heights, scan.heights, rtol=1e-14)
    assert got.pitch == pytest.approx(PITCH, rel=1e-12)


REFUSED = [
    ("s.sur", "no scan", {}, "s.sur"),
    ("s.csv", "1,2\n3,4\n", {}, "unit and pitch"),
    ("s.csv", "1,2\n3,4\n", BARE, "2 x 2 points"),
    ("s.csv", "1,2\n3\n", BARE, "s.csv:2: "),
    ("s.csv", "1,2\n3,four\n", BARE, "s.csv:2: 'four'"),
    ("s.txt", "0 0 1\n1 0 1\n", BARE, "1 µm apart"),
    ("s.csv", "nan,\n" * 5, BARE, "s.csv"),
    ("s.csv", "x [N],y,z\n1,2,3\n", {}, "s.csv:1: x: "),
    ("s.csv", "x,y,z\n0,0,1\n0,0,2\n1,0,1\n", {}, "s.csv:3: "),
    ("s.csv", "x,y,z\n0,0,1\n1,0,1\n2,0,1\n3,0,1\n4.3,0,1\n5,0,1\n", {}, "s.csv:6: x: 4.3"),
]


@pytest.mark.parametrize(("name", "content", "bare", "place"), REFUSED)
def test_tables_that_are_no_scan_are_refused_with_their_place(name, content, bare, place, tmp_path):
    (tmp_path / name).write_text(content, encoding="utf-8")
    with pytest.raises(InputFileError) as refused:
        read_scan(str(tmp_path / name), bare.get("unit"), bare.get("pitch"))
    assert place in str(refused.value)


def test_a_file_under_another_name_is_not_guessed(scan, tmp_path):
    """The library would use the first of its readers that finds numbers."""
    write_scan(tmp_path / "s.x3p", scan)
    (tmp_path / "s.x3p").rename(tmp_path / "s.al3d")
    with pytest.raises(InputFileError, match="another kind"):
        read_scan(str(tmp_path / "s.al3d"), None, None)
    with pytest.raises(UserError, match=r"no such format; allowed: .x3p, .sur"):
        write_scan(tmp_path / "s.plu", scan)


def test_without_the_library_the_package_to_install_is_named(tmp_path, monkeypatch):
    there = builtins.__import__

    def without(name, *rest):
        if name.startswith("surfalize"):
            raise ImportError(name)
        return there(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(InputFileError, match=r"pip install 'fretscale\[profilometer\]'"):
        read_scan(str(tmp_path / "s.sur"), None, None)
    path = corpus(tmp_path, "s.plu", scan_corpus.BINARY["s.plu"])
    assert read_scan(str(path), None, None).heights.shape == (scan_corpus.NX, scan_corpus.NY)


# --- in a contact -------------------------------------------------------------------------------


def rough_ball(folder, surfaces, shape="shape: sphere, radius: 10 mm"):
    text = BALL.replace("radius: 10 mm}", f"radius: 10 mm, surfaces: {surfaces}}}")
    return parse_case(text.replace("shape: sphere, radius: 10 mm", shape), str(folder / "c.yaml"))


@pytest.fixture
def both(tmp_path):
    """Return levelled points of both bodies on the grid itself, and the folder."""
    rng, grid = np.random.default_rng(4), Grid.covering((1.0, 1.0), (16, 16))
    heights = [1e-4 * rng.normal(size=grid.shape) for _ in range(2)]
    for number, each in enumerate(heights, start=1):
        write_scan(tmp_path / f"{number}.x3p", Scan(each, grid.pitch))
    return tmp_path, grid, *heights


def test_a_gap_from_files_is_the_same_as_one_that_is_made(both):
    """Scans lie on the cells: heights of either body close the gap; the upper's are turned."""
    folder, grid, first, second = both
    case = rough_ball(
        folder, "{body_1: {file: 1.x3p, level: none}, body_2: {file: 2.x3p, level: none}}"
    )
    made = (grid.x**2 + grid.y**2) / 20.0 - first - second[:, ::-1]
    np.testing.assert_allclose(case.structure.gap_on(grid), made, atol=1e-14)
    flat = rough_ball(folder, "{body_1: {file: 1.x3p, level: mean}}", "shape: plane")
    np.testing.assert_allclose(flat.structure.gap_on(grid), first.mean() - first, atol=1e-14)


@pytest.mark.parametrize(
    "surfaces",
    [
        "{}",
        "{body_1: {file: no.sur}}",
        "{body_1: {file: 1.x3p, shift: [1, 0]}}",
        "{body_1: {file: holes.x3p}}",
        "{body_1: {file: 1.x3p, unit: um}}",
    ],
)
def test_cases_refuse_scans_that_do_not_fit(both, surfaces):
    folder, grid, first, _ = both
    write_scan(folder / "holes.x3p", Scan(np.where(first > 1e-4, np.nan, first), grid.pitch))
    with pytest.raises(CaseError, match=r"structure\.surfaces\.body_1"):
        rough_ball(folder, surfaces)


def test_a_contact_that_wears_takes_means_over_any_grid(both):
    """Coarser grids, used for choices, have the means over their own cells."""
    folder, _, first, _ = both
    (folder / "wear.yaml").write_text(template("bodies_wear"), encoding="utf-8")
    overrides = [
        "contact.size=[0.8 mm, 0.8 mm]",
        "contact.grid=[32, 32]",
        "structure={kind: bodies, shape: plane, surfaces: {body_1: {file: 1.x3p, level: none}}}",
    ]
    (face,) = source_of(load_case(folder / "wear.yaml", overrides)).faces
    for cells in ((32, 32), (8, 12)):
        grid = Grid.covering((0.8, 0.8), cells)
        on = resampled(Scan(first, (0.0625, 0.0625)), grid).heights
        np.testing.assert_allclose(face.gap(grid.x, grid.y), -on, atol=1e-13)
