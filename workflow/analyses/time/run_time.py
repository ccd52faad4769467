"""Run time of a case in time."""

from __future__ import annotations

from dataclasses import replace

from workflow.analyses import wear
from workflow.analyses.rig.bodies.matrix_body import MatrixBody
from workflow.analyses.rig.excitation import Harmonic
from workflow.analyses.rig.structure import JointedBody, ReducedBody
from workflow.analyses.specimens.run_time import reduction_of
from workflow.analyses.time.case import JointCase, RigCase
from workflow.case.loading import load_case
from workflow.shell.run_time import FIGURES, RunTime

# Time of a step of a rig, and of a reduced body [s]; factor where steps may be split.
STEP, REDUCED_STEP, CHOSEN = 8e-5, 1e-3, 5.0
# Periods to a steady state, and steady states of an ageing.
PERIODS, AGEING = 30, 20
# Time of a joint alone, aged at its stroke [s].
JOINT = 1.0


def run_time(case: JointCase | RigCase) -> RunTime:
    """Return the time of all motions, or of the cycles up to steady ones."""
    computed = _computed_wear(case.evolution.file)
    begun = 0.0 if computed is None else computed.seconds
    if isinstance(case, JointCase):
        return _after(computed, begun, JOINT)
    reduced = isinstance(case.structure, JointedBody)
    motions = len(case.energies)
    if isinstance(case.excitation, Harmonic):
        motions = PERIODS * (motions + (AGEING if case.ageing.wanted else 0))
    step = REDUCED_STEP if reduced else STEP
    if case.integration.tolerance is not None:
        step *= CHOSEN
    if isinstance(case.structure, ReducedBody):
        begun += reduction_of(case.structure.file)
    elif isinstance(case.structure, MatrixBody):
        begun += case.structure.build_time()
    return _after(computed, begun, motions * case.steps * step)


def _after(computed: RunTime | None, begun: float, course: float) -> RunTime:
    """Return the time of a ``course`` that has ``begun`` with the wear case computed before it."""
    if computed is None:
        return RunTime(begun, course)
    return replace(computed, before=begun, course=course, after=FIGURES)


def _computed_wear(file: str | None) -> RunTime | None:
    """Return the time of the wear case that the joint follows, or None where there is none."""
    if file is None or not file.endswith(".yaml"):
        return None
    kinds = list(wear.ANALYSIS.cases.values())
    return wear.ANALYSIS.run_time(load_case(file, kinds))
