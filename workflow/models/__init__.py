"""Models of structures, contacts and wear: what a case describes, built and run from Python.

Models are plain frozen dataclasses with numpy in them. They know :mod:`fe_models`, :mod:`wear` and
:mod:`sa_solver`, and nothing of case files, folders, caches, printing or plots.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from sa_solver.lazy import lazy_names

if TYPE_CHECKING:
    from workflow.models.assembly import LegPath, MeshAssembly, TightenedBolt
    from workflow.models.contact import Contact, Wear
    from workflow.models.dovetail import DovetailJoint, DovetailMesh
    from workflow.models.gaps import AddedGap
    from workflow.models.loads import ContactFace, LoadSource, UncoupledSource
    from workflow.models.loops import TangentialLoops
    from workflow.models.rig.joint import WearingJoint
    from workflow.models.rig.motion import MotionModel
    from workflow.models.rig.rig_model import RigModel
    from workflow.models.specimens.fretted import FrettedSpecimens
    from workflow.models.specimens.reduced import SpecimenPair
    from workflow.models.stress.settings import Stress
    from workflow.models.structure import StructureLoads
    from workflow.models.structure_model import LoadCycle, Nonlinearity, StructureModel
    from workflow.models.uncoupled.body_pair import BodyPair
    from workflow.models.uncoupled.given_loads import GivenLoads
    from workflow.models.uncoupled.load_table import LoadTable
    from workflow.models.vibration.model import VibrationModel
    from workflow.models.vibration.sweep import FrequencySweep
    from workflow.models.wear import WearModel

__all__ = [
    "AddedGap",
    "BodyPair",
    "Contact",
    "ContactFace",
    "DovetailJoint",
    "DovetailMesh",
    "FrequencySweep",
    "FrettedSpecimens",
    "GivenLoads",
    "LegPath",
    "LoadCycle",
    "LoadSource",
    "LoadTable",
    "MeshAssembly",
    "MotionModel",
    "Nonlinearity",
    "RigModel",
    "SpecimenPair",
    "Stress",
    "StructureLoads",
    "StructureModel",
    "TangentialLoops",
    "TightenedBolt",
    "UncoupledSource",
    "VibrationModel",
    "Wear",
    "WearModel",
    "WearingJoint",
]

__getattr__, __dir__ = lazy_names(__name__)
