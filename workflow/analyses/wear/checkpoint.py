"""Storage of a wear run's state between two jumps in its checkpoint."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from sa_solver.normal.contact import NormalStart
from sa_solver.types import LoadHistory
from wear.contact.interface import InterfaceState
from wear.contact.link import StructureLink
from wear.coupled import CoupledState
from wear.steps.full_cycle import CycleStart
from wear.surfaces import Surfaces
from wear.worn import Spent
from workflow.errors import UserError
from workflow.shell.analysis import Run
from workflow.shell.folders.checkpoint import StoredState, save

# Arrays over all jumps.
HISTORIES = ("cycles", "kinetics", "drift", "solved_resultants")
# Contents of one interface's state: groups of arrays, arrays, numbers.
PARTS: dict[str, Any] = {"surfaces": Surfaces, "loads": LoadHistory, "link": StructureLink}
ARRAYS = ("slip", "pressed", "paths")
# Start values of normal contact solves: their increments, and these fields of each.
INCREMENTS, START = "starts/increments", ("pressure", "displacement")
# Start values of the half-space's frictional cycle.
CYCLE = "cycle_start"
# Group of the coarse companion.
COARSE = "coarse"
SCALARS = ("energy", "depth_rate", "volume_rate", "next_cycles", "order")


def keep(run: Run[Any], state: CoupledState, jumps: Sequence[str]) -> None:
    """Store the state, with the digests of the files of the jumps before it."""
    save(run.folder, StoredState(*stored_state(state), jumps), run.provenance)


def stored_state(state: CoupledState) -> tuple[dict[str, object], dict[str, object]]:
    """Return the arrays and the numbers that store a state."""
    arrays: dict[str, object] = {name: getattr(state, name) for name in HISTORIES}
    for number, interface in enumerate(state.interfaces):
        arrays |= _arrays_of(interface, f"interface_{number}")
    attributes: dict[str, object] = {
        "solutions": state.solutions,
        "interfaces": len(state.interfaces),
    }
    attributes |= vars(state.spent)
    return arrays, attributes


def _arrays_of(interface: InterfaceState, group: str) -> dict[str, object]:
    """Return the arrays of one interface's state and of its coarse companion."""
    arrays: dict[str, object] = {
        f"{group}/{part}/{field.name}": getattr(getattr(interface, part), field.name)
        for part, kind in PARTS.items()
        for field in fields(kind)
    }
    arrays |= {f"{group}/{name}": getattr(interface, name) for name in ARRAYS}
    arrays[f"{group}/scalars"] = np.array([getattr(interface, name) for name in SCALARS])
    # The fields of all increments form one dataset, because each dataset has a fixed cost.
    if interface.starts:
        arrays[f"{group}/{INCREMENTS}"] = np.array(list(interface.starts))
        for name in START:
            fields_of_all = [getattr(start, name) for start in interface.starts.values()]
            arrays[f"{group}/starts/{name}"] = np.stack(fields_of_all)
    if isinstance(interface.start, CycleStart):
        arrays |= {f"{group}/{CYCLE}/{name}": of for name, of in vars(interface.start).items()}
    if isinstance(interface.coarse, InterfaceState):
        arrays |= _arrays_of(interface.coarse, f"{group}/{COARSE}")
    return arrays


def restored(run: Run[Any], kept: StoredState) -> CoupledState:
    """Return the state from which a run is resumed.

    Raises UserError for a state that another version stored.
    """
    try:
        return restored_state(kept.arrays, kept.attributes)
    except (KeyError, TypeError, ValueError) as error:
        folder = run.folder
        raise UserError(
            f"{folder.checkpoint}: of another version of fretscale (no {error}); {folder.again}"
        ) from error


def restored_state(arrays: Mapping[str, Any], attributes: Mapping[str, Any]) -> CoupledState:
    """Return a stored state; raises KeyError, TypeError or ValueError for anything else."""
    return CoupledState(
        interfaces=tuple(
            _load_interface(arrays, f"interface_{number}")
            for number in range(int(attributes["interfaces"]))
        ),
        **{name: arrays[name] for name in HISTORIES},
        solutions=int(attributes["solutions"]),
        spent=Spent(*(int(attributes[count.name]) for count in fields(Spent))),
    )


def _load_interface(arrays: Mapping[str, Any], group: str) -> InterfaceState:
    increments = arrays.get(f"{group}/{INCREMENTS}", np.empty(0)).tolist()
    starts = {
        increment: NormalStart(*(arrays[f"{group}/starts/{name}"][number] for name in START))
        for number, increment in enumerate(increments)
    }
    cycle, start = f"{group}/{CYCLE}", None
    if f"{cycle}/shear" in arrays:
        start = CycleStart(**{f.name: arrays[f"{cycle}/{f.name}"] for f in fields(CycleStart)})
    companion = f"{group}/{COARSE}"
    coarse = _load_interface(arrays, companion) if f"{companion}/scalars" in arrays else None
    scalars = dict(zip(SCALARS, arrays[f"{group}/scalars"].tolist(), strict=True))
    parts: dict[str, Any] = {
        part: kind(**{f.name: arrays[f"{group}/{part}/{f.name}"] for f in fields(kind)})
        for part, kind in PARTS.items()
    }
    given = parts | {name: arrays[f"{group}/{name}"] for name in ARRAYS} | scalars
    return InterfaceState(starts=starts, start=start, coarse=coarse, **given)
