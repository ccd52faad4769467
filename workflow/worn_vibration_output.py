"""What a vibration case with wear leaves: results, tables, figures, and the summary."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from itertools import pairwise
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
from workflow.worn_vibration_outcome import (
    DATASETS,
    EVOLUTION,
    RESPONSES,
    WORN,
    WornState,
    WornVibrationOutcome,
)

# Datasets larger than this are worth packing.
LARGE = 4096
# N mm to J, N/mm to N/µm, mm to µm.
JOULES, PER_MICRON, MICRONS = 1e-3, 1e-3, 1e3


def write_worn_vibration_output(
    outcome: WornVibrationOutcome, folder: OutputFolder, reporter: Reporter
) -> None:
    """Write all files of a finished run; the summary comes last and marks it as finished."""
    with reporter.stage("results"):
        _write_results(outcome, folder.results)
        _write_tables(outcome, folder.root)
    if outcome.case.output.figures:
        from workflow.figures import write_figures

        with reporter.stage("paraview and figures"):
            write_figures(folder.results, folder.figures)
    summary = _summary(outcome, reporter)
    folder.write_summary(summary)
    for state in outcome.states:
        reporter.say(f"  {_line(state)}")
    seconds = ", ".join(f"{name} {value:.1f}" for name, value in summary["seconds"].items())
    reporter.say(f"  seconds: {seconds}")


# --- results ------------------------------------------------------------------------------------


def _write_results(outcome: WornVibrationOutcome, path: Path) -> None:
    case, grid = outcome.case, outcome.grid
    with replacing(path) as partial, h5py.File(partial, "w") as file:
        file.attrs.update({"title": case.title, "analysis": case.analysis})
        file.attrs["forces"] = list(case.forces)
        file.create_group("case").attrs.update({"text": dump_case(case)} | versions())
        file.create_group("grid").attrs.update({"shape": grid.shape, "pitch": grid.pitch})
        _put(file, EVOLUTION, EVOLUTION, outcome.evolution)
        for number, state in enumerate(outcome.states):
            place = f"{WORN}/{number:05d}"
            file.create_group(place).attrs.update(state.numbers)
            for kind, values in state.fields.items():
                _put(file, f"{place}/{kind}", kind, values)
            for response_number, response in enumerate(state.responses):
                group = _put(
                    file, f"{place}/{RESPONSES}/{response_number:05d}", RESPONSES, response.curves
                )
                group.attrs.update({"force": response.force, **response.numbers})


def _put(file: h5py.File, place: str, kind: str, values: Mapping[str, Array]) -> h5py.Group:
    """Write the datasets of one kind, each with its unit and description."""
    for name, own in values.items():
        packed = {"compression": "gzip", "compression_opts": 1} if own.size > LARGE else {}
        dataset = file.create_dataset(f"{place}/{name}", data=own, **packed)
        dataset.attrs["unit"], dataset.attrs["description"] = DATASETS[kind][name]
    return file[place]


# --- tables -------------------------------------------------------------------------------------


def _write_tables(outcome: WornVibrationOutcome, root: Path) -> None:
    """The evolution, and the responses of every state to every force, as CSV in base units."""
    _write_table(root / f"{EVOLUTION}.csv", EVOLUTION, outcome.evolution)
    for number, state in enumerate(outcome.states):
        for force, response in enumerate(state.responses):
            _write_table(root / f"frf_{number:05d}_{force:05d}.csv", RESPONSES, response.curves)


def _write_table(path: Path, kind: str, curves: Mapping[str, Array]) -> None:
    """Curves as columns, of what has several values at a point one for each."""
    columns: dict[str, Array] = {}
    for name, values in curves.items():
        unit = DATASETS[kind][name][0]
        if values.ndim == 1:
            columns[f"{name} [{unit}]"] = values
        else:
            columns |= {f"{name}_{n} [{unit}]": own for n, own in enumerate(values.T, start=1)}
    with replacing(path) as partial, partial.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        for row in np.column_stack(list(columns.values())):
            writer.writerow([f"{value:.9g}" for value in row])


# --- summary ------------------------------------------------------------------------------------


def _summary(outcome: WornVibrationOutcome, reporter: Reporter) -> dict[str, Any]:
    states, last = outcome.states, outcome.states[-1].numbers
    energy = last["energy"]
    return {
        "title": outcome.case.title,
        "assumed": list(outcome.case.assumed),
        "volume_per_energy": last["volume"] / energy if energy > 0.0 else 0.0,
        "states": [_of_state(state) for state in states],
        "trend": {
            name: _trend([state.numbers[name] for state in states])
            for name in ("stiffness", "peak_pressure")
        }
        | {"resonance": _trend([state.responses[0].numbers["resonance"] for state in states])},
        "warnings": reporter.warnings,
        "seconds": {name: round(value, 2) for name, value in reporter.seconds.items()},
        "versions": versions(),
    }


def _of_state(state: WornState) -> dict[str, Any]:
    responses = [{"force": own.force, **own.numbers} for own in state.responses]
    return {**state.numbers, RESPONSES: responses}


def _trend(values: Sequence[float]) -> float:
    """1 where values rise and never fall, -1 where they fall and never rise, else 0."""
    signs = {float(np.sign(after - before)) for before, after in pairwise(values)} - {0.0}
    return signs.pop() if len(signs) == 1 else 0.0


def _line(state: WornState) -> str:
    """A state in a line."""
    own = state.numbers
    resonances = ", ".join(
        f"{response.numbers['resonance']:.4g} Hz under {response.force:g} N"
        for response in state.responses
    )
    return (
        f"{state.cycles:g} cycles, {JOULES * own['energy']:.4g} J: kt "
        f"{PER_MICRON * own['stiffness']:.4g} N/um, depth {MICRONS * own['depth']:.3g} um, stroke "
        f"{MICRONS * own['stroke']:.3g} um; resonance {resonances}"
    )
