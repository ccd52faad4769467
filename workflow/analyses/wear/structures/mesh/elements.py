"""Report on the use of a mesh's midside nodes before a run."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from workflow.case.text.plain import counted
from workflow.messages.warning_kinds import Notice, WarningKind

if TYPE_CHECKING:
    from fe_models.geometry.imported import ImportedMesh
    from fe_models.meshes.structure_mesh import Interface, StructureMesh

# Distance of midside nodes of matching faces, relative to the face, that counts as a difference.
APART = 1e-6


def elements_outline(mesh: StructureMesh, imported: ImportedMesh, order: int) -> Iterator[str]:
    """Yield how curved the elements of each body are, if file or case have midside nodes."""
    from fe_models.meshes.second_order import curvature

    known = {body.name: curvature(body, imported) for body in mesh.bodies}
    if order == 1:
        if any(known.values()):
            yield (
                "order 1, with straight edges: midside nodes only give contact faces their form; "
                "mesh.order: 2 uses them as elements"
            )
        return
    for name, found in known.items():
        if found is None:
            yield f"{name} of order 2, straight: the file has no midside nodes for it"
        elif not found.curved:
            yield f"{name} of order 2, straight: its midside nodes are in the middle of edges"
        else:
            without = found.edges - found.given
            rest = f"; {counted(without, 'edge')} without a midside node straight" * (without > 0)
            yield (
                f"{name} of order 2, {found.curved} of {counted(found.edges, 'edge')} curved by "
                f"up to {1e3 * found.off:.3g} µm{rest}"
            )


def folded_elements(mesh: StructureMesh, imported: ImportedMesh) -> Iterator[Notice]:
    """Yield warnings about elements that midside nodes would fold, and how they are treated."""
    from fe_models.meshes.second_order import curvature

    for body in mesh.bodies:
        if body.midsides is None or not (found := curvature(body, imported)):
            continue
        if found.straightened:
            yield Notice(
                WarningKind.FOLDED_ELEMENTS,
                f"{body.name}: midside nodes fold some elements, so "
                f"{counted(found.straightened, 'edge')} of {found.edges} are taken as straight: "
                "refine the mesh where it bends",
            )


def apart(mesh: StructureMesh, interface: Interface) -> Notice | None:
    """Return a warning about matching faces whose midside nodes differ, if they do."""
    from fe_models.meshes.second_order import distance_of_midsides

    between = distance_of_midsides(interface, [mesh.bodies[place] for place in interface.bodies])
    if between <= APART * float(interface.facet_sizes.max()) ** (1.0 if interface.line else 0.5):
        return None
    return Notice(
        WarningKind.MIDSIDES_APART,
        f"{interface.name}: its faces meet node to node, but their midside nodes are up to "
        f"{1e3 * between:.3g} µm apart; the gap there is taken as zero: give both faces the "
        "same midside nodes, or take mesh.order: 1",
    )
