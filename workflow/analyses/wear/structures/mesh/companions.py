"""Companions of a mesh of the user's: the same with elements of second order."""

from __future__ import annotations

from workflow.analyses.wear.budget.companions import Companions
from workflow.analyses.wear.structures.mesh.case import MeshCase

# Nodes in space of which elements of second order, seven times as many, are still cheap.
MOST_NODES = 4000


def companions(case: MeshCase) -> Companions[MeshCase]:
    """The mesh with elements of second order, where it has others and is small enough."""
    mesh = case.structure.mesh()
    cheap = mesh.interfaces[0].line or mesh.node_count(1) <= MOST_NODES
    finer = {"structure.order": 2} if case.structure.order == 1 and cheap else None
    return Companions.of(case, line=mesh.interfaces[0].line, finer=finer)
