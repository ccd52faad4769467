"""Wear analysis of contacts: structure, contact, wear, and loads of the worn structure."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.output.layout import LAYOUT, WearContents
from workflow.analyses.wear.output.measures import COMPARISON
from workflow.analyses.wear.output.quantities import CURVES, main_results
from workflow.analyses.wear.run_time import run_time
from workflow.analyses.wear.structures import STRUCTURES, structure_of
from workflow.shell.analysis import Analysis, Pictures, Run

__all__ = ["ANALYSIS"]


def _run(run: Run[WearCase]) -> None:
    # Solvers take a second to import, so they are imported only where they are used.
    from workflow.analyses.wear.run import run_wear

    run_wear(run)


def _write_loads(case: WearCase, name: str, out: Path, force: bool) -> Sequence[str]:
    from workflow.analyses.wear.output.export import export_resultants

    return export_resultants(case, name, out, force)


def _draw_faces(case: WearCase, name: str, out: Path, force: bool) -> Path:
    from workflow.analyses.wear.contact_faces import draw_faces

    return draw_faces(case, name, out, force)


def _pictures() -> Pictures:
    # Plots take a second to import, so they are imported only where they are drawn.
    from workflow.analyses.wear.figures.wear import figures_of
    from workflow.analyses.wear.paraview.wear import write_wear

    return Pictures(figures_of, write_wear, contents=WearContents)


ANALYSIS = Analysis(
    name="wear",
    cases={structure.name: structure.case for structure in STRUCTURES},
    run=_run,
    pictures=_pictures,
    in_worker="pictures",  # ten seconds and more on one core
    memory=lambda case: structure_of(case).memory(case, 0, 0),
    run_time=lambda case: run_time(case, structure_of(case).extent(case)),
    layout=lambda case: LAYOUT,
    quantities=main_results,
    curves=CURVES,
    resumable=True,
    choose=lambda case: structure_of(case).choose(case),
    comparison=COMPARISON,
    write_loads=_write_loads,
    draw_faces=_draw_faces,
)
