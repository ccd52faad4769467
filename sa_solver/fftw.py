"""pyFFTW without its interfaces to numpy, scipy and dask, which load ten times as long as it."""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import Any

INTERFACES = "pyfftw.interfaces"


class _Later(ModuleType):
    """Stands for the interfaces until somebody asks for one of them."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(importlib.import_module(INTERFACES), name)


def load_pyfftw() -> Any:
    """The module ``pyfftw``, whose interfaces are loaded when they are first asked for."""
    if "pyfftw" in sys.modules:
        return sys.modules["pyfftw"]
    sys.modules[INTERFACES] = _Later(INTERFACES)
    try:
        return importlib.import_module("pyfftw")
    finally:
        del sys.modules[INTERFACES]
