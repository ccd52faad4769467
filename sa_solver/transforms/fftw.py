"""Import of pyFFTW, bound to its own FFTW library and without its interface modules."""

from __future__ import annotations

import importlib
import os
import sys
from threading import Lock
from types import ModuleType
from typing import Any

INTERFACES = "pyfftw.interfaces"

_LOADING = Lock()


class _LazyInterfaces(ModuleType):
    """Placeholder for the interface modules, which imports them on first access."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(importlib.import_module(INTERFACES), name)


def load_pyfftw() -> Any:
    """Return the module ``pyfftw``, bound to its own FFTW library.

    MKL has functions of the same names. If MKL is loaded first, by finite elements or by a numpy
    that is built on it, the linker would bind pyfftw to the functions of MKL. The rounding of
    results would then depend on whether MKL had been loaded before.

    The interfaces to numpy, scipy and dask take ten times as long to load as the rest. They are
    imported on first access.
    """
    with _LOADING:  # While another thread imports the module, some of its names are missing.
        return sys.modules.get("pyfftw") or _imported()


def _imported() -> ModuleType:
    flags = sys.getdlopenflags()
    sys.modules[INTERFACES] = _LazyInterfaces(INTERFACES)
    sys.setdlopenflags(flags | getattr(os, "RTLD_DEEPBIND", 0))
    try:
        return importlib.import_module("pyfftw")
    finally:
        sys.setdlopenflags(flags)
        del sys.modules[INTERFACES]


def plan(before: Any, after: Any, axis: int, backward: bool = False) -> Any:
    """Return FFTW's plan of unnormalised DFTs of ``before`` into ``after`` along an ``axis``.

    The plan is estimated, not measured: measuring would choose different algorithms, and thus a
    different rounding, from one run to the next. Execution may overwrite ``before``.
    """
    return load_pyfftw().FFTW(
        before,
        after,
        axes=(axis,),
        direction="FFTW_BACKWARD" if backward else "FFTW_FORWARD",
        flags=("FFTW_ESTIMATE", "FFTW_DESTROY_INPUT"),
    )
