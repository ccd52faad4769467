"""Elements of Abaqus input files that are read, and advice on the families that are refused.

Names of types are as in the Abaqus Elements Guide, which CalculiX follows.
"""

from __future__ import annotations

import re

from fe_models.meshes.structure_mesh import MeshError
from fe_models.readers.abaqus.cards import Card

# Shape of the solid (C3D) and plane (CPE, CPS) elements by their number of nodes, of which the
# corners come first.
SOLIDS = {
    4: "tetra", 10: "tetra", 5: "pyramid", 6: "wedge", 15: "wedge", 8: "hexahedron",
    20: "hexahedron",
}  # fmt: skip
PLANES = {3: "triangle", 6: "triangle", 4: "quad", 8: "quad"}
# Letters after the number (reduced integration, hybrid, modified, ...) do not change the mesh.
SOLID_TYPE, PLANE_TYPE = re.compile(r"C3D(\d+)[HIMPRST]*"), re.compile(r"CP[ES](\d+)[HIMPRT]*")
PLANE_STRESS = re.compile(r"CPS\d+.*")
# Types that gmsh, meshio and FreeCAD write for edges and facets, which are not bodies.
FACET_TYPES = {
    "B21": (2, "line"), "B22": (3, "line"), "B31": (2, "line"), "B32": (3, "line"),
    "T2D2": (2, "line"), "T2D3": (3, "line"), "T3D2": (2, "line"), "T3D3": (3, "line"),
    "R3D3": (3, "triangle"), "R3D4": (4, "quad"), "SFM3D3": (3, "triangle"), "SFM3D4": (4, "quad"),
}  # fmt: skip
ALLOWED_TYPES = (
    "C3D4, C3D5, C3D6, C3D8, C3D10, C3D15, C3D20, CPE3, CPE4, CPE6, CPE8, and CPS of these"
)

SOLIDS_FOR_IT = "mesh its volume with solid elements (C3D8, C3D10, ...)"
# Families of types that are refused: pattern of the type, description and remedy.
FAMILIES = (
    (r"SC[68]", "a continuum shell", "write it as C3D8, several across its thickness"),
    (r"(SAX|MAX|RAX|CAX|CGAX|DCAX|ASI2DAX)\w*",
     "axisymmetric, which is not computed", "take a sector in space, or a plane section"),
    (r"(S\d|STRI|DS\d)\w*", "a shell", SOLIDS_FOR_IT),
    (r"M3D\w*", "a membrane", SOLIDS_FOR_IT),
    (r"SFM3D\w*", "a surface without stiffness", "name the surface with *Surface"),
    (r"(B2|B3|PIPE|ELBOW|FRAME)\w*", "a beam",
     f"{SOLIDS_FOR_IT}, or leave it out and put its force on the body as a load"),
    (r"T[23]D\w*", "a truss",
     f"{SOLIDS_FOR_IT}, or leave it out and put its force on the body as a load"),
    (r"(R2D|R3D|RB)\w*", "a rigid surface",
     "give the body a mesh of its own and a high Young's modulus"),
    (r"CPEG\w*", "in generalised plane strain", "write it as CPE"),
    (r"(C3D27|C3D10MS|CSS)\w*", "of a form of its own", "write it as C3D20, C3D10 or C3D8"),
    (r"(COH|GK)\w*", "a layer that bonds",
     "make one body of what is bonded, or a contact of its two sides"),
    (r"CIN\w*", "infinite", "leave it out and hold the boundary it stands on"),
    (r"(DC|AC|EM|DCC|Q3D)\w*", "of heat, sound or fields",
     "write it as the stress element of the same shape, such as C3D8"),
    (r"(SPRING|DASHPOT|CONN|JOINT|GAP|ITS|DRAG)\w*", "a spring or a joint of points",
     "leave it out and put its force on the body as a load"),
    (r"(MASS|ROTARYI|HEATCAP)\w*", "a point mass",
     "leave it out and put its force on the body as a load"),
)  # fmt: skip


def element_type(card: Card) -> tuple[int, str]:
    """Return the number of nodes and the shape of the elements of a keyword.

    Raises :class:`MeshError` for a type that is not read.
    """
    kind = card.name("TYPE").upper()
    for pattern, shapes in ((SOLID_TYPE, SOLIDS), (PLANE_TYPE, PLANES)):
        if (match := pattern.fullmatch(kind)) and int(match[1]) in shapes:
            return int(match[1]), shapes[int(match[1])]
    if kind not in FACET_TYPES:
        why = f" is {advice(kind)}" if advice(kind) else f"; allowed: {ALLOWED_TYPES}"
        raise MeshError(f"{card.place}: element type {kind}{why}")
    return FACET_TYPES[kind]


def advice(kind: str) -> str:
    """Return the family of a type that is not read and what to do; empty if it is unknown."""
    for pattern, family, remedy in FAMILIES:
        if re.fullmatch(rf"{pattern}[A-Z]*", kind):
            return f"{family}: {remedy}"
    return ""
