"""Structures that hold the joints of a rig: masses in a row, a reduced body, or two specimens."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from workflow.analyses.rig.damping import OF_MODES, Damping, DampingRatios, damping_text
from workflow.analyses.rig.joint_sections import (
    ElasticJoint,
    Joint,
    RowLaw,
    VibrationLaw,
)
from workflow.analyses.rig.places import Against, Direction, KeptPoints, Moved
from workflow.analyses.specimens.case import SpecimensCase
from workflow.case.fields import Quantity, Whole, shown
from workflow.case.files.input_files import open_hdf5
from workflow.case.loading import YAML, CaseFile, outline_of
from workflow.case.sections import Length, Section, Title, at_entry, disagreement, entry
from workflow.case.text.plain import entries
from workflow.models.rig.names import MODE

if TYPE_CHECKING:
    from fe_models.joints.reduction import ReducedModel

# Rows of a specimens outline that a rig shows, with their names there.
OF_SPECIMENS = {
    "structure": "specimens",
    **{f"surface {body}": f"surface {body}" for body in (1, 2)},
    "material": "material",
    "wear law": "wear law",
}
Mass = Annotated[float, Quantity("t", above=0.0, at_most=1e3, range_text="above 0 to 1e6 kg")]
Spring = Annotated[float, Quantity("N/mm", at_least=0.0, at_most=1e12, range_text="0 to 1e6 kN/um")]


class JointPlaces(Against):
    """A joint at each of some points."""

    direction: Direction = entry(
        "direction in which the points move as the joint stretches; a friction contact closes "
        "along it and slides across it",
        "-z",
    )
    joint: VibrationLaw | None = entry(
        "law and parameters of these joints together; without it those of the case's joint, "
        "which all entries without a law share",
        default=None,
    )


class RowJoint(JointPlaces):
    """A joint of a mass in a row."""

    points: Title = entry("the mass: m1, m2, ... counted from the ground", "m2")
    against: Title | None = entry("another mass; without it the ground", "m1", default=None)
    direction: Direction = entry(
        "x or -x: direction in which the mass stretches the joint", "x", default="x"
    )
    joint: RowLaw | None = entry(
        "law and parameters of this joint; without it the case's joint, which all joints "
        "without a law share",
        default=None,
    )


class RowOfMasses(Section):
    """Masses in a row on springs, counted from the ground, of which the last one has the joint."""

    refused: ClassVar[Mapping[str, str]] = {
        "joints": "given; allowed: leave them out: the contact that wears is the only joint"
    }

    kind: Literal["rig"] = entry("masses in a row", "rig")
    masses: Annotated[tuple[Mass, ...], Field(min_length=1, max_length=20)] = entry(
        "masses, from the ground on [t]", ["21.2 kg", "1.2 kg"]
    )
    springs: Annotated[tuple[Spring, ...], Field(min_length=1, max_length=20)] = entry(
        "springs, each between its mass and the one before, or the ground [N/mm]",
        ["1.4 N/um", "273 N/um"],
    )
    damping_ratio: DampingRatios = entry(f"without the joint, {OF_MODES}", 0.001)
    damping: Damping | None = entry("damping added to that of the modes", default=None)

    @model_validator(mode="after")
    def _check_damping_ratios(self) -> RowOfMasses:
        count = len(self.masses)
        if len(self.damping_ratio) > count:
            raise disagreement(
                f"{len(self.damping_ratio)} ratios for {count} modes; allowed: as many or fewer",
                "damping_ratio",
            )
        return self

    @model_validator(mode="after")
    def _a_spring_per_mass(self) -> RowOfMasses:
        if len(self.springs) != len(self.masses):
            raise disagreement(
                f"{len(self.springs)} springs for {len(self.masses)} masses; allowed: as many",
                *("springs", "masses"),
            )
        return self

    @property
    def text(self) -> str:
        """Short description of the rig."""
        return f"rig of {_on_springs(self.masses, self.springs)}"


class Rig(RowOfMasses):
    """Masses in a row on springs, counted from the ground, with joints anywhere between them."""

    refused: ClassVar[Mapping[str, str]] = {}

    joints: tuple[RowJoint, ...] = entry(
        "places of the joints; the case's joint is between the last mass and the ground if no "
        "entry uses it",
        default=(),
    )

    @model_validator(mode="after")
    def _check_joint_places(self) -> Rig:
        names = [f"m{number}" for number in range(1, len(self.masses) + 1)]
        for number, joint in enumerate(self.joints):
            key = f"joints.{number}"
            for end in ("points", "against"):
                name = getattr(joint, end)
                if name is not None and name not in names:
                    raise disagreement(
                        f"{shown(name)}: no such mass; allowed: m1 to {names[-1]}", f"{key}.{end}"
                    )
            if joint.points == joint.against:
                raise disagreement(
                    f"{joint.points} joined to itself; allowed: other masses", f"{key}.against"
                )
            if joint.direction[-1] != "x":
                raise disagreement(
                    f"{joint.direction}: masses in a row move along x; allowed: x, -x",
                    f"{key}.direction",
                )
        return self

    @property
    def text(self) -> str:
        joints = f", joints {joined(self.joints)}" if self.joints else ""
        return f"{super().text}{joints}"


class AddedMass(KeptPoints):
    """A mass that points share evenly."""

    mass: Mass = entry("mass of all of them together [t]", "1.2 kg")


class AddedSpring(Against):
    """A spring that points share evenly."""

    stiffness: Spring = entry("stiffness of all of them together [N/mm]", "273 N/um")


class FurtherMass(Section):
    """A mass at a point of its own that is not part of the body."""

    name: Title = entry("name of the point in joints, springs and forces", "damper")
    mass: Mass = entry("[t]", "50 g")
    directions: Literal["xyz", "xy", "xz", "yz", "x", "y", "z"] = entry(
        "directions in which it moves; it is held in the others", "xz", default="xyz"
    )

    @model_validator(mode="after")
    def _is_a_point(self) -> FurtherMass:
        if re.fullmatch(MODE, self.name) is not None:
            raise disagreement(
                f"{shown(self.name)}: the name of a mode; allowed: other names", "name"
            )
        return self


class StoredBody(Section):
    """A body that is reduced to a few points and its lowest modes."""

    kind: Literal["reduced"] = entry("a Craig-Bampton model with joints at its points", "reduced")
    file: Annotated[str, CaseFile((".h5", YAML), (SpecimensCase,), "specimens")] = entry(
        "body_1.h5 or body_2.h5 of a specimens run; or the specimens case itself, whose body is "
        "reduced first; its points are pad 1, pad 2, ... and ring 1, ring 2, ...",
        "specimens.yaml",
    )
    body: Annotated[int, Whole(1, 2)] | None = entry(
        "body of a specimens case: 1 below its pad, or 2 above", 2, default=None
    )


class JointedBody(Section, ABC):
    """A body with joints, masses and springs at its points."""

    also_filled_in: ClassVar[tuple[str, ...]] = ("driven", "body")

    joints: tuple[JointPlaces, ...] = entry("places of the joints", min_length=1)
    masses: tuple[AddedMass, ...] = entry("added masses, moving in x, y and z", default=())
    further_masses: tuple[FurtherMass, ...] = entry(
        "points with mass outside the body, such as a damper, held by joints and springs",
        default=(),
    )
    springs: tuple[AddedSpring, ...] = entry("added", default=())
    damping_ratio: DampingRatios = entry(f"without the joints, {OF_MODES}", 0.001)
    damping: Damping | None = entry("damping added to that of the modes", default=None)
    driven: Moved | None = entry(
        "points that share the force of the excitation evenly; none where the excitation of a "
        "steady vibration names its own",
        default=None,
    )
    seen: Moved = entry("points whose mean displacement is reported")

    @model_validator(mode="after")
    def _names_masses_once(self) -> JointedBody:
        names = [mass.name for mass in self.further_masses]
        for number, name in enumerate(names):
            if name in names[:number]:
                raise disagreement(
                    f"{shown(name)}: given twice; allowed: different names",
                    f"further_masses.{number}.name",
                )
        return self

    @property
    @abstractmethod
    def text(self) -> str:
        """Short description of the structure."""

    @property
    def driven_place(self) -> str:
        """Short description of the place where the force of an excitation acts."""
        driven = self.driven
        return "no place" if driven is None else f"{driven.points} along {driven.direction}"

    @property
    def added(self) -> str:
        """Short description of the places of joints, and of masses and springs that are added."""
        added = [f"{1e3 * added.mass:g} kg at {added.points}" for added in self.masses]
        added += [f"{1e3 * added.mass:g} kg as {added.name}" for added in self.further_masses]
        added += [
            f"{1e-3 * spring.stiffness:g} N/um at {spring.points} along {spring.direction}"
            for spring in self.springs
        ]
        return f"joints {joined(self.joints)}" + (f"; added: {', '.join(added)}" if added else "")

    def outline(self) -> list[tuple[str, str]]:
        """Return rows about the body itself."""
        return []


class ReducedBody(JointedBody, StoredBody):
    """A body on a few points and its lowest modes, with joints, masses and springs there."""

    @model_validator(mode="after")
    def _body_of_a_case(self) -> ReducedBody:
        of_a_case = self.file.endswith(YAML)
        if of_a_case != (self.body is not None):
            wrong = "missing" if of_a_case else f"{self.body}: given with a file of a single body"
            raise disagreement(f"{wrong}; allowed: with a case of specimens, 1 or 2", "body")
        return self

    @model_validator(mode="after")
    def _file_is_a_model(self) -> ReducedBody:
        if self.body is None:
            with at_entry("file"):
                self.stored()
        return self

    def stored(self) -> ReducedModel:
        """Return the model in a file that holds one. Raises InputFileError."""
        from fe_models.joints.reduction import load_reduced

        with open_hdf5(self.file):
            return load_reduced(Path(self.file))

    @property
    def text(self) -> str:
        return f"reduced body of {Path(self.file).name}, {self.added}"


class FrictionRig(Section):
    """Two masses in a row on two specimens, whose joint is a friction_contact at every node."""

    kind: Literal["friction_rig"] = entry("two reduced specimens in a rig", "friction_rig")
    specimens: Annotated[str, CaseFile((YAML,), (SpecimensCase,), "specimens")] = entry(
        "a case of specimens: bodies, form, materials, mesh and reduction are taken from it",
        "specimens_rig.yaml",
    )
    masses: tuple[Mass, Mass] = entry(
        "driven mass, and mass that holds the upper specimen [t]",
        ["21.152 kg", "1.189 kg"],
    )
    springs: tuple[Spring, Spring] = entry(
        "springs from the ground to the first mass, and on to the second [N/mm]",
        ["1.3469e3 N/mm", "273e3 N/mm"],
    )
    damping_ratio: DampingRatios = entry(f"with the contact open, {OF_MODES}", 0.001)
    damping: Damping | None = entry("damping added to that of the modes", default=None)
    target_distance: Length = entry(
        "distance of a laser's targets from the contact plane on each specimen [mm]",
        "1 mm",
        default=1.0,
    )
    sharing: Literal["even", "area"] = entry(
        "sharing of the joint's stiffness among the pairs of nodes: even, or by the area of each",
        "area",
        default="area",
    )

    @property
    def text(self) -> str:
        """Short description of the structure."""
        rig = _on_springs(self.masses, self.springs)
        return f"specimens of {Path(self.specimens).name} in a rig of {rig}"

    def outline(self) -> list[tuple[str, str]]:
        """Return rows about the specimens."""
        return outline_of(self.specimens, SpecimensCase, OF_SPECIMENS)


def _on_springs(masses: Sequence[float], springs: Sequence[float]) -> str:
    """Return a description of masses in a row, and of the springs that hold them."""
    stiff = ", ".join(f"{1e-3 * spring:.6g}" for spring in springs)
    return f"{', '.join(f'{1e3 * mass:g}' for mass in masses)} kg on springs of {stiff} N/µm"


def joined(joints: Sequence[JointPlaces]) -> str:
    """Return a description of the places of joints, with the laws of those that have their own."""
    parts = []
    for joint in joints:
        between = "at " + joint.points if joint.against is None else _between(joint)
        parts.append(between if joint.joint is None else f"{between} ({joint.joint.law})")
    return ", ".join(parts)


def _between(joint: JointPlaces) -> str:
    return f"between {joint.against} and {joint.points}"


def joints_of(structure: Section, shared: bool = True) -> tuple[JointPlaces, ...]:
    """Return the entries of joints of a structure, empty for specimens, which need none.

    If a law of the case is ``shared`` but no entry uses it, an entry is added: a joint between the
    last mass of a row and the ground.
    """
    if isinstance(structure, RowOfMasses):
        joints = structure.joints if isinstance(structure, Rig) else ()
        taken = any(joint.joint is None for joint in joints)
        last = () if taken or not shared else (RowJoint(points=f"m{len(structure.masses)}"),)
        return (*joints, *last)
    return structure.joints if isinstance(structure, JointedBody) else ()


def own_laws(structure: Section, shared: bool = True) -> tuple[VibrationLaw | None, ...]:
    """Return the law that each entry of joints has of its own; one None if no entry is needed."""
    if isinstance(structure, FrictionRig):
        return (None,)
    return tuple(places.joint for places in joints_of(structure, shared))


def joint_rows(
    shared: Joint | ElasticJoint | None, own: Sequence[Joint | ElasticJoint | None]
) -> list[tuple[str, str]]:
    """Return the laws of joints with their parameters, for an outline."""
    numbered = [(f"joint {number}", law) for number, law in enumerate(own, start=1)]
    every = [("joint", shared), *numbered]
    return [(name, f"{law.law}, {entries(law)}") for name, law in every if law is not None]


def refuse_own_joints(structure: Section) -> None:
    """Refuse laws of individual joints of a body whose contact wears."""
    if not isinstance(structure, JointedBody):
        return
    for number, law in enumerate(own_laws(structure)):
        if law is not None:
            raise disagreement(
                f"{law.law}: a law of its own; allowed: the contact that wears alone",
                f"structure.joints.{number}.joint",
            )


def structure_outline(structure: RowOfMasses | JointedBody | FrictionRig) -> list[tuple[str, str]]:
    """Return outline rows on the structure, and on the bodies that another case describes."""
    damping = damping_text(structure.damping_ratio, structure.damping)
    below = [] if isinstance(structure, RowOfMasses) else structure.outline()
    return [("structure", f"{structure.text}, {damping}"), *below]


def driven_place(structure: Section, mass: int | None) -> str:
    """Return a short description of the place where a force on a structure acts."""
    if isinstance(structure, JointedBody):
        return structure.driven_place
    return f"mass {mass or 1}"


def refuse_undriven(structure: Section) -> None:
    """Refuse a reduced body that does not state where a force acts."""
    if isinstance(structure, JointedBody) and structure.driven is None:
        raise disagreement(
            "missing; allowed: points and direction of the force", "structure.driven", "structure"
        )


def refuse_missing_mass(structure: Section, mass: int | None, key: str, otherwise: str) -> None:
    """Refuse the number of a driven mass that a structure does not have.

    ``otherwise`` is the text of the error for a structure that is not a row of masses.
    """
    if mass is None:
        return
    if not isinstance(structure, RowOfMasses):
        raise disagreement(f"{mass}: given with {otherwise}", key)
    count = len(structure.masses)
    if mass > count:
        raise disagreement(f"{mass}: no such mass; allowed: 1 to {count}", key)
