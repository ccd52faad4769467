"""Elements of Nastran bulk data that are read, and entries that are refused with the reason.

Names are as in the Nastran Quick Reference Guide.
"""

from __future__ import annotations

import re

from fe_models.readers.nastran.cards import BulkEntry

# Shape of the elements that are read, and their numbers of nodes of first and of second order;
# corners come first.
SOLIDS = {
    "CTETRA": ("tetra", (4, 10)), "CPYRAM": ("pyramid", (5, 13)), "CPYRA": ("pyramid", (5, 13)),
    "CPENTA": ("wedge", (6, 15)), "CHEXA": ("hexahedron", (8, 20)),
}  # fmt: skip
SHELLS = {
    "CTRIA3": ("triangle", 3), "CTRIAR": ("triangle", 3), "CTRIA6": ("triangle", 6),
    "CQUAD4": ("quad", 4), "CQUADR": ("quad", 4), "CQUAD8": ("quad", 8),
}  # fmt: skip
PLANES = {
    f"CPLST{state}{count}": (shape, count)
    for state in "NS"
    for shape, count in (("triangle", 3), ("quad", 4), ("triangle", 6), ("quad", 8))
}
SHELL = (
    "a shell: mesh its volume with solid elements (CHEXA, CTETRA, ...), or lay it on faces of "
    "solids to name these"
)
TIED = "the tie or constraint is not carried over; make one body of what is bonded"
BEAM = "a beam: mesh its volume with solid elements, or leave it out and put its force on the body"
# Beams, which name the edges of solids that they lie on.
BEAMS = ("CBAR", "CBEAM", "CROD", "CTUBE")
POINTS = "leave it out and put its force on the body as a load"
# Entries that are refused, by their first letters, with the reason and the remedy.
REFUSED = (
    (r"RBE\d|RBAR\d?|RROD|RTRPLT\d?|RSPLINE|RSSCON|RJOINT|MPC|MPCY|BGSET|CWELD|CFAST|CSEAM", TIED),
    (r"CBEAM3|CBEND|CONROD", BEAM),
    (r"CELAS\d|CBUSH\w*|CDAMP\d|CVISC|CGAP|GENEL|DMIG",
     f"a spring or a matrix between points: {POINTS}"),
    (r"CONM\d|CMASS\d", f"a point mass: {POINTS}"),
    (r"CTRIAX\w*|CTRAX\w*|CQUADX\w*|CCONEAX",
     "axisymmetric, which is not computed: take a sector in space, or a plane section"),
    (r"CSHEAR|CQUAD9?|CTRIA9", "a membrane or a form of its own: mesh it with CQUAD4 or solids"),
    (r"CIFHEX|CIFPENT|CIFQDX|CIFQUAD|CCOHES\w*", "a layer that bonds: make one body of it"),
    (r"GRDSET", "write the coordinate system of each GRID out"),
    (r"CORD1\w|CORD3G", "a system on grid points: write it as CORD2R, CORD2C or CORD2S"),
    (r"BOLT\w*|BCPROP1?|MODTRAK|SPCAX|SUPORT\d?", "is not supported; leave it out"),
)  # fmt: skip


def refuse(entry: BulkEntry) -> None:
    """Raise :class:`MeshError` for an entry that must not be ignored."""
    for pattern, reason in REFUSED:
        if re.fullmatch(pattern, entry.name):
            raise entry.wrong(reason)
