"""Meshes in Abaqus input files: flat ones, and ones of parts, instances and an assembly.

Keywords are as in the Abaqus Keywords Reference Guide. Keywords that do not belong to the mesh
(materials, steps) are skipped; those that change the mesh or tie bodies together are refused,
because they are not imported.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from fe_models.meshes.structure_mesh import MeshError
from fe_models.readers.abaqus.cards import cards
from fe_models.readers.abaqus.elements import PLANE_STRESS
from fe_models.readers.abaqus.model import Model
from fe_models.readers.abaqus.scene import scene_of
from fe_models.readers.flattened import FlatFile, Flattened, dimension_of
from fe_models.readers.grouped import DIMENSION, GroupedMesh
from fe_models.readers.scope import Scope


def read_abaqus(path: Path) -> GroupedMesh:
    """Read the mesh of an Abaqus input file.

    Each instance is a body of that name with its part's node numbers. Element surfaces are
    boundaries; node sets and node surfaces are node sets. Those of a part keep their name, or are
    named ``Instance.name`` if another instance or the assembly has the name, too.

    In a flat file each connected piece is a body with the name of the element set that is exactly
    its elements, or else ``body_1``, .... Element sets of facets (triangles on tetrahedra, as gmsh
    writes them) are boundaries too, and those of edges of solids are node sets.

    Raises :class:`MeshError` with file and line.
    """
    model = Model(path)
    for card in cards(path):
        model.read(card)
    if model.parts:
        _check_assembly(path, model)
        scopes = [scope for _, scope in model.instances.items()]
        flattened = Flattened(scopes, model.assembly)
    elif model.flat.elements:
        scopes = [model.flat]
        flattened = FlatFile(model.flat)
    else:
        raise MeshError(f"{path}: has no elements")
    mesh = flattened.mesh()
    caveats = [*_plane_stress(scopes), *_stiff_edges(model)]
    scene = scene_of(model, flattened, mesh)
    scene = replace(scene, ignored=(*caveats, *scene.ignored))
    return replace(mesh, unused=(*caveats, *model.unused), scene=scene)


def _plane_stress(scopes: list[Scope]) -> list[str]:
    """Return a line if bodies are of plane stress, which are computed in plane strain."""
    for scope in scopes:
        for element in scope.elements.values():
            if PLANE_STRESS.fullmatch(element.kind) and dimension_of(scope) == 2:
                return [
                    f"{element.place.short}: {element.kind} of plane stress; bodies in "
                    "the plane are in plane strain"
                ]
    return []


def _stiff_edges(model: Model) -> list[str]:
    """Return a line for each type of beams on edges of solids, and of trusses with a section.

    Trusses without a section are what gmsh writes for edges.
    """
    sets = model.flat.element_sets
    sections = [card.parameters.get("ELSET", "") for _, card in model.case_cards
                if card.keyword == "SOLIDSECTION"]  # fmt: skip
    stiff = {n for name in sections if name in sets for n in sets[name].get("", ())}
    first = {
        element.kind: element.place
        for number, element in reversed(model.flat.elements.items())
        if element.shape == "line" and (element.kind.startswith("B") or number in stiff)
    }
    return [
        f"{place.short}: stiffness of {kind}, which names edges" for kind, place in first.items()
    ]


def _check_assembly(path: Path, model: Model) -> None:
    """Raise unless all elements are those of instances."""
    if model.assembly.elements:
        place = next(iter(model.assembly.elements.values())).place
        raise MeshError(f"{place}: an element of the assembly; allowed: elements of parts")
    if not model.flat.is_empty():
        raise MeshError(
            f"{path}: has nodes, sets or surfaces outside of its parts and its assembly; allowed: "
            "inside either of them"
        )
    if not model.instances:
        raise MeshError(f"{path}: has parts but no *Instance of any part; add one")
    for name, scope in model.instances.items():
        if not scope.elements:
            raise MeshError(f"{scope.place}: instance {name} has no elements")
        dimension = dimension_of(scope)
        for element in scope.elements.values():
            if DIMENSION[element.shape] != dimension or not element.stands_alone:
                raise MeshError(
                    f"{element.place}: element type {element.kind} "
                    f"{f'is {element.advice}; ' * bool(element.advice)}"
                    "allowed in a part: solid elements, or plane ones, alone"
                )
