"""Laws of joints as a case gives them."""

from __future__ import annotations

from collections.abc import Sequence

from workflow.analyses.rig.joint_sections import ElasticJoint, Joint
from workflow.models.rig.laws import LAWS, Law


def law_of(joint: Joint | ElasticJoint) -> Law:
    """Return the law of a joint of a case. Raises :class:`wear.joints.parameters.JointError`."""
    law: Law = LAWS[joint.law](**joint.model_dump(exclude={"law"}))
    return law


def laws_of(joints: Sequence[Joint | ElasticJoint | None]) -> tuple[Law | None, ...]:
    """Return the law of each entry of joints, None if it has none. Raises as :func:`law_of`."""
    return tuple(None if joint is None else law_of(joint) for joint in joints)
