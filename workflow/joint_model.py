"""The joint of a case: the law that it begins with, and how wear changes its parameters."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sa_solver.types import Array
from wear.joints import evolution as forms
from wear.joints.bouc_wen import BoucWen
from wear.joints.evolution import JointEvolution, WearFunction
from wear.joints.friction_contact import FrictionContact
from wear.joints.iwan import FourParameterIwan, UniformIwan
from wear.joints.jenkins import Jenkins
from wear.joints.law import JointResponse, State
from workflow.case import TimeCase
from workflow.case import joint_evolution as given
from workflow.errors import UserError
from workflow.loop_table import read_loop_table
from workflow.time_outcome import PARAMETERS

if TYPE_CHECKING:
    from wear.joints.parameters import Parameter


@dataclass(frozen=True)
class FrictionContactInLine:
    """A friction contact of three directions that moves along one, under a constant normal load.

    ``stiffness`` kt [N/mm], ``friction`` µ and ``normal_load`` N [N].
    """

    stiffness: Parameter
    friction: Parameter
    normal_load: Parameter

    @property
    def directions(self) -> int:
        return 1

    @cached_property
    def _contact(self) -> FrictionContact:
        return FrictionContact(self.stiffness, 0.0, self.friction, self.normal_load)

    def rest(self, joints: int) -> State:
        return self._contact.rest(joints)

    def respond(self, state: State, increment: Array) -> JointResponse:
        moved = np.zeros((len(increment), self._contact.directions))
        moved[:, :1] = increment
        full = self._contact.respond(state, moved)
        return JointResponse(
            full.force[:, :1], full.tangent[:, :1, :1], full.state, full.dissipated
        )

    def loop_energy(self, amplitude: Parameter) -> Array:
        """Energy of a settled cycle between ± ``amplitude`` [mm]: that of Jenkins's element."""
        return Jenkins(self.stiffness, self.friction, self.normal_load).loop_energy(amplitude)


Law = BoucWen | Jenkins | UniformIwan | FourParameterIwan | FrictionContactInLine
# What a case calls them.
LAWS: dict[str, type[Law]] = {
    "bouc_wen": BoucWen,
    "jenkins": Jenkins,
    "uniform_iwan": UniformIwan,
    "four_parameter_iwan": FourParameterIwan,
    "friction_contact": FrictionContactInLine,
}


@dataclass(frozen=True)
class JointModel:
    """A joint that wears: its ``law`` with the parameters that ``evolution`` begins with."""

    law: Law
    evolution: JointEvolution

    @classmethod
    def of(cls, case: TimeCase) -> JointModel:
        """The joint of a case. Raises UserError where its table of loops cannot be taken."""
        parameters: dict[str, Any] = case.joint.model_dump(exclude={"law"})
        return cls(LAWS[case.joint.law](**parameters), _evolution(case))

    def at(self, energy: float) -> Law:
        """The law after so much dissipated ``energy`` [N mm]."""
        law: Law = self.evolution.at(self.law, energy)
        return law

    def parameters(self, energy: float) -> dict[str, float]:
        """Parameters after so much dissipated ``energy`` [N mm], by name."""
        law = self.at(energy)
        return {name: float(getattr(law, name)) for name in PARAMETERS if hasattr(law, name)}


def _evolution(case: TimeCase) -> JointEvolution:
    """The wear functions of a case; tables of the joint's own loops are taken as they are."""
    section = case.evolution
    functions = {
        name: _function(factor, getattr(case.joint, name))
        for name in PARAMETERS
        if (factor := getattr(section, name)) is not None
    }
    if section.file is not None:
        functions |= _measured(section.file)
    return JointEvolution(**functions)


def _function(factor: given.Factor, initial: float) -> WearFunction:
    """A factor of a parameter that begins with an ``initial`` value."""
    if isinstance(factor, given.Logarithmic):
        return forms.Logarithmic(factor.change, factor.rate)
    if isinstance(factor, given.Arrhenius):
        return forms.Arrhenius(factor.change, factor.scale)
    if isinstance(factor, given.Linear):
        return forms.Linear(factor.slope)
    if isinstance(factor, given.Exponential):
        return forms.Exponentials(factor.final, -factor.rate, factor.share, -factor.second_rate)
    return forms.Table(factor.energy, tuple(initial * own for own in factor.factor))


def _measured(file: str) -> dict[str, WearFunction]:
    """Friction and stiffness of a table of loops."""
    table = read_loop_table(Path(file))
    if table.per_length:
        raise UserError(f"{file}: loops of a line contact, per mm; allowed: those of a whole joint")
    energy = tuple(table.energy.tolist())
    try:
        return {
            "friction": forms.Table(energy, tuple(table.mu.tolist())),
            "stiffness": forms.Table(energy, tuple(table.kt.tolist())),
        }
    except ValueError as error:
        raise UserError(f"{file}: {error}") from error
