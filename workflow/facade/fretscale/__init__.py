"""Fretting wear across scales, from Python.

What is done with a case
    - ``run``: compute it, or find its results again.
    - ``load_case``: read and check it.
    - ``check``: what it would run, in what memory and time.
    - ``Check``: that, as numbers.

What comes out
    - ``open``: the results in the folder of a finished run.
    - ``Results``: its summary, warnings and case, and all that it has computed.
    - ``MainResult``: one of its main results, with unit and estimated error.
    - ``Group``: datasets and groups of ``results.h5`` under one name.
    - ``Values``: a dataset, read when it is needed, with its unit and description.

What several runs have in common
    - ``compare``: put finished runs side by side.
    - ``Comparison``: what differs in their cases and results, as text, table and page.
    - ``ComparedResult``: a main result in each of them, and how far they are apart.

What was measured
    - ``fit``: find parameters of a case from measurements.
    - ``FitResult``: these with their bounds, and the section of a case.
    - ``FittedParameter``: one of them.

What is raised
    - ``FretscaleError``: the base of all; each says in a line what is wrong and what to do.
    - ``CaseError``: a case that cannot be run.
    - ``UserError``: a bad argument, file or folder; a ``CaseError`` is one.
    - ``MethodFailed``: a numerical method did not converge.
    - ``OutOfMemory``: the case needs more memory than there is.
    - ``NotWritten``: the disk is full.

A case is a file, a dictionary of the same entries, or what ``load_case`` gives:

>>> import fretscale
>>> case = fretscale.load_case("cases/sphere_normal.yaml", contact__grid=[64, 64])
>>> case.title
'Sphere pressed on a flat (Hertz)'
>>> try:
...     fretscale.load_case(case, friction__coefficient=-1)
... except fretscale.CaseError as error:
...     print(error)
--set friction.coefficient=-1: -1: out of range; allowed: at least 0 and at most 2, as a bare number or in %
"""

# Not from __future__ import annotations: nothing may be imported before the check, nor is needed.

import sys
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as _version
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

# Our packages lie beside this one under names of their own, and not within it: type checkers,
# editors and import-linter read folders, and would not find what is mapped from elsewhere. So a
# file of somebody else's may have such a name. These are files that only ours have.
_OURS = {
    "sa_solver": "influence.py",
    "wear": "coupled.py",
    "fe_models": "mortar.py",
    "workflow": "kinds.py",
}


def _check_packages() -> None:
    """Raise ImportError where the packages that Python would import are not ours."""
    for name, of_ours in _OURS.items():
        try:
            spec = find_spec(name)
        except ValueError:  # a module that somebody has made up
            spec = None
        places = list(spec.submodule_search_locations or ()) if spec else []
        if any(Path(place, of_ours).is_file() for place in places):
            continue
        found = getattr(sys.modules.get(name), "__file__", None)
        file = (spec.origin if spec else None) or found or next(iter(places), None)
        if name in sys.modules and file is None:
            file = f"a module `{name}` without a file"
        if file is None:
            raise ImportError(
                f"fretscale: its package `{name}` is not installed; install fretscale again"
            )
        raise ImportError(
            f"fretscale: {file} is in the way: it has the name of fretscale's own package "
            f"`{name}`; rename it, or start Python elsewhere"
        )


_check_packages()

from sa_solver.lazy import lazy_names  # noqa: E402

if TYPE_CHECKING:
    from sa_solver.errors import FretscaleError
    from workflow.errors import CaseError, MethodFailed, NotWritten, OutOfMemory, UserError
    from workflow.interface.cases import Check, check, load_case
    from workflow.interface.comparing import ComparedResult, Comparison, compare
    from workflow.interface.datasets import Group, Values
    from workflow.interface.fitting import FitResult, FittedParameter, fit
    from workflow.interface.results import MainResult, Results, open  # noqa: A004
    from workflow.interface.running import run

__all__ = [
    "CaseError",
    "Check",
    "ComparedResult",
    "Comparison",
    "FitResult",
    "FittedParameter",
    "FretscaleError",
    "Group",
    "MainResult",
    "MethodFailed",
    "NotWritten",
    "OutOfMemory",
    "Results",
    "UserError",
    "Values",
    "check",
    "compare",
    "fit",
    "load_case",
    "open",
    "run",
]

try:
    __version__ = _version("fretscale")
except PackageNotFoundError:  # a checkout that is not installed
    __version__ = "unknown"

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "errors": (
            "CaseError",
            "FretscaleError",
            "MethodFailed",
            "NotWritten",
            "OutOfMemory",
            "UserError",
        ),
        "interface.cases": ("Check", "check", "load_case"),
        "interface.comparing": ("ComparedResult", "Comparison", "compare"),
        "interface.datasets": ("Group", "Values"),
        "interface.fitting": ("FitResult", "FittedParameter", "fit"),
        "interface.results": ("MainResult", "Results", "open"),
        "interface.running": ("run",),
    },
    within="workflow",
)
