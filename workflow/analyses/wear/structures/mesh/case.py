"""A wear case whose structure is a mesh or CAD file of the user's."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import model_validator

from fe_models.mesh import MeshError, StructureMesh
from workflow.analyses.wear.case.base import FiniteElementCase, check_interface_name
from workflow.analyses.wear.case.gaps import Gap, HeightsGap, check_gap
from workflow.analyses.wear.case.sections import (
    Density,
    Share,
    Solid,
    TwoBodies,
    Wear,
    check_rows,
    check_shares,
)
from workflow.analyses.wear.structures.mesh.faces import (
    face_size,
    hardly_met,
    outline_of,
    planes_of_symmetry,
)
from workflow.analyses.wear.structures.mesh.load import Component, Factor, Name
from workflow.analyses.wear.structures.mesh.loads import (
    AccelerationLoad,
    DisplacementLoad,
    Load,
    RotationLoad,
)
from workflow.analyses.wear.structures.mesh.temperatures import Expansion, check_temperatures
from workflow.case.fields import AUTO, Auto, File, OrAlone, OrAuto, Whole
from workflow.case.input_files import read_heights
from workflow.case.plain import counted
from workflow.case.sections import Length, Section, Title, disagreement, entry

if TYPE_CHECKING:
    from fe_models import imported_structure as fe
    from fe_models.geometry.imported import ImportedMesh

# Files that hold shapes and no mesh.
CAD = (".step", ".stp", ".brep")
# What the readers take; other endings are refused with advice.
ENDINGS = (
    ".msh", ".inp", ".step", ".stp", ".brep", ".vtu", ".vtk", ".xdmf", ".med", ".bdf", ".mesh",
    ".nas", ".cdb", ".odb", ".cae", ".db", ".igs", ".iges",
)  # fmt: skip

# Heights on both sides of a plane of symmetry may differ by this share of their range: files round.
MIRRORED = 1e-6

Stamp = tuple[int, int]


Faces = Annotated[tuple[Name, ...], OrAlone()]


class ContactPair(Section):
    """Two faces that meet; their meshes need not match."""

    name: Name = entry("of the interface in all results", "pad")
    face_1: Faces = entry("boundary of body 1, or several that are one face together", "disk_top")
    face_2: Faces = entry("boundary of body 2, or several", "blade_foot")
    x: tuple[Component, Component, Component] = entry(
        "direction in which body 2 would slide under the load; x of the interface frame [1]",
        [1.0, 0.0, 0.0],
    )
    gap: Gap | None = entry("of the unloaded bodies, beside that of their meshes", default=None)

    @model_validator(mode="after")
    def _has_direction(self) -> ContactPair:
        if not any(self.x):
            raise disagreement("no direction; allowed: one that is not zero", "x")
        return self

    @model_validator(mode="after")
    def _has_faces(self) -> ContactPair:
        for key in ("face_1", "face_2"):
            names = getattr(self, key)
            if not names:
                raise disagreement("none; allowed: a boundary, or several", key)
            if len(set(names)) < len(names):
                raise disagreement("a boundary twice; allowed: each once", key)
        return self

    def described(self, bodies: tuple[str, str]) -> fe.ContactPair:
        """As the structure takes it, of body 1 and body 2."""
        from fe_models.imported_structure import ContactPair as Pair

        return Pair(self.name, bodies, self.face_1, self.face_2, np.array(self.x))


class Support(Section):
    """Displacements held at a boundary or a node set, of whichever body has it."""

    group: Name = entry("boundary or node set", "disk_base")
    hold: Literal[
        "all", "normal", "x", "y", "z", "xy", "xz", "yz", "mean_x", "mean_y", "mean_z"
    ] = entry(
        "all, normal, global axes such as xz, or mean_x: only the mean of a boundary along x", "all"
    )

    def described(self) -> fe.Support:
        """As the structure takes it."""
        from fe_models.imported_structure import Support as Held

        return Held(self.group, "xyz" if self.hold == "all" else self.hold)


class ImportedStructure(Section):
    """Two bodies from a file; lengths in mm.

    Tetrahedra and hexahedra, or triangles and quadrilaterals in plane strain: coordinates of a
    plane mesh are called X and Z.
    """

    refused: ClassVar[Mapping[str, str]] = {
        "size": "of the elements; allowed: as mesh.size",
        "order": "of the elements; allowed: as mesh.order",
    }

    kind: Literal["mesh"] = entry("what the structure is", "mesh")
    file: Annotated[str, File(ENDINGS)] = entry(
        "mesh (.msh, .inp, .vtu, ...) or CAD (.step, .brep)", "joint.msh"
    )
    body_1: Name = entry("name in the file of the lower, fixed body", "disk")
    body_2: Name = entry("name in the file of the upper, moving body", "blade")
    contacts: tuple[ContactPair, ...] = entry("faces that meet", min_length=1)
    supports: tuple[Support, ...] = entry("what is held", min_length=1)
    loads: tuple[Load, ...] = entry("what is applied", min_length=1)

    @model_validator(mode="after")
    def _names_differ(self) -> ImportedStructure:
        names = [pair.name for pair in self.contacts]
        if len(set(names)) < len(names):
            raise disagreement("two contacts of one name; allowed: names that differ", "contacts")
        for index, name in enumerate(names):
            check_interface_name(name, f"contacts.{index}.name")
        if self.body_1 == self.body_2:
            raise disagreement("the same body twice; allowed: two bodies", "body_2", "body_1")
        return self

    def read(self, size: float | None) -> ImportedMesh:
        """Everything in the file, read once, CAD by elements of a ``size``. Raises MeshError."""
        return _read(self.file, size, _stamp(self.file))

    def mesh(self, size: float | None) -> StructureMesh:
        """The two bodies and their interfaces, made once. Raises MeshError."""
        return _joined(self, size, _stamp(self.file))


# Reading or meshing takes seconds for every 100 000 elements: a check and the run that follows it
# share what they find.
@lru_cache(maxsize=1)
def _read(file: str, size: float | None, stamp: Stamp) -> ImportedMesh:
    from fe_models.geometry.imported import read_bodies

    return read_bodies(Path(file), size)


@lru_cache(maxsize=1)
def _joined(structure: ImportedStructure, size: float | None, stamp: Stamp) -> StructureMesh:
    from fe_models.imported_structure import imported_mesh

    bodies = structure.body_1, structure.body_2
    pairs = [pair.described(bodies) for pair in structure.contacts]
    supports = [support.described() for support in structure.supports]
    return imported_mesh(structure.read(size), bodies, pairs, supports)


def _stamp(file: str) -> Stamp:
    """Time and size by which a file that has changed is known."""
    state = Path(file).stat()
    return state.st_mtime_ns, state.st_size


class CycleOfMix(Section):
    """One of several cycles, in which every load has its own factor."""

    share: Share = entry("of all cycles; the shares add up to 1 [1]", "100 %")
    factors: tuple[Factor, ...] = entry(
        "of every load, in the order of structure.loads; of the speed for a rotation [1]", [1.0]
    )


class Legs(Section):
    """Every load goes linearly from leg to leg; the last legs are one cycle."""

    increments: Annotated[tuple[Annotated[int, Whole(1, 10_000)], ...] | Auto, OrAuto()] = entry(
        "of each leg; auto: as many as leave no more than wear.tolerance", [8, 14]
    )
    cycle_from: Annotated[int, Whole(1, 1000)] = entry(
        "first leg of the cycle; those before it are passed once", 1, default=1
    )
    peak_leg: Annotated[int, Whole(1, 1000)] = entry(
        "leg of the cycle at whose end the load peaks: stress is shown there", 1, default=1
    )
    mix: tuple[CycleOfMix, ...] = entry(
        "cycles that take turns, all on these legs, the one to show first; without it there is one",
        default=(),
    )

    @model_validator(mode="after")
    def _are_some(self) -> Legs:
        if not self.increments:
            raise disagreement("none; allowed: one or more", "increments")
        if self.mix:
            check_shares([cycle.share for cycle in self.mix])
        return self

    @property
    def legs(self) -> tuple[int, ...]:
        """Increments of all legs, once they are chosen."""
        assert isinstance(self.increments, tuple)
        return self.increments

    def mixed(self, loads: int) -> list[tuple[tuple[float, ...], float]]:
        """Factors of all ``loads``, so many, and share of every cycle."""
        return [(cycle.factors, cycle.share) for cycle in self.mix] or [((1.0,) * loads, 1.0)]


class Elements(Section):
    """Elements of the structure: those of the file, or made for its shapes."""

    size: Length | None = entry("for CAD files only [mm]", "2 mm", default=None)
    order: Literal[1, 2] = entry("of the elements, 1 or 2", 1, default=1)


class MeshMaterial(Solid):
    """Isotropic linear elastic material, with a mass where that counts."""

    density: Density | None = entry(
        "mass per volume, for loads of rotation and acceleration [t/mm^3]",
        "4430 kg/m^3",
        default=None,
    )
    expansion: Expansion | None = entry(
        "linear thermal, for loads of temperature [1/K]", "8.6e-6 1/K", default=None
    )


class MeshMaterials(TwoBodies[MeshMaterial]):
    """The two bodies in contact."""


class MeshCase(FiniteElementCase):
    """Bodies from a file under loads of the user's."""

    about: ClassVar[str] = "two bodies of your own mesh or CAD file under your loads"

    title: Title = entry("one line", "Two bodies of a mesh file")
    structure: ImportedStructure = entry("bodies, contacts, supports and loads, named by groups")
    materials: MeshMaterials = entry("the two bodies in contact")
    load_path: Legs = entry("one cycle")
    mesh: Elements = entry("finite elements of the structure", default=Elements())
    wear: Wear = entry("law, length of the run and step")

    @property
    def cores(self) -> int:
        return len(self.structure.contacts)

    @property
    def legs(self) -> tuple[int, ...]:
        before = self.load_path.cycle_from - 1
        if self.load_path.increments == AUTO:
            return (0,) * (len(self.structure.loads[0].path) - before)
        return self.load_path.legs[before:]

    def divided(self, legs: Sequence[int]) -> dict[str, Any]:
        """Of legs before the cycle, which are passed once, each has as many as the finest."""
        before = (max(legs),) * (self.load_path.cycle_from - 1)
        return {"load_path.increments": (*before, *legs)}

    def loads_outline(self) -> list[tuple[str, str]]:
        structure, path = self.structure, self.load_path
        cycles = f", {len(path.mix)} cycles mixed" if path.mix else ""
        before = f", those before it in {path.cycle_from - 1} legs" if path.cycle_from > 1 else ""
        mesh = structure.mesh(self.mesh.size)
        bodies = [f"{b.name} of {b.mesh.nvertices} nodes" for b in mesh.bodies]
        return [
            ("structure", f"{Path(structure.file).name}: {' and '.join(bodies)}"),
            *(
                ("face", outline_of(mesh, interface, pair.gap))
                for interface, pair in zip(mesh.interfaces, structure.contacts, strict=True)
            ),
            *(("held", f"{support.group}, {support.hold}") for support in structure.supports),
            ("load path", f"{self.increments_outline} in {len(self.legs)} legs{before}{cycles}"),
            *(("load", load.text) for load in structure.loads),
        ]

    def doubts(self) -> Iterator[str]:
        """What the file says besides its mesh; faces that hardly meet, as parts of a face do."""
        yield from super().doubts()
        if left := self.structure.read(self.mesh.size).left:
            yield (
                f"structure.file: {counted(len(left), 'keyword')} with loads, supports, contact or "
                f"materials not taken over, the first {left[0]}; all of them: fretscale describe"
            )
        mesh = self.structure.mesh(self.mesh.size)
        for index, interface in enumerate(mesh.interfaces):
            if doubt := hardly_met(mesh, interface):
                yield f"structure.contacts.{index}: {doubt}"

    @model_validator(mode="after")
    def _size_is_for_cad(self) -> MeshCase:
        shapes, size = Path(self.structure.file).suffix.lower() in CAD, self.mesh.size
        if shapes and size is None:
            raise disagreement("missing; allowed: a size, to mesh a CAD file with", "mesh.size")
        if not shapes and size is not None:
            raise disagreement(
                f"{size:g} mm: the file is a mesh already; allowed: none, or a file of "
                f"{', '.join(CAD)}",
                "mesh.size",
            )
        return self

    @model_validator(mode="after")
    def _paths_fit_legs(self) -> MeshCase:
        path = self.load_path
        legs = len(self.structure.loads[0].path if path.increments == AUTO else path.increments)
        for index, load in enumerate(self.structure.loads):
            if len(load.path) != legs:
                raise disagreement(
                    f"{len(load.path)} factors for {legs} legs; allowed: one for each leg",
                    f"structure.loads.{index}.path",
                )
        if not path.cycle_from <= path.peak_leg <= legs:
            raise disagreement(
                f"{path.peak_leg}: no leg of the cycle; allowed: {path.cycle_from} to {legs}",
                *("load_path.peak_leg", "load_path.cycle_from"),
            )
        loads = len(self.structure.loads)
        for index, cycle in enumerate(self.load_path.mix):
            if len(cycle.factors) != loads:
                raise disagreement(
                    f"{len(cycle.factors)} factors for {loads} loads; allowed: one for each load",
                    f"load_path.mix.{index}.factors",
                )
        return self

    @model_validator(mode="after")
    def _mass_is_known(self) -> MeshCase:
        for load in self.structure.loads:
            if not isinstance(load, RotationLoad | AccelerationLoad):
                continue
            for body in ("body_1", "body_2"):
                if getattr(self.materials, body).density is None:
                    raise disagreement(
                        f"missing, and a load of {load.kind} acts on the mass; allowed: mass per "
                        "volume [t/mm^3], such as 4430 kg/m^3",
                        f"materials.{body}.density",
                        f"materials.{body}",
                    )
        return self

    @model_validator(mode="after")
    def _expansion_is_known(self) -> MeshCase:
        structure, materials = self.structure, self.materials
        named = {
            "body_1": (structure.body_1, materials.body_1.expansion),
            "body_2": (structure.body_2, materials.body_2.expansion),
        }
        check_temperatures(structure.loads, named, self.nonlinearity)
        return self

    @model_validator(mode="after")
    def _fits_the_file(self) -> MeshCase:
        """Every name is in the file, the faces meet and body 1 is held."""
        structure = self.structure
        with _pointing_at("structure.file"):
            imported = structure.read(self.mesh.size)
        self._check_names(imported)
        self._check_contacts()
        self._check_supports(imported)
        return self

    def _check_names(self, imported: ImportedMesh) -> None:
        from fe_models.imported_structure import (
            check_load,
            check_support,
            contact_facets,
            named_body,
        )

        structure = self.structure
        with _pointing_at("structure.body_1"):
            body_1 = named_body(imported, structure.body_1)
        with _pointing_at("structure.body_2"):
            body_2 = named_body(imported, structure.body_2)
        for index, pair in enumerate(structure.contacts):
            for key, body in (("face_1", body_1), ("face_2", body_2)):
                with _pointing_at(f"structure.contacts.{index}.{key}"):
                    for name in getattr(pair, key):
                        contact_facets(imported, body, name)
        for index, support in enumerate(structure.supports):
            with _pointing_at(f"structure.supports.{index}.group"):
                check_support(imported, (body_1, body_2), support.described())
        for index, load in enumerate(structure.loads):
            suffix = ".group" if hasattr(load, "group") else ""
            with _pointing_at(f"structure.loads.{index}{suffix}"):
                check_load(imported, (body_1, body_2), load.described())

    def _check_contacts(self) -> None:
        """Make the interfaces; where they cannot be, find the pair that is at fault."""
        structure, size = self.structure, self.mesh.size
        try:
            interfaces = structure.mesh(size).interfaces
        except MeshError:
            for index, pair in enumerate(structure.contacts):
                with _pointing_at(f"structure.contacts.{index}"):
                    structure.model_copy(update={"contacts": (pair,)}).mesh(size)
            raise
        for index, (pair, face) in enumerate(zip(structure.contacts, interfaces, strict=True)):
            check_rows(self.contact, face.line)
            if pair.gap is not None:
                cells = self.contact.grid[0], 1 if face.line else self.contact.grid[1]
                key = f"structure.contacts.{index}.gap"
                check_gap(pair.gap, face_size(face), cells, face.line, key)
                _check_mirrored(pair.gap, face.planes, key)

    def _check_supports(self, imported: ImportedMesh) -> None:
        """Build what holds the bodies, on elements of order 1 and without forces."""
        from fe_models.imported_structure import imported_structure

        structure = self.structure
        supports = [support.described() for support in structure.supports]
        imposed = [
            load.described() for load in structure.loads if isinstance(load, DisplacementLoad)
        ]
        materials = self.material(1), self.material(2)
        with _pointing_at("structure.supports"):
            mesh = structure.mesh(self.mesh.size)
            made = imported_structure(mesh, imported, materials, supports, imposed, 1)
        slices = [name for name, share in made.held_faces.items() if share == 1.0]
        if slices and made.dimension == 3:
            raise disagreement(
                f"all nodes of {slices[0]} are held along it, as in a slice in plane strain, and "
                "its half-space would be a strip as wide as the slice; allowed: the section as a "
                "plane mesh",
                "structure.supports",
            )


def _check_mirrored(gap: Gap, planes: Sequence[int], key: str) -> None:
    """Refuse heights that are not their own image across the ``planes`` that cut their face."""
    if not isinstance(gap, HeightsGap):
        return
    heights = read_heights(gap.file)
    for axis in planes:
        apart = np.abs(heights - np.flip(heights, axis)).max()
        if apart > MIRRORED * np.ptp(heights):
            raise disagreement(
                f"{gap.file}: not the same on both sides of {planes_of_symmetry([axis])}, by up to "
                f"{apart:.3g} mm; allowed: heights that are, over the whole face, or a mesh of it",
                key,
            )


@contextmanager
def _pointing_at(key: str) -> Iterator[None]:
    """Say of a mesh that cannot be used which entry asks for it."""
    try:
        yield
    except MeshError as error:
        raise disagreement(str(error), key) from error
