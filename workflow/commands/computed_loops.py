"""``fretscale loops`` of a wear run: its computed loops, evaluated as measured loops are."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import h5py

from wear.joints.measured.loop_record import MeasuredLoopError
from wear.joints.measured.measured_loops import measure_loops
from workflow.case.files.input_files import open_hdf5
from workflow.errors import UserError
from workflow.runs.provenance import case_values
from workflow.shell.folders.folder import OutputFolder

HEADINGS = ("cycles", "energy [J{per}]", "kt [N/um{per}]", "stuck", "+-", "mu")
WIDTH = 15


def report_of_run(path: Path) -> list[str]:
    """Return a row for each loop of the run in the folder ``path``.

    Raises UserError for a folder without loops, results that do not belong to its run, and loops of
    too few increments.
    """
    run = OutputFolder(path)
    if not run.results.is_file():
        raise UserError(
            f"{path}: a directory without results of a run; allowed: a record, or a finished wear "
            "run"
        )
    run.check_results(case_values(run))
    with open_hdf5(str(run.results)) as file:
        if "loops" not in file:
            raise UserError(f"{path}: no loops; allowed: a wear run with loops.amplitude or force")
        return report_of_loops(file["loops"])


def report_of_loops(loops: h5py.Group) -> list[str]:
    """Return a row for each loop in the group of loops; raise UserError for too few increments."""
    return [
        *(line for name, group in loops.items() for line in _rows(name, group)),
        "kt is the slope right after a reversal, as for measured loops; stuck is that of the "
        "fully stuck contact, +- the error due to the grid",
        "mu in brackets is only a lower bound: these loops do not slide",
    ]


def _rows(name: str, group: h5py.Group) -> Iterator[str]:
    per = "/mm" if any(kept["force"].attrs["unit"] == "N/mm" for kept in group.values()) else ""
    yield name
    yield "".join(f"{cell.format(per=per):>{WIDTH}}" for cell in HEADINGS)
    for jump, kept in group.items():
        values = kept.attrs
        if "kt_error" not in values:
            raise UserError(
                f"loops of {name}: written by an earlier version; allowed: those of a new run"
            )
        try:
            loops = measure_loops(kept["displacement"][()], kept["force"][()], float(values["P"]))
        except MeasuredLoopError as error:
            raise UserError(
                f"loops of {name}, jump {int(jump)}: {error}; or more loops.increments in the case"
            ) from error
        kt = 1e-3 * loops.stick_estimate.value
        stuck, off = (1e-3 * float(values[key]) for key in ("kt", "kt_error"))
        mu = f"{loops.friction[-1]:.4g}" if loops.slides else f"({loops.mobilised[-1]:.4g})"
        energy = f"{1e-3 * float(values['energy']):.4g}"
        row = f"{float(values['cycles']):.6g}", energy, f"{kt:.4g}", f"{stuck:.4g}", f"{off:.1g}"
        yield "".join(f"{cell:>{WIDTH}}" for cell in (*row, mu))
