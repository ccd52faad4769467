"""State of a normal contact, and the initial guess of a solution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sa_solver.normal.problem import NormalResiduals
from sa_solver.types import Array


@dataclass(frozen=True)
class NormalStart:
    """Initial guess of a solve: pressure [MPa] and its displacement K p [mm], ``(nx, ny)``."""

    pressure: Array
    displacement: Array


@dataclass(frozen=True)
class NormalState:
    """Solution of a normal contact problem.

    Attributes
    ----------
    pressure
        Pressure ``(nx, ny)`` [MPa].
    gap
        Gap ``(nx, ny)`` [mm].
    displacement
        Elastic displacement K p ``(nx, ny)`` [mm].
    approach, tilt_x, tilt_y
        Rigid motions δz [mm], φx and φy [rad]. A tilt that the pressed cells cannot resist, because
        they lie on one line or point, is the smallest possible.
    P, Mx, My
        Resultants of the pressure [N, N mm; per mm on a line grid].
    residuals
        Residuals of the state, which do not depend on the method.
    converged
        Whether all residuals are within the tolerance.
    message
        What is wrong and what to try, if the state has not ``converged`` or the contact reaches the
        border of the grid; empty otherwise.
    convolutions
        Cost of the solution in convolutions on the whole grid, by the size of the transforms,
        rounded up. Each iteration also transforms an unpadded field, at a quarter of the cost of a
        convolution, which is not counted.
    border_load
        Share of P that the outermost cells carry; above 0 the grid is too small.
    cell_area
        Area of a cell of the grid [mm²].
    method
        Method that found the solution.
    flattening
        Depth ``(nx, ny)`` [mm] by which the surfaces have yielded, None without a hardness.
    """

    pressure: Array
    gap: Array
    displacement: Array
    approach: float
    tilt_x: float
    tilt_y: float
    P: float
    Mx: float
    My: float
    residuals: NormalResiduals
    converged: bool
    message: str
    convolutions: int
    border_load: float
    cell_area: float
    method: str = ""
    flattening: Array | None = None

    @property
    def contact_area(self) -> float:
        """Area of the cells in contact [mm²]; for a line contact its width [mm]."""
        return float(np.count_nonzero(self.pressure)) * self.cell_area

    @property
    def elastic_energy(self) -> float:
        """Elastic energy ½ Σ p u S of both bodies [N mm], with their displacement u = K p.

        For bodies that do not wear it equals the work of P and the moments since the bodies were
        apart. For a line contact it is per mm, and within the datum of the half-space.
        """
        return 0.5 * float(np.vdot(self.pressure, self.displacement)) * self.cell_area

    @property
    def start(self) -> NormalStart:
        """Initial guess for the next solve on the same grid."""
        return NormalStart(self.pressure, self.displacement)

    @property
    def touches_border(self) -> bool:
        """True if the outermost cells of the grid carry load."""
        return self.border_load > 0.0
