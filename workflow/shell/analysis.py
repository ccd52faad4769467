"""Description of an analysis, the only thing that the shell and the commands know about it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Literal, TypeVar

from workflow.case.sections import Case
from workflow.layout.declared import Layout
from workflow.shell.memory import Memory
from workflow.shell.processes import WorkerProcess
from workflow.shell.run_time import RunTime

if TYPE_CHECKING:
    import h5py
    from matplotlib.figure import Figure

    from workflow.shell.folders.checkpoint import StoredState
    from workflow.shell.folders.folder import OutputFolder
    from workflow.shell.output.quantities import CurvesOf, SummaryQuantity
    from workflow.shell.terminal.reporter import Reporter

AnyCase = TypeVar("AnyCase", bound=Case)
Summary = Mapping[str, Any]
Share = Literal["nothing", "files", "pictures"]
"""Output that a second process helps to draw: none, files for ParaView, or figures as well."""


@dataclass(frozen=True)
class Run(Generic[AnyCase]):
    """Run that an analysis has to complete.

    Attributes
    ----------
    kind
        Name of the kind of case.
    case
        The case with all its settings.
    folder
        Output folder of the run.
    reporter
        Receives progress, log lines and warnings.
    resume
        Whether to continue from the state stored in ``folder``.
    kept
        Stored state to resume from; None if the earlier run stored none before it stopped.
    provenance
        Origin of the results, by which stored files are checked before they are used again.
    choice
        Record of the settings that were chosen for the case; None if all stand as written.
    compute
        Runs another case file into a folder, resuming an earlier run there; returns False if that
        run was already finished.
    draw
        Draws the pictures that the case asks for, given the contents of the results.
    measured
        Returns the comparison with measured points, in the form stored in the summary.
    report
        Writes the report from the final summary and the figures.
    worker
        Worker process for work that the run need not wait for; it draws at the end.
    """

    kind: str
    case: AnyCase
    folder: OutputFolder
    reporter: Reporter
    resume: bool
    kept: StoredState | None
    provenance: Mapping[str, Any]
    choice: dict[str, Any] | None
    compute: Callable[[Path, Path], bool]
    draw: Callable[[Any], None]
    measured: Callable[[], list[dict[str, Any]]]
    report: Callable[[Summary], None]
    worker: WorkerProcess


@dataclass(frozen=True)
class Pictures:
    """Functions that show the results of an analysis.

    Both functions receive a frozen description of the contents of the results, which the run makes
    from what it has written. ``figures_of`` returns the functions that draw figures, by name.
    ``write_paraview`` writes files for ParaView into a folder and returns their paths; it is None
    for cases without fields. ``contents`` is the type of the description, needed to read the
    results of a finished run; it is None if the description is empty.
    """

    figures_of: Callable[[Any], Mapping[str, Callable[[h5py.File], Figure]]]
    write_paraview: Callable[[Any, h5py.File, Path], list[Path]] | None = None
    contents: type[Any] | None = None


def as_written(case: Any) -> tuple[Any, None]:
    """Return the case unchanged and None: no setting is left open."""
    return case, None


def expected(case: Case, summary: Summary) -> list[str]:
    """Return the expected quantities of a case; a value of 0 is left out (no relative error)."""
    return [entry.quantity for entry in case.expect if entry.value]


@dataclass(frozen=True)
class ChartComparison(Generic[AnyCase]):
    """Rules by which a chart compares two runs of an analysis.

    Attributes
    ----------
    quantities
        Returns the dotted paths into the summary that are compared.
    extras
        Returns the paths of further quantities to report.
    sections
        Returns the paths of quantities at the middle of the faces.
    at_the_end
        Quantities that do not depend on which increments are computed.
    plain
        Overrides that switch off output a chart does not need, by the entry that they affect; not
        applied if the chart asks for a quantity below that entry.
    measured
        Returns the summary, extended by quantities that only the results in the folder contain.
    apart
        Returns the differences between the results in two folders, by name.
    """

    quantities: Callable[[AnyCase, Summary], list[str]] = expected
    extras: Callable[[Summary], list[str]] = lambda summary: []
    sections: Callable[[Summary], list[str]] = lambda summary: []
    at_the_end: tuple[str, ...] = ()
    plain: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    measured: Callable[[Path, Summary], Summary] = lambda folder, summary: summary
    apart: Callable[[Path, Path, Summary], dict[str, float]] = lambda *runs: {}


@dataclass(frozen=True)
class Analysis(Generic[AnyCase]):
    """Description of an analysis for the shell and the commands.

    Attributes
    ----------
    name
        Name of the analysis.
    cases
        Kinds of case by their names in ``fretscale new``.
    run
        Function that completes a run.
    memory
        Estimates the memory that a run needs, before anything is meshed.
    run_time
        Estimates how long a run takes.
    quantities
        Returns the main results, for everything that shows or compares runs.
    layout
        Returns the layout of ``results.h5`` of a case.
    curves
        Curves that are drawn over each other where runs are compared.
    pictures
        Returns the functions that show the results.
    worker
        Output that a second process helps to draw; figures are excluded if drawing them takes less
        than the half second in which that process would load the plotting library.
    resumable
        Whether a run stores its steps in a checkpoint (:mod:`workflow.shell.folders.steps`).
    choose
        Returns the case with the settings that it leaves open, and a record of the reasons.
    comparison
        Rules by which charts compare two runs.
    write_loads
        Solves only the structure of a case and writes the loads of its contacts into a folder; None
        if there is no structure.
    draw_faces
        Draws the contact faces of the structure into a folder; None if there is no structure.
    """

    name: str
    cases: Mapping[str, type[AnyCase]]
    run: Callable[[Run[AnyCase]], None]
    memory: Callable[[AnyCase], Memory]
    run_time: Callable[[AnyCase], RunTime]
    quantities: Callable[[AnyCase, Summary], Sequence[SummaryQuantity]] = lambda case, summary: ()
    layout: Callable[[AnyCase], Layout] = lambda case: Layout({})
    curves: Sequence[CurvesOf] = ()
    pictures: Callable[[], Pictures] | None = None
    in_worker: Share = "nothing"
    resumable: bool = False
    choose: Callable[[AnyCase], tuple[AnyCase, dict[str, Any] | None]] = as_written
    comparison: ChartComparison[AnyCase] = ChartComparison()
    write_loads: Callable[[AnyCase, str, Path, bool], Sequence[str]] | None = None
    draw_faces: Callable[[AnyCase, str, Path, bool], Path] | None = None
