"""A run of any kind of case: its folder, its log, and where an earlier one has got to."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, Literal

from workflow.case.changing import changed
from workflow.case.sections import Case
from workflow.case.writing import dump_case
from workflow.errors import UNWRITTEN, CaseError, NotWritten, UserError
from workflow.kinds import analysis_of, kind_of, load_case
from workflow.pictures.drawing import write_pictures
from workflow.shell.analysis import Analysis, Run
from workflow.shell.folder import ASIDE, MANIFEST, OutputFolder
from workflow.shell.lock import locked
from workflow.shell.reporter import Reporter

# Seconds in which a process that was cut off, or whoever started it, has come to its end.
PATIENCE = 60.0

Kept = Literal["finished", "unfinished", "other", "nothing"]


def run_case(case: Case, out: Path, force: bool) -> None:
    """Run a case from the start into a folder, by the cheapest model if it leaves that open.

    Raises FretscaleError; UserError too where another process works in the folder.
    """
    with _working(case, out) as gone:
        _start(case, out, force, gone)


def resume_run(out: Path) -> bool:
    """Continue the run in a folder from its last whole jump; False if it is finished already."""
    folder = OutputFolder(out)
    if not folder.case.exists():
        raise UserError(f"{out}: no run of fretscale here (case.yaml is missing)")
    case = load_case(folder.case)
    if folder.summary.exists():
        return False
    with _working(case, out) as gone:
        _go_on(case, folder, gone)
    return True


def bring_to_end(case: Case, root: Path, take_over: bool = False) -> bool:
    """Bring a case to its end in a folder, from where that has got to; False if it was there.

    A finished run of the same case stays, an unfinished one goes on from its last jump if it can,
    and what else the folder has of earlier runs gives way. For ``take_over`` see
    :func:`workflow.shell.lock.locked`. Raises FretscaleError.
    """
    with _working(case, root, PATIENCE, take_over) as gone:
        OutputFolder(root).refuse_foreign()
        kept = kept_in(root, case)
        if kept == "finished":
            return False
        resumable, folder = analysis_of(case).resumable, OutputFolder(root)
        if kept == "unfinished" and resumable is not None and resumable(folder):
            _go_on(load_case(folder.case), folder, gone)
        else:
            _start(case, root, True, gone)
        return True


def kept_in(root: Path, case: Case) -> Kept:
    """What a folder has of this case; "other" is a run of another case."""
    folder = OutputFolder(root)
    if not folder.case.exists():
        return "nothing"
    finished = folder.summary.exists()
    record = folder.read_summary().get("fidelity") if finished else folder.choice
    # As a run of it was claimed, after its open settings had been chosen.
    if not _is_case(folder.case, changed(case, (record or {}).get("chosen", {}))):
        return "other"
    if finished:
        return "finished"
    listed = folder.manifest is not None and folder.checkpoint.exists()
    return "unfinished" if listed and analysis_of(case).resumable is not None else "nothing"


@contextmanager
def _working(
    case: Case, out: Path, patience: float = 0.0, take_over: bool = False
) -> Iterator[str]:
    """Hold the folder of a run (see :func:`workflow.shell.lock.locked`).

    Raises NotWritten where the disk is full, with what goes on from there.
    """
    try:
        with locked(out, patience, take_over) as gone:
            yield gone
    except OSError as error:
        if error.errno not in UNWRITTEN:
            raise
        again = "the same command"
        if analysis_of(case).resumable is not None and OutputFolder(out).case.exists():
            again = f"`resume {out}`"
        where = error.filename or out
        raise NotWritten(f"{where}: {error.strerror}; go on with {again} once it can be") from error


def _start(case: Case, out: Path, force: bool, gone: str) -> None:
    """Run a case from the start; ``gone`` is what to tell of a process that was there before."""
    analysis = analysis_of(case)
    case, choice = analysis.choose(case)
    analysis.memory(case).check()
    folder = OutputFolder(out)
    stays = folder.claim(case, force, resumable=analysis.resumable is not None)
    folder.keep_choice(choice)
    _run(analysis, case, folder, gone, resume=False, stays=stays)


def _go_on(case: Case, folder: OutputFolder, gone: str) -> None:
    """Continue the run in a folder."""
    analysis, out = analysis_of(case), folder.root
    if analysis.resumable is None:
        raise UserError(
            f"{out}: a case of this kind takes up no run half done; start it again with "
            f"`fretscale run {folder.case} --out {out}`"
        )
    if folder.manifest is None:
        raise UserError(
            f"{out}: a run of an older version, which left no {MANIFEST} of its files; start it "
            f"again with `fretscale run {folder.case} --out DIR`"
        )
    analysis.memory(case).check()
    folder.clear_partial()
    folder.reserve_state()
    _run(analysis, case, folder, gone, resume=True)


def _run(
    analysis: Analysis,
    case: Case,
    folder: OutputFolder,
    gone: str,
    resume: bool,
    stays: Sequence[str] = (),
) -> None:
    def compute(file: Path, root: Path) -> bool:
        return bring_to_end(load_case(file), root)

    def draw(contents: Any) -> None:
        with reporter.stage("paraview and figures"):
            if analysis.pictures is not None:
                processes = analysis.drawing_processes
                write_pictures(case.output, folder, analysis.pictures, contents, processes)

    with closing(Reporter(folder.reserve_log(), append=resume)) as reporter:
        if gone:
            reporter.say(gone)
        if stays:
            reporter.warn(
                f"{', '.join(stays)}: in the folder before this run, and not of it; what has a "
                f"name that the run needs gets {ASIDE} at its end"
            )
        run = Run(kind_of(case), case, folder, reporter, resume, folder.choice, compute, draw)
        analysis.run(run)


def _is_case(path: Path, case: Case) -> bool:
    """Whether the file says this case, perhaps in the words of another version."""
    if path.read_text(encoding="utf-8") == dump_case(case):
        return True
    try:
        return load_case(path) == case
    except CaseError:
        return False
