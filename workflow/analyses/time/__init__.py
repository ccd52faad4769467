"""Joints in time: at a prescribed stroke, or in a rig that is excited, hit or driven."""

from workflow.analyses.time.case import JointCase, RigCase
from workflow.analyses.time.memory import memory
from workflow.analyses.time.outcome import LAYOUT, MotionContents
from workflow.analyses.time.quantities import CURVES, main_results
from workflow.analyses.time.run_time import run_time
from workflow.shell.analysis import Analysis, Pictures, Run

__all__ = ["ANALYSIS"]


def _run(run: Run[JointCase | RigCase]) -> None:
    # Imported here, as joint laws are compiled when they are first imported.
    from workflow.analyses.time.run import run_time

    run_time(run)


def _pictures() -> Pictures:
    # Imported here, as plotting takes a second to load.
    from workflow.analyses.time.figures import figures_of

    return Pictures(figures_of, contents=MotionContents)


ANALYSIS = Analysis(
    name="time",
    cases={"joint": JointCase, "rig": RigCase},
    run=_run,
    pictures=_pictures,
    memory=memory,
    run_time=run_time,
    layout=lambda case: LAYOUT,
    quantities=main_results,
    curves=CURVES,
    resumable=True,
)
