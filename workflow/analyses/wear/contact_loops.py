"""Tangential loops on the worn contacts of a wear run.

A loop is run where it is due (unworn, after every wear step or only at the end), is kept with the
fields of its jump, so that a resumed run still has it, and ends up in ``results.h5`` and, one row
per loop, in ``loops_<interface>.csv`` (:mod:`workflow.analyses.wear.loop_table`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import h5py
import numpy as np

from sa_solver.contact import FrictionalContact
from sa_solver.cycles.loop_accuracy import loop_errors
from sa_solver.cycles.tangential_loop import (
    CLOSED,
    MOST_CYCLES,
    LoopFailure,
    LoopPath,
    march_loop,
)
from sa_solver.errors import ContactProblemError
from sa_solver.types import Array, Tilt
from wear.contact.interface import InterfaceState
from wear.steps.stepping import ContactFailure
from workflow.analyses.wear.case.loops import Loops
from workflow.analyses.wear.loop_table import COLUMNS, SLIDES, Column, write_loop_table
from workflow.errors import UserError
from workflow.shell.dataset import Dataset
from workflow.shell.folder import OutputFolder
from workflow.shell.reporter import Reporter
from workflow.shell.results import ResultsWriter

# Measured by every loop; cycles come from the jump.
MEASURED = tuple(column.name for column in COLUMNS if column.name != "cycles")
# Interfaces and jumps are groups of a file.
LOOPS, LOOPS_OVER_ENERGY = "loops", "loops_over_energy"
OVER_ENERGY = "energy", "kt", "kt_error", "mu", "mu_error"


@dataclass(frozen=True)
class WornLoop:
    """A loop on worn surfaces: ``values`` by the names ``MEASURED``, in base units.

    ``displacement`` [mm] and ``force`` [N] ``(k,)`` are its curve, first loading included.
    """

    values: dict[str, float]
    displacement: Array
    force: Array


# --- running ------------------------------------------------------------------------------------


def loops_due(loops: Loops, jump: int, ended: bool) -> bool:
    """Whether a loop is to be run after ``jump``."""
    return loops.wanted and (loops.every == "jump" or jump == 0 or ended)


def worn_loop(
    contact: FrictionalContact,
    loops: Loops,
    name: str,
    state: InterfaceState,
    peak: int,
    tilt: Tilt = "free",
    lift: Array | float = 0.0,
) -> WornLoop:
    """The loop of the contact ``name`` in its present state, under its loads at ``peak``.

    These widen the gap by ``lift`` ``(nx, ny)`` [mm]. Its ``tilt`` is held, or free under their
    moments. A normal force of one's own acts along the same line, and lifts by its share. Raises
    ContactFailure if it does not converge or friction cannot carry it, UserError for a contact
    without load.
    """
    path = loop_path(loops, name, state, peak, tilt)
    height = state.surfaces.gap + _share(path.P, state, peak) * lift
    try:
        loop = march_loop(contact, height, path)
    except (LoopFailure, ContactProblemError) as error:
        raise ContactFailure(
            f"tangential loop: {error}; allowed: lower loops.force or loops.amplitude"
        ) from error
    if loop.closure > CLOSED:
        raise ContactFailure(
            f"tangential loop: still open by {loop.closure:.1e} of its range after {MOST_CYCLES} "
            "cycles; allowed: lower loops.amplitude or loops.force"
        )
    errors = loop_errors(contact, height, path, loop)
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
        "kt_error": errors.stiffness,
        "mu_error": errors.friction,
        "energy_per_loop_error": errors.energy,
    }
    return WornLoop(values, loop.displacement, loop.force)


def loop_path(
    loops: Loops, name: str, state: InterfaceState, peak: int, tilt: Tilt = "free"
) -> LoopPath:
    """What the loop imposes on the contact ``name``."""
    loads = state.loads
    P, Mx, My = (float(column[peak]) for column in (loads.P, loads.Mx, loads.My))
    if loops.normal_force is None and not P > 0.0:
        raise UserError(
            f"loops: {name} carries nothing at peak load; allowed: loops.normal_force above 0"
        )
    force = P if loops.normal_force is None else loops.normal_force
    share = _share(force, state, peak)
    amplitude = loops.amplitude if loops.force is None else loops.force
    assert amplitude is not None, "loops that are not wanted"
    drive: Literal["motion", "force"] = "motion" if loops.force is None else "force"
    moments = None if tilt == "held" else (share * Mx, share * My)
    return LoopPath(force, amplitude, drive, loops.increments, loops.axis, moments)


def _share(force: float, state: InterfaceState, peak: int) -> float:
    """A normal force over that at peak load; 0 where that is none."""
    P = float(state.loads.P[peak])
    return force / P if P > 0.0 else 0.0


def kept_loops(names: Sequence[str], loops: Sequence[WornLoop]) -> dict[str, Array]:
    """Loops of the contacts ``names`` as arrays for the file of their jump."""
    arrays: dict[str, Array] = {}
    for name, loop in zip(names, loops, strict=True):
        place = f"{LOOPS}/{name}"
        arrays[f"{place}/values"] = np.array([loop.values[column] for column in MEASURED])
        arrays |= {f"{place}/displacement": loop.displacement, f"{place}/force": loop.force}
    return arrays


# --- writing ------------------------------------------------------------------------------------


def write_loops(writer: ResultsWriter, folder: OutputFolder, jumps: int, per_length: bool) -> None:
    """Copy the loops of all jumps, 0 to ``jumps``, into the results: /loops/<interface>/<jump>.

    What they measure is there against energy too: /loops_over_energy/<interface>.
    """
    measured: dict[str, list[list[float]]] = {}
    for jump in range(jumps + 1):
        with h5py.File(folder.jump(jump), "r") as file:
            cycles = float(file.attrs["cycles"])
            for name, kept in file.get(LOOPS, {}).items():
                _write_loop(writer, f"{LOOPS}/{name}/{jump:05d}", kept, cycles)
                measured.setdefault(name, []).append(kept["values"][()].tolist())
    for name, rows in measured.items():
        columns = dict(zip(MEASURED, np.array(rows).T, strict=True))
        over = {
            column.name: Dataset(
                columns[column.name], _unit(column, per_length), column.description
            )
            for column in COLUMNS
            if column.name in OVER_ENERGY
        }
        writer.put(f"{LOOPS_OVER_ENERGY}/{name}", over)


def _unit(column: Column, per_length: bool) -> str:
    """Of a dataset. Whoever writes it knows energies per mm, but not stiffnesses."""
    energy = column.name == "energy"
    return "N mm" if energy else column.units(per_length)[0]


def _write_loop(writer: ResultsWriter, place: str, kept: h5py.Group, cycles: float) -> None:
    along = "of body 1 relative to body 2 along the axis, from the pressed state"
    curve = {
        "displacement": Dataset(kept["displacement"][()], "mm", along),
        "force": Dataset(kept["force"][()], "N", "tangential force on body 2"),
    }
    values = dict(zip(MEASURED, kept["values"][()].tolist(), strict=True))
    writer.put(place, curve, **values, cycles=cycles)


def write_loop_tables(folder: OutputFolder, per_length: bool) -> dict[str, dict[str, Any]]:
    """Write the table of every interface; what the summary says of its loops, by interface."""
    summary: dict[str, dict[str, Any]] = {}
    with h5py.File(folder.results, "r") as file:
        for name, group in file.get(LOOPS, {}).items():
            rows = [{c.name: float(loop.attrs[c.name]) for c in COLUMNS} for loop in group.values()]
            table = f"loops_{name}.csv"
            path = folder.reserve(table, f"tangential loops of {name} as it wears")
            write_loop_table(path, rows, per_length)
            summary[name] = {"file": table, "unworn": rows[0], "worn": rows[-1]}
    return summary


def warn_of_border(loops: dict[str, dict[str, Any]], asked: Loops, reporter: Reporter) -> None:
    """Warn of loops under a normal force of their own that is too much for the grid."""
    for name, loop in loops.items():
        share = max(loop[when]["border_load"] for when in ("unworn", "worn"))
        if share > 0.0 and asked.normal_force is not None:
            reporter.warn(
                f"{name}: in the tangential loops the contact reaches the border of its grid "
                f"({share:.1%} of the force): lower loops.normal_force"
            )


def loops_sentence(name: str, loops: dict[str, Any], per_length: bool) -> str:
    """The loops of an interface, as the summary has them, in a line."""
    first, last = loops["unworn"], loops["worn"]
    per = "/mm" if per_length else ""
    off = max(loop["kt_error"] / loop["kt"] for loop in (first, last))
    mu = "mu" if min(first["sliding"], last["sliding"]) >= SLIDES else "mu, only mobilised,"
    return (
        f"{name}: kt {first['kt'] * 1e-3:.4g} -> {last['kt'] * 1e-3:.4g} N/um{per} (within "
        f"{off:.1%} by the grid), {mu} {first['mu']:.3g} -> {last['mu']:.3g}, energy per "
        f"loop {first['energy_per_loop']:.4g} -> {last['energy_per_loop']:.4g} mJ{per}"
    )
