"""A case whose loads come from a file of another finite element code."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import model_validator

from sa_solver.load_history import LoadHistory
from sa_solver.types import Frame, Grid
from workflow.analyses.contact.case import BodyMaterial
from workflow.analyses.contact.surfaces import MeasuredSurfaces
from workflow.analyses.wear.case.base import WearCase, check_interface_name
from workflow.analyses.wear.case.gaps import Gap, GapShape, check_cells, check_gap
from workflow.analyses.wear.case.scanned import ScannedFace
from workflow.analyses.wear.case.sections import ContactSection, TwoBodies, WearSection, check_rows
from workflow.analyses.wear.structures.resultants.faces import FaceError
from workflow.analyses.wear.structures.resultants.imported import ImportedLoads
from workflow.case.fields import File, Quantity, ScalarOrList, shown, split_dataset
from workflow.case.files.input_files import InputFileError
from workflow.case.plausibility import pressed, uneven_cells
from workflow.case.sections import Length, Section, Title, disagreement, entry
from workflow.case.text.plain import between, plain, shape_in_words
from workflow.messages.warning_kinds import Notice

# Deviation of x and normal from a right angle that is accepted, for numbers with six digits.
PERPENDICULAR = 1e-6
# Tangential forces below this share of the normal force are rounding.
NOTHING = 1e-9

Place = Annotated[float, Quantity("mm", at_least=-1e6, at_most=1e6)]
Direction = Annotated[float, Quantity("1", at_least=-1e6, at_most=1e6)]
Sizes = Annotated[tuple[Length, ...], ScalarOrList()]
NodeFile = Annotated[str, File((".csv",))]

# --- faces --------------------------------------------------------------------------------------


class FaceFrame(Section):
    """Position of a face in the user's axes; y is normal × x."""

    origin: tuple[Place, Place, Place] = entry(
        "centre of the face [mm]", ["15 mm", "0 mm", "245 mm"]
    )
    x: tuple[Direction, Direction, Direction] = entry(
        "direction along the face, in which body 2 slides out, of any length [1]", [-1.0, 0.0, 1.0]
    )
    normal: tuple[Direction, Direction, Direction] = entry(
        "direction out of body 1 into body 2, of any length [1]", [-1.0, 0.0, -1.0]
    )

    @model_validator(mode="after")
    def _is_right_angled(self) -> FaceFrame:
        x, normal = np.array(self.x), np.array(self.normal)
        lengths = float(np.linalg.norm(x) * np.linalg.norm(normal))
        if lengths == 0.0 or abs(x @ normal) > PERPENDICULAR * lengths:
            raise disagreement(
                "x and normal are not at right angles; allowed: perpendicular directions, none "
                "of length 0",
                "x",
                "normal",
            )
        return self

    def frame(self) -> Frame:
        """Return the frame, with axes of length 1."""
        normal = np.array(self.normal) / np.linalg.norm(self.normal)
        x = np.array(self.x) - (np.array(self.x) @ normal) * normal
        x /= np.linalg.norm(x)
        return Frame(np.array(self.origin), np.array([x, np.cross(normal, x), normal]))


class NodeTables(Section):
    """Node numbers and global coordinates of each body's face, for the worn surfaces."""

    body_1: NodeFile | None = entry("columns node, X, Y, Z", "nodes_1.csv", default=None)
    body_2: NodeFile | None = entry("columns node, X, Y, Z", "nodes_2.csv", default=None)


class ImportedInterface(Section):
    """An interface of the file, with its own settings."""

    name: Title = entry("name in the file; 'interface' if it has no names", "interface")
    size: Sizes | None = entry(
        "size, instead of structure.size [mm]", ["11 mm", "60 mm"], default=None
    )
    gap: Gap | None = entry("gap, instead of structure.gap", default=None)
    surfaces: MeasuredSurfaces | None = entry(
        "measured surfaces, instead of structure.surfaces", default=None
    )
    frame: FaceFrame | None = entry("place of the face, instead of that in the file", default=None)
    nodes: NodeTables | None = entry(
        "nodes that the worn surfaces go to; needs a frame", default=None
    )


class Resultants(Section):
    """Loads from a file, over nominal faces with the gap of the unloaded bodies."""

    kind: Literal["resultants"] = entry("kind of structure", "resultants")
    dimension: Literal[2, 3] = entry(
        "3, or 2: line contacts in plane strain, loads per length", 3, default=3
    )
    file: Annotated[str, File((".csv", ".h5", ".hdf5"))] = entry(
        "file with the loads of one closed cycle (columns: docs, loads of another code); .h5 "
        "may name a :group",
        "loads.csv",
    )
    size: Sizes = entry(
        "size of every face and the contact grid, along x and y; in 2 dimensions along x "
        "alone [mm]",
        ["11 mm", "60 mm"],
    )
    gap: Gap | None = entry(
        "gap of the unloaded bodies over every face; without it 'height' of an HDF5 file",
        default=None,
    )
    surfaces: MeasuredSurfaces | None = entry(
        "measured surfaces of every face, added to the gap, or in place of it",
        default=None,
    )
    interfaces: tuple[ImportedInterface, ...] = entry(
        "interfaces to use, and what differs on them; without it all of the file", default=()
    )

    @model_validator(mode="after")
    def _sizes_are_whole(self) -> Resultants:
        sizes = {"size": self.size} | {
            f"interfaces.{number}.size": interface.size
            for number, interface in enumerate(self.interfaces)
            if interface.size is not None
        }
        for key, size in sizes.items():
            if len(size) != 2 and not (len(size) == 1 and self.dimension == 2):
                allowed = "[x, y]" if self.dimension == 3 else "x, or [x, y]"
                raise disagreement(f"{shown(size)}: not a size; allowed: {allowed}", key)
        return self

    @property
    def line(self) -> bool:
        """True if the contacts are line contacts."""
        return self.dimension == 2

    def size_of(self, name: str) -> tuple[float, float]:
        """Return the extent of a face along x and y [mm]; a line contact is 1 mm long."""
        size = self._interface(name).size or self.size
        return size[0], 1.0 if self.line else size[1]

    def gap_of(self, name: str) -> GapShape | None:
        """Return the gap over a face, or None if it comes from the file."""
        return self._interface(name).gap or self.gap

    def surfaces_of(self, name: str) -> MeasuredSurfaces | None:
        """Return the measured surfaces of a face, or None."""
        return self._interface(name).surfaces or self.surfaces

    def frame_of(self, name: str) -> Frame | None:
        """Return the frame of a face, or None if the case gives none."""
        frame = self._interface(name).frame
        return None if frame is None else frame.frame()

    def nodes_of(self, name: str) -> dict[Literal[1, 2], str]:
        """Return the node tables of a face by body."""
        nodes = self._interface(name).nodes or NodeTables()
        files: dict[Literal[1, 2], str | None] = {1: nodes.body_1, 2: nodes.body_2}
        return {body: file for body, file in files.items() if file is not None}

    def _interface(self, name: str) -> ImportedInterface:
        """Return the settings of an interface; empty ones unless the case names it."""
        named = {interface.name: interface for interface in self.interfaces}
        return named.get(name) or ImportedInterface(name=name)

    def key_of(self, name: str, key: str) -> str:
        """Return the dotted path of a face's entry, that of its interface if it is given there."""
        for number, interface in enumerate(self.interfaces):
            if interface.name == name and getattr(interface, key.partition(".")[0]) is not None:
                return f"structure.interfaces.{number}.{key}"
        return f"structure.{key}"

    def read(self, friction: float) -> dict[str, ImportedLoads]:
        """Return the loads of all interfaces of the file, by name. Raises InputFileError."""
        from workflow.analyses.wear.structures.resultants.reading import read_resultants

        # The faces' sizes bound the moments, so the first reading only finds out which faces there
        # are.
        names = read_resultants(self.file, self.line)
        sizes = {name: self.size_of(name) for name in names}
        return read_resultants(self.file, self.line, friction, sizes)

    def taken(self, loads: dict[str, ImportedLoads]) -> dict[str, ImportedLoads]:
        """Return those of the loads in the file that the case uses."""
        names = [interface.name for interface in self.interfaces] or list(loads)
        return {name: loads[name] for name in names}


class ImportedContact(ContactSection):
    """Half-space solution on a grid over each contact face."""

    method: Literal["normal", "full"] = entry(
        "full: pressure and slips of the half-space; normal: slips of the file, which must be HDF5",
        "full",
        default="full",
    )


class SurfaceMaterials(TwoBodies[BodyMaterial]):
    """The two bodies in contact."""


# --- the case -----------------------------------------------------------------------------------


class ResultantsCase(WearCase):
    """Contacts under loads from a file."""

    about: ClassVar[str] = "contacts under loads from another finite-element code, as CSV or HDF5"

    title: Title = entry("one line", "Contacts under loads of another code")
    structure: Resultants = entry("the loads, and the faces they press")
    materials: SurfaceMaterials = entry("the two bodies in contact")
    contact: ImportedContact = entry(
        "half-space grid over each contact face", default=ImportedContact()
    )
    wear: WearSection = entry("law, length of the run and step")

    def loads(self) -> dict[str, ImportedLoads]:
        """Return the loads of the interfaces in use, by name. Raises InputFileError."""
        return self.structure.taken(self.structure.read(self.friction.at(0.0)))

    @property
    def cells(self) -> tuple[int, int]:
        """Cells of the contact grid along x and y."""
        nx, ny = self.contact.grid
        return nx, 1 if self.structure.line else ny

    @property
    def cores(self) -> int:
        return len(self.loads())

    @property
    def loads_in_words(self) -> str:
        file = Path(split_dataset(self.structure.file)[0]).name
        return f"loads in {self.structure.dimension}-D from {file}"

    def loads_outline(self) -> list[tuple[str, str]]:
        loads = self.loads()
        first = next(iter(loads.values()))
        unit = "N/mm" if self.structure.line else "N"
        slip = "with" if first.slip is not None else "without"
        return [
            ("structure", f"{self.loads_in_words}, {slip} slip"),
            ("load path", f"{len(first.loads)} increments"),
            *(
                (
                    "face",
                    f"{name}, {_ranges(imported.loads, unit)}, {self._shape(name, imported)}, "
                    f"tilt {imported.tilt}",
                )
                for name, imported in loads.items()
            ),
            *(row for face in self.scanned() for row in face.outline()),
        ]

    def scanned(self) -> Iterator[ScannedFace]:
        for name in self.loads():
            yield from self._scanned(name)

    def _scanned(self, name: str) -> Iterator[ScannedFace]:
        """Yield the face of that name, if it has measured surfaces."""
        structure = self.structure
        surfaces = structure.surfaces_of(name)
        if surfaces is not None:
            grid = Grid.over(structure.size_of(name), self.contact.grid, structure.line)
            yield ScannedFace(name, structure.key_of(name, "surfaces"), surfaces, grid)

    def _shape(self, name: str, loads: ImportedLoads) -> str:
        size, gap = self.structure.size_of(name), self.structure.gap_of(name)
        unnamed = "plane" if loads.height is None else "heights of the file"
        sides = f"{size[0]:g} mm" if self.structure.line else f"{size[0]:g} x {size[1]:g} mm"
        return f"{sides}, {unnamed if gap is None else shape_in_words(gap)}"

    def plausibility_warnings(self) -> Iterator[Notice]:
        yield from super().plausibility_warnings()
        for name, imported in self.loads().items():
            x, y = sides = self.structure.size_of(name)
            yield from pressed(
                "structure.file", float(imported.loads.P.max()) / (x * y), self.yields
            )
            if not self.structure.line:
                yield from uneven_cells(sides, self.cells)
        yield from self.surface_warnings()

    @model_validator(mode="after")
    def _loads_can_be_used(self) -> ResultantsCase:
        check_rows(self.contact.grid, self.structure.line)
        try:
            in_file = self.structure.read(self.friction.at(0.0))
        except InputFileError as error:
            raise disagreement(str(error), "structure.file") from error
        self._check_names(list(in_file))
        loads = self.structure.taken(in_file)
        if not any(imported.loads.P.any() for imported in loads.values()):
            raise disagreement(
                "P is 0 in every increment; allowed: loads that press", "structure.file"
            )
        for name, imported in loads.items():
            self._check_slip(imported)
            self._check_gap(name, imported)
            self._check_nodes(name, imported)
        return self

    def _check_names(self, in_file: list[str]) -> None:
        """Refuse interfaces that are not in the file, given twice, or named as a result is."""
        named = [interface.name for interface in self.structure.interfaces]
        for number, name in enumerate(named):
            key = f"structure.interfaces.{number}.name"
            if name not in in_file:
                allowed = ", ".join(in_file)
                raise disagreement(f"{shown(name)}: not in the file; allowed: {allowed}", key)
            if name in named[:number]:
                raise disagreement(f"{shown(name)}: given twice; allowed: once", key)
        for name in named or in_file:
            check_interface_name(name, "structure.file")

    def _check_slip(self, loads: ImportedLoads) -> None:
        if self.contact.method == "normal" and loads.slip is None:
            raise disagreement(
                f"normal: no slip in {self.structure.file}; allowed: full, or an HDF5 file with "
                "slip",
                *("contact.method", "structure.file"),
            )

    def _check_gap(self, name: str, loads: ImportedLoads) -> None:
        structure, gap = self.structure, self.structure.gap_of(name)
        key, beside = structure.key_of(name, "gap"), structure.key_of(name, "size")
        for face in self._scanned(name):
            face.surfaces.check(face.grid, face.key, beside)
        if gap is not None:
            check_gap(gap, structure.size_of(name), self.cells, structure.line, key, beside)
        elif loads.height is None and structure.surfaces_of(name) is None:
            raise disagreement(
                f"missing, and {structure.file} has no height of {name}; allowed: shape rounded, "
                "paraboloid or heights, with the entries of each, or measured surfaces",
                key,
            )
        elif loads.height is not None:
            check_cells(loads.height.shape, structure.file, self.cells)

    def _check_nodes(self, name: str, loads: ImportedLoads) -> None:
        from workflow.analyses.wear.worn.worn_nodes import check_nodes

        structure = self.structure
        frame = structure.frame_of(name) or loads.frame
        for body, file in structure.nodes_of(name).items():
            key = structure.key_of(name, f"nodes.body_{body}")
            if frame is None:
                raise disagreement(
                    f"nodes of {name} without its frame; allowed: frame and nodes", key
                )
            try:
                check_nodes(file, frame, structure.size_of(name), structure.line)
            except InputFileError as error:
                raise disagreement(str(error), key) from error
            except FaceError as error:
                raise disagreement(f"{file}: {error}", key) from error


def _ranges(loads: LoadHistory, unit: str) -> str:
    """Return the ranges of P, and of Qx and Qy if they act, in a cycle, in words."""
    low, high = float(loads.P.min()), float(loads.P.max())
    ranges = [f"P {between(low, high, unit) if low else f'up to {plain(high, unit)}'}"]
    if low == high:
        ranges = [f"P {plain(high, unit)}"]
    for name in ("Qx", "Qy"):
        force = getattr(loads, name)
        if np.abs(force).max() > NOTHING * loads.P.max():
            ranges.append(f"{name} {between(force.min(), force.max(), unit)}")
    return ", ".join(ranges)
