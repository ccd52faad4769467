"""The mesh or CAD file of a case, its unit of length, and plausibility of sizes and loads.

A mesh in m that is read as mm is a thousand times too small, and nothing in the file shows it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np

from fe_models.readers.endings import READ, why_not_read
from fe_models.readers.length_unit import SIZES
from workflow.analyses.wear.structures.mesh.load import MeshLoad
from workflow.analyses.wear.structures.mesh.loads import (
    DisplacementLoad,
    ForceLoad,
    MomentLoad,
    RotationLoad,
)
from workflow.case.fields import File, Word
from workflow.case.plausibility import WEAK, pressed
from workflow.case.text.plain import plain
from workflow.messages.warning_kinds import Notice, WarningKind

if TYPE_CHECKING:
    from fe_models.geometry.imported import ImportedMesh
    from fe_models.meshes.structure_mesh import Body
    from workflow.analyses.wear.structures.mesh.contacts import MeshMaterial

LengthName = Annotated[str, Word(tuple(SIZES))]
# Usual range of the longest side of bodies in contact [mm], and units of files by likelihood.
USUAL, UNITS = (0.5, 1e4), ("mm", "m", "um", "in")
# Largest plausible displacement of a face, relative to its body.
MOVED = 0.5


@dataclass(frozen=True)
class MeshFile(File):
    """A file with a mesh or a shape, recognised by its ending in upper or lower case."""

    endings: tuple[str, ...] = READ

    def wrong_name(self, name: str) -> str:
        return why_not_read(name)


def lengths_outline(imported: ImportedMesh, names: tuple[str, ...]) -> str:
    """Return the unit of length, and the box round all bodies of the case."""
    from fe_models.geometry.imported import extent

    points = np.concatenate([imported.bodies[name].mesh.p for name in names], axis=1)
    return f"{imported.unit}; bodies within {extent(points)}"


def size_warnings(
    imported: ImportedMesh, solids: Mapping[str, MeshMaterial], loads: Sequence[MeshLoad]
) -> Iterator[Notice]:
    """Yield plausibility warnings about sizes of bodies, by themselves and with the loads."""
    from fe_models.geometry.imported import GIVEN

    bodies = [imported.bodies[name] for name in solids]
    side = float(np.ptp(np.concatenate([body.points for body in bodies]), axis=0).max())
    if not USUAL[0] <= side <= USUAL[1]:
        text = f"structure.length_unit: {_unusual(imported, side)}"
        yield Notice(WarningKind.UNUSUAL_LENGTH, text)
    elif imported.unit.name == "m" and imported.unit.source != GIVEN:
        yield Notice(
            WarningKind.UNUSUAL_LENGTH,
            f"structure.length_unit: lengths are {imported.unit}, which gives bodies of "
            f"{plain(side, 'mm', 4)}; Salome and FreeCAD write this unit into every mesh: give mm "
            "or m here",
        )
    yield from _loads(loads, imported, solids)


def _unusual(imported: ImportedMesh, side: float) -> str:
    """Return a description of an unusual size, and a unit that would make it usual."""
    least, most = (plain(usual, "mm") for usual in USUAL)
    sizes = f"bodies of {plain(side, 'mm', 4)}, lengths {imported.unit}; usual: {least} to {most}"
    for name in UNITS:
        meant = side / imported.unit.size * SIZES[name]
        if USUAL[0] <= meant <= USUAL[1]:
            return f"{sizes}; {plain(meant, 'mm', 4)} if they are in {name}"
    return sizes


def _loads(
    loads: Sequence[MeshLoad], imported: ImportedMesh, solids: Mapping[str, MeshMaterial]
) -> Iterator[Notice]:
    """Yield warnings about loads too large for the bodies, or all of them too small."""
    bodies = [imported.bodies[name] for name in solids]
    stresses: dict[str, float] = {}
    for index, load in enumerate(loads):
        key, most = f"structure.loads.{index}", max(map(abs, load.path))
        if isinstance(load, DisplacementLoad):
            yield from _moved(key, load, most, imported, bodies)
        stress = _stress(load, imported, solids)
        # An unknown stress counts as neither large nor small.
        stresses[key] = WEAK if stress is None else stress * most
    strongest = max(stresses, key=lambda key: stresses[key])
    moduli = [solid.young for solid in solids.values()]
    yields = [solid.yield_stress for solid in solids.values()]
    yield from pressed(strongest, stresses[strongest], yields, moduli)


def _moved(
    key: str, load: DisplacementLoad, most: float, imported: ImportedMesh, bodies: list[Body]
) -> Iterator[Notice]:
    """Yield a warning about a face whose displacement is large compared with its body."""
    motion = most * float(np.linalg.norm(load.displacement))
    for body in bodies:
        side = float(np.ptp(body.points, axis=0).max())
        if _area(imported, body, load.group) and motion > MOVED * side:
            yield Notice(
                WarningKind.UNUSUAL_LOAD,
                f"{key}.displacement: moves {body.name}, which is {plain(side, 'mm', 4)} long, by "
                f"{plain(motion, 'mm', 4)}: are its unit and that of the mesh right?",
            )


def _stress(
    load: MeshLoad, imported: ImportedMesh, solids: Mapping[str, MeshMaterial]
) -> float | None:
    """Return an estimate of the stress due to a load [MPa], None if the load allows none."""
    bodies = [imported.bodies[name] for name in solids]
    if isinstance(load, RotationLoad):
        axis = np.array(load.axis) / np.linalg.norm(load.axis)
        return max(
            (solid.density or 0.0)
            * load.speed**2
            * float(np.sum(np.cross(body.points - load.through, axis) ** 2, axis=1).max())
            for solid, body in zip(solids.values(), bodies, strict=True)
        )
    if not isinstance(load, ForceLoad | MomentLoad):
        return None
    area = sum(_area(imported, body, load.group) for body in bodies)
    if not area:
        return None
    if isinstance(load, ForceLoad):
        return float(np.linalg.norm(load.force)) / area
    # The face is taken as square; in the plane it is a slice of 1 mm.
    arm = area if bodies[0].mesh.dim() == 2 else area**0.5
    return float(np.linalg.norm(load.moment)) / (area * arm)


def _area(imported: ImportedMesh, body: Body, group: str) -> float:
    """Return the area of a boundary or of a node set that is a face [mm²]; 0 if there is none."""
    facets = (body.mesh.boundaries or {}).get(group)
    if facets is None:
        facets = imported.set_faces[body.name].get(group)
    if facets is None:
        return 0.0
    return float(np.linalg.norm(body.outward_of(facets), axis=1).sum())
