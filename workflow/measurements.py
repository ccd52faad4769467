"""Commands for measurements: loops, scars, and fits of parameters.

Everything heavy is imported inside the commands, so that ``--help`` answers at once.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder for a table and a figure.")
@click.option(
    "--normal-load", metavar="FORCE", help="Such as '60 N', if FILE has no column for it."
)
@click.option(
    "--column", "columns", multiple=True, metavar="KEY=NAME", help="Heading of FILE for a quantity."
)
@click.option("--force", is_flag=True, help="Overwrite what is there.")
def loops(
    file: Path, out: Path | None, normal_load: str | None, columns: tuple[str, ...], force: bool
) -> None:
    """Measure hysteresis loops in FILE.

    Tells friction, stiffness and energy of each of them.

    FILE is CSV with headings such as `displacement [um], force [N]`, and `time [s]` where samples
    are not evenly spaced, and `normal_load [N]` where it is known. Of the folder of a wear run with
    loops, those are read in the same way.
    """
    if file.is_dir():
        from workflow.commands.computed_loops import report_of_run

        if out is not None or normal_load is not None or columns:
            raise click.UsageError("a run has its loads and tables; allowed: no other options")
        for line in report_of_run(file):
            click.echo(line)
        return
    from workflow.commands.loops import loops_of_file, report, write_loops

    measured = loops_of_file(file, columns, normal_load)
    for line in report(measured):
        click.echo(line)
    if out is not None:
        for path in write_loops(measured, out, file.name, force):
            click.echo(path)


@click.command()
@click.argument("before", type=click.Path(path_type=Path))
@click.argument("after", type=click.Path(path_type=Path))
@click.option(
    "--worn", metavar="RECTANGLE", help="Worn area, from the middle: XMIN,XMAX,YMIN,YMAX."
)
@click.option(
    "--bare", nargs=3, metavar="UNIT DX DY", help="Unit and pitch of scans that do not state them."
)
@click.option("--out", type=click.Path(path_type=Path), help="Folder for table, map and figure.")
@click.option("--force", is_flag=True, help="Overwrite what is there.")
def scar(before: Path, after: Path, out: Path | None, force: bool, **given: Any) -> None:
    """Measure the wear between the scans BEFORE and AFTER.

    Tells depth and volume with 95 % bounds; the scans are laid over each other by what is not worn.
    """
    from workflow.commands.scar import report, scar_of_files, write_scar

    measured = scar_of_files(before, after, **given)
    for line in report(measured):
        click.echo(line)
    for path in [] if out is None else write_scar(measured, out, after.name, force):
        click.echo(path)


@click.command()
@click.argument("file", metavar="FIT", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder for section and figure.")
@click.option("--force", is_flag=True, help="Overwrite what is there.")
def fit(file: Path, out: Path | None, force: bool) -> None:
    """Find parameters of a case from measurements.

    FIT is a YAML file that names tables of measurements and what is free: `fretscale new` writes
    fit_joint, fit_loops, fit_wear and fit_profiles. Tells values with their standard deviations and
    95 % bounds, what the data do not determine, and what speaks against the fit; with --out writes
    the section of a case. fit_profiles needs it for its runs, which another call takes up.
    """
    from workflow.fit.report import report
    from workflow.fit.running import run_fit, write_fit
    from workflow.fit.schema import load_fit
    from workflow.shell.terminal.screen import Loudness

    fitted = run_fit(load_fit(file), out, force, Loudness.NORMAL)
    for line in report(fitted):
        click.echo(line)
    if out is not None:
        for path in write_fit(fitted, out, force):
            click.echo(path)
