"""An analysis as the shell and the commands know it: one frozen description, and nothing else."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Literal, TypeVar

from workflow.case.sections import Case
from workflow.shell.memory import Memory
from workflow.shell.processes import Beside
from workflow.shell.run_time import RunTime

if TYPE_CHECKING:
    import h5py
    from matplotlib.figure import Figure

    from workflow.shell.checkpoint import StoredState
    from workflow.shell.folder import OutputFolder
    from workflow.shell.quantities import CurvesOf, Quantity
    from workflow.shell.reporter import Reporter

AnyCase = TypeVar("AnyCase", bound=Case)
Summary = Mapping[str, Any]
Share = Literal["nothing", "files", "pictures"]
"""What of its pictures a run shares with a second process: files for ParaView, or figures too."""


@dataclass(frozen=True)
class Run(Generic[AnyCase]):
    """A run that an analysis is to bring to its end.

    ``kind`` is the name of its kind of case. It goes on from where ``folder`` has got to if it is
    to ``resume``, with the state in ``kept``, None where it left none before it was cut off.
    ``provenance`` is what its numbers come from, by which its files are known again.
    ``choice`` is the record of the settings that were chosen for the case, None
    where they stand as written. ``compute`` runs another case file into a folder, from where an
    earlier run there has got to; False if that was finished already. ``draw`` writes the pictures
    of the results that the case asks for, told what these hold. ``measured`` tells how far these
    are from what was measured, as the summary has it. ``report`` puts the summary that
    the run is to end with, and what was drawn, on a page for people. ``beside`` is a process for
    what need not wait, which draws at the end.
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
    beside: Beside


@dataclass(frozen=True)
class Pictures:
    """How results are shown.

    Both are told what the results hold: a frozen description that the run makes of what it has
    written. ``figures_of`` gives the figures to draw, by name; ``write_paraview`` writes files for
    ParaView into a folder and gives their paths, None for cases without fields. ``contents`` is the
    type of that description, for results whose run has ended; None where there is nothing to tell.
    """

    figures_of: Callable[[Any], Mapping[str, Callable[[h5py.File], Figure]]]
    write_paraview: Callable[[Any, h5py.File, Path], list[Path]] | None = None
    contents: type[Any] | None = None


def as_written(case: Any) -> tuple[Any, None]:
    """The case, and no record: nothing is to choose."""
    return case, None


def no_quantities(case: Any, summary: Summary) -> Sequence[Quantity]:
    """None, of an analysis that names none."""
    return ()


def expected(case: Case, summary: Summary) -> list[str]:
    """What a case expects to find; of 0 there is no relative error."""
    return [entry.quantity for entry in case.expect if entry.value]


@dataclass(frozen=True)
class Comparison(Generic[AnyCase]):
    """How a chart compares two runs of an analysis.

    ``quantities`` are dotted paths into the summary, ``extras`` those told beside them,
    ``sections`` those of the middle of the faces, and ``at_the_end`` those that do not depend on
    which increments are computed. ``plain`` are overrides that leave out what a chart has no use
    for, unless it asks for a quantity below the entry. ``measured`` is the summary with what only
    the results in the folder tell, ``apart`` how far they are from those in another, by name.
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
    """All that the shell and the commands know of an analysis.

    ``cases`` are its kinds of case by the names that ``fretscale new`` has for them; these say
    themselves how they are told apart, what they would run and on how many cores. ``memory`` is
    what a run needs before anything is meshed, ``run_time`` about how long it takes, ``pictures``
    how its results are shown, and ``beside`` what of these a second process has a share of: not
    figures where to draw them takes less than the half second in which it would load what draws.
    ``resumable`` are runs that leave a checkpoint to go on from (:mod:`workflow.shell.checkpoint`),
    by their steps (:mod:`workflow.shell.steps`) or a state of their own.
    ``quantities`` are the main results, for all that show or compare runs, ``curves`` what is drawn
    over each other where runs are compared.
    ``choose`` gives the case with the settings that it leaves open, and a record of why.
    ``write_loads`` solves the structure of a case alone and writes the loads of its contacts into a
    folder, ``draw_faces`` draws the faces of these into one; None where there is no structure.
    """

    name: str
    cases: Mapping[str, type[AnyCase]]
    run: Callable[[Run[AnyCase]], None]
    memory: Callable[[AnyCase], Memory]
    run_time: Callable[[AnyCase], RunTime]
    quantities: Callable[[AnyCase, Summary], Sequence[Quantity]] = no_quantities
    curves: Sequence[CurvesOf] = ()
    pictures: Callable[[], Pictures] | None = None
    beside: Share = "nothing"
    resumable: bool = False
    choose: Callable[[AnyCase], tuple[AnyCase, dict[str, Any] | None]] = as_written
    comparison: Comparison[AnyCase] = Comparison()
    write_loads: Callable[[AnyCase, str, Path, bool], Sequence[str]] | None = None
    draw_faces: Callable[[AnyCase, str, Path, bool], Path] | None = None
