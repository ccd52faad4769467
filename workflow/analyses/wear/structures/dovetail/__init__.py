"""A blade root in a disk sector, in contact along two flanks."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi, prod
from typing import TYPE_CHECKING, Any

from workflow.analyses.wear.approximations.ladders import flank_mesh, slot_mesh
from workflow.analyses.wear.run_time import DISSIPATING, Extent
from workflow.analyses.wear.structure import SPECTRA, WearStructure, memory, needs_no_matrices
from workflow.analyses.wear.structures.dovetail.case import DovetailCase
from workflow.messages.warning_kinds import Notice
from workflow.shell.memory import Memory

if TYPE_CHECKING:
    from workflow.models.contact import FaceContact
    from workflow.models.structure_model import StructureModel

# Stored fields per cell and increment: slips, depths per pressure, pressures, starts.
FIELDS = 12
# Nodes of both bodies in space: per node of a flank, by the order of the elements, and by their
# volume.
FLANK_NODES, VOLUME_NODES = {1: 40.0, 2: 50.0}, 1.5


def _model(case: DovetailCase) -> StructureModel:
    # Finite elements take a second to import, so they are imported only where they are used.
    from workflow.analyses.wear.structures.dovetail.model import dovetail_joint

    return dovetail_joint(case)


def _memory(case: DovetailCase, nodes: int = 0, interface_nodes: int = 0) -> Memory:
    """Return the memory of a run.

    In space, flank nodes are known, those of both bodies are estimated before they are meshed, and
    all increments are stored.
    """
    kept = SPECTRA
    if case.structure.dimension == 3:
        interface_nodes = 2 * prod(case.mesh.flank_nodes)
        nodes = nodes or int(_extent(case).nodes)
        kept = 2 * len(case.load_path.shares) * sum(case.expected_legs) * FIELDS
    remedy = "lower mesh.flank_nodes, mesh.notch, mesh.order or contact.grid, or raise mesh.size"
    mirrored = case.structure.dimension == 3 and case.structure.skew == 0.0
    sparse = needs_no_matrices(case, case.mesh.order)
    return memory(case, nodes, interface_nodes, kept, remedy, mirrored=mirrored, sparse=sparse)


def _extent(case: DovetailCase) -> Extent:
    """Return the extent of the loads; in space, nodes are counted from the flanks inwards."""
    across, along = case.mesh.flank_nodes
    structure, faces = case.structure, 2
    increments = len(case.load_path.shares) * sum(case.expected_legs)
    section = Extent(increments, faces, 0.0, faces * across, dissipating=DISSIPATING)
    if structure.dimension == 2:
        return section
    sector = 2.0 * pi * structure.rim_radius / structure.blades * structure.disk_height
    blade = structure.shank_height * structure.neck_width
    volume = (sector + blade) * structure.slot_length
    of_flanks = FLANK_NODES[case.mesh.order] * across * along
    nodes = of_flanks + VOLUME_NODES * volume / case.mesh.size**3
    return Extent(
        increments, faces, nodes, faces * across * along, dissipating=DISSIPATING, section=section
    )


def _choose(case: DovetailCase) -> tuple[DovetailCase, dict[str, Any] | None]:
    if case.fidelity == "auto":
        from workflow.analyses.wear.fidelity.choosing import choose

        return choose(case)
    if any(case.legs):
        return case, None
    from workflow.analyses.wear.increments import choose_increments
    from workflow.analyses.wear.structures.dovetail.model import section_joint

    return choose_increments(case, section_joint)


def _warnings(case: DovetailCase, stage: FaceContact, load: float) -> Iterator[Notice]:
    from workflow.analyses.wear.structures.dovetail.edge_peaks import warnings

    return warnings(case, stage, load)


def _settings(case: DovetailCase) -> dict[str, str]:
    """Return the settings that reduce the errors of meshes and link: elements of half the size."""
    mesh = flank_mesh(case, 2.0)
    nodes = f"mesh.flank_nodes: {list(mesh['mesh.flank_nodes'])}"
    finer = f"{nodes} and mesh.size: {mesh['mesh.size']:g} mm"
    if case.mesh.order == 1:
        quadratic = case.mesh.described().of_order(2).refined(2.0)
        nodes_and_size = f"{list(quadratic.flank_nodes)} and mesh.size: {quadratic.size:g} mm"
        finer = f"mesh.order: 2 and mesh.flank_nodes: {nodes_and_size}"
    along = list(slot_mesh(case, 2.0)["mesh.flank_nodes"])
    return {"link": nodes, "mesh": finer, "slot": f"mesh.flank_nodes: {along}"}


STRUCTURE = WearStructure(
    name="dovetail",
    case=DovetailCase,
    model=_model,
    extent=_extent,
    memory=_memory,
    choose=_choose,
    warnings=_warnings,
    settings=_settings,
)
