"""pyFFTW: on the functions of FFTW, and without its interfaces."""

from __future__ import annotations

import importlib
import os
import sys
from threading import Lock
from types import ModuleType
from typing import Any

INTERFACES = "pyfftw.interfaces"

_LOADING = Lock()


class _Later(ModuleType):
    """Stands for the interfaces until somebody asks for one of them."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(importlib.import_module(INTERFACES), name)


def load_pyfftw() -> Any:
    """The module ``pyfftw``, bound to its own FFTW; its interfaces are loaded when asked for.

    MKL has functions of the same names. Where it is used first, as for finite elements or by a
    numpy that is built on it, the linker would give pyfftw those, and results would be rounded
    otherwise than where it is not, as with a structure that comes from the cache.

    The interfaces to numpy, scipy and dask load ten times as long as the rest.
    """
    with _LOADING:  # a module that another thread has begun to load has not all its names yet
        return sys.modules.get("pyfftw") or _loaded()


def _loaded() -> ModuleType:
    flags = sys.getdlopenflags()
    sys.modules[INTERFACES] = _Later(INTERFACES)
    sys.setdlopenflags(flags | getattr(os, "RTLD_DEEPBIND", 0))
    try:
        return importlib.import_module("pyfftw")
    finally:
        sys.setdlopenflags(flags)
        del sys.modules[INTERFACES]


def plan(before: Any, after: Any, axis: int, backward: bool = False) -> Any:
    """FFTW's plan of DFTs along an ``axis`` of ``before`` into ``after``, unnormalised.

    It is estimated, not measured: measuring picks another algorithm, and with it another rounding,
    from one run to the next. What is in ``before`` may be lost.
    """
    return load_pyfftw().FFTW(
        before,
        after,
        axes=(axis,),
        direction="FFTW_BACKWARD" if backward else "FFTW_FORWARD",
        flags=("FFTW_ESTIMATE", "FFTW_DESTROY_INPUT"),
    )
