"""Tangential loops on the worn contacts of a wear run.

A loop is run for the unworn state and after every wear step, or only at the end. It is stored with
the fields of its jump, so that a resumed run still has it. All loops are copied to ``results.h5``
and, one row per loop, to ``loops_<interface>.csv``
(:mod:`workflow.analyses.wear.output.loop_table`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from sa_solver.types import Array
from workflow.analyses.wear.case.loops import Loops
from workflow.analyses.wear.output.loop_table import COLUMNS, OVER_ENERGY, SLIDES, write_loop_table
from workflow.case.text.readable import percent
from workflow.layout.declared import Arrays, declared
from workflow.messages.warning_kinds import WarningKind
from workflow.models.loops import WornLoop
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.output.results import ResultsWriter
from workflow.shell.terminal.reporter import Reporter

# Quantities that every loop measures; the cycles are those of the jump.
MEASURED = tuple(name for name in COLUMNS if name != "cycles")
# Groups of a file above those of interfaces and jumps.
LOOPS, LOOPS_OVER_ENERGY = "loops", "loops_over_energy"
# The cycles of a jump, among the arrays of its file.
CYCLES = "cycles"

Measurements = Mapping[str, Sequence[Mapping[str, float]]]
"""Values that the loops of each interface measure, by loop."""


def stored_loops(names: Sequence[str], loops: Sequence[WornLoop]) -> dict[str, Array]:
    """Return the loops of the contacts ``names`` as arrays for the file of their jump."""
    arrays: dict[str, Array] = {}
    for name, loop in zip(names, loops, strict=True):
        place = f"{LOOPS}/{name}"
        arrays[f"{place}/values"] = np.array([loop.values[column] for column in MEASURED])
        arrays |= {f"{place}/displacement": loop.displacement, f"{place}/force": loop.force}
    return arrays


# --- writing ------------------------------------------------------------------------------------


def write_loops(writer: ResultsWriter, jumps: Sequence[Arrays]) -> Measurements:
    """Write the loops kept with each jump to /loops/<interface>/<jump>; return what they measure.

    The measured values are also written against energy: /loops_over_energy/<interface>.
    """
    measured: dict[str, list[dict[str, float]]] = {}
    for jump, arrays in enumerate(jumps):
        for name in [place.split("/")[1] for place in arrays if place.endswith("/values")]:
            place = f"{LOOPS}/{name}"
            values = dict(zip(MEASURED, arrays[f"{place}/values"].tolist(), strict=True))
            values["cycles"] = float(arrays[CYCLES])
            curve = {of: arrays[f"{place}/{of}"] for of in ("displacement", "force")}
            writer.put(f"{place}/{jump:05d}", curve, **values)
            measured.setdefault(name, []).append(values)
    for name, rows in measured.items():
        over_energy = {of: np.array([row[of] for row in rows]) for of in declared(OVER_ENERGY)}
        writer.put(f"{LOOPS_OVER_ENERGY}/{name}", over_energy)
    return measured


def write_loop_tables(
    folder: OutputFolder, measured: Measurements, per_length: bool
) -> dict[str, dict[str, Any]]:
    """Write the table of every interface; return the summary's loop entries by interface."""
    summary: dict[str, dict[str, Any]] = {}
    for name, values in measured.items():
        rows = [{column: row[column] for column in COLUMNS} for row in values]
        table = f"loops_{name}.csv"
        path = folder.reserve(table, f"tangential loops of {name} as it wears")
        write_loop_table(path, rows, per_length)
        summary[name] = {"file": table, "unworn": rows[0], "worn": rows[-1]}
    return summary


def warn_of_border(loops: dict[str, dict[str, Any]], asked: Loops, reporter: Reporter) -> None:
    """Warn of loops whose own normal force presses the contact to the border of its grid."""
    for name, loop in loops.items():
        share = max(loop[when]["border_load"] for when in ("unworn", "worn"))
        if share > 0.0 and asked.normal_force is not None:
            reporter.warn(
                WarningKind.CONTACT_AT_BORDER,
                f"{name}: in the tangential loops the contact reaches the border of its grid, "
                f"which carries {percent(share)} of the force: lower loops.normal_force",
            )


def loops_sentence(name: str, loops: dict[str, Any], per_length: bool) -> str:
    """Return a sentence on an interface's loops, from their summary."""
    first, last = loops["unworn"], loops["worn"]
    per = "/mm" if per_length else ""
    off = max(loop["kt_error"] / loop["kt"] for loop in (first, last))
    mu = "mu" if min(first["sliding"], last["sliding"]) >= SLIDES else "mu, only mobilised,"
    return (
        f"{name}: kt {first['kt'] * 1e-3:.4g} -> {last['kt'] * 1e-3:.4g} N/um{per} (within "
        f"{percent(off)} by the grid), {mu} {first['mu']:.3g} -> {last['mu']:.3g}, energy per "
        f"loop {first['energy_per_loop']:.4g} -> {last['energy_per_loop']:.4g} mJ{per}"
    )
