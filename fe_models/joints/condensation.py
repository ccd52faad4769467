"""Bodies condensed one by one, each of which may have been condensed before."""

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
# Takes all arrays that a condensation is made from, and what makes it: gives it made, or as it was
# kept when it was made from the same arrays.
Keep = Callable[[Sequence[np.ndarray], Callable[[], Condensed]], Condensed]


def made_anew(made_from: Sequence[np.ndarray], make: Callable[[], Condensed]) -> Condensed:
    """Make it: nothing is kept."""
    return make()


def condense_body(
    stiffness: sp.csr_matrix, loads: Array, kept: Indices, keep: Keep = made_anew
) -> Condensed:
    """Condense a body onto ``kept`` ``(c,)``: stiffness ``(c, c)`` and loads ``(c, cases)``.

    As :func:`fe_models.solvers.linear_solver.condense`, which says what it raises. Load cases in
    which nothing acts on the body take no part in it: what was kept of a body serves other
    structures, whatever acts on their other bodies.
    """
    acting = loads.any(axis=0)
    own = np.ascontiguousarray(loads[:, acting])
    # PARDISO's last bits depend on the threads that share the work.
    made_from = stiffness.data, stiffness.indices, stiffness.indptr, own, kept, np.array(threads())
    static, some = keep(made_from, partial(condense, stiffness, own, kept))
    every = np.zeros((len(kept), loads.shape[1]))
    every[:, acting] = some
    return static, every


def renamed(condensed: Condensed, names: sp.csr_matrix) -> Condensed:
    """A condensed body in other coordinates: each row of ``names`` has one entry, 1 or -1."""
    static, loads = condensed
    old, sign = names.indices, np.round(names.data)
    static, loads = static[np.ix_(old, old)], sign[:, None] * loads[old]
    static *= sign
    static *= sign[:, None]
    return static, loads
