"""Control of a normal contact: for each rigid freedom an imposed resultant or motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sa_solver import checks
from sa_solver.errors import ContactProblemError
from sa_solver.rigid_modes import APPROACH, mode_lengths
from sa_solver.types import Array, Grid


class NormalContactError(ContactProblemError):
    """Data of a normal contact problem that admit no solution."""


@dataclass(frozen=True)
class NormalControl:
    """Imposed resultants and motions of a normal contact, one of each pair.

    The pairs are ``P`` [N] and ``approach`` [mm], ``Mx`` [N mm] and ``tilt_x`` [rad], ``My`` and
    ``tilt_y``. A tilt is held at 0 where neither it nor its moment is given. NormalContactError is
    raised for both of a pair, neither ``P`` nor ``approach``, values that are not finite, and a
    negative load.
    """

    P: float | None = None
    Mx: float | None = None
    My: float | None = None
    approach: float | None = None
    tilt_x: float | None = None
    tilt_y: float | None = None

    def __post_init__(self) -> None:
        for force, motion in (("P", "approach"), ("Mx", "tilt_x"), ("My", "tilt_y")):
            if None not in (getattr(self, force), getattr(self, motion)):
                raise NormalContactError(
                    f"{force} and {motion} are both given: impose one, the other follows"
                )
        if self.P is None and self.approach is None:
            raise NormalContactError("neither P nor approach is given: impose one of them")
        for moment, tilt in (("Mx", "tilt_x"), ("My", "tilt_y")):
            if getattr(self, moment) is None and getattr(self, tilt) is None:
                checks.settle(self, **{tilt: 0.0})
        for name, value in vars(self).items():
            if value is not None:
                checks.settle(self, **{name: checks.number(name, value, error=NormalContactError)})
        if self.P is not None and self.P < 0.0:
            raise NormalContactError(f"load P = {self.P:g} N pulls: give P >= 0")

    @property
    def free(self) -> tuple[int, ...]:
        """Modes whose resultants are imposed and whose motions are unknown."""
        motions = (self.approach, self.tilt_x, self.tilt_y)
        return tuple(mode for mode, motion in enumerate(motions) if motion is None)

    @property
    def resultants(self) -> Array:
        """Resultants P, Mx, My ``(3,)``, 0 where the motion is imposed."""
        return np.array([value or 0.0 for value in (self.P, self.Mx, self.My)])

    @property
    def motions(self) -> Array:
        """Motions δz, φx, φy ``(3,)``, 0 where the resultant is imposed."""
        return np.array([value or 0.0 for value in (self.approach, self.tilt_x, self.tilt_y)])

    def sums(self, grid: Grid, free: tuple[int, ...]) -> Array:
        """Return the sums of pressure times each of the modes ``free`` [MPa].

        They follow from the imposed resultants.
        """
        sums: Array = self.resultants / (mode_lengths(grid) * grid.cell_area)
        return sums[list(free)]

    def check_moments(self, grid: Grid) -> None:
        """Raise NormalContactError for a moment that pressure on ``grid`` cannot carry.

        An imposed load must act strictly inside the convex hull of the cell centres.
        """
        P, Mx, My = self.resultants
        for name, moment, centres in (("Mx", Mx, grid.y), ("My", -My, grid.x)):
            reach = float(centres.max())
            if moment == 0.0 or (APPROACH not in self.free and reach > 0.0):
                continue
            if abs(moment) >= P * reach:
                raise NormalContactError(
                    f"{name} = {abs(moment):g} N mm under P = {P:g} N puts the load outside the "
                    f"cells, more than {reach:g} mm off centre: enlarge the grid or lower the "
                    "moment"
                )
