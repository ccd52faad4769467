"""Writing of the report of a run, at its end or later from its folder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path, PurePath
from typing import Any

from workflow.case.sections import Case, Measured
from workflow.errors import RunChanged
from workflow.kinds import analysis_of, kind_of, load_case
from workflow.pictures.drawing import vector_figures
from workflow.report.run_page import ReportData, run_page
from workflow.shell.analysis import Analysis, Pictures
from workflow.shell.folders.folder import DIGESTS, OutputFolder
from workflow.shell.folders.lock import locked
from workflow.shell.folders.store import file_digest, read_bytes, write_text
from workflow.shell.output.quantities import CurvesOf
from workflow.shell.output.results import read_contents


def pictures_of(analysis: Analysis[Any], case: Case) -> Callable[[], Pictures] | None:
    """Return the functions that draw a case, including measured points; None if there are none."""
    if analysis.pictures is None or not case.measured:
        return analysis.pictures
    return partial(_with_measured, analysis.pictures, case.measured, analysis.curves)


def _with_measured(
    pictures: Callable[[], Pictures], measured: Sequence[Measured], curves: Sequence[CurvesOf]
) -> Pictures:
    from workflow.pictures.measured import with_measured  # it takes a second to load

    return with_measured(pictures(), measured, curves)


def write_page(run: ReportData, path: Path) -> None:
    """Write the report of a run, which appears under its name once it is complete."""
    write_text(path, run_page(run))


def write_report(root: Path, out: Path | None = None) -> Path:
    """Write the report of the finished run in a folder again, into the folder or a file ``out``.

    Its figures are drawn again, whether or not the case asks for any. Returns the path. Raises
    UserError if there is no finished run or if its files have changed.
    """
    if out is not None:
        run = report_data_of(root)
        out.parent.mkdir(parents=True, exist_ok=True)
        write_page(run, out)
        return out
    folder = OutputFolder(root)
    folder.check_ended()
    with locked(root):
        run = report_data_of(root)
        path = folder.reserve_report()
        write_page(run, path)
    return path


def report_data_of(root: Path, figures: bool = True) -> ReportData:
    """Return the finished run in a folder, with its figures drawn again if wanted.

    Raises UserError as :func:`write_report` does.
    """
    folder = OutputFolder(root)
    folder.check_ended()
    summary, results = folder.read_summary(), folder.results
    digests = summary[DIGESTS]
    if digests.get(results.name, "") != file_digest(results):
        raise RunChanged(f"{results}: differs from the run in {root}; {folder.again}")
    case = load_case(folder.case)
    return ReportData(
        case=case,
        case_text=read_bytes(folder.case).decode("utf-8"),
        kind=kind_of(case),
        summary=summary,
        input_files={name: digests[name] for name in digests if PurePath(name).is_absolute()},
        figures=_figures(root) if figures else {},
    )


def _figures(root: Path) -> dict[str, str]:
    folder = OutputFolder(root)
    case = load_case(folder.case)
    pictures = pictures_of(analysis_of(case), case)
    if pictures is None:
        return {}
    contents = read_contents(folder.results, pictures().contents)
    return vector_figures(pictures, contents, folder.results)
