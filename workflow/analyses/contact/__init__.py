"""Contact of two bodies along a path of loads, without structure and wear."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from workflow.analyses.contact.case import BodiesCase, ContactCase, LineContactCase
from workflow.analyses.contact.memory import memory
from workflow.analyses.contact.output.layout import LAYOUT, ContactContents
from workflow.analyses.contact.output.quantities import CURVES, main_results
from workflow.analyses.contact.run_time import run_time
from workflow.shell.analysis import Analysis, ChartComparison, Pictures, Run, Summary, expected

if TYPE_CHECKING:
    import h5py
    from matplotlib.figure import Figure

__all__ = ["ANALYSIS"]


def _run(run: Run[BodiesCase]) -> None:
    # Imported here, as the solvers take a second to load.
    from workflow.analyses.contact.run import run_contact

    run_contact(run)


# Quantities by which contact cases without expected values are compared.
AT_THE_END = (
    *("states.-1.approach", "states.-1.central_pressure", "states.-1.shift_x"),
    *("states.-1.stick_radius", "states.-1.stick_half_width", "loop.energy"),
)


def _quantities(case: BodiesCase, summary: Summary) -> list[str]:
    return expected(case, summary) or list(AT_THE_END)


def _pictures() -> Pictures:
    from workflow.analyses.contact.output.paraview import write_contact

    return Pictures(_figures_of, write_contact, contents=ContactContents)


def _figures_of(contents: Any) -> Mapping[str, Callable[[h5py.File], Figure]]:
    # Imported here, as plotting takes half a second to load.
    from workflow.analyses.contact.output.figures import figures_of

    return figures_of(contents)


ANALYSIS: Analysis[BodiesCase] = Analysis(
    name="contact",
    cases={"bodies": ContactCase, "line": LineContactCase},
    run=_run,
    pictures=_pictures,
    memory=memory,
    run_time=run_time,
    layout=lambda case: LAYOUT,
    quantities=main_results,
    curves=CURVES,
    comparison=ChartComparison(quantities=_quantities, at_the_end=AT_THE_END),
    in_worker="files",
)
