"""Compiled functions of joints, kept from one run to the next.

numba keeps a compiled function as long as the file that it is in stays as it is, also where one
that it calls has changed in another file: a later run would then compute what the old one did. So
they are kept in a folder for each version of all files of this package.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba

Function = TypeVar("Function", bound=Callable[..., Any])
# Its attributes are set when numba is loaded.
config: Any = numba.config

PACKAGE = Path(__file__).parent


def version_of(package: Path) -> str:
    """What tells versions of a package's files apart."""
    digest = hashlib.sha256()
    for file in sorted(package.glob("*.py")):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


KEPT = Path(config.CACHE_DIR or PACKAGE / "__pycache__") / f"numba-{version_of(PACKAGE)}"


def compiled(**options: Any) -> Callable[[Function], Function]:
    """``numba.njit`` with these options for a function of this package, kept in ``KEPT``."""

    def compile_function(function: Function) -> Function:
        elsewhere, config.CACHE_DIR = config.CACHE_DIR, str(KEPT)
        try:
            dispatcher: Function = numba.njit(cache=True, **options)(function)
            return dispatcher
        finally:
            config.CACHE_DIR = elsewhere

    return compile_function
