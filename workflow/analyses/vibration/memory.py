"""Memory that a vibration case needs."""

from __future__ import annotations

from workflow.analyses.rig.bodies.matrix_body import MatrixBody
from workflow.analyses.vibration.case.case_base import VibrationCaseBase
from workflow.analyses.vibration.case.vibration_case import VibrationCase
from workflow.shell.memory import Memory

# CURVE_POINTS: points of a forced response, for each of which the motion and the samples of the
# joint forces are held until the curve is found. SLOPES: points for which derivatives of the forces
# are held at once.
CURVE_POINTS, SLOPES = 2000, 20


def memory(case: VibrationCaseBase, displacements: int = 0, joints: int = 1) -> Memory:
    """Return the memory for all motions under a force, and for finding one of them.

    ``displacements`` and ``joints`` are their numbers in the structure, once they are known.
    """
    directions = 3 if case.contacts else 1
    functions = 2 * len(case.harmonics)
    motion = functions * (displacements + joints * directions)
    slopes = joints * (functions * directions) ** 2
    samples = case.resolution.samples * joints * (directions + 1)
    if isinstance(case, VibrationCase) and case.harmonics_along_curves:
        motion *= 2
    motions = Memory(
        CURVE_POINTS * (samples + motion) + SLOPES * slopes,
        "lower resolution.samples or resolution.harmonics",
    )
    if not isinstance(case.structure, MatrixBody):
        return motions
    return max(motions, case.structure.memory(), key=lambda memory: memory.required)
