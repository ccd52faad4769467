"""A wear case whose structure is a mesh or CAD file of the user."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

from pydantic import model_validator

from fe_models.meshes.structure_mesh import MeshError, StructureMesh
from fe_models.readers.endings import CAD
from sa_solver.types import Grid
from workflow.analyses.wear.case.base import (
    ContactTerms,
    FiniteElementCase,
    check_interface_name,
)
from workflow.analyses.wear.case.gaps import check_gap
from workflow.analyses.wear.case.scanned import ScannedFace
from workflow.analyses.wear.case.sections import (
    TwoBodies,
    WearSection,
    check_rows,
)
from workflow.analyses.wear.structures.mesh.contacts import (
    ContactPairSection,
    MeshMaterial,
    OtherBody,
    SupportSection,
    own_terms,
)
from workflow.analyses.wear.structures.mesh.cyclic import CyclicCuts, check_sector
from workflow.analyses.wear.structures.mesh.elements import (
    apart,
    elements_outline,
    folded_elements,
)
from workflow.analyses.wear.structures.mesh.faces import (
    check_mirrored,
    hardly_met,
    outline_of,
)
from workflow.analyses.wear.structures.mesh.legs import Legs
from workflow.analyses.wear.structures.mesh.load import Name
from workflow.analyses.wear.structures.mesh.loads import (
    AccelerationLoad,
    Load,
    RotationLoad,
)
from workflow.analyses.wear.structures.mesh.mesh_file import (
    LengthName,
    MeshFile,
    lengths_outline,
    size_warnings,
)
from workflow.analyses.wear.structures.mesh.pretension import check_bolts
from workflow.analyses.wear.structures.mesh.temperatures import check_temperatures
from workflow.case.changing import changed
from workflow.case.fields import AUTO
from workflow.case.sections import Length, Section, Title, disagreement, entry
from workflow.case.text.plain import body_text, counted, listed
from workflow.messages.warning_kinds import Notice, WarningKind
from workflow.models.faces import face_size

if TYPE_CHECKING:
    from fe_models.geometry.imported import ImportedMesh

Stamp = tuple[int, int]


class ImportedStructure(Section):
    """Two or more bodies from a file.

    Elements are tetrahedra and hexahedra, or triangles and quadrilaterals in plane strain. The
    coordinates of a plane mesh are called X and Z.
    """

    refused: ClassVar[Mapping[str, str]] = {
        "size": "of the elements; allowed: as mesh.size",
        "order": "of the elements; allowed: as mesh.order",
    }

    kind: Literal["mesh"] = entry("kind of structure", "mesh")
    file: Annotated[str, MeshFile()] = entry(
        "mesh (.msh, .inp, .vtu, ...) or CAD (.step, .brep)", "joint.msh"
    )
    length_unit: LengthName | None = entry(
        "length unit of the file: mm, um, cm, m, in or ft; without it that of the file, or mm",
        "m",
        default=None,
    )
    body_1: Name = entry("name in the file of the lower, fixed body", "disk")
    body_2: Name = entry("name in the file of the upper, moving body", "blade")
    other_bodies: tuple[OtherBody, ...] = entry("bodies other than body 1 and body 2", default=())
    contacts: tuple[ContactPairSection, ...] = entry("pairs of faces in contact", min_length=1)
    supports: tuple[SupportSection, ...] = entry("held boundaries", min_length=1)
    loads: tuple[Load, ...] = entry("applied loads", min_length=1)
    cyclic: tuple[CyclicCuts, ...] = entry(
        "cuts of bodies that are one sector of a wheel, tied to each other", default=()
    )

    @model_validator(mode="after")
    def _names_differ(self) -> ImportedStructure:
        names = [pair.name for pair in self.contacts]
        if len(set(names)) < len(names):
            raise disagreement(
                "two contacts of the same name; allowed: different names", "contacts"
            )
        for index, name in enumerate(names):
            check_interface_name(name, f"contacts.{index}.name")
        if self.body_1 == self.body_2:
            raise disagreement("the same body twice; allowed: two bodies", "body_2", "body_1")
        for index, body in enumerate(self.other_bodies):
            if body.name in self.names[: 2 + index]:
                raise disagreement(
                    f"{body.name} twice; allowed: each body once", f"other_bodies.{index}.name"
                )
        return self

    @model_validator(mode="after")
    def _contacts_are_of_bodies(self) -> ImportedStructure:
        for index, pair in enumerate(self.contacts):
            for name in pair.bodies or ():
                if name not in self.names:
                    raise disagreement(
                        f"no body {name}; allowed: {', '.join(self.names)}, or list it in "
                        "structure.other_bodies",
                        f"contacts.{index}.bodies",
                    )
        touched = {name for pair in self.contacts for name in self.bodies_of(pair)}
        for index, body in enumerate(self.names):
            if body not in touched:
                key = f"other_bodies.{index - 2}.name" if index > 1 else f"body_{index + 1}"
                raise disagreement(
                    f"{body}: in no contact; allowed: bodies in contact with others", key
                )
        return self

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all bodies in the file, in the order of the mesh."""
        return self.body_1, self.body_2, *(body.name for body in self.other_bodies)

    def bodies_of(self, pair: ContactPairSection) -> tuple[str, str]:
        """Return the names of body 1 and body 2 of a contact."""
        return pair.bodies or (self.body_1, self.body_2)

    def read(self, size: float | None) -> ImportedMesh:
        """Return the cached contents of the file; CAD is meshed with ``size``. Raises MeshError."""
        return _read(self.file, size, self.length_unit, _stamp(self.file))

    def mesh(self, size: float | None, order: int = 1) -> StructureMesh:
        """Return the cached mesh with interfaces, for elements of ``order``. Raises MeshError."""
        made = _joined if order == 1 else _curved
        return made(self, size, _stamp(self.file))


# Reading or meshing takes seconds for every 100 000 elements, so that a check and the run that
# follows it share the cached results.
@lru_cache(maxsize=1)
def _read(file: str, size: float | None, unit: str | None, stamp: Stamp) -> ImportedMesh:
    from fe_models.geometry.imported import read_bodies

    return read_bodies(Path(file), size, unit)


@lru_cache(maxsize=1)
def _joined(structure: ImportedStructure, size: float | None, stamp: Stamp) -> StructureMesh:
    from fe_models.imported_structure import imported_mesh

    pairs = [pair.described(structure.bodies_of(pair)) for pair in structure.contacts]
    supports = [support.described() for support in structure.supports]
    return imported_mesh(structure.read(size), structure.names, pairs, supports)


@lru_cache(maxsize=1)
def _curved(structure: ImportedStructure, size: float | None, stamp: Stamp) -> StructureMesh:
    from fe_models.meshes.second_order import with_midsides

    return with_midsides(_joined(structure, size, stamp), structure.read(size))


def _stamp(file: str) -> Stamp:
    """Return time and size of a file, by which a change is recognised."""
    state = Path(file).stat()
    return state.st_mtime_ns, state.st_size


class Elements(Section):
    """Elements of the structure: those of a mesh file, or generated for CAD shapes."""

    size: Length | None = entry(
        "size of the elements, for CAD files only [mm]", "2 mm", default=None
    )
    order: Literal[1, 2] = entry(
        "order of the elements; 2 uses the file's midside nodes", 1, default=1
    )


class MeshMaterials(TwoBodies[MeshMaterial]):
    """Body 1 and body 2."""


class MeshCase(FiniteElementCase):
    """Bodies from a file under user-defined loads."""

    about: ClassVar[str] = "two bodies of your own mesh or CAD file under your loads"

    title: Title = entry("one line", "Two bodies of a mesh file")
    structure: ImportedStructure = entry("bodies, contacts, supports and loads, named by groups")
    materials: MeshMaterials = entry("body 1 and body 2")
    load_path: Legs = entry("one cycle")
    mesh: Elements = entry("finite elements of the structure", default=Elements())
    wear: WearSection = entry("law, length of the run and step")

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
        """Return the entries for increments; legs before the cycle, passed once, get the most."""
        before = (max(legs),) * (self.load_path.cycle_from - 1)
        return {"load_path.increments": (*before, *legs)}

    @property
    def loads_in_words(self) -> str:
        return "; ".join(load.sized for load in self.structure.loads)

    def loads_outline(self) -> list[tuple[str, str]]:
        structure, path = self.structure, self.load_path
        cycles = f", {len(path.mix)} cycles mixed" if path.mix else ""
        before = f", the first {path.cycle_from - 1} legs run once" if path.cycle_from > 1 else ""
        imported = structure.read(self.mesh.size)
        mesh = structure.mesh(self.mesh.size, self.mesh.order)
        bodies = [f"{b.name} of {b.mesh.nvertices} nodes" for b in mesh.bodies]
        return [
            ("structure", f"{Path(structure.file).name}: {listed(bodies)}"),
            ("lengths", lengths_outline(imported, structure.names)),
            *(("elements", text) for text in elements_outline(mesh, imported, self.mesh.order)),
            *(
                ("face", outline_of(mesh, interface, pair.gap))
                for interface, pair in zip(mesh.interfaces, structure.contacts, strict=True)
            ),
            *(row for face in self.scanned() for row in face.outline()),
            *(
                ("material", f"{body.name}: {body_text(body.material)}")
                for body in structure.other_bodies
            ),
            *(("contact", text) for pair in structure.contacts if (text := own_terms(pair))),
            *(("held", f"{support.group}, {support.hold}") for support in structure.supports),
            *(("sector", cuts.outline(mesh)) for cuts in structure.cyclic),
            ("load path", f"{self.increments_outline} in {len(self.legs)} legs{before}{cycles}"),
            *(("load", load.text) for load in structure.loads),
        ]

    def plausibility_warnings(self) -> Iterator[Notice]:
        """Yield plausibility warnings about file, lengths, elements and contacts."""
        yield from super().plausibility_warnings()
        imported = self.structure.read(self.mesh.size)
        if left := imported.unused:
            yield Notice(
                WarningKind.UNUSED_CONTENT,
                f"structure.file: {counted(len(left), 'line')} with loads, supports, contacts or "
                f"materials not used, the first is {left[0]}; fretscale describe lists all, and "
                "--case writes them as a case",
            )
        for remark in imported.remarks:
            yield Notice(WarningKind.READER_REMARK, f"structure.file: {remark}")
        yield from size_warnings(imported, self.solids, self.structure.loads)
        mesh = self.structure.mesh(self.mesh.size, self.mesh.order)
        for kind, text in folded_elements(mesh, imported):
            yield Notice(kind, f"mesh.order: {text}")
        for index, interface in enumerate(mesh.interfaces):
            for kind, text in filter(None, (hardly_met(mesh, interface), apart(mesh, interface))):
                yield Notice(kind, f"structure.contacts.{index}: {text}")
        yield from self.surface_warnings()

    @model_validator(mode="after")
    def _size_is_for_cad(self) -> MeshCase:
        shapes, size = Path(self.structure.file).suffix.lower() in CAD, self.mesh.size
        if shapes and size is None:
            raise disagreement("missing; allowed: an element size for the CAD file", "mesh.size")
        if not shapes and size is not None:
            raise disagreement(
                f"{size:g} mm: the file already is a mesh; allowed: no size, or a file of "
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
    def _is_linear_with_others(self) -> MeshCase:
        asked = self.nonlinearity.asked
        if asked and self.structure.other_bodies:
            raise disagreement(
                "only for two bodies, the first of them held; allowed: leave it out, or no "
                "structure.other_bodies",
                *(f"nonlinearity.{key}" for key in asked),
            )
        return self

    @model_validator(mode="after")
    def _mass_is_known(self) -> MeshCase:
        for load in self.structure.loads:
            if not isinstance(load, RotationLoad | AccelerationLoad):
                continue
            for key, (_, solid) in self._keyed_solids.items():
                if solid.density is None:
                    raise disagreement(
                        f"missing, but a load of {load.kind} acts on the mass; allowed: mass per "
                        "volume [t/mm^3], such as 4430 kg/m^3",
                        f"{key}.density",
                        key,
                    )
        return self

    @property
    def _keyed_solids(self) -> dict[str, tuple[str, MeshMaterial]]:
        """Names and materials of all bodies by the case entry of the material."""
        keys = ["materials.body_1", "materials.body_2"]
        others = range(len(self.structure.other_bodies))
        keys += [f"structure.other_bodies.{index}.material" for index in others]
        return dict(zip(keys, self.solids.items(), strict=True))

    @property
    def solids(self) -> dict[str, MeshMaterial]:
        """Materials of all bodies by name, in the order of the mesh."""
        structure, materials = self.structure, self.materials
        of_two = {structure.body_1: materials.body_1, structure.body_2: materials.body_2}
        return of_two | {body.name: body.material for body in structure.other_bodies}

    def terms(self, name: str) -> ContactTerms:
        (pair,) = (pair for pair in self.structure.contacts if pair.name == name)
        bodies, wear = self.structure.bodies_of(pair), pair.wear or self.wear
        return ContactTerms(
            materials=(self.solids[bodies[0]].elastic(), self.solids[bodies[1]].elastic()),
            laws=(wear.body_1, wear.body_2),
            friction=pair.friction or self.friction,
            grid=pair.grid or self.contact.grid,
        )

    def scanned(self) -> Iterator[ScannedFace]:
        faces = self.structure.mesh(self.mesh.size, self.mesh.order).interfaces
        for index, (pair, face) in enumerate(zip(self.structure.contacts, faces, strict=True)):
            if pair.surfaces is not None:
                grid = Grid.over(face_size(face), self.terms(pair.name).grid, face.line)
                key = f"structure.contacts.{index}.surfaces"
                yield ScannedFace(pair.name, key, pair.surfaces, grid, face)

    @property
    def contact_names(self) -> tuple[str, ...]:
        return tuple(pair.name for pair in self.structure.contacts)

    def on_one_grid(self) -> Self:
        contacts = tuple(p.model_copy(update={"grid": None}) for p in self.structure.contacts)
        return changed(self, {"structure.contacts": contacts})

    @model_validator(mode="after")
    def _strains_are_known(self) -> MeshCase:
        known = {key: (name, b.expansion) for key, (name, b) in self._keyed_solids.items()}
        check_temperatures(self.structure.loads, known, self.nonlinearity, self.mesh.size)
        check_bolts(self.structure.loads, self.load_path, self.nonlinearity)
        return self

    @model_validator(mode="after")
    def _fits_the_file(self) -> MeshCase:
        """Refuse names that are not in the file, faces that do not meet and a body 1 not held."""
        structure = self.structure
        with _pointing_at("structure.file"):
            imported = structure.read(self.mesh.size)
        self._check_names(imported)
        self._check_contacts()
        mesh = structure.mesh(self.mesh.size)
        check_sector(structure, mesh, imported.node_numbers, _pointing_at)
        self._check_supports(imported)
        with _pointing_at("mesh.order"):
            structure.mesh(self.mesh.size, self.mesh.order)
        return self

    def _check_names(self, imported: ImportedMesh) -> None:
        from fe_models.imported_structure import (
            check_load,
            check_support,
            contact_facets,
            named_body,
        )

        structure = self.structure
        keys = "body_1", "body_2", *(f"other_bodies.{k}.name" for k in range(len(self.solids) - 2))
        bodies = {}
        for key, name in zip(keys, structure.names, strict=True):
            with _pointing_at(f"structure.{key}"):
                bodies[name] = named_body(imported, name)
        for index, pair in enumerate(structure.contacts):
            for key, body in zip(("face_1", "face_2"), structure.bodies_of(pair), strict=True):
                with _pointing_at(f"structure.contacts.{index}.{key}"):
                    for name in getattr(pair, key):
                        contact_facets(imported, bodies[body], name)
        every = list(bodies.values())
        for index, support in enumerate(structure.supports):
            with _pointing_at(f"structure.supports.{index}.group"):
                check_support(imported, every, support.described())
        for index, load in enumerate(structure.loads):
            suffix = ".group" if hasattr(load, "group") else ""
            with _pointing_at(f"structure.loads.{index}{suffix}"):
                check_load(imported, every, load.described())

    def _check_contacts(self) -> None:
        """Make and check the interfaces; if they cannot be made, find the contact at fault."""
        structure, size = self.structure, self.mesh.size
        try:
            interfaces = structure.mesh(size).interfaces
        except MeshError:
            for index, pair in enumerate(structure.contacts):
                with _pointing_at(f"structure.contacts.{index}"):
                    structure.model_copy(update={"contacts": (pair,)}).mesh(size)
            raise
        for index, (pair, face) in enumerate(zip(structure.contacts, interfaces, strict=True)):
            grid = pair.grid or self.contact.grid
            check_rows(grid, face.line, f"structure.contacts.{index}.grid" if pair.grid else None)
            key = f"structure.contacts.{index}"
            if pair.gap is not None:
                cells = grid[0], 1 if face.line else grid[1]
                check_gap(pair.gap, face_size(face), cells, face.line, f"{key}.gap")
                check_mirrored(pair.gap, face.planes, f"{key}.gap")
            if pair.surfaces is not None:
                over = Grid.over(face_size(face), grid, face.line)
                pair.surfaces.check(over, f"{key}.surfaces", "mesh")
                scanned = ScannedFace(pair.name, f"{key}.surfaces", pair.surfaces, over, face)
                scanned.check_mirrored()

    def _check_supports(self, imported: ImportedMesh) -> None:
        """Build supports and ties of the bodies, with elements of order 1 and without forces."""
        from fe_models.imported_structure import imported_structure
        from fe_models.loads.pretension import Pretension, bolt_section

        structure = self.structure
        supports = [support.described() for support in structure.supports]
        asked = [(index, load) for index, load in enumerate(structure.loads) if load.ties]
        loads = [load.described() for _, load in asked]
        materials = [material.elastic() for material in self.solids.values()]
        with _pointing_at("structure.supports"):
            mesh = structure.mesh(self.mesh.size)
            cyclic = [cuts.described() for cuts in structure.cyclic]
            made = imported_structure(mesh, imported, materials, supports, loads, 1, cyclic)
        for (index, _), load in zip(asked, loads, strict=True):
            if isinstance(load, Pretension):
                with _pointing_at(f"structure.loads.{index}"):
                    bolt_section(made, load)
        slices = [name for name, share in made.held_faces.items() if share == 1.0]
        if slices and made.dimension == 3:
            raise disagreement(
                f"all nodes of {slices[0]} are held along it, as in a slice in plane strain, but "
                "its half-space would be a strip as wide as the slice; allowed: the section as a "
                "plane mesh",
                "structure.supports",
            )


@contextmanager
def _pointing_at(key: str) -> Iterator[None]:
    """Report a mesh error as a disagreement at the case entry ``key``."""
    try:
        yield
    except MeshError as error:
        raise disagreement(str(error), key) from error
