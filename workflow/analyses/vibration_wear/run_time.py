"""How long a vibration case takes whose contact wears."""

from __future__ import annotations

from math import log

from workflow.analyses.vibration.run_time import POINTS, point_time, structure_time
from workflow.analyses.vibration_wear.case import VibrationWearCaseBase
from workflow.shell.run_time import RunTime

# Points of a curve that wear to a state takes as long as.
WEAR = 60


def run_time(case: VibrationWearCaseBase) -> RunTime:
    """Of the structure, and of the wear to every state and the curves in it."""
    span = log(case.frequencies[1] / case.frequencies[0])
    states = len(case.wear.cycles) + 1
    points = states * (WEAR + POINTS * span * len(case.amounts))
    return RunTime(structure_time(case), points * point_time(case))
