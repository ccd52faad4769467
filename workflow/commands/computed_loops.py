"""``fretscale loops`` of a wear run: its computed loops, read as measured ones are."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import h5py

from wear.joints.loop_record import MeasuredLoopError
from wear.joints.measured_loops import measure_loops
from workflow.errors import UserError
from workflow.shell.folder import OutputFolder

HEADINGS = ("cycles", "energy [J]", "kt [N/um]", "stuck", "+-", "mu")
WIDTH = 12


def report_of_run(path: Path) -> list[str]:
    """A row for each loop of the run in the folder ``path``; per mm where its contacts are lines.

    Raises UserError for a folder without loops, or whose loops have too few increments.
    """
    results = OutputFolder(path).results
    if not results.is_file():
        raise UserError(f"{path}: no results of a run; allowed: a record, or a finished wear run")
    with h5py.File(results, "r") as file:
        if "loops" not in file:
            raise UserError(f"{path}: no loops; allowed: a wear run with loops.amplitude or force")
        lines = [line for name, group in file["loops"].items() for line in _rows(name, group)]
    return [
        *lines,
        "kt is the slope right after a reversal, as of measured loops; stuck is that of the "
        "contact with all stuck, +- what the grid leaves of it",
        "mu in brackets is only what is mobilised: these loops do not slide",
    ]


def _rows(name: str, group: h5py.Group) -> Iterator[str]:
    yield name
    yield "".join(f"{cell:>{WIDTH}}" for cell in HEADINGS)
    for jump, kept in group.items():
        values = kept.attrs
        try:
            loops = measure_loops(kept["displacement"][()], kept["force"][()], float(values["P"]))
        except MeasuredLoopError as error:
            raise UserError(
                f"loops of {name}, jump {int(jump)}: {error}; or more loops.increments of the case"
            ) from error
        kt = 1e-3 * loops.stick_estimate.value
        stuck, off = (1e-3 * float(values[key]) for key in ("kt", "kt_error"))
        mu = f"{loops.friction[-1]:.4g}" if loops.slides else f"({loops.mobilised[-1]:.4g})"
        energy = f"{1e-3 * float(values['energy']):.4g}"
        row = f"{float(values['cycles']):.6g}", energy, f"{kt:.4g}", f"{stuck:.4g}", f"{off:.1g}"
        yield "".join(f"{cell:>{WIDTH}}" for cell in (*row, mu))
