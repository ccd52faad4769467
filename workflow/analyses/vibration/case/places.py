"""Check of the places that a vibration case names, before anything runs."""

from __future__ import annotations

from workflow.analyses.rig.bodies.ring import RingOfSectors
from workflow.analyses.rig.building import known_rig
from workflow.analyses.rig.joint_sections import ElasticJoint, Joint
from workflow.analyses.rig.structure import FrictionRig, JointedBody, RowOfMasses
from workflow.analyses.vibration.case.excitation import VibrationExcitation
from workflow.analyses.vibration.case.load import driving_of
from workflow.case.sections import in_its_place
from workflow.models.rig.rig_model import RigModel


def check_places(
    structure: RowOfMasses | JointedBody | FrictionRig,
    excitation: VibrationExcitation | None,
    highest: int,
    joint: Joint | ElasticJoint | None = None,
    mass: int | None = None,
    ring: RingOfSectors | None = None,
    engine_order: int = 1,
) -> RigModel | None:
    """Return the rig of a case as far as it is known before a run, and refuse unknown places.

    Records are used up to the ``highest`` harmonic; see :func:`known_rig` for the other parameters.
    """
    with in_its_place():
        rig = known_rig(structure, joint, mass, ring, engine_order)
        if rig is not None:
            driving_of(excitation, rig, highest)
    return rig
