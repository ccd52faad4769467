"""Check of the system before anything is installed: Python's venv and the mesher's libraries.

The gmsh wheel brings its library but not the X11 and OpenGL libraries that it is linked with, and
a bare Debian has no ``ensurepip``. This check finds everything that is missing at once, with the
Debian packages that contain it. It uses the standard library only, and is run by its path because
this package may need more:

    python3 -I workflow/shell/system_check.py            # installs what is missing, or says how
    python -I workflow/shell/system_check.py --imports   # later: can what was installed be used?
"""

from __future__ import annotations

import ctypes
import importlib
import importlib.util
import os
import shutil
import subprocess
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
# Upper bound for a system with none of the packages, measured on Debian 12.
MOST = "at most 70 MB to download, 230 MB on disk, a minute"
UPDATE = "apt-get update"
INSTALL = "apt-get install -y --no-install-recommends"
FAILED = 3


def missing_packages() -> list[str]:
    """Return the Debian packages of libraries that cannot be loaded; empty except on Linux."""
    if not sys.platform.startswith("linux"):
        return []
    return [package for name, package in DEBIAN_PACKAGES.items() if not _loads(name)]


def remedy(error: Exception) -> str | None:
    """Return advice on what to install if ``error`` is a library that could not be loaded."""
    if "cannot open shared object file" not in str(error):
        return None
    packages = missing_packages()
    return _advice(packages) if packages else f"a system library is missing: {_line(error)}"


def _advice(packages: list[str]) -> str:
    if shutil.which("apt-get") is None:
        return f"system packages are missing, by Debian's names: {' '.join(packages)}"
    sudo = "" if os.geteuid() == 0 else "sudo "
    commands = f"{sudo}{UPDATE} && {sudo}{INSTALL} {' '.join(packages)}"
    return f"system packages are missing; install with: {commands}"


def _line(error: Exception) -> str:
    return " ".join(str(error).split())


def _loads(name: str) -> bool:
    try:
        ctypes.CDLL(name)
    except OSError:
        return False
    return True


def _prepared() -> str | None:
    """Install missing packages if that needs no password; return what is still missing, or None."""
    packages = _wanted()
    if packages and _may_install():
        print(f"fretscale: installing {' '.join(packages)}: {MOST}", flush=True)
        _install(packages)
        importlib.invalidate_caches()
        packages = _wanted()
    return _advice(packages) if packages else None


def _wanted() -> list[str]:
    """Return the Debian packages of everything missing, including the virtual environment's."""
    version = "{}.{}".format(*sys.version_info)
    there = all(map(importlib.util.find_spec, ("ensurepip", "venv")))
    return missing_packages() + ([] if there else [f"python{version}-venv"])


def _may_install() -> bool:
    if shutil.which("apt-get") is None:
        return False
    if os.geteuid() == 0:
        return True
    if shutil.which("sudo") is None:
        return False
    asked = subprocess.run(["sudo", "-n", "true"], stderr=subprocess.DEVNULL, check=False)
    return asked.returncode == 0


def _install(packages: list[str]) -> None:
    root = ["env", "DEBIAN_FRONTEND=noninteractive"]
    if os.geteuid() != 0:
        root = ["sudo", "-n", *root]
    for command in (UPDATE.split(), [*INSTALL.split(), *packages]):
        subprocess.run([*root, *command, "-qq"], stdout=subprocess.DEVNULL, check=False)


def _imported() -> str | None:
    """Return why the mesher cannot be used, or None."""
    try:
        # By name: a static import would break the rule that only fe_models knows gmsh.
        importlib.import_module("gmsh")
    except (ImportError, OSError) as error:
        return remedy(error) or _line(error)
    return None


def main(arguments: list[str]) -> int:
    """Check what was installed with ``--imports``, or else what must exist before."""
    wrong = _imported() if "--imports" in arguments else _prepared()
    if wrong:
        print(f"fretscale: {wrong}", file=sys.stderr)
    return FAILED if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
