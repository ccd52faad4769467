"""Translation of a dovetail case into a model of its structure."""

from __future__ import annotations

from fe_models.dovetail import Mission
from workflow.analyses.wear.case.scanned import ScannedFace
from workflow.analyses.wear.structures.dovetail.case import DovetailCase
from workflow.case.changing import changed
from workflow.models.dovetail import DovetailJoint
from workflow.models.gaps import AddedGap


def dovetail_joint(case: DovetailCase) -> DovetailJoint:
    """Return the joint, its missions and its mesh as the case gives them."""
    structure, path = case.structure, case.load_path
    advice = "raise mesh.notch"
    if structure.dimension == 3:
        advice += " or mesh.flank_nodes"
    if case.mesh.order == 1:
        advice += ", or take mesh.order: 2"
    return DovetailJoint(
        geometry=structure.geometry(),
        disk=case.material(1),
        blade=case.material(2),
        missions=tuple(Mission(**entries) for entries in path.missions()),
        mesh=case.mesh.described(),
        dimension=structure.dimension,
        sides=structure.sides,
        shares=path.shares,
        added={face.name: added_gap(face) for face in case.scanned()},
        nonlinearity=case.nonlinearity.described(),
        finer=advice,
    )


def section_joint(case: DovetailCase) -> DovetailJoint:
    """Return the section of the joint in plane strain, under the same missions."""
    return dovetail_joint(changed(case, case.to_plane))


def added_gap(face: ScannedFace) -> AddedGap:
    """Return the gap of measured surfaces: their values on cells, their means at nodes."""
    return AddedGap(face.over, face.at_nodes_of)
