"""Run time of a vibration case whose contact wears."""

from __future__ import annotations

from math import log

from workflow.analyses.vibration.run_time import POINTS, point_time, structure_time
from workflow.analyses.vibration_wear.case import VibrationWearCaseBase
from workflow.shell.run_time import RunTime

# Number of points of a curve that take as long as the wear to a state.
WEAR = 60


def run_time(case: VibrationWearCaseBase) -> RunTime:
    """Return the time of the structure, the wear to every state, and the curves in each."""
    span = log(case.frequencies[1] / case.frequencies[0])
    states = len(case.wear.cycles) + 1
    points = states * (WEAR + POINTS * span * len(case.amounts))
    return RunTime(structure_time(case), points * point_time(case))
