"""Output of a contact run: results, summary, ParaView files and figures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from sa_solver.contact_state import ContactState
from sa_solver.cycles.history import History
from sa_solver.types import Array, Frame, Grid, Mask
from workflow.analyses.contact.case import BodiesCase
from workflow.analyses.contact.output.layout import BODIES, LAYOUT, ContactContents
from workflow.analyses.contact.output.summary import (
    increments_errors,
    loop_summary,
    slides,
    state_summaries,
    stick_zone,
)
from workflow.case.text.plain import counted
from workflow.case.text.readable import percent
from workflow.models.uncoupled.load_table import FORCES, MOTIONS, LoadTable
from workflow.shell.analysis import Run
from workflow.shell.output.results import run_results
from workflow.shell.output.summary import finish

ContactRun = Run[BodiesCase]

# Attributes of a history in the summary.
HISTORY = "method", "reason", "parts", "error", "error_of", "energy_error"


@dataclass(frozen=True)
class ContactOutcome:
    """All results of a contact run.

    ``height`` ``(nx, ny)`` is the gap before loading [mm]. ``strain`` ``(n,)`` is the strain of
    body 2 less that of body 1 by bulk stress. ``convolutions`` is the number in all solves,
    including passes over the path that were too coarse to be kept.
    """

    case: BodiesCase
    grid: Grid
    height: Array
    table: LoadTable
    strain: Array
    history: History
    convolutions: int


def write_contact_output(outcome: ContactOutcome, run: ContactRun) -> None:
    """Write all files of a finished run; the summary comes last and marks it as finished."""
    with run.reporter.stage("results"):
        write_contact_results(outcome, run)
    run.draw(_contents(outcome))
    summary = _summary(outcome)
    finish(run, summary, _lines(summary, outcome.grid))


def _contents(outcome: ContactOutcome) -> ContactContents:
    return ContactContents(outcome.grid.line, len(outcome.history.states))


def write_contact_results(outcome: ContactOutcome, run: ContactRun) -> None:
    """Write ``results.h5`` with the states that were computed."""
    case, grid, history = outcome.case, outcome.grid, outcome.history
    friction = case.friction.coefficient
    with run_results(run, case, LAYOUT, {"friction": friction}, grid.line) as writer:
        writer.put_contents(_contents(outcome))
        writer.put_grid(f"grid/{BODIES}", grid, Frame(np.zeros(3), np.eye(3)))
        writer.put(f"surfaces/{BODIES}", {"height": outcome.height})
        writer.put("path", outcome.table.columns)
        method = {"method": history.method, "reason": history.reason, "parts": history.parts}
        writer.put("history", _columns(history, friction), **method)
        for index, state in zip(history.indices, history.states, strict=True):
            place = f"contact/{BODIES}/{index + 1:05d}"
            writer.put(place, _fields(state, friction), increment=index + 1)


def _columns(history: History, friction: float) -> dict[str, Array]:
    """Return resultants, rigid motions and energies of the computed increments, ``(n,)`` each."""
    forces = np.array([state.resultants for state in history.states])
    motions = np.array([state.rigid for state in history.states])
    energies = np.array([state.energy for state in history.states])
    return {
        "increment": np.array(history.indices) + 1,
        **dict(zip(FORCES, forces.T, strict=True)),
        **dict(zip(("Edx", "Edy"), energies.T, strict=True)),
        "sliding": np.array([slides(state, friction) for state in history.states]),
        **dict(zip(MOTIONS, motions.T, strict=True)),
    }


def _fields(state: ContactState, friction: float) -> dict[str, Array | Mask]:
    """Return fields of the contact in one increment."""
    known = {"limit": state.limit, "flattening": state.flattening}
    others = {name: field for name, field in known.items() if field is not None}
    return {
        "pressure": state.traction[2],
        "shear": state.traction[:2],
        "slip": state.slip,
        "gap": state.gap,
        "sticking": stick_zone(state, friction),
        **others,
    }


def _summary(outcome: ContactOutcome) -> dict[str, Any]:
    case, grid, history = outcome.case, outcome.grid, outcome.history
    friction, surfaces = case.friction.coefficient, case.structure.surfaces
    reported = grid, friction, outcome.table, history, outcome.strain
    return {
        **({} if surfaces is None else {"surfaces": surfaces.summary(grid)}),
        "increments": len(outcome.table),
        "history": {key: getattr(history, key) for key in HISTORY},
        "states": state_summaries(grid, friction, history),
        "loop": loop_summary(*reported),
        "increments_error": increments_errors(*reported),
        "convolutions": outcome.convolutions,
    }


def _lines(summary: dict[str, Any], grid: Grid) -> Iterator[str]:
    """Yield lines on the results, for the end of the run."""
    last, history = summary["states"][-1], summary["history"]
    some = len(summary["states"]) < summary["increments"]
    computed = f", {len(summary['states'])} of them computed" if some else ""
    split = f" in {history['parts']} parts each" if history["parts"] > 1 else ""
    left = ""
    if history["error"] is not None:
        left = (
            f", shear within {percent(history['error'])} of µP, energy within "
            f"{percent(history['energy_error'])}"
        )
    yield (
        f"{counted(summary['increments'], 'increment')}{computed} ({history['method']})"
        f"{split}{left}, {counted(summary['convolutions'], 'convolution')}"
    )
    size = "half_width" if grid.line else "radius"
    yield (
        f"  last: peak pressure {last['peak_pressure']:.4g} MPa, contact {size.replace('_', ' ')} "
        f"{last[f'contact_{size}']:.4g} mm, stick {last[f'stick_{size}']:.4g} mm"
    )
    if loop := summary["loop"]:
        energy = "N mm per mm" if grid.line else "N mm"
        yield f"  cycle: {loop['energy']:.5g} {energy} dissipated"
