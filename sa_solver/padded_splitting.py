"""Elastic step and local step of the splitting of a contact problem, on the zero-padded grid.

The elastic relation ``v = K t + offset - R c`` is met exactly there, because the padded K is
circulant and the law off the grid is t = 0. The rigid motions c are such that t has the given
resultants. The caller decides which components the tractions have and which law they obey on the
grid: pressure alone (:mod:`sa_solver.normal.splitting`) or pressure and shear
(:mod:`sa_solver.dissimilar.splitting`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sa_solver.half_space.operator import HalfSpaceResolvent
from sa_solver.types import Array

Sums = Callable[[Array], Array]
"""Function that returns the products ``(k,)`` of a traction ``(c, nx, ny)`` with k rigid modes."""


@dataclass(frozen=True)
class RigidResponse:
    """Response of a resolvent to unit rigid motions.

    ``tractions`` ``(k, c, mx, my)`` are the tractions in response to each of the k motions. Row i
    of ``products`` ``(k, k)`` holds the products of the response to motion i with all k modes.
    ``sums`` returns such products of any traction.
    """

    tractions: Array
    products: Array
    sums: Sums

    @classmethod
    def of(cls, resolvent: HalfSpaceResolvent, motions: Array, sums: Sums) -> RigidResponse:
        """Return the response to unit ``motions`` ``(k, c, nx, ny)``, by one solve for each."""
        shape = (motions.shape[1], *resolvent.padded_shape)
        tractions = np.array([resolvent.solve(resolvent.padded(motion)) for motion in motions])
        products = [sums(resolvent.on_grid(traction)) for traction in tractions]
        count = len(motions)
        return cls(tractions.reshape(count, *shape), np.reshape(products, (count, count)), sums)

    def only(self, places: list[int]) -> RigidResponse:
        """Return the response to the motions with the indices ``places``."""
        products = self.products[np.ix_(places, places)]
        return RigidResponse(self.tractions[places], products, lambda t: self.sums(t)[places])


class PaddedSplitting:
    """Steps ``elastic_step`` and ``local_law`` for :func:`sa_solver.splitting.douglas_rachford`."""

    def __init__(
        self,
        resolvent: HalfSpaceResolvent,
        response: RigidResponse,
        target: Array,
        offset: Array,
        law: Callable[[Array], Array],
    ) -> None:
        """Prepare the two steps.

        Parameters
        ----------
        resolvent
            Resolvent of the half-space on the padded grid.
        response
            Its response to the free rigid motions.
        target
            Imposed sums ``(k,)`` of the tractions [MPa].
        offset
            Relative displacement ``(c, nx, ny)`` without tractions [mm].
        law
            Function that maps a traction ``(c, nx, ny)`` on the grid to one that obeys the contact
            law.
        """
        self._resolvent, self._response = resolvent, response
        self._target, self._law = target, law
        self._offset = resolvent.padded(offset)
        self._gain = np.linalg.pinv(response.products.T)
        self.rigid = np.zeros(len(target))
        """Motions ``(k,)`` of the last elastic step."""

    def elastic_step(self, state: Array) -> Array:
        """Return ``(K + ρ)⁻¹ (ρ s - offset + R c)`` with the motions c that meet the resultants."""
        resolvent = self._resolvent
        traction = resolvent.solve(resolvent.shift * state - self._offset)
        missing = self._target - self._response.sums(resolvent.on_grid(traction))
        self.rigid = self._gain @ missing
        traction += np.tensordot(self.rigid, self._response.tractions, 1)
        return traction

    def local_law(self, trial: Array) -> Array:
        """Return ``trial`` with the contact law applied on the grid, and 0 off it."""
        return self._resolvent.padded(self._law(self._resolvent.on_grid(trial)))
