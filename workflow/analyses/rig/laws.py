"""The laws of joints, by the names that cases have for them."""

from __future__ import annotations

from dataclasses import replace

from wear.joints.bouc_wen import BoucWen
from wear.joints.elastic import ElasticStop, PolynomialSpring
from wear.joints.friction_contact import FrictionContact
from wear.joints.iwan import FourParameterIwan, UniformIwan
from wear.joints.jenkins import Jenkins

LineLaw = BoucWen | Jenkins | UniformIwan | FourParameterIwan
Elastic = PolynomialSpring | ElasticStop
Law = LineLaw | FrictionContact | Elastic
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


def shared_out(law: Law, joints: int) -> Law:
    """The law of each of so many joints that share stiffness and load of ``law`` evenly."""
    shares = {name: getattr(law, name) / joints for name in SHARED if hasattr(law, name)}
    return replace(law, **shares) if joints > 1 else law
