"""Memory that a case in time needs."""

from __future__ import annotations

from workflow.analyses.rig.structure import ReducedBody, Rig
from workflow.analyses.time.case import JointCase, RigCase
from workflow.shell.memory import Memory

# Numbers per mass and step of a rig in time: displacement, velocity, acceleration, forces, energies
# and their results, with the objects that hold a step while it is computed.
STEP_COLUMNS = 60
# Numbers per step and displacement of a reduced body, which are in large arrays.
REDUCED_COLUMNS = 20


def memory(case: JointCase | RigCase, displacements: int = 0) -> Memory:
    """Return the memory for the motions: every step, with all its columns, at every energy.

    ``displacements`` is their number in a reduced body, once it is known.
    """
    remedy = "raise integration.step, or shorten the record"
    if isinstance(case, JointCase):
        return Memory(0.0, remedy)
    if isinstance(case.structure, Rig):
        columns = STEP_COLUMNS * len(case.structure.masses) * len(case.energies)
        return Memory(columns * case.steps, remedy)
    # Little of these motions is kept once they are computed.
    motions = Memory(REDUCED_COLUMNS * displacements * case.steps, remedy)
    if isinstance(case.structure, ReducedBody):
        return motions
    return max(motions, case.structure.memory(), key=lambda memory: memory.required)
