"""Tests of a body of own matrices that wears its contacts: closed forms, balances, a run."""

import csv
import json
from functools import partial
from pathlib import Path

import h5py
import numpy as np
import pytest
import pyvista
from numpy.polynomial import Chebyshev
from scipy.integrate import solve_ivp

from fe_models.dynamics.periodic.cycle_energy import energy_lost, work_done
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.periodic.load import PeriodicLoad
from fe_models.dynamics.rig import Link, lumped_rig, unit_force
from fe_models.joints.reduction import save_reduced
from fe_models.matrices import external_matrices, on_all
from tests.workflow.conftest import invoke
from tests.workflow.output.shown_files import check_arrays, check_scene, total
from tests.workflow.vibration.time_scenes import refused
from wear.joints.jenkins import Jenkins
from wear.joints.periodic.march import PeriodicMarch
from wear.laws import EnergyLaw
from wear.steps.marching import advance_cycles
from wear.steps.step_errors import step_errors
from wear.steps.steppers import HeunStepper
from workflow.analyses.vibration_wear.body import body_model
from workflow.analyses.vibration_wear.case import ReducedWearCase
from workflow.analyses.vibration_wear.nodes_run import resonance_that_wears
from workflow.analyses.vibration_wear.pads import WearingPads, worn_model
from workflow.kinds import parse_case
from workflow.models.vibration.structure import VibratingStructure
from workflow.shell.terminal.reporter import Reporter

# Three by three nodes on springs below a holder that is free along z; see matrices().
SIDE, PITCH, HOLDER_MASS = 3, 0.5, 1.2e-3
NODES, LOAD = SIDE * SIDE, 60.0
COEFFICIENTS = 1e-9, 2e-9
ROUNDING = 1e-12

BODY = """\
title: Holder on nine contacts
analysis: vibration
structure:
  kind: matrices
  matrices: {file: body.npz, units: {length: mm, force: N}}
  joints: [{points: pad, direction: -z}]
  damping_ratio: 0.01
  driven: {points: holder, direction: x}
  seen: {points: holder, direction: x}
joint:
  law: friction_contact
  normal_load: 60 N
  friction: 0.5
  stiffness: 45 N/um
  normal_stiffness: 60 N/um
  pressed: {points: holder, direction: -z}
  nodes: nodes.csv
wear:
  force: 60 N
  frequency: 300 Hz
  cycles: [2e5, 1e6]
  law: energy
  body_1: {coefficient: 1000 um^3/J}
  body_2: {coefficient: 2000 um^3/J}
forces: [20 N]
frequencies: [200 Hz, 900 Hz]
resolution: {harmonics: 3, samples: 64}
continuation: {longest_step: 0.4}
"""


def matrices():
    """Return stiffness, mass, names and places: the holder, and coupled pads below it."""
    points = ["holder", *(f"pad {k + 1}" for k in range(NODES))]
    grid = PITCH * np.array([(i, j, 0) for i in range(SIDE) for j in range(SIDE)], dtype=float)
    places = np.vstack([[PITCH, PITCH, 10.0], grid]) + np.array([100.0, 20.0, 5.0])
    of_axis = {"x": (2e4, 5e3), "y": (2e4, 5e3), "z": (4e4, 8e3)}
    K, M = np.zeros((3 * len(points),) * 2), np.zeros((3 * len(points),) * 2)
    for k, (to_holder, between) in enumerate(of_axis.values()):
        for a in range(1, len(points)):
            ends = [(0, to_holder)]
            near = np.linalg.norm(places[1:a] - places[a], axis=1) < 1.1 * PITCH
            ends += [(b + 1, between) for b in np.flatnonzero(near)]
            for b, stiffness in ends:
                pair = np.array([3 * a + k, 3 * b + k])
                K[np.ix_(pair, pair)] += stiffness * np.array([[1.0, -1.0], [-1.0, 1.0]])
    K[0, 0] += 1.4e3
    K[1, 1] += 5e3
    np.fill_diagonal(M, np.repeat([HOLDER_MASS, *[2e-6] * NODES], 3))
    names = [f"{point} {axis}" for point in points for axis in of_axis]
    return K, M, names, np.repeat(places, 3, axis=0)


AREAS = np.outer([0.5, 1.0, 0.5], [0.5, 1.0, 0.5]).ravel() * PITCH**2
# µm: so that corners are open at first, unlike each other.
GAPS = np.array([4.4, 1.6, 4.3, 1.5, 0.0, 1.4, 4.2, 1.7, 4.5])
ROWS = "".join(
    f"pad {k + 1},{area!r},{gap!r}\n"
    for k, (area, gap) in enumerate(zip(AREAS.tolist(), GAPS.tolist(), strict=True))
)
NODES_FILE = "point,area [mm^2],gap [um]\n" + ROWS


def as_texts():
    """Return the same as text: matrices, and unknowns with their places."""
    K, M, names, places = matrices()
    head = f"%%MatrixMarket matrix array real general\n{len(K)} {len(K)}\n"
    texts = {"k.mtx": K, "m.mtx": M}
    files = [
        (name, head + "".join(f"{value!r}\n" for value in matrix.ravel().tolist()))
        for name, matrix in texts.items()
    ]
    rows = (
        ",".join([*name.rsplit(" ", 1), *map(repr, place)])
        for name, place in zip(names, places.tolist(), strict=True)
    )
    unknowns = "\n".join(["point,direction,x,y,z", *rows, ""])
    return (*files, ("unknowns.csv", unknowns), ("nodes.csv", NODES_FILE))


IN_TEXT = (
    "structure.matrices={stiffness: k.mtx, mass: m.mtx, unknowns: unknowns.csv, "
    "units: {length: mm, force: N}}"
)


def write_body(folder):
    K, M, names, places = matrices()
    np.savez(folder / "body.npz", K=K, M=M, names=np.array(names), places=places)
    (folder / "nodes.csv").write_text(NODES_FILE, encoding="utf-8")


def case_of(folder, *overrides, text=BODY) -> ReducedWearCase:
    case = parse_case(text, str(folder / "case.yaml"), overrides)
    assert isinstance(case, ReducedWearCase)
    return case


def pads_of(case, folder, force=None, laws=None):
    reporter = Reporter(folder / "log")
    unworn: VibratingStructure = body_model(case, reporter)
    reporter.close()
    return WearingPads(unworn, laws or case.laws, force or case.wearing, case.wear.frequency)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("body")
    write_body(folder)
    return folder


@pytest.fixture(scope="module")
def pads(folder):
    return pads_of(case_of(folder), folder)


# --- a closed form -------------------------------------------------------------------------------

# One point held along z by a spring: its load falls as it wears.
POINT = """\
title: Point that a spring presses
analysis: vibration
structure:
  kind: matrices
  matrices: {file: point.npz, units: {length: mm, force: N}}
  joints: [{points: p, direction: -z}]
  damping_ratio: 0.02
  driven: {points: p, direction: x}
  seen: {points: p, direction: x}
joint:
  law: friction_contact
  normal_load: 30 N
  friction: 0.5
  stiffness: 20 N/um
  normal_stiffness: 30 N/um
  area: 0.5 mm^2
wear: {force: 20 N, frequency: 200 Hz, cycles: [1e5], law: energy, body_1: {coefficient: 0},
       body_2: {coefficient: 3000 um^3/J}}
forces: [20 N]
frequencies: [100 Hz, 300 Hz]
resolution: {harmonics: [1, 3], samples: 256}
"""
SPRINGS, MASS, KN, KT = (2e3, 2e3, 5e3), 1e-3, 30e3, 20e3
# µ = 0.5 on 30 N at first.
PRESSED, AREA, ALPHA = 30.0, 0.5, 3e-9
SERIES = KN * SPRINGS[2] / (KN + SPRINGS[2])


@pytest.fixture(scope="module")
def point(tmp_path_factory):
    folder = tmp_path_factory.mktemp("point")
    names = np.array(["p x", "p y", "p z"])
    np.savez(folder / "point.npz", K=np.diag(SPRINGS), M=np.eye(3) * MASS, names=names)
    return pads_of(case_of(folder, text=POINT), folder)


def dissipated(load):
    """Return a cycle's energy of a slider along one line at constant load, by another law."""
    rig = lumped_rig({"p": MASS}, {Link("p"): SPRINGS[0]}, [[Link("p")]], damping_ratio=0.02)
    law = PeriodicMarch(Jenkins(KT, 0.5, max(load, 0.0)))
    sine = PeriodicLoad({1: -1j * unit_force(rig, "p")})
    motion = HarmonicBalance(rig, law, sine, Resolution((0, 1, 3), 256)).solve(200.0, 20.0)
    assert motion.converged
    return float(motion.cycle.dissipated.sum())


def depth_after(cycles):
    """Integrate dw/dn = α e(N0 - K w) / A, with both springs in series.

    The load follows from the depth; e(N) is interpolated at Chebyshev's points, as it is smooth
    while everything slides.
    """
    energy = Chebyshev.interpolate(lambda loads: [*map(dissipated, loads)], 10, (LEAST, PRESSED))

    def rate(_, depth):
        return ALPHA * energy(PRESSED - SERIES * depth) / AREA

    return float(solve_ivp(rate, (0.0, cycles), [0.0], rtol=1e-10, atol=1e-14).y[0, -1])


CYCLES, LEAST = 6e5, 15.0


def test_a_point_that_a_spring_presses_wears_as_its_equation_says(point):
    """Steps converge with their square; their reported error is right within a factor of 2."""
    exact = depth_after(CYCLES)
    # A third of the load is gone.
    assert 0.3 < SERIES * exact / PRESSED < 1.0 - LEAST / PRESSED
    errors = []
    for count in (2, 4, 8):
        state, stepper = point.begin(), HeunStepper(tolerance=np.inf, share=np.inf)
        for _ in range(count):
            state = stepper.step(state, CYCLES / count, CYCLES, point.contact_at).state
        errors.append(state.surfaces.depth[0] / exact - 1.0)
        reported = step_errors(state, point.at(state).areas)["depth"]
        assert abs(errors[-1]) / 2.0 < reported < 2.0 * abs(errors[-1])
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all((orders > 1.7) & (orders < 2.5)), orders
    cycle = point.at(state)
    force = cycle.model.rest.cycle.samples[0, 0, 2]
    assert force == pytest.approx(PRESSED - SERIES * state.surfaces.depth[0], rel=1e-8)


# --- balances ------------------------------------------------------------------------------------


def test_volume_energy_and_work_balance(pads):
    """V = α ΣE for either body; the force's work is lost in joints and damping."""
    state = advance_cycles(HeunStepper(0.1), pads.begin(), 1e6, 1e6, pads.contact_at).state
    cycle = pads.at(state)
    volumes = [float(depth @ cycle.areas) for depth in state.surfaces.depths]
    np.testing.assert_allclose(volumes, np.multiply(COEFFICIENTS, state.energy), rtol=ROUNDING)
    pressed = cycle.model.rest.cycle.samples[0, :, 2]
    assert pressed.sum() == pytest.approx(LOAD, rel=1e-8)
    begun = pads.at(pads.begin())
    assert begun.model.touching.sum() < cycle.model.touching.sum() <= NODES
    left = []
    for samples in (64, 128, 256):
        problem = cycle.model.problem.with_resolution(Resolution((0, 1, 3, 5), samples))
        motion = problem.solve(300.0, 60.0, cycle.motion)
        left.append(abs(work_done(problem, motion) / energy_lost(problem, motion) - 1.0))
    assert left[0] < 1e-2
    assert left[-1] < 0.2 * left[0]


def test_a_load_on_the_contacts_is_that_on_what_presses_them(folder, tmp_path):
    """With equal areas and no gaps, pressing the body or each contact gives the same.

    As the pads are equal except for their neighbours, springs between them carry nothing.
    """
    for place in ("body.npz", "nodes.csv"):
        (tmp_path / place).write_bytes((folder / place).read_bytes())
    even = ("joint.nodes=", "joint.area=2.25 mm^2")
    through = pads_of(case_of(tmp_path, *even), tmp_path)
    by_each = pads_of(case_of(tmp_path, *even, "joint.pressed="), tmp_path)
    depths = []
    for pads in (through, by_each):
        state = pads.begin()
        for _ in range(2):
            state = pads.contact_at(state).explicit_step(state, 2e4).state
        cycle = pads.at(state)
        depths.append(np.append(state.surfaces.depth, cycle.energy))
    np.testing.assert_allclose(depths[0], depths[1], rtol=1e-7)


def test_a_stored_reduced_body_wears_as_its_matrices(pads, folder):
    """The other kind of structure has its places in its file."""
    save_reduced(folder / "body.h5", on_all(external_matrices({}, folder / "body.npz")))
    own = case_of(folder)
    kept = ("joints", "damping_ratio", "driven", "seen")
    entries = own.structure.model_dump(include=set(kept), exclude_none=True)
    stored = {"kind": "reduced", "file": "body.h5", **entries}
    case = case_of(folder, "structure=" + json.dumps(stored))
    assert case.structure.kind == "reduced"
    other = pads_of(case, folder)
    np.testing.assert_array_equal(other.unworn.rig.places, pads.unworn.rig.places)
    expected, depths = (
        each.contact_at(each.begin()).explicit_step(each.begin(), 1e5).state.surfaces.depths
        for each in (pads, other)
    )
    np.testing.assert_allclose(depths, expected, rtol=1e-9)


def test_nothing_wears_where_one_body_is_given_none(pads):
    only = WearingPads(pads.unworn, (EnergyLaw(0.0), EnergyLaw(1e-9)), 60.0, 300.0)
    state = only.begin()
    after = only.contact_at(state).explicit_step(state, 1e4).state
    assert not after.surfaces.depth_1.any()
    assert after.surfaces.depth_2.any()


def test_wear_alike_everywhere_lowers_the_body_and_nothing_else(pads):
    """All contacts of the starting motion may even be open on the worn body.

    Newton's method then moved the bodies so far apart that rounding hid the unbalanced load.
    """
    begun = pads.at(pads.begin())
    deep = 1.1 * float(begun.motion.coefficients[:, 0, 2].max())
    problem = worn_model(pads.unworn, np.full(NODES, deep)).problem
    motion = problem.solve(300.0, 60.0, begun.motion)
    assert motion.converged
    np.testing.assert_allclose(motion.cycle.dissipated, begun.energy, atol=1e-8)
    lowered = motion.coefficients[:, 0, 2] - begun.motion.coefficients[:, 0, 2]
    np.testing.assert_allclose(lowered, deep, rtol=1e-8)


# --- at resonance --------------------------------------------------------------------------------


def test_wear_follows_the_resonance(folder):
    """The holder lags its force by a quarter of a period, in every state."""
    case = case_of(folder, "wear.frequency=", "wear.at_resonance=true", "wear.force=20 N")
    assert dict(case.outline())["worn by"] == "20 N at resonance"
    reporter = Reporter(folder / "log")
    unworn = body_model(case, reporter)
    reporter.close()
    search = partial(resonance_that_wears, case)
    pads = WearingPads(unworn, case.laws, 20.0, None, search=search)
    state, frequencies = pads.begin(), []
    for _ in range(3):
        motion = pads.at(state).motion
        first = motion.motion[motion.resolution.harmonics.index(1), 0]
        # The force is Re (-i) exp(iωt): a quarter later is -1.
        assert abs(first.imag) < 1e-8 * abs(first)
        assert first.real < 0.0
        frequencies.append(motion.frequency)
        state = pads.contact_at(state).explicit_step(state, 2e5).state
    # It moves with the contact, and is that of a response found without the states before.
    assert abs(frequencies[2] / frequencies[0] - 1.0) > 1e-3
    assert search(pads.at(state).model.problem).frequency == pytest.approx(
        pads.at(state).motion.frequency, rel=1e-6
    )


# --- a whole run ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def ended(folder):
    (folder / "case.yaml").write_text(BODY, encoding="utf-8")
    quiet = "output={figures: false}"
    done = invoke("run", folder / "case.yaml", "--out", folder / "out", "--set", quiet)
    assert done.exit_code == 0, done.output
    return folder / "out"


def test_a_run_leaves_nodes_in_tables_results_and_paraview(ended):
    summary = json.loads((ended / "summary.json").read_text(encoding="utf-8"))
    assert summary["volume_per_energy"] == pytest.approx(3e-9, rel=ROUNDING)
    last = summary["states"][-1]
    balance = last["energy_per_cycle"] + last["damped_per_cycle"]
    assert last["work_per_cycle"] == pytest.approx(balance, rel=1e-2)
    with h5py.File(ended / "results.h5") as file:
        names = [name.decode() for name in file["places/name"][()]]
        assert names == [f"pad {k + 1}" for k in range(NODES)]
        nodes = {name: values[()] for name, values in file["worn/00002/nodes"].items()}
        assert nodes["energy"].sum() == pytest.approx(last["energy_per_cycle"], rel=ROUNDING)
        assert (nodes["depth_1"] + nodes["depth_2"]) @ AREAS == pytest.approx(
            last["volume"], rel=ROUNDING
        )
    with (ended / "nodes_00002.csv").open(newline="", encoding="utf-8") as table:
        rows = list(csv.DictReader(table))
    assert [row["point"] for row in rows] == names
    np.testing.assert_allclose([float(row["energy [N mm]"]) for row in rows], nodes["energy"])
    np.testing.assert_allclose(
        [float(row["position_x [mm]"]) for row in rows[::3]], [100, 100.5, 101]
    )
    folder = ended / "paraview"
    check_arrays(folder)
    check_scene(folder / "view.py")
    assert pyvista.PVDReader(folder / "contact.pvd").time_values == [0.0, 2e5, 1e6]
    face = pyvista.read(folder / "contact" / "00002.vtu")
    assert face.n_cells == (SIDE - 1) ** 2
    np.testing.assert_allclose(face.points, matrices()[3][3::3], rtol=1e-6)
    assert total(face, "pressure [MPa]") == pytest.approx(LOAD, rel=1e-6)
    assert total(face, "depth [mm]") == pytest.approx(last["volume"], rel=1e-6)
    assert total(face, "cycle_energy [N/mm]") == pytest.approx(last["energy_per_cycle"], rel=1e-6)
    # Body 1 is below: it wears downwards, body 2 upwards.
    for body, sign in ((1, -1.0), (2, 1.0)):
        worn = sign * nodes[f"depth_{body}"][:, None] * [0.0, 0.0, 1.0]
        np.testing.assert_allclose(face[f"worn_{body} [mm]"], worn, rtol=1e-6)


# --- refusals ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("overrides", "named"),
    [
        (["joint.nodes="], "joint.area"),
        (["joint.area=1 mm^2"], "joint.area"),
        (["joint.pressed="], "pressed"),
        (["wear.frequency="], "wear.frequency"),
        (["wear.at_resonance=true"], "at_resonance"),
        (["joint.friction=0"], "joint.friction"),
        (["wear.cycles=[10, 5]"], "wear.cycles"),
    ],
)
def test_wrong_entries_are_named(folder, overrides, named):
    code, message = refused(folder, BODY, *overrides)
    assert code == 2
    assert named in message


@pytest.mark.parametrize(
    ("before", "after", "place"),
    [
        ("pad 9,", "pad 8,", "nodes.csv:10: point: pad 8"),
        ("pad 9,", "pad 10,", "nodes.csv:10: point: pad 10"),
        (ROWS.splitlines()[-1], "", "pad 9"),
        ("area [mm^2]", "area [mm]", "nodes.csv:1: area"),
    ],
)
def test_wrong_tables_of_nodes_are_refused(tmp_path, before, after, place):
    write_body(tmp_path)
    assert before in NODES_FILE
    (tmp_path / "nodes.csv").write_text(NODES_FILE.replace(before, after), encoding="utf-8")
    code, message = refused(tmp_path, BODY)
    assert code == 2
    assert place in message
