"""Works measured by `docs/cost_charts.py`: one work of one size, alone in this process.

    python docs/cost_works.py WORK SIZE [--prepare]

prints as JSON the size, the processor seconds, the counted quantity, and the peak memory above that
of the loaded program, in GB. The same work is first done in small, which loads modules and compiles
loops. Contacts are computed at least twice, since the first time sets up their transforms, and the
smallest time counts. With ``--prepare`` the condensed structure that a work needs is written to the
cache, and nothing is measured.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
from skfem import MeshTet

from fe_models.dynamics.curves.curve_steps import ContinuationControl
from fe_models.dynamics.curves.forced_response import along_frequency
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.geometry.imported import ImportedMesh
from fe_models.imported_structure import ContactPair, Support, imported_mesh, imported_structure
from fe_models.joints.friction import FrictionalJoint
from fe_models.loads.applied_loads import BoundaryForce, Pressure
from fe_models.meshes.structure_mesh import Body
from fe_models.structure import Structure
from sa_solver import (
    ContactLoad,
    ElasticPair,
    FrictionalContact,
    Grid,
    HalfSpace,
    Material,
    NormalContact,
)
from sa_solver.reference.hertz import HertzSphere
from sa_solver.transforms import passes as loops
from workflow.analyses.vibration.case.vibration_case import VibrationCase
from workflow.analyses.vibration.model import vibration_model
from workflow.analyses.wear.structures.dovetail.model import dovetail_joint
from workflow.analyses.wear.translation import structure_loads
from workflow.kinds import load_case
from workflow.models.structure import StructureLoads
from workflow.shell.terminal.reporter import Reporter

CASES = Path(__file__).parent.parent / "cases"
TITANIUM, FRICTION = Material(115e3, 0.29), 0.5
ALIKE, UNLIKE = ElasticPair(TITANIUM, TITANIUM), ElasticPair(Material(np.inf, 0.3), TITANIUM)
# Contacts that take less than LONG seconds are computed again, because the first time sets up the
# transforms; within SHORT seconds they are repeated, up to TRIES times.
LONG, SHORT, TRIES = 200.0, 2.0, 5
AGAIN = ("normal", "friction", "unlike")
# Ratio of the contact radius to half the grid's width, and of the shear load to µP.
CONTACT_SHARE, SHEAR_SHARE = 0.6, 0.75
# Number of nodes across and along a flank of the default dovetail.
FLANK = np.array([20, 34])
# Number of nodes along a side of the blocks of a stack, and its cycle of four increments.
SIDE, PATH = 16, np.array([[1.0, 0.5], [1.0, 1.0], [1.0, 0.0], [1.0, -1.0]])
# The shipped rig: nodes along a side of its pads less one, odd harmonics, force [N], span [Hz].
PAD, ODD, FORCE, SPAN = 10, 5, 10.0, (50.0, 500.0)
STEPS = ContinuationControl(most=0.1)


class Sized(NamedTuple):
    """Work to be measured, with its size; calling it returns the counted quantity."""

    size: int
    run: Callable[[], int]


# --- contacts -----------------------------------------------------------------------------------


def normal(cells: int) -> Sized:
    """Press a sphere on ``cells`` cells along each side, from a cold start; count convolutions."""
    height, half_space, hertz = _sphere(cells, ALIKE)
    contact = NormalContact(half_space)
    return Sized(cells, lambda: contact.solve(height, hertz.load).convolutions)


def friction(cells: int, pair: ElasticPair = ALIKE) -> Sized:
    """Press a sphere, then shear it by three quarters of the friction limit; count convolutions."""
    height, half_space, hertz = _sphere(cells, pair)
    contact = FrictionalContact(half_space, FRICTION)

    def run() -> int:
        state, count = contact.unloaded_state(height), 0
        for share in (0.0, SHEAR_SHARE):
            load = np.array([1.0, share * FRICTION, 0, 0, 0, 0]) * hertz.load
            state = contact.advance(state, height, ContactLoad(load))
            assert state.converged, state.message
            count += state.convolutions
        return count

    return Sized(cells, run)


def _sphere(cells: int, pair: ElasticPair) -> tuple[Any, HalfSpace, HertzSphere]:
    hertz = HertzSphere(400.0, 10.0, pair.contact_modulus)
    width = 2.0 * hertz.contact_radius / CONTACT_SHARE
    grid = Grid.covering((width, width), (cells, cells))
    return hertz.gap(grid.x, grid.y), HalfSpace(grid, pair), hertz


# --- structures ---------------------------------------------------------------------------------


def condensation(nodes: int) -> Sized:
    """Condense the default dovetail with ``nodes`` nodes across each flank; count unknowns."""
    stage = _dovetail(nodes)
    bodies = stage.mesh.bodies

    def run() -> int:
        stage.prepare()
        return 3 * sum(body.mesh.nvertices for body in bodies)

    return Sized(stage.interface_count(), run)


def missions(nodes: int) -> Sized:
    """Solve both missions of the dovetail, 22 increments with friction; count iterations."""
    stage = _dovetail(nodes)
    structure, joint, model = stage.structure, stage.joint, stage.model
    cycle = partial(structure.solve_cycle, joint, model.load_cycles[0].amplitudes, structure.gap())

    def run() -> int:
        solution = cycle(stage.friction[0])
        assert solution.converged
        return solution.iterations

    return Sized(stage.interface_count(), run)


def stack(bodies: int) -> Sized:
    """Press and shear ``bodies`` stacked blocks with friction; count unknowns."""
    structure = _stack(bodies)

    def run() -> int:
        joint = FrictionalJoint(structure.condense().resolvent(), FRICTION)
        cycle = structure.solve_cycle(joint, PATH, structure.gap(), FRICTION)
        assert cycle.converged
        return sum(body.elastic.size for body in structure.bodies)

    return Sized(bodies, run)


def _stack(bodies: int) -> Structure:
    side, names = np.linspace(0.0, 12.0, SIDE), [f"block_{k}" for k in range(bodies)]
    meshes, pairs = {}, []
    for k, name in enumerate(names):
        z = np.linspace(6.0 * k, 6.0 * (k + 1), SIDE // 2 + 1)
        ends = {
            f"{name}_{end}": lambda p, at=at: np.isclose(p[2], at)
            for end, at in (("low", z[0]), ("high", z[-1]))
        }
        meshes[name] = Body(name, MeshTet.init_tensor(side, side, z).with_boundaries(ends))
    for k, (one, two) in enumerate(pairwise(names)):
        faces = [f"{one}_high"], [f"{two}_low"]
        pairs.append(ContactPair(f"contact_{k}", (one, two), *faces, np.array([1.0, 0.0, 0.0])))
    numbers = {name: np.arange(body.mesh.nvertices) for name, body in meshes.items()}
    imported = ImportedMesh(meshes, numbers, {name: {} for name in names})
    held, top = [Support(f"{names[0]}_low", "xyz")], f"{names[-1]}_high"
    loads = [Pressure(top, 50.0), BoundaryForce(top, np.array([200.0, 0.0, 0.0]))]
    mesh = imported_mesh(imported, names, pairs, held)
    return imported_structure(mesh, imported, [TITANIUM] * bodies, held, loads, 1)


def _dovetail(nodes: int) -> StructureLoads:
    along = round(nodes * FLANK[1] / FLANK[0])
    mesh = f"mesh={{flank_nodes: [{nodes}, {along}], size: 5 mm, notch: 48, order: 1}}"
    case: Any = load_case(CASES / "dovetail.yaml", [mesh])
    return structure_loads(case, dovetail_joint)


# --- vibration ----------------------------------------------------------------------------------


def harmonics(odd: int) -> Sized:
    """Compute a response of the rig's 121 contacts with ``odd`` odd harmonics; count points."""
    return Sized(odd, partial(_response, _rig(PAD), odd))


def contacts(elements: int) -> Sized:
    """Compute such a response with five odd harmonics and ``elements`` elements along each pad."""
    problem = _rig(elements)
    return Sized((elements + 1) ** 2, partial(_response, problem, ODD))


def _rig(elements: int) -> HarmonicBalance:
    with TemporaryDirectory() as folder:
        specimens = (CASES / "specimens_rig.yaml").read_text(encoding="utf-8")
        finer = specimens.replace("pad_elements: 10", f"pad_elements: {elements}")
        Path(folder, "specimens_rig.yaml").write_text(finer, encoding="utf-8")
        case = Path(folder, "rig.yaml")
        case.write_text((CASES / "rig_harmonic_balance.yaml").read_text(encoding="utf-8"), "utf-8")
        loaded = load_case(case)
        assert isinstance(loaded, VibrationCase)
        return vibration_model(loaded, Reporter(Path(folder, "run.log"))).structure.problem


def _response(problem: HarmonicBalance, odd: int) -> int:
    refined = problem.with_resolution(Resolution((0, *range(1, 2 * odd, 2)), 256))
    branch = along_frequency(refined, FORCE, SPAN, control=STEPS)
    assert branch.message == "", branch.message
    return len(branch.solutions)


# --- all ----------------------------------------------------------------------------------------

WORKS: dict[str, tuple[Callable[[int], Sized], int]] = {
    "normal": (normal, 32),
    "friction": (friction, 32),
    "unlike": (partial(friction, pair=UNLIKE), 32),
    "condensation": (condensation, 8),
    "missions": (missions, 8),
    "stack": (stack, 2),
    "harmonics": (harmonics, 1),
    "contacts": (contacts, 4),
}
"""Each by its name, with the size of the small one."""


def measured(work: str, size: int) -> dict[str, float]:
    """Measure one work, after doing the same in small."""
    make, small = WORKS[work]
    loops.PAYS = 0  # as in a process that runs for long, which uses compiled loops
    make(small).run()
    before = _peak(anew=True)
    sized = make(size)
    # The memory of the preparation, a mesh or a reduction, is excluded, except for what remains.
    _peak(anew=True)
    times, count = list[float](), 0
    while not times or (work in AGAIN and _again(times)):
        began = time.process_time()
        count = sized.run()
        times.append(time.process_time() - began)
    memory = _peak() - before
    return {"size": int(sized.size), "seconds": min(times), "count": int(count), "memory": memory}


def _again(times: list[float]) -> bool:
    """Return whether a work that took these seconds is measured again."""
    if len(times) == 1:
        return times[0] < LONG
    return sum(times) < SHORT and len(times) < TRIES


def _peak(anew: bool = False) -> float:
    """Return the peak memory of this process [GB] from Linux; ``anew`` restarts its measurement."""
    own = Path("/proc/self")
    if anew:
        (own / "clear_refs").write_text("5", encoding="ascii")
    (line,) = (row for row in (own / "status").read_text().splitlines() if "VmHWM" in row)
    return 1024e-9 * float(line.split()[1])


if __name__ == "__main__":
    name, across, *prepare = sys.argv[1:]
    if prepare:
        WORKS[name][0](int(across))
    else:
        print(json.dumps(measured(name, int(across))))  # noqa: T201
