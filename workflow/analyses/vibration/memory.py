"""Memory a vibration case needs."""

from __future__ import annotations

from workflow.analyses.rig.matrix_body import MatrixBody
from workflow.analyses.vibration.case import VibrationCase
from workflow.analyses.vibration.case_base import VibrationCaseBase
from workflow.shell.memory import Memory

# Points of a forced response, of each of which the samples of the joints' forces and the motion are
# kept until the curve is found; derivatives of the forces are held by so many of them at once.
CURVE_POINTS, SLOPES = 2000, 20


def memory(case: VibrationCaseBase, displacements: int = 0, joints: int = 1) -> Memory:
    """Of all motions under a force, and of what is held while one is found.

    The structure has so many ``displacements`` and ``joints``, once they are known.
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
