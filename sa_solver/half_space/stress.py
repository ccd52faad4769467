"""Equivalent and principal stresses from the six components xx, yy, zz, xy, yz, zx."""

from __future__ import annotations

import numpy as np

from sa_solver.types import Array


def von_mises(stress: Array) -> Array:
    """Return the von Mises stress ``(...)`` of components ``(6, ...)`` [MPa].

    Examples
    --------
    For uniaxial tension it is the tension, for pure shear √3 times the shear stress:

    >>> import numpy as np
    >>> from sa_solver import von_mises
    >>> stress = np.array([[100.0, 0.0], [0, 0], [0, 0], [0, 100.0], [0, 0], [0, 0]])
    >>> print(von_mises(stress).round(1))
    [100.  173.2]
    """
    xx, yy, zz, xy, yz, zx = stress
    squares = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
    return np.asarray(np.sqrt(0.5 * squares + 3.0 * (xy**2 + yz**2 + zx**2)))


def principal_stresses(stress: Array) -> Array:
    """Return the principal stresses ``(3, ...)``, the largest first, of components ``(6, ...)``.

    Examples
    --------
    In pure shear the largest and the smallest differ by twice the shear stress:

    >>> import numpy as np
    >>> from sa_solver import principal_stresses
    >>> print(principal_stresses(np.array([0.0, 0.0, 0.0, 100.0, 0.0, 0.0])))
    [ 100.    0. -100.]
    """
    xx, yy, zz, xy, yz, zx = np.asarray(stress, dtype=np.float64)
    tensors = np.moveaxis(np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]), (0, 1), (-2, -1))
    return np.moveaxis(np.linalg.eigvalsh(tensors)[..., ::-1], -1, 0)
