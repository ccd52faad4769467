"""CAD files through gmsh's OpenCASCADE kernel: every solid is a body, every face a boundary."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

from fe_models.meshes.gmsh_session import gmsh_model
from fe_models.meshes.structure_mesh import MeshError
from fe_models.readers.gmsh_file import EntityGroup, first_line, grouped_entities
from fe_models.readers.grouped import GroupedMesh
from fe_models.readers.length_unit import LengthUnit
from fe_models.readers.reader_process import cpu_limited
from fe_models.readers.text_files import unmarked

# Ending of files that do not state a unit.
BREP = ".brep"
# First bytes of files of each kind. They are checked because OpenCASCADE writes its errors to the
# terminal.
BEGINNINGS = {
    ".step": (b"ISO-10303-21",),
    ".stp": (b"ISO-10303-21",),
    BREP: (b"DBRep_DrawableShape", b"CASCADE Topology"),
}
# Name that OpenCASCADE writes for a shape without a name.
NO_NAME = "Open CASCADE STEP translator"
# Number of bytes that are read to find the beginning after blank lines.
HEAD_BYTES = 200


def read_cad(path: Path, size: float, unit: LengthUnit | None = None) -> GroupedMesh:
    """Mesh the solids of a STEP or BREP file with tetrahedra of edge length ``size`` [mm].

    A STEP file is converted to mm from the unit it states; BREP states none and is in ``unit``. A
    solid has its name in the file (``solid_1``, ... without one; ``name_1``, ... if several share
    it). Its faces are ``solid_1.face_1``, ... in the order of the file, and also have their own
    names if the file gives any. Solids that touch have separate nodes unless they share a face in
    the file. Raises :class:`MeshError`.
    """
    if not size > 0.0:
        raise MeshError(f"{path}: the mesh size is {size:g} mm; allowed: more than 0")
    stated = path.suffix.lower() != BREP
    if stated and unit is not None:
        raise MeshError(
            f"{path}: STEP files state their unit of length, from which they are converted; "
            "allowed: no unit"
        )
    unit = unit or LengthUnit(source="converted from the unit of the file" * stated)
    with unmarked(path) as plain:
        return _meshed(path, plain, size, unit)


def _meshed(path: Path, plain: Path, size: float, unit: LengthUnit) -> GroupedMesh:
    """Mesh the solids of a file; ``plain`` is the file without a byte order mark."""
    with plain.open("rb") as file:
        if not file.read(HEAD_BYTES).lstrip().startswith(BEGINNINGS[path.suffix.lower()]):
            raise MeshError(f"{path}: is not a {path.suffix.lower()} file; export it again")
    with gmsh_model(path.stem) as gmsh:
        gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
        gmsh.option.setNumber("Geometry.OCCScaling", unit.size)
        # Both limits are set, because by default gmsh limits sizes to a tenth of the model.
        gmsh.option.setNumber("Mesh.MeshSizeMin", size)
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        try:
            with cpu_limited(plain):
                gmsh.model.occ.importShapes(str(plain))
            gmsh.model.occ.synchronize()
        except Exception as error:  # gmsh raises no more specific exception.
            raise MeshError(f"{path}: gmsh cannot read it: {first_line(error)}") from None
        groups = _groups(gmsh.model)
        if not groups:
            raise MeshError(f"{path}: has no solids; allowed: closed solids, not loose faces")
        try:
            gmsh.model.mesh.generate(3)
            gmsh.model.mesh.setOrder(2)  # Midside nodes are on the surfaces, facets are not.
        except Exception as error:
            raise MeshError(
                f"{path}: gmsh cannot mesh it at size {size:g} mm: {first_line(error)}; use a "
                "smaller size or repair the solids"
            ) from None
        return replace(grouped_entities(gmsh, groups), unit=unit)


def _groups(model: Any) -> list[EntityGroup]:
    """Return the solids and their faces by name."""
    groups: list[EntityGroup] = []
    labelled: dict[str, list[int]] = {}
    solids = [tag for _, tag in model.getEntities(3)]
    for name, solid in zip(_solid_names(model, solids), solids, strict=True):
        groups.append(EntityGroup(name, 3, [solid]))
        faces = model.getBoundary([(3, solid)], combined=False, oriented=False)
        for number, (_, face) in enumerate(faces, start=1):
            groups.append(EntityGroup(f"{name}.face_{number}", 2, [face]))
            if label := _label(model, 2, face):
                labelled.setdefault(label, []).append(face)
    return groups + [EntityGroup(label, 2, faces) for label, faces in labelled.items()]


def _solid_names(model: Any, solids: list[int]) -> list[str]:
    """Return a unique name for every solid."""
    labels = [_label(model, 3, solid) for solid in solids]
    count, used = Counter(labels), Counter[str]()
    names = []
    for number, label in enumerate(labels, start=1):
        used[label] += 1
        if not label:
            names.append(f"solid_{number}")
        else:
            names.append(label if count[label] == 1 else f"{label}_{used[label]}")
    return names


def _label(model: Any, dimension: int, tag: int) -> str:
    """Return the file's own name of an entity without its assemblies; empty if it has none."""
    label = model.getEntityName(dimension, tag).rpartition("/")[2]
    return "" if label.startswith(NO_NAME) else label
