"""Output of a vibration case with wear: results, tables, figures and the summary."""

from __future__ import annotations

from typing import Any

import numpy as np

from workflow.analyses.vibration.output.outcome import trend
from workflow.analyses.vibration.output.results import put_response_curves
from workflow.analyses.vibration_wear.case import (
    FrictionRigWearCase,
    ReducedWearCase,
    VibrationWearCase,
)
from workflow.analyses.vibration_wear.output.layout import layout_of
from workflow.analyses.vibration_wear.output.outcome import (
    VibrationWearContents,
    VibrationWearOutcome,
    WornNodes,
    WornRig,
)
from workflow.layout.declared import Arrays, Layout
from workflow.models.vibration.amount import ExcitationSize
from workflow.pictures.scales import PER_MICRON, TO_JOULES, TO_MICRONS
from workflow.shell.analysis import Run
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.output.results import run_results
from workflow.shell.output.summary import finish
from workflow.shell.output.tables import DIGITS, heading, write_table

VibrationWearRun = Run[VibrationWearCase | FrictionRigWearCase | ReducedWearCase]

# Quantities whose trend is reported, in addition to the resonance under the least force.
TRENDS = ("stiffness", "peak_pressure", "touching")


def write_vibration_wear_output(outcome: VibrationWearOutcome, run: VibrationWearRun) -> None:
    """Write all files of a finished run; the summary comes last and marks it as finished."""
    with run.reporter.stage("results"):
        _write_results(outcome, run)
    run.draw(_contents(outcome))
    finish(
        run,
        _summary(outcome),
        (f"  {_line(outcome.case.amount, state)}" for state in outcome.states),
    )


# --- results ------------------------------------------------------------------------------------


def _contents(outcome: VibrationWearOutcome) -> VibrationWearContents:
    if outcome.nodes is None:
        return VibrationWearContents(at_nodes=False)
    known = outcome.nodes.arrays
    on_plane = "x" in known
    return VibrationWearContents(
        at_nodes=True, placed=on_plane or "position" in known, on_plane=on_plane
    )


def _write_results(outcome: VibrationWearOutcome, run: VibrationWearRun) -> None:
    """Write results, and as CSV evolution, nodes and responses of every state to every force."""
    case, folder, layout = outcome.case, run.folder, layout_of(outcome.case.amount)
    attributes = {
        "analysis": case.analysis,
        "forces": list(case.amounts),
        "amount": case.amount.name,
    }
    with run_results(run, case, layout, attributes) as writer:
        writer.put_contents(_contents(outcome))
        if outcome.grid is not None:
            writer.put_grid("grid", outcome.grid)
        if outcome.nodes is not None:
            writer.put("places", {**outcome.nodes.arrays, **_named(outcome.nodes)})
        path = folder.reserve("evolution.csv", "contact and resonances, over the cycles")
        writer.put_table(path, "evolution", _evolution(outcome, layout))
        for number, state in enumerate(outcome.states):
            place = f"worn/{number:05d}"
            writer.put(place, {}, **state.numbers)
            for group, arrays in state.fields.items():
                writer.put(f"{place}/{group}", arrays)
            for force, response in enumerate(state.responses):
                where = f"{place}/responses/{force:05d}"
                under = f"{case.amount.under(response.force)} after {state.cycles:g} cycles"
                what = f"response {under}, over frequency"
                path = folder.reserve(f"frf_{number:05d}_{force:05d}.csv", what)
                put_response_curves(writer, path, where, case.amount, response)
            if outcome.nodes is not None:
                _write_nodes(outcome.nodes, number, state, folder, layout)


def _evolution(outcome: VibrationWearOutcome, layout: Layout) -> Arrays:
    """Return numbers of all states against cycles ``(k,)``; those of each force ``(k, forces)``."""
    rows = [
        {
            **state.numbers,
            "resonance": [response.numbers["resonance"] for response in state.responses],
            "receptance": [response.numbers["receptance"] for response in state.responses],
        }
        for state in outcome.states
    ]
    declared = layout.datasets("evolution")
    return {name: np.array([row[name] for row in rows]) for name in declared if name in rows[0]}


def _named(nodes: WornNodes) -> Arrays:
    """Return the names of nodes, empty if they have none."""
    return {"name": np.array(nodes.names, dtype=np.bytes_)} if nodes.names else {}


def _write_nodes(
    nodes: WornNodes, number: int, state: WornRig, folder: OutputFolder, layout: Layout
) -> None:
    """Write depths and energies of the nodes in a state, a row for each node."""
    what = f"nodes after {state.cycles:g} cycles: gaps, depths, energies of a cycle"
    path = folder.reserve(f"nodes_{number:05d}.csv", what)
    columns: dict[str, Any] = {heading("point", ""): nodes.names} if nodes.names else {}
    declared = {**layout.datasets("places"), **layout.datasets("worn/-/nodes")}
    for name, array in {**nodes.arrays, **state.fields["nodes"]}.items():
        by_axis = array.reshape(len(array), -1).T
        axes = "xyz" if len(by_axis) > 1 else ("",)
        for axis, values in zip(axes, by_axis, strict=True):
            columns[heading(f"{name}_{axis}".strip("_"), declared[name].unit)] = values
    write_table(path, columns, DIGITS)


# --- summary ------------------------------------------------------------------------------------


def _summary(outcome: VibrationWearOutcome) -> dict[str, Any]:
    states, last = outcome.states, outcome.states[-1].numbers
    energy = last["energy"]
    return {
        "volume_per_energy": last["volume"] / energy if energy > 0.0 else 0.0,
        "states": [_of_state(outcome.case.amount, state) for state in states],
        "trend": {
            name: trend([state.numbers[name] for state in states])
            for name in TRENDS
            if name in states[0].numbers
        }
        | {"resonance": trend([state.responses[0].numbers["resonance"] for state in states])},
    }


def _of_state(amount: ExcitationSize, state: WornRig) -> dict[str, Any]:
    responses = [{amount.name: response.force, **response.numbers} for response in state.responses]
    # JSON has no NaN.
    numbers = {name: value for name, value in state.numbers.items() if value == value}
    return {**numbers, "responses": responses}


def _line(amount: ExcitationSize, state: WornRig) -> str:
    """Return a state as one line of text."""
    numbers = state.numbers
    resonances = ", ".join(
        f"{response.numbers['resonance']:.4g} Hz {amount.under(response.force)}"
        for response in state.responses
    )
    stiffness = PER_MICRON * numbers["stiffness"]
    sticks = f"kt {stiffness:.4g} N/um, " if np.isfinite(stiffness) else ""
    return (
        f"{state.cycles:g} cycles, {TO_JOULES * numbers['energy']:.4g} J: {sticks}depth "
        f"{TO_MICRONS * numbers['depth']:.3g} um, stroke {TO_MICRONS * numbers['stroke']:.3g} um; "
        f"resonance {resonances}"
    )
