"""Vibration of a structure whose contacts wear by it: motion and wear in turn."""

from workflow.analyses.vibration.memory import memory
from workflow.analyses.vibration_wear.case import (
    FrictionRigWearCase,
    ReducedWearCase,
    VibrationWearCase,
)
from workflow.analyses.vibration_wear.output.layout import layout_of
from workflow.analyses.vibration_wear.output.outcome import VibrationWearContents
from workflow.analyses.vibration_wear.output.quantities import CURVES, main_results
from workflow.analyses.vibration_wear.run_time import run_time
from workflow.shell.analysis import Analysis, Pictures, Run

__all__ = ["ANALYSIS"]


def _run(run: Run[VibrationWearCase | FrictionRigWearCase | ReducedWearCase]) -> None:
    # Imported here, as joint laws are compiled when they are first imported.
    from workflow.analyses.vibration_wear.run import run_vibration_wear

    run_vibration_wear(run)


def _pictures() -> Pictures:
    # Imported here, as plotting takes a second to load.
    from workflow.analyses.vibration_wear.output.figures import figures_of
    from workflow.analyses.vibration_wear.output.paraview import write_vibration_wear

    return Pictures(figures_of, write_vibration_wear, contents=VibrationWearContents)


ANALYSIS = Analysis(
    name="vibration_wear",
    cases={
        "vibration_wear": VibrationWearCase,
        "friction_rig_wear": FrictionRigWearCase,
        "reduced_wear": ReducedWearCase,
    },
    run=_run,
    pictures=_pictures,
    memory=memory,
    run_time=run_time,
    layout=lambda case: layout_of(case.amount),
    quantities=main_results,
    curves=CURVES,
    resumable=True,
)
