"""Contact cases: two bodies without a structure, pressed and sheared along a path of loads.

A line contact, in plane strain, differs in the dimensions of its loads and its grid. It is a
separate kind of case, though both are written ``analysis: contact``.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Discriminator, Field, Tag, model_validator

from sa_solver.surfaces import shapes
from sa_solver.types import Array, ElasticPair, Grid, Layer
from sa_solver.types import Material as ElasticMaterial
from workflow.analyses.contact.friction import FrictionByPlace
from workflow.analyses.contact.load_path import ContactPath, LegsOrFile, LineContactPath
from workflow.analyses.contact.plausibility import (
    about_grid,
    about_pressure,
    about_repetition,
    about_shear,
)
from workflow.analyses.contact.surfaces import MeasuredSurfaces
from workflow.case.fields import File, Quantity
from workflow.case.files.input_files import read_heights
from workflow.case.loading import word_at
from workflow.case.plausibility import heights, hertz, uneven_cells
from workflow.case.sections import (
    Case,
    ElasticSection,
    GridCells,
    Length,
    LineCells,
    RoundingRadius,
    Section,
    Stress,
    Title,
    Tolerance,
    at_entry,
    disagreement,
    entry,
)
from workflow.case.source import Source
from workflow.case.text.plain import body_text, merged_rows, of_bodies, plain, shape_in_words
from workflow.messages.warning_kinds import Notice
from workflow.models.gaps import GapFunction
from workflow.models.uncoupled.load_table import PRESSING, LoadTable

# Limits are wide: they catch a forgotten unit or a slipped exponent, not an unusual contact.
Poisson = Annotated[float, Quantity("1", at_least=0.0, at_most=0.5)]

RIGID = ElasticMaterial(young=np.inf, poisson=0.0)
AREA_SHAPES = ("sphere", "ellipsoid")
LINE_SHAPES = ("cylinder", "flat_rounded")
# Loads that turn the bodies or strain them all over.
UNLIKE = ("Mx", "My", "Mz", "tilt_x", "tilt_y", "twist", "bulk_stress_1", "bulk_stress_2")
# Shapes of contacts both over an area and along a line.
PLANE, HEIGHTS = "plane", "heights"

# --- bodies -------------------------------------------------------------------------------------


class Bodies(Section):
    """Two bodies without finite elements."""

    kind: Literal["bodies"] = entry("kind of structure", "bodies")
    shape: str  # each narrows it to its name
    surfaces: MeasuredSurfaces | None = entry("measured heights, added to the shape", default=None)

    @property
    def text(self) -> str:
        """Short description of the shape."""
        return shape_in_words(self)

    @abstractmethod
    def form_on(self, grid: Grid) -> Array:
        """Return the gap of the shape before loading on ``grid``, ``(nx, ny)`` [mm]."""

    def gap_on(self, grid: Grid) -> Array:
        """Return the gap before loading on ``grid``, ``(nx, ny)`` [mm], with measured surfaces."""
        form = self.form_on(grid)
        return form if self.surfaces is None else form + self.surfaces.gap(grid)


class Shape(Bodies):
    """Two bodies whose gap is known at any point."""

    @abstractmethod
    def described(self) -> GapFunction:
        """Return the gap before loading as a function of the place."""

    def form_on(self, grid: Grid) -> Array:
        return self.described()(grid.x, grid.y)


class Plane(Shape):
    """No form of its own: the whole form is in the measured surfaces."""

    shape: Literal["plane"] = entry("a plane all over the grid", "plane")
    surfaces: MeasuredSurfaces = entry("measured heights, with their whole form")

    def described(self) -> GapFunction:
        return shapes.plane


class Sphere(Shape):
    """Hertz's paraboloid (x² + y²) / 2 R."""

    shape: Literal["sphere"] = entry("sphere, ellipsoid, plane or heights", "sphere")
    radius: RoundingRadius = entry("relative radius, 1/R = 1/R1 + 1/R2 [mm]", "10 mm")

    def described(self) -> GapFunction:
        return partial(shapes.sphere, radius=self.radius)


class Ellipsoid(Shape):
    """Paraboloid x² / 2 Rx + y² / 2 Ry."""

    shape: Literal["ellipsoid"] = entry("sphere, ellipsoid, plane or heights", "ellipsoid")
    radius_x: RoundingRadius = entry("relative radius of the section along x [mm]", "10 mm")
    radius_y: RoundingRadius = entry("relative radius of the section along y [mm]", "20 mm")

    def described(self) -> GapFunction:
        return partial(shapes.ellipsoid, radius_x=self.radius_x, radius_y=self.radius_y)


class Cylinder(Shape):
    """Parabola x² / 2 R, constant along y: a line contact."""

    shape: Literal["cylinder"] = entry("cylinder, flat_rounded, plane or heights", "cylinder")
    radius: RoundingRadius = entry("relative radius, 1/R = 1/R1 + 1/R2 [mm]", "10 mm")

    def described(self) -> GapFunction:
        return partial(shapes.cylinder, radius=self.radius)


class FlatRounded(Shape):
    """Flat with a parabola beyond either end: a line contact."""

    shape: Literal["flat_rounded"] = entry(
        "cylinder, flat_rounded, plane or heights", "flat_rounded"
    )
    half_width: Length = entry("half width of the flat [mm]", "4 mm")
    edge_radius: RoundingRadius = entry("radius of the parabola beyond the flat [mm]", "10 mm")

    def described(self) -> GapFunction:
        return partial(
            shapes.rounded_flat, half_width=self.half_width, edge_radius=self.edge_radius
        )


class Heights(Bodies):
    """Gap before loading from a file, rows along x and columns along y, over ``contact.size``."""

    shape: Literal["heights"] = entry("heights: the gap before loading from a file", "heights")
    file: Annotated[str, File((".npy", ".csv", ".h5"))] = entry(
        "file with the gap in mm, one value per cell; for .h5 add :dataset", "gap.npy"
    )

    def form_on(self, grid: Grid) -> Array:
        return read_heights(self.file)


class BodyMaterial(ElasticSection):
    """Isotropic linear elastic material."""

    young: Stress = entry("Young's modulus [MPa]", "115 GPa")
    poisson: Poisson = entry("Poisson's ratio [1]", 0.29)
    yield_stress: Stress | None = entry(
        "a run warns of pressures above it; without it never [MPa]", "900 MPa", default=None
    )


NAME_OR_SECTION = Discriminator(
    lambda value: "(name)" if str(value).startswith("rigid") else "(section)"
)
Body = Annotated[
    Annotated[BodyMaterial, Tag("(section)")] | Annotated[Literal["rigid"], Tag("(name)")],
    NAME_OR_SECTION,
]


LOWER = "the lower, fixed body; a material's name, its entries or the word rigid"
UPPER = "the upper, moving body; a material's name, its entries or the word rigid"


class BodyMaterials(Section):
    """The two bodies in contact."""

    body_1: Body = entry(LOWER)
    body_2: Body = entry(UPPER)

    @model_validator(mode="after")
    def _one_is_elastic(self) -> BodyMaterials:
        if self.body_1 == self.body_2 == "rigid":
            raise disagreement(
                "both bodies are rigid; allowed: at most one of them", "body_2", "body_1"
            )
        return self


class LayerSection(ElasticSection):
    """Elastic layer that is bonded to what lies below it."""

    thickness: Length = entry("thickness [mm]", "50 um")
    young: Stress = entry("Young's modulus [MPa]", "50 GPa")
    poisson: Poisson = entry("Poisson's ratio [1]", 0.3)

    def layer(self) -> Layer:
        """Return the layer for the solvers."""
        return Layer(self.thickness, self.young, self.poisson)


class LayeredMaterial(BodyMaterial):
    """Isotropic linear elastic material, with the layers on its surface."""

    layers: tuple[LayerSection, ...] = entry(
        "layers on the surface, such as coatings, the outermost first", default=()
    )

    def elastic(self) -> ElasticMaterial:
        return replace(super().elastic(), layers=tuple(n.layer() for n in self.layers))


LayeredBody = Annotated[
    Annotated[LayeredMaterial, Tag("(section)")] | Annotated[Literal["rigid"], Tag("(name)")],
    NAME_OR_SECTION,
]


class LayeredMaterials(BodyMaterials):
    """The two bodies in contact, with their layers."""

    body_1: LayeredBody = entry(LOWER)
    body_2: LayeredBody = entry(UPPER)


def elastic(body: Body) -> ElasticMaterial:
    """Return the material of a body in the form that the solvers need."""
    return RIGID if body == "rigid" else body.elastic()


def unworn_contact(
    shape: Section, bodies: Sequence[ElasticSection | str], load: float, line: bool
) -> tuple[float, float] | None:
    """Return width [mm] and largest pressure [MPa] of a ball or cylinder.

    None is returned for other shapes, and for layered bodies.
    """
    radius = getattr(shape, "radius", None)
    if any(getattr(body, "layers", ()) for body in bodies):
        return None
    compliance = sum(
        (1.0 - body.elastic().poisson ** 2) / body.elastic().young
        for body in bodies
        if isinstance(body, ElasticSection)
    )
    if radius is None or compliance == 0.0:
        return None
    half_width, pressure = hertz(load, radius, 1.0 / compliance, line)
    return 2.0 * half_width, pressure


def layers_in_words(materials: LayeredMaterials) -> list[tuple[str, str]]:
    """Return a row with the layers of each body that has some."""
    texts = {}
    for name in LayeredMaterials.model_fields:
        if layers := getattr(getattr(materials, name), "layers", ()):
            texts[name] = " on ".join(f"({body_text(layer)})" for layer in layers)
    return merged_rows("layers", texts)


# --- loads --------------------------------------------------------------------------------------


def check_bulk_stress(table: LoadTable, materials: BodyMaterials) -> None:
    """Refuse bulk stress in a rigid or layered body."""
    for number in (1, 2):
        body, key = f"body_{number}", f"bulk_stress_{number}"
        if key not in table.columns:
            continue
        if getattr(getattr(materials, body), "layers", ()):
            raise disagreement(
                f"the bulk stress of a layered body is not computed, but load_path has {key}; "
                "allowed: no layers, or no bulk stress",
                f"materials.{body}",
            )
        if getattr(materials, body) == "rigid":
            raise disagreement(
                f"a rigid body carries no bulk stress, but load_path has {key}; "
                "allowed: an elastic body",
                f"materials.{body}",
            )


# --- grids --------------------------------------------------------------------------------------


class HalfSpaceGrid(Section):
    """Settings for the solution of a contact along its path."""

    grid: object  # each dimension narrows the cells and the size
    size: object
    boundary: Literal["free", "periodic"] = entry(
        "free: the bodies go on beyond the grid without contact; periodic: the grid repeats itself "
        "without end, as a patch of a rough surface",
        "free",
        default="free",
    )
    hardness: Stress | None = entry(
        "largest pressure before the softer body yields and stays flatter, about 3 times its yield "
        "stress; without it bodies are elastic [MPa]",
        "6 GPa",
        default=None,
    )
    tolerance: Tolerance = entry("relative tolerance of every residual [1]", 1e-8, default=1e-8)
    history: Literal["auto", "full", "reversals"] = entry(
        "auto: the cheapest that is accurate; full: all increments; reversals: only turning points",
        "auto",
        default="auto",
    )
    accuracy: Annotated[float, Quantity("1", at_least=1e-6, at_most=1.0)] = entry(
        "error of shear (over µP) and energy that increments may cause: auto splits them, full "
        "warns [1]",
        "2 %",
        default=0.02,
    )

    @property
    def periodic(self) -> bool:
        """True if the grid repeats itself."""
        return self.boundary == "periodic"

    @abstractmethod
    def centred(self) -> Grid:
        """Return the grid, centred on the bodies."""


class ContactGrid(HalfSpaceGrid):
    """Half-space solution on a grid centred on the bodies."""

    grid: tuple[GridCells, GridCells] = entry(
        "number of cells along x, along y; for heights as many as in their file",
        [128, 128],
        default=(128, 128),
    )
    size: tuple[Length, Length] = entry("size of the grid along x, along y [mm]", ["1 mm", "1 mm"])

    def centred(self) -> Grid:
        return Grid.covering(self.size, self.grid)


class LineContactGrid(HalfSpaceGrid):
    """Half-plane solution on cells of a line contact, centred on the bodies."""

    grid: LineCells = entry(
        "number of cells along x; for heights as many as in their file", 512, default=(512, 1)
    )
    size: Length = entry("size of the grid along x [mm]", "2 mm")
    datum: Length | None = entry(
        "depth at which displacements vanish; default: twice the size [mm]",
        "50 mm",
        default=None,
    )

    @model_validator(mode="after")
    def _datum_beyond_grid(self) -> LineContactGrid:
        if self.datum is not None and self.datum < self.size:
            raise disagreement(
                f"{self.datum:g} mm: too close; allowed: at least the size, {self.size:g} mm",
                *("datum", "size"),
            )
        if self.datum is not None and self.periodic:
            raise disagreement(
                "displacements of a periodic contact are relative to their mean; allowed: no datum",
                *("datum", "boundary"),
            )
        return self

    def centred(self) -> Grid:
        return Grid.line_contact(self.size, self.grid[0])


# --- cases --------------------------------------------------------------------------------------


class BodiesCase(Case):
    """Two bodies in contact, over an area or along a line."""

    analysis: Literal["contact"] = entry("kind of analysis", "contact")
    structure: Bodies
    materials: LayeredMaterials = entry("the two bodies in contact")
    friction: FrictionByPlace = entry(
        "Coulomb's law; not needed if similar bodies are only pressed",
        default=FrictionByPlace(coefficient=0.0),
    )
    load_path: LegsOrFile
    contact: HalfSpaceGrid

    @model_validator(mode="after")
    def _rubs_with_friction(self) -> Self:
        """Refuse shear, and pressure on dissimilar bodies, if no friction is given."""
        if "friction" in self.model_fields_set:
            return self
        sheared = sorted(set(self.load_path.table().columns) - set(PRESSING))
        if sheared or not self._pair.similar:
            why = f"load_path has {', '.join(sheared)}" if sheared else "dissimilar bodies rub"
            raise disagreement(f"missing, but {why}; allowed: a coefficient, or 0", "friction")
        return self

    @model_validator(mode="after")
    def _can_run(self) -> Self:
        check_bulk_stress(self.load_path.table(), self.materials)
        if self.contact.periodic:
            self._check_periodic()
        if self.contact.hardness is not None and not self._pair.similar:
            raise disagreement(
                "the yield of dissimilar bodies is not computed; allowed: bodies of equal "
                "(1 - 2ν)/G, both with the same layers, or no hardness",
                *("contact.hardness", "materials"),
            )
        self._check_load_below_hardness()
        if self.friction.varies and not self._pair.similar:
            raise disagreement(
                "friction that depends on place or pressure is not computed for dissimilar bodies; "
                "allowed: bodies of equal (1 - 2ν)/G, or one coefficient",
                *("friction", "materials"),
            )
        self.friction.check_field(self.contact.centred().shape)
        if isinstance(self.structure, Heights):
            require_shape(self.structure.file, self.contact.centred().shape)
        check_surfaces(self.structure, self.contact.centred())
        return self

    def _check_load_below_hardness(self) -> None:
        """Refuse a load that the whole grid cannot carry at the hardness."""
        grid, table = self.contact.centred(), self.load_path.table()
        if self.contact.hardness is None or "P" not in table.columns:
            return
        most = self.contact.hardness * grid.cell_area * grid.shape[0] * grid.shape[1]
        if (largest := float(table["P"].max())) >= most:
            raise disagreement(
                f"{plain(self.contact.hardness, 'MPa')}: the whole grid carries {most:.4g} N at "
                f"it, and P is up to {largest:.4g} N; allowed: a larger hardness, or grid",
                "contact.hardness",
            )

    def _check_periodic(self) -> None:
        """Refuse loads and bodies that a patch and its neighbours cannot have alike."""
        if unlike := sorted(set(self.load_path.table().columns) & set(UNLIKE)):
            raise disagreement(
                f"{', '.join(unlike)}: all patches of a periodic contact are alike and do not "
                "turn; allowed: with contact.boundary: free",
                "load_path",
            )
        if not self._pair.similar:
            raise disagreement(
                "a periodic contact of dissimilar bodies is not computed; allowed: bodies of equal "
                "(1 - 2ν)/G, both with the same layers, or contact.boundary: free",
                "materials",
            )

    @property
    def _pair(self) -> ElasticPair:
        return ElasticPair(elastic(self.materials.body_1), elastic(self.materials.body_2))

    @property
    def question(self) -> str:
        return (
            f"Where do two bodies ({self.structure.text}) touch, stick and slip, and under which "
            f"pressure and shear? Load: {', '.join(self.load_path.ranges())}."
        )

    def outline(self) -> list[tuple[str, str]]:
        table, grid = self.load_path.table(), self.contact.centred()
        (nx, ny), (dx, dy) = grid.shape, grid.pitch
        kind = "no finite elements"
        cells = f"{nx} x {ny} cells of {plain(dx, 'mm', 4)} x {plain(dy, 'mm', 4)}"
        if grid.line:
            kind, cells = "line contact", f"{nx} cells of {plain(dx, 'mm', 4)}"
        count = f"{len(table)} increment{'s' if len(table) > 1 else ''}"
        repeated = ", repeated without end" if self.contact.periodic else ""
        hardness = self.contact.hardness
        yields = f", hardness {plain(hardness, 'MPa')}" if hardness is not None else ""
        return [
            ("structure", f"{self.structure.text}, {kind}"),
            ("load path", f"{count} of {', '.join(table.columns)}"),
            ("loads", ", ".join(self.load_path.ranges())),
            *surfaces_in_words(self.structure, grid),
            *of_bodies("material", self.materials),
            *layers_in_words(self.materials),
            ("friction", self.friction.text),
            ("contact", f"{cells}{repeated}{yields}, history {self.contact.history}"),
        ]

    def plausibility_warnings(self) -> Iterator[Notice]:
        grid, table = self.contact.centred(), self.load_path.table()
        loads = table.columns
        sides = grid.shape[0] * grid.pitch[0], grid.shape[1] * grid.pitch[1]
        if grid.line:
            sides = sides[0], sides[0]
        else:
            yield from uneven_cells(sides, grid.shape)
        if isinstance(self.structure, Heights):
            yield from heights("structure.file", self.structure.form_on(grid), sides)
        elif "P" in loads and (load := float(loads["P"].max())) > 0.0:
            bodies = self.materials.body_1, self.materials.body_2
            if found := unworn_contact(self.structure, bodies, load, grid.line):
                if self.contact.hardness is None:
                    yield from about_pressure("load_path", found[1], bodies)
                yield from about_grid(found[0], sides, grid.shape)
        yield from surface_warnings(self.structure, grid)
        if self.contact.periodic:
            yield from about_repetition(self.structure.gap_on(grid))
        unit = "N/mm" if grid.line else "N"
        if not self.friction.varies:
            yield from about_shear("load_path", table, self.friction.coefficient, unit)


class ContactCase(BodiesCase):
    """Two bodies in contact over an area."""

    about: ClassVar[str] = "a ball, ellipsoid or measured heights under any history of loads"

    title: Title = entry("one line", "Ball on a flat, pressed and sheared")
    structure: Annotated[Sphere | Ellipsoid | Plane | Heights, Field(discriminator="shape")] = (
        entry("the bodies: no finite elements")
    )
    load_path: ContactPath = entry("forces or motions, one leg after the other")
    contact: ContactGrid = entry("half-space grid")

    @classmethod
    def suits(cls, source: Source) -> bool:
        return not touches_along_a_line(source, (PLANE, HEIGHTS))


class LineContactCase(BodiesCase):
    """Two bodies in contact along a line, in plane strain: all quantities are per length of it."""

    about: ClassVar[str] = "a cylinder, flat or heights along a line under any history of loads"

    title: Title = entry("one line", "Cylinder on a flat, pressed and sheared")
    structure: Annotated[Cylinder | FlatRounded | Plane | Heights, Field(discriminator="shape")] = (
        entry("the bodies: no finite elements")
    )
    load_path: LineContactPath = entry("forces or motions per length, one leg after the other")
    contact: LineContactGrid = entry("half-plane grid")

    @classmethod
    def suits(cls, source: Source) -> bool:
        return touches_along_a_line(source, (PLANE, HEIGHTS))


def touches_along_a_line(source: Source, ambiguous: tuple[str, ...]) -> bool:
    """Return whether two bodies touch along a line, by their shape.

    The ``ambiguous`` shapes, such as heights and planes, have no dimension: a grid of one size is
    that of a line contact. Raises CaseError for an unknown shape.
    """
    if source.at(("structure", "kind")) != "bodies":
        return False
    shape = word_at(source, ("structure", "shape"), (*AREA_SHAPES, *LINE_SHAPES, *ambiguous))
    one_size = isinstance(source.at(("contact", "size")), str | int | float)
    return one_size if shape in ambiguous else shape in LINE_SHAPES


def check_surfaces(bodies: Bodies, grid: Grid) -> None:
    """Raise an error unless measured surfaces fit the grid."""
    if bodies.surfaces is not None:
        bodies.surfaces.check(grid)


def surface_warnings(bodies: Bodies, grid: Grid) -> Iterator[Notice]:
    """Warn about the units of measured surfaces, and about roughness that the grid loses."""
    if bodies.surfaces is not None:
        yield from bodies.surfaces.plausibility_warnings(grid)


def surfaces_in_words(bodies: Bodies, grid: Grid) -> list[tuple[str, str]]:
    """Return an outline row for each measured surface."""
    surfaces = bodies.surfaces
    reported = {} if surfaces is None else surfaces.reported(surfaces.summary(grid))
    return [(f"surface {name[-1]}", text) for name, text in reported.items()]


def require_shape(file: str, grid: tuple[int, int]) -> None:
    """Raise an error unless a file of heights has a value for each cell of ``grid``."""
    with at_entry("structure.file"):
        shape = read_heights(file).shape
    if shape != grid:
        cells = f"[{shape[0]}, {shape[1]}]" if grid[1] > 1 or shape[1] > 1 else f"{shape[0]}"
        raise disagreement(
            f"{grid[0]} x {grid[1]} cells: the file of heights has {shape[0]} x {shape[1]}; "
            f"allowed: {cells}",
            "contact.grid",
        )
