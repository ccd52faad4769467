"""Two specimens of a friction rig, reduced, and worn under each normal force."""

from workflow.analyses.specimens.case import SpecimensCase
from workflow.analyses.specimens.layout import LAYOUT
from workflow.analyses.specimens.memory import memory
from workflow.analyses.specimens.quantities import CURVES, main_results
from workflow.analyses.specimens.run_time import run_time
from workflow.shell.analysis import Analysis, Pictures, Run

__all__ = ["ANALYSIS"]


def _run(run: Run[SpecimensCase]) -> None:
    # Imported here, as finite elements take a second to load.
    from workflow.analyses.specimens.run import run_specimens

    run_specimens(run)


def _pictures() -> Pictures:
    # Imported here, as plotting takes a second to load.
    from workflow.analyses.specimens.figures import figures_of
    from workflow.analyses.specimens.paraview import write_specimens

    return Pictures(figures_of, write_specimens)


ANALYSIS = Analysis(
    name="specimens",
    cases={"specimens": SpecimensCase},
    run=_run,
    pictures=_pictures,
    memory=memory,
    run_time=run_time,
    layout=lambda case: LAYOUT,
    quantities=main_results,
    curves=CURVES,
    resumable=True,
)
