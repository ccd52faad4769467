"""Run time of a vibration case."""

from __future__ import annotations

from math import log

from workflow.analyses.rig.bodies.matrix_body import MatrixBody
from workflow.analyses.rig.bodies.point_body import PointBody
from workflow.analyses.rig.structure import FrictionRig, ReducedBody, RowOfMasses, joints_of
from workflow.analyses.specimens.case import SpecimensCase
from workflow.analyses.specimens.run_time import reduction_of
from workflow.analyses.vibration.case.case_base import VibrationCaseBase
from workflow.analyses.vibration.case.vibration_case import VibrationCase
from workflow.case.loading import load_case
from workflow.shell.run_time import RunTime

# Usual number of points of a curve while the frequency or the force grows by a factor of e.
POINTS = 50
# Number of points of a curve that take as long as a motion at one frequency.
ANSWER = 5
# Time of a point of a rig with one joint, and where harmonics grow to a tolerance [s].
POINT, GROWING_POINT = 5e-3, 3e-2
# Time of a point with MANY_UNKNOWNS unknowns of joints, and of the linear limits with DIRECTIONS
# directions of joints [s].
MANY, MANY_UNKNOWNS, MANY_POWER = 0.37, 4000.0, 1.5
LIMITS, DIRECTIONS, CUBE = 25.0, 363.0, 3
# Factor where a damping matrix couples the modes: each harmonic is then a solve with all of them.
MIXED = 40.0
# Time of the stability of a point with one joint, and with DIRECTIONS directions of joints of which
# most slip [s]; most directions for which stability is computed by default.
STABILITY, MANY_STABILITY, FEW_DIRECTIONS = 4e-2, 1.2, 12
# Joints assumed for a reduced body whose points are not counted.
JOINTS = 100


def run_time(case: VibrationCase) -> RunTime:
    """Return the time of the structure, its linear limits, and all curves."""
    span = log(case.frequencies[1] / case.frequencies[0])
    curves = len(case.amounts) * span
    if case.backbone or case.force_sweeps:
        along = log(case.amounts[-1] / case.amounts[0])
        curves += (case.backbone + len(case.force_sweeps)) * along
    if case.modes is not None:
        least, largest = case.modes.amplitudes
        curves += len(case.modes.numbers) * log(largest / least)
    points = POINTS * curves + ANSWER * len(case.at) * len(case.amounts)
    return RunTime(structure_time(case), points * (point_time(case) + stability_time(case)))


def structure_time(case: VibrationCaseBase) -> float:
    """Return the time until curves can be followed [s]."""
    limits = LIMITS * (_directions(case) / DIRECTIONS) ** CUBE
    if isinstance(case.structure, FrictionRig):
        return limits + reduction_of(case.structure.specimens)
    if isinstance(case.structure, ReducedBody):
        return limits + reduction_of(case.structure.file)
    if isinstance(case.structure, MatrixBody):
        return limits + case.structure.build_time()
    return limits


def point_time(case: VibrationCaseBase) -> float:
    """Return the time of a point of a curve [s]."""
    unknowns = _directions(case) * 2 * len(case.harmonics)
    structure, mixed = case.structure, 1.0
    if isinstance(structure, MatrixBody) and structure.matrices.damping is not None:
        mixed = MIXED
    one = POINT if case.resolution.tolerance is None else GROWING_POINT
    return one + mixed * float(MANY * (unknowns / MANY_UNKNOWNS) ** MANY_POWER)


def stability_time(case: VibrationCase) -> float:
    """Return the time of the stability of a point of a curve [s]."""
    directions = _directions(case)
    many = case.stability == "auto" and directions > FEW_DIRECTIONS
    if case.stability == "none" or many:
        return 0.0
    return STABILITY + MANY_STABILITY * (directions - 1) / DIRECTIONS


def _directions(case: VibrationCaseBase) -> int:
    """Return the number of directions of all joints."""
    if isinstance(case.structure, RowOfMasses):
        return len(joints_of(case.structure, shared=False)) or 1
    joints = JOINTS
    if isinstance(case.structure, MatrixBody | PointBody):
        joints = case.structure.joint_count
    if isinstance(case.structure, FrictionRig):
        file = case.structure.specimens
        specimens = load_case(file, [SpecimensCase])
        joints = (specimens.mesh.pad_elements + 1) ** 2
    return joints * (3 if case.contacts else 1)
