"""Loads of one interface from a file, and the columns of such files."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from fe_models.meshes.structure_mesh import Face
from sa_solver.load_history import LoadHistory
from sa_solver.types import Array, Frame, Indices, Tilt
from workflow.analyses.contact.output.layout import LOADS
from workflow.layout.declared import declared

COLUMNS = ("P", "Qx", "Qy", "Mx", "My", "Mz", "Edx", "Edy")
MOMENTS = ("Mx", "My")
# Columns that a line contact has only if it is sheared along its length.
OPTIONAL_IN_LINE = ("Qy", "Mx", "Mz", "Edy")
# Relative change of the contact forces from the cycle before, equal in all rows of an interface.
CLOSURE = "closure"
# Name of the interface in a file without names.
UNNAMED = "interface"


@dataclass(frozen=True)
class ImportedLoads:
    """Data of one interface from a file.

    ``loads`` are those of one closed cycle; without moments the ``tilt`` is held. ``closure`` is
    the change of the contact forces from the cycle before, over the largest force. With the nodes
    of the face there may be: ``slip`` ``(t, 2, n)`` of each increment [mm]; at its end ``force``
    ``(t, 3, n)`` on body 2 [N] and ``displacement`` ``(t, 3, n)`` [mm] relative to body 1, both or
    neither; ``coordinates`` ``(n, 2)`` in the interface frame [mm]; ``facets`` ``(m, 3)`` or, in a
    line contact, ``(m, 2)``; the ``frame`` in the user's axes; the user's node numbers on body 1
    and body 2 ``(n,)``; and the gap of the unloaded, unworn faces [mm], ``nodal_height`` ``(n,)``
    at these nodes and ``height`` ``(nx, ny)`` on the grid of the case. Each is None if it is not
    given. ``weighted`` says how force and displacement are defined at nodes
    (:class:`fe_models.meshes.structure_mesh.Face`).
    """

    loads: LoadHistory
    tilt: Tilt = "free"
    closure: float | None = None
    slip: Array | None = None
    force: Array | None = None
    displacement: Array | None = None
    coordinates: Array | None = None
    facets: Indices | None = None
    frame: Frame | None = None
    nodes_1: Indices | None = None
    nodes_2: Indices | None = None
    nodal_height: Array | None = None
    height: Array | None = None
    weighted: bool = False

    def face(self, name: str) -> Face | None:
        """Return the face on which slip is given, or None if there is none.

        It is in the global axes if the file does not give a frame.
        """
        if self.coordinates is None or self.facets is None:
            return None
        frame = self.frame or Frame(np.zeros(3), np.eye(3))
        return Face(name, frame, self.coordinates, self.facets, weighted=self.weighted)


def base_units(line: bool) -> dict[str, str]:
    """Return the base unit of every column; per length in a line contact."""
    columns = declared(LOADS).items()
    return {name: column.unit_in(line) for name, column in columns if name != "sliding"}


def required_columns(line: bool, given: Collection[str]) -> list[str]:
    """Return the columns required in a file with those ``given``; it needs both moments or none."""
    moments = MOMENTS if tilt_of(line, given) == "held" else ()
    optional = (*(OPTIONAL_IN_LINE if line else ()), *moments)
    return [name for name in COLUMNS if name not in optional]


def tilt_of(line: bool, given: Collection[str]) -> Tilt:
    """Return the tilt for a file with these columns: held without moments of the pressure."""
    moments = MOMENTS[1:] if line else MOMENTS
    return "free" if any(name in given for name in moments) else "held"
