"""Pytest plugin that perturbs contact and body matrices and direct solutions by 1e-13.

This is about the effect of another processor's rounding, with one draw for each SEED. A test that
fails with it, or a method that takes a thousand iterations, relies on luck.

    SEED=3 python -m pytest -p tests.perturbed tests/sa_solver

The same input is perturbed equally each time, and symmetric matrices stay symmetric.
"""

import os
from functools import cached_property, wraps

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from fe_models.elasticity.body import ElasticBody
from fe_models.solvers.linear_solver import _Checked
from sa_solver.half_space.symbols import Coefficients

SIZE = 1e-13
SEED = int(os.environ.get("SEED", "1"))
# Constants of splitmix64 (Steele, Lea & Flood 2014, doi:10.1145/2660193.2660195).
GAMMA, FIRST, SECOND = 0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB


def noise(values, places):
    """Return numbers in [-1, 1) from the digits of each value and its place, but not its sign."""
    bits = np.abs(np.ascontiguousarray(values, dtype=np.float64)).view(np.uint64)
    bits = bits + (places.astype(np.uint64) + np.uint64(SEED)) * np.uint64(GAMMA)
    for shift, factor in ((30, FIRST), (27, SECOND)):
        bits = (bits ^ (bits >> np.uint64(shift))) * np.uint64(factor)
    return ((bits ^ (bits >> np.uint64(31))) >> np.uint64(11)) / 2.0**52 - 1.0


def off(values):
    """Perturb an array of real numbers, or a tuple with such arrays, by SIZE of each number."""
    if isinstance(values, tuple):
        parts = map(off, values)
        return type(values)(*parts) if hasattr(values, "_fields") else tuple(parts)
    if not isinstance(values, np.ndarray) or values.dtype != np.float64:
        return values
    return values * (1.0 + SIZE * noise(values, np.arange(values.size).reshape(values.shape)))


def off_symmetric(matrix):
    """Perturb a symmetric sparse matrix by SIZE of each entry, and keep it symmetric."""
    entries = matrix.tocoo()
    rows, columns = entries.row.astype(np.int64), entries.col.astype(np.int64)
    places = np.minimum(rows, columns) * matrix.shape[0] + np.maximum(rows, columns)
    values = entries.data * (1.0 + SIZE * noise(np.zeros(len(places)), places))
    return sp.csr_matrix((values, (rows, columns)), shape=matrix.shape)


def perturb(owner, name):
    """Perturb the results of a function or method."""
    exact = getattr(owner, name)
    setattr(owner, name, wraps(exact)(lambda *given, **options: off(exact(*given, **options))))


def perturb_property(owner, name):
    """Perturb a cached sparse matrix."""
    exact = owner.__dict__[name].func
    changed = cached_property(lambda self: off_symmetric(exact(self)))
    changed.__set_name__(owner, name)
    setattr(owner, name, changed)


def pytest_configure():
    perturb(Coefficients, "quarter")
    perturb_property(ElasticBody, "stiffness")
    perturb_property(ElasticBody, "mass")
    perturb(_Checked, "__call__")
    for name in ("solve", "inv", "eigh", "eigvalsh", "lstsq"):
        perturb(np.linalg, name)
    for name in ("solve", "inv", "eigh", "eigvalsh", "cho_solve", "lu_solve"):
        perturb(scipy.linalg, name)
