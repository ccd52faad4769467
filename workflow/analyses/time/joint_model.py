"""The joint of a case: the law that it begins with, and how wear changes its parameters."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from wear.joints import evolution as forms
from wear.joints.elastic import ElasticLaw
from wear.joints.evolution import JointEvolution, WearFunction
from wear.joints.friction_contact import FrictionContact
from workflow.analyses.rig import joint_evolution as given
from workflow.analyses.rig.joint_sections import BoucWenJoint
from workflow.analyses.rig.laws import LAWS, Law, LineLaw, shared_out
from workflow.analyses.time.case import TimeCase
from workflow.analyses.time.outcome import PARAMETERS
from workflow.analyses.wear.loop_table import read_loop_table
from workflow.errors import UserError


@dataclass(frozen=True)
class JointModel:
    """A joint that wears: its ``law`` with the parameters that ``evolution`` begins with.

    They are those of all ``joints`` together, which share stiffness and load evenly.
    """

    law: Law
    evolution: JointEvolution
    joints: int = 1

    @classmethod
    def of(cls, case: TimeCase, joints: int = 1) -> JointModel:
        """The joint of a case. Raises UserError where its table of loops cannot be taken."""
        parameters: dict[str, Any] = case.joint.model_dump(exclude={"law"})
        return cls(LAWS[case.joint.law](**parameters), _evolution(case), joints)

    @property
    def line_law(self) -> LineLaw:
        """The law of a joint alone, which has one direction."""
        assert not isinstance(self.law, FrictionContact | ElasticLaw)
        return self.law

    def at(self, energy: float) -> Law:
        """The law of each joint after so much ``energy`` dissipated in all of them [N mm]."""
        return shared_out(self._whole(energy), self.joints)

    def parameters(self, energy: float) -> dict[str, float]:
        """Parameters after so much dissipated ``energy`` [N mm], by name."""
        law = self._whole(energy)
        return {name: float(getattr(law, name)) for name in PARAMETERS if hasattr(law, name)}

    def _whole(self, energy: float) -> Law:
        law: Law = self.evolution.at(self.law, energy)
        return law


def _evolution(case: TimeCase) -> JointEvolution:
    """The wear functions of a case; tables of the joint's own loops are taken as they are."""
    section = case.evolution
    functions = {
        name: _function(factor, getattr(case.joint, name))
        for name in PARAMETERS
        if (factor := getattr(section, name)) is not None
    }
    if section.file is not None:
        functions |= _measured(section.file, case)
    return JointEvolution(**functions)


def _function(factor: given.Factor, initial: float) -> WearFunction:
    """A factor of a parameter that begins with an ``initial`` value."""
    if isinstance(factor, given.Logarithmic):
        return forms.LogarithmicEvolution(factor.change, factor.rate)
    if isinstance(factor, given.Arrhenius):
        return forms.ArrheniusEvolution(factor.change, factor.scale)
    if isinstance(factor, given.Linear):
        return forms.LinearEvolution(factor.slope)
    if isinstance(factor, given.Exponential):
        return forms.ExponentialEvolution(
            factor.final, -factor.rate, factor.share, -factor.second_rate
        )
    return forms.TabulatedEvolution(factor.energy, tuple(initial * f for f in factor.factor))


def _measured(file: str, case: TimeCase) -> dict[str, WearFunction]:
    """Friction and stiffness of a table of loops.

    A table's stiffness is the whole slope of the stuck joint, the residual one included.
    """
    table = read_loop_table(Path(file))
    if table.per_length:
        raise UserError(f"{file}: loops of a line contact, per mm; allowed: those of a whole joint")
    energy = tuple(table.energy.tolist())
    beside = 0.0
    if not isinstance(case.joint, BoucWenJoint):
        beside = getattr(case.joint, "residual_stiffness", 0.0)
    try:
        return {
            "friction": forms.TabulatedEvolution(energy, tuple(table.mu.tolist())),
            "stiffness": forms.TabulatedEvolution(energy, tuple((table.kt - beside).tolist())),
        }
    except ValueError as error:
        raise UserError(f"{file}: {error}") from error
