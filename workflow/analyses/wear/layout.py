"""What a wear run's ``results.h5`` holds, for those who draw it."""

from __future__ import annotations

import h5py


def body_names(file: h5py.File) -> dict[int, str]:
    """Names of body 1 and body 2."""
    name_1, name_2 = file.attrs["bodies"]
    return {1: str(name_1), 2: str(name_2)}


def jump_names(file: h5py.File, interface: str) -> list[str]:
    """Names of the jumps that have both surfaces and a contact solution, ascending."""
    return sorted(set(file["surfaces"][interface]) & set(file["contact"][interface]))
