"""Parts common to all vibration cases: structure, excitation, frequencies and resolution."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import pi
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from workflow.analyses.rig.bodies.matrix_body import MatrixBody
from workflow.analyses.rig.bodies.point_body import PointBody
from workflow.analyses.rig.bodies.ring import RingOfSectors
from workflow.analyses.rig.excitation import DrivingForce, FrequencySpan, MassNumber
from workflow.analyses.rig.joint_sections import ElasticJoint, Joint
from workflow.analyses.rig.plausibility import RIGID, about_matrices, about_modes
from workflow.analyses.rig.structure import (
    FrictionRig,
    ReducedBody,
    RowOfMasses,
    driven_place,
    refuse_missing_mass,
    refuse_own_joints,
    refuse_undriven,
)
from workflow.analyses.vibration.case.excitation import VibrationExcitation
from workflow.analyses.vibration.case.sections import Continuation, MotionResolution
from workflow.case.fields import Ascending, Quantity
from workflow.case.sections import Case, Title, disagreement, entry, in_its_place, one_of
from workflow.case.source import Source
from workflow.case.text.plain import shares
from workflow.messages.warning_kinds import Notice
from workflow.models.vibration.amount import FORCE, LEVEL, ExcitationSize

if TYPE_CHECKING:
    from workflow.models.rig.rig_model import RigModel


Forces = Annotated[
    tuple[DrivingForce, ...], Field(min_length=1, max_length=100), Ascending("ascending forces")
]


class VibrationCaseBase(Case):
    """A structure under forces a sin(2π frequency t), for all frequencies of a span."""

    also_filled_in: ClassVar[tuple[str, ...]] = ("forces",)
    # Whether joints may have laws of their own, in addition to the law of the case.
    mixes_laws: ClassVar[bool] = False
    in_schema: ClassVar[Mapping[str, Any]] = one_of("forces", "excitation")

    title: Title = entry("one line", "Forced response of a friction rig")
    analysis: Literal["vibration"] = entry("kind of analysis", "vibration")
    structure: RowOfMasses | ReducedBody | MatrixBody | PointBody | FrictionRig = entry(
        "structure that holds the joints"
    )
    forces: Forces | None = entry(
        "amplitudes of the force, ascending, each followed through the frequencies [N]",
        ["10 N", "40 N"],
        default=None,
    )
    excitation: VibrationExcitation | None = entry(
        "instead of forces and mass: forces at any places, records, motion of the ground",
        default=None,
    )
    engine_order: Annotated[float, Quantity("1", above=0.0, at_most=1e3)] | None = entry(
        "frequency over turns per second of an engine: results are also given over its speed [1]",
        4,
        default=None,
    )
    frequencies: FrequencySpan = entry("lower and upper end [Hz]", ["20 Hz", "400 Hz"])
    resolution: MotionResolution = entry("resolution of a period", default=MotionResolution())
    continuation: Continuation = entry("continuation of each curve", default=Continuation())

    @model_validator(mode="after")
    def _wears_its_joint(self) -> VibrationCaseBase:
        if not self.mixes_laws:
            refuse_own_joints(self.structure)
        return self

    @model_validator(mode="after")
    def _is_driven(self) -> VibrationCaseBase:
        excitation, driven = self.excitation, getattr(self.structure, "driven", None)
        if excitation is None:
            if self.forces is None:
                raise disagreement("missing; allowed: forces, or an excitation", "forces")
            refuse_undriven(self.structure)
            return self
        if self.forces is not None:
            raise disagreement(
                "given with an excitation; allowed: excitation.levels, by which it is multiplied",
                *("forces", "excitation"),
            )
        if driven is not None:
            raise disagreement(
                "given with an excitation, which names its places; allowed: one of them",
                *("structure.driven", "excitation"),
            )
        harmonics = excitation.harmonics(self.resolution.harmonics[-1])
        if 1 not in harmonics:
            raise disagreement(
                "no harmonic 1; allowed: a harmonic 1, because frequencies are those of the "
                "slowest part",
                "excitation",
            )
        if self.resolution.samples <= 2 * max(harmonics):
            raise disagreement(
                f"{self.resolution.samples}: too few for harmonic {max(harmonics)} of the "
                f"excitation; allowed: above {2 * max(harmonics)}",
                *("resolution.samples", "excitation"),
            )
        return self

    def _in_place(
        self,
        joint: Joint | ElasticJoint | None,
        mass: int | None = None,
        ring: RingOfSectors | None = None,
    ) -> RigModel | None:
        """Return the rig as far as it is known before a run, and refuse places it does not have."""
        # Imported here, as they load the modules that build the structure.
        from workflow.analyses.rig.building import known_rig
        from workflow.analyses.vibration.case.load import driving_of

        with in_its_place():
            rig = known_rig(self.structure, joint, mass, ring, round(self.engine_order or 1))
            if rig is not None:
                driving_of(self.excitation, rig, self.resolution.harmonics[-1])
        return rig

    @property
    def amount(self) -> ExcitationSize:
        """Quantity along which motions are followed: a force, or the level of an excitation."""
        return FORCE if self.excitation is None else LEVEL

    @property
    def amounts(self) -> tuple[float, ...]:
        """Forces [N], or levels of the excitation."""
        return self.forces or () if self.excitation is None else self.excitation.levels

    @property
    def turning(self) -> float:
        """Speed of the engine [rad/s] over the frequency [Hz]."""
        assert self.engine_order is not None
        return 2.0 * pi / self.engine_order

    @property
    def contacts(self) -> bool:
        """True if joints are contacts, with a normal direction."""
        return False

    @property
    def moves_mean(self) -> bool:
        """True if joints may move the mean of a vibration: contacts do."""
        return self.contacts

    @property
    def harmonics(self) -> tuple[int, ...]:
        """Harmonics of the motion, with those of the excitation, and 0 where the mean moves."""
        return self.with_mean(self.resolution.harmonics)

    def with_mean(self, harmonics: Sequence[int]) -> tuple[int, ...]:
        """Return the harmonics and those of the excitation, with 0 where the mean moves.

        The mean moves by joints that are not symmetric, and by even harmonics of the excitation.
        """
        excited: set[int] = set()
        if self.excitation is not None:
            excited = self.excitation.harmonics(self.resolution.harmonics[-1])
        mean = self.moves_mean or any(order % 2 == 0 for order in excited)
        return tuple(sorted({*harmonics, *excited} | ({0} if mean else set())))

    def plausibility_warnings(self) -> Iterator[Notice]:
        yield from about_modes(
            "frequencies", self.frequencies, self.structure, self._stuck, self._shares
        )
        yield from about_matrices(self.structure, self.frequencies[1] * self.harmonics[-1])

    @property
    def _stuck(self) -> float:
        """Upper bound on the stiffness of joints [N/mm]."""
        return RIGID

    @property
    def _shares(self) -> bool:
        """True if there is a law for joints without a law of their own."""
        return True

    @property
    def driving(self) -> str:
        """Forces, their places and their frequencies, for an outline."""
        low, high = self.frequencies
        if self.excitation is not None:
            text = self.excitation.text(self.resolution.harmonics[-1])
            return f"{text}, at {low:g} to {high:g} Hz{self._engine}"
        forces = ", ".join(f"{force:g}" for force in self.amounts)
        place = driven_place(self.structure, self._driven_mass)
        return f"{forces} N on {place}, at {low:g} to {high:g} Hz{self._engine}"

    @property
    def _engine(self) -> str:
        """Engine order and its speeds, for an outline."""
        if self.engine_order is None:
            return ""
        low, high = (60.0 * frequency / self.engine_order for frequency in self.frequencies)
        return f", engine order {self.engine_order:g}: {low:.5g} to {high:.5g} rpm"

    @property
    def resolved(self) -> str:
        """Method by which the motion is found, for an outline."""
        resolution, harmonics = self.resolution, self.harmonics
        text = f"harmonic balance, {len(harmonics)} harmonics to {harmonics[-1]}"
        text += f", {resolution.samples} samples"
        if resolution.tolerance is not None:
            text += f", growing to a tolerance of {shares(resolution.tolerance)}"
        return text

    @property
    def _driven_mass(self) -> int | None:
        """Number of the driven mass, None if not given."""
        return None


def wears(source: Source) -> bool:
    """Return whether the joints of a vibration case wear: it has a section wear or contact."""
    return any(source.at((section,)) is not None for section in ("wear", "contact"))


class DrivenMass(VibrationCaseBase):
    """A vibration case whose structure may be a row of masses, of which any one is driven."""

    mass: MassNumber | None = entry(
        "driven mass of a row, counted from the ground; without it the first", 1, default=None
    )

    @model_validator(mode="after")
    def _drives_a_mass(self) -> DrivenMass:
        otherwise = f"{self.structure.kind}; allowed: for a rig"
        if self.mass is not None and self.excitation is not None:
            raise disagreement(
                f"{self.mass}: given with an excitation, which names its places; allowed: one of "
                "them",
                *("mass", "excitation"),
            )
        refuse_missing_mass(self.structure, self.mass, "mass", otherwise)
        return self

    @property
    def _driven_mass(self) -> int | None:
        return self.mass
