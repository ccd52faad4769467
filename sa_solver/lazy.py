"""Lazy imports: the public names of a package are imported on first access (PEP 562).

Importing a package of the library then costs next to nothing. The transforms, compilers, meshers
and finite elements behind its names are loaded only by programs that use them.
"""

from __future__ import annotations

import ast
import inspect
import sys
from collections.abc import Callable
from functools import cache
from importlib import import_module


def lazy_names(package: str) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """Return ``__getattr__`` and ``__dir__`` of a ``package`` whose names are imported lazily.

    The names are those that the package imports under ``if TYPE_CHECKING``, so that they are listed
    with their modules in one place, where type checkers read them too.
    """

    @cache
    def homes() -> dict[str, str]:
        statements = ast.parse(inspect.getsource(sys.modules[package])).body
        (for_checkers,) = (each for each in statements if isinstance(each, ast.If))
        return {
            alias.name: str(each.module)
            for each in for_checkers.body
            if isinstance(each, ast.ImportFrom)
            for alias in each.names
        }

    def find(name: str) -> object:
        # Python itself asks for special names, also while the source is looked up.
        if name.startswith("__") or name not in homes():
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(homes()[name]), name)

    def known() -> list[str]:
        return sorted({*vars(sys.modules[package]), *homes()})

    return find, known
