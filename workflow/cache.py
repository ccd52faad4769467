"""Condensed structures on disk, found again by the content they were made from."""

from __future__ import annotations

import hashlib
import os
from importlib.metadata import version
from pathlib import Path

import fe_models
from fe_models.reduction import JointResolvent
from workflow.store import read_arrays, write_arrays

# Files are pruned, least recently used first, above this size; one default dovetail takes 134 MB.
LARGEST_CACHE = 4 * 1024**3
SOLVERS = ("numpy", "scipy", "scikit-fem", "gmsh")


def cache_folder() -> Path:
    """``FRETSCALE_CACHE``, or ``fretscale`` in the user's cache folder."""
    default = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "fretscale"
    return Path(os.environ.get("FRETSCALE_CACHE", default))


def content_key(*parts: object) -> str:
    """Hash of the parts, of the structural code and of the packages it relies on."""
    digest = hashlib.sha256(repr(parts).encode())
    for source in sorted(Path(fe_models.__file__).parent.rglob("*.py")):
        digest.update(source.read_bytes())
    digest.update(repr([(name, version(name)) for name in SOLVERS]).encode())
    return digest.hexdigest()[:32]


def load_joint(key: str) -> JointResolvent | None:
    """The condensed joint of that key, or None."""
    path = cache_folder() / f"joint-{key}.h5"
    try:
        arrays, attributes = read_arrays(path)
    except OSError:
        return None
    os.utime(path)
    return JointResolvent(
        inverse=arrays["inverse"],
        rho=float(attributes["rho"]),
        loads=arrays["loads"],
        rigid_modes=int(attributes["rigid_modes"]),
    )


def save_joint(key: str, joint: JointResolvent) -> None:
    """Keep a condensed joint; a cache that cannot be written is no error."""
    folder = cache_folder()
    attributes = {"rho": joint.rho, "rigid_modes": joint.rigid_modes}
    arrays = {"inverse": joint.inverse, "loads": joint.loads}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_arrays(folder / f"joint-{key}.h5", arrays, attributes)
        _prune(folder)
    except OSError:
        return


def _prune(folder: Path) -> None:
    files = sorted(folder.glob("joint-*.h5"), key=lambda path: path.stat().st_mtime, reverse=True)
    total = 0
    for path in files:
        total += path.stat().st_size
        if total > LARGEST_CACHE:
            path.unlink()
