"""Translation of a mesh case into a model of its structure."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from fe_models.meshes.structure_mesh import Interface
from sa_solver.types import Array, Grid
from workflow.analyses.wear.case.scanned import ScannedFace
from workflow.analyses.wear.gaps import gap_over
from workflow.analyses.wear.structures.dovetail.model import added_gap
from workflow.analyses.wear.structures.mesh.case import MeshCase
from workflow.analyses.wear.structures.mesh.pretension import BoltLoad
from workflow.models.assembly import LegPath, MeshAssembly, TightenedBolt
from workflow.models.faces import face_size
from workflow.models.gaps import AddedGap


def mesh_assembly(case: MeshCase) -> MeshAssembly:
    """Return the bodies of the file with supports, loads and cycle as the case gives them."""
    structure, path, size = case.structure, case.load_path, case.mesh.size
    advice = "refine the file's mesh there" if size is None else "lower mesh.size"
    if case.mesh.order == 1:
        advice += ", or take mesh.order: 2"
    mesh = structure.mesh(size, case.mesh.order)
    return MeshAssembly(
        imported=structure.read(size),
        bodies={name: solid.elastic() for name, solid in case.solids.items()},
        contacts=tuple(pair.described(structure.bodies_of(pair)) for pair in structure.contacts),
        supports=tuple(support.described() for support in structure.supports),
        loads=tuple(load.described() for load in structure.loads),
        path=LegPath(
            increments=path.legs,
            factors=tuple(load.path for load in structure.loads),
            cycle_from=path.cycle_from,
            peak_leg=path.peak_leg,
            mix=tuple(path.mixed(len(structure.loads))),
        ),
        bolts_tightened=tuple(
            TightenedBolt(place, load.name, load.tension)
            for place, load in enumerate(structure.loads)
            if isinstance(load, BoltLoad)
        ),
        cyclic=tuple(cuts.described() for cuts in structure.cyclic),
        order=case.mesh.order,
        added=dict(_added(case, mesh.interfaces)),
        nonlinearity=case.nonlinearity.described(),
        finer=advice,
        joined=mesh,
    )


def _added(case: MeshCase, interfaces: tuple[Interface, ...]) -> Iterator[tuple[str, AddedGap]]:
    """Return the gaps that the case adds to those of the meshes, by the name of the contact."""
    scanned = {face.name: face for face in case.scanned()}
    for interface in interfaces:
        shape = _shape(case, interface)
        if (scan := scanned.get(interface.name)) is None:
            if shape is not None:
                yield interface.name, shape
        elif shape is None:
            yield interface.name, added_gap(scan)
        else:
            yield interface.name, _both(shape, scan)


def _shape(case: MeshCase, interface: Interface) -> AddedGap | None:
    """Return the shape that the case gives the gap of an interface, if it does."""
    (pair,) = (p for p in case.structure.contacts if p.name == interface.name)
    if pair.gap is None:
        return None
    grid = case.terms(interface.name).grid
    return AddedGap(gap_over(pair.gap, None, Grid.over(face_size(interface), grid, interface.line)))


def _both(shape: AddedGap, scan: ScannedFace) -> AddedGap:
    """Return the sum of a shape and of surfaces as measured."""
    measured = added_gap(scan)
    return AddedGap(measured.on(shape.over), partial(_nodal_sum, shape, measured))


def _nodal_sum(shape: AddedGap, measured: AddedGap, face: Interface) -> Array:
    return shape.at_nodes(face) + measured.at_nodes(face)
