"""Bodies, contacts and supports of a user's mesh, as sections of a case."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
from pydantic import model_validator

from workflow.analyses.contact.surfaces import MeasuredSurfaces
from workflow.analyses.wear.case.evolution import EvolvingFriction
from workflow.analyses.wear.case.gaps import Gap
from workflow.analyses.wear.case.sections import Density, Laws, Solid, TwoBodies
from workflow.analyses.wear.case.worn_bodies import BodyWear, wearing
from workflow.analyses.wear.structures.mesh.load import Direction, Name
from workflow.analyses.wear.structures.mesh.temperatures import Expansion
from workflow.case.fields import ScalarOrList
from workflow.case.sections import FaceCells, Section, disagreement, entry

if TYPE_CHECKING:
    from fe_models import imported_structure as fe

Faces = Annotated[tuple[Name, ...], ScalarOrList()]


class MeshMaterial(Solid):
    """Isotropic linear elastic material, with a density where loads need it."""

    density: Density | None = entry(
        "mass per volume, for loads of rotation and acceleration [t/mm^3]",
        "4430 kg/m^3",
        default=None,
    )
    expansion: Expansion | None = entry(
        "linear thermal expansion, for loads of temperature [1/K]", "8.6e-6 1/K", default=None
    )


class OtherBody(Section):
    """A body in addition to body 1 and body 2."""

    name: Name = entry("name of the body in the file", "bolt")
    material: MeshMaterial = entry("material of the body")


class ContactFriction(EvolvingFriction):
    """Friction of one contact."""

    filled_in: ClassVar[bool] = False


class ContactWear(Laws, TwoBodies[BodyWear]):
    """Laws of the two bodies of a contact."""


class ContactPairSection(Section):
    """Two faces that meet; their meshes need not match."""

    name: Name = entry("name of the interface in all results", "pad")
    face_1: Faces = entry("boundary of body 1, or several that form one face", "disk_top")
    face_2: Faces = entry("boundary of body 2, or several", "blade_foot")
    x: Direction = entry(
        "direction in which body 2 would slide under the load, x of the interface frame [1]",
        [1.0, 0.0, 0.0],
    )
    gap: Gap | None = entry(
        "gap of the unloaded bodies, added to that of their meshes", default=None
    )
    surfaces: MeasuredSurfaces | None = entry(
        "measured surfaces, added to gap and meshes: rows along x of the contact, about the "
        "middle of its grid",
        default=None,
    )
    bodies: tuple[Name, Name] | None = entry(
        "bodies of this contact; without it body 1 and body 2 of the structure",
        ["disk", "blade"],
        default=None,
    )
    friction: ContactFriction | None = entry(
        "friction of this contact; without it that of all", default=None
    )
    wear: ContactWear | None = entry(
        "wear laws of this contact's bodies; without it those of all", default=None
    )
    grid: FaceCells | None = entry(
        "number of cells along x, along y of this contact; without it contact.grid",
        [64, 64],
        default=None,
    )

    @model_validator(mode="after")
    def _has_two_bodies(self) -> ContactPairSection:
        if self.bodies is not None and self.bodies[0] == self.bodies[1]:
            raise disagreement("the same body twice; allowed: two bodies", "bodies")
        return self

    @model_validator(mode="after")
    def _has_faces(self) -> ContactPairSection:
        for key in ("face_1", "face_2"):
            names = getattr(self, key)
            if not names:
                raise disagreement("none; allowed: one boundary or several", key)
            if len(set(names)) < len(names):
                raise disagreement("a boundary twice; allowed: each once", key)
        return self

    def described(self, bodies: tuple[str, str]) -> fe.ContactPair:
        """Return the contact between ``bodies`` 1 and 2 as the structure takes it."""
        from fe_models.imported_structure import ContactPair as Pair

        return Pair(self.name, bodies, self.face_1, self.face_2, np.array(self.x))


def own_terms(pair: ContactPairSection) -> str:
    """Return the settings specific to a contact, in words; empty if there are none."""
    parts = []
    if pair.bodies is not None:
        parts.append(f"between {pair.bodies[0]} and {pair.bodies[1]}")
    if pair.friction is not None:
        changes = "" if pair.friction.evolution is None else ", changing with dissipated energy"
        parts.append(f"friction {pair.friction.coefficient:g}{changes}")
    if pair.wear is not None:
        bodies = {"body_1": pair.wear.body_1, "body_2": pair.wear.body_2}
        parts += [f"{title} {text}" for title, text in wearing(bodies)]
    if pair.grid is not None:
        line = pair.grid[1] == 1
        parts.append(f"{pair.grid[0]} {'cells' if line else f'x {pair.grid[1]} cells'}")
    return f"{pair.name}: {', '.join(parts)}" if parts else ""


class SupportSection(Section):
    """Displacements held at a boundary or a node set of any body."""

    group: Name = entry("boundary or node set", "disk_base")
    hold: Literal[
        "all", "normal", "x", "y", "z", "xy", "xz", "yz", "mean_x", "mean_y", "mean_z"
    ] = entry(
        "all, normal, global axes such as xz, or mean_x: only the mean of a boundary along x", "all"
    )

    def described(self) -> fe.Support:
        """Return the support as the structure takes it."""
        from fe_models.imported_structure import Support as Held

        return Held(self.group, "xyz" if self.hold == "all" else self.hold)
