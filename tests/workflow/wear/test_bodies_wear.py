"""Tests of two bodies that wear without a structure: the case, its loads, and its results."""

import json
import pickle
import re
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from tests.marks import slow
from tests.workflow.command_line import command
from wear.contact.interface import InterfaceState
from workflow.analyses.wear.structures.bodies.case import BodiesWearCase, LineBodiesWearCase
from workflow.analyses.wear.structures.bodies.model import source_of
from workflow.analyses.wear.structures.resultants.reading import read_resultants
from workflow.analyses.wear.translation import face_contact
from workflow.case.text.writing import dump_case
from workflow.errors import CaseError
from workflow.kinds import parse_case, template
from workflow.models.contact import FaceContact

CASES = Path(__file__).parents[3] / "cases"
AREA, LINE = template("bodies_wear"), template("line_wear")
FLAT = "{kind: bodies, shape: flat, half_width: 0.2, half_length: 0.1, step: 5 um}"
STRIP = "{kind: bodies, shape: flat, half_width: 0.2}"
SMALL = ["contact.grid=[40, 40]", "load_path={P: 50 N, stroke: 50 um, increments: 1}"]


def area(*overrides: str) -> BodiesWearCase:
    case = parse_case(AREA, "area.yaml", [*SMALL, *overrides])
    assert isinstance(case, BodiesWearCase)
    return case


def line(*overrides: str) -> LineBodiesWearCase:
    case = parse_case(LINE, "line.yaml", ["contact.grid=[80, 1]", *overrides])
    assert isinstance(case, LineBodiesWearCase)
    return case


def worn(
    case: BodiesWearCase | LineBodiesWearCase, jumps: int = 4
) -> tuple[FaceContact, InterfaceState]:
    """Return the contact after the cycles of the case, computed in this process."""
    source = source_of(case)
    stage = face_contact(case, source.faces[0])
    state, _ = stage.contact.begin(source.unworn()[0], case.wear.cycles)
    for jump in range(jumps):
        left = case.wear.cycles * (1.0 - jump / jumps)
        state, _ = stage.contact.jump(state, case.wear.cycles / jumps, left)
    return stage, state


# --- the case -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "override", "kind"),
    [
        (AREA, "structure.radius=1 m", BodiesWearCase),
        (AREA, f"structure={FLAT}", BodiesWearCase),
        (LINE, "structure.radius=1 m", LineBodiesWearCase),
        (LINE, f"structure={STRIP}", LineBodiesWearCase),
    ],
)
def test_shape_and_size_decide_whether_bodies_touch_along_a_line(text, override, kind) -> None:
    case = parse_case(text, "case.yaml", [override])
    assert isinstance(case, kind)
    assert parse_case(dump_case(case), "dump") == case


def test_heights_must_suit_the_grid(tmp_path: Path) -> None:
    np.save(tmp_path / "gap.npy", np.zeros((30, 40)))
    heights = "structure={kind: bodies, shape: heights, file: gap.npy}"
    with pytest.raises(CaseError, match=r"allowed: \[30, 40\]"):
        parse_case(AREA, str(tmp_path / "case.yaml"), [*SMALL, heights])


# --- the loads ----------------------------------------------------------------------------------


def test_a_cycle_goes_there_and_back() -> None:
    """The motion has constant speed along the direction and is closed; friction opposes it."""
    case = area("load_path.increments=3", "load_path.direction=30 deg", "friction.coefficient=0.5")
    source = source_of(case)
    motion = source.motion
    np.testing.assert_allclose(np.hypot(*motion.T), 0.05 / 3, rtol=1e-12)
    np.testing.assert_allclose(motion.sum(axis=0), 0.0, atol=1e-15)
    np.testing.assert_allclose(motion[:, 1], np.tan(np.pi / 6) * motion[:, 0], rtol=1e-12)
    loads = source.unworn()[0].loads
    np.testing.assert_allclose(np.hypot(loads.Qx, loads.Qy), 0.5 * 50.0, rtol=1e-12)
    assert np.all(loads.Qx * motion[:, 0] + loads.Qy * motion[:, 1] < 0.0)
    # Energy of gross sliding: 4 amplitudes, two strokes, of µ P.
    assert (loads.Edx + loads.Edy).sum() == pytest.approx(2 * 0.05 * 25.0, rel=1e-12)
    assert source.unworn()[0].slip.shape == (6, 2, 4)
    np.testing.assert_array_equal(source.probe([])[0, :3], [50.0, loads.Qx[1], loads.Qy[1]])
    # Friction that has changed with wear.
    (later,) = source.worn([], [0.7])
    np.testing.assert_allclose(later.loads.Edx, 1.4 * loads.Edx, rtol=1e-12)
    np.testing.assert_array_equal(later.slip, source.unworn()[0].slip)


def test_faces_travel_to_the_processes_of_contacts() -> None:
    for case in (area(), area(f"structure={FLAT}"), line(), line(f"structure={STRIP}")):
        (face,) = source_of(case).faces
        again = pickle.loads(pickle.dumps(face))
        grid = again.grid(case.contact.grid)
        np.testing.assert_array_equal(again.gap(grid.x, grid.y), face.gap(grid.x, grid.y))
        assert again.drive.motion[1]


def test_a_flat_stands_on_its_step() -> None:
    (face,) = source_of(area(f"structure={FLAT}")).faces
    grid = face.grid((40, 40))
    gap = face.gap(grid.x, grid.y)
    assert set(np.unique(gap)) == {0.0, 0.005}
    assert np.count_nonzero(gap == 0.0) * grid.cell_area == pytest.approx(0.4 * 0.2, rel=1e-9)


# --- wear ---------------------------------------------------------------------------------------


def test_volume_is_what_sliding_that_far_wears() -> None:
    """Either body loses V = α µ P 2 s N, whatever the shape."""
    case = area("wear.cycles=1000", "wear.body_2.coefficient=3e3 um^3/J")
    stage, state = worn(case)
    sliding = case.friction.coefficient * 50.0 * 2.0 * 0.05 * 1000.0
    for depth, coefficient in ((state.surfaces.depth_1, 1e-8), (state.surfaces.depth_2, 3e-9)):
        volume = depth.sum() * stage.grid.cell_area
        assert volume == pytest.approx(coefficient * sliding, rel=1e-9)
    assert state.energy == pytest.approx(sliding, rel=1e-9)


def test_heights_of_a_cylinder_wear_as_the_cylinder(tmp_path: Path) -> None:
    case = line("wear.cycles=1000")
    (face,) = source_of(case).faces
    grid = face.grid(case.contact.grid)
    np.save(tmp_path / "gap.npy", face.gap(grid.x, grid.y))
    heights = "structure={kind: bodies, shape: heights, file: gap.npy}"
    overrides = ["contact.grid=[80, 1]", "wear.cycles=1000", heights]
    same = parse_case(LINE, str(tmp_path / "case.yaml"), overrides)
    assert isinstance(same, LineBodiesWearCase)
    np.testing.assert_array_equal(worn(same)[1].surfaces.depth_2, worn(case)[1].surfaces.depth_2)


def test_direction_turns_what_wears() -> None:
    """Wear along y equals wear along x, turned, for a stroke that is not small."""
    overrides = "wear.cycles=200", "load_path.stroke=0.2 mm", "load_path.P=20 N"
    along_x = worn(area(*overrides))[1].surfaces
    along_y = worn(area(*overrides, "load_path.direction=90 deg"))[1].surfaces
    for name in ("depth_1", "depth_2"):
        x, y = getattr(along_x, name), getattr(along_y, name)
        np.testing.assert_allclose(y, x.T, atol=1e-7 * x.max())
    # The scar on body 1 is longer than that on body 2, by the stroke.
    lengths = [
        np.count_nonzero(depth.any(axis=1)) / 40.0 for depth in (along_x.depth_1, along_x.depth_2)
    ]
    assert lengths[0] - lengths[1] == pytest.approx(0.2, abs=2.1 / 40.0)


def test_following_the_motion_can_be_forced() -> None:
    """Automatic mode follows the motion if the stroke exceeds a fiftieth of the first contact."""
    overrides = "wear.cycles=200", "load_path.P=20 N"
    for stroke, automatic in (("0.2 mm", "follow"), ("4 um", "neglect")):
        given = [*overrides, f"load_path.stroke={stroke}"]
        depths = {
            chosen: worn(area(*given, f"wear.motion={chosen}"))[1].surfaces.depth_1
            for chosen in ("auto", "follow", "neglect")
        }
        np.testing.assert_array_equal(depths["auto"], depths[automatic])
        assert np.abs(depths["follow"] - depths["neglect"]).max() > 0.0


def test_the_flat_wears_as_the_punch_passes_over_it() -> None:
    """A strip that does not wear itself wears the flat by the trapezoid of its uniform pressure.

    The bodies conform, p = P/2a. The flat is then worn by p times the share of the stroke that the
    strip is over it: fully in the middle, by half below the strip's edges in its middle position,
    and not at all a + s/2 away.
    """
    case = line(
        f"structure={STRIP}",
        *("load_path.P=20 N/mm", "load_path.stroke=0.1 mm", "load_path.increments=8"),
        *("wear.body_2.coefficient=0", "wear.cycles=400", "wear.motion=follow"),
    )
    stage, state = worn(case, 16)
    x, depth = stage.grid.x.ravel(), state.surfaces.depth_1.ravel()
    reach = np.abs(x[depth > 0.0]).max() + 0.5 * stage.grid.pitch[0]
    assert reach == pytest.approx(0.25, abs=1.01 * stage.grid.pitch[0])
    volume = 1e-8 * case.friction.coefficient * 20.0 * 0.2 * 400.0
    assert depth.sum() * stage.grid.pitch[0] == pytest.approx(volume, rel=1e-9)
    assert not state.surfaces.depth_2.any()


def test_wear_beyond_the_grid_is_refused_with_the_remedy() -> None:
    from wear.steps.stepping import ContactFailure

    case = area("load_path.stroke=0.9 mm", "wear.cycles=10", "load_path.increments=2")
    with pytest.raises(ContactFailure, match="grid along x"):
        worn(case, 1)


def test_partial_slip_over_a_given_stroke_is_that_of_mindlin() -> None:
    """Method full finds stroke and energy of Mindlin and Deresiewicz's loop at Q = 0.75 µP.

    cases/sphere_fretting.yaml has the closed forms: an amplitude of 6.69523 µm dissipates 0.414092
    N mm per cycle; they neglect the transverse shear, 2 %.
    """
    case = area(
        *("load_path.P=400 N", "load_path.stroke=13.39046 um", "load_path.increments=4"),
        *("friction.coefficient=0.7", "contact.method=full", "wear.cycles=1"),
    )
    source = source_of(case)
    stage = face_contact(case, source.faces[0])
    _, first = stage.contact.begin(source.unworn()[0], case.wear.cycles)
    assert first.energy.sum() == pytest.approx(0.414092, rel=2e-2)
    forces = [state.resultants[1] for state in first.cycle]
    assert max(forces) == pytest.approx(210.0, rel=2e-2)
    assert min(forces) == pytest.approx(-max(forces), rel=1e-3)
    # Body 2 is pulled along x on the way there: friction holds it back.
    assert forces[3] == min(forces)


# --- the run ------------------------------------------------------------------------------------


def run(case: Path, out: Path, *overrides: str) -> dict[str, Any]:
    done = command("run", case, "--out", out, overrides=["output.figures=false", *overrides])
    assert done.exit_code == 0, done.stderr
    summary: dict[str, Any] = json.loads((out / "summary.json").read_text("utf-8"))
    return summary


def test_a_run_writes_what_every_wear_run_does(tmp_path: Path) -> None:
    summary = run(
        *(CASES / "cylinder_wear.yaml", tmp_path / "out"),
        *("wear.cycles=1e5", "wear.step.cycles=5e4", "contact.grid=[64, 1]"),
        "stress={section: x, life: {parameter: ruiz}}",
    )
    interface = summary["interface"]
    assert summary["per_length"] is True
    # µ P 2s = 0.5 N mm/mm a cycle.
    assert interface["volume_1"] == pytest.approx(5e-9 * 0.5 * 1e5, rel=1e-9)
    assert interface["energy_per_cycle"]["half_space"] == pytest.approx(0.5, rel=1e-9)
    assert {"results.h5", "case.yaml", "run.log"} <= {p.name for p in (tmp_path / "out").iterdir()}


@pytest.mark.parametrize("dimension", [2, slow(3)])
def test_moments_that_hold_the_tilt_are_results(dimension: int, tmp_path: Path) -> None:
    """A cylinder or a ball moves over its groove under moments that are results, not loads.

    Read as loads of another code, they hold the tilt.
    """
    text, small = (LINE, "contact.grid=[64, 1]") if dimension == 2 else (AREA, SMALL[0])
    case = tmp_path / "case.yaml"
    case.write_text(text, encoding="utf-8")
    overrides = [
        *(small, "wear.cycles=2000", "wear.step.cycles=1000", "load_path.stroke=0.1 mm"),
        *("load_path.P=20", "wear.motion=follow", "stress.section=none"),
        *("stress.life.parameter=none", "output.paraview=false"),
    ]
    own = run(case, tmp_path / "held", *overrides)["interface"]
    assert own["tilt"] == "held"
    assert own["holding_moment"]["unworn"] < 1e-9 * 20.0 < own["holding_moment"]["worn"]
    assert "tilt held" in command("check", case).stdout
    with h5py.File(tmp_path / "held" / "results.h5") as file:
        assert not {"Mx", "My"} & file["structure/interface/load_history"].keys()
        moments = {name: file["contact/interface"].get(f"{name}_worn") for name in ("Mx", "My")}
        assert (moments["Mx"] is None) == (dimension == 2)
        assert moments["My"].attrs["unit"] == ("N mm" if dimension == 3 else "N mm/mm")
        My = moments["My"][()]
    assert np.abs(My).max() == pytest.approx(own["holding_moment"]["worn"], rel=1e-6)
    # Body 2 stands at x > 0 of its groove half of the time, and then presses on the rim there.
    assert My.max() > 0.5 * np.abs(My).max()
    assert -My.min() > 0.5 * np.abs(My).max()
    (again,) = read_resultants(
        f"{tmp_path / 'held' / 'results.h5'}:structure", dimension == 2
    ).values()
    assert again.tilt == "held"
    free = run(case, tmp_path / "free", *overrides, "load_path.tilt=free")["interface"]
    assert free["tilt"] == "free"
    assert "holding_moment" not in free
    assert free["depth_1"] > 1.002 * own["depth_1"]


def test_a_loop_on_worn_surfaces_keeps_the_tilt_too() -> None:
    for tilt, moments in (("held", None), ("free", (0.0, 0.0))):
        case = line(f"load_path.tilt={tilt}", "loops.amplitude=1 um")
        stage = face_contact(case, source_of(case).faces[0])
        state, _ = stage.contact.begin(source_of(case).unworn()[0], 1.0)
        path = case.loops.described().path(stage.name, state, 0, stage.settings.drive.tilt)
        assert path.moments == moments


# --- what wear steps leave ------------------------------------------------------------------------


def worn_over_50_um(folder: Path, step: str) -> tuple[dict[str, Any], list[str]]:
    """Return the interface of a cylinder that slides over 50 µm, and the warnings of the run."""
    folder.mkdir()
    (folder / "case.yaml").write_text(LINE)
    steel = [f"materials.body_{n}={{young: 200 GPa, poisson: 0.3}}" for n in (1, 2)]
    done = command(
        *("run", folder / "case.yaml", "--out", folder / "out"),
        overrides=[
            "output={figures: false, paraview: false}",
            "load_path={P: 18.5 N/mm, stroke: 50 um, increments: 2}",
            *("structure.radius=6 mm", "contact.size=0.8 mm", "contact.grid=[100, 1]"),
            *("wear.cycles=18000", f"wear.step={step}", "stress={section: none}"),
            *("friction.coefficient=0.9", *steel),
            *("wear.body_1={law: archard, specific_wear_rate: 2.9e-8 mm^2/N}",),
            *("wear.body_2={law: archard, specific_wear_rate: 1.9e-8 mm^2/N}",),
        ],
    )
    assert done.exit_code == 0, done.output
    summary = json.loads((folder / "out" / "summary.json").read_text())
    return summary["interface"], summary["warnings"]


@pytest.mark.slow
def test_a_run_estimates_the_pressure_error_of_its_steps(tmp_path) -> None:
    """Long steps cause pressure peaks at the worn edges, and the advised setting removes them.

    160 steps of second order give 151.9 MPa to 2 %; more increments give less.
    """
    step, errors = "{kind: implicit, cycles: 6000}", []
    for number in range(2):
        interface, warnings = worn_over_50_um(tmp_path / str(number), step)
        left, peak = interface["step_error"]["pressure"], interface["peak_pressure"]["worn"]
        errors.append(abs(peak / 151.9 - 1.0))
        assert left / 3.0 < errors[-1] < 3.0 * left
        warned = [line for line in warnings if "of the worn peak pressure" in line]
        assert bool(warned) == (left > 0.1)
        if warned:
            step = re.search(r"wear\.step: (\{.*\})\) \[FS-W303\]$", warned[0])[1]
            assert "second_order" in step
    assert errors[1] < 0.6 * errors[0]
