"""Sector of a ring in a travelling wave: every harmonic has its own number of nodal diameters.

The sector is solved harmonic by harmonic like any structure, with the complex mode shapes for the
nodal diameters of each harmonic. Its joints are marched through one period: those of the other
sectors do the same, later. A joint to the next sector has both of its ends in its row of B_d = B
T_d, and B_dᴴ applies its force to both. Only travelling waves are computed, not motions in which
sectors differ, such as standing waves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fe_models.dynamics.model import stiffened
from fe_models.dynamics.periodic.harmonic_jacobian import HarmonicTransfer
from fe_models.dynamics.periodic.harmonics import ComplexArray, Resolution
from fe_models.dynamics.periodic.receptance import Receptance, SteadyMotion
from fe_models.dynamics.rings.sector import CyclicSector
from sa_solver.types import Array


class WaveReceptance:
    """Receptance of a sector, with the nodal diameters of each harmonic.

    Parameters
    ----------
    sector
        The sector.
    tangents
        Springs ``(j, d, d)`` [N/mm] in place of the joints, or None. They do not change the damping
        matrix.
    mixed
        Whether damping between different modes is kept; see :class:`Receptance`.
    """

    def __init__(
        self, sector: CyclicSector, tangents: Array | None = None, *, mixed: bool = True
    ) -> None:
        self.sector, self._tangents, self._mixed = sector, tangents, mixed
        self._receptance_of_shift: dict[int, Receptance] = {}

    def of(self, harmonic: int) -> Receptance:
        """Return the receptance of the sector at the nodal diameters of a harmonic."""
        shift = self.sector.ring.shift(harmonic)
        if shift not in self._receptance_of_shift:
            model = self.sector.at(shift)
            if self._tangents is not None:
                model = stiffened(model, self._tangents)
            self._receptance_of_shift[shift] = Receptance(model, mixed=self._mixed)
        return self._receptance_of_shift[shift]

    def stuck(self, tangents: Array) -> WaveReceptance:
        """Return the receptance with springs as joints, without damping between modes."""
        return WaveReceptance(self.sector, tangents, mixed=False)

    def transfer(self, resolution: Resolution, directions: int) -> WaveTransfer:
        """Return the transfer between joints and modes at all harmonics of a resolution."""
        structures = tuple(self.of(harmonic) for harmonic in resolution.harmonics)
        return WaveTransfer(resolution, self.of(0), directions, structures)


class WaveMotion(SteadyMotion):
    """Sector at frequencies ``(k,)``, one per harmonic.

    Parameters
    ----------
    rest
        Receptance without nodal diameters, which is that of the sector at rest.
    structures
        Receptance of each harmonic.
    angular
        Angular frequencies ``(k,)`` [rad/s] of the harmonics.
    """

    def __init__(self, rest: Receptance, structures: Sequence[Receptance], angular: Array) -> None:
        self.structure, self.angular, self._structures = rest, angular, structures
        self._moving = int(angular[0] == 0.0)
        # One inverse per harmonic, since every harmonic has its own modes.
        self._inverses = [
            structures[row].inverse_at(angular[row : row + 1])
            for row in range(self._moving, len(structures))
        ]

    def vibrate(self, force: ComplexArray) -> ComplexArray:
        response = np.zeros(force.shape, dtype=complex)
        for row, inverse in enumerate(self._inverses, start=self._moving):
            response[row] = inverse.apply(force[row : row + 1])[0]
        return response

    def per_force(self, weights: ComplexArray) -> ComplexArray:
        rows = zip(self._inverses, weights, strict=True)
        return np.array([inverse.apply_transposed(row[None])[0] for inverse, row in rows])

    def stiffness_slope(self, motion: ComplexArray) -> ComplexArray:
        slopes = -2.0 * self.angular[:, None] * motion
        for row, each in enumerate(self._structures):
            damping = each.damping
            by_velocity = damping @ motion[row] if damping.ndim == 2 else damping * motion[row]
            slopes[row] += 1j * by_velocity
        return np.asarray(slopes)

    def between_joints(self) -> ComplexArray:
        size, moving = len(self.structure.at_joints), self._moving
        between = np.empty((len(self.angular), size, size), dtype=complex)
        if moving:
            between[0] = self.structure.static_flexibility
        for row, inverse in enumerate(self._inverses, start=moving):
            inverse.write_between_joints(self._structures[row].at_joints, between[row : row + 1])
        return between


@dataclass(frozen=True)
class WaveTransfer(HarmonicTransfer):
    """Transfer between joints and modes of a sector.

    ``structures`` ``(k,)`` are the receptances of the harmonics. ``receptance`` is that without
    nodal diameters, for the sector at rest.
    """

    structures: tuple[Receptance, ...]

    def steady(self, angular: Array) -> WaveMotion:
        return WaveMotion(self.receptance, self.structures, angular)

    def modal(self, force: Array) -> ComplexArray:
        forces = self.resolution.amplitudes(force)
        return self._map_each(forces, self._joints_to_modes)

    def at_joints(self, motion: ComplexArray) -> Array:
        moved = self._map_each(motion, [each.at_joints.T for each in self.structures])
        return self.resolution.coefficients(moved, self.directions).ravel()

    def load_on_modes(self, load: ComplexArray, row: int) -> ComplexArray:
        return np.asarray(load @ self.structures[row].at_points.conj())

    def displacement(self, motion: ComplexArray) -> ComplexArray:
        return self._map_each(motion, [each.at_points.T for each in self.structures])

    @cached_property
    def _joints_to_modes(self) -> list[ComplexArray]:
        return [each.at_joints.conj() for each in self.structures]

    def _map_each(self, amplitudes: ComplexArray, maps: Sequence[ComplexArray]) -> ComplexArray:
        """Multiply amplitudes ``(k, ...)`` of each harmonic by its own matrix."""
        return np.array([row @ by for row, by in zip(amplitudes, maps, strict=True)])


def transfer_of(
    resolution: Resolution, receptance: Receptance | WaveReceptance, directions: int
) -> HarmonicTransfer:
    """Return the transfer between the joints and modes of a structure, or of a sector in a wave.

    Parameters
    ----------
    resolution
        Harmonics of the motion and samples of a period.
    receptance
        The structure or the sector.
    directions
        Number of directions of each joint.
    """
    if isinstance(receptance, WaveReceptance):
        return receptance.transfer(resolution, directions)
    return HarmonicTransfer(resolution, receptance, directions)
