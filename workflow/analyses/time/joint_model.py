"""The joint of a case: its initial law, and the evolution of its parameters by wear."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from wear.joints import evolution as forms
from wear.joints.elastic import ElasticLaw
from wear.joints.evolution import JointEvolution, WearFunction
from wear.joints.friction_contact import FrictionContact
from workflow.analyses.rig import joint_evolution as given
from workflow.analyses.rig.joint_sections import BoucWenJoint, ElasticJoint, Joint
from workflow.analyses.rig.laws import law_of, laws_of
from workflow.analyses.time.case import JointCase, TimeCase
from workflow.analyses.time.outcome import PARAMETERS
from workflow.analyses.wear.output.loop_table import read_loop_table
from workflow.errors import UserError
from workflow.models.rig.joint import WearingJoint, parameters_of
from workflow.models.rig.laws import Law, Laws, law_of_all


@dataclass(frozen=True)
class JointModel:
    """A joint that wears: its ``law`` with initial parameters, and their ``evolution``.

    There are entries of ``counts`` joints each. Entries with a law of their ``own`` do not wear.
    All other joints share stiffness and load of the law evenly.
    """

    law: Law
    evolution: JointEvolution
    counts: Sequence[int] = (1,)
    own: Sequence[Law | None] = (None,)

    @classmethod
    def of(
        cls,
        case: TimeCase,
        counts: Sequence[int] = (1,),
        own: Sequence[Joint | ElasticJoint | None] = (None,),
    ) -> JointModel:
        """Return the joint of a case. Raises UserError where its table of loops cannot be used."""
        return cls(law_of(case.joint), _evolution(case), counts, laws_of(own))

    def at(self, energy: float) -> Laws:
        """Return the law of each joint after a dissipated ``energy`` of those that wear [N mm]."""
        return law_of_all(self._whole(energy), self.own, self.counts)

    def parameters(self, energy: float) -> dict[str, float]:
        """Return parameters after a dissipated ``energy`` [N mm], by name."""
        return parameters_of(self._whole(energy))

    def _whole(self, energy: float) -> Law:
        law: Law = self.evolution.at(self.law, energy)
        return law


def wearing_joint(case: JointCase) -> WearingJoint:
    """Return the joint of a case that is a joint alone, with its drive.

    Raises UserError where its table of loops cannot be used.
    """
    law = law_of(case.joint)
    assert not isinstance(law, FrictionContact | ElasticLaw), "a law of one direction"
    ageing = case.ageing
    return WearingJoint(
        law, _evolution(case), case.drive.stroke, ageing.cycles, ageing.energy, ageing.tolerance
    )


def _evolution(case: TimeCase) -> JointEvolution:
    """Return the wear functions of a case; tables of measured loops are used unchanged."""
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
    """Return the wear function for a factor of a parameter with an ``initial`` value."""
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
    """Return friction and stiffness of a table of loops.

    The stiffness in a table is the whole slope of the stuck joint, residual stiffness included.
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
