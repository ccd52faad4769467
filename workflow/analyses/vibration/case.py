"""Vibration cases: a structure with joints under a harmonic force, its steady motions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from math import pi
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import Field, StrictBool, model_validator

from workflow.analyses.rig.doubts import RIGID, about_matrices, about_modes
from workflow.analyses.rig.excitation import DrivingForce, Frequency, MassNumber
from workflow.analyses.rig.joint_sections import (
    ElasticJoint,
    FrictionContactJoint,
    Joint,
    VibrationLaw,
)
from workflow.analyses.rig.matrix_body import MatrixBody
from workflow.analyses.rig.point_body import PointBody
from workflow.analyses.rig.ring import RingOfSectors
from workflow.analyses.rig.structure import (
    FrictionRig,
    ReducedBody,
    Rig,
    RowOfMasses,
    driven_place,
    joint_rows,
    own_laws,
    refuse_missing_mass,
    refuse_own_joints,
    refuse_undriven,
    structure_outline,
)
from workflow.analyses.vibration.excitation import FORCE, LEVEL, Amount, VibrationExcitation
from workflow.analyses.vibration.sections import (
    Continuation,
    FurtherStart,
    LoopsAt,
    MotionResolution,
    NonlinearModes,
)
from workflow.case.fields import Quantity
from workflow.case.plain import shares
from workflow.case.sections import Case, Title, disagreement, entry, one_of
from workflow.case.source import Source

if TYPE_CHECKING:
    from workflow.analyses.rig.rig_model import RigModel


class VibrationCaseBase(Case):
    """A structure under forces a sin(2π frequency t), for all frequencies of a span."""

    also_filled_in: ClassVar[tuple[str, ...]] = ("forces",)
    # Whether joints may have laws of their own, beside that of the case.
    mixes_laws: ClassVar[bool] = False
    in_schema: ClassVar[Mapping[str, Any]] = one_of("forces", "excitation")

    title: Title = entry("one line", "Forced response of a friction rig")
    analysis: Literal["vibration"] = entry("what is computed", "vibration")
    structure: RowOfMasses | ReducedBody | MatrixBody | PointBody | FrictionRig = entry(
        "what holds the joints"
    )
    forces: Annotated[tuple[DrivingForce, ...], Field(min_length=1, max_length=100)] | None = entry(
        "amplitudes, ascending, each followed through the frequencies [N]",
        ["10 N", "40 N"],
        default=None,
    )
    excitation: VibrationExcitation | None = entry(
        "instead of forces and mass: forces at any places, records, motion of the ground",
        default=None,
    )
    engine_order: Annotated[float, Quantity("1", above=0.0, at_most=1e3)] | None = entry(
        "frequency over turns per second of an engine: answers are told over its speed too [1]",
        4,
        default=None,
    )
    frequencies: tuple[Frequency, Frequency] = entry(
        "lower and upper end [Hz]", ["20 Hz", "400 Hz"]
    )
    resolution: MotionResolution = entry("of a period", default=MotionResolution())
    continuation: Continuation = entry("of each curve", default=Continuation())

    @model_validator(mode="after")
    def _ascending(self) -> VibrationCaseBase:
        if any(after <= before for before, after in pairwise(self.forces or ())):
            raise disagreement("not ascending; allowed: each force above the last", "forces")
        if self.frequencies[0] >= self.frequencies[1]:
            raise disagreement("not ascending; allowed: lower, then upper end", "frequencies")
        return self

    @model_validator(mode="after")
    def _wears_its_joint(self) -> VibrationCaseBase:
        if not self.mixes_laws:
            refuse_own_joints(self.structure, "the contact that wears alone")
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
                "given beside an excitation; allowed: excitation.levels, by which it is multiplied",
                *("forces", "excitation"),
            )
        if driven is not None:
            raise disagreement(
                "given beside an excitation, which names its places; allowed: one of them",
                *("structure.driven", "excitation"),
            )
        harmonics = excitation.harmonics(self.resolution.harmonics[-1])
        if 1 not in harmonics:
            raise disagreement(
                "no harmonic 1; allowed: one, frequencies being those of the slowest part",
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
        """The rig, as far as it is known before a run; places that it has not are refused."""
        # Imported here: it builds the structure.
        from workflow.analyses.vibration.places import check_places

        highest, order = self.resolution.harmonics[-1], round(self.engine_order or 1)
        return check_places(self.structure, self.excitation, highest, joint, mass, ring, order)

    @property
    def amount(self) -> Amount:
        """What motions are followed by: a force, or the level of an excitation."""
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
        """Whether joints are contacts, with a normal direction."""
        return False

    @property
    def moves_mean(self) -> bool:
        """Whether joints may move the mean of a vibration: contacts do."""
        return self.contacts

    @property
    def harmonics(self) -> tuple[int, ...]:
        """Those of the motion: 0 too where the mean moves, and those that an excitation has."""
        return self.with_mean(self.resolution.harmonics)

    def with_mean(self, harmonics: Sequence[int]) -> tuple[int, ...]:
        """Harmonics and those of the excitation; with 0 where joints or it move the mean."""
        excited: set[int] = set()
        if self.excitation is not None:
            excited = self.excitation.harmonics(self.resolution.harmonics[-1])
        mean = self.moves_mean or any(order % 2 == 0 for order in excited)
        return tuple(sorted({*harmonics, *excited} | ({0} if mean else set())))

    def doubts(self) -> Iterator[str]:
        yield from about_modes(
            "frequencies", self.frequencies, self.structure, self._stuck, self._shares
        )
        yield from about_matrices(self.structure, self.frequencies[1] * self.harmonics[-1])

    @property
    def _stuck(self) -> float:
        """A stiffness [N/mm] that no joint has more of."""
        return RIGID

    @property
    def _shares(self) -> bool:
        """Whether joints without a law of their own have one."""
        return True

    @property
    def driving(self) -> str:
        """Forces, where they act, and their frequencies, for an outline."""
        low, high = self.frequencies
        if self.excitation is not None:
            text = self.excitation.text(self.resolution.harmonics[-1])
            return f"{text}, at {low:g} to {high:g} Hz{self._engine}"
        forces = ", ".join(f"{force:g}" for force in self.amounts)
        place = driven_place(self.structure, self._driven_mass)
        return f"{forces} N on {place}, at {low:g} to {high:g} Hz{self._engine}"

    @property
    def _engine(self) -> str:
        """Of an engine order, for an outline."""
        if self.engine_order is None:
            return ""
        low, high = (60.0 * frequency / self.engine_order for frequency in self.frequencies)
        return f", engine order {self.engine_order:g}: {low:.5g} to {high:.5g} rpm"

    @property
    def resolved(self) -> str:
        """How the motion is found, for an outline."""
        resolution, harmonics = self.resolution, self.harmonics
        text = f"harmonic balance, {len(harmonics)} harmonics to {harmonics[-1]}"
        text += f", {resolution.samples} samples"
        if resolution.tolerance is not None:
            text += f", growing to a tolerance of {shares(resolution.tolerance)}"
        return text

    @property
    def _driven_mass(self) -> int | None:
        """The number of the mass that is driven, as far as it is given."""
        return None


def wears(source: Source) -> bool:
    """Whether the joints of a vibration case wear: it has a section on that."""
    return any(source.at((section,)) is not None for section in ("wear", "contact"))


class DrivenMass(VibrationCaseBase):
    """The same of a structure that may be a row of masses, of which any is driven."""

    mass: MassNumber | None = entry(
        "of a row, that is driven, counted from the ground; without it the first", 1, default=None
    )

    @model_validator(mode="after")
    def _drives_a_mass(self) -> DrivenMass:
        otherwise = f"{self.structure.kind}; allowed: for a rig"
        if self.mass is not None and self.excitation is not None:
            raise disagreement(
                f"{self.mass}: given beside an excitation, which names its places; allowed: one of "
                "them",
                *("mass", "excitation"),
            )
        refuse_missing_mass(self.structure, self.mass, "mass", otherwise)
        return self

    @property
    def _driven_mass(self) -> int | None:
        return self.mass


class VibrationCase(DrivenMass):
    """Steady vibration of a structure on friction joints that stay as they are."""

    about: ClassVar[str] = "the steady vibration of a rig with friction joints, over frequency"
    also_filled_in: ClassVar[tuple[str, ...]] = ("forces", "joint")
    mixes_laws: ClassVar[bool] = True

    @classmethod
    def suits(cls, source: Source) -> bool:
        return not wears(source)

    structure: Annotated[
        Rig | ReducedBody | MatrixBody | PointBody | FrictionRig, Field(discriminator="kind")
    ] = entry("what holds the joints")
    joint: VibrationLaw | None = entry(
        "its law and its parameters; of all joints together that have none of their own in "
        "structure.joints, of those of one sector of a ring",
        default=None,
    )
    ring: RingOfSectors | None = entry(
        "of like sectors, of which the structure is one: a wave of the engine order travels round",
        default=None,
    )
    loops: LoopsAt | None = entry("of all joints together, at one frequency", default=None)
    force_sweeps: Annotated[tuple[Frequency, ...], Field(max_length=100)] = entry(
        "frequencies at which motions are followed along the force, from the least to the largest "
        "[Hz]",
        ["100 Hz"],
        default=(),
    )
    at: Annotated[tuple[Frequency, ...], Field(max_length=100)] = entry(
        "frequencies at which every motion under each force is solved for [Hz]",
        ["100 Hz", "150 Hz"],
        default=(),
    )
    harmonics_along_curves: StrictBool = entry(
        "whether the harmonics of every point of the curves are written too, which may be large; "
        "those at resonance, and of the motions that are solved for, always are",
        False,
        default=False,
    )
    backbone: StrictBool = entry(
        "whether phase resonance, what is driven 90 degrees behind the force, is followed too",
        False,
        default=False,
    )
    modes: NonlinearModes | None = entry(
        "whose frequency and damping are followed over the amplitude", default=None
    )

    further_branches: Annotated[tuple[FurtherStart, ...], Field(max_length=100)] = entry(
        "from where branches are looked for that no end of the frequencies leads to, as closed "
        "ones; none: nowhere",
        default=(),
    )
    stability: Literal["auto", "every", "none"] = entry(
        "of which motions it is found, and where it changes; auto: of every one in structures of "
        "up to 64 modes and 12 directions of joints, in all sectors of a ring together, as with "
        "more one may take a second",
        "every",
        default="auto",
    )

    @model_validator(mode="after")
    def _has_laws(self) -> VibrationCase:
        own = self.own_laws
        if self.joint is None and (None in own or not own):
            raise disagreement(
                "missing; allowed: the law of all joints, or one for each entry of "
                "structure.joints",
                "joint",
            )
        if self.joint is not None and None not in own:
            raise disagreement(
                f"{self.joint.law}: given, but every entry of joints has a law of its own; "
                "allowed: without it",
                "joint",
            )
        return self

    @property
    def _shares(self) -> bool:
        return self.joint is not None

    @property
    def own_laws(self) -> tuple[Joint | ElasticJoint | None, ...]:
        """Of every entry of joints, None for that of the case."""
        return own_laws(self.structure, self._shares)

    @property
    def laws(self) -> tuple[Joint | ElasticJoint, ...]:
        """That of every entry of joints, or of joints that need no entry."""
        every = (own or self.joint for own in self.own_laws)
        return tuple(law for law in every if law is not None)

    @property
    def _stuck(self) -> float:
        # Nonlinear springs may take a mode anywhere above that without them.
        return max(law.stiffness if isinstance(law, Joint) else RIGID for law in self.laws)

    @property
    def law_names(self) -> str:
        """What these are called."""
        return ", ".join(dict.fromkeys(law.law for law in self.laws))

    @property
    def contacts(self) -> bool:
        return any(isinstance(law, FrictionContactJoint) for law in self.laws)

    @property
    def moves_mean(self) -> bool:
        return any(law.moves_mean for law in self.laws)

    def doubts(self) -> Iterator[str]:
        yield from super().doubts()
        uneven = [law for law in self.laws if isinstance(law, ElasticJoint) and law.moves_mean]
        if uneven and not any(number % 2 == 0 for number in self.harmonics if number > 0):
            yield (
                f"resolution.harmonics: without even ones, which a joint of law {uneven[0].law} "
                "that is not alike on both sides has; list them, such as [0, 1, 2, 3, 4, 5]"
            )

    @model_validator(mode="after")
    def _joins_forces(self) -> VibrationCase:
        if (self.backbone or self.force_sweeps) and len(self.amounts) < 2:
            raise disagreement(
                f"a single {self.amount.name}; allowed: two or more, between which motions are "
                "followed",
                *("forces", "backbone", "force_sweeps"),
            )
        if self.backbone and self.excitation is not None and self.excitation.moves_by_a_way:
            raise disagreement(
                "true: with a displacement of the ground, whose forces change with the frequency; "
                "allowed: a kind of base that is acceleration",
                *("backbone", "excitation"),
            )
        return self

    @model_validator(mode="after")
    def _is_a_sector(self) -> VibrationCase:
        if self.ring is None:
            return self
        structure, order = self.structure, self.engine_order
        if isinstance(structure, Rig | FrictionRig):
            raise disagreement(
                f"{structure.kind}: no sector of a ring; allowed: points, reduced or matrices",
                *("structure.kind", "ring"),
            )
        if order is None or not order.is_integer():
            given = "missing" if order is None else f"{order:g}"
            raise disagreement(
                f"{given}; allowed: with a ring, a whole number", "engine_order", "ring"
            )
        return self

    @model_validator(mode="after")
    def _follows_a_wave(self) -> VibrationCase:
        if self.ring is None:
            return self
        if self.modes is not None:
            raise disagreement(
                "given with a ring, in whose waves every harmonic has modes of its own; allowed: "
                "backbone, and responses",
                *("modes", "ring"),
            )
        if self.excitation is not None and self.excitation.base:
            raise disagreement(
                "a ground that moves drives all sectors at once, not as an engine order does; "
                "allowed: forces and records",
                *("excitation.base", "ring"),
            )
        return self

    @model_validator(mode="after")
    def _further_from_its_own(self) -> VibrationCase:
        low, high = self.frequencies
        for number, start in enumerate(self.further_branches):
            if start.force not in self.amounts:
                allowed = ", ".join(map(self.amount.told, self.amounts))
                raise disagreement(
                    f"{self.amount.told(start.force)}: not among those of the case; allowed: "
                    f"{allowed}",
                    f"further_branches.{number}.force",
                )
            if not low <= start.frequency <= high:
                raise disagreement(
                    f"{start.frequency:g} Hz: outside; allowed: within frequencies, {low:g} to "
                    f"{high:g} Hz",
                    f"further_branches.{number}.frequency",
                )
        return self

    @model_validator(mode="after")
    def _has_the_directions(self) -> VibrationCase:
        if isinstance(self.joint, FrictionContactJoint) and isinstance(self.structure, Rig):
            raise disagreement(
                "friction_contact: has three directions; allowed: in a reduced structure or a "
                "friction_rig, or jenkins, which it is along one",
                "joint.law",
            )
        if isinstance(self.structure, FrictionRig):
            self._require_pad_contacts()
        return self

    def _require_pad_contacts(self) -> None:
        """Refuse joints that are not those of two pads."""
        (joint,) = self.laws
        if not isinstance(joint, FrictionContactJoint):
            raise disagreement(
                f"{joint.law}: between two pads; allowed: friction_contact", "joint.law"
            )
        if joint.gap > 0.0:
            raise disagreement(
                f"{joint.gap:g} mm: given beside specimens; allowed: their own form, "
                "structure.form of their case",
                "joint.gap",
            )
        if joint.normal_load == 0.0:
            raise disagreement(
                "0 N: nothing presses the specimens together; allowed: above 0",
                "joint.normal_load",
            )

    @model_validator(mode="after")
    def _looks_inside(self) -> VibrationCase:
        self._require_joints_of_loops()
        low, high = self.frequencies
        looked_at = {f"at.{place}": frequency for place, frequency in enumerate(self.at)}
        if self.loops is not None:
            looked_at["loops.frequency"] = self.loops.frequency
        for key, frequency in looked_at.items():
            if not low <= frequency <= high:
                raise disagreement(
                    f"{frequency:g} Hz: outside; allowed: within frequencies, {low:g} to "
                    f"{high:g} Hz",
                    key,
                )
        if any(after <= before for before, after in pairwise(self.at)):
            raise disagreement("not ascending; allowed: each frequency above the last", "at")
        return self

    @model_validator(mode="after")
    def _has_its_places(self) -> VibrationCase:
        rig = self._in_place(self.joint, self.mass, self.ring)
        if rig is not None and self.modes is not None:
            count, highest = len(rig.model.mass), max(self.modes.numbers)
            if highest > count:
                raise disagreement(
                    f"mode {highest}: the structure has 1 to {count}; allowed: one of these",
                    "modes.numbers",
                )
        return self

    @property
    def waves(self) -> str:
        """The ring, and nodal diameters of harmonics, in words."""
        ring = self.ring
        assert ring is not None
        assert self.engine_order is not None
        found = ring.diameters(round(self.engine_order), self.harmonics)
        each = (
            f"{harmonic} has {abs(diameters)}{' backward' if diameters < 0 else ''}"
            for harmonic, diameters in zip(self.harmonics, found, strict=True)
        )
        return f"{ring.text}; nodal diameters: harmonic {', '.join(each)}"

    def _require_joints_of_loops(self) -> None:
        """Refuse loops of an entry that there is not, and of several laws together."""
        if self.loops is None:
            return
        number, own = self.loops.joints, self.own_laws
        if number is None and any(own) and len(own) > 1:
            raise disagreement(
                "missing: joints of laws of their own have no loop together; allowed: the number "
                f"of an entry of structure.joints, 1 to {len(own)}",
                "loops.joints",
                "loops",
            )
        if number is not None and number > len(own):
            raise disagreement(
                f"{number}: no such entry of structure.joints; allowed: up to {len(own)}",
                "loops.joints",
            )

    def outline(self) -> list[tuple[str, str]]:
        return [
            *structure_outline(self.structure),
            *([] if self.ring is None else [("ring", self.waves)]),
            *joint_rows(self.joint, self.own_laws),
            ("forces", self.driving),
            ("method", self.resolved),
            *([("motions at", f"{', '.join(f'{at:g}' for at in self.at)} Hz")] if self.at else []),
            *([] if self.loops is None else [("loops", self.loops.text)]),
            *([] if self.modes is None else [("modes", self.modes.text)]),
        ]
