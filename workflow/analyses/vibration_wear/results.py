"""What a vibration case with wear leaves: results, tables, figures, and the summary."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np

from workflow.analyses.vibration.outcome import trend
from workflow.analyses.vibration.store import put, write_table
from workflow.analyses.vibration_wear.figures import figures_of
from workflow.analyses.vibration_wear.outcome import (
    DATASETS,
    EVOLUTION,
    PLACES,
    RESPONSES,
    WORN,
    VibrationWearOutcome,
    WornState,
)
from workflow.case.writing import dump_case
from workflow.pictures.drawing import write_pictures
from workflow.shell.folder import OutputFolder
from workflow.shell.reporter import Reporter
from workflow.shell.store import replacing
from workflow.shell.versions import versions

# What rises, falls, or neither, beside the resonance under the least force.
TRENDS = ("stiffness", "peak_pressure", "touching")
# N mm to J, N/mm to N/µm, mm to µm.
TO_JOULES, PER_MICRON, TO_MICRONS = 1e-3, 1e-3, 1e3


def write_vibration_wear_output(
    outcome: VibrationWearOutcome, folder: OutputFolder, reporter: Reporter
) -> None:
    """Write all files of a finished run; the summary comes last and marks it as finished."""
    with reporter.stage("results"):
        _write_results(outcome, folder.results)
        _write_tables(outcome, folder.root)
    with reporter.stage("paraview and figures"):
        write_pictures(outcome.case.output, folder, figures_of)
    summary = _summary(outcome, reporter)
    folder.write_summary(summary)
    for state in outcome.states:
        reporter.say(f"  {_line(state)}")
    seconds = ", ".join(f"{name} {value:.1f}" for name, value in summary["seconds"].items())
    reporter.say(f"  seconds: {seconds}")


# --- results ------------------------------------------------------------------------------------


def _write_results(outcome: VibrationWearOutcome, path: Path) -> None:
    case = outcome.case
    with replacing(path) as partial, h5py.File(partial, "w") as file:
        file.attrs.update({"title": case.title, "analysis": case.analysis})
        file.attrs["forces"] = list(case.forces)
        file.create_group("case").attrs.update({"text": dump_case(case)} | versions())
        if outcome.grid is not None:
            own = {"shape": outcome.grid.shape, "pitch": outcome.grid.pitch}
            file.create_group("grid").attrs.update(own)
        if outcome.places is not None:
            put(file, PLACES, outcome.places, DATASETS[PLACES])
        put(file, EVOLUTION, outcome.evolution, DATASETS[EVOLUTION])
        for number, state in enumerate(outcome.states):
            place = f"{WORN}/{number:05d}"
            file.create_group(place).attrs.update(state.numbers)
            for kind, values in state.fields.items():
                put(file, f"{place}/{kind}", values, DATASETS[kind])
            for response_number, response in enumerate(state.responses):
                within = f"{place}/{RESPONSES}/{response_number:05d}"
                group = put(file, within, response.curves, DATASETS[RESPONSES])
                group.attrs.update({"force": response.force, **response.numbers})


# --- tables -------------------------------------------------------------------------------------


def _write_tables(outcome: VibrationWearOutcome, root: Path) -> None:
    """The evolution, and the responses of every state to every force, as CSV in base units."""
    write_table(root / f"{EVOLUTION}.csv", outcome.evolution, DATASETS[EVOLUTION])
    for number, state in enumerate(outcome.states):
        for force, response in enumerate(state.responses):
            path = root / f"frf_{number:05d}_{force:05d}.csv"
            write_table(path, response.curves, DATASETS[RESPONSES])


# --- summary ------------------------------------------------------------------------------------


def _summary(outcome: VibrationWearOutcome, reporter: Reporter) -> dict[str, Any]:
    states, last = outcome.states, outcome.states[-1].numbers
    energy = last["energy"]
    return {
        "title": outcome.case.title,
        "assumed": list(outcome.case.assumed),
        "volume_per_energy": last["volume"] / energy if energy > 0.0 else 0.0,
        "states": [_of_state(state) for state in states],
        "trend": {
            name: trend([state.numbers[name] for state in states])
            for name in TRENDS
            if name in states[0].numbers
        }
        | {"resonance": trend([state.responses[0].numbers["resonance"] for state in states])},
        "warnings": reporter.warnings,
        "seconds": {name: round(value, 2) for name, value in reporter.seconds.items()},
        "versions": versions(),
    }


def _of_state(state: WornState) -> dict[str, Any]:
    responses = [{"force": own.force, **own.numbers} for own in state.responses]
    # JSON has no NaN.
    numbers = {name: value for name, value in state.numbers.items() if value == value}
    return {**numbers, RESPONSES: responses}


def _line(state: WornState) -> str:
    """A state in a line."""
    own = state.numbers
    resonances = ", ".join(
        f"{response.numbers['resonance']:.4g} Hz under {response.force:g} N"
        for response in state.responses
    )
    stiffness = PER_MICRON * own["stiffness"]
    sticks = f"kt {stiffness:.4g} N/um, " if np.isfinite(stiffness) else ""
    return (
        f"{state.cycles:g} cycles, {TO_JOULES * own['energy']:.4g} J: {sticks}depth "
        f"{TO_MICRONS * own['depth']:.3g} um, stroke {TO_MICRONS * own['stroke']:.3g} um; "
        f"resonance {resonances}"
    )
