"""The laws of joints, by the names that cases have for them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from wear.joints.bouc_wen import BoucWen
from wear.joints.elastic import ElasticStop, PolynomialSpring
from wear.joints.friction_contact import FrictionContact
from wear.joints.iwan import FourParameterIwan, UniformIwan
from wear.joints.jenkins import Jenkins
from wear.joints.mixed import JointGroup, MixedLaw
from workflow.analyses.rig.joint_sections import ElasticJoint, Joint

LineLaw = BoucWen | Jenkins | UniformIwan | FourParameterIwan
Elastic = PolynomialSpring | ElasticStop
Law = LineLaw | FrictionContact | Elastic
# Those of all joints of a structure: one, or several.
Laws = Law | MixedLaw
# What a case calls them.
LAWS: dict[str, type[Law]] = {
    "bouc_wen": BoucWen,
    "jenkins": Jenkins,
    "uniform_iwan": UniformIwan,
    "four_parameter_iwan": FourParameterIwan,
    "friction_contact": FrictionContact,
    "polynomial_spring": PolynomialSpring,
    "elastic_stop": ElasticStop,
}
# What joints with the same parameters share: friction and gap are those of each.
SHARED = (
    *("stiffness", "residual_stiffness", "normal_stiffness", "normal_load"),
    *("quadratic", "cubic", "quartic", "quintic"),
)


def law_of(joint: Joint | ElasticJoint) -> Law:
    """The law of a case. Raises :class:`wear.joints.parameters.JointError`."""
    law: Law = LAWS[joint.law](**joint.model_dump(exclude={"law"}))
    return law


def laws_of(joints: Sequence[Joint | ElasticJoint | None]) -> tuple[Law | None, ...]:
    """Those of entries of joints, None of those without. Raises as :func:`law_of`."""
    return tuple(None if joint is None else law_of(joint) for joint in joints)


def law_of_all(shared: Law | None, own: Sequence[Law | None], counts: Sequence[int]) -> Laws:
    """The law of all joints of a structure, in entries of so many joints each.

    Joints of an entry share evenly what is its ``own``, and those of all others what is ``shared``.
    """
    sharing = sum(count for count, law in zip(counts, own, strict=True) if law is None)
    common = None if shared is None else shared_out(shared, sharing)
    if common is not None and not any(own):
        return common
    groups = []
    for count, law in zip(counts, own, strict=True):
        each = common if law is None else shared_out(law, count)
        assert each is not None
        groups.append(JointGroup(each, count))
    return MixedLaw(tuple(groups))


def grouped(law: Laws, joints: int) -> MixedLaw:
    """The law of so many joints as groups of one law each."""
    return law if isinstance(law, MixedLaw) else MixedLaw((JointGroup(law, joints),))


def shared_out(law: Law, joints: int) -> Law:
    """The law of each of so many joints that share stiffness and load of ``law`` evenly."""
    shares = {name: getattr(law, name) / joints for name in SHARED if hasattr(law, name)}
    return replace(law, **shares) if joints > 1 else law
