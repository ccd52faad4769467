"""Cache of condensed structures and solved cycles on disk, found by the inputs they were made from.

A file that differs from what was written under its key is ignored, with a warning.
"""

from __future__ import annotations

import hashlib
import logging
import os
import re
from collections.abc import Callable, Sequence
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from platformdirs import user_cache_path

import fe_models
import sa_solver
from fe_models.joints.condensation import Condensed
from fe_models.joints.joint import JointResolvent, Resolvent
from fe_models.solvers.symmetry import Mirror, SplitMatrix
from fe_models.structure import FIELDS, CycleSolution, Structure
from sa_solver.types import Array
from workflow.messages.warning_kinds import WarningKind
from workflow.shell.folders.store import DamagedFile, read_arrays, write_arrays

LOG = logging.getLogger(__name__)

# Files are pruned, least recently used first, above this size; one default dovetail takes 67 MB for
# its joint and 133 MB for its bodies.
LARGEST_CACHE = 4 * 1024**3
# Names of files: the kind of content and the hash of the inputs it was made from.
NAME = re.compile(r"[a-z]+-[0-9a-f]{32}\.h5")
SOLVERS = ("numpy", "scipy", "scikit-fem", "gmsh")


def cache_folder() -> Path:
    """Return the folder ``FRETSCALE_CACHE``, or ``fretscale`` in the user's cache folder."""
    return Path(os.environ.get("FRETSCALE_CACHE", user_cache_path("fretscale", appauthor=False)))


def content_key(*parts: object) -> str:
    """Return a hash of the parts, of the structural code and of the packages it relies on."""
    return hashlib.sha256(repr(parts).encode() + _code()).hexdigest()[:32]


@cache
def _code() -> bytes:
    """Return a digest of the structural code and of the packages it relies on, computed once."""
    digest = hashlib.sha256()
    for package in (fe_models, sa_solver):
        assert package.__file__ is not None
        for source in sorted(Path(package.__file__).parent.rglob("*.py")):
            digest.update(source.read_bytes())
    digest.update(repr([(name, version(name)) for name in SOLVERS]).encode())
    return digest.digest()


class DiskStore:
    """Store of condensed bodies, joints and cycles in the cache folder.

    It is a :class:`workflow.models.structure_model.StructureStore`.
    """

    def body(self, made_from: Sequence[np.ndarray], make: Callable[[], Condensed]) -> Condensed:
        """Return the condensed body made from these arrays; ``make`` it if it is not stored."""
        name = f"body-{content_key(*(_digest(array) for array in made_from))}"
        if (stored := _load(name)) is not None:
            return stored[0]["stiffness"], stored[0]["loads"]
        stiffness, loads = make()
        _save(name, {"stiffness": stiffness, "loads": loads}, {})
        return stiffness, loads

    def joint(
        self, key: tuple[object, ...], make: Callable[[], Resolvent]
    ) -> tuple[Resolvent, bool]:
        """Return the joint of a key, and whether it was stored; only full matrices are."""
        name = f"joint-{content_key(*key)}"
        if (stored := _load(name)) is not None:
            return _restored_joint(*stored), True
        joint = make()
        if isinstance(joint, JointResolvent):
            _save_joint(name, joint)
        return joint, False

    def cycle(
        self,
        key: tuple[object, ...],
        structure: Structure,
        friction: float | Array,
        make: Callable[[], CycleSolution],
    ) -> CycleSolution:
        """Return the solved cycle of a key on its structure."""
        name = f"cycle-{content_key(*key)}"
        if (stored := _load(name)) is not None:
            return _restored_cycle(*stored, structure, friction)
        cycle = make()
        _save_cycle(name, cycle)
        return cycle

    def arrays(
        self, kind: str, key: tuple[object, ...], make: Callable[[], dict[str, Any]]
    ) -> tuple[dict[str, Any], bool]:
        """Return the named arrays of a kind and key, and whether they were stored."""
        name = f"{kind}-{content_key(kind, *key)}"
        if (stored := load_arrays(name)) is not None:
            return stored, True
        arrays = make()
        save_arrays(name, arrays)
        return arrays, False


def _restored_joint(arrays: dict[str, Any], attributes: dict[str, Any]) -> JointResolvent:
    inverse: Array | SplitMatrix
    if "inverse" in arrays:
        inverse = arrays["inverse"]
    else:
        mirror = Mirror(arrays["partner"], arrays["sign"])
        inverse = SplitMatrix(mirror, (arrays["kept"], arrays["turned"]))
    return JointResolvent(
        inverse=inverse,
        rho=float(attributes["rho"]),
        loads=arrays["loads"],
        rigid_modes=int(attributes["rigid_modes"]),
    )


def _save_joint(name: str, joint: JointResolvent) -> None:
    inverse = joint.inverse
    arrays: dict[str, Any] = {"loads": joint.loads}
    if isinstance(inverse, SplitMatrix):
        arrays |= {"partner": inverse.mirror.partner, "sign": inverse.mirror.sign}
        arrays["kept"], arrays["turned"] = inverse.blocks
    else:
        arrays["inverse"] = inverse
    _save(name, arrays, {"rho": joint.rho, "rigid_modes": joint.rigid_modes})


def _restored_cycle(
    arrays: dict[str, Any],
    attributes: dict[str, Any],
    structure: Structure,
    friction: float | Array,
) -> CycleSolution:
    fields = {name: arrays[name] for name in FIELDS}
    return CycleSolution(
        histories=structure.histories(**fields, friction=friction),
        states=tuple(arrays["states"]),
        last_displacement=fields["displacement"][-1],
        iterations=int(attributes["iterations"]),
        residual=float(attributes["residual"]),
        converged=True,
        closure=float(attributes["closure"]),
        cycles=int(attributes["cycles"]),
        equilibrium=arrays["equilibrium"],
    )


def _save_cycle(name: str, cycle: CycleSolution) -> None:
    arrays = {"states": np.stack(cycle.states), "equilibrium": cycle.equilibrium}
    names = ("iterations", "residual", "closure", "cycles")
    attributes = {name: getattr(cycle, name) for name in names}
    _save(name, cycle.fields() | arrays, attributes)


def _digest(array: np.ndarray) -> tuple[str, tuple[int, ...], str]:
    """Return the type, the shape and a hash of an array."""
    bits = hashlib.sha256(np.ascontiguousarray(array).data)
    return array.dtype.str, array.shape, bits.hexdigest()


def load_arrays(name: str) -> dict[str, Any] | None:
    """Return the named arrays stored under ``name``, or None if there are none."""
    kept = _load(name)
    return None if kept is None else kept[0]


def save_arrays(name: str, arrays: dict[str, Array]) -> None:
    """Store named arrays under ``name``."""
    _save(name, arrays, {})


def _load(name: str) -> tuple[dict[str, Any], dict[str, Any]] | None:
    path = cache_folder() / f"{name}.h5"
    try:
        os.utime(path)
        return read_arrays(path)
    except DamagedFile as error:
        LOG.warning(WarningKind.DAMAGED_CACHE.marked(f"cache: {error}; computed again"))
    except OSError:
        pass
    return None


def _save(name: str, arrays: dict[str, Array], attributes: dict[str, Any]) -> None:
    """Write a file, or do nothing if the cache folder cannot be written."""
    folder = cache_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_arrays(folder / f"{name}.h5", arrays, attributes)
        _prune(folder)
    except OSError:
        return


def cache_files(folder: Path) -> list[Path]:
    """Return the cache files in a folder; files of other programs are left out."""
    return [path for path in folder.glob("*.h5") if NAME.fullmatch(path.name)]


def _prune(folder: Path) -> None:
    files = sorted(cache_files(folder), key=lambda path: path.stat().st_mtime, reverse=True)
    total = 0
    for path in files:
        total += path.stat().st_size
        if total > LARGEST_CACHE:
            path.unlink()
