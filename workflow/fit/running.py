"""``fretscale fit``: read, fit, tell, write."""

from __future__ import annotations

from pathlib import Path

from workflow.fit.fitting import Fitted
from workflow.fit.report import data_columns, parameter_columns, summary
from workflow.fit.section import section_of
from workflow.shell.folder import OutputFolder
from workflow.shell.lock import locked
from workflow.shell.store import write_text
from workflow.shell.tables import write_table

FILES = {
    "fit.yaml": "the fit as asked for",
    "section.yaml": "what was found, as a section of a case",
    "parameters.csv": "parameters with their bounds",
    "data.csv": "data, fitted values and residuals",
    "fit.png": "data, curves with bands, and residuals",
}
SUMMARY = "summary.json"
DIGITS = 12


def write_fit(fitted: Fitted, out: Path, force: bool = False) -> list[Path]:
    """Write section, tables, figure and summary into a folder; returns their paths.

    Raises UserError for a folder that has them already, unless ``force``.
    """
    from workflow.fit.figures import write_figure

    section = section_of(fitted)
    with locked(out):
        folder = OutputFolder(out, "fit")
        asked, found, parameters, data, drawn, _ = folder.replace(
            {**FILES, SUMMARY: "what came out, in numbers"}, force
        )
        write_text(asked, fitted.given.text)
        write_text(found, section)
        write_table(parameters, parameter_columns(fitted))
        write_table(data, data_columns(fitted), DIGITS)
        write_figure(fitted, drawn)
        folder.write_summary(summary(fitted, section))
    return [found, parameters, data, drawn, out / SUMMARY]
