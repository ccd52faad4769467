"""Compiled functions of joints, cached between runs.

numba caches a compiled function as long as the file that contains it is unchanged, even if a
function that it calls has changed in another file: a later run would then use the old code. The
cache therefore has a folder for each version of all files of this package.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any, TypeVar

import numba

Function = TypeVar("Function", bound=Callable[..., Any])
# The attributes of numba's configuration are set at run time, which type checkers cannot see.
config: Any = numba.config

PACKAGE = Path(__file__).parent


def version_of(package: Path) -> str:
    """Return a digest of all files of a package."""
    digest = hashlib.sha256()
    for file in sorted(package.rglob("*.py")):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


CACHE_FOLDER = Path(config.CACHE_DIR or PACKAGE / "__pycache__") / f"numba-{version_of(PACKAGE)}"


def compiled(**options: Any) -> Callable[[Function], Function]:
    """Return a decorator that applies ``numba.njit`` with these options and caches the result."""

    def compile_function(function: Function) -> Function:
        previous, config.CACHE_DIR = config.CACHE_DIR, str(CACHE_FOLDER)
        try:
            dispatcher: Function = numba.njit(cache=True, **options)(function)
            return dispatcher
        finally:
            config.CACHE_DIR = previous

    return compile_function


def call_in_turn(function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a compiled function, for the first time in this process under a lock.

    Processes that need the function at the same time wait for the first of them and then load what
    it has compiled, which takes up to 20 s. Without a lock, as in a folder that cannot be written
    or without the package ``filelock``, each of them compiles.
    """
    if getattr(function, "signatures", True):
        return function(*arguments)
    with ExitStack() as held:
        with suppress(OSError, NotImplementedError, ImportError):
            from filelock import FileLock

            CACHE_FOLDER.mkdir(parents=True, exist_ok=True)
            held.enter_context(FileLock(CACHE_FOLDER / "compiling.lock"))
        return function(*arguments)
