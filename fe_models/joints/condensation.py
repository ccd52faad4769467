"""Condensation of single bodies, with a store for bodies that were condensed before."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import scipy.sparse as sp

from fe_models.solvers.linear_solver import condense
from fe_models.solvers.pardiso import threads
from sa_solver.types import Array, Indices

# Stiffness and loads of a condensed body.
Condensed = tuple[Array, Array]
# Store of condensed bodies: called with all arrays that a condensation is computed from and the
# function that computes it, it returns the stored result for these arrays or computes it.
Keep = Callable[[Sequence[np.ndarray], Callable[[], Condensed]], Condensed]


def made_anew(made_from: Sequence[np.ndarray], make: Callable[[], Condensed]) -> Condensed:
    """Compute the condensation with ``make``, since nothing is stored."""
    return make()


def condense_body(
    stiffness: sp.csr_matrix, loads: Array, kept: Indices, keep: Keep = made_anew
) -> Condensed:
    """Condense a body onto ``kept`` ``(c,)``: stiffness ``(c, c)`` and loads ``(c, cases)``.

    Raises what :func:`fe_models.solvers.linear_solver.condense` raises. Load cases that do not act
    on the body are left out of the computation, so a stored body also serves in structures with
    other loads on their other bodies.
    """
    acting = loads.any(axis=0)
    own_loads = np.ascontiguousarray(loads[:, acting])
    # The last bits of PARDISO's results depend on the number of threads.
    made_from = (
        stiffness.data,
        stiffness.indices,
        stiffness.indptr,
        own_loads,
        kept,
        np.array(threads()),
    )
    static, condensed_loads = keep(made_from, partial(condense, stiffness, own_loads, kept))
    all_loads = np.zeros((len(kept), loads.shape[1]))
    all_loads[:, acting] = condensed_loads
    return static, all_loads


def renamed(condensed: Condensed, names: sp.csr_matrix) -> Condensed:
    """Return a condensed body in other coordinates.

    Each row of ``names`` has one entry, 1 or -1.
    """
    static, loads = condensed
    old, sign = names.indices, np.round(names.data)
    static, loads = static[np.ix_(old, old)], sign[:, None] * loads[old]
    static *= sign
    static *= sign[:, None]
    return static, loads
