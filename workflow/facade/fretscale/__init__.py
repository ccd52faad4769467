"""Fretting wear across scales, from Python.

Cases
    - ``run``: compute a case, or return its results if they exist already.
    - ``load_case``: read and check a case.
    - ``check``: return what a case would run, with its memory and run time.
    - ``Check``: the result of ``check``.

Models in Python
    - ``WearModel``: a structure, its contacts and how they wear; ``run`` computes the wear.
    - ``wear_model``: the model that a case describes.
    - ``error_budget``: the estimated errors of the main results of a wear model.
    - ``DovetailJoint``, ``DovetailMesh``, ``Dovetail``, ``Mission``: the built-in blade root in its
      disk: the joint, its mesh, its section and its loads.
    - ``MeshAssembly``, ``LegPath``, ``TightenedBolt``: bodies of a mesh or CAD file under loads.
    - ``BodyPair``, ``LoadTable``: a ball, cylinder or any gap under a cycle of forces and motions.
    - ``GivenLoads``: contact faces with the resultants that another code has found.
    - ``UncoupledSource``, ``LoadSource``: base classes for user-defined loads of ``ContactFace`` s.
    - ``SpecimenPair``, ``FrettedSpecimens``: crossed specimens of a friction rig, and their wear.
    - ``Contact``, ``CoulombFriction``: properties of a contact, and how it is computed.
    - ``Wear``, ``JumpSize``, ``Stop``: how far contacts wear, and in which steps.
    - ``Stress``: the stress of bodies and under contacts, and fretting life.
    - ``AddedGap``: a profile on top of the form of a face.
    - ``VibrationModel``: a rig with joints under periodic forces; ``run`` computes its motions.
    - ``vibration_model``: the model that a vibration case describes.
    - ``MotionModel``: a rig with joints in time; ``run`` integrates its motion under a force.
    - ``WearingJoint``: a friction joint alone whose parameters change with dissipated energy.
    - ``RigModel``, ``FrequencySweep``: the rig, and the frequencies of its motions.
    - ``Observer``, ``Progress``, ``Checkpoint``: objects that are called while a model runs.

Results
    - ``open``: the results in the folder of a finished run.
    - ``Results``: the summary, warnings and case of a run, and everything that it computed.
    - ``MainResult``: a main result of a run, with unit and estimated error.
    - ``Group``: datasets and groups of ``results.h5`` under one name.

Comparison of runs
    - ``compare``: compare finished runs.
    - ``Comparison``: differences of their cases and results, as text, table and page.
    - ``ComparedResult``: a main result in each run, with the differences.

Measurements
    - ``fit``: fit parameters of a case to measurements.
    - ``FitResult``: the fitted parameters with their bounds, and the section of a case.
    - ``FittedParameter``: a fitted parameter.

Exceptions
    - ``FretscaleError``: the base class; each message says what is wrong and what to do.
    - ``CaseError``: a case that cannot be run.
    - ``UserError``: a bad argument, file or folder; ``CaseError`` is derived from it.
    - ``MethodFailed``: a numerical method did not converge.
    - ``OutOfMemory``: the case needs more memory than there is.
    - ``ModelWarning``: a warning about results of a model that may be wrong.
    - ``NotWritten``: output could not be written, for example because the disk is full.

A case is a file, a dictionary of the same entries, or the result of ``load_case``:

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

# No `from __future__ import annotations` here: nothing is imported before the check, and it is not
# needed.

import sys
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as _version
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

# The packages of fretscale are installed next to this one, not within it: type checkers, editors
# and import-linter read folders, and would not find modules that are mapped from elsewhere. A file
# of the user may therefore shadow one of them. Each package is recognized by a file that
# only it has.
_OURS = {
    "sa_solver": "rigid_modes.py",
    "wear": "coupled.py",
    "fe_models": "supported_body.py",
    "workflow": "kinds.py",
}


def _check_packages() -> None:
    """Raise ImportError where Python would import other packages of the same names."""
    for name, of_ours in _OURS.items():
        try:
            spec = find_spec(name)
        except ValueError:  # a module that was created without a spec
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
    from wear.coupled_state import Observer
    from wear.evolution import CoulombFriction
    from wear.schedule import JumpSize, Stop
    from workflow.errors import (
        CaseError,
        MethodFailed,
        ModelWarning,
        NotWritten,
        OutOfMemory,
        UserError,
    )
    from workflow.interface.cases import Check, check, load_case
    from workflow.interface.comparing import ComparedResult, Comparison, compare
    from workflow.interface.datasets import Group
    from workflow.interface.fitting import FitResult, FittedParameter, fit
    from workflow.interface.modelling import vibration_model, wear_model
    from workflow.interface.observers import Checkpoint, Progress
    from workflow.interface.results import MainResult, Results, open  # noqa: A004
    from workflow.interface.running import run
    from workflow.models.assembly import LegPath, MeshAssembly, TightenedBolt
    from workflow.models.budget.budget import error_budget
    from workflow.models.contact import Contact, Wear
    from workflow.models.dovetail import DovetailJoint, DovetailMesh
    from workflow.models.gaps import AddedGap
    from workflow.models.loads import ContactFace, LoadSource, UncoupledSource
    from workflow.models.rig.joint import WearingJoint
    from workflow.models.rig.motion import MotionModel
    from workflow.models.rig.rig_model import RigModel
    from workflow.models.specimens.fretted import FrettedSpecimens
    from workflow.models.specimens.reduced import SpecimenPair
    from workflow.models.stress.settings import Stress
    from workflow.models.uncoupled.body_pair import BodyPair
    from workflow.models.uncoupled.given_loads import GivenLoads
    from workflow.models.uncoupled.load_table import LoadTable
    from workflow.models.vibration.model import VibrationModel
    from workflow.models.vibration.sweep import FrequencySweep
    from workflow.models.wear import WearModel

__all__ = [
    "AddedGap",
    "BodyPair",
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
    "FrequencySweep",
    "FretscaleError",
    "FrettedSpecimens",
    "GivenLoads",
    "Group",
    "JumpSize",
    "LegPath",
    "LoadSource",
    "LoadTable",
    "MainResult",
    "MeshAssembly",
    "MethodFailed",
    "Mission",
    "ModelWarning",
    "MotionModel",
    "NotWritten",
    "Observer",
    "OutOfMemory",
    "Progress",
    "Results",
    "RigModel",
    "SpecimenPair",
    "Stop",
    "Stress",
    "TightenedBolt",
    "UncoupledSource",
    "UserError",
    "VibrationModel",
    "Wear",
    "WearModel",
    "WearingJoint",
    "check",
    "compare",
    "error_budget",
    "fit",
    "load_case",
    "open",
    "run",
    "vibration_model",
    "wear_model",
]

try:
    __version__ = _version("fretscale")
except PackageNotFoundError:  # a checkout that is not installed
    __version__ = "unknown"

__getattr__, __dir__ = lazy_names(__name__)
