"""Vibration cases whose contact wears: forced responses, computed again as wear grows."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import Field, StrictBool, model_validator

from wear.laws import WearLaw
from workflow.analyses.rig.bodies.matrix_body import MatrixBody
from workflow.analyses.rig.excitation import DrivingForce, Frequency
from workflow.analyses.rig.joint_sections import FrictionContactJoint, JenkinsJoint, Joint
from workflow.analyses.rig.place_names import place_names_of
from workflow.analyses.rig.plausibility import AWAY, about_modes
from workflow.analyses.rig.structure import (
    FrictionRig,
    ReducedBody,
    Rig,
    RowOfMasses,
    structure_outline,
)
from workflow.analyses.vibration.case.case_base import DrivenMass, VibrationCaseBase, wears
from workflow.analyses.vibration.case.excitation import Level, VibrationExcitation
from workflow.analyses.vibration.case.vibration_case import VibrationCase
from workflow.analyses.vibration_wear.node_contacts import NodeContacts, PadContacts
from workflow.analyses.wear.case.sections import Cycles, Laws, TwoBodies
from workflow.analyses.wear.case.worn_bodies import BodyWear, wearing
from workflow.analyses.wear.structures.bodies.case import BodiesWearCase, Reciprocation
from workflow.case.fields import Ascending, Quantity
from workflow.case.loading import YAML, CaseFile, load_case, outline_of
from workflow.case.sections import Section, Title, disagreement, entry, in_its_place, one_of
from workflow.case.source import Source
from workflow.case.text.plain import entries, plain, times
from workflow.messages.warning_kinds import Notice

if TYPE_CHECKING:
    from workflow.models.rig.rig_model import RigModel

# Rows of the outline of the contact's own case that are shown, with their names here.
OF_CONTACT = {
    "structure": "shape",
    "material": "material",
    "friction": "friction",
    "wear law": "wear law",
}
# Entries of cases with wear that a vibration case of one state does not use.
NOT_OF_A_STATE = ("assumed", "measured", "expect")


def _unfit(bodies: BodiesWearCase) -> str:
    """Return why the contact of a wear case cannot be the joint of a rig; empty if it can."""
    if not isinstance(bodies.load_path, Reciprocation):
        return "a cycle of legs or a file; take load_path: {P, stroke}, of which P counts"
    if bodies.material(1) != bodies.material(2):
        return (
            "dissimilar materials, whose pressure depends on the shear; take the same material "
            "twice"
        )
    if bodies.friction.at(0.0) == 0.0:
        return "no friction.coefficient above 0"
    if not bodies.wear.step.automatic:
        return (
            "wear.step of a given size; take implicit or second_order steps, whose length "
            "follows from wear.tolerance"
        )
    return ""


class WornContact(Section):
    """The contact that is the rig's joint."""

    file: Annotated[
        str, CaseFile((YAML,), (BodiesWearCase,), "wear of two bodies over an area", _unfit)
    ] = entry(
        "a wear case of two bodies, for form, materials, friction, normal force, grid and wear; "
        "its stroke, cycles and stop are not used",
        "specimens_wear.yaml",
    )


class WearByVibration(Section):
    """The force that wears the contact, and the cycles after which responses are computed."""

    also_filled_in: ClassVar[tuple[str, ...]] = ("force",)

    force: DrivingForce | None = entry("amplitude [N]", "40 N", default=None)
    level: Level | None = entry("factor of the excitation, instead of force [1]", 1, default=None)
    frequency: Frequency = entry("frequency of the force [Hz]", "100 Hz")
    cycles: Annotated[
        tuple[Cycles, ...], Field(min_length=1, max_length=100), Ascending("ascending numbers")
    ] = entry(
        "numbers of cycles at which states are reported, ascending; the contact is first "
        "reported unworn [1]",
        [1000, 100_000],
    )

    @property
    def where(self) -> str:
        """Frequency of the motion that wears, as text."""
        return f"at {self.frequency:g} Hz"


class WearOfNodes(WearByVibration):
    """Wear of contacts at nodes, at resonance too, with a bound on the error of wear steps."""

    also_filled_in: ClassVar[tuple[str, ...]] = ("force", "frequency")
    in_schema: ClassVar[Mapping[str, Any]] = one_of("frequency", "at_resonance")

    frequency: Frequency | None = entry(  # type: ignore[assignment]
        "frequency of the force [Hz]", "100 Hz", default=None
    )
    at_resonance: StrictBool = entry(
        "instead of frequency: whether to follow phase resonance, at which the driven point lags "
        "the force by a quarter of a period, as wear moves it; at first the largest within "
        "frequencies",
        False,
        default=False,
    )
    tolerance: Annotated[
        float, Quantity("1", at_least=1e-4, at_most=0.5, range_text="0.01 % to 50 %")
    ] = entry(
        "error of a first-order step relative to what it wears; the second-order step that is "
        "taken is far better [1]",
        0.1,
        default=0.1,
    )

    @model_validator(mode="after")
    def _at_one_frequency(self) -> WearOfNodes:
        if (self.frequency is None) != self.at_resonance:
            wrong = "given with at_resonance" if self.at_resonance else "missing"
            raise disagreement(
                f"{wrong}; allowed: frequency, or at_resonance: true", "frequency", "at_resonance"
            )
        return self

    @property
    def where(self) -> str:
        return "at resonance" if self.frequency is None else super().where


class WearOfBody(TwoBodies[BodyWear], Laws, WearOfNodes):
    """Wear of contacts at nodes of a reduced body, with the wear laws of both bodies."""

    body_1: BodyWear = entry("body at the other side of the joints, or the ground")
    body_2: BodyWear = entry("the body at the points of the joints")

    @model_validator(mode="after")
    def _something_wears(self) -> WearOfBody:
        if self.body_1.rate(1.0) == self.body_2.rate(1.0) == 0.0:
            raise disagreement("0 for both bodies; allowed: for one of them at most", "body_1")
        return self


class VibrationWearCaseBase(VibrationCaseBase):
    """A rig on a contact that it wears, and its response to forces a sin(2π frequency t)."""

    title: Title = entry("one line", "Forced response of a friction rig as it wears")
    structure: RowOfMasses | FrictionRig | ReducedBody | MatrixBody = entry(
        "structure that holds the contact"
    )
    excitation: VibrationExcitation | None = entry(
        "instead of forces and mass, with wear.level: forces at any places, records, motion of "
        "the ground",
        default=None,
    )
    wear: WearByVibration = entry("wear of the contact")

    @classmethod
    def suits(cls, source: Source) -> bool:
        return wears(source)

    @model_validator(mode="after")
    def _wears_by_the_same(self) -> VibrationWearCaseBase:
        names = ("level", "force") if self.excitation is not None else ("force", "level")
        wanted, other = names
        if getattr(self.wear, other) is not None:
            beside = "an" if self.excitation is not None else "no"
            raise disagreement(
                f"given with {beside} excitation; allowed: {wanted}", f"wear.{other}", "excitation"
            )
        if getattr(self.wear, wanted) is None:
            raise disagreement(f"missing; allowed: {wanted}", f"wear.{wanted}", "wear")
        return self

    @property
    def wearing(self) -> float:
        """Force [N], or level, under which the contact wears."""
        amount = self.wear.force if self.excitation is None else self.wear.level
        assert amount is not None
        return amount

    @property
    def question(self) -> str:
        return (
            f"How does the vibration of a rig change as {self.worn_by} wear its contact for "
            f"{times(self.wear.cycles[-1])} cycles? Load: {self.driving}."
        )

    @property
    def worn_by(self) -> str:
        """Force or level that wears the contact, and its frequency, as text."""
        return f"{self.amount.as_text(self.wearing)} {self.wear.where}"

    def outline(self) -> list[tuple[str, str]]:
        structure, wear = self.structure, self.wear
        return [
            *structure_outline(structure),
            ("worn by", self.worn_by),
            ("states", f"unworn and after {'; '.join(map(times, wear.cycles))} cycles"),
            ("forces", self.driving),
            ("method", self.resolved),
        ]

    def plausibility_warnings(self) -> Iterator[Notice]:
        yield from super().plausibility_warnings()
        frequency: float | None = self.wear.frequency
        if frequency is not None:
            span = frequency / AWAY, frequency * AWAY
            yield from about_modes("wear.frequency", span, self.structure)

    def _of_a_state(self, joint: Joint, mass: int | None = None) -> VibrationCase:
        """Return the vibration case with this joint, driven at the mass of this number."""
        shared = [name for name in VibrationCaseBase.model_fields if name not in NOT_OF_A_STATE]
        entries = {name: getattr(self, name) for name in shared}
        if isinstance(self.structure, RowOfMasses):
            entries["structure"] = Rig(**dict(self.structure))
        return VibrationCase(joint=joint, mass=mass, **entries)


class VibrationWearCase(VibrationWearCaseBase, DrivenMass):
    """Steady vibration of a row of masses on a half-space contact, which it wears."""

    about: ClassVar[str] = "the steady vibration of a rig on a ball or flat that it wears"

    structure: RowOfMasses = entry("structure that holds the contact")
    contact: WornContact = entry("contact between the last mass and the ground")

    @model_validator(mode="after")
    def _has_its_places(self) -> VibrationWearCase:
        self._in_place(None, self.mass)
        return self

    def with_joint(self, normal_load: float, friction: float, stiffness: float) -> VibrationCase:
        """Return the vibration case of one state of the contact, given by its joint parameters."""
        joint = JenkinsJoint(
            law="jenkins", normal_load=normal_load, friction=friction, stiffness=stiffness
        )
        return self._of_a_state(joint, self.mass)

    def outline(self) -> list[tuple[str, str]]:
        bodies = load_case(self.contact.file, [BodiesWearCase])
        assert isinstance(bodies.load_path, Reciprocation)
        pressed = f"pressed by {plain(bodies.load_path.P, 'N')}"
        return [
            *super().outline(),
            ("contact", f"from {Path(self.contact.file).name}, {pressed}"),
            ("grid", f"{' x '.join(map(str, bodies.contact.grid))} cells"),
            *outline_of(self.contact.file, BodiesWearCase, OF_CONTACT),
        ]


class NodesWearCase(VibrationWearCaseBase):
    """Steady vibration of a structure that wears its contacts node by node."""

    joint: PadContacts = entry("all contacts together")
    wear: WearOfNodes = entry("wear of the contacts")

    @model_validator(mode="after")
    def _has_a_resonance(self) -> NodesWearCase:
        excitation = self.excitation
        if self.wear.at_resonance and excitation is not None and excitation.moves_by_a_way:
            raise disagreement(
                "true: with a displacement of the ground, whose forces change with the "
                "frequency; allowed: base.kind: acceleration, or wear.frequency",
                *("wear.at_resonance", "excitation"),
            )
        return self

    @model_validator(mode="after")
    def _has_its_places(self) -> NodesWearCase:
        rig = self._in_place(self._law)
        if rig is not None:
            with in_its_place():
                self._check_contacts(rig)
        return self

    def _check_contacts(self, rig: RigModel) -> None:
        """Raise EntryError for contacts that the rig does not have."""

    @property
    def contacts(self) -> bool:
        return True

    @property
    def _law(self) -> FrictionContactJoint:
        """Law of all contacts before they wear."""
        shared = FrictionContactJoint.model_fields.keys() & PadContacts.model_fields.keys()
        return FrictionContactJoint(**self.joint.model_dump(include=shared))

    @property
    def unworn(self) -> VibrationCase:
        """Vibration case before the first cycle."""
        return self._of_a_state(self._law)

    def outline(self) -> list[tuple[str, str]]:
        joint = self.joint
        return [*super().outline(), ("joint", f"{joint.law}, {entries(joint)}")]


class FrictionRigWearCase(NodesWearCase):
    """Steady vibration of two specimens in a rig, which wear each other node by node."""

    about: ClassVar[str] = "the steady vibration of a rig with two specimens that it wears"

    structure: FrictionRig = entry("two specimens in a rig; their case states how they wear")
    joint: PadContacts = entry("all contacts of the pads together; gaps follow from their form")
    wear: WearOfNodes = entry("wear of the pads")


class ReducedWearCase(NodesWearCase):
    """Steady vibration of a reduced body that wears the friction contacts at its nodes."""

    about: ClassVar[str] = "the steady vibration of a reduced body that wears its contacts"

    title: Title = entry("one line", "Forced response of a body as its contacts wear")
    structure: Annotated[ReducedBody | MatrixBody, Field(discriminator="kind")] = entry(
        "a body with friction contacts at its nodes"
    )
    excitation: VibrationExcitation | None = entry(
        "instead of forces, with wear.level and without structure.driven: forces at any places, "
        "records, motion of the ground",
        default=None,
    )
    joint: NodeContacts = entry("all contacts together")
    wear: WearOfBody = entry("wear of the contacts")

    def _check_contacts(self, rig: RigModel) -> None:
        if self.joint.pressed is not None:
            place_names_of(rig).shared(self.joint.pressed, "joint.pressed")
        assert rig.nodes is not None
        self.joint.of_points(rig.nodes.names)

    @property
    def laws(self) -> tuple[WearLaw, WearLaw]:
        """Wear laws of body 1 and body 2."""
        return self.wear.body_1.described(), self.wear.body_2.described()

    def outline(self) -> list[tuple[str, str]]:
        joint, wear = self.joint, self.wear
        pressed = "each contact by its share"
        if joint.pressed is not None:
            pressed = f"{joint.pressed.points} along {joint.pressed.direction}"
        nodes = [] if joint.nodes is None else [("nodes", Path(joint.nodes).name)]
        return [
            *super().outline(),
            ("pressed", pressed),
            *nodes,
            *wearing({"body_1": wear.body_1, "body_2": wear.body_2}),
        ]
