"""Extent of meshed contact faces, and the planes of symmetry that cut them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fe_models.meshes.structure_mesh import Interface

AXIS_NAMES = "xy"


def face_size(face: Interface) -> tuple[float, float]:
    """Return the extent of a face along x and y about its origin [mm]; 1 mm along y of a line.

    A face that planes of symmetry cut has its origin on them: its extent is that of the whole.
    """
    reach = 2.0 * np.abs(face.coordinates).max(axis=0)
    return float(reach[0]), 1.0 if face.line else float(reach[1])


def planes_of_symmetry(planes: Sequence[int]) -> str:
    """Return the planes across some axes of a contact's frame, in words."""
    return " and ".join(f"a plane of symmetry across {AXIS_NAMES[axis]}" for axis in planes)
