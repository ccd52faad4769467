"""Cases in time: a joint that wears while it is driven, alone or in a vibrating rig."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from fe_models.dynamics.excitation import FEWEST_STEPS
from workflow.analyses.rig.bodies.matrix_body import MatrixBody
from workflow.analyses.rig.excitation import (
    Excitation,
    Hammer,
    Harmonic,
    PrescribedMotion,
    Recorded,
    Time,
)
from workflow.analyses.rig.joint_evolution import EvolutionSection
from workflow.analyses.rig.joint_sections import (
    ContactLaw,
    ElasticJoint,
    FrictionContactJoint,
    Joint,
    JointLaw,
)
from workflow.analyses.rig.plausibility import AWAY, RIGID, about_matrices, about_modes
from workflow.analyses.rig.structure import (
    ReducedBody,
    Rig,
    driven_place,
    joint_rows,
    own_laws,
    refuse_missing_mass,
    refuse_undriven,
    structure_outline,
)
from workflow.analyses.wear.case.evolution import PositiveEnergy, TotalEnergy
from workflow.analyses.wear.case.sections import Cycles
from workflow.case.fields import Ascending, Quantity
from workflow.case.sections import (
    Case,
    DottedPath,
    OutputWithoutFields,
    Section,
    Title,
    disagreement,
    entry,
    in_its_place,
    one_of,
)
from workflow.case.text.plain import plain, times
from workflow.messages.warning_kinds import Notice
from workflow.models.checks.limits import MOST_TIME_STEPS

StepError = Annotated[float, Quantity("1", above=0.0, at_most=0.1)]
JumpError = Annotated[float, Quantity("1", at_least=1e-10, at_most=0.1)]


class SingleJoint(Section):
    """A structure that is only the joint."""

    kind: Literal["joint"] = entry("kind of structure", "joint")


class Ageing(Section):
    """How long the joint is driven: by energy or by cycles."""

    in_schema: ClassVar[Mapping[str, Any]] = one_of("energy", "cycles")

    energy: PositiveEnergy | None = entry(
        "energy dissipated until the end, instead of cycles [N*mm]", "2800 J", default=None
    )
    cycles: Cycles | None = entry("number of cycles until the end [1]", 1.08e6, default=None)
    tolerance: JumpError = entry(
        "relative error of the cycles that jumps in energy may cause [1]", 1e-4, default=1e-4
    )

    @model_validator(mode="after")
    def _one_end(self) -> Ageing:
        if self.energy is not None and self.cycles is not None:
            raise disagreement("both given; allowed: energy or cycles", "cycles", "energy")
        return self

    @property
    def wanted(self) -> bool:
        """True if the joint is aged."""
        return self.energy is not None or self.cycles is not None


class SteadyAgeing(Ageing):
    """How long the joint is driven in steady states: by energy, by cycles, or not at all."""

    filled_in: ClassVar[bool] = False
    in_schema: ClassVar[Mapping[str, Any]] = {}


class Integration(Section):
    """Newmark's method, implicit in the force of the joint."""

    step: Time = entry("time step [s]", "10 us", default=1e-5)
    tolerance: StepError | None = entry(
        "error of the displacement that a step may add before it is split, relative to the "
        "largest displacement; without it steps are never split [1]",
        1e-5,
        default=None,
    )


class ReportedValue(Section):
    """A value that a source reports, shown next to the computed one without any requirement."""

    quantity: DottedPath = entry("path in summary.json", "states.-1.friction")
    value: Annotated[float, Quantity(None)] = entry(
        "value with its unit; a bare number is in base units", 0.9
    )
    source: Title = entry("source of the value", "measured")


class TimeCase(Case):
    """A joint that changes with the energy it dissipates."""

    title: Title = entry("one line", "Bouc-Wen joint at a prescribed stroke")
    analysis: Literal["time"] = entry("kind of analysis", "time")
    structure: Section = entry("structure that holds the joint")
    joint: Joint = entry("law of the joint, and its initial parameters")
    evolution: EvolutionSection = entry(
        "evolution of the parameters with dissipated energy; without it none",
        default=EvolutionSection(),
    )
    energies: Annotated[
        tuple[TotalEnergy, ...], Field(min_length=1), Ascending("ascending energies")
    ] = entry(
        "energies dissipated so far, ascending, at which the joint is reported [N*mm]",
        ["0 J", "1 kJ"],
        default=(0.0,),
    )
    output: OutputWithoutFields = entry(
        "files written with summary and results", default=OutputWithoutFields()
    )
    reported: tuple[ReportedValue, ...] = entry(
        "reported values to show with the computed ones", default=()
    )

    @model_validator(mode="after")
    def _evolves_what_there_is(self) -> TimeCase:
        for name in ("friction", "stiffness", "residual_stiffness", "normal_load"):
            if getattr(self.evolution, name) is not None and not hasattr(self.joint, name):
                raise disagreement(
                    f"{self.joint.law} has no {name}; allowed: those of the joint",
                    f"evolution.{name}",
                )
        return self


class JointCase(TimeCase):
    """A joint alone, moved forward and backward until it is worn."""

    about: ClassVar[str] = "a friction joint alone, driven forward and backward until it is worn"

    structure: SingleJoint = entry("structure of the joint: nothing but its drive")
    joint: JointLaw = entry("law of the joint, and its initial parameters")
    drive: PrescribedMotion = entry("imposed motion of the joint")
    ageing: Ageing = entry("duration of the test")

    @model_validator(mode="after")
    def _ends_after_them(self) -> JointCase:
        if not self.ageing.wanted:
            raise disagreement("no end given; allowed: energy or cycles", "ageing.cycles", "ageing")
        check_within(self.energies, self.ageing)
        return self

    @property
    def question(self) -> str:
        return (
            f"How does a friction joint change as it ages {ageing_outline(self.ageing)}? "
            f"Load: {self.driven}."
        )

    @property
    def driven(self) -> str:
        """Stroke and frequency of the drive, as text."""
        return f"stroke of {plain(self.drive.stroke, 'mm')} at {self.drive.frequency:g} Hz"

    def outline(self) -> list[tuple[str, str]]:
        return [
            ("structure", "none: the joint alone"),
            *joint_outline(self),
            ("drive", self.driven),
            ("ageing", ageing_outline(self.ageing)),
        ]


class RigCase(TimeCase):
    """A rig with a joint: excited by a harmonic force, hit, or driven by a recorded force."""

    about: ClassVar[str] = "masses on friction joints, shaken, hit or driven by a record"

    title: Title = entry("one line", "Friction rig driven by a force")
    structure: Annotated[Rig | ReducedBody | MatrixBody, Field(discriminator="kind")] = entry(
        "structure that holds the joint"
    )
    joint: ContactLaw = entry(
        "law of the joint, and its initial parameters; several joints share them evenly, except "
        "those with a law of their own in structure.joints, which does not evolve"
    )
    excitation: Excitation = entry("excitation of the rig")
    ageing: SteadyAgeing = entry(
        "for a harmonic force: duration of wear in steady states; without an end there is no wear",
        default=SteadyAgeing(),
    )
    integration: Integration = entry("integration in time", default=Integration())

    @model_validator(mode="after")
    def _drives_a_mass(self) -> RigCase:
        otherwise = "a reduced body; allowed: structure.driven"
        refuse_undriven(self.structure)
        refuse_missing_mass(self.structure, self.excitation.mass, "excitation.mass", otherwise)
        return self

    @model_validator(mode="after")
    def _check_joint_is_used(self) -> RigCase:
        if None not in own_laws(self.structure):
            raise disagreement(
                f"{self.joint.law}: not used, because every entry of joints has a law of its own; "
                "allowed: an entry without one, which takes this joint",
                *("joint", "structure.joints"),
            )
        return self

    @model_validator(mode="after")
    def _is_damped_in_time(self) -> RigCase:
        damping = self.structure.damping
        if damping is not None and damping.loss_factor > 0.0:
            raise disagreement(
                f"{damping.loss_factor:g}: only in steady vibration; allowed: 0, and half of it "
                "as structure.damping_ratio, which is the same at resonance",
                "structure.damping.loss_factor",
            )
        return self

    @model_validator(mode="after")
    def _has_the_directions(self) -> RigCase:
        if isinstance(self.joint, FrictionContactJoint) and isinstance(self.structure, Rig):
            raise disagreement(
                "friction_contact has three directions; allowed: in a reduced structure, or "
                "jenkins, which has one",
                "joint.law",
            )
        return self

    @model_validator(mode="after")
    def _has_its_places(self) -> RigCase:
        # Imported here, as it loads the modules that build the structure.
        from workflow.analyses.rig.building import known_rig

        with in_its_place():
            known_rig(self.structure, self.joint, self.excitation.mass)
        return self

    @model_validator(mode="after")
    def _ages_in_steady_states(self) -> RigCase:
        if not self.ageing.wanted:
            return self
        if not isinstance(self.excitation, Harmonic):
            raise disagreement(
                f"given with {self.excitation.kind}; allowed: with a harmonic force", "ageing"
            )
        check_within(self.energies, self.ageing)
        return self

    @model_validator(mode="after")
    def _step_resolves(self) -> RigCase:
        longest = _longest_step(self.excitation)
        if self.integration.step > (1.0 + ROUNDING) * longest:
            raise disagreement(
                f"{self.integration.step:g} s: too long for the excitation; "
                f"allowed: up to {longest:g} s",
                "integration.step",
                "integration",
            )
        return self

    @model_validator(mode="after")
    def _motion_ends(self) -> RigCase:
        count = self.steps * getattr(self.excitation, "periods", 1)
        if count > MOST_TIME_STEPS:
            raise disagreement(
                f"{self.integration.step:g} s: {count:.3g} time steps; allowed: at most "
                f"{MOST_TIME_STEPS:.0e}, with a longer step or a shorter record",
                "integration.step",
                "integration",
            )
        return self

    @property
    def steps(self) -> float:
        """Number of time steps stored of each motion."""
        return _recorded_time(self.excitation) / self.integration.step

    @property
    def question(self) -> str:
        worn = ", and how does wear of the joints change that" * (self.energies[-1] > 0.0)
        return f"How does a rig with friction joints move{worn}? Load: {excitation_outline(self)}."

    def outline(self) -> list[tuple[str, str]]:
        structure = self.structure
        rows = [
            *structure_outline(structure),
            *joint_outline(self, own_laws(structure)),
            ("excitation", excitation_outline(self)),
            ("time steps", f"of {plain(self.integration.step, 's')}"),
        ]
        if self.ageing.wanted:
            rows.append(("ageing", ageing_outline(self.ageing)))
        return rows

    def plausibility_warnings(self) -> Iterator[Notice]:
        excitation, own = self.excitation, own_laws(self.structure)
        stiffness = RIGID if any(own) else self.joint.stiffness
        if isinstance(excitation, Harmonic):
            span = excitation.frequency / AWAY, excitation.frequency * AWAY
            yield from about_modes("excitation.frequency", span, self.structure, stiffness)
        elif isinstance(excitation, Hammer):
            yield from about_modes("excitation.band", excitation.band, self.structure, stiffness)
        # The highest frequency that the time steps resolve.
        yield from about_matrices(self.structure, 1.0 / (FEWEST_STEPS * self.integration.step))


# Tolerance on the difference of two recorded times, for rounding.
ROUNDING = 1e-9


def _longest_step(excitation: Harmonic | Hammer | Recorded) -> float:
    """Return the longest step of time that resolves the excitation [s]."""
    if isinstance(excitation, Harmonic):
        return 1.0 / (FEWEST_STEPS * excitation.frequency)
    if isinstance(excitation, Hammer):
        return min(excitation.duration / FEWEST_STEPS, 0.5 / excitation.highest)
    return float(np.diff(excitation.read()[0]).min())


def _recorded_time(excitation: Harmonic | Hammer | Recorded) -> float:
    """Return the length of the stored motion [s]."""
    if isinstance(excitation, Harmonic):
        return 1.0 / excitation.frequency
    if isinstance(excitation, Hammer):
        return excitation.record
    return float(np.ptp(excitation.read()[0]))


def joules(energy: float) -> str:
    """Return an energy [N mm] as text in J."""
    return f"{1e-3 * energy:.5g} J"


def check_within(energies: tuple[float, ...], ageing: Ageing) -> None:
    """Refuse energies beyond the end of the ageing."""
    if ageing.energy is not None and energies[-1] > ageing.energy:
        raise disagreement(
            f"{joules(energies[-1])}: beyond the end; allowed: up to {joules(ageing.energy)}",
            f"energies.{len(energies) - 1}",
        )


def joint_outline(
    case: TimeCase, own: Sequence[Joint | ElasticJoint | None] = ()
) -> list[tuple[str, str]]:
    """Return rows on the joint, joints with their own laws, the evolution, and the energies."""
    rows = joint_rows(case.joint, own)
    if not case.evolution.is_empty:
        rows.append(("evolution", case.evolution.text))
    if any(case.energies):
        rows.append(("states", f"after {', '.join(map(joules, case.energies))} dissipated"))
    return rows


def excitation_outline(case: RigCase) -> str:
    """Return the excitation of a rig as one line of text."""
    excitation = case.excitation
    place = driven_place(case.structure, excitation.mass)
    if isinstance(excitation, Harmonic):
        return f"{excitation.force:g} N at {excitation.frequency:g} Hz on {place}"
    if isinstance(excitation, Hammer):
        return (
            f"blow of {excitation.force:g} N and {plain(excitation.duration, 's')} on {place}, "
            f"{excitation.record:g} s recorded"
        )
    return f"{excitation.file} on {place}"


def ageing_outline(ageing: Ageing) -> str:
    """Return the end of the ageing as text."""
    if ageing.cycles is not None:
        return f"to {times(ageing.cycles)} cycles"
    return f"to {joules(ageing.energy or 0.0)}"
