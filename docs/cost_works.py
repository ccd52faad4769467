"""What `docs/cost_charts.py` measures: one work of one size, alone in this process.

    python docs/cost_works.py WORK SIZE [--prepare]

prints as JSON how large it is, its seconds of the processor, what it counts, and by how much its
peak memory is above what the loaded program had, in GB. The same work in small comes first: modules
are loaded and loops compiled with that. Contacts are done at least twice, the first
time with their transforms set up, and the least time counts. With ``--prepare`` what a work stands
on, a condensed structure, is brought to the cache, and nothing is measured.
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
from workflow.analyses.vibration.case import VibrationCase
from workflow.analyses.vibration.model import VibrationModel
from workflow.analyses.wear.structures.dovetail.model import dovetail_joint
from workflow.analyses.wear.translation import structure_loads
from workflow.kinds import load_case
from workflow.models.structure import StructureLoads
from workflow.shell.reporter import Reporter

CASES = Path(__file__).parent.parent / "cases"
TITANIUM, FRICTION = Material(115e3, 0.29), 0.5
ALIKE, UNLIKE = ElasticPair(TITANIUM, TITANIUM), ElasticPair(Material(np.inf, 0.3), TITANIUM)
# Contacts are done again, for transforms are set up the first time, but for those that take longer
# than some seconds; within less of them more often, up to a number of times.
LONG, SHORT, TRIES = 200.0, 2.0, 5
AGAIN = ("normal", "friction", "unlike")
# Contact radius over half the grid's width, and the shear load over µP.
CONTACT_SHARE, SHEAR_SHARE = 0.6, 0.75
# Nodes across a flank of the default dovetail, and along it.
FLANK = np.array([20, 34])
# Nodes along a side of the blocks of a stack, whose cycle has four increments.
SIDE, PATH = 16, np.array([[1.0, 0.5], [1.0, 1.0], [1.0, 0.0], [1.0, -1.0]])
# The shipped rig: nodes along a side of its pads less one, odd harmonics, force [N], span [Hz].
PAD, ODD, FORCE, SPAN = 10, 5, 10.0, (50.0, 500.0)
STEPS = ContinuationControl(most=0.1)


class Sized(NamedTuple):
    """A work to be measured, and how large it is; called, it gives what it counts."""

    size: int
    run: Callable[[], int]


# --- contacts -----------------------------------------------------------------------------------


def normal(cells: int) -> Sized:
    """A sphere pressed on so many cells along each side, cold; counts convolutions."""
    height, half_space, hertz = _sphere(cells, ALIKE)
    contact = NormalContact(half_space)
    return Sized(cells, lambda: contact.solve(height, hertz.load).convolutions)


def friction(cells: int, pair: ElasticPair = ALIKE) -> Sized:
    """The same, then sheared by three quarters of what friction carries; counts convolutions."""
    height, half_space, hertz = _sphere(cells, pair)
    contact = FrictionalContact(half_space, FRICTION)

    def run() -> int:
        state, count = contact.apart(height), 0
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
    """The default dovetail with so many nodes across each flank; counts unknowns of its mesh."""
    stage = _dovetail(nodes)
    bodies = stage.mesh.bodies

    def run() -> int:
        stage.prepare()
        return 3 * sum(body.mesh.nvertices for body in bodies)

    return Sized(stage.interface_count(), run)


def missions(nodes: int) -> Sized:
    """Its two missions of 22 increments with friction, once condensed; counts iterations."""
    stage = _dovetail(nodes)
    structure, joint, model = stage.structure, stage.joint, stage.model
    cycle = partial(structure.solve_cycle, joint, model.load_cycles[0].amplitudes, structure.gap())

    def run() -> int:
        solution = cycle(stage.friction[0])
        assert solution.converged
        return solution.iterations

    return Sized(stage.interface_count(), run)


def stack(bodies: int) -> Sized:
    """So many blocks on each other, each pressed and sheared by friction; counts unknowns."""
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
    case: Any = load_case(CASES / "dovetail.yaml", [f"mesh.flank_nodes=[{nodes}, {along}]"])
    return structure_loads(case, dovetail_joint)


# --- vibration ----------------------------------------------------------------------------------


def harmonics(odd: int) -> Sized:
    """A response of the rig's 121 contacts, the mean and so many odd harmonics; counts points."""
    return Sized(odd, partial(_response, _rig(PAD), odd))


def contacts(elements: int) -> Sized:
    """The same with five odd harmonics and so many elements along each side of the pads."""
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
        return VibrationModel.of(loaded, Reporter(Path(folder, "run.log"))).problem


def _response(problem: HarmonicBalance, odd: int) -> int:
    refined = problem.refined(Resolution((0, *range(1, 2 * odd, 2)), 256))
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
    """One work, after the same in small."""
    make, small = WORKS[work]
    loops.PAYS = 0  # a process that goes on for long has turned to compiled loops
    make(small).run()
    before = _peak(anew=True)
    sized = make(size)
    # What it took to get there, a mesh or a reduction, is not of the work; what it keeps is.
    _peak(anew=True)
    times, count = list[float](), 0
    while not times or (work in AGAIN and _again(times)):
        began = time.process_time()
        count = sized.run()
        times.append(time.process_time() - began)
    memory = _peak() - before
    return {"size": int(sized.size), "seconds": min(times), "count": int(count), "memory": memory}


def _again(times: list[float]) -> bool:
    """Whether a work that took these seconds is worth another try."""
    if len(times) == 1:
        return times[0] < LONG
    return sum(times) < SHORT and len(times) < TRIES


def _peak(anew: bool = False) -> float:
    """Most memory of this process [GB], as Linux tells it; ``anew``: counted from now on."""
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
