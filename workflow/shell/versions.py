"""Versions of what a result depends on."""

from __future__ import annotations

import platform
from importlib.metadata import version

PACKAGES = ("fretscale", "numpy", "scipy", "scikit-fem", "gmsh", "pyfftw", "h5py")


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that compute."""
    return {"python": platform.python_version()} | {name: version(name) for name in PACKAGES}
