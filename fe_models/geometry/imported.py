"""Bodies from a user's mesh or CAD file."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from fe_models.geometry.cad import read_cad
from fe_models.geometry.checked import checked_body, vector
from fe_models.meshes.curved_face import Midsides
from fe_models.meshes.remesh import element_volumes
from fe_models.meshes.structure_mesh import Body, MeshError, in_space
from fe_models.readers.abaqus.mesh import read_abaqus
from fe_models.readers.endings import CAD, EXODUS, EXPORT, NASTRAN, why_not_read
from fe_models.readers.exodus import read_exodus
from fe_models.readers.gmsh_file import read_msh
from fe_models.readers.grouped import DIMENSION, Blocks, GroupedMesh, nodes_of, split_blocks
from fe_models.readers.length_unit import SIZES, LengthUnit
from fe_models.readers.meshio_file import read_meshio
from fe_models.readers.nastran.mesh import read_nastran
from fe_models.readers.reader_process import read_in_subprocess, reading
from fe_models.readers.scene import Scene
from fe_models.readers.set_faces import faces_of_sets
from fe_models.readers.text_files import open_text
from fe_models.readers.unv import read_unv
from sa_solver import checks
from sa_solver.types import Array, Indices

# A mesh is plane when it is thinner than this share of its size.
PLANE = 1e-9
# A surface is closed when its total normal is below this share of the area, which is rounding.
CLOSED = 1e-9
# Lines that identify a ``.dat`` as Nastran's.
BULK_DATA = re.compile(r"\s*(GRID|BEGIN\s+BULK|CEND)\b", re.IGNORECASE)
# Source of a unit that the user has given.
GIVEN = "as given"


@dataclass(frozen=True)
class ImportedMesh:
    """Bodies of a file by name, each with its own nodes and named boundaries.

    Attributes
    ----------
    bodies
        The bodies by name.
    node_numbers
        The file's own numbers ``(n,)`` of each body's vertices.
    points
        Vertices in each named node set of the file that has any on that body.
    midsides
        Points in the middle of edges, for bodies for which the file has them.
    middles
        Edges ``(k, 2)`` whose midside nodes are in each of the node sets.
    unused
        Lines of the file that describe more than a mesh and are not imported.
    scene
        Materials, contacts, supports and loads of the file.
    axes
        Axes of the file that the bodies have: all, or the two of a plane.
    unit
        Unit of length of the file; lengths here are in mm.
    remarks
        Messages that the library which reads the file has printed.

    Examples
    --------
    A body of one tetrahedron, in Abaqus' format:

    >>> import tempfile
    >>> from pathlib import Path
    >>> from fe_models.geometry import read_bodies
    >>> text = '''*NODE
    ... 10, 0, 0, 0
    ... 20, 6, 0, 0
    ... 30, 0, 6, 0
    ... 40, 0, 0, 6
    ... *ELEMENT, TYPE=C3D4, ELSET=wedge
    ... 1, 10, 20, 30, 40
    ... '''
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "wedge.inp")
    ...     _ = file.write_text(text)
    ...     imported = read_bodies(file)
    >>> print(imported.node_numbers["wedge"], imported.bodies["wedge"].points[1])
    [10 20 30 40] [6. 0. 0.]
    """

    bodies: dict[str, Body]
    node_numbers: dict[str, Indices]
    points: dict[str, dict[str, Indices]]
    midsides: dict[str, Midsides] = field(default_factory=dict)
    middles: dict[str, dict[str, Indices]] = field(default_factory=dict)
    unused: tuple[str, ...] = ()
    scene: Scene = field(default_factory=Scene)
    axes: tuple[int, ...] = (0, 1, 2)
    unit: LengthUnit = field(default_factory=LengthUnit)
    remarks: tuple[str, ...] = ()

    @cached_property
    def set_faces(self) -> dict[str, dict[str, Indices]]:
        """Facets of the node sets of each body that are faces, by name."""
        return {name: faces_of_sets(body, self.points[name]) for name, body in self.bodies.items()}


@dataclass(frozen=True)
class Patch:
    """Size and position of a boundary: area [mm²], centroid ``(3,)`` [mm] and normal ``(3,)``.

    The normal is the outward one, averaged over the area and of length 1, or zero if the boundary
    is closed. In the plane the area is a length [mm].
    """

    area: float
    centroid: Array
    normal: Array


def read_bodies(path: Path, size: float | None = None, unit: str | None = None) -> ImportedMesh:
    """Read the bodies of a mesh file, or mesh those of a CAD file at ``size`` [mm].

    Formats are gmsh's ``.msh`` (:func:`read_msh`), Abaqus ``.inp`` (:func:`read_abaqus`), Nastran's
    ``.bdf``, ``.dat`` and ``.nas`` (:func:`read_nastran`), ``.unv`` (:func:`read_unv`), Exodus
    (:func:`read_exodus`), ``.step``, ``.stp`` and ``.brep`` (:func:`read_cad`), and those that
    meshio reads (:func:`read_meshio`).

    Elements are straight between their corners. Midside nodes on their edges determine the form of
    contact faces, and of elements of second order
    (:func:`fe_models.meshes.second_order.with_midsides`). Quadrilaterals, pyramids, wedges and
    hexahedra are split into triangles or tetrahedra. A plane mesh keeps the two coordinates that
    vary, in their order, as X and Z; whether its elements are of plane strain or plane stress is
    not read.

    Parameters
    ----------
    path
        The file.
    size
        Edge length of the mesh of a CAD file [mm]; None for a mesh file.
    unit
        Unit of length, one of ``SIZES``. By default it is the unit that the file states, or mm if
        it states none.

    Raises
    ------
    MeshError
        If the file cannot be read; if a body has flat, folded or duplicate elements or is in
        several pieces; if bodies share nodes; or if a boundary is not on the surface of one.

    Examples
    --------
    A plane quadrilateral of 4 mm by 3 mm becomes two triangles, and an edge of it is named:

    >>> import tempfile
    >>> from pathlib import Path
    >>> from fe_models.geometry import read_bodies
    >>> text = '''*NODE
    ... 1, 0, 0, 0
    ... 2, 4, 0, 0
    ... 3, 4, 3, 0
    ... 4, 0, 3, 0
    ... *ELEMENT, TYPE=CPE4, ELSET=plate
    ... 1, 1, 2, 3, 4
    ... *SURFACE, NAME=side
    ... plate, S2
    ... '''
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "plate.inp")
    ...     _ = file.write_text(text)
    ...     plate = read_bodies(file).bodies["plate"]
    >>> print(plate.mesh.nelements, "triangles,", plate.outward("side")[:, 0], "mm of side")
    2 triangles, [3.] mm of side
    """
    path = Path(path)
    if size is not None:
        checks.number("size", size, error=MeshError)
    with reading(path):
        grouped = _grouped(path, size, unit)
        try:
            return _separated(grouped)
        except MeshError as error:
            raise MeshError(f"{path}: {error}") from None


def _grouped(path: Path, size: float | None, unit: str | None) -> GroupedMesh:
    suffix = path.suffix.lower()
    if unit is not None:
        checks.choice("unit", unit, list(SIZES), MeshError)
    given = LengthUnit() if unit is None else LengthUnit(unit, SIZES[unit], GIVEN)
    if not path.is_file():
        raise MeshError(f"{path}: {'not a file' if path.exists() else 'no such file'}")
    if why := why_not_read(path.name):
        raise MeshError(f"{path}: {why}")
    if suffix in CAD:
        if size is None:
            raise MeshError(
                f"{path}: a CAD file needs a mesh size, as it is meshed here: --size '2 mm' of "
                "fretscale describe, mesh.size of a case"
            )
        return read_in_subprocess(read_cad, path, size, unit and given)
    if size is not None:
        raise MeshError(f"{path}: is a mesh already; a mesh size is for {', '.join(CAD)} only")
    if suffix == ".msh":
        mesh = read_in_subprocess(read_msh, path)
    else:
        mesh = _READERS.get(suffix, read_meshio)(path)
    return (mesh if unit is None else replace(mesh, unit=given)).in_millimetres()


def _read_dat(path: Path) -> GroupedMesh:
    """Read a ``.dat`` of Nastran, an ending that many other programs use, too."""
    with open_text(path) as file:
        if any(BULK_DATA.match(line) for line in file):
            return read_nastran(path)
    raise MeshError(
        f"{path}: has no bulk data of Nastran (GRID, CTETRA, ...); what Abaqus prints into a .dat, "
        f"Ansys' input and Tecplot's files are not read: {EXPORT}"
    )


_READERS: dict[str, Callable[[Path], GroupedMesh]] = {
    ".inp": read_abaqus, ".unv": read_unv, **dict.fromkeys(NASTRAN, read_nastran),
    ".dat": _read_dat, **dict.fromkeys(EXODUS, read_exodus),
}  # fmt: skip


def describe_bodies(imported: ImportedMesh) -> list[str]:
    """Return lines that list bodies, boundaries and node sets with their sizes and positions.

    Examples
    --------
    A body of one tetrahedron, in Abaqus' format, whose volume is 6³/6:

    >>> import tempfile
    >>> from pathlib import Path
    >>> from fe_models.geometry import describe_bodies, read_bodies
    >>> text = '''*NODE
    ... 10, 0, 0, 0
    ... 20, 6, 0, 0
    ... 30, 0, 6, 0
    ... 40, 0, 0, 6
    ... *ELEMENT, TYPE=C3D4, ELSET=wedge
    ... 1, 10, 20, 30, 40
    ... '''
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "wedge.inp")
    ...     _ = file.write_text(text)
    ...     for line in describe_bodies(read_bodies(file)):
    ...         print(line)
    lengths taken as mm, the file says no unit
    body wedge: 4 nodes, 1 tetrahedra, 6 x 6 x 6 mm, volume 36 mm³
    """
    lines = [f"lengths {imported.unit}"]
    for name, body in imported.bodies.items():
        volume = float(np.abs(element_volumes(body.mesh)).sum())
        solid = body.mesh.dim() == 3
        element, facet = ("tetrahedra", "triangles") if solid else ("triangles", "edges")
        measure, unit = ("area", "mm²") if solid else ("length", "mm")
        lines.append(
            f"body {name}: {body.mesh.nvertices} nodes, {body.mesh.nelements} {element}, "
            f"{extent(body.mesh.p)}, "
            + (f"volume {volume:.6g} mm³" if solid else f"area {volume:.6g} mm²")
        )
        for boundary in body.mesh.boundaries or {}:
            face = patch(body, boundary)
            lines.append(
                f"  boundary {boundary}: {len(body.facets(boundary))} {facet}, {measure} "
                f"{face.area:.6g} {unit}, centroid {vector(face.centroid)} mm, "
                + (f"normal {vector(face.normal)}" if np.any(face.normal) else "closed")
            )
        for points, vertices in imported.points[name].items():
            centre = body.points[vertices].mean(axis=0)
            form = f", a face of {facet}" * (points in imported.set_faces[name])
            lines.append(
                f"  node set {points}: {len(vertices)} nodes{form}, centroid {vector(centre)} mm"
            )
    lines += [f"not taken over: {line}" for line in imported.unused]
    return lines + [f"the reader reports: {remark}" for remark in imported.remarks]


def extent(points: Array) -> str:
    """Return the sides of a box around points ``(dim, n)`` [mm], as text."""
    return f"{' x '.join(f'{side:.4g}' for side in np.ptp(points, axis=1))} mm"


def patch(body: Body, boundary: str) -> Patch:
    """Return area, centroid and mean outward normal of a named boundary."""
    normals = body.outward(boundary)
    areas = np.linalg.norm(normals, axis=1)
    area, total = float(areas.sum()), normals.sum(axis=0)
    length = np.linalg.norm(total)
    return Patch(
        area=area,
        centroid=areas @ body.points[body.facets(boundary)].mean(axis=1) / area,
        normal=total / length if length > CLOSED * area else np.zeros(3),
    )


def _separated(grouped: GroupedMesh) -> ImportedMesh:
    """Give every body its own nodes, boundaries and node sets."""
    axes = _axes(grouped)
    coordinates = grouped.points[:, axes]
    cells = {name: split_blocks(blocks) for name, blocks in grouped.bodies.items()}
    owner = _owners(cells, len(coordinates))
    names = list(cells)
    surfaces = {
        name: _facets(name, blocks, owner) for name, blocks in grouped.surfaces.items() if blocks
    }
    bodies, numbers, points, midsides, middles = {}, {}, {}, {}, {}
    for number, name in enumerate(names):
        used = np.flatnonzero(owner == number)
        vertex = np.full(len(owner), -1)
        vertex[used] = np.arange(len(used))
        boundaries = {
            surface: vertex[facets[owner[facets[:, 0]] == number]]
            for surface, facets in surfaces.items()
            if np.any(owner[facets[:, 0]] == number)
        }
        bodies[name] = checked_body(name, coordinates[used], vertex[cells[name]], boundaries)
        numbers[name] = grouped.numbers[used]
        points[name] = {
            points_name: vertex[rows[owner[rows] == number]]
            for points_name, rows in grouped.node_sets.items()
            if np.any(owner[rows] == number)
        }
        if grouped.midsides is not None:
            edges = grouped.midsides.edges
            inside = np.all(owner[edges] == number, axis=1)
            places = in_space(grouped.midsides.points[inside][:, axes])
            midsides[name] = Midsides(vertex[edges[inside]], places)
            rows = grouped.midsides.rows
            assert rows is not None
            middles[name] = {
                points_name: vertex[edges[inside & np.isin(rows, grouped.node_sets[points_name])]]
                for points_name in points[name]
            }
    return ImportedMesh(
        bodies=bodies,
        node_numbers=numbers,
        points=points,
        midsides=midsides,
        middles=middles,
        unused=grouped.unused,
        scene=grouped.scene,
        axes=tuple(axes.tolist()),
        unit=grouped.unit,
        remarks=grouped.remarks,
    )


def _axes(grouped: GroupedMesh) -> Indices:
    """Return the axes of the coordinates: all three, or the two of a plane mesh that vary."""
    dimensions = {DIMENSION[shape] for blocks in grouped.bodies.values() for shape, _ in blocks}
    if dimensions not in ({2}, {3}):
        raise MeshError(
            "has no bodies of solid or plane elements"
            if not dimensions or dimensions & {0, 1}
            else "mixes solid and plane bodies; allowed: either"
        )
    used = nodes_of([block for blocks in grouped.bodies.values() for block in blocks])
    if not np.all(np.isfinite(grouped.points[used])):
        raise MeshError("has nodes whose coordinates are not finite numbers")
    if dimensions == {3}:
        return np.arange(3)
    extent = np.ptp(grouped.points[used], axis=0)
    varying = np.flatnonzero(extent > PLANE * extent.max())
    if len(varying) != 2:
        raise MeshError(
            "has surface elements only, and they are not in one plane x, y or z = constant; "
            "allowed: a plane mesh in such a plane, or solid elements"
        )
    return varying


def _owners(cells: dict[str, Indices], count: int) -> Indices:
    """Return the number of the body that each node belongs to ``(n,)``, or -1 for unused nodes."""
    owner = np.full(count, -1)
    names = list(cells)
    for number, (name, body) in enumerate(cells.items()):
        nodes = np.unique(body)
        taken = owner[nodes]
        if np.any(taken >= 0):
            other = taken[taken >= 0][0]
            raise MeshError(
                f"bodies {names[other]} and {name} share {np.sum(taken == other)} nodes: they are "
                "bonded, not in contact; put them into one group if they are one body, or give "
                "each its own nodes"
            )
        owner[nodes] = number
    return owner


def _facets(name: str, blocks: Blocks, owner: Indices) -> Indices:
    """Return the distinct facets of a surface. Raises unless each is on one body."""
    facets = np.unique(np.sort(split_blocks(blocks), axis=1), axis=0)
    owners = owner[facets]
    loose = np.sum((owners != owners[:, :1]).any(axis=1) | (owners[:, 0] < 0))
    if loose:
        raise MeshError(f"{loose} of the {len(facets)} facets of boundary {name} are on no body")
    return facets
