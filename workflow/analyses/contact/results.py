"""What a contact run leaves: results, summary, ParaView files and figures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from sa_solver.types import Array, Frame, Grid
from workflow.analyses.contact.bodies import bodies_of, bulk_strain
from workflow.analyses.contact.case import ContactCase, LineContactCase
from workflow.analyses.contact.figures import figures_of
from workflow.analyses.contact.load_table import FORCES, MOTIONS, LoadTable
from workflow.analyses.contact.paraview import write_contact
from workflow.analyses.contact.summary import loop_summary, slides, state_summaries, stick_zone
from workflow.case.writing import dump_case
from workflow.pictures.drawing import write_pictures
from workflow.shell.folder import OutputFolder
from workflow.shell.reporter import Reporter
from workflow.shell.store import BODIES, ResultsWriter, replacing
from workflow.shell.versions import versions

if TYPE_CHECKING:
    from sa_solver.history import History


@dataclass(frozen=True)
class ContactOutcome:
    """Everything a contact run found; ``height`` ``(nx, ny)`` is the gap before loading [mm]."""

    case: ContactCase | LineContactCase
    grid: Grid
    height: Array
    table: LoadTable
    history: History


def write_contact_output(outcome: ContactOutcome, folder: OutputFolder, reporter: Reporter) -> None:
    """Write all files of a finished run; the summary comes last and marks it as finished."""
    with reporter.stage("results"):
        write_contact_results(outcome, folder)
    with reporter.stage("paraview and figures"):
        write_pictures(outcome.case.output, folder, figures_of, write_contact)
    summary = _summary(outcome, reporter)
    folder.write_summary(summary)
    _say(summary, outcome.grid, reporter)


def write_contact_results(outcome: ContactOutcome, folder: OutputFolder) -> None:
    """Write ``results.h5`` with the states there are."""
    case, history = outcome.case, outcome.history
    friction = case.friction.coefficient
    with replacing(folder.results) as partial, h5py.File(partial, "w") as file:
        writer = ResultsWriter(file, per_length=outcome.grid.line)
        file.attrs.update({"title": case.title, "friction": friction})
        file.create_group("case").attrs.update({"text": dump_case(case)} | versions())
        writer.put_grid(BODIES, outcome.grid, Frame(np.zeros(3), np.eye(3)))
        writer.put(f"surfaces/{BODIES}", height=outcome.height)
        writer.put("path", **outcome.table.columns)
        writer.put(
            "history", increment=np.array(history.indices) + 1, **_columns(history, friction)
        )
        file["history"].attrs.update({"method": history.method, "reason": history.reason})
        for index, state in zip(history.indices, history.states, strict=True):
            group = f"contact/{BODIES}/{index + 1:05d}"
            writer.put(
                group,
                pressure=state.traction[2],
                shear=state.traction[:2],
                slip=state.slip,
                gap=state.gap,
                sticking=stick_zone(state, friction),
            )
            file[group].attrs["increment"] = index + 1


def _columns(history: History, friction: float) -> dict[str, Array]:
    """Resultants, rigid motions and energies of the computed increments, ``(n,)`` each."""
    forces = np.array([state.resultants for state in history.states])
    motions = np.array([state.rigid for state in history.states])
    energies = np.array([state.energy for state in history.states])
    return {
        **dict(zip(FORCES, forces.T, strict=True)),
        **dict(zip(MOTIONS, motions.T, strict=True)),
        **dict(zip(("Edx", "Edy"), energies.T, strict=True)),
        "sliding": np.array([slides(state, friction) for state in history.states]),
    }


def _summary(outcome: ContactOutcome, reporter: Reporter) -> dict[str, Any]:
    case, grid, history = outcome.case, outcome.grid, outcome.history
    friction = case.friction.coefficient
    strain = bulk_strain(outcome.table, bodies_of(case))
    return {
        "title": case.title,
        "assumed": list(case.assumed),
        "increments": len(outcome.table),
        "history": {
            "method": history.method,
            "reason": history.reason,
            "error": history.error,
            "error_of": history.error_of,
        },
        "states": state_summaries(grid, friction, history),
        "loop": loop_summary(grid, friction, outcome.table, history, strain),
        "convolutions": sum(state.convolutions for state in history.states),
        "warnings": reporter.warnings,
        "seconds": {name: round(value, 2) for name, value in reporter.seconds.items()},
        "versions": versions(),
    }


def _say(summary: dict[str, Any], grid: Grid, reporter: Reporter) -> None:
    """The end of the run in a few lines."""
    last, method = summary["states"][-1], summary["history"]["method"]
    reporter.say(
        f"{summary['increments']} increments, {len(summary['states'])} computed ({method}), "
        f"{summary['convolutions']} convolutions"
    )
    size = "half_width" if grid.line else "radius"
    reporter.say(
        f"  last: peak pressure {last['peak_pressure']:.4g} MPa, contact {size.replace('_', ' ')} "
        f"{last[f'contact_{size}']:.4g} mm, stick {last[f'stick_{size}']:.4g} mm"
    )
    if loop := summary["loop"]:
        energy = "N mm per mm" if grid.line else "N mm"
        reporter.say(f"  cycle: {loop['energy']:.5g} {energy} dissipated")
    reporter.say(f"  seconds: {', '.join(f'{k} {v:.1f}' for k, v in summary['seconds'].items())}")
