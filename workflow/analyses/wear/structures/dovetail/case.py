"""A dovetail case: a blade root in its disk, its mission, its flanks and their wear."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import cos, pi, radians, sin, tan
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import field_validator, model_validator
from pydantic_core import PydanticCustomError

from fe_models.meshes.structure_mesh import MeshError, StructureMesh
from sa_solver.types import Grid
from workflow.analyses.wear.case.base import FiniteElementCase
from workflow.analyses.wear.case.gaps import check_arcs
from workflow.analyses.wear.case.scanned import ScannedFace
from workflow.analyses.wear.case.sections import (
    BladeAndDiskMaterials,
    DovetailWear,
    Share,
    check_rows,
    check_shares,
)
from workflow.analyses.wear.structures.dovetail.flank_surfaces import MeasuredFlanks
from workflow.case.fields import AUTO, Auto, OrAuto, Quantity, Whole
from workflow.case.plausibility import pressed
from workflow.case.sections import Length, RoundingRadius, Section, disagreement, entry, together
from workflow.case.text.plain import plain, shares
from workflow.messages.warning_kinds import Notice, WarningKind

if TYPE_CHECKING:
    from fe_models.geometry.dovetail import Dovetail as Geometry
    from workflow.models.dovetail import DovetailMesh

Mass = Annotated[float, Quantity("t", at_least=0.0, at_most=1.0, range_text="0 to 1000 kg")]
FlankAngle = Annotated[
    float,
    Quantity("rad", at_least=radians(10), at_most=radians(80), range_text="10 deg to 80 deg"),
]
Skew = Annotated[
    float,
    Quantity("rad", at_least=radians(-30), at_most=radians(30), range_text="-30 deg to 30 deg"),
]
RotationSpeed = Annotated[
    float,
    Quantity(
        "rad/s", above=0.0, at_most=1e5 * pi / 30, range_text="above 0 and at most 100000 rpm"
    ),
]
Moment = Annotated[
    float, Quantity("N*mm", at_least=-1e9, at_most=1e9, range_text="-1e6 N*m to 1e6 N*m")
]
# Entry of measured surfaces.
SURFACES = "structure.surfaces"
# Signs of X at the flanks.
SIDES = {"intrados": 1, "extrados": -1}
LegIncrements = Annotated[int, Whole(1, 10_000)]
FlankNodes = Annotated[int, Whole(3, 2000)]


class DovetailSection(Section):
    """Blade root in a disk sector, in contact along two flanks (dovetail attachment)."""

    in_schema: ClassVar[Mapping[str, Any]] = together("end_width", "end_radius")
    kind: Literal["dovetail"] = entry("kind of structure", "dovetail")
    dimension: Literal[2, 3] = entry(
        "3, or 2: the section in the middle of the slot in plane strain, loads per length",
        3,
        default=3,
    )
    flank_angle: FlankAngle = entry("angle between the flank and the radial axis [rad]", "45 deg")
    flank_length: Length = entry(
        "length of the flat part of the flank, across the slot [mm]", "8 mm"
    )
    edge_radius: RoundingRadius = entry(
        "radius of the two flank edges along the slot [mm]", "30 mm"
    )
    edge_width: Length = entry("width of each rounded edge, beyond the flat [mm]", "1.5 mm")
    end_radius: RoundingRadius | None = entry(
        "radius of the flank at the slot ends; ignored in 2 dimensions [mm]",
        "150 mm",
        default=None,
    )
    end_width: Length | None = entry(
        "width of each rounded end, inside the slot length [mm]", "3 mm", default=None
    )
    neck_width: Length = entry("blade: width between the tops of the flanks [mm]", "20 mm")
    neck_fillet: Length = entry("blade: radius between neck and flank [mm]", "3 mm")
    slot_length: Length = entry("length of the slot, along its direction [mm]", "60 mm")
    slot_fillet: Length = entry("disk: radius at the bottom of the slot [mm]", "3 mm")
    root_depth: Length = entry("blade: depth below the flanks [mm]", "6 mm")
    shank_height: Length = entry(
        "blade: height of the shank, from the top of the flanks [mm]", "30 mm"
    )
    slot_clearance: Length = entry("clearance under the blade root [mm]", "1 mm")
    lug_height: Length = entry("disk: height above the top of the flanks [mm]", "6 mm")
    blades: Annotated[int, Whole(3, 1000)] = entry(
        "number of blades: the sector spans 360°/blades", 24
    )
    rim_radius: Length = entry("radius from the rotor axis to the top of the flanks [mm]", "250 mm")
    disk_height: Length = entry("radial height of the sector below the rim [mm]", "60 mm")
    skew: Skew = entry("angle of the slot to the rotor axis [rad]", "0 deg", default=0.0)
    sides: Literal["guided", "cyclic"] = entry(
        "sides of the disk's sector: guided along their planes, or cyclic: moving as those "
        "of the next sectors",
        "guided",
        default="guided",
    )
    surfaces: MeasuredFlanks | None = entry(
        "measured surfaces of the flanks, added to their form, about the middle of each; in "
        "dimension 2 profiles, the same all along the slot",
        default=None,
    )

    @property
    def flanks(self) -> str:
        """Sizes of the flanks in a line."""
        sizes = f"{plain(self.flank_length, 'mm')} flat at {plain(self.flank_angle, 'rad')}"
        rounded = f"{plain(self.edge_width, 'mm')} with {plain(self.edge_radius, 'mm')}"
        along = f", {plain(self.slot_length, 'mm')} long" if self.dimension == 3 else ""
        return f"{sizes}, edges rounded over {rounded}{along}"

    @property
    def face_width(self) -> float:
        """Width of a flank across the slot, with both rounded edges [mm]."""
        return self.flank_length + 2.0 * self.edge_width

    @property
    def face_depth(self) -> float:
        """Radial extent of the flank below the rim [mm]."""
        return self.face_width * cos(self.flank_angle)

    @property
    def root_width(self) -> float:
        """Width of the blade root at the bottom of the flanks [mm]."""
        return self.neck_width + 2.0 * self.face_width * sin(self.flank_angle)

    @model_validator(mode="after")
    def _plane_is_straight(self) -> DovetailSection:
        if self.dimension == 2 and self.skew != 0.0:
            raise disagreement(
                "2: the sections of a skewed slot differ; allowed: dimension 3, or skew 0",
                *("dimension", "skew"),
            )
        return self

    @model_validator(mode="after")
    def _sides_are_images(self) -> DovetailSection:
        if self.sides == "cyclic" and self.skew != 0.0:
            raise disagreement(
                "cyclic: the sides of a skewed slot's sector, which ends in planes, are not "
                "images of each other; allowed: guided, or skew 0",
                *("sides", "skew"),
            )
        return self

    @model_validator(mode="after")
    def _roundings_fit(self) -> DovetailSection:
        check_arcs(self)
        _require_below(self, "edge_width", self.flank_length / 2, "half the flank_length")
        if self.end_width is not None:
            _require_below(self, "end_width", self.slot_length / 2, "half the slot_length")
        elif self.dimension == 3:
            raise disagreement(
                "none: without rounding the pressure has no limit at the slot ends; allowed: "
                "end_width and end_radius, or dimension 2",
                *("end_width", "end_radius", "dimension"),
            )
        return self

    @model_validator(mode="after")
    def _root_fits_sector(self) -> DovetailSection:
        _require_below(self, "disk_height", self.rim_radius, "the rim_radius")
        depth = self.face_depth + self.slot_fillet
        if depth >= self.disk_height:
            raise disagreement(
                f"{self.disk_height:g} mm: too shallow for flanks and slot_fillet, which reach "
                f"{depth:.4g} mm below the rim; allowed: above {depth:.4g} mm",
                *("disk_height", "flank_length", "edge_width", "flank_angle", "slot_fillet"),
            )
        sector = 2.0 * (self.rim_radius - self.face_depth) * tan(pi / self.blades)
        if self.root_width >= sector:
            raise disagreement(
                f"{self.blades} blades: the sector is {sector:.4g} mm wide at the bottom of the "
                f"flanks, the blade root {self.root_width:.4g} mm; allowed: fewer blades or a "
                "narrower root",
                *("blades", "neck_width", "flank_length", "edge_width", "flank_angle"),
                "rim_radius",
            )
        return self

    @model_validator(mode="after")
    def _can_be_drawn(self) -> DovetailSection:
        try:
            self.geometry().check()
        except MeshError as error:
            raise disagreement(str(error)) from error
        return self

    def geometry(self) -> Geometry:
        """Return the joint as the mesher takes it."""
        from fe_models.geometry.dovetail import Dovetail as Geometry

        return Geometry(**self.model_dump(exclude={"kind", "dimension", "sides", "surfaces"}))

    def meshed(self, mesh: Mesh) -> StructureMesh:
        """Return the mesh of both bodies without measured surfaces. Raises MeshError.

        The mesh is cached, so that a check and the run that follows it share it.
        """
        from workflow.models.dovetail import dovetail_mesh

        return dovetail_mesh(self.geometry(), mesh.described(), self.dimension)


def _require_below(section: Section, key: str, limit: float, name: str) -> None:
    """Raise unless the length ``key`` is below ``limit`` [mm], called ``name`` in the message."""
    length = getattr(section, key)
    if length >= limit:
        limiting_key = name.rsplit(" ", 1)[-1]
        raise disagreement(
            f"{length:g} mm: too large; allowed: below {name}, {limit:g} mm", key, limiting_key
        )


class MissionOfMix(Section):
    """One of several missions; entries that it does not give are those of ``load_path``."""

    share: Share = entry("share of all cycles; the shares add up to 1 [1]", "100 %")
    rotation_speed: RotationSpeed | None = entry(
        "speed at the peak [rad/s]", "5000 rpm", default=None
    )
    aerodynamic_moment: Moment | None = entry(
        "moment at peak speed, about the slot; presses on the intrados [N*mm]",
        "20 N*m",
        default=None,
    )


class LoadPath(Section):
    """One mission: the speed rises linearly to its peak and falls back to zero.

    Centrifugal force and aerodynamic moment follow the square of the speed.
    """

    refused: ClassVar[Mapping[str, str]] = {
        "peak_at": "the first leg of increments: [8, 14] where the speed peaks at 8 of 22"
    }

    increments: Annotated[tuple[LegIncrements, LegIncrements] | Auto, OrAuto()] = entry(
        "increments up to the peak, and down from it; auto: as many as wear.tolerance needs",
        [8, 14],
    )
    rotation_speed: RotationSpeed = entry("speed at the peak [rad/s]", "6000 rpm")
    airfoil_mass: Mass = entry("mass of the blade outside the model [t]", "0.8 kg")
    airfoil_radius: Length = entry(
        "radius of the airfoil's centre of mass, from the rotor axis [mm]", "400 mm"
    )
    aerodynamic_moment: Moment = entry(
        "moment at peak speed, about the slot; presses on the intrados [N*mm]",
        "30 N*m",
        default=0.0,
    )
    mix: tuple[MissionOfMix, ...] = entry(
        "missions that alternate; without it there is one", default=()
    )

    @field_validator("increments", mode="before")
    @classmethod
    def _are_of_legs(cls, increments: object) -> object:
        if type(increments) is int:
            raise PydanticCustomError(
                "entry",
                "{count}: for a whole cycle; allowed: up to the peak and down from it, such as [8, "
                "14], or auto",
                {"count": increments},
            )
        return increments

    @model_validator(mode="after")
    def _shares_are_whole(self) -> LoadPath:
        check_shares(self.shares)
        return self

    @property
    def shares(self) -> tuple[float, ...]:
        """Share of each mission in all cycles."""
        return tuple(mission.share for mission in self.mix) or (1.0,)

    def missions(self) -> list[dict[str, Any]]:
        """Return the entries of every mission of the mix."""
        up, down = (0, 0) if self.increments == AUTO else self.legs
        counts = {"increments": up + down, "peak_at": up}
        entries = counts | self.model_dump(exclude={"mix", "increments"})
        missions = [
            mission.model_dump(exclude={"share"}, exclude_none=True) for mission in self.mix
        ]
        return [entries | mission for mission in missions or [{}]]

    @property
    def heaviest(self) -> int:
        """Index of the mission with the highest speed and, among equal ones, the largest moment."""
        peaks = [(m["rotation_speed"], abs(m["aerodynamic_moment"])) for m in self.missions()]
        return peaks.index(max(peaks))

    @property
    def legs(self) -> tuple[int, int]:
        """Increments up to the peak and after it, which must be chosen by then."""
        assert isinstance(self.increments, tuple)
        return self.increments


class Mesh(Section):
    """Tetrahedra of the structure."""

    flank_nodes: tuple[FlankNodes, FlankNodes] = entry(
        "number of nodes across the flank, along the slot", [21, 27], default=(21, 27)
    )
    size: Length = entry("distance of the nodes away from the flanks [mm]", "12 mm", default=12.0)
    notch: Annotated[int, Whole(8, 1000)] = entry(
        "nodes round a full circle of a fillet", 16, default=16
    )
    order: Literal[1, 2] = entry(
        "order of the tetrahedra, 1 or 2; those of order 2 join an odd number of flank nodes",
        2,
        default=2,
    )

    @model_validator(mode="after")
    def _nodes_make_elements(self) -> Mesh:
        if self.order == 2 and not all(count % 2 for count in self.flank_nodes):
            odd = [count + 1 - count % 2 for count in self.flank_nodes]
            raise disagreement(
                f"{list(self.flank_nodes)}: elements of order 2 have three nodes along an edge; "
                f"allowed: odd numbers, such as {odd}, or order 1",
                *("flank_nodes", "order"),
            )
        return self

    def described(self) -> DovetailMesh:
        """Return the mesh as the model takes it."""
        from workflow.models.dovetail import DovetailMesh

        return DovetailMesh(self.flank_nodes, self.size, self.notch, self.order)


class DovetailCase(FiniteElementCase):
    """A dovetail under its mission."""

    about: ClassVar[str] = "the built-in blade root in its disk, in space or in the plane"

    bodies: ClassVar[tuple[str, str]] = ("disk", "blade")

    structure: DovetailSection = entry(
        "lengths in the section across the slot unless named otherwise"
    )
    materials: BladeAndDiskMaterials = entry("the two bodies in contact")
    load_path: LoadPath = entry("one cycle")
    mesh: Mesh = entry("finite elements of the structure", default=Mesh())
    wear: DovetailWear = entry("law, length of the run and step")
    fidelity: Literal["fixed", "auto"] = entry(
        "fixed: as written; auto: probes choose dimension, increments, mesh, grid, tolerances, "
        "wear steps and drift as coarse as the accuracy allows",
        "fixed",
        default="fixed",
    )

    @property
    def legs(self) -> tuple[int, ...]:
        return (0, 0) if self.load_path.increments == AUTO else self.load_path.legs

    def divided(self, legs: Sequence[int]) -> dict[str, Any]:
        return {"load_path.increments": tuple(legs)}

    @property
    def loads_in_words(self) -> str:
        return ", ".join(self._peak_loads())

    def loads_outline(self) -> list[tuple[str, str]]:
        path, (across, along) = self.load_path, self.mesh.flank_nodes
        nodes = f"{across} x {along}" if self.structure.dimension == 3 else f"{across}"
        missions = f", {len(path.mix)} missions" if path.mix else ""
        peak = f", peak at {self.legs[0]}" if any(self.legs) else ""
        rows = [
            ("structure", f"dovetail in {self.structure.dimension}-D, {nodes} nodes on a flank"),
            ("flanks", self.structure.flanks),
            *(row for face in self.scanned() for row in face.outline()),
            ("load path", f"{self.increments_outline}{peak}{missions}"),
            ("peak load", self.loads_in_words),
        ]
        if self.fidelity == "auto":
            by_probes = f"2-D or 3-D and how fine: chosen by probes for {shares(self.accuracy)}"
            rows.append(("fidelity", by_probes))
        return rows

    def _peak_loads(self) -> Iterator[str]:
        """Yield the loads of the blade at the peak of its heaviest mission, in words."""
        heaviest = self.load_path.missions()[self.load_path.heaviest]
        yield plain(heaviest["rotation_speed"], "rad/s")
        mass, radius = self.load_path.airfoil_mass, self.load_path.airfoil_radius
        yield f"airfoil {plain(mass, 't')} at {plain(radius, 'mm')}: {plain(self._pull, 'N', 4)}"
        if moment := heaviest["aerodynamic_moment"]:
            yield f"moment {plain(moment, 'N*mm')}"

    @property
    def _pull(self) -> float:
        """Centrifugal force of the airfoil at the peak of the heaviest mission [N]."""
        path = self.load_path
        speed = path.missions()[path.heaviest]["rotation_speed"]
        return float(path.airfoil_mass * path.airfoil_radius * speed**2)

    @property
    def to_plane(self) -> dict[str, Any]:
        """Entries that turn the case into its plane-strain section, without measured surfaces."""
        entries: dict[str, Any] = {"structure.dimension": 2, "structure.skew": 0.0}
        return entries | ({} if self.structure.dimension == 2 else {SURFACES: None})

    def scanned(self) -> Iterator[ScannedFace]:
        if self.structure.surfaces is None:
            return
        faces = {face.name: face for face in self.structure.meshed(self.mesh).interfaces}
        for name, surfaces in self.structure.surfaces.flanks.items():
            grid = self._flank_grid(name)
            yield ScannedFace(name, f"{SURFACES}.{name}", surfaces, grid, faces[name])

    def remarks_on_nodes(self) -> Iterator[str]:
        yield from super().remarks_on_nodes()
        if self.structure.surfaces is not None and self.structure.dimension == 3:
            yield (
                "structure.surfaces: the section that chooses increments and estimates the error "
                "of the mesh does not have them"
            )

    def _flank_grid(self, name: str) -> Grid:
        """Return the contact grid over a flank."""
        size = self.structure.geometry().flank_size(SIDES[name])
        return Grid.over(size, self.contact.grid, self.structure.dimension == 2)

    def face_sides(self) -> tuple[float, float]:
        return self.structure.face_width, self.structure.slot_length

    def plausibility_warnings(self) -> Iterator[Notice]:
        yield from super().plausibility_warnings()
        width, length = self.face_sides()
        pressure = self._pull / (2.0 * width * length * cos(self.structure.flank_angle))
        yield from pressed("load_path", pressure, self.yields)
        # One of the flanks carries nothing if the pull acts outside of both.
        arm, moment = 0.5 * self.structure.neck_width, abs(self.load_path.aerodynamic_moment)
        if moment > arm * self._pull:
            yield Notice(
                WarningKind.FLANK_LIFTS,
                f"load_path.aerodynamic_moment: {plain(moment, 'N*mm')} would lift the blade off "
                f"a flank: it exceeds the pull of {plain(self._pull, 'N')} on half of the neck, "
                f"{plain(arm, 'mm')}",
            )
        yield from self.surface_warnings()

    @property
    def cores(self) -> int:
        return 2

    @model_validator(mode="after")
    def _ends_are_probed(self) -> DovetailCase:
        if self.fidelity == "auto" and self.structure.end_width is None:
            raise disagreement(
                "auto: compares two and three dimensions, for which structure.end_width and "
                "structure.end_radius are needed; allowed: these, or fidelity fixed",
                *("fidelity", "structure.end_width", "structure.end_radius"),
            )
        return self

    @model_validator(mode="after")
    def _grid_fits(self) -> DovetailCase:
        check_rows(self.contact.grid, line=self.structure.dimension == 2)
        return self

    @model_validator(mode="after")
    def _surfaces_fit(self) -> DovetailCase:
        """Refuse measured surfaces that do not fit a flank or automatic fidelity."""
        if self.structure.surfaces is None:
            return self
        if self.fidelity == "auto":
            raise disagreement(
                "auto: compares two and three dimensions, but measured surfaces belong to one of "
                "them; allowed: fidelity fixed, or no structure.surfaces",
                *("fidelity", SURFACES),
            )
        sizes = "structure.flank_length"
        for name, surfaces in self.structure.surfaces.flanks.items():
            surfaces.check(self._flank_grid(name), f"{SURFACES}.{name}", sizes)
        return self

    @model_validator(mode="after")
    def _airfoil_outside_disk(self) -> DovetailCase:
        radius, rim = self.load_path.airfoil_radius, self.structure.rim_radius
        if radius <= rim:
            raise disagreement(
                f"{radius:g} mm: the airfoil is inside the disk; "
                f"allowed: above structure.rim_radius, {rim:g} mm",
                *("load_path.airfoil_radius", "structure.rim_radius"),
            )
        return self
