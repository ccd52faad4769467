"""Steady vibration of structures with joints, by harmonic balance."""

from itertools import product

from workflow.analyses.vibration.case.vibration_case import VibrationCase
from workflow.analyses.vibration.memory import memory
from workflow.analyses.vibration.output.layout import layout_of
from workflow.analyses.vibration.output.outcome import VibrationContents
from workflow.analyses.vibration.output.quantities import CURVES, main_results
from workflow.analyses.vibration.run_time import run_time
from workflow.shell.analysis import Analysis, ChartComparison, Pictures, Run, Summary

__all__ = ["ANALYSIS"]

# Quantities by which motions under every force are compared between runs. The frequency of a
# resonance is not among them: it says little where the amplitude hardly changes with frequency.
MOTIONS = "amplitude", "energy_per_cycle", "loops.-1.energy"


def _run(run: Run[VibrationCase]) -> None:
    # Imported here, as joint laws are compiled when they are first imported.
    from workflow.analyses.vibration.run import run_vibration

    run_vibration(run)


def _quantities(case: VibrationCase, summary: Summary) -> list[str]:
    count = len(case.amounts)
    return [f"responses.{n}.{moved}" for n, moved in product(range(count), MOTIONS)]


def _pictures() -> Pictures:
    # Imported here, as plotting takes a second to load.
    from workflow.analyses.vibration.figures.response import figures_of
    from workflow.analyses.vibration.output.paraview import write_vibration

    return Pictures(figures_of, write_vibration, contents=VibrationContents)


ANALYSIS = Analysis(
    name="vibration",
    cases={"vibration": VibrationCase},
    run=_run,
    pictures=_pictures,
    memory=memory,
    run_time=run_time,
    layout=lambda case: layout_of(case.amount),
    quantities=main_results,
    curves=CURVES,
    resumable=True,
    comparison=ChartComparison(quantities=_quantities),
)
