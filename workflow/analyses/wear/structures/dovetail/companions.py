"""Companions of a dovetail: its section in plane strain, for the joint in space too."""

from __future__ import annotations

from workflow.analyses.wear.budget.companions import MESH_SHARES, Companions
from workflow.analyses.wear.fidelity.probe import plane_section
from workflow.analyses.wear.structures.dovetail.case import DovetailCase
from workflow.case.changing import changed


def companions(case: DovetailCase) -> Companions[DovetailCase]:
    """The section on its mesh and on one of half the size and second order, and on a coarser grid.

    What mesh and grid leave along the slot is not in it.
    """
    (across, along), size = case.mesh.flank_nodes, case.mesh.size
    finer = {
        "mesh.flank_nodes": (2 * across - 1, 2 * along - 1),
        "mesh.size": 0.5 * size,
        "mesh.order": 2,
    }
    section = changed(plane_section(case), {"mesh": case.mesh})
    share = MESH_SHARES[case.mesh.order]
    return Companions.of(case, section, line=True, finer=finer, mesh_share=share)
