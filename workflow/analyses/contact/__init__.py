"""Contact of two bodies along a path of loads: no structure, no wear."""

from workflow.analyses.contact.case import BodiesCase, ContactCase, LineContactCase
from workflow.analyses.contact.memory import memory
from workflow.analyses.contact.quantities import CURVES, main_results
from workflow.analyses.contact.run_time import run_time
from workflow.shell.analysis import Analysis, Comparison, Pictures, Run, Summary, expected

__all__ = ["ANALYSIS"]


def _run(run: Run[BodiesCase]) -> None:
    # Solvers take a second to load: where they are used.
    from workflow.analyses.contact.run import run_contact

    run_contact(run)


# What contact cases are compared by where they expect nothing.
AT_THE_END = (
    *("states.-1.approach", "states.-1.central_pressure", "states.-1.shift_x"),
    *("states.-1.stick_radius", "states.-1.stick_half_width", "loop.energy"),
)


def _quantities(case: BodiesCase, summary: Summary) -> list[str]:
    return expected(case, summary) or list(AT_THE_END)


def _pictures() -> Pictures:
    # Plots take a second to load: where they are drawn.
    from workflow.analyses.contact.datasets import Contents
    from workflow.analyses.contact.figures import figures_of
    from workflow.analyses.contact.paraview import write_contact

    return Pictures(figures_of, write_contact, contents=Contents)


ANALYSIS: Analysis[BodiesCase] = Analysis(
    name="contact",
    cases={"bodies": ContactCase, "line": LineContactCase},
    run=_run,
    pictures=_pictures,
    memory=memory,
    run_time=run_time,
    quantities=main_results,
    curves=CURVES,
    comparison=Comparison(quantities=_quantities, at_the_end=AT_THE_END),
    draws_beside=True,
)
