"""What a vibration case leaves: results, tables, a figure, and the summary."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from sa_solver.types import Array
from workflow.case import dump_case
from workflow.folder import OutputFolder
from workflow.reporter import Reporter
from workflow.store import replacing
from workflow.versions import versions
from workflow.vibration_run import DATASETS, Response, VibrationOutcome


def write_vibration_output(
    outcome: VibrationOutcome, folder: OutputFolder, reporter: Reporter
) -> None:
    """Write all files of a finished run; the summary comes last and marks it as finished."""
    with reporter.stage("results"):
        _write_results(outcome, folder.results)
        for number, response in enumerate(outcome.responses):
            _write_table(folder.root / f"frf_{number:05d}.csv", response.curves)
    if outcome.case.output.figures:
        from workflow.figures import write_figures

        with reporter.stage("paraview and figures"):
            write_figures(folder.results, folder.figures)
    summary = _summary(outcome, reporter)
    folder.write_summary(summary)
    for response in outcome.responses:
        reporter.say(f"  {_response_line(response)}")
    seconds = ", ".join(f"{name} {value:.1f}" for name, value in summary["seconds"].items())
    reporter.say(f"  seconds: {seconds}")


def _write_results(outcome: VibrationOutcome, path: Path) -> None:
    case = outcome.case
    with replacing(path) as partial, h5py.File(partial, "w") as file:
        file.attrs.update({"title": case.title, "analysis": case.analysis, "law": case.joint.law})
        file.create_group("case").attrs.update({"text": dump_case(case)} | versions())
        linear = _put(file, "linear", "linear", outcome.linear)
        linear.attrs.update({name: outcome.numbers[name] for name in ("free", "stuck", "sliding")})
        for number, response in enumerate(outcome.responses):
            group = _put(file, f"responses/{number:05d}", "responses", response.curves)
            group.attrs.update({"force": response.force, **response.numbers})


def _put(file: h5py.File, place: str, kind: str, curves: Mapping[str, Array]) -> h5py.Group:
    """Write the curves of one kind, each with its unit and description."""
    for name, values in curves.items():
        dataset = file.create_dataset(f"{place}/{name}", data=values)
        dataset.attrs["unit"], dataset.attrs["description"] = DATASETS[kind][name]
    return file[place]


def _write_table(path: Path, curves: Mapping[str, Array]) -> None:
    """The motions under a force as CSV in base units, a column of amplitudes for each mass."""
    columns: dict[str, Array] = {}
    for name, values in curves.items():
        unit = DATASETS["responses"][name][0]
        if values.ndim == 1:
            columns[f"{name} [{unit}]"] = values
        else:
            columns |= {f"{name}_{n} [{unit}]": own for n, own in enumerate(values.T, start=1)}
    with replacing(path) as partial, partial.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        for row in np.column_stack(list(columns.values())):
            writer.writerow([f"{value:.9g}" for value in row])


def _summary(outcome: VibrationOutcome, reporter: Reporter) -> dict[str, Any]:
    case = outcome.case
    return {
        "title": case.title,
        "assumed": list(case.assumed),
        "law": case.joint.law,
        **outcome.numbers,
        "responses": [{"force": own.force, **own.numbers} for own in outcome.responses],
        "warnings": reporter.warnings,
        "seconds": {name: round(value, 2) for name, value in reporter.seconds.items()},
        "versions": versions(),
    }


def _response_line(response: Response) -> str:
    """What a force does, in a line."""
    own = response.numbers
    text = (
        f"{response.force:g} N: resonance {own['resonance']:.5g} Hz, last mass "
        f"{1e3 * own['amplitude']:.4g} um, slips {own['slip']:.0%} of the cycle, "
        f"{own['points']} points, harmonics left out {own['left_out']:.1e}"
    )
    return text + (f"; {len(own['folds'])} folds" if own["folds"] else "")
