"""Fretting wear across scales, from Python.

What is done with a case
    - ``run``: compute it, or find its results again.
    - ``load_case``: read and check it.
    - ``check``: what it would run, in what memory and time.
    - ``Check``: that, as numbers.

What is modelled in Python
    - ``WearModel``: a structure, its contacts and how they wear; ``run`` computes the wear.
    - ``wear_model``: the model that a case describes.
    - ``DovetailJoint``, ``DovetailMesh``, ``Dovetail``, ``Mission``: the built-in blade root in its
      disk: the joint, its mesh, its section and its loads.
    - ``MeshAssembly``, ``LegPath``, ``TightenedBolt``: bodies of a mesh or CAD file under loads.
    - ``UncoupledSource``, ``LoadSource``: the bases of loads of one's own, for ``ContactFace`` s.
    - ``Contact``, ``CoulombFriction``: what a contact is made of, and how it is computed.
    - ``Wear``, ``JumpSize``, ``Stop``: how far contacts wear, and in which steps.
    - ``AddedGap``: a profile on top of the form of a face.
    - ``Observer``, ``Progress``, ``Checkpoint``: what is called while a model runs.

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
    "sa_solver": "rigid_modes.py",
    "wear": "coupled.py",
    "fe_models": "supported_body.py",
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
    from fe_models.dovetail import Mission
    from fe_models.geometry.dovetail import Dovetail
    from sa_solver.errors import FretscaleError
    from wear.coupled import JumpSize, Observer, Stop
    from wear.evolution import CoulombFriction
    from workflow.errors import CaseError, MethodFailed, NotWritten, OutOfMemory, UserError
    from workflow.interface.cases import Check, check, load_case
    from workflow.interface.comparing import ComparedResult, Comparison, compare
    from workflow.interface.datasets import Group, Values
    from workflow.interface.fitting import FitResult, FittedParameter, fit
    from workflow.interface.modelling import wear_model
    from workflow.interface.observers import Checkpoint, Progress
    from workflow.interface.results import MainResult, Results, open  # noqa: A004
    from workflow.interface.running import run
    from workflow.models.assembly import LegPath, MeshAssembly, TightenedBolt
    from workflow.models.contact import Contact, Wear
    from workflow.models.dovetail import DovetailJoint, DovetailMesh
    from workflow.models.gaps import AddedGap
    from workflow.models.loads import ContactFace, LoadSource, UncoupledSource
    from workflow.models.wear import WearModel

__all__ = [
    "AddedGap",
    "CaseError",
    "Check",
    "Checkpoint",
    "ComparedResult",
    "Comparison",
    "Contact",
    "ContactFace",
    "CoulombFriction",
    "Dovetail",
    "DovetailJoint",
    "DovetailMesh",
    "FitResult",
    "FittedParameter",
    "FretscaleError",
    "Group",
    "JumpSize",
    "LegPath",
    "LoadSource",
    "MainResult",
    "MeshAssembly",
    "MethodFailed",
    "Mission",
    "NotWritten",
    "Observer",
    "OutOfMemory",
    "Progress",
    "Results",
    "Stop",
    "TightenedBolt",
    "UncoupledSource",
    "UserError",
    "Values",
    "Wear",
    "WearModel",
    "check",
    "compare",
    "fit",
    "load_case",
    "open",
    "run",
    "wear_model",
]

try:
    __version__ = _version("fretscale")
except PackageNotFoundError:  # a checkout that is not installed
    __version__ = "unknown"

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "fe_models.dovetail": ("Mission",),
        "fe_models.geometry.dovetail": ("Dovetail",),
        "wear.coupled": ("JumpSize", "Observer", "Stop"),
        "wear.evolution": ("CoulombFriction",),
        "workflow.errors": (
            "CaseError",
            "FretscaleError",
            "MethodFailed",
            "NotWritten",
            "OutOfMemory",
            "UserError",
        ),
        "workflow.interface.cases": ("Check", "check", "load_case"),
        "workflow.interface.comparing": ("ComparedResult", "Comparison", "compare"),
        "workflow.interface.datasets": ("Group", "Values"),
        "workflow.interface.fitting": ("FitResult", "FittedParameter", "fit"),
        "workflow.interface.results": ("MainResult", "Results", "open"),
        "workflow.interface.running": ("run",),
        "workflow.interface.modelling": ("wear_model",),
        "workflow.interface.observers": ("Checkpoint", "Progress"),
        "workflow.models.assembly": ("LegPath", "MeshAssembly", "TightenedBolt"),
        "workflow.models.contact": ("Contact", "Wear"),
        "workflow.models.dovetail": ("DovetailJoint", "DovetailMesh"),
        "workflow.models.gaps": ("AddedGap",),
        "workflow.models.loads": ("ContactFace", "LoadSource", "UncoupledSource"),
        "workflow.models.wear": ("WearModel",),
    },
    within="",
)
