"""Conversion of a body in ``results.h5`` to a VTK mesh."""

from __future__ import annotations

from typing import TYPE_CHECKING

import h5py

if TYPE_CHECKING:
    import pyvista


def body_mesh(group: h5py.Group) -> pyvista.UnstructuredGrid:
    """Return the body's tetrahedra or, in the plane, its triangles, without fields."""
    import pyvista

    elements = group["elements"][()]
    kind = pyvista.CellType.TETRA if elements.shape[1] == 4 else pyvista.CellType.TRIANGLE
    return pyvista.UnstructuredGrid({kind: elements}, group["points"][()])
