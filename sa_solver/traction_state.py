"""Base classes of contact states: areas of contact and stick, and elastic energy."""

from __future__ import annotations

import numpy as np

from sa_solver.types import Array, Mask


class StickingState:
    """State of a contact on a grid whose ``sticking`` cells ``(nx, ny)`` are known.

    ``cell_area`` [mm²] is the area of a cell.
    """

    sticking: Mask
    cell_area: float

    @property
    def stick_area(self) -> float:
        """Area of the cells that stick [mm²]; for a line contact their width [mm]."""
        return float(np.count_nonzero(self.sticking)) * self.cell_area


class TractionState(StickingState):
    """State of a contact with pressure and shear.

    ``traction`` ``(3, nx, ny)`` is ordered qx, qy, p [MPa], ``displacement`` its K t
    ``(3, nx, ny)`` [mm].
    """

    traction: Array
    displacement: Array

    @property
    def pressure(self) -> Array:
        """Pressure p ``(nx, ny)`` [MPa]."""
        pressure: Array = self.traction[2]
        return pressure

    @property
    def shear(self) -> Array:
        """Shear tractions qx, qy ``(2, nx, ny)`` [MPa]."""
        return self.traction[:2]

    @property
    def contact_area(self) -> float:
        """Area of the cells in contact [mm²]; for a line contact its width [mm]."""
        return float(np.count_nonzero(self.pressure)) * self.cell_area

    @property
    def elastic_energy(self) -> float:
        """Elastic energy ½ Σ t·u S of both bodies [N mm], with u = K t.

        In an increment the work of forces and moments equals the growth of this energy plus the
        energy dissipated by slip, but for the work of a bulk strain, which is in neither. For a
        line contact the energy is per mm, and within the datum of the half-space.
        """
        return 0.5 * float(np.vdot(self.traction, self.displacement)) * self.cell_area
