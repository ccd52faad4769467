"""Bodies of a mesh or CAD file of the user."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from workflow.analyses.wear.run_time import DISSIPATING, Extent
from workflow.analyses.wear.structure import WearStructure, memory, needs_no_matrices
from workflow.analyses.wear.structures.mesh.case import MeshCase
from workflow.errors import UserError
from workflow.shell.memory import Memory

if TYPE_CHECKING:
    from workflow.models.structure_model import StructureModel


def _model(case: MeshCase) -> StructureModel:
    # Finite elements take a second to import, so they are imported only where they are used.
    from workflow.analyses.wear.structures.mesh.model import mesh_assembly

    return mesh_assembly(case)


def _extent(case: MeshCase) -> Extent:
    """Return the extent of the loads, from the file that a check reads anyway."""
    mesh, cycles = case.structure.mesh(case.mesh.size), max(1, len(case.load_path.mix))
    return Extent(
        cycles * sum(case.expected_legs),
        len(mesh.interfaces),
        mesh.node_count(1),
        sum(len(interface) for interface in mesh.interfaces),
        dissipating=DISSIPATING,
    )


def _memory(case: MeshCase, nodes: int = 0, interface_nodes: int = 0) -> Memory:
    bodies = 2 + len(case.structure.other_bodies)
    sparse = needs_no_matrices(case, case.mesh.order)
    return memory(case, nodes, interface_nodes, bodies=bodies, sparse=sparse)


def _choose(case: MeshCase) -> tuple[MeshCase, dict[str, Any] | None]:
    if any(case.legs):
        return case, None
    from fe_models.meshes.structure_mesh import MeshError
    from workflow.analyses.wear.increments import choose_increments
    from workflow.analyses.wear.structures.mesh.model import mesh_assembly

    extent = _extent(case)
    _memory(case, int(extent.nodes), int(extent.interface_nodes)).check()
    try:
        return choose_increments(case, mesh_assembly)
    except MeshError as error:
        raise UserError(f"structure: {error}") from error


def _settings(case: MeshCase) -> dict[str, str]:
    """Return the setting that reduces the error of the mesh; only CAD is meshed at a size."""
    size = case.mesh.size
    finer = "a finer mesh" if size is None else f"mesh.size: {0.5 * size:g} mm"
    return {"mesh": f"mesh.order: 2, or {finer}" if case.mesh.order == 1 else finer}


STRUCTURE = WearStructure(
    name="mesh",
    case=MeshCase,
    model=_model,
    extent=_extent,
    memory=_memory,
    choose=_choose,
    settings=_settings,
)
