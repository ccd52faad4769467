"""The copy on disk of the state that a wear run has between two jumps."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from sa_solver.normal import NormalStart
from sa_solver.types import LoadHistory
from wear.coupled import CoupledState
from wear.interface import InterfaceState
from wear.surfaces import Surfaces
from wear.worn import Spent
from workflow.errors import UserError
from workflow.shell.store import read_arrays, write_arrays

# What the state has of all jumps.
HISTORIES = ("cycles", "kinetics", "drift", "solved_resultants")
# What the state of one interface has: parts of arrays, arrays, numbers.
PARTS: dict[str, Any] = {"surfaces": Surfaces, "loads": LoadHistory}
ARRAYS = ("slip", "error", "ends")
SCALARS = ("energy", "depth_rate", "volume_rate", "volume_error", "next_cycles")


def save(path: Path, state: CoupledState) -> None:
    """Write the state; the old file stays until the new one is whole."""
    arrays: dict[str, object] = {name: getattr(state, name) for name in HISTORIES}
    for number, interface in enumerate(state.interfaces):
        group = f"interface_{number}"
        for part, kind in PARTS.items():
            for field in fields(kind):
                values = getattr(getattr(interface, part), field.name)
                arrays[f"{group}/{part}/{field.name}"] = values
        arrays |= {f"{group}/{name}": getattr(interface, name) for name in ARRAYS}
        arrays[f"{group}/scalars"] = np.array([getattr(interface, name) for name in SCALARS])
        for increment, start in interface.starts.items():
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
        **{name: arrays[name] for name in HISTORIES},
        solutions=int(attributes["solutions"]),
        spent=Spent(*(int(attributes[count.name]) for count in fields(Spent))),
    )


def _load_interface(arrays: dict[str, Any], group: str) -> InterfaceState:
    prefix = f"{group}/starts/"
    increments = sorted(
        {int(n[len(prefix) :].split("/")[0]) for n in arrays if n.startswith(prefix)}
    )
    starts = {
        t: NormalStart(arrays[f"{prefix}{t}/pressure"], arrays[f"{prefix}{t}/displacement"])
        for t in increments
    }
    scalars = dict(zip(SCALARS, arrays[f"{group}/scalars"].tolist(), strict=True))
    parts: dict[str, Any] = {
        part: kind(**{f.name: arrays[f"{group}/{part}/{f.name}"] for f in fields(kind)})
        for part, kind in PARTS.items()
    }
    return InterfaceState(
        starts=starts, **parts, **{name: arrays[f"{group}/{name}"] for name in ARRAYS}, **scalars
    )
