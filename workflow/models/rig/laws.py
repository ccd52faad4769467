"""Laws of the joints of a structure: one for all, or one for each group of joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from wear.joints.bouc_wen import BoucWen
from wear.joints.elastic import ElasticStop, PolynomialSpring
from wear.joints.friction_contact import FrictionContact
from wear.joints.iwan import FourParameterIwan, UniformIwan
from wear.joints.jenkins import Jenkins
from wear.joints.mixed import JointGroup, MixedLaw

LineLaw = BoucWen | Jenkins | UniformIwan | FourParameterIwan
Elastic = PolynomialSpring | ElasticStop
Law = LineLaw | FrictionContact | Elastic
# Law of all joints of a structure: a single law, or one per group of joints.
Laws = Law | MixedLaw
# Laws by their names in cases.
LAWS: dict[str, type[Law]] = {
    "bouc_wen": BoucWen,
    "jenkins": Jenkins,
    "uniform_iwan": UniformIwan,
    "four_parameter_iwan": FourParameterIwan,
    "friction_contact": FrictionContact,
    "polynomial_spring": PolynomialSpring,
    "elastic_stop": ElasticStop,
}
# Parameters that are split among joints with one law. Friction and gap are the same in each.
SHARED = (
    *("stiffness", "residual_stiffness", "normal_stiffness", "normal_load"),
    *("quadratic", "cubic", "quartic", "quintic"),
)


def law_of_all(shared: Law | None, own: Sequence[Law | None], counts: Sequence[int]) -> Laws:
    """Return the law of all joints of a structure, whose entries have ``counts`` joints each.

    The joints of an entry with a law of its ``own`` share its parameters evenly. All other joints
    share the parameters of the ``shared`` law.
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
    """Return the law of all ``joints`` as groups of joints with one law each."""
    return law if isinstance(law, MixedLaw) else MixedLaw((JointGroup(law, joints),))


def shared_out(law: Law, joints: int) -> Law:
    """Return the law of one joint where ``joints`` share stiffness and load of ``law`` evenly."""
    shares = {name: getattr(law, name) / joints for name in SHARED if hasattr(law, name)}
    return replace(law, **shares) if joints > 1 else law
