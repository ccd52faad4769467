"""What states of contacts with friction say of their cells: areas, and the energy stored."""

from __future__ import annotations

import numpy as np

from sa_solver.types import Array, Mask


class StickingState:
    """State of a contact on a grid, with its ``sticking`` cells ``(nx, ny)``.

    ``cell_area`` [mm²] is that of the grid.
    """

    sticking: Mask
    cell_area: float

    @property
    def stick_area(self) -> float:
        """Area of the cells that stick [mm²; in a line contact, per mm, their width in mm]."""
        return float(np.count_nonzero(self.sticking)) * self.cell_area


class TractionState(StickingState):
    """Such a state with pressure and shear together.

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
        """Area of the cells in contact [mm²; in a line contact, per mm, its width in mm]."""
        return float(np.count_nonzero(self.pressure)) * self.cell_area

    @property
    def elastic_energy(self) -> float:
        """Energy ½ Σ t·u S that all tractions store in both bodies [N mm], with u = K t.

        In an increment forces and moments do as much work as this grows by and slip dissipates.
        Bulk strain does work as well, which neither counts. In a line contact, per mm, it counts up
        to the datum of the half-space.
        """
        return 0.5 * float(np.vdot(self.traction, self.displacement)) * self.cell_area
