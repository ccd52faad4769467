"""Vibration cases: steady motions of a structure with joints under a periodic force."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import Field, StrictBool, model_validator

from workflow.analyses.rig.bodies.matrix_body import MatrixBody
from workflow.analyses.rig.bodies.point_body import PointBody
from workflow.analyses.rig.bodies.ring import RingOfSectors
from workflow.analyses.rig.excitation import Frequency
from workflow.analyses.rig.joint_sections import (
    ElasticJoint,
    FrictionContactJoint,
    Joint,
    VibrationLaw,
)
from workflow.analyses.rig.plausibility import RIGID
from workflow.analyses.rig.structure import (
    FrictionRig,
    ReducedBody,
    Rig,
    joint_rows,
    own_laws,
    structure_outline,
)
from workflow.analyses.vibration.case.case_base import DrivenMass, wears
from workflow.analyses.vibration.case.sections import FurtherStart, LoopsAt, NonlinearModes
from workflow.case.fields import Ascending
from workflow.case.sections import disagreement, entry
from workflow.case.source import Source
from workflow.messages.warning_kinds import Notice, WarningKind


class VibrationCase(DrivenMass):
    """Steady vibration of a structure with joints that do not wear."""

    about: ClassVar[str] = "the steady vibration of a rig with friction joints, over frequency"
    also_filled_in: ClassVar[tuple[str, ...]] = ("forces", "joint")
    mixes_laws: ClassVar[bool] = True

    @classmethod
    def suits(cls, source: Source) -> bool:
        return not wears(source)

    structure: Annotated[
        Rig | ReducedBody | MatrixBody | PointBody | FrictionRig, Field(discriminator="kind")
    ] = entry("structure that holds the joints")
    joint: VibrationLaw | None = entry(
        "law and parameters of the joint; of all joints together that have none of their own in "
        "structure.joints, in a ring of one sector",
        default=None,
    )
    ring: RingOfSectors | None = entry(
        "ring of equal sectors, of which the structure is one: a wave of the engine order "
        "travels round",
        default=None,
    )
    loops: LoopsAt | None = entry("loops of all joints together, at one frequency", default=None)
    force_sweeps: Annotated[tuple[Frequency, ...], Field(max_length=100)] = entry(
        "frequencies at which motions are followed from the smallest to the largest force [Hz]",
        ["100 Hz"],
        default=(),
    )
    at: Annotated[
        tuple[Frequency, ...], Field(max_length=100), Ascending("ascending frequencies")
    ] = entry(
        "frequencies at which every motion under each force is computed [Hz]",
        ["100 Hz", "150 Hz"],
        default=(),
    )
    harmonics_along_curves: StrictBool = entry(
        "whether to write the harmonics of every point of the curves, which may be large; those "
        "at resonance and of the computed motions are always written",
        False,
        default=False,
    )
    backbone: StrictBool = entry(
        "whether to follow phase resonance, at which the driven point lags the force by 90 degrees",
        False,
        default=False,
    )
    modes: NonlinearModes | None = entry(
        "modes whose frequency and damping are followed over the amplitude", default=None
    )

    further_branches: Annotated[tuple[FurtherStart, ...], Field(max_length=100)] = entry(
        "starts of the search for branches that no end of the frequencies leads to, such as "
        "closed ones; none: no search",
        default=(),
    )
    stability: Literal["auto", "every", "none"] = entry(
        "motions whose stability is computed; auto: every one in structures of up to 64 modes "
        "and 12 directions of joints (in a ring, of all sectors together), because one may take "
        "a second in larger ones; none with the contact of two bodies that wear",
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
                f"{self.joint.law}: not used, because every entry of joints has a law of its own; "
                "allowed: without it",
                "joint",
            )
        return self

    @property
    def _shares(self) -> bool:
        return self.joint is not None

    @property
    def own_laws(self) -> tuple[Joint | ElasticJoint | None, ...]:
        """Law of every entry of joints, None for entries that use the law of the case."""
        return own_laws(self.structure, self._shares)

    @property
    def laws(self) -> tuple[Joint | ElasticJoint, ...]:
        """Law of every entry of joints, or of joints that need no entry."""
        every = (own or self.joint for own in self.own_laws)
        return tuple(law for law in every if law is not None)

    @property
    def _stuck(self) -> float:
        # Nonlinear springs may raise a mode to any frequency above its value without them.
        return max(law.stiffness if isinstance(law, Joint) else RIGID for law in self.laws)

    @property
    def law_names(self) -> str:
        """Names of the laws, each once."""
        return ", ".join(dict.fromkeys(law.law for law in self.laws))

    @property
    def contacts(self) -> bool:
        return any(isinstance(law, FrictionContactJoint) for law in self.laws)

    @property
    def moves_mean(self) -> bool:
        return any(law.moves_mean for law in self.laws)

    def plausibility_warnings(self) -> Iterator[Notice]:
        yield from super().plausibility_warnings()
        uneven = [law for law in self.laws if isinstance(law, ElasticJoint) and law.moves_mean]
        if uneven and not any(number % 2 == 0 for number in self.harmonics if number > 0):
            yield Notice(
                WarningKind.EVEN_HARMONICS_MISSING,
                f"resolution.harmonics: no even ones, but a joint of law {uneven[0].law} differs "
                "on its two sides and needs them; list them, such as [0, 1, 2, 3, 4, 5]",
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
                "true: with a displacement of the ground, whose forces change with the "
                "frequency; allowed: base.kind: acceleration",
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
                "a moving ground drives all sectors at once, not as an engine order does; "
                "allowed: forces and records",
                *("excitation.base", "ring"),
            )
        return self

    @model_validator(mode="after")
    def _check_further_starts(self) -> VibrationCase:
        for number, start in enumerate(self.further_branches):
            if start.force not in self.amounts:
                allowed = ", ".join(map(self.amount.as_text, self.amounts))
                raise disagreement(
                    f"{self.amount.as_text(start.force)}: not among those of the case; allowed: "
                    f"{allowed}",
                    f"further_branches.{number}.force",
                )
            self._require_inside(start.frequency, f"further_branches.{number}.frequency")
        return self

    def _require_inside(self, frequency: float, key: str) -> None:
        """Refuse a frequency that the curves do not reach."""
        low, high = self.frequencies
        if not low <= frequency <= high:
            raise disagreement(
                f"{frequency:g} Hz: outside; allowed: within frequencies, {low:g} to {high:g} Hz",
                key,
            )

    @model_validator(mode="after")
    def _has_the_directions(self) -> VibrationCase:
        if isinstance(self.joint, FrictionContactJoint) and isinstance(self.structure, Rig):
            raise disagreement(
                "friction_contact has three directions; allowed: in a reduced structure or a "
                "friction_rig, or jenkins, which has one",
                "joint.law",
            )
        if isinstance(self.structure, FrictionRig):
            self._require_pad_contacts()
        return self

    def _require_pad_contacts(self) -> None:
        """Refuse joints that cannot be contacts between two pads."""
        (joint,) = self.laws
        if not isinstance(joint, FrictionContactJoint):
            raise disagreement(
                f"{joint.law}: between two pads; allowed: friction_contact", "joint.law"
            )
        if joint.gap > 0.0:
            raise disagreement(
                f"{joint.gap:g} mm: given with specimens; allowed: structure.form of their case",
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
        for place, frequency in enumerate(self.at):
            self._require_inside(frequency, f"at.{place}")
        if self.loops is not None:
            self._require_inside(self.loops.frequency, "loops.frequency")
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
        """Description of the ring, and nodal diameters of harmonics."""
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
        """Refuse loops of an entry that does not exist, and of several laws together."""
        if self.loops is None:
            return
        number, own = self.loops.joints, self.own_laws
        if number is None and any(own) and len(own) > 1:
            raise disagreement(
                "missing: joints with laws of their own have no common loop; allowed: the number "
                f"of an entry of structure.joints, 1 to {len(own)}",
                "loops.joints",
                "loops",
            )
        if number is not None and number > len(own):
            raise disagreement(
                f"{number}: no such entry of structure.joints; allowed: up to {len(own)}",
                "loops.joints",
            )

    @property
    def question(self) -> str:
        return (
            "How strongly does a structure with friction joints vibrate, and where is its "
            f"resonance? Load: {self.driving}."
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
