"""Memory a case needs, estimated before anything large is allocated."""

from __future__ import annotations

from math import prod

from fe_models.memory import available_bytes as _available_bytes
from workflow.case import (
    Case,
    DovetailCase,
    JointCase,
    LineContactCase,
    RigCase,
    SpecimensCase,
    WearCase,
)
from workflow.case.rig_structure import ReducedBody
from workflow.case.vibration_case import VibrationScene
from workflow.errors import OutOfMemory

# Dense interface matrices alive at once while the joint is condensed.
DENSE_MATRICES = 6
# Fields per cell and increment: slips, depths per pressure, pressures, starts.
FIELDS = 12
# A contact case: fields kept of a state, and spectra and iterates alive during a solve, per cell.
STATE_FIELDS, SPECTRA = 6, 300
# A rig in time: displacement, velocity, acceleration, forces, energies and what is made of them,
# per mass and step, with the objects that hold a step while it is found.
STEP_COLUMNS = 60
# The same per displacement of a reduced body, whose numbers are in large arrays.
REDUCED_COLUMNS = 20
# Points of a forced response, of each of which the samples of the joints' forces and the motion are
# kept until the curve is found; derivatives of the forces are held by so many of them at once.
CURVE_POINTS, SLOPES = 2000, 20
# Sparse factors of a structure with this many nodes took this much; they grow with this power.
FACTOR_BYTES, FACTOR_NODES, FACTOR_POWER = 3.5e9, 1e5, 1.4
# Meshes, plots and the interpreter with its libraries.
REST = 1.2e9
BYTES = 8


def required_bytes(
    case: WearCase | Case, structure_nodes: int = 0, interface_nodes: int = 0
) -> float:
    """Upper estimate of the memory a run takes.

    ``structure_nodes`` of both bodies, or displacements of a reduced one in a rig, and
    ``interface_nodes`` of all contacts, or joints, once known.
    """
    if isinstance(case, JointCase | RigCase):
        return BYTES * _kept_in_time(case, structure_nodes) + REST
    if isinstance(case, VibrationScene):
        return BYTES * _kept_of_motions(case, structure_nodes, max(interface_nodes, 1)) + REST
    if isinstance(case, SpecimensCase):
        pad = 3 * (case.mesh.pad_elements + 1) ** 2
        factors = FACTOR_BYTES * (structure_nodes / FACTOR_NODES) ** FACTOR_POWER
        fields = prod(case.contact.grid) * SPECTRA + DENSE_MATRICES * pad**2
        shapes = 2 * pad * structure_nodes
        return BYTES * (fields + shapes) + factors + REST
    if not isinstance(case, WearCase):
        cells = case.contact.grid if isinstance(case, LineContactCase) else prod(case.contact.grid)
        increments = len(case.load_path.table())
        return BYTES * cells * (SPECTRA + STATE_FIELDS * increments) + REST
    contact = prod(case.contact.grid) * SPECTRA
    if isinstance(case, DovetailCase) and case.structure.dimension == 3:
        interface_nodes = 2 * prod(case.mesh.flank_nodes)
        increments = len(case.load_path.shares) * case.load_path.increments
        contact = 2 * prod(case.contact.grid) * increments * FIELDS
    factors = FACTOR_BYTES * (structure_nodes / FACTOR_NODES) ** FACTOR_POWER
    return BYTES * (DENSE_MATRICES * (3 * interface_nodes) ** 2 + contact) + factors + REST


def _kept_in_time(case: JointCase | RigCase, displacements: int) -> float:
    """Numbers kept of all motions of a rig: every step, with all its columns, at every energy."""
    if isinstance(case, JointCase):
        return 0.0
    if isinstance(case.structure, ReducedBody):
        # Of these motions little is kept once they are found.
        return REDUCED_COLUMNS * displacements * case.steps
    return STEP_COLUMNS * len(case.structure.masses) * len(case.energies) * case.steps


def _kept_of_motions(case: VibrationScene, displacements: int, joints: int) -> float:
    """Numbers kept of all motions under a force, and those held while one is found."""
    directions = 3 if case.contacts else 1
    functions = 2 * len(case.harmonics)
    motion = functions * (displacements + joints * directions)
    slopes = joints * (functions * directions) ** 2
    samples = case.resolution.samples * joints * (directions + 1)
    return CURVE_POINTS * (samples + motion) + SLOPES * slopes


def check_memory(case: WearCase | Case, structure_nodes: int = 0, interface_nodes: int = 0) -> None:
    """Raise :class:`OutOfMemory` if the machine has less than the case needs."""
    required = required_bytes(case, structure_nodes, interface_nodes)
    available = _available_bytes()
    if available is not None and required > available:
        raise OutOfMemory(
            f"this case needs about {required / 1e9:.1f} GB of memory, {available / 1e9:.1f} GB "
            f"are free: {_remedy(case)}"
        )


def _remedy(case: WearCase | Case) -> str:
    """What makes a case smaller."""
    if isinstance(case, JointCase | RigCase):
        return "raise integration.step, or shorten what is recorded"
    if isinstance(case, VibrationScene):
        return "lower resolution.samples or resolution.harmonics"
    if isinstance(case, SpecimensCase):
        return "lower mesh.pad_elements, mesh.order or contact.grid, or raise mesh.size"
    if isinstance(case, DovetailCase):
        return "lower mesh.flank_nodes, mesh.order or contact.grid, or raise mesh.size"
    if isinstance(case, WearCase):
        return "lower contact.grid"
    return "lower contact.grid or the increments of load_path"
