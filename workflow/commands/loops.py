"""``fretscale loops``: friction, stiffness and energy of the loops in a measured record."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sa_solver.types import Array, Mask
from wear.joints.measured.loop_record import MeasuredLoopError
from wear.joints.measured.measured_loops import (
    MeanEstimate,
    MeasuredLoops,
    mean_estimate,
    measure_loops,
)
from workflow.analyses.wear.output.loop_table import write_loop_table
from workflow.case.fields import Quantity, quantity_of_option
from workflow.case.files.loop_file import BASE_UNITS, account, read_loop_file
from workflow.case.text.readable import percent
from workflow.errors import UserError
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.folders.lock import locked

TABLE, FIGURE = "loops.csv", "loops.png"
LOAD = Quantity("N", above=0.0, range_text="a force above 0 such as 60 N")
# Largest number of cycles that are printed.
MOST_ROWS = 12
WIDTH = 14


def loops_of_file(path: Path, columns: Sequence[str], normal_load: str | None) -> MeasuredLoops:
    """Measure the loops in a file.

    ``columns`` are texts ``KEY=NAME`` for columns with other headings; ``normal_load``, such as
    ``60 N``, is for a file without that column. Raises UserError.
    """
    record = read_loop_file(path, _names(columns))
    try:
        load = _normal_load(path, record.get("normal_load"), normal_load)
        return measure_loops(record["displacement"], record["force"], load, record.get("time"))
    except MeasuredLoopError as error:
        raise UserError(f"{path}: {error}") from error


def _names(columns: Sequence[str]) -> dict[str, str]:
    """Return the headings of columns by the quantity that they hold."""
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
    """Return the normal load of the file or of the command."""
    if text is None:
        return column
    if column is not None:
        raise UserError(f"{path}: has a column of the normal load; allowed: it or --normal-load")
    return quantity_of_option(text, LOAD, "--normal-load")


# --- report -------------------------------------------------------------------------------------


def report(loops: MeasuredLoops) -> list[str]:
    """Return the table of loops, the means of each step with standard errors, and notes."""
    steps = loops.steps
    many = len(steps) > 1
    columns = _shown(loops)
    rows = [["cycle", *(["step"] if many else []), *columns]]
    for cycle in _few(len(loops.energy)):
        step = [str(loops.step[cycle] + 1)] if many else []
        rows.append([str(cycle + 1), *step, *(column.cell(cycle) for column in columns.values())])
    for number in _few(len(steps)):
        rows += _means(steps[number], list(columns), str(number + 1) if many else "")
    lines = ["".join(f"{cell:>{WIDTH}}" for cell in row) for row in rows]
    if max(len(loops.energy), len(steps)) > MOST_ROWS:
        lines.append(f"only {MOST_ROWS} rows are shown; the table that --out writes has all loops")
    return [*lines, *_notes(loops)]


def _means(step: MeasuredLoops, names: Sequence[str], number: str) -> list[list[str]]:
    """Return the rows of a step: its means and, for several loops, their standard errors."""
    columns = _shown(step)
    beside = [number] if number else []
    given = [columns.get(name) for name in names]
    rows = [["mean", *beside, *("-" if one is None else one.mean_cell() for one in given)]]
    if len(step.energy) > 1:
        rows.append(["+-", *beside, *("-" if one is None else one.error_cell() for one in given)])
    return rows


class _Column(NamedTuple):
    """Values ``(c,)`` of the loops, their mean, and which of them are only a lower bound."""

    values: Array
    mean: MeanEstimate
    bounds: Mask

    def cell(self, cycle: int) -> str:
        return _cell(self.values[cycle], self.bounds[cycle])

    def mean_cell(self) -> str:
        return _cell(self.mean.value, self.bounds[0])

    def error_cell(self) -> str:
        return f"{self.mean.error:.1g}" if np.isfinite(self.mean.error) else "-"


def _cell(value: float, bound: bool) -> str:
    """Return a number as text, with ``>`` for a lower bound, and ``-`` if it is not known."""
    return f"{'>' if bound else ''}{value:.4g}" if np.isfinite(value) else "-"


def _shown(loops: MeasuredLoops) -> dict[str, _Column]:
    """Return the columns by heading; the mean stiffness is given only if all loops are similar."""
    per_micron = 1e-3
    some = bool(loops.sliding.any())
    kt = loops.stick_stiffness * per_micron
    columns = {
        "stroke [um]": _column(loops.stroke / per_micron),
        "energy [mJ]": _column(loops.energy),
        "kt [N/um]": _column(kt),
    }
    if (loops.step == loops.step[0]).all():
        stick = loops.stick_estimate
        mean = MeanEstimate(stick.value * per_micron, stick.error * per_micron)
        columns["kt [N/um]"] = columns["kt [N/um]"]._replace(mean=mean)
    if some:
        columns["kr [N/um]"] = _column(loops.residual_stiffness * per_micron)
    known = not np.isnan(loops.normal_load).any()
    sliding, stuck = ("mu", "mu at least") if known else ("mu N [N]", "force [N]")
    values = np.where(loops.sliding > 0.0, loops.friction_force, loops.force)
    values = values / loops.normal_load if known else values
    columns[sliding if some else stuck] = _column(values, some & (loops.sliding == 0.0))
    return columns


def _column(values: Array, bounds: Mask | None = None) -> _Column:
    none = np.zeros(len(values), dtype=np.bool_)
    return _Column(values, mean_estimate(values), none if bounds is None else bounds)


def _few(count: int) -> list[int]:
    """Return all cycles, or some of them from the first to the last."""
    if count <= MOST_ROWS:
        return list(range(count))
    return np.unique(np.linspace(0, count - 1, MOST_ROWS).round().astype(int)).tolist()


def _notes(loops: MeasuredLoops) -> list[str]:
    """Return notes on the meaning of the numbers."""
    count = int(loops.step[-1]) + 1
    notes = [account(loops), "kt is the slope right after a reversal, residual stiffness included"]
    if count > 1:
        notes.append(
            f"{count} steps of loops that agree in stroke, force and load; they have no common mean"
        )
    if np.isnan(loops.stick_stiffness).any():
        notes.append(
            "kt: unknown where fewer than 4 samples lie between a reversal and half of the "
            "loop's height; a fit of joint_law finds it from whole loops"
        )
    if loops.sliding.any():
        shares = np.unique(loops.sliding[loops.sliding > 0.0])
        least, most = f"{percent(shares[0])}", f"{percent(shares[-1])}"
        notes.append(
            f"the last {least if least == most else f'{least} to {most}'} of the branches slide: "
            "kr is their slope, mu half their distance over the normal load"
        )
    if not loops.slides:
        notes.append(
            f"no sliding branch{f' at {_strokes(loops)}' if loops.sliding.any() else ''}: half "
            "the force range over the normal load is only a lower bound of mu, and kr is "
            "unknown; a larger stroke would show both"
        )
    if np.isnan(loops.normal_load).any():
        notes.append("no normal load, so mu is unknown: give --normal-load or a column normal_load")
    return notes


def _strokes(loops: MeasuredLoops) -> str:
    """Return the strokes of the loops that do not slide, as text."""
    stuck = 1e3 * loops.stroke[loops.sliding == 0.0]
    least, most = f"{stuck.min():.4g}", f"{stuck.max():.4g}"
    return f"strokes of {least if least == most else f'{least} to {most}'} um"


# --- files --------------------------------------------------------------------------------------


def write_loops(loops: MeasuredLoops, out: Path, title: str, force: bool) -> list[Path]:
    """Write a table of loops for joint laws, with a row per cycle, and the figure.

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
    """Yield a row in base units for each loop whose stiffness is known.

    Columns that the record does not have are left out. If only some loops slide, the friction of
    the others is the mobilised one, as in the table of a wear run.
    """
    reversals, work = loops.reversals, loops.work
    values: dict[str, Array] = {
        "cycles": np.arange(1.0, len(loops.energy) + 1.0),
        # Energy since the first loop of the record began.
        "energy": work[reversals[:, 2]] - work[reversals.min()],
        "kt": loops.stick_stiffness,
        "energy_per_loop": loops.energy,
        "amplitude": 0.5 * loops.stroke,
        "force": loops.force,
    }
    if loops.slides:
        values["residual_stiffness"] = loops.residual_stiffness
    if not np.isnan(loops.normal_load).any():
        values["P"] = loops.normal_load
        if loops.sliding.any():
            values["mu"] = np.where(loops.sliding > 0.0, loops.friction, loops.mobilised)
            if not loops.slides:
                values["sliding"] = (loops.sliding > 0.0).astype(float)
    if np.isnan(loops.stick_stiffness).all():
        del values["kt"]
    for cycle in zip(*values.values(), strict=True):
        row = dict(zip(values, map(float, cycle), strict=True))
        if np.isfinite(row.get("kt", 0.0)):
            yield row
