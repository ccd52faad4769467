"""The two steps of a contact's splitting, on tractions of the zero-padded grid.

The elastic relation ``v = K t + offset - R c`` is met exactly there, since the padded K is
circulant and the law off the grid is t = 0. The rigid motions c are such that t has the given
resultants. The caller says which components the tractions have and which law they obey on the grid:
pressure alone (:mod:`sa_solver.normal.splitting`) or pressure and shear
(:mod:`sa_solver.dissimilar.contact`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sa_solver.half_space.operator import HalfSpaceResolvent
from sa_solver.types import Array

Sums = Callable[[Array], Array]
"""Products ``(k,)`` with k rigid modes of a traction ``(c, nx, ny)``."""


@dataclass(frozen=True)
class RigidResponse:
    """Tractions ``(k, c, mx, my)`` in answer to unit motions, and their products ``(k, k)``.

    Row i of ``products`` are those of the traction in answer to motion i with all k modes, which
    ``sums`` gives of any traction.
    """

    tractions: Array
    products: Array
    sums: Sums

    @classmethod
    def of(cls, resolvent: HalfSpaceResolvent, motions: Array, sums: Sums) -> RigidResponse:
        """That to the ``motions`` ``(k, c, nx, ny)`` of unit size; one solve for each."""
        shape = (motions.shape[1], *resolvent.padded_shape)
        tractions = np.array([resolvent.solve(resolvent.padded(motion)) for motion in motions])
        products = [sums(resolvent.on_grid(traction)) for traction in tractions]
        count = len(motions)
        return cls(tractions.reshape(count, *shape), np.reshape(products, (count, count)), sums)

    def only(self, places: list[int]) -> RigidResponse:
        """That to some of the motions."""
        products = self.products[np.ix_(places, places)]
        return RigidResponse(self.tractions[places], products, lambda t: self.sums(t)[places])


class PaddedSplitting:
    """``elastic_step`` and ``local_law`` of :func:`sa_solver.splitting.douglas_rachford`."""

    def __init__(
        self,
        resolvent: HalfSpaceResolvent,
        response: RigidResponse,
        target: Array,
        offset: Array,
        law: Callable[[Array], Array],
    ) -> None:
        """``offset`` ``(c, nx, ny)`` [mm], ``target`` ``(k,)`` [MPa] the imposed sums.

        ``law`` takes a traction ``(c, nx, ny)`` on the grid to one that obeys the contact law.
        """
        self._resolvent, self._response = resolvent, response
        self._target, self._law = target, law
        self._offset = resolvent.padded(offset)
        self._gain = np.linalg.pinv(response.products.T)
        self.rigid = np.zeros(len(target))
        """Motions ``(k,)`` of the last elastic step."""

    def elastic_step(self, state: Array) -> Array:
        """``(K + ρ)⁻¹ (ρ s - offset + R c)`` with the motions c that meet the resultants."""
        resolvent = self._resolvent
        traction = resolvent.solve(resolvent.shift * state - self._offset)
        missing = self._target - self._response.sums(resolvent.on_grid(traction))
        self.rigid = self._gain @ missing
        traction += np.tensordot(self.rigid, self._response.tractions, 1)
        return traction

    def local_law(self, trial: Array) -> Array:
        """The contact law on the grid, and 0 off it."""
        return self._resolvent.padded(self._law(self._resolvent.on_grid(trial)))
