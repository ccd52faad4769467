"""How long a case in time takes."""

from __future__ import annotations

from dataclasses import replace

from workflow.analyses import wear
from workflow.analyses.rig.excitation import Harmonic
from workflow.analyses.rig.matrix_body import MatrixBody
from workflow.analyses.rig.structure import JointedBody, ReducedBody
from workflow.analyses.specimens.run_time import reduction_of
from workflow.analyses.time.case import JointCase, RigCase
from workflow.case.loading import load_case
from workflow.shell.run_time import FIGURES, RunTime

# A step of a rig in time; of a reduced body [s]. Chosen steps are parts of what the case gives.
STEP, REDUCED_STEP, CHOSEN = 8e-5, 1e-3, 5.0
# Periods to a steady state, and steady states that an ageing is built on.
PERIODS, AGEING = 30, 20
# A joint alone, aged at its stroke [s].
JOINT = 1.0


def run_time(case: JointCase | RigCase) -> RunTime:
    """Of all motions, or of the cycles up to steady ones."""
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
