"""Lazy imports: the public names of a package are imported on first access (PEP 562).

Importing a package of the library then costs next to nothing. The transforms, compilers, meshers
and finite elements behind its names are loaded only by programs that use them.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module


def lazy_names(
    package: str, modules: Mapping[str, Sequence[str]], within: str | None = None
) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """Return ``__getattr__`` and ``__dir__`` of a ``package`` whose names are imported lazily.

    ``modules`` lists the public names by the module that defines them. The modules are looked up in
    the package ``within``, or in ``package`` itself by default; "" if their names are complete.
    """
    home = package if within is None else within
    prefix = f"{home}." if home else ""
    homes = {name: f"{prefix}{module}" for module, names in modules.items() for name in names}

    def find(name: str) -> object:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(homes[name]), name)

    def known() -> list[str]:
        return sorted({*vars(sys.modules[package]), *homes})

    return find, known
