"""Tangential loops on the worn contacts of a wear run, and the table that joint laws read of them.

A loop is run where it is due (unworn, after every wear step or only at the end), is kept with the
fields of its jump, so that a resumed run still has it, and ends up in ``results.h5`` and, one row
per loop, in ``loops_<interface>.csv``.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from sa_solver.contact import FrictionalContact
from sa_solver.tangential_loop import (
    CLOSED,
    MOST_CYCLES,
    LoopFailure,
    LoopPath,
    tangential_loop,
)
from sa_solver.types import Array
from wear.full_cycle import IMPOSSIBLE
from wear.stepping import ContactFailure
from workflow.case.loops import Loops
from workflow.case.units import UnitError, to_base
from workflow.errors import UserError
from workflow.store import replacing

if TYPE_CHECKING:
    from workflow.contact_stage import InterfaceState
    from workflow.folder import OutputFolder
    from workflow.reporter import Reporter
    from workflow.store import ResultsWriter


@dataclass(frozen=True)
class Column:
    """A column of the table: ``unit`` is the base unit, ``shown`` the unit it is written in.

    ``extensive`` quantities are per mm in a line contact.
    """

    name: str
    unit: str
    shown: str
    description: str
    extensive: bool = True

    def units(self, per_length: bool) -> tuple[str, str]:
        """Base unit and the one written."""
        per = "/mm" if per_length and self.extensive else ""
        return self.unit + per, self.shown + per

    def heading(self, per_length: bool) -> str:
        """Name and unit, as they head the column."""
        return f"{self.name} [{self.units(per_length)[1]}]"


COLUMNS = (
    Column("cycles", "1", "1", "cycles", extensive=False),
    Column("energy", "N*mm", "J", "energy that wear has dissipated so far"),
    Column("P", "N", "N", "normal force"),
    Column("kt", "N/mm", "N/mm", "tangential stiffness of the stuck contact"),
    Column("mu", "1", "1", "largest tangential over normal force", extensive=False),
    Column("energy_per_loop", "N*mm", "mJ", "energy dissipated in the loop"),
    Column("area", "mm^2", "mm^2", "area in contact"),
    Column("amplitude", "mm", "mm", "half the range of the displacement", extensive=False),
    Column("force", "N", "N", "half the range of the tangential force"),
    Column("sliding", "1", "1", "share of P on cells that slip as branches end", extensive=False),
    Column("residual_stiffness", "N/mm", "N/mm", "slope of the loop as branches end"),
    Column("border_load", "1", "1", "share of P on the grid's outermost cells", extensive=False),
)
# Measured by every loop; cycles come from the jump.
MEASURED = tuple(column.name for column in COLUMNS if column.name != "cycles")
# Without these a table is none.
NEEDED = ("energy", "P", "kt", "mu")
CURVES = {
    "displacement": ("mm", "of body 1 relative to body 2 along the axis, from the pressed state"),
    "force": ("N", "tangential force on body 2"),
}
HEADING = re.compile(r"\s*(\w+)\s*(?:\[(.*)\])?\s*")
# Interfaces and jumps are groups of a file.
LOOPS = "loops"


@dataclass(frozen=True)
class WornLoop:
    """A loop on worn surfaces: ``values`` by the names ``MEASURED``, in base units.

    ``displacement`` [mm] and ``force`` [N] ``(k,)`` are its curve, first loading included.
    """

    values: dict[str, float]
    displacement: Array
    force: Array


@dataclass(frozen=True)
class LoopTable:
    """Columns of a table of loops, ``(k,)`` each, in base units: see ``COLUMNS``.

    ``energy`` ascends; columns that the file does not have are NaN. ``per_length`` says that
    energies, forces, stiffnesses and areas are per mm.
    """

    cycles: Array
    energy: Array
    P: Array
    kt: Array
    mu: Array
    energy_per_loop: Array
    area: Array
    amplitude: Array
    force: Array
    sliding: Array
    residual_stiffness: Array
    border_load: Array
    per_length: bool


# --- running ------------------------------------------------------------------------------------


def loops_due(loops: Loops, jump: int, ended: bool) -> bool:
    """Whether a loop is to be run after ``jump``."""
    return loops.wanted and (loops.every == "jump" or jump == 0 or ended)


def worn_loop(
    contact: FrictionalContact, loops: Loops, name: str, state: InterfaceState, peak: int
) -> WornLoop:
    """The loop of the contact ``name`` in its present state, under its loads at ``peak``.

    A normal force of one's own acts along the same line. Raises ContactFailure if it does not
    converge or friction cannot carry it, UserError for a contact without load.
    """
    path = loop_path(loops, name, state, peak)
    try:
        loop = tangential_loop(contact, state.surfaces.gap, path)
    except (LoopFailure, *IMPOSSIBLE) as error:
        raise ContactFailure(
            f"tangential loop: {error}; allowed: lower loops.force or loops.amplitude"
        ) from error
    if loop.closure > CLOSED:
        raise ContactFailure(
            f"tangential loop: still open by {loop.closure:.1e} of its range after {MOST_CYCLES} "
            "cycles; allowed: lower loops.amplitude or loops.force"
        )
    values = {
        "energy": state.energy,
        "P": loop.P,
        "kt": loop.stiffness,
        "mu": loop.friction,
        "energy_per_loop": loop.energy,
        "area": loop.area,
        "amplitude": loop.amplitude,
        "force": loop.force_amplitude,
        "sliding": loop.sliding,
        "residual_stiffness": loop.residual_stiffness,
        "border_load": loop.border_load,
    }
    return WornLoop(values, loop.displacement, loop.force)


def loop_path(loops: Loops, name: str, state: InterfaceState, peak: int) -> LoopPath:
    """What the loop imposes on the contact ``name``."""
    loads = state.loads
    P, Mx, My = (float(column[peak]) for column in (loads.P, loads.Mx, loads.My))
    if loops.normal_force is None and not P > 0.0:
        raise UserError(
            f"loops: {name} carries nothing at peak load; allowed: loops.normal_force above 0"
        )
    force = P if loops.normal_force is None else loops.normal_force
    arms = (Mx / P, My / P) if P > 0.0 else (0.0, 0.0)
    amplitude = loops.amplitude if loops.force is None else loops.force
    assert amplitude is not None, "loops that are not wanted"
    return LoopPath(
        force,
        amplitude,
        "motion" if loops.force is None else "force",
        loops.increments,
        loops.axis,
        (arms[0] * force, arms[1] * force),
    )


def kept_loops(names: Sequence[str], loops: Sequence[WornLoop]) -> dict[str, Array]:
    """Loops of the contacts ``names`` as arrays for the file of their jump."""
    arrays: dict[str, Array] = {}
    for name, loop in zip(names, loops, strict=True):
        place = f"{LOOPS}/{name}"
        arrays[f"{place}/values"] = np.array([loop.values[own] for own in MEASURED])
        arrays |= {f"{place}/{curve}": getattr(loop, curve) for curve in CURVES}
    return arrays


# --- writing ------------------------------------------------------------------------------------


def write_loops(writer: ResultsWriter, folder: OutputFolder, jumps: int) -> None:
    """Copy the loops of all jumps, 0 to ``jumps``, into the results: /loops/<interface>/<jump>."""
    for jump in range(jumps + 1):
        with h5py.File(folder.jump(jump), "r") as file:
            cycles = float(file.attrs["cycles"])
            for name, kept in file.get(LOOPS, {}).items():
                _write_loop(writer, f"{LOOPS}/{name}/{jump:05d}", kept, cycles)


def _write_loop(writer: ResultsWriter, place: str, kept: h5py.Group, cycles: float) -> None:
    for curve, (unit, description) in CURVES.items():
        dataset = writer.file.create_dataset(f"{place}/{curve}", data=kept[curve][()])
        dataset.attrs.update({"unit": unit, "description": description})
    values = dict(zip(MEASURED, kept["values"][()].tolist(), strict=True))
    writer.file[place].attrs.update(values | {"cycles": cycles})


def write_loop_tables(folder: OutputFolder, per_length: bool) -> dict[str, dict[str, Any]]:
    """Write the table of every interface; what the summary says of its loops, by interface."""
    summary: dict[str, dict[str, Any]] = {}
    with h5py.File(folder.results, "r") as file:
        for name, group in file.get(LOOPS, {}).items():
            rows = [{c.name: float(own.attrs[c.name]) for c in COLUMNS} for own in group.values()]
            table = f"loops_{name}.csv"
            write_table(folder.root / table, rows, per_length)
            summary[name] = {"file": table, "unworn": rows[0], "worn": rows[-1]}
    return summary


def warn_of_border(loops: dict[str, dict[str, Any]], asked: Loops, reporter: Reporter) -> None:
    """Warn of loops under a normal force of their own that is too much for the grid."""
    for name, own in loops.items():
        share = max(own[when]["border_load"] for when in ("unworn", "worn"))
        if share > 0.0 and asked.normal_force is not None:
            reporter.warn(
                f"{name}: in the tangential loops the contact reaches the border of its grid "
                f"({share:.1%} of the force): lower loops.normal_force"
            )


def loops_sentence(name: str, loops: dict[str, Any], per_length: bool) -> str:
    """The loops of an interface, as the summary has them, in a line."""
    first, last = loops["unworn"], loops["worn"]
    per = "/mm" if per_length else ""
    return (
        f"{name}: kt {first['kt'] * 1e-3:.4g} -> {last['kt'] * 1e-3:.4g} N/um{per}, energy per "
        f"loop {first['energy_per_loop']:.4g} -> {last['energy_per_loop']:.4g} mJ{per}"
    )


def write_table(path: Path, rows: Iterable[dict[str, float]], per_length: bool = False) -> None:
    """Write a table of loops, whose ``rows`` are in base units."""
    factors = {
        column.name: to_base(f"1 {shown}", unit) if shown != unit else 1.0
        for column in COLUMNS
        for unit, shown in [column.units(per_length)]
    }
    with replacing(path) as partial, partial.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([column.heading(per_length) for column in COLUMNS])
        for row in rows:
            writer.writerow([f"{row[name] / factor:.12g}" for name, factor in factors.items()])


# --- reading ------------------------------------------------------------------------------------


def read_loop_table(path: Path) -> LoopTable:
    """The table of loops in file ``path``, of a wear run or measured, in base units.

    Headings are the names of ``COLUMNS``, each with any unit of its kind in brackets, or in its
    base unit without. Raises UserError for a file that is no such table.
    """
    try:
        lines = list(csv.reader(path.read_text(encoding="utf-8").splitlines()))
    except (OSError, UnicodeError, csv.Error) as error:
        raise UserError(f"{path}: cannot be read ({error}); allowed: a table of loops") from error
    rows = [(number, line) for number, line in enumerate(lines, start=1) if "".join(line).strip()]
    if len(rows) < 2:
        raise UserError(f"{path}: no table; allowed: headings and a row for every loop")
    headings = _headings(path, rows[0][1])
    numbers = np.array([_numbers(path, number, line, len(headings)) for number, line in rows[1:]])
    per_length = _per_length(path, headings)
    columns = {column.name: np.full(len(numbers), np.nan) for column in COLUMNS}
    for values, (column, unit) in zip(numbers.T, headings, strict=True):
        columns[column.name] = values * _factor(path, column, unit, per_length)
    if np.any(np.diff(columns["energy"]) < 0.0):
        raise UserError(f"{path}: the energy falls; allowed: rows in the order of their energy")
    return LoopTable(**columns, per_length=per_length)


def _headings(path: Path, cells: Sequence[str]) -> list[tuple[Column, str]]:
    """Column and unit of every heading; an empty unit for the base unit."""
    known = {column.name: column for column in COLUMNS}
    found: list[tuple[Column, str]] = []
    for cell in cells:
        match = HEADING.fullmatch(cell)
        if match is None or match[1] not in known:
            raise UserError(f"{path}:1: {cell!r}: no column; allowed: {', '.join(known)}")
        found.append((known[match[1]], (match[2] or "").strip()))
    names = [column.name for column, _ in found]
    for name in NEEDED:
        if names.count(name) == 0:
            raise UserError(f"{path}:1: no column {name}; allowed: at least {', '.join(NEEDED)}")
    for name in names:
        if names.count(name) > 1:
            raise UserError(f"{path}:1: two columns {name}; allowed: one")
    return found


def _numbers(path: Path, number: int, cells: Sequence[str], count: int) -> list[float]:
    """One row of finite numbers."""
    if len(cells) != count:
        raise UserError(f"{path}:{number}: {len(cells)} cells; allowed: {count}, as headings")
    values = []
    for cell in cells:
        try:
            values.append(float(cell))
        except ValueError as error:
            raise UserError(f"{path}:{number}: {cell!r}; allowed: numbers") from error
    if not np.all(np.isfinite(values)):
        raise UserError(f"{path}:{number}: a number that is not finite; allowed: finite numbers")
    return values


def _per_length(path: Path, headings: Sequence[tuple[Column, str]]) -> bool:
    """Whether the table is of a line contact: by the unit of its stiffness."""
    ((column, unit),) = [own for own in headings if own[0].name == "kt"]
    try:
        to_base(f"1 {unit or column.unit}", column.units(True)[0])
    except UnitError:
        return False
    return True


def _factor(path: Path, column: Column, unit: str, per_length: bool) -> float:
    """Base units in a unit of the table."""
    base, _ = column.units(per_length)
    if unit in ("", base):
        return 1.0
    try:
        return to_base(f"1 {unit}", base)
    except UnitError as error:
        raise UserError(f"{path}:1: {column.name}: {error}; allowed: units of {base}") from error
