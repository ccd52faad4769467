"""Writing of a comparison to a folder: table, page and figures."""

from __future__ import annotations

import re
from pathlib import Path

from workflow.comparing.compared import ComparedRuns
from workflow.comparing.showing import columns_of, comparison_page
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.folders.lock import locked
from workflow.shell.folders.store import write_text
from workflow.shell.output.tables import write_table

TABLE, PAGE, FIGURES = "compare.csv", "compare.html", "curves"


def write_comparison(comparison: ComparedRuns, out: Path, force: bool = False) -> list[Path]:
    """Write ``compare.csv``, ``compare.html`` and figures; return the paths of the first two.

    Raises UserError for a folder that has them already, unless ``force``, or that fretscale did not
    write.
    """
    # Imported here because plotting libraries take a second to load.
    from workflow.comparing.figures import figures_of
    from workflow.pictures.style import write_figures

    with locked(out):
        folder = OutputFolder(out, "comparison")
        whats = {TABLE: "results side by side", PAGE: "results, cases and curves side by side"}
        table, page = folder.replace(whats, force)
        drawn, vectors = figures_of(comparison), dict[str, str]()
        names = {_file_name(title): title for title in drawn}
        with folder.filling(FIGURES, "curves of all runs over each other") as figures:
            write_figures(
                ((name, drawn[title]) for name, title in names.items()), figures, vectors=vectors
            )
        write_table(table, columns_of(comparison))
        pictures = {names[name]: svg for name, svg in vectors.items()}
        write_text(page, comparison_page(comparison, pictures))
    return [table, page]


def _file_name(title: str) -> str:
    return re.sub(r"[^\w-]+", "_", title.lower()).strip("_")
