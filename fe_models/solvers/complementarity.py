"""Contact as a linear complementarity problem of forces and gaps.

Neither is negative, and one of them is zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
from numpy.typing import NDArray

from sa_solver.types import Array, Indices

Flags = NDArray[np.bool_]

# Forces and gaps below this share of the largest are rounding errors, whose sign means nothing.
ROUNDING = 1e-12
# Number of exchanges of all wrong nodes that may fail to reduce their number, before nodes are
# exchanged one at a time.
PATIENCE = 3
# Limit of the exchanges: a contact needs a few, or some per node if nodes are exchanged singly.
EXCHANGES_PER_NODE = 20


@dataclass(frozen=True)
class Complementary:
    """Solution of ``force >= 0``, ``gap = offset + A force - level >= 0`` and ``force · gap = 0``.

    ``force`` and ``gap`` are ``(n,)``.
    """

    force: Array
    gap: Array
    level: float
    converged: bool


def complementary(
    compliance: Array, offset: Array, total: float | None = None, guess: Flags | None = None
) -> Complementary:
    """Solve 0 <= f ⊥ offset + A f - level >= 0, with Σ f = ``total`` or else with level 0.

    The status iteration exchanges the status of all nodes whose force or gap is negative as long as
    their number falls, and after that of the last of them alone. It ends for any A if the level is
    given (block principal pivoting: Júdice & Pires 1994, Computers & Operations Research 21, 587).
    ``converged`` of the result is False if the number of exchanges reached its limit.

    Parameters
    ----------
    compliance
        A ``(n, n)``, symmetric positive definite.
    offset
        Gaps without force ``(n,)``.
    total
        Sum of the forces, for which the level is found. If None, the level is 0.
    guess
        Flags ``(n,)`` of the nodes that are likely to carry force.
    """
    active = np.ones(len(offset), dtype=np.bool_) if guess is None else guess.copy()
    fewest, patience = len(offset) + 1, PATIENCE
    wrong, iterations = np.arange(len(offset)), 0
    while len(wrong) and iterations < EXCHANGES_PER_NODE * len(offset):
        iterations += 1
        if total is not None and not active.any():
            active[np.argmin(offset)] = True
        force, gap, level = _at_status(compliance, offset, total, active)
        wrong = _wrong_nodes(force, gap, active, np.abs(offset).max() + abs(level))
        if len(wrong) < fewest:
            fewest, patience = len(wrong), PATIENCE
        elif patience > 0:
            patience -= 1
        else:
            wrong = wrong[-1:]
        active[wrong] = ~active[wrong]
    forces, gaps = np.maximum(force, 0.0), np.maximum(gap, 0.0)
    return Complementary(forces, gaps, level, len(wrong) == 0)


def _wrong_nodes(force: Array, gap: Array, active: Flags, size: float) -> Indices:
    """Return active nodes with negative force and others with negative gap, beyond rounding.

    ``size`` is the magnitude of the gaps.
    """
    pulls = force < -ROUNDING * np.abs(force).max(initial=0.0)
    return np.flatnonzero(np.where(active, pulls, gap < -ROUNDING * size))


def _at_status(
    compliance: Array, offset: Array, total: float | None, active: Flags
) -> tuple[Array, Array, float]:
    """Return forces that close the gaps of active nodes, the other gaps, and the level."""
    force, level = np.zeros(len(offset)), 0.0
    nodes = np.flatnonzero(active)
    if len(nodes):
        sides = np.stack([-offset[nodes], np.ones(len(nodes))], axis=1)
        closing, unit = sl.solve(compliance[np.ix_(nodes, nodes)], sides, assume_a="pos").T
        if total is not None:
            level = float((total - closing.sum()) / unit.sum())
        force[nodes] = closing + level * unit
    gap = offset + compliance[:, nodes] @ force[nodes] - level
    gap[nodes] = 0.0
    return force, gap, level
