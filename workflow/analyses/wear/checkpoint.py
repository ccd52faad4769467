"""The copy on disk of the state that a wear run has between two jumps."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from sa_solver.normal import NormalStart
from sa_solver.types import Array, LoadHistory
from wear.coupled import CoupledState
from wear.interface import InterfaceState
from wear.surfaces import Surfaces
from wear.worn import Spent
from workflow.errors import UserError
from workflow.shell.store import read_arrays, write_arrays

# Numbers of the state of one interface.
SCALARS = ("energy", "depth_rate", "volume_rate", "volume_error", "next_cycles")


def save(path: Path, state: CoupledState) -> None:
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


def load(path: Path) -> CoupledState:
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


def _restored(arrays: dict[str, Any], attributes: dict[str, Any]) -> CoupledState:
    return CoupledState(
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
