"""The state of a wear run between two jumps, and its copy on disk."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from sa_solver.normal import NormalStart
from sa_solver.types import Array, LoadHistory
from wear.surfaces import Surfaces
from workflow.analyses.wear.interface_state import InterfaceState, Spent
from workflow.errors import UserError
from workflow.shell.store import read_arrays, write_arrays

# Columns of the kinetics of one interface.
KINETICS = ("depth_1", "depth_2", "volume_1", "volume_2", "energy")
# Numbers of the state of one interface.
SCALARS = ("energy", "depth_rate", "volume_rate", "volume_error", "next_cycles")


@dataclass(frozen=True)
class RunState:
    """Everything a wear run needs to go on.

    ``cycles`` ``(j,)`` are those at the end of every jump so far, the unworn state included;
    ``kinetics`` ``(j, interfaces, 5)`` has the columns ``KINETICS``; ``solved_resultants``
    ``(interfaces, 6)`` is the probe at the last structural solution; ``drift`` ``(j,)`` the drift
    found after each jump; ``solutions`` counts the structural solutions, ``spent`` what the
    contacts have taken.
    """

    interfaces: tuple[InterfaceState, ...]
    cycles: Array
    kinetics: Array
    drift: Array
    solved_resultants: Array
    solutions: int
    spent: Spent

    @property
    def jump(self) -> int:
        """Number of jumps done."""
        return len(self.cycles) - 1

    def record(self, cycles: float, cell_areas: list[float], drift: float) -> RunState:
        """The state with a row of kinetics added."""
        row = [
            kinetics_row(state, area)
            for state, area in zip(self.interfaces, cell_areas, strict=True)
        ]
        return replace(
            self,
            cycles=np.append(self.cycles, cycles),
            kinetics=np.concatenate([self.kinetics, np.array([row])]),
            drift=np.append(self.drift, drift),
        )


def kinetics_row(state: InterfaceState, cell_area: float) -> list[float]:
    """Values of ``KINETICS`` for one interface."""
    depths = state.surfaces.depth_1, state.surfaces.depth_2
    return [
        *(float(depth.max()) for depth in depths),
        *(float(depth.sum()) * cell_area for depth in depths),
        state.energy,
    ]


def save(path: Path, state: RunState) -> None:
    """Write the state; the old file stays until the new one is whole."""
    arrays: dict[str, object] = {
        name: getattr(state, name) for name in ("cycles", "kinetics", "drift", "solved_resultants")
    }
    for number, own in enumerate(state.interfaces):
        group = f"interface_{number}"
        for part in fields(Surfaces):
            arrays[f"{group}/surfaces/{part.name}"] = getattr(own.surfaces, part.name)
        for column in fields(LoadHistory):
            arrays[f"{group}/loads/{column.name}"] = getattr(own.loads, column.name)
        arrays[f"{group}/slip"] = own.slip
        arrays[f"{group}/error"] = own.error
        arrays[f"{group}/ends"] = own.ends
        arrays[f"{group}/scalars"] = np.array([getattr(own, name) for name in SCALARS])
        for increment, start in own.starts.items():
            arrays[f"{group}/starts/{increment}/pressure"] = start.pressure
            arrays[f"{group}/starts/{increment}/displacement"] = start.displacement
    attributes = {"solutions": state.solutions, "interfaces": len(state.interfaces)}
    attributes |= vars(state.spent)
    write_arrays(path, arrays, attributes)


def load(path: Path) -> RunState:
    """Read a state; raises :class:`UserError` if the file is damaged."""
    try:
        return _restored(*read_arrays(path))
    except (OSError, KeyError, TypeError, ValueError, RuntimeError) as error:
        reason = " ".join(str(error).split())
        raise UserError(f"{path}: damaged ({reason}): start again with `run --force`") from error


def readable(path: Path) -> bool:
    """Whether the state is whole."""
    try:
        load(path)
    except UserError:
        return False
    return True


def _restored(arrays: dict[str, Any], attributes: dict[str, Any]) -> RunState:
    return RunState(
        interfaces=tuple(
            _load_interface(arrays, f"interface_{number}")
            for number in range(int(attributes["interfaces"]))
        ),
        cycles=arrays["cycles"],
        kinetics=arrays["kinetics"],
        drift=arrays["drift"],
        solved_resultants=arrays["solved_resultants"],
        solutions=int(attributes["solutions"]),
        spent=Spent(*(int(attributes[own.name]) for own in fields(Spent))),
    )


def _load_interface(arrays: dict[str, Array], group: str) -> InterfaceState:
    prefix = f"{group}/starts/"
    increments = sorted(
        {int(n[len(prefix) :].split("/")[0]) for n in arrays if n.startswith(prefix)}
    )
    starts = {
        t: NormalStart(arrays[f"{prefix}{t}/pressure"], arrays[f"{prefix}{t}/displacement"])
        for t in increments
    }
    scalars = dict(zip(SCALARS, arrays[f"{group}/scalars"].tolist(), strict=True))
    surfaces = {part.name: arrays[f"{group}/surfaces/{part.name}"] for part in fields(Surfaces)}
    loads = {column.name: arrays[f"{group}/loads/{column.name}"] for column in fields(LoadHistory)}
    return InterfaceState(
        surfaces=Surfaces(**surfaces),
        loads=LoadHistory(**loads),  # type: ignore[arg-type]
        slip=arrays[f"{group}/slip"],
        error=arrays[f"{group}/error"],
        ends=arrays[f"{group}/ends"],
        starts=starts,
        **scalars,
    )
