"""What a case in time leaves: results, tables, figures, and the summary."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from sa_solver.types import Array
from workflow.analyses.time.figures import figures_of
from workflow.analyses.time.outcome import DATASETS, MOTION, State, TimeOutcome
from workflow.case.writing import dump_case
from workflow.pictures.drawing import write_pictures
from workflow.shell.folder import OutputFolder
from workflow.shell.reporter import Reporter
from workflow.shell.store import replacing
from workflow.shell.summary import number_at
from workflow.shell.versions import versions

EVOLUTION = "evolution"
# Datasets larger than this are worth packing.
LARGE = 4096


def write_time_output(outcome: TimeOutcome, folder: OutputFolder, reporter: Reporter) -> None:
    """Write all files of a finished run; the summary comes last and marks it as finished."""
    with reporter.stage("results"):
        _write_results(outcome, folder.results)
        _write_tables(outcome, folder.root)
    with reporter.stage("paraview and figures"):
        write_pictures(outcome.case.output, folder, figures_of)
    summary = _summary(outcome, reporter)
    folder.write_summary(summary)
    _say(summary, reporter)


# --- results and tables -------------------------------------------------------------------------


def _write_results(outcome: TimeOutcome, path: Path) -> None:
    with replacing(path) as partial, h5py.File(partial, "w") as file:
        case = outcome.case
        file.attrs.update({"title": case.title, "analysis": case.analysis, "law": case.joint.law})
        if outcome.seen:
            file.attrs["seen"] = outcome.seen
        file.create_group("case").attrs.update({"text": dump_case(case)} | versions())
        _put(file, EVOLUTION, EVOLUTION, outcome.evolution)
        for number, state in enumerate(outcome.states):
            group = file.create_group(f"states/{number:05d}")
            scalars = {k: v for k, v in state.numbers.items() if isinstance(v, int | float | list)}
            group.attrs.update({"energy": state.energy, **state.parameters, **scalars})
            if state.cycles is not None:
                group.attrs["cycles"] = state.cycles
            for kind, curves in state.curves.items():
                _put(file, f"states/{number:05d}/{kind}", kind, curves)


def _put(file: h5py.File, place: str, kind: str, curves: Mapping[str, Array]) -> None:
    """Write the curves of one kind, each with its unit and description."""
    for name, values in curves.items():
        packed = {"compression": "gzip", "compression_opts": 1} if values.size > LARGE else {}
        dataset = file.create_dataset(f"{place}/{name}", data=values, **packed)
        dataset.attrs["unit"], dataset.attrs["description"] = DATASETS[kind][name]


def _write_tables(outcome: TimeOutcome, root: Path) -> None:
    """The evolution, and the curves of every state, as CSV in base units; motions are too long."""
    _write_table(root / f"{EVOLUTION}.csv", EVOLUTION, outcome.evolution)
    for number, state in enumerate(outcome.states):
        for kind, curves in state.curves.items():
            if kind != MOTION:
                _write_table(root / f"{kind}_{number:05d}.csv", kind, curves)


def _write_table(path: Path, kind: str, curves: Mapping[str, Array]) -> None:
    units = {name: unit for name, (unit, _) in DATASETS[kind].items()}
    with replacing(path) as partial, partial.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([f"{name} [{units[name]}]" for name in curves])
        for row in np.column_stack(list(curves.values())):
            writer.writerow([f"{value:.9g}" for value in row])


# --- summary ------------------------------------------------------------------------------------


def _summary(outcome: TimeOutcome, reporter: Reporter) -> dict[str, Any]:
    case = outcome.case
    found: dict[str, Any] = {
        "title": case.title,
        "assumed": list(case.assumed),
        "law": case.joint.law,
        **outcome.numbers,
        "states": [_state_summary(state) for state in outcome.states],
    }
    reported = []
    for entry in case.reported:
        computed = number_at(found, entry.quantity)
        if computed is None:
            reporter.warn(f"reported: no quantity {entry.quantity} in summary.json")
        told = {"quantity": entry.quantity, "reported": entry.value, "computed": computed}
        reported.append(told | {"source": entry.source})
    return found | {
        "reported": reported,
        "warnings": reporter.warnings,
        "seconds": {name: round(value, 2) for name, value in reporter.seconds.items()},
        "versions": versions(),
    }


def _state_summary(state: State) -> dict[str, Any]:
    cycles = {} if state.cycles is None else {"cycles": state.cycles}
    return {"energy": state.energy, **cycles, **state.parameters, **state.numbers}


def _say(summary: dict[str, Any], reporter: Reporter) -> None:
    """The end of the run in a few lines."""
    for state in summary["states"]:
        reporter.say(f"  {_state_line(state)}")
    for entry in summary["reported"]:
        reporter.say(
            f"  {entry['quantity']}: {_shown(entry['computed'])} computed, "
            f"{_shown(entry['reported'])} reported ({entry['source']})"
        )
    reporter.say(f"  seconds: {', '.join(f'{k} {v:.1f}' for k, v in summary['seconds'].items())}")


def _shown(value: float | None) -> str:
    return "none" if value is None else f"{value:.5g}"


def _state_line(state: Mapping[str, Any]) -> str:
    """What a state is and does, in a line."""
    parts = [f"{1e-3 * state['energy']:.5g} J"]
    if "cycles" in state:
        parts.append(f"{state['cycles']:.6g} cycles")
    parts.append(f"mu {state['friction']:.4g}, kt {1e-3 * state['stiffness']:.4g} N/um")
    if "energy_per_cycle" in state:
        parts.append(f"{state['energy_per_cycle']:.4g} mJ a cycle")
    if "stroke" in state:
        parts.append(f"stroke {1e3 * state['stroke']:.4g} um")
    for name in ("first", "second"):
        if f"{name}_frequency" in state:
            hertz, peak = state[f"{name}_frequency"], 1e-3 * state[f"{name}_peak"]
            parts.append(f"{name} peak {peak:.3g} m/s^2/N at {hertz:.4g} Hz")
    return ", ".join(parts)
