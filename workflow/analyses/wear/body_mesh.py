"""A body of ``results.h5`` as a mesh of VTK's."""

from __future__ import annotations

from typing import TYPE_CHECKING

import h5py

if TYPE_CHECKING:
    import pyvista


def body_mesh(group: h5py.Group) -> pyvista.UnstructuredGrid:
    """Its tetrahedra or, in the plane, its triangles, without fields."""
    import pyvista

    elements = group["elements"][()]
    kind = pyvista.CellType.TETRA if elements.shape[1] == 4 else pyvista.CellType.TRIANGLE
    return pyvista.UnstructuredGrid({kind: elements}, group["points"][()])
