"""Joints as a case gives them: a law with its initial parameters."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, StrictBool, model_validator

from workflow.case.fields import Quantity
from workflow.case.sections import Section, disagreement, entry

# Limits are wide: they catch a forgotten unit or a slipped exponent, not an unusual joint.
JointStiffness = Annotated[
    float, Quantity("N/mm", above=0.0, at_most=1e12, range_text="above 0 to 1e6 kN/um")
]
ResidualStiffness = Annotated[
    float, Quantity("N/mm", at_least=0.0, at_most=1e12, range_text="0 to 1e6 kN/um")
]
Preload = Annotated[float, Quantity("N", at_least=0.0, at_most=1e9, range_text="0 to 1e6 kN")]
Gap = Annotated[float, Quantity("mm", at_least=0.0, at_most=1e3)]
Coefficient = Annotated[float, Quantity("1", at_least=0.0, at_most=10.0)]


class Joint(Section):
    """A joint with a friction limit, elastic as long as it sticks: entries of all friction laws."""

    law: str  # named first; each law narrows it to its own name
    normal_load: Preload = entry("normal load that presses the joint [N]", "60 N")
    friction: Coefficient = entry("limit of the friction force over the normal load [1]", 0.11)
    stiffness: JointStiffness = entry("stiffness of the stuck joint [N/mm]", "27.3 N/um")

    @property
    def moves_mean(self) -> bool:
        """True if a vibration about 0 has a mean, and even harmonics."""
        return False


class RisingJoint(Joint):
    """A joint whose force continues to rise when all of it slides."""

    residual_stiffness: ResidualStiffness = entry(
        "slope when all of the joint slides [N/mm]", "0.88 N/um", default=0.0
    )


class BoucWenJoint(RisingJoint):
    """Bouc and Wen's law, normalised: force µN ξ, plus the residual slope."""

    law: Literal["bouc_wen"] = entry(
        "bouc_wen, jenkins, uniform_iwan or four_parameter_iwan; in a reduced structure also "
        "friction_contact, in a friction_rig only that",
        "bouc_wen",
    )
    stiffness: JointStiffness = entry(
        "initial slope, residual stiffness included [N/mm]", "27.3 N/um"
    )
    sigma: Annotated[float, Quantity("1", at_least=0.5, at_most=1.0)] = entry(
        "shape of the unloading branch: straight at first with 0.5 [1]", 0.5, default=0.5
    )
    exponent: Annotated[float, Quantity("1", at_least=1.0, at_most=100.0)] = entry(
        "sharpness of the transition from sticking to sliding [1]", 2, default=2.0
    )

    @model_validator(mode="after")
    def _stiffer_than_its_rest(self) -> BoucWenJoint:
        if self.residual_stiffness >= self.stiffness:
            raise disagreement(
                f"{self.residual_stiffness:g} N/mm: not below stiffness; allowed: less",
                *("residual_stiffness", "stiffness"),
            )
        return self


class JenkinsJoint(RisingJoint):
    """A spring with a slider, in parallel with the residual slope."""

    law: Literal["jenkins"] = entry("a spring with a slider", "jenkins")
    stiffness: JointStiffness = entry(
        "stiffness of the spring; the residual one is added [N/mm]", "27.3 N/um"
    )


class IwanJoint(RisingJoint):
    """Iwan's sliders in parallel."""

    stiffness: JointStiffness = entry(
        "stiffness with all sliders stuck; the residual one is added [N/mm]", "115 N/um"
    )


class UniformIwanJoint(IwanJoint):
    """Iwan's sliders with limits spread evenly, starting from zero."""

    law: Literal["uniform_iwan"] = entry("sliders with limits spread evenly", "uniform_iwan")


class FourParameterIwanJoint(IwanJoint):
    """Segalman's Iwan joint: sliders spread by a power law, others with one common limit."""

    law: Literal["four_parameter_iwan"] = entry("Segalman 2005", "four_parameter_iwan")
    chi: Annotated[float, Quantity("1", above=-1.0, at_most=10.0)] = entry(
        "the energy of a small cycle is proportional to the amplitude to the power of chi + 3 [1]",
        -0.5,
    )
    beta: Annotated[float, Quantity("1", at_least=0.0, at_most=1e3)] = entry(
        "stiffness lost at once in full slip, relative to that of the spread sliders [1]", 1.0
    )


class FrictionContactJoint(Joint):
    """Contact at points of a reduced structure: Coulomb's cone about the normal, on springs."""

    law: Literal["friction_contact"] = entry(
        "a contact point, in a reduced structure or a friction_rig", "friction_contact"
    )
    stiffness: JointStiffness = entry("stiffness along the surface, stuck [N/mm]", "100 N/um")
    normal_stiffness: JointStiffness = entry("normal stiffness in contact [N/mm]", "100 N/um")
    gap: Gap = entry("gap at rest, instead of a normal load [mm]", "0 um", default=0.0)

    @property
    def moves_mean(self) -> bool:
        return True

    @model_validator(mode="after")
    def _pressed_or_open(self) -> FrictionContactJoint:
        if self.gap > 0.0 and self.normal_load > 0.0:
            raise disagreement(
                f"{self.gap:g} mm: given with a normal load; allowed: one of them above 0",
                *("gap", "normal_load"),
            )
        return self


class ElasticJoint(Section):
    """A joint without friction, along one direction."""

    law: str

    @property
    def normal_load(self) -> float:
        """Normal load [N]: 0, as nothing presses this joint."""
        return 0.0

    @property
    def moves_mean(self) -> bool:
        """True if a vibration about 0 has a mean, and even harmonics."""
        return False


class PolynomialSpringJoint(ElasticJoint):
    """A spring whose force is a polynomial of its displacement."""

    law: Literal["polynomial_spring"] = entry("a nonlinear spring", "polynomial_spring")
    stiffness: Annotated[float, Quantity("N/mm", at_least=-1e12, at_most=1e12)] = entry(
        "stiffness of small motions, which may be 0 or negative [N/mm]", "1 N/um"
    )
    quadratic: Annotated[float, Quantity("N/mm^2", at_least=-1e15, at_most=1e15)] = entry(
        "force over the square of the displacement [N/mm^2]", "0 N/mm^2", default=0.0
    )
    cubic: Annotated[float, Quantity("N/mm^3", at_least=-1e18, at_most=1e18)] = entry(
        "force over the third power; above 0 it hardens [N/mm^3]", "1e5 N/mm^3", default=0.0
    )
    quartic: Annotated[float, Quantity("N/mm^4", at_least=-1e21, at_most=1e21)] = entry(
        "force over the fourth power [N/mm^4]", "0 N/mm^4", default=0.0
    )
    quintic: Annotated[float, Quantity("N/mm^5", at_least=-1e24, at_most=1e24)] = entry(
        "force over the fifth power [N/mm^5]", "0 N/mm^5", default=0.0
    )

    @property
    def moves_mean(self) -> bool:
        return self.quadratic != 0.0 or self.quartic != 0.0


class ElasticStopJoint(ElasticJoint):
    """A spring that takes load once a gap is closed."""

    law: Literal["elastic_stop"] = entry("a spring behind a gap", "elastic_stop")
    stiffness: JointStiffness = entry("stiffness once the gap is closed [N/mm]", "10 N/um")
    gap: Gap = entry("gap up to the stop [mm]", "20 um", default=0.0)
    two_sided: StrictBool = entry("whether there is a stop on either side", False, default=False)

    @property
    def moves_mean(self) -> bool:
        return not self.two_sided


UniaxialJoint = BoucWenJoint | JenkinsJoint | UniformIwanJoint | FourParameterIwanJoint
JointLaw = Annotated[UniaxialJoint, Field(discriminator="law")]
# Laws for a structure that also moves in three directions.
ContactLaw = Annotated[UniaxialJoint | FrictionContactJoint, Field(discriminator="law")]
# Laws for masses in a row, which move along one direction.
RowLaw = Annotated[
    UniaxialJoint | PolynomialSpringJoint | ElasticStopJoint, Field(discriminator="law")
]
# Laws for steady vibrations, in which joints need not wear.
VibrationLaw = Annotated[
    UniaxialJoint | FrictionContactJoint | PolynomialSpringJoint | ElasticStopJoint,
    Field(discriminator="law"),
]
