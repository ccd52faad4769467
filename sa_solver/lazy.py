"""Names that a package offers, imported when they are first asked for (PEP 562).

So that importing a package of the library costs next to nothing, and the transforms, compilers,
meshers and finite elements behind its names are loaded by those who use them.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module


def lazy_names(
    package: str, modules: Mapping[str, Sequence[str]], within: str | None = None
) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """Return ``__getattr__`` and ``__dir__`` of a ``package`` that offers names of its ``modules``.

    The modules lie ``within`` the package itself, or another one; "" if their names are complete.
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
