"""``fretscale loops``: friction, stiffness and energy of the loops in a measured record."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from sa_solver.types import Array
from wear.joints.loop_record import MeasuredLoopError
from wear.joints.measured_loops import MeanEstimate, MeasuredLoops, mean_estimate, measure_loops
from workflow.analyses.wear.loop_table import write_loop_table
from workflow.case.loop_file import BASE_UNITS, read_loop_file
from workflow.case.units import UnitError, to_base
from workflow.errors import UserError
from workflow.shell.folder import OutputFolder
from workflow.shell.lock import locked

TABLE, FIGURE = "loops.csv", "loops.png"
# More cycles than this are not all printed.
MOST_ROWS = 12
WIDTH = 14


def loops_of_file(path: Path, columns: Sequence[str], normal_load: str | None) -> MeasuredLoops:
    """Measure the loops in a file.

    ``columns`` are texts ``KEY=NAME`` for columns that are called otherwise; ``normal_load`` such
    as ``60 N`` is for a file without one. Raises UserError.
    """
    record = read_loop_file(path, _names(columns))
    try:
        load = _normal_load(path, record.get("normal_load"), normal_load)
        return measure_loops(record["displacement"], record["force"], load, record.get("time"))
    except MeasuredLoopError as error:
        raise UserError(f"{path}: {error}") from error


def _names(columns: Sequence[str]) -> dict[str, str]:
    """Names of columns by what they are."""
    names: dict[str, str] = {}
    for text in columns:
        key, equals, name = (part.strip() for part in text.partition("="))
        if key not in BASE_UNITS or not equals or not name:
            allowed = ", ".join(f"{key}=NAME" for key in BASE_UNITS)
            raise UserError(f"--column {text}: no such column; allowed: {allowed}")
        if key in names or name in names.values():
            raise UserError(f"--column {text}: given twice; allowed: once")
        names[key] = name
    return names


def _normal_load(path: Path, column: Array | None, text: str | None) -> Array | float | None:
    """The normal load of the file or of the command."""
    if text is None:
        return column
    if column is not None:
        raise UserError(f"{path}: has a column of the normal load; allowed: it or --normal-load")
    try:
        load = _number(text) or to_base(text, "N")
    except UnitError as error:
        raise UserError(f"--normal-load {text}: {error}; allowed: a force such as 60 N") from error
    if not load > 0.0:
        raise UserError(f"--normal-load {text}: not above 0; allowed: a force such as 60 N")
    return load


def _number(text: str) -> float | None:
    """A bare number; None of anything else."""
    try:
        return float(text)
    except ValueError:
        return None


# --- what is printed ----------------------------------------------------------------------------


def report(loops: MeasuredLoops) -> list[str]:
    """The table of cycles, their means with standard errors, and what to know of them."""
    columns = _shown(loops)
    rows = [["cycle", *columns]]
    count = len(loops.energy)
    for cycle in _few(count):
        values = [values[cycle] for values, _ in columns.values()]
        rows.append([str(cycle + 1), *(f"{value:.4g}" for value in values)])
    rows.append(["mean", *(f"{estimate.value:.4g}" for _, estimate in columns.values())])
    if count > 1:
        rows.append(["+-", *(f"{estimate.error:.1g}" for _, estimate in columns.values())])
    lines = ["".join(f"{cell:>{WIDTH}}" for cell in row) for row in rows]
    return [*lines, *_notes(loops)]


def _shown(loops: MeasuredLoops) -> dict[str, tuple[Array, MeanEstimate]]:
    """Values ``(c,)`` and their mean, by heading."""
    per_micron = 1e-3
    stick = loops.stick_estimate
    columns = {
        "stroke [um]": _with_mean(loops.stroke / per_micron),
        "energy [mJ]": _with_mean(loops.energy),
        "kt [N/um]": (
            loops.stick_stiffness * per_micron,
            MeanEstimate(stick.value * per_micron, stick.error * per_micron),
        ),
    }
    if loops.slides:
        columns["kr [N/um]"] = _with_mean(loops.residual_stiffness * per_micron)
    if not np.isnan(loops.normal_load).any():
        mu = loops.friction if loops.slides else loops.mobilised
        columns["mu" if loops.slides else "mu at least"] = _with_mean(mu)
    else:
        force = loops.friction_force if loops.slides else loops.force
        columns["mu N [N]" if loops.slides else "force [N]"] = _with_mean(force)
    return columns


def _with_mean(values: Array) -> tuple[Array, MeanEstimate]:
    return values, mean_estimate(values)


def _few(count: int) -> list[int]:
    """All cycles, or some of them from the first to the last."""
    if count <= MOST_ROWS:
        return list(range(count))
    return np.unique(np.linspace(0, count - 1, MOST_ROWS).round().astype(int)).tolist()


def _notes(loops: MeasuredLoops) -> list[str]:
    """What the numbers mean."""
    notes = ["kt is the slope right after a reversal, residual stiffness included"]
    if loops.slides:
        notes.append(
            f"the last {loops.sliding:.0%} of the branches slide: kr is their slope, mu half "
            "their distance over the normal load"
        )
    else:
        notes.append(
            "no sliding branch: half the force range over the normal load is a lower bound of mu, "
            "and kr is not known; a larger stroke would show both"
        )
    if np.isnan(loops.normal_load).any():
        notes.append("no normal load, so no mu: give --normal-load or a column normal_load")
    return notes


# --- what is written ----------------------------------------------------------------------------


def write_loops(loops: MeasuredLoops, out: Path, title: str, force: bool) -> list[Path]:
    """Write a row per cycle, as a table of loops for joint laws, and the figure.

    Raises UserError for a folder that has them already, unless ``force``.
    """
    from workflow.commands.loops_figure import write_figure

    with locked(out):
        folder = OutputFolder(out, "record of loops")
        paths = folder.replace(dict.fromkeys((TABLE, FIGURE), "measured loops"), force)
        write_loop_table(paths[0], list(_rows(loops)))
        write_figure(loops, title, paths[1])
    return paths


def _rows(loops: MeasuredLoops) -> Iterator[dict[str, float]]:
    """A row per cycle, in base units; columns that the record does not have are left out."""
    values: dict[str, Array] = {
        "cycles": np.arange(1.0, len(loops.energy) + 1.0),
        # Since the first cycle of the record began.
        "energy": np.cumsum(loops.energy),
        "kt": loops.stick_stiffness,
        "energy_per_loop": loops.energy,
        "amplitude": 0.5 * loops.stroke,
        "force": loops.force,
    }
    if loops.slides:
        values["residual_stiffness"] = loops.residual_stiffness
    if not np.isnan(loops.normal_load).any():
        values["P"] = loops.normal_load
        if loops.slides:
            values["mu"] = loops.friction
    for cycle in zip(*values.values(), strict=True):
        yield dict(zip(values, map(float, cycle), strict=True))
