"""Cases of two rig specimens: pressed together, fretted, and worn in cycle blocks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from sa_solver.types import Grid
from sa_solver.types import Material as ElasticMaterial
from wear.laws import WearLaw
from workflow.analyses.contact.plausibility import about_pressure
from workflow.analyses.contact.surfaces import KEY, MeasuredSurfaces
from workflow.analyses.wear.case.evolution import PositiveEnergy
from workflow.analyses.wear.case.scanned import ScannedFace, WithScans
from workflow.analyses.wear.case.sections import (
    Cycles,
    Laws,
    PressingForce,
    Ratio,
    TwoBodies,
    TwoMaterials,
)
from workflow.analyses.wear.case.worn_bodies import BodyWear, WornByArchard, wearing
from workflow.case.fields import Formats, Quantity, Whole
from workflow.case.sections import (
    Case,
    Friction,
    GridCells,
    Length,
    Output,
    RoundingRadius,
    Section,
    Title,
    Tolerance,
    disagreement,
    entry,
    one_of,
)
from workflow.case.text.plain import of_bodies, plain, shares, times
from workflow.messages.warning_kinds import Notice, WarningKind

if TYPE_CHECKING:
    from fe_models.geometry.specimens import Specimen
    from fe_models.meshes.structure_mesh import StructureMesh

# Formats of matrices; the first one is the default.
MATRIX_FORMATS = "npz", "mat", "mtx"
Depth = Annotated[float, Quantity("mm", at_least=0.0, at_most=1e4)]


class Form(Section):
    """Radii of each strip, which is flat without them."""

    along: RoundingRadius = entry("radius of the section along the strip [mm]", "1000 mm")
    across: RoundingRadius = entry("radius of the section across the strip [mm]", "50 mm")


class Specimens(Section):
    """Two cylinders end to end, each narrowed to a strip; the strips cross over a square pad."""

    kind: Literal["specimens"] = entry("kind of structure", "specimens")
    diameter: Length = entry("diameter of the cylinders [mm]", "8 mm")
    length: Length = entry("length of each cylinder [mm]", "33 mm")
    strip_width: Length = entry("width of each strip, the side of the pad [mm]", "1 mm")
    chamfer_depth: Depth = entry("depth from the strip down to the cylinder's side [mm]", "1 mm")
    ring_distance: Length = entry(
        "distance from the pad to the ring where the holder ends, which is held or moved [mm]",
        "2 mm",
    )
    ring_nodes: Annotated[int, Whole(4, 400)] = entry(
        "number of points of the ring that are kept, a multiple of 4", 16, default=16
    )
    form: Form | None = entry("form of the strips; without it they are flat", default=None)
    surfaces: MeasuredSurfaces | None = entry(
        "measured surfaces of the pads, added to the form: rows along x, which is along body 1's "
        "strip, about the middle of the pad; with angle: 90 deg along body 2's",
        default=None,
    )

    @model_validator(mode="after")
    def _can_be_drawn(self) -> Specimens:
        from fe_models.meshes.structure_mesh import MeshError

        try:
            self.geometry().check()
        except MeshError as error:
            key, _, _ = str(error).partition(" ")
            raise disagreement(str(error), *({key} & set(type(self).model_fields))) from error
        return self

    def geometry(self, **settings: int) -> Specimen:
        """Return the specimen as the mesher needs it, with ``pad_elements`` if they are known."""
        from fe_models.geometry.specimens import Specimen

        radii = None if self.form is None else (self.form.along, self.form.across)
        sizes = self.model_dump(exclude={"kind", "form", "surfaces"})
        return Specimen(**sizes, radii=radii, **settings)


class FrettingLoads(Section):
    """Normal forces one after the other, each on unworn specimens."""

    refused: ClassVar[Mapping[str, str]] = {
        "P": "of other cases; allowed: normal_forces, one after the other, such as [60 N]"
    }

    normal_forces: Annotated[tuple[PressingForce, ...], Field(min_length=1)] = entry(
        "normal force, constant while the pair is fretted [N]", ["17 N", "87 N", "150 N", "250 N"]
    )
    stroke: Length = entry("stroke of body 2's ring along x, peak to peak [mm]", "14 um")

    @model_validator(mode="after")
    def _forces_differ(self) -> FrettingLoads:
        for index, force in enumerate(self.normal_forces):
            if force in self.normal_forces[:index]:
                raise disagreement(
                    f"{force:g} N: given twice; allowed: every force once", f"normal_forces.{index}"
                )
        return self


class SpecimenMesh(Section):
    """Tetrahedra of each specimen, growing away from its pad."""

    pad_elements: Annotated[int, Whole(2, 60)] = entry(
        "squares along each side of the pad, an even number", 10, default=10
    )
    size: Length = entry("size of the largest elements [mm]", "1 mm", default=1.0)
    order: Literal[1, 2] = entry("order of the tetrahedra, 1 or 2", 2, default=2)

    @model_validator(mode="after")
    def _pad_has_a_middle(self) -> SpecimenMesh:
        if self.pad_elements % 2:
            raise disagreement(f"{self.pad_elements}: odd; allowed: even numbers", "pad_elements")
        return self


class Reduction(Section):
    """Craig-Bampton model of each specimen on the nodes of its pad and ring."""

    modes: Annotated[int, Whole(1, 500)] = entry(
        "number of fixed-interface modes that are kept", 20, default=20
    )


class PadGrid(Section):
    """Half-space over exactly the pad, for the same contact."""

    grid: tuple[GridCells, GridCells] = entry(
        "number of cells along x, y", [40, 40], default=(40, 40)
    )
    link: Literal["corrected", "half_space"] = entry(
        "corrected: the specimens deform as their models do; half_space: as half-spaces",
        "corrected",
        default="corrected",
    )
    tolerance: Tolerance = entry(
        "relative tolerance of equilibrium and complementarity [1]", 1e-8, default=1e-8
    )


class ExplicitStep(Section):
    """A block of cycles of constant geometry."""

    fraction: Ratio = entry("share of the stability limit [1]", 0.5, default=0.5)
    cycles: Cycles | None = entry(
        "cycles of every step instead; refused where they would be unstable [1]", 1000, default=None
    )


class Reported(Section):
    """A reported number of cycles, from which the wear coefficient that gives it is found."""

    normal_force: PressingForce = entry("one of load_path.normal_forces [N]", "17 N")
    steady: Literal["stiffness", "pressure"] = entry(
        "quantity that no longer changes then", "stiffness"
    )
    cycles: Cycles = entry("cycles after which it is steady [1]", 2.5e6)


class SpecimensWear(TwoBodies[BodyWear], Laws):
    """Wear of both specimens, node by node; ends by exactly one of cycles and energy."""

    in_schema: ClassVar[Mapping[str, Any]] = one_of("cycles", "energy")

    cycles: Cycles | None = entry("cycles under each normal force [1]", 3e5, default=None)
    energy: PositiveEnergy | None = entry(
        "energy dissipated under each normal force, instead of cycles [N*mm]", "1 kJ", default=None
    )
    step: ExplicitStep = entry("cycles of constant geometry", default=ExplicitStep())
    reported: tuple[Reported, ...] = entry("number of cycles that a source reports", default=())

    @model_validator(mode="after")
    def _ends_once(self) -> SpecimensWear:
        if (self.cycles is None) == (self.energy is None):
            given = "neither" if self.cycles is None else "both"
            raise disagreement(f"{given} given; allowed: either cycles or energy", "energy")
        return self

    @model_validator(mode="after")
    def _something_wears(self) -> SpecimensWear:
        if self.body_1.rate(1.0) == self.body_2.rate(1.0) == 0.0:
            raise disagreement("0 for both bodies; allowed: for one of them at most", "body_1")
        return self

    @model_validator(mode="after")
    def _reported_are_of_energy(self) -> SpecimensWear:
        """Refuse reported cycles if the shapes do not scale with the wear coefficients."""
        for body in (self.body_1, self.body_2):
            if self.reported and (isinstance(body, WornByArchard) or body.evolution is not None):
                raise disagreement(
                    "given for a body that wears by archard, or whose coefficient changes; "
                    "allowed: only with energy laws without evolution",
                    "reported",
                )
        return self


class SpecimensOutput(Output):
    """Files that are written in addition to summary, results and reduced bodies."""

    matrices: Annotated[bool | tuple[str, ...], Formats(MATRIX_FORMATS)] = entry(
        "files of the reduced bodies for other programs: false, true (npz), or one or a list of "
        "npz, mat and mtx; body_1.h5 and body_2.h5 are always written",
        ["npz", "mat"],
        default=False,
    )

    @property
    def matrix_formats(self) -> tuple[str, ...]:
        """Formats in which matrices are written, empty where they are not wanted."""
        if isinstance(self.matrices, tuple):
            return self.matrices
        return MATRIX_FORMATS[:1] if self.matrices else ()


class SpecimensCase(WithScans, Case):
    """Two specimens of a friction rig, on their reduced models and on a half-space."""

    about: ClassVar[str] = "two crossed specimens of a friction rig that wear each other"

    title: Title = entry("one line", "Friction-rig specimens worn at 14 um stroke")
    analysis: Literal["wear"] = entry("kind of analysis", "wear")
    structure: Specimens = entry("two equal specimens, turned 90° to each other")
    materials: TwoMaterials = entry("the two specimens")
    friction: Friction = entry("Coulomb's law on the pad")
    load_path: FrettingLoads = entry("load of every cycle")
    mesh: SpecimenMesh = entry("finite elements of each specimen", default=SpecimenMesh())
    reduction: Reduction = entry("reduction of each specimen", default=Reduction())
    contact: PadGrid = entry("half-space for comparison with the specimens", default=PadGrid())
    wear: SpecimensWear = entry("law, length of the run and of its cycle blocks")
    output: SpecimensOutput = entry(
        "files written with summary and results", default=SpecimensOutput()
    )

    @property
    def elastic(self) -> tuple[ElasticMaterial, ElasticMaterial]:
        """Materials of body 1 and body 2."""
        return self.materials.body_1.elastic(), self.materials.body_2.elastic()

    @property
    def laws(self) -> tuple[WearLaw, WearLaw]:
        """Wear laws of body 1 and body 2."""
        return self.wear.body_1.described(), self.wear.body_2.described()

    def geometry(self) -> Specimen:
        """Return the specimen as the mesher needs it."""
        return self.structure.geometry(pad_elements=self.mesh.pad_elements)

    def meshed(self) -> StructureMesh:
        """Return both specimens, meshed once, without measured surfaces. Raises MeshError."""
        from workflow.models.specimens.reduced import meshed_specimens

        return meshed_specimens(self.geometry(), self.mesh.size)

    @property
    def pad_grid(self) -> Grid:
        """Grid of the half-space."""
        side = self.structure.strip_width
        return Grid.covering((side, side), self.contact.grid)

    def scanned(self) -> Iterator[ScannedFace]:
        if self.structure.surfaces is not None:
            (face,) = self.meshed().interfaces
            yield ScannedFace("pad", KEY, self.structure.surfaces, self.pad_grid, face)

    @property
    def question(self) -> str:
        return (
            f"How far do two specimens wear each other within {self._end}, and how does that "
            f"change their tangential stiffness? Load: {self._loads}."
        )

    @property
    def _end(self) -> str:
        """End of the wear under each normal force, as text."""
        wear = self.wear
        if wear.cycles:
            return f"{times(wear.cycles)} cycles"
        return f"{1e-3 * (wear.energy or 0.0):g} J of dissipated energy"

    @property
    def _loads(self) -> str:
        """Normal forces and stroke, as text."""
        loads = self.load_path.normal_forces
        forces, stroke = ", ".join(f"{f:g}" for f in loads), plain(self.load_path.stroke, "mm")
        return f"{forces} N{' in turn' * (len(loads) > 1)}, stroke {stroke}"

    def outline(self) -> list[tuple[str, str]]:
        form, wear = self.structure.form, self.wear
        pad = self.structure.strip_width
        shape = "flat"
        if form is not None:
            shape = f"radii {plain(form.along, 'mm')} and {plain(form.across, 'mm')}"
        each = " each" * (len(self.load_path.normal_forces) > 1)
        nodes = (self.mesh.pad_elements + 1) ** 2
        fraction, cycles = wear.step.fraction, wear.step.cycles
        block = (
            f"{shares(fraction)} of their limit" if cycles is None else f"{times(cycles)} cycles"
        )
        cells = " x ".join(map(str, self.contact.grid))
        return [
            ("structure", f"pads of {pad:g} x {pad:g} mm with {nodes} nodes, {shape}"),
            *(row for face in self.scanned() for row in face.outline()),
            ("load path", self._loads),
            *of_bodies("material", self.materials),
            ("friction", f"{self.friction.coefficient:g}"),
            ("contact", f"reduced specimens; for comparison {cells} cells on a half-space"),
            *wearing({"body_1": wear.body_1, "body_2": wear.body_2}),
            ("wear", f"{self._end}{each}, in cycle blocks of {block}"),
        ]

    def plausibility_warnings(self) -> Iterator[Notice]:
        side = self.structure.strip_width
        if self.load_path.stroke > side:
            yield Notice(
                WarningKind.LONG_STROKE,
                f"load_path.stroke: {plain(self.load_path.stroke, 'mm')}, longer than the pad "
                f"({plain(side, 'mm')}): is its unit right?",
            )
        bodies = self.materials.body_1, self.materials.body_2
        for index, force in enumerate(self.load_path.normal_forces):
            path = f"load_path.normal_forces.{index}"
            yield from about_pressure(path, force / side**2, bodies)
        yield from self.surface_warnings()

    @model_validator(mode="after")
    def _surfaces_fit(self) -> SpecimensCase:
        if self.structure.surfaces is not None:
            self.structure.surfaces.check(self.pad_grid, size="structure.strip_width")
        return self

    @model_validator(mode="after")
    def _reported_forces_run(self) -> SpecimensCase:
        for index, reported in enumerate(self.wear.reported):
            if reported.normal_force not in self.load_path.normal_forces:
                forces = ", ".join(f"{force:g}" for force in self.load_path.normal_forces)
                raise disagreement(
                    f"{reported.normal_force:g} N: not run; allowed: {forces} N",
                    f"wear.reported.{index}.normal_force",
                )
        return self
