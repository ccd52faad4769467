"""A sector of a ring in a wave that travels round it: every harmonic has its nodal diameters.

The sector is solved harmonic by harmonic as any structure, with the complex shapes of its modes at
that harmonic's nodal diameters. Joints are marched through a period once: those of the other
sectors do the same later. Of a joint to the next sector both ends are in its row of B_d = B T_d,
and B_dᴴ brings its force to both. Only such waves are found: motions in which sectors differ, as
standing waves, are not looked for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fe_models.dynamics.periodic.harmonic_jacobian import HarmonicTransfer
from fe_models.dynamics.periodic.harmonics import ComplexArray, Resolution
from fe_models.dynamics.periodic.receptance import Receptance, SteadyMotion
from fe_models.dynamics.rings.sector import CyclicSector, stiffened
from sa_solver.types import Array


class WaveReceptance:
    """What harmonic forces do to a sector, each harmonic at its nodal diameters.

    With springs ``tangents`` ``(j, d, d)`` [N/mm] in the place of joints damping stays as it was;
    ``mixed`` is that of :class:`Receptance`.
    """

    def __init__(
        self, sector: CyclicSector, tangents: Array | None = None, *, mixed: bool = True
    ) -> None:
        self.sector, self._tangents, self._mixed = sector, tangents, mixed
        self._by_shift: dict[int, Receptance] = {}

    def of(self, harmonic: int) -> Receptance:
        """The sector at the nodal diameters of a harmonic."""
        shift = self.sector.ring.shift(harmonic)
        if shift not in self._by_shift:
            model = self.sector.at(shift)
            if self._tangents is not None:
                model = stiffened(model, self._tangents)
            self._by_shift[shift] = Receptance(model, mixed=self._mixed)
        return self._by_shift[shift]

    def stuck(self, tangents: Array) -> WaveReceptance:
        """With springs in the place of joints; damping between modes left out."""
        return WaveReceptance(self.sector, tangents, mixed=False)

    def transfer(self, resolution: Resolution, directions: int) -> WaveTransfer:
        """Between joints and modes at all harmonics of a resolution."""
        structures = tuple(self.of(harmonic) for harmonic in resolution.harmonics)
        return WaveTransfer(resolution, self.of(0), directions, structures)


class WaveMotion(SteadyMotion):
    """A sector at frequencies ``(k,)``, of one harmonic each, with the ``structures`` of these."""

    def __init__(self, rest: Receptance, structures: Sequence[Receptance], angular: Array) -> None:
        self.structure, self.angular, self._structures = rest, angular, structures
        self._moving = int(angular[0] == 0.0)
        # One at a time: every harmonic has a structure of its own.
        self._inverses = [
            structures[row].inverse_at(angular[row : row + 1])
            for row in range(self._moving, len(structures))
        ]

    def vibrate(self, force: ComplexArray) -> ComplexArray:
        response = np.zeros(force.shape, dtype=complex)
        for row, inverse in enumerate(self._inverses, start=self._moving):
            response[row] = inverse.times(force[row : row + 1])[0]
        return response

    def per_force(self, weights: ComplexArray) -> ComplexArray:
        rows = zip(self._inverses, weights, strict=True)
        return np.array([inverse.turned(row[None])[0] for inverse, row in rows])

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
            inverse.between(self._structures[row].at_joints, between[row : row + 1])
        return between


@dataclass(frozen=True)
class WaveTransfer(HarmonicTransfer):
    """Between joints and modes of a sector; ``structures`` ``(k,)`` are those of the harmonics.

    ``receptance`` is that of no nodal diameter, which is at rest.
    """

    structures: tuple[Receptance, ...]

    def steady(self, angular: Array) -> WaveMotion:
        return WaveMotion(self.receptance, self.structures, angular)

    def modal(self, force: Array) -> ComplexArray:
        forces = self.resolution.amplitudes(force)
        return self._each(forces, self._joints_to_modes)

    def at_joints(self, motion: ComplexArray) -> Array:
        moved = self._each(motion, [each.at_joints.T for each in self.structures])
        return self.resolution.coefficients(moved, self.directions).ravel()

    def load_on_modes(self, load: ComplexArray, row: int) -> ComplexArray:
        return np.asarray(load @ self.structures[row].at_points.conj())

    def displacement(self, motion: ComplexArray) -> ComplexArray:
        return self._each(motion, [each.at_points.T for each in self.structures])

    @cached_property
    def _joints_to_modes(self) -> list[ComplexArray]:
        return [each.at_joints.conj() for each in self.structures]

    def _each(self, amplitudes: ComplexArray, maps: Sequence[ComplexArray]) -> ComplexArray:
        """Amplitudes ``(k, ...)`` of harmonics, each by its own map."""
        return np.array([row @ by for row, by in zip(amplitudes, maps, strict=True)])
