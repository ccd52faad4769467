"""Checkpoint of an unfinished run: its last state, tied to its case and to its files by digests.

The file on disk stores the provenance of the run and the digest of every file of steps written
before it. Both are checked before a resumed run computes anything.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from workflow.case.fields import shown
from workflow.errors import RunChanged
from workflow.shell.folders.folder import CHOICE, OutputFolder
from workflow.shell.folders.store import DamagedFile, checked_digest, read_arrays, write_arrays

# Names of arrays in the checkpoint that are added to those of the analysis.
PROVENANCE, JUMPS = "provenance", "jumps"
# Text of a message for the value of an entry that only the other case has.
ABSENT = "not given"


@dataclass(frozen=True)
class StoredState:
    """Last stored state of a run and the digests of all its files of steps."""

    arrays: Mapping[str, Any]
    attributes: Mapping[str, Any]
    jumps: Sequence[str]


def save(folder: OutputFolder, state: StoredState, provenance: Mapping[str, Any]) -> None:
    """Write the state; the old file remains until the new one is complete."""
    ties = {PROVENANCE: json.dumps(provenance), JUMPS: np.array(state.jumps, dtype="S64")}
    write_arrays(folder.checkpoint, {**state.arrays, **ties}, state.attributes)


def load(folder: OutputFolder, provenance: Mapping[str, Any]) -> StoredState:
    """Return the last state.

    Raises UserError if the state, its files of steps and the case do not belong together.
    """
    try:
        arrays, attributes = read_arrays(folder.checkpoint)
        begun = json.loads(arrays.pop(PROVENANCE))
        jumps = [digest.decode("ascii") for digest in arrays.pop(JUMPS)]
    except DamagedFile as error:
        raise RunChanged(f"{error}; {folder.again}") from error
    except (OSError, KeyError) as error:
        raise RunChanged(
            f"{folder.checkpoint}: cannot be read ({error}); {folder.again}"
        ) from error
    if begun != provenance:
        raise RunChanged(f"{_changed(folder, begun, provenance)}; put that back, or {folder.again}")
    for number, kept in enumerate(jumps):
        path = folder.jump(number)
        try:
            same = checked_digest(path) == kept
        except OSError:
            raise RunChanged(f"{path}: missing or unreadable; {folder.again}") from None
        except DamagedFile as error:
            raise RunChanged(f"{error}; {folder.again}") from error
        if not same:
            raise RunChanged(f"{path}: of another run than {folder.checkpoint}; {folder.again}")
    return StoredState(arrays, attributes, jumps)


def _changed(folder: OutputFolder, begun: Mapping[str, Any], now: Mapping[str, Any]) -> str:
    """Return a message that names the input whose content has changed since the run began."""
    if begun["case"] != now["case"]:
        return f"{folder.case}: {_entry(begun['case'], now['case'])}"
    files = now["input_files"]
    changed = [file for file, kept in begun["input_files"].items() if files.get(file) != kept]
    return f"{(*changed, folder.jumps / CHOICE)[0]}: has changed since the run was begun"


def _entry(begun: Any, now: Any, place: str = "") -> str:
    """Return a message on the first entry in which two different cases differ."""
    if isinstance(begun, dict) and isinstance(now, dict):
        values = {key: (begun.get(key, ABSENT), now.get(key, ABSENT)) for key in {**begun, **now}}
    elif isinstance(begun, list) and isinstance(now, list) and len(begun) == len(now):
        values = {str(n): pair for n, pair in enumerate(zip(begun, now, strict=True))}
    else:
        return f"{place}: {shown(now)}, but {shown(begun)} when the run was begun"
    key = next(key for key, (before, after) in values.items() if before != after)
    return _entry(*values[key], f"{place}.{key}".lstrip("."))
