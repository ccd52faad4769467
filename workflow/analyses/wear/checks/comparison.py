"""Comparison of the cycle of the half-space with the structure's, where the method is full."""

from __future__ import annotations

from typing import Any

import numpy as np

from sa_solver.contact_state import ContactState
from sa_solver.load_history import LoadHistory
from workflow.analyses.contact.output.layout import load_columns
from workflow.shell.output.results import ResultsWriter

# Increments shown, as shares of the way from the peak to the end of the cycle: 8, 12 and 15 of 22.
SHOWN = 0.0, 2.0 / 7.0, 0.5


def half_space_loads(cycle: tuple[ContactState, ...], structure: LoadHistory) -> LoadHistory:
    """Return resultants and energies of the half-space's cycle, with the structure's mix."""
    P, Qx, Qy, Mx, My, Mz = np.stack([state.resultants for state in cycle], axis=1)
    Edx, Edy = np.stack([state.energy for state in cycle], axis=1)
    sliding = np.array([state.sliding for state in cycle])
    mix = structure.share, structure.block
    return LoadHistory(P, Qx, Qy, Mx, My, Mz, Edx, Edy, sliding, *mix)


def write_comparison(
    writer: ResultsWriter,
    name: str,
    cycle: tuple[ContactState, ...],
    structure: LoadHistory,
    peak: int,
) -> None:
    """Write the loads of the cycle and its fields at the increments ``SHOWN``.

    In a mix of missions, the fields are those of the mission with the peak load.
    """
    group = f"comparison/{name}"
    writer.put(f"{group}/load_history", load_columns(half_space_loads(cycle, structure)))
    left = next(mission.stop for mission in structure.missions if peak < mission.stop) - 1 - peak
    # In a short cycle two of the increments may coincide, hence a set.
    for increment in sorted({peak + round(share * left) for share in SHOWN}):
        state = cycle[increment]
        fields = {"pressure": state.pressure, "shear": state.shear, "slip": state.slip}
        writer.put(f"{group}/{increment:05d}", fields)


def comparison_summary(
    cycle: tuple[ContactState, ...], structure: LoadHistory, slip_known: bool
) -> dict[str, Any]:
    """Return results of the half-space by increment, with the structure's where they are known."""
    half_space = half_space_loads(cycle, structure)
    forces, energies = ("Qx", "Qy", "Mz"), ("Edx", "Edy")
    known = {*forces, *(energies if slip_known else ())}
    return {
        "sliding": half_space.sliding.tolist(),
        **{
            name: {"half_space": getattr(half_space, name).tolist()}
            | ({"structure": getattr(structure, name).tolist()} if name in known else {})
            for name in (*forces, *energies)
        },
    }
