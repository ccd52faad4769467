"""Run of a case of any kind in its folder, from the start or from where an earlier run stopped."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path
from typing import Any, Literal

from workflow.case.changing import changed
from workflow.case.plausibility import plausibility_warnings_of
from workflow.case.sections import Case
from workflow.case.text.writing import dump_case
from workflow.errors import UNWRITTEN, CaseError, NotWritten, UserError
from workflow.kinds import analysis_of, kind_of, load_case
from workflow.messages.warning_kinds import WarningKind
from workflow.pictures.drawing import load_what_draws, write_pictures
from workflow.report.run_page import ReportData
from workflow.report.writing import pictures_of, write_page
from workflow.runs.first_look import first_look
from workflow.runs.provenance import case_values, provenance_of
from workflow.shell.analysis import Analysis, Pictures, Run, Share, Summary
from workflow.shell.folders import checkpoint
from workflow.shell.folders.checkpoint import StoredState
from workflow.shell.folders.folder import ASIDE, MANIFEST, REPORT, OutputFolder
from workflow.shell.folders.lock import locked
from workflow.shell.folders.store import read_bytes
from workflow.shell.output.measured import check_measured, tell_measured
from workflow.shell.processes import WorkerProcess
from workflow.shell.run_time import RunTime
from workflow.shell.terminal.reporter import FORECAST, SHORT_RUN, TERMINAL, Reporter, telling
from workflow.shell.terminal.screen import Loudness, Screen
from workflow.shell.terminal.signals import remembering_interruptions

# Seconds after which an interrupted process, and the process that started it, have surely ended.
PATIENCE = 60.0

Kept = Literal["finished", "unfinished", "other", "nothing"]


def run_case(case: Case, out: Path, force: bool, loudness: Loudness = Loudness.NORMAL) -> None:
    """Run a case from the start in a folder, with the cheapest model if the case leaves it open.

    Raises FretscaleError, in particular UserError if another process works in the folder.
    """
    with _working(case, out) as gone:
        _start(case, out, force, gone, loudness=loudness)


def resume_run(out: Path, loudness: Loudness = Loudness.NORMAL) -> bool:
    """Resume the run in a folder from its last saved state; return False if it is finished.

    Temporary files that a finished run did not remove are removed.
    """
    folder = OutputFolder(out)
    folder.check_run()
    case = load_case(folder.case)
    if folder.summary.exists():
        folder.check_finished(case_values(folder))
        if folder.has_leftovers:
            with _working(case, out):
                folder.check_finished(case_values(folder))
                folder.clear_leftovers()
        return False
    with _working(case, out) as gone:
        _go_on(case, folder, gone, loudness)
    return True


def bring_to_end(
    case: Case, root: Path, take_over: bool = False, loudness: Loudness = Loudness.NORMAL
) -> bool:
    """Complete a case in a folder, resuming an earlier run; return False if it was finished.

    A finished run of the same case is reused, an unfinished one is resumed from its last saved
    state if possible, and other files of earlier runs are replaced. For ``take_over`` see
    :func:`workflow.shell.folders.lock.locked`. Raises FretscaleError.
    """
    with _working(case, root, PATIENCE, take_over) as gone:
        OutputFolder(root).refuse_foreign()
        (kept, damaged), folder = _stored_and_damaged(root, case), OutputFolder(root)
        if kept == "finished":
            folder.clear_leftovers()
            return False
        if kept == "unfinished":
            _go_on(load_case(folder.case), folder, gone, loudness)
        else:
            _start(case, root, True, gone, damaged, loudness)
        return True


def stored_run(root: Path, case: Case) -> Kept:
    """Return what kind of run a folder has of this case; "other" is a run of another case.

    A run whose files, or whose input files, have changed counts as "nothing".
    """
    return _stored_and_damaged(root, case)[0]


def _stored_and_damaged(root: Path, case: Case) -> tuple[Kept, str]:
    """Return what a folder has of this case, and why a damaged run there cannot be used."""
    folder, record, damaged = OutputFolder(root), None, ""
    if not folder.case.exists():
        return "nothing", ""
    finished = folder.summary.exists()
    try:
        record = folder.read_summary().get("choice") if finished else folder.choice
    except UserError as error:
        damaged = str(error)
    # The folder has the case with its open settings chosen, so the comparison needs the same.
    if not _is_case(folder.case, changed(case, (record or {}).get("chosen", {}))):
        return "other", ""
    try:
        if finished and not damaged:
            folder.check_finished(case_values(folder))
            return "finished", ""
        listed = folder.lists_state and folder.checkpoint.exists()
        if listed and not damaged and analysis_of(case).resumable:
            _state(folder, case)
            return "unfinished", ""
    except UserError as error:
        damaged = str(error)
    return "nothing", damaged


def _state(folder: OutputFolder, case: Case) -> StoredState | None:
    """Return the state that an unfinished run resumes from; None if none was saved."""
    if not folder.checkpoint.exists():
        return None
    return checkpoint.load(folder, provenance_of(folder, case))


@contextmanager
def _working(
    case: Case, out: Path, patience: float = 0.0, take_over: bool = False
) -> Iterator[str]:
    """Hold the folder of a run (see :func:`workflow.shell.folders.lock.locked`).

    Raises NotWritten if the disk is full, and KeyboardInterrupt if the run is stopped; their
    messages say how to resume.
    """
    try:
        with remembering_interruptions(), locked(out, patience, take_over) as gone:
            yield gone
    except KeyboardInterrupt as stop:
        raise KeyboardInterrupt(_stopped(analysis_of(case), OutputFolder(out))) from stop
    except OSError as error:
        if error.errno not in UNWRITTEN:
            raise
        again = "the same command"
        if analysis_of(case).resumable and OutputFolder(out).case.exists():
            again = f"`{OutputFolder(out).resume_command}`"
        where = error.filename or out
        raise NotWritten(
            f"{where}: {error.strerror}; continue with {again} once it is possible"
        ) from error


def _start(
    case: Case,
    out: Path,
    force: bool,
    gone: str,
    damaged: str = "",
    loudness: Loudness = Loudness.NORMAL,
) -> None:
    """Run a case from the start.

    ``gone`` is a message about an earlier process in the folder, ``damaged`` says why its run
    cannot be used.
    """
    analysis = analysis_of(case)
    check_measured(case, analysis.curves, analysis.layout(case))
    with closing(Screen(loudness > Loudness.QUIET)) as screen, screen.row("choice of settings"):
        case, choice = analysis.choose(case)
    analysis.memory(case).check()
    folder = OutputFolder(out)
    stays = folder.claim(case, force, analysis.resumable)
    folder.keep_choice(choice)
    if damaged:
        damaged = f"an earlier run is not used: {damaged}"
    _run(analysis, case, folder, (gone, damaged), loudness, stays=stays)


def _go_on(
    case: Case, folder: OutputFolder, gone: str, loudness: Loudness = Loudness.NORMAL
) -> None:
    """Resume the run in a folder."""
    analysis, out = analysis_of(case), folder.root
    if not analysis.resumable:
        raise UserError(
            f"{out}: a case of this kind cannot continue a half-done run; start it again with "
            f"`{folder.run_command}`"
        )
    if not folder.lists_state:
        raise UserError(
            f"{out}: its {MANIFEST} does not list its files: it is damaged, or of an older "
            f"version; start it again with `fretscale run {folder.case} --out DIR`"
        )
    kept = _state(folder, case)
    analysis.memory(case).check()
    folder.clear_partial()
    folder.reserve_state()
    new = "" if kept else "no state was stored: from the start"
    _run(analysis, case, folder, (gone, new), loudness, resume=True, kept=kept)


def _run(
    analysis: Analysis,
    case: Case,
    folder: OutputFolder,
    reported: Sequence[str],
    loudness: Loudness,
    resume: bool = False,
    kept: StoredState | None = None,
    stays: Sequence[str] = (),
) -> None:
    def compute(file: Path, root: Path) -> bool:
        return bring_to_end(load_case(file), root)

    def draw(contents: Any) -> None:
        isolated, output = reporter.isolated, case.output
        with reporter.stage("paraview and figures", "pictures") as reported, isolated("figures"):
            if pictures is not None:
                drawn.extend(_names(pictures, case, contents))
                told_of = folder, pictures, contents, isolated
                figures.update(write_pictures(output, *told_of, worker, share, reported))

    def report(summary: Summary) -> None:
        with reporter.isolated(REPORT):
            if case.output.report:
                _report(run, summary, figures)

    pictures, share = pictures_of(analysis, case), _share(analysis, case)
    figures: dict[str, str] = {}
    drawn: list[str] = []
    with (
        closing(Reporter(folder.reserve_log(), resume, loudness=loudness)) as reporter,
        closing(WorkerProcess()) as worker,
    ):
        with reporter.isolated(FORECAST):
            reporter.expected = analysis.run_time(case)
        for line in filter(None, reported):
            reporter.say(line)
        if stays:
            reporter.warn(
                WarningKind.FOREIGN_FILES,
                f"{', '.join(stays)}: in the folder before this run, and not part of it; files "
                f"whose names the run needs get {ASIDE} at their end",
            )
        _announce(case, reporter.expected, resume, reporter)
        run = Run(
            kind=kind_of(case),
            case=case,
            folder=folder,
            reporter=reporter,
            resume=resume,
            kept=kept,
            provenance=provenance_of(folder, case),
            choice=folder.choice,
            compute=compute,
            draw=draw,
            measured=partial(tell_measured, case, analysis.curves, folder.results),
            report=report,
            worker=worker,
        )
        if share != "nothing":
            with reporter.isolated("figures"):
                worker.begin(load_what_draws, pictures, case.output, share)
        with telling(reporter):
            analysis.run(run)
        with reporter.isolated(TERMINAL):
            for line in first_look(folder.root, drawn):
                reporter.say(line)


def _names(pictures: Callable[[], Pictures], case: Case, contents: Any) -> list[str]:
    """Return the figures of a run, without loading the plotting library if none are wanted."""
    return list(pictures().figures_of(contents)) if case.output.figure_formats else []


def _share(analysis: Analysis, case: Case) -> Share:
    """Return the share of the pictures of a run that the worker process draws."""
    output = case.output
    alone = analysis.in_worker == "files" and not output.paraview
    return "nothing" if alone or not output.figure_formats else analysis.in_worker


def _announce(case: Case, expected: RunTime, resume: bool, reporter: Reporter) -> None:
    """Report which case runs, about how long, and the plausibility warnings of the case."""
    long = not resume and expected.seconds >= SHORT_RUN
    takes = f" ({expected.short})" if long else ""
    reporter.say(f"{'resume' if resume else 'run'}: {case.title}{takes}")
    for warning in plausibility_warnings_of(case):
        reporter.say(f"warning: {warning}", always=True)


def _stopped(analysis: Analysis, folder: OutputFolder) -> str:
    """Return what a run has left after Ctrl-C, and the command that resumes it."""
    out = folder.root
    if not folder.case.exists():
        return f"{out} is still empty; start again with the same command"
    if folder.summary.exists():
        return f"{out} is finished, but for files that `{folder.resume_command}` removes"
    if not analysis.resumable:
        return f"{out} is not finished; start again with `{folder.run_command}`"
    return f"{out} keeps what is done; continue with `{folder.resume_command}`"


def _report(run: Run[Any], summary: Summary, figures: Mapping[str, str]) -> None:
    """Write the report of a run."""
    reported = ReportData(
        case=run.case,
        case_text=read_bytes(run.folder.case).decode("utf-8"),
        kind=run.kind,
        summary=summary,
        input_files=run.provenance["input_files"],
        figures=figures,
    )
    write_page(reported, run.folder.reserve_report())


def _is_case(path: Path, case: Case) -> bool:
    """Return whether the file contains this case, possibly written by another version."""
    if read_bytes(path) == dump_case(case).encode("utf-8"):
        return True
    try:
        return load_case(path) == case
    except CaseError:
        return False
