"""The command ``fretscale``.

Everything heavy is imported inside the commands, so that ``--help`` answers at once.
"""

from __future__ import annotations

import shutil
import sys
import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from click.shell_completion import CompletionItem

from workflow import errors
from workflow.commands.group import OneLineGroup
from workflow.measurements import fit, loops, scar

if TYPE_CHECKING:
    from workflow.shell.terminal.screen import Loudness

Command = TypeVar("Command", bound=Callable[..., Any])

TO_TRY = """\
Three things to try:

  fretscale new bodies_wear ball.yaml      write a case: a ball wears on a flat
  fretscale check ball.yaml                what it would run, and how long
  fretscale run ball.yaml --out out/ball   run it: pictures in half a minute

All commands: `fretscale -h`; a case of few lines: `fretscale new KIND --short`.
"""


def _loud(command: Command) -> Command:
    """Add the switches of all commands that compute."""
    for switch, level, text in (
        ("-v/--verbose", "VERBOSE", "Print everything that goes to the log."),
        ("-q/--quiet", "QUIET", "Print only errors and warnings."),
    ):
        names = switch.split("/")
        command = click.option(*names, "loudness", flag_value=level, help=text)(command)
    return command


def _loudness(level: str | None) -> Loudness:
    from workflow.shell.terminal.screen import Loudness

    return Loudness[level or "NORMAL"]


@contextmanager
def _repeatable(out: Path) -> Iterator[None]:
    """Complete the message of Ctrl-C for a command that reuses its finished runs."""
    try:
        yield
    except KeyboardInterrupt as stop:
        raise KeyboardInterrupt(
            f"{out} keeps the finished runs; continue with the same command"
        ) from stop


@click.group(
    cls=OneLineGroup,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.version_option(package_name="fretscale")
@click.pass_context
def cli(context: click.Context) -> None:
    """Fretting wear across scales: a structure, its contacts, and how they wear.

    Exit codes: 0 done, 1 an expectation missed, 2 bad case or usage, 3 a method failed or the disk
    is full, 4 not enough memory, 130 interrupted.
    """
    if context.invoked_subcommand is None:
        click.echo(f"{context.command.get_short_help_str(80)}\n\n{TO_TRY}", nl=False)


@cli.command()
@click.argument("case", type=click.Path())
@click.option("--out", required=True, type=click.Path(path_type=Path), help="Folder to write.")
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="Change an entry.")
@click.option("--force", is_flag=True, help="Overwrite a folder that holds another run.")
@_loud
def run(
    case: str, out: Path, overrides: tuple[str, ...], force: bool, loudness: str | None
) -> None:
    """Run CASE and write its results."""
    from workflow.kinds import load_case

    loaded = load_case(case, overrides)
    from workflow.runs.run import run_case

    run_case(loaded, out, force, _loudness(loudness))


@cli.command()
@click.argument("folder", type=click.Path(exists=True, file_okay=False, path_type=Path))
@_loud
def resume(folder: Path, loudness: str | None) -> None:
    """Go on with an interrupted run in its FOLDER."""
    from workflow.runs.run import resume_run

    if not resume_run(folder, _loudness(loudness)) and loudness != "QUIET":
        click.echo(f"{folder}: this run is finished; nothing to do")


@cli.command()
@click.argument("folder", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option(
    "--out", type=click.Path(path_type=Path), help="File to write, instead of its report.html."
)
def report(folder: Path, out: Path | None) -> None:
    """Write the page of the finished run in FOLDER anew."""
    from workflow.report.writing import write_report

    click.echo(write_report(folder, out))


@cli.command()
@click.argument("cases", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--out",
    default=Path("out/verify"),
    show_default=True,
    type=click.Path(path_type=Path),
    help="Folder for the runs, one inside it for each case.",
)
@_loud
def verify(cases: tuple[Path, ...], out: Path, loudness: str | None) -> None:
    """Run CASES and compare with what they expect."""
    from workflow.runs.verify import verify_cases

    try:
        met = verify_cases(cases, out, _loudness(loudness))
    except KeyboardInterrupt as stop:
        raise KeyboardInterrupt(
            f"{out} is not complete; start again with the same command"
        ) from stop
    if not met:
        raise errors.ExpectationMissed("a result is outside the tolerance of what its case expects")


@cli.command()
@click.argument(
    "folders",
    nargs=-1,
    required=True,
    type=click.Path(exists=True, file_okay=False, path_type=Path),
)
@click.option("--out", type=click.Path(path_type=Path), help="Folder for table, page and figures.")
@click.option("--force", is_flag=True, help="Overwrite what is there.")
def compare(folders: tuple[Path, ...], out: Path | None, force: bool) -> None:
    """Put finished runs side by side: results, cases, curves.

    The first is the reference. All must be runs of one analysis.
    """
    from workflow.comparing import compare
    from workflow.comparing.showing import show

    compared = compare(folders)
    written: list[Path] = []
    if out is not None:
        from workflow.comparing.writing import write_comparison

        # Before anything is shown: an output that cannot be written ends the command.
        written = write_comparison(compared, out, force)
    show(compared)
    for path in written:
        click.echo(path)


@cli.command()
@click.argument("case", type=click.Path(path_type=Path))
@click.option("--out", required=True, type=click.Path(path_type=Path), help="Folder to write.")
@click.option("--axis", "axes", multiple=True, metavar="NAME", help="Only this approximation.")
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="Change an entry.")
@click.option(
    "--quantity", "quantities", multiple=True, metavar="PATH", help="Path in summary.json."
)
@click.option(
    "--accuracy", default="1 %", show_default=True, help="Accuracy for which settings are chosen."
)
@_loud
def chart(
    case: Path,
    out: Path,
    axes: tuple[str, ...],
    overrides: tuple[str, ...],
    quantities: tuple[str, ...],
    accuracy: str,
    loudness: str | None,
) -> None:
    """Chart error against cost for what CASE approximates.

    Each AXIS has a ladder of runs about the settings of CASE: grid, tolerance, method, stepper,
    dimension, coupling, history, mesh, order, step, harmonics, samples; by default all that apply.
    Finished runs are kept: the same command goes on where it was interrupted.
    """
    from workflow.chart import accuracy_of, chart_case
    from workflow.chart.report import show, write_chart
    from workflow.runs.first_look import look_at
    from workflow.shell.folders.lock import locked

    with _repeatable(out), locked(out) as gone:
        if gone and loudness != "QUIET":
            click.echo(gone, err=True)
        charted = chart_case(
            case,
            out,
            axes=axes,
            overrides=overrides,
            quantities=quantities,
            accuracy=accuracy_of(accuracy),
            loudness=_loudness(loudness),
        )
        reported = write_chart(charted, out)
    if loudness != "QUIET":
        show(charted)
        for line in look_at(out, reported):
            click.echo(line)
    if not charted.complete:
        raise errors.RunsFailed(f"{out}: some runs failed; the chart is of the others")


@cli.command()
@click.argument("file", metavar="SWEEP", type=click.Path(path_type=Path))
@click.option("--out", required=True, type=click.Path(path_type=Path), help="Folder to write.")
@click.option("--processes", type=click.IntRange(1), help="Cores to use; all by default.")
@click.option(
    "--dask", metavar="ADDRESS", help="Address of a dask.distributed scheduler, to run there."
)
@click.option("--force", is_flag=True, help="Overwrite runs of another case.")
@_loud
def sweep(
    file: Path,
    out: Path,
    processes: int | None,
    dask: str | None,
    force: bool,
    loudness: str | None,
) -> None:
    """Run a case many times with other values, as SWEEP says.

    SWEEP is a YAML file with the `case`, what to `vary` and the `design`: grid, zip or sample. All
    cases are checked before anything runs. A run that fails does not stop the others; the exit code
    then is 3. Finished runs are kept: the same command goes on where it was interrupted.

    With --dask the runs go to a cluster whose machines share the folders, such as one that
    dask-jobqueue's SLURMCluster starts; they go on elsewhere where a worker dies.
    """
    if processes is not None and dask is not None:
        raise errors.UserError("--processes is for this machine; allowed: it or --dask")
    from workflow.sweep import run_sweep

    reported = _loudness(loudness)
    with _repeatable(out):
        done = run_sweep(file, out, processes=processes, dask=dask, force=force, loudness=reported)
    if not done:
        raise errors.RunsFailed(f"{out}: some runs failed; its table says why")


@cli.command()
@click.argument("case", type=click.Path())
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="Change an entry.")
@click.option("--out", type=click.Path(path_type=Path), help="Folder for a picture of the faces.")
@click.option("--force", is_flag=True, help="Overwrite what is there.")
def check(case: str, overrides: tuple[str, ...], out: Path | None, force: bool) -> None:
    """Read CASE; say what it would run, and how long.

    Says what is given in plain units, what looks like a slip, and whether the memory is enough.
    With --out the contact faces of a meshed structure are drawn: where they are, and how far apart.
    """
    from workflow.case.plausibility import plausibility_warnings_of
    from workflow.case.text.leaves import taken
    from workflow.kinds import analysis_of, load_case
    from workflow.shell.output.measured import check_measured

    loaded = load_case(case, overrides)
    analysis = analysis_of(loaded)
    check_measured(loaded, analysis.curves, analysis.layout(loaded))
    memory, run_time = analysis.memory(loaded), analysis.run_time(loaded)
    memory.check()
    click.echo(f"OK {case}: {loaded.title}")
    needed = ("memory", f"up to {memory.required / 1e9:.1f} GB"), ("time", run_time.text)
    for name, text in [*loaded.outline(), *taken(loaded), *needed]:
        click.echo(_fitted(f"  {name:<10} {text}", indent=13))
    for warning in plausibility_warnings_of(loaded):
        click.echo(_fitted(f"warning: {warning}", indent=2))
    if out is not None:
        if analysis.draw_faces is None:
            raise errors.UserError(f"{case}: has no faces to draw; allowed with --out: a wear case")
        click.echo(str(analysis.draw_faces(loaded, case, out, force)))


def _fitted(line: str, indent: int) -> str:
    """Return a line wrapped to the width of the terminal; unchanged if there is no terminal."""
    if sys.stdout is None or not sys.stdout.isatty():
        return line
    width = shutil.get_terminal_size().columns
    return "\n".join(textwrap.wrap(line, width, subsequent_indent=indent * " "))


@cli.command()
@click.argument("case", type=click.Path())
@click.option("--out", required=True, type=click.Path(path_type=Path), help="Folder to write.")
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="Change an entry.")
@click.option("--force", is_flag=True, help="Overwrite what is there.")
def resultants(case: str, out: Path, overrides: tuple[str, ...], force: bool) -> None:
    """Write the contact loads of the structure of CASE."""
    from workflow.kinds import analysis_of, load_case

    loaded = load_case(case, overrides)
    write_loads = analysis_of(loaded).write_loads
    if write_loads is None:
        raise errors.UserError(
            f"{case}: a case of this kind has no structure to take loads from; allowed: a wear case"
        )
    for line in write_loads(loaded, case, out, force):
        click.echo(line)


@cli.command()
@click.argument("folder", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--body", type=click.Choice(["1", "2"]), required=True, help="1 is the lower body.")
@click.option("--unworn", is_flag=True, help="Before the first cycle.")
@click.option("--interface", help="Name, if there are several.")
@click.option("--force", is_flag=True, help="Overwrite the file.")
def surface(folder: Path, file: Path, **given: Any) -> None:
    """Write a surface of the run in FOLDER to a profilometer's FILE.

    By its ending: .x3p, .sur, .al3d or .sdf; .npz without further libraries.
    """
    from workflow.commands.surface import write_surface

    click.echo(write_surface(folder, file, **given))


@cli.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--size", metavar="LENGTH", help="Size of the elements, for a CAD file, such as '2 mm'."
)
@click.option("--unit", help="Unit of lengths in the file: mm, um, cm, m, in or ft.")
@click.option("--out", type=click.Path(path_type=Path), help="Folder for a picture and a .vtu.")
@click.option(
    "--case", type=click.Path(path_type=Path), help="File for a case of what FILE contains."
)
@click.option("--force", is_flag=True, help="Overwrite what is there.")
def describe(
    file: Path,
    size: str | None,
    unit: str | None,
    out: Path | None,
    case: Path | None,
    force: bool,
) -> None:
    """List what a case may name of a mesh or CAD FILE.

    That is bodies, boundaries and node sets; with --out they are drawn, too. With --case its
    contacts, supports, loads and materials become a case, whose other entries are to be filled in.
    """
    from dataclasses import replace

    from fe_models.geometry.imported import describe_bodies
    from workflow.commands.describe import read_file, write_assembly, write_offer

    imported = read_file(file, size, unit)
    # Contents that are not in the case are listed when the case is written.
    for line in describe_bodies(imported if case is None else replace(imported, unused=())):
        click.echo(line)
    if out is not None:
        for path in write_assembly(imported, out, file.name, force):
            click.echo(path)
    if case is not None:
        for line in write_offer(imported, file, size, case, force):
            click.echo(line)


def _kinds() -> dict[str, str]:
    """Return each kind of file that ``new`` writes, with a line about it."""
    from workflow.commands.new import offered

    return offered()


class _Kind(click.ParamType):
    """Kind of case, completed by the shell."""

    name = "kind"

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        return [
            CompletionItem(kind, help=text)
            for kind, text in _kinds().items()
            if kind.startswith(incomplete)
        ]


class _KindsInHelp(click.Command):
    """Command whose help ends with the kinds of case."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("KIND is one of"):
            formatter.write_dl(list(_kinds().items()))


@cli.command(cls=_KindsInHelp)
@click.argument("kind", required=False, type=_Kind())
@click.argument("file", required=False, type=click.Path(path_type=Path))
@click.option("--short", is_flag=True, help="Only the required entries.")
def new(kind: str | None, file: Path | None, short: bool) -> None:
    """Write a commented case to FILE; without KIND list the kinds.

    An example of a file that the case names is written beside it, where there is none yet.
    """
    from workflow.commands.new import text_of, write_new

    if kind is None:
        for name, text in _kinds().items():
            click.echo(f"{name:<18} {text}")
    elif file is None:
        click.echo(text_of(kind, short), nl=False)
    else:
        example = write_new(kind, file, short)
        if example is not None:
            click.echo(f"{example}: an example, which {file} names; replace it by your own file")


@cli.command()
def materials() -> None:
    """List the materials that a case may name, with sources."""
    from workflow.commands.materials import known_materials

    for line in known_materials():
        click.echo(line)


@cli.command()
@click.argument("code", required=False)
def explain(code: str | None) -> None:
    """Explain the CODE of a warning or an error, such as FS-W102.

    Without CODE, list all codes.
    """
    from workflow.commands.explain import explained

    for name, text in explained(code):
        click.echo(_fitted(f"{name:<9} {text}", indent=10))


@cli.command()
def schema() -> None:
    """Print the JSON schema of a case, a sweep or a fit, for editors."""
    import json

    from workflow.fit.template import FITS
    from workflow.kinds import json_schema
    from workflow.sweep.schema import AnySweepFile
    from workflow.sweep.template import ABOUT, SWEEP

    made = json_schema({SWEEP: (AnySweepFile, ABOUT), **FITS})
    click.echo(json.dumps(made, indent=1, allow_nan=False, ensure_ascii=False))


for _command in (loops, scar, fit):
    cli.add_command(_command)


def main() -> None:
    """Run the command line; this is the entry point of the command."""
    from workflow.shell.terminal.signals import end_tidily, ignore_signals
    from workflow.shell.terminal.streams import hold_standard_streams, replace_missing_characters

    hold_standard_streams()
    replace_missing_characters()
    end_tidily()
    try:
        cli(prog_name="fretscale")
    except KeyboardInterrupt:  # pressed again while the first interruption was being reported
        sys.exit(errors.INTERRUPTED)
    finally:
        ignore_signals()
