"""``fretscale fit``: reads, fits and writes."""

from __future__ import annotations

from pathlib import Path

from workflow.errors import FolderTaken
from workflow.fit.fitting import Fitted, fit_joint, fit_wear
from workflow.fit.loops import fit_loops
from workflow.fit.profile_schema import ProfileFit
from workflow.fit.report import data_columns, parameter_columns, summary
from workflow.fit.schema import FitInput, JointFit, LoopFitSection
from workflow.fit.section import section_of
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.folders.lock import locked
from workflow.shell.folders.store import write_text
from workflow.shell.output.tables import write_table
from workflow.shell.terminal.screen import Loudness

FILES = {
    "fit.yaml": "the fit as given",
    "section.yaml": "the result, as a section of a case",
    "parameters.csv": "parameters with their bounds",
    "data.csv": "data, fitted values and residuals",
    "fit.png": "data, curves with bands, and residuals",
}
SUMMARY = "summary.json"
DIGITS = 12


def run_fit(
    given: FitInput,
    out: Path | None = None,
    force: bool = False,
    loudness: Loudness = Loudness.QUIET,
) -> Fitted:
    """Fit what the file of a fit names, with the runs that it needs below ``out``.

    Raises CaseError and InputFileError with file and line, UserError for data that allow no fit or
    a folder with another fit, unless ``force``, ConvergenceError where no start leads to a
    solution, MethodFailed for a run that fails.
    """
    there = [] if out is None else [name for name in (*FILES, SUMMARY) if (out / name).exists()]
    if there and not force:
        raise FolderTaken(f"{out}/{there[0]}: exists; give another folder, or --force")
    file = given.file
    if isinstance(file, ProfileFit):
        from workflow.fit.profiles import fit_profiles  # imports all solvers

        return fit_profiles(given, file, out, loudness)
    if isinstance(file, JointFit):
        return fit_joint(given, file)
    return fit_loops(given, file) if isinstance(file, LoopFitSection) else fit_wear(given, file)


def write_fit(fitted: Fitted, out: Path, force: bool = False) -> list[Path]:
    """Write section, tables, figure and summary into a folder; return their paths.

    Raises UserError for a folder that has them already, unless ``force``.
    """
    from workflow.fit.figures import write_figure

    section = section_of(fitted)
    with locked(out):
        folder = OutputFolder(out, "fit")
        asked, found, parameters, data, drawn, _ = folder.replace(
            {**FILES, SUMMARY: "the result, in numbers"}, force
        )
        write_text(asked, fitted.given.text)
        write_text(found, section)
        write_table(parameters, parameter_columns(fitted))
        write_table(data, data_columns(fitted), DIGITS)
        write_figure(fitted, drawn)
        folder.write_summary(summary(fitted, section))
    return [found, parameters, data, drawn, out / SUMMARY]
