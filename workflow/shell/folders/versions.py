"""Versions of the software that results depend on."""

from __future__ import annotations

import platform
from functools import cache
from importlib.metadata import version

PACKAGES = ("fretscale", "numpy", "scipy", "scikit-fem", "gmsh", "pyfftw", "h5py")


@cache
def _packages() -> dict[str, str]:
    return {name: version(name) for name in PACKAGES}


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that compute."""
    return {"python": platform.python_version()} | _packages()
