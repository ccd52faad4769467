"""Tests of loads of another code: the case that reads them, its run, and exported loads."""

import csv
import json
import shutil
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from fe_models.geometry.dovetail import Dovetail
from sa_solver.types import Array, Grid
from tests.marks import slow
from tests.workflow.command_line import command
from workflow.analyses.wear.case.gaps import ParaboloidGap, RoundedGap
from workflow.analyses.wear.checks.warnings import warn_of_file
from workflow.analyses.wear.gaps import gap_over
from workflow.analyses.wear.structures.resultants.case import ResultantsCase
from workflow.analyses.wear.structures.resultants.model import given_loads
from workflow.case.text.writing import dump_case
from workflow.errors import CaseError
from workflow.kinds import load_case, parse_case, template
from workflow.models.gaps import GridHeights
from workflow.shell.terminal.reporter import Reporter

# Typed by hand: what presses and slides, what opens and closes, a face that is never closed.
TABLE = """\
# forces of the lower body on the upper one
interface, P [kN], Qx [kN], Qy, Mx, My [N*m], Mz, Edx [mJ], Edy
early,  20,  -6, 0, 0, 10, 0,  0, 0
early,  50, -20, 0, 0, 20, 0, 60, 0
early,  30,   2, 0, 0, 10, 0,  0, 0
early,   0,   0, 0, 0,  0, 0,  0, 0
late,    0,   0, 0, 0,  0, 0,  0, 0
late,    0,   0, 0, 0,  0, 0,  0, 0
late,   10,   4, 0, 0,  0, 0, 20, 0
late,    5,   0, 0, 0,  0, 0,  0, 0
never,   0,   0, 0, 0,  0, 0,  0, 0
never,   0,   0, 0, 0,  0, 0,  0, 0
never,   0,   0, 0, 0,  0, 0,  0, 0
never,   0,   0, 0, 0,  0, 0,  0, 0
"""
LINE_TABLE = """\
P [kN/m], Qx [kN/m], My [N], Edx [mJ/mm]
200, 80, 40, 0.6
1000, 400, 100, 3
1000, -400, 100, 8
"""
FRAME = "{origin: [15, 0, 245], x: [-1, 0, 1], normal: [-1, 0, -1]}"
SMALL = ["contact.grid=[16, 24]", "wear.cycles=2e4", "wear.step.cycles=1e4"]
QUIET = [
    *("output.paraview=false", "output.figures=false"),
    *("stress.section=none", "stress.life.parameter=none"),
]


def run(case: Path, out: Path, *overrides: str) -> dict[str, Any]:
    """Return the summary of a run that must succeed."""
    done = command("run", case, "--out", out, "--force", overrides=[*QUIET, *overrides])
    assert done.exit_code == 0, done.stderr
    summary: dict[str, Any] = json.loads((out / "summary.json").read_text("utf-8"))
    return summary


def write_nodes(path: Path, x: Array, y: Array) -> Path:
    """Write a table of nodes at ``x`` and ``y`` of the face in ``FRAME``, numbered from 100."""
    local = np.stack([axis.ravel() for axis in np.meshgrid(x, y)], axis=1)
    points = [15, 0, 245] + local[:, :1] * [-1, 0, 1] / np.sqrt(2) + local[:, 1:] * [0, 1, 0]
    rows = [f"{100 + n}, {X!r}, {Y!r}, {Z!r}" for n, (X, Y, Z) in enumerate(points.tolist())]
    path.write_text("\n".join(["node, X, Y, Z", *rows]), encoding="utf-8")
    return path


@pytest.fixture
def written(tmp_path: Path) -> Path:
    """Write the template and a table in its folder."""
    (tmp_path / "loads.csv").write_text(TABLE, encoding="utf-8")
    path = tmp_path / "case.yaml"
    path.write_text(template("resultants"), encoding="utf-8")
    return path


# Attributes of an interface of a cycle that was marched.
CLOSING = "closure", "cycles"


# --- the case -----------------------------------------------------------------------------------


def test_template_is_a_case(written):
    case = load_case(written)
    assert isinstance(case, ResultantsCase)
    assert case.contact.method == "full"  # a table has no slip
    assert parse_case(dump_case(case), "dump") == case
    checked = command("check", written)
    assert checked.exit_code == 0
    assert "loads in 3-D from loads.csv, without slip" in checked.stdout
    assert "early, P up to 50 kN, Qx -20 to 2 kN, 11 x 60 mm, rounded" in checked.stdout


@pytest.mark.parametrize(
    ("override", "place"),
    [
        ("contact.method=normal", "contact.method"),
        ("structure.file=none.csv", "structure.file"),
        ("structure.file=zero.csv", "structure.file"),
        ("structure.file=taken.csv", "structure.file"),
        ("friction.coefficient=0.1", "structure.file"),
        ("structure.size=[0.5, 60]", "structure.file"),
        ("structure.dimension=2", "structure.file"),
        ("structure.size=[11]", "structure.size"),
        ("structure.gap=", "structure.gap"),
        ("structure.gap.edge_width=6", "structure.gap.edge_width"),
        ("structure.gap.end_radius=", "structure.gap.end_width"),
        ("structure.gap={shape: paraboloid}", "structure.gap.radius_x"),
        ("structure.gap={shape: heights, file: gap.npy}", "contact.grid"),
        ("structure.interfaces=[{name: pad}]", "interfaces.0.name"),
        ("structure.interfaces=[{name: late}, {name: late}]", "interfaces.1.name"),
        ("structure.interfaces=[{name: late, size: 3}]", "interfaces.0.size"),
        ("structure.interfaces=[{name: late, nodes: {body_1: nodes.csv}}]", "nodes.body_1"),
    ],
)
def test_wrong_entries_are_named(written, override, place):
    folder = written.parent
    header = "interface,P,Qx,Qy,Mx,My,Mz,Edx,Edy\n"
    (folder / "zero.csv").write_text(f"{header}a{',0' * 8}\n", encoding="utf-8")
    (folder / "taken.csv").write_text(f"{header}kinetics,1{',0' * 7}\n", encoding="utf-8")
    np.save(folder / "gap.npy", np.zeros((3, 4)))
    write_nodes(folder / "nodes.csv", np.linspace(-5, 5, 4), np.linspace(-9, 9, 4))
    with pytest.raises(CaseError) as refusal:
        load_case(written, [override])
    (line,) = str(refusal.value).splitlines()
    assert place in line


def test_interfaces_may_differ(written):
    overrides = [
        "structure.interfaces=[{name: late, size: [8, 20], gap: {shape: paraboloid, radius_x: 1 m},"
        f" frame: {FRAME}}}, {{name: early}}]"
    ]
    source = given_loads(load_case(written, [*SMALL, *overrides]))
    late, early = source.faces
    assert (late.face.name, early.face.name) == ("late", "early")
    assert late.size == pytest.approx((8.0, 20.0), rel=1e-15)
    assert late.gap(np.array([2.0]), np.array([5.0])) == pytest.approx(2e-3, rel=1e-15)
    assert early.size == pytest.approx((11.0, 60.0), rel=1e-15)
    axes = late.face.frame.axes
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(axes) == pytest.approx(1.0, rel=1e-15)
    np.testing.assert_allclose(axes[1], [0.0, 1.0, 0.0], atol=1e-15)  # z × x
    # The corners of the nominal face carry all of its area, and do not slip.
    assert late.face.nodal_areas.sum() == pytest.approx(160.0, rel=1e-15)
    assert source.peak == 1
    assert source.probe([])[:, 0].tolist() == [0.0, 5e4]
    assert not source.unworn()[0].slip.any()


# --- gaps ---------------------------------------------------------------------------------------


def test_rounded_gap_is_that_of_a_straight_flank(small_path):
    geometry: Dovetail = load_case(small_path).structure.geometry()
    grid = Grid.covering((1.1 * geometry.flank_width, 1.1 * geometry.slot_length), (33, 47))
    names = ("edge_width", "edge_radius", "end_width", "end_radius")
    shape = RoundedGap(shape="rounded", **{name: getattr(geometry, name) for name in names})
    nominal = Grid.covering(geometry.flank_size(), (1, 1))
    rounded = gap_over(shape, None, nominal)(grid.x, grid.y)
    flank = geometry.flank_gap(grid.x, grid.y, 1)
    np.testing.assert_allclose(rounded, flank, rtol=0.0, atol=1e-13 * flank.max())


def test_paraboloid_is_straight_without_a_radius():
    x, y = np.array([[1.0], [2.0]]), np.array([[3.0, 4.0]])
    grid = Grid.covering((1.0, 1.0), (1, 1))
    both = gap_over(ParaboloidGap(shape="paraboloid", radius_x=2.0, radius_y=4.0), None, grid)
    np.testing.assert_allclose(both(x, y), x**2 / 4.0 + y**2 / 8.0, rtol=1e-15)
    one = gap_over(ParaboloidGap(shape="paraboloid", radius_y=4.0), None, grid)
    np.testing.assert_allclose(one(x, y), 0.0 * x + y**2 / 8.0, rtol=1e-15)


@pytest.mark.parametrize("line", [False, True], ids=["area", "line"])
def test_heights_are_their_own_on_their_grid_and_bilinear_elsewhere(line):
    size = 4.0, 6.0
    grid = Grid.line_contact(4.0, 12) if line else Grid.covering(size, (12, 9))
    other = Grid.line_contact(4.0, 31) if line else Grid.covering(size, (31, 8))
    rough = np.random.default_rng(0).random(grid.shape)
    np.testing.assert_array_equal(GridHeights(grid, rough)(grid.x, grid.y), rough, strict=True)
    plane = 1.0 + 2.0 * grid.x + 0.3 * grid.y + 0.5 * grid.x * grid.y
    expected = 1.0 + 2.0 * other.x + 0.3 * other.y + 0.5 * other.x * other.y
    heights = GridHeights(grid, plane)(other.x, other.y)
    np.testing.assert_allclose(heights, expected, atol=1e-13)


# --- a table typed by hand ----------------------------------------------------------------------


@pytest.fixture(scope="module")
def typed(tmp_path_factory) -> tuple[Path, dict[str, Any]]:
    """Return folder and summary of a run under the table, which tests must not change."""
    folder = tmp_path_factory.mktemp("typed")
    (folder / "loads.csv").write_text(TABLE, encoding="utf-8")
    (folder / "case.yaml").write_text(template("resultants"), encoding="utf-8")
    x, y = np.linspace(-5.5, 5.5, 12), np.linspace(-30, 30, 30)
    write_nodes(folder / "all.csv", x, y)
    write_nodes(folder / "half.csv", x[6:], y)
    nodes = "{body_1: all.csv, body_2: half.csv}"
    early = f"{{name: early, frame: {FRAME}, nodes: {nodes}}}"
    interfaces = f"[{early}, {{name: late}}, {{name: never}}]"
    summary = run(
        folder / "case.yaml", folder / "out", *SMALL, f"structure.interfaces={interfaces}",
        "structure.gap.edge_width=3 mm", "structure.gap.edge_radius=100 mm",
        "structure.gap.end_width=10 mm", "structure.gap.end_radius=1 m",
    )  # fmt: skip
    return folder / "out", summary


def test_table_wears_as_its_energy_says(typed):
    """Loads are those of the table, and worn volume = coefficient x energy."""
    folder, summary = typed
    coefficient = 1e-8  # 1e4 µm³/J in 1/MPa
    for name, load in {"early": 5e4, "late": 0.0, "never": 0.0}.items():
        interface = summary[name]
        assert interface["peak_load"]["unworn"]["P"] == load
        for body in (1, 2):
            assert interface[f"volume_{body}"] == pytest.approx(
                coefficient * interface["energy"], rel=1e-9
            )
    assert summary["early"]["volume_1"] > 0.0
    assert summary["late"]["volume_1"] > 0.0
    assert summary["never"]["volume_1"] == 0.0
    assert summary["early"]["by_increment"]["sliding"] == [False, True, False, False]
    assert summary["early"]["slip_per_cycle"] > 0.0  # of the half-space: the table has none
    with h5py.File(folder / "results.h5") as file:
        pressure = file["contact/early/00000/pressure"][()]
        pitch = file["grid/early"].attrs["pitch"]
    assert pressure.sum() * np.prod(pitch) == pytest.approx(5e4, rel=1e-7)


def test_worn_surface_goes_back_to_the_nodes(typed):
    folder, summary = typed
    assert sorted(path.name for path in folder.glob("worn_nodes_*")) == [
        "worn_nodes_early_body_1.csv",
        "worn_nodes_early_body_2.csv",
    ]
    reported = summary["early"]["worn_nodes"]
    assert reported["body_1"]["volume_share"] == pytest.approx(1.0, rel=1e-12)
    assert 0.1 < reported["body_2"]["volume_share"] < 0.9
    assert any("early, body_2: the nodes carry" in warning for warning in summary["warnings"])
    assert not any("body_1" in warning for warning in summary["warnings"])
    moved = {body: displacements(folder / f"worn_nodes_early_body_{body}.csv") for body in (1, 2)}
    assert (len(moved[1]), len(moved[2])) == (360, 180)
    # Into their own bodies along the normal, which points down and to the left.
    normal = np.array([-1.0, 0.0, -1.0]) / np.sqrt(2.0)
    for body, sign in {1: -1.0, 2: 1.0}.items():
        depth = sign * moved[body] @ normal
        np.testing.assert_allclose(moved[body], sign * np.outer(depth, normal), atol=1e-18)
        assert depth.min() >= 0.0
        assert 0.0 < depth.max() <= summary["early"][f"depth_{body}"]


def displacements(path: Path) -> Array:
    """Return the rows ``(n, 3)`` of a table of displacements."""
    with path.open(newline="", encoding="utf-8") as stream:
        header, *rows = csv.reader(stream)
    assert header == ["node", "ux [mm]", "uy [mm]", "uz [mm]"]
    assert [int(row[0]) for row in rows] == list(range(100, 100 + len(rows)))
    return np.array([row[1:] for row in rows], dtype=float)


def test_a_new_run_takes_away_the_nodes_of_the_old(typed, tmp_path):
    shutil.copytree(typed[0], tmp_path / "out")
    (tmp_path / "loads.csv").write_text(LINE_TABLE, encoding="utf-8")
    (tmp_path / "case.yaml").write_text(template("resultants"), encoding="utf-8")
    summary = run(
        tmp_path / "case.yaml", tmp_path / "out", *SMALL, "structure.dimension=2",
        "structure.size=3", "structure.gap={shape: paraboloid, radius_x: 20 mm}",
        "contact.grid=[64, 8]",
    )  # fmt: skip
    assert not list((tmp_path / "out").glob("worn_nodes_*"))
    interface = summary["interface"]
    assert summary["per_length"]
    assert interface["energy_per_cycle"]["half_space"] == pytest.approx(11.6, rel=1e-6)
    assert interface["volume_1"] == pytest.approx(1e-8 * interface["energy"], rel=1e-9)


def test_a_table_without_moments_holds_the_tilt(tmp_path):
    """Heights are not level; a table of the moments that hold the tilt presses equally."""
    x = (np.arange(64) - 31.5) * 3.0 / 64
    np.save(tmp_path / "gap.npy", (0.03 * x**4 + 0.01 * x)[:, None])
    rows = [line.split(", ") for line in LINE_TABLE.splitlines()]
    rows = [[P, Qx, energy] for P, Qx, _, energy in rows]
    case = tmp_path / "case.yaml"
    case.write_text(template("resultants"), encoding="utf-8")
    overrides = [
        *SMALL, "structure.dimension=2", "structure.size=3", "contact.grid=[64, 8]",
        "structure.gap={shape: heights, file: gap.npy}",
    ]  # fmt: skip

    def worn(moments: list[str], name: str) -> dict[str, Any]:
        table = [",".join([*row, moment]) for row, moment in zip(rows, moments, strict=True)]
        (tmp_path / "loads.csv").write_text("\n".join(table), encoding="utf-8")
        return run(case, tmp_path / name, *overrides)["interface"]

    (tmp_path / "loads.csv").write_text("\n".join(map(",".join, rows)), encoding="utf-8")
    checked = command("check", case, overrides=overrides)
    assert "heights of gap.npy, tilt held" in checked.stdout, checked.stderr
    held = run(case, tmp_path / "held", *overrides)["interface"]
    with h5py.File(tmp_path / "held" / "results.h5") as file:
        My = file["contact/interface/My_unworn"][()].tolist()
    assert held["tilt"] == "held"
    assert held["holding_moment"]["unworn"] == pytest.approx(max(map(abs, My)), rel=1e-12)
    assert held["peak_load"]["unworn"]["My"] == pytest.approx(My[1], rel=1e-12)
    same, none = worn(["My", *map(repr, My)], "same"), worn(["My", "0", "0", "0"], "none")
    assert same["tilt"] == none["tilt"] == "free"
    pressure = held["peak_pressure"]["unworn"]
    assert same["peak_pressure"]["unworn"] == pytest.approx(pressure, rel=1e-6)
    assert none["peak_pressure"]["unworn"] != pytest.approx(pressure, rel=1e-3)


# --- our own loads as files ---------------------------------------------------------------------


@pytest.mark.parametrize(
    "settings",
    [
        ["structure.dimension=2", "contact.grid=[32, 8]", "contact.method=full"],
        slow(["contact.grid=[16, 24]"]),
    ],
    ids=["line, full", "area, given slips"],
)
def test_our_loads_through_files_wear_the_same_bit_for_bit(small_path, tmp_path, settings):
    fewer = "load_path.increments=[2, 4]", "wear.cycles=2e4"
    settings = [*settings, *fewer, "coupling.resultants=constant", *QUIET]
    assert command("resultants", small_path, "--out", tmp_path, overrides=settings).exit_code == 0
    original = run(small_path, tmp_path / "original", *settings)
    moved = tmp_path / "moved"
    moved.mkdir()
    for name in ("resultants.h5", "resultants.yaml"):
        shutil.move(tmp_path / name, moved / name)
    imported = run(moved / "resultants.yaml", tmp_path / "imported")
    with (
        h5py.File(tmp_path / "original" / "results.h5") as ours,
        h5py.File(tmp_path / "imported" / "results.h5") as read,
    ):
        for interface in ("intrados", "extrados"):
            last = max(ours["surfaces"][interface])
            assert last == max(read["surfaces"][interface]) == "00002"
            for body in ("body_1", "body_2"):
                key = f"surfaces/{interface}/{last}/{body}"
                assert ours[key][()].tobytes() == read[key][()].tobytes(), key
            reported = original["structure"]["closure"], original["structure"]["cycles"]
            assert tuple(ours[f"structure/{interface}"].attrs[k] for k in CLOSING) == reported
    assert f"the last of {reported[1]} cycles marched" in (tmp_path / "resultants.log").read_text()
    for interface in ("intrados", "extrados"):
        assert imported[interface]["depth_1"] > 0.0
        assert imported[interface]["slip_per_cycle"] == original[interface]["slip_per_cycle"]
        for reported in imported[interface]["worn_nodes"].values():
            assert reported["volume_share"] == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize(("closure", "reported"), [(9e-4, 0), (2e-3, 1)])
def test_loads_that_do_not_close_are_warned_of(tmp_path, closure, reported):
    rows = [f"{row}, {closure}" for row in LINE_TABLE.splitlines()[1:]]
    table = [f"{LINE_TABLE.splitlines()[0]}, closure", *rows]
    (tmp_path / "loads.csv").write_text("\n".join(table), encoding="utf-8")
    text = template("resultants").replace("dimension: 3", "dimension: 2")
    case = parse_case(text, str(tmp_path / "case.yaml"))
    reporter = Reporter(tmp_path / "log")
    warn_of_file(case, reporter)
    assert len(reporter.warnings) == reported
    assert all("0.20 % of the largest" in line for line in reporter.warnings)


@pytest.mark.slow
def test_our_table_is_read_by_a_case(small_path, written):
    """The CSV alone suffices, over the flank as a nominal face."""
    folder = written.parent / "ours"
    settings = ["contact.grid=[16, 24]", *QUIET]
    done = command("resultants", small_path, "--out", folder, overrides=settings)
    assert "RECIPE.md" in done.stdout
    case = load_case(written, [f"structure.file={folder / 'resultants.csv'}"])
    assert list(case.loads()) == ["intrados", "extrados"]
    again = command("resultants", small_path, "--out", folder, overrides=settings)
    assert (again.exit_code, again.stderr.count("\n")) == (2, 1)
    assert "exists; give another folder, or --force" in again.stderr
    forced = command("resultants", small_path, "--out", folder, "--force", overrides=settings)
    assert forced.exit_code == 0
