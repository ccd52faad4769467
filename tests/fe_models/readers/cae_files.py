"""Files of two small blocks, one on the other, as several programs write them (2 x 1 x 1 mm)."""

from itertools import pairwise

import numpy as np

# Rings of faces and their midsides, by shape, as programs list them.
EDGES = {
    "hexahedron": [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5),
                   (2, 6), (3, 7)],
    "wedge": [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)],
    "pyramid": [(0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)],
    "tetra": [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
    "quad": [(0, 1), (1, 2), (2, 3), (3, 0)],
    "triangle": [(0, 1), (1, 2), (2, 0)],
}  # fmt: skip


def mixed_column():
    """Return points and cells, by shape, of a column of hexahedra, wedges, pyramids and tetrahedra.

    It has 2 x 2 x 3 cells of 1 mm: hexahedra below, then pairs of wedges, then pyramids around the
    middle of each cell, of which the uppermost is two tetrahedra.
    """
    points = [(x, y, z) for z in range(4) for y in range(3) for x in range(3)]
    at = {point: number for number, point in enumerate(points)}
    cells = {"hexahedron": [], "wedge": [], "pyramid": [], "tetra": []}
    for x in (0, 1):
        for y in (0, 1):

            def corner(dx, dy, z, x=x, y=y):
                return at[x + dx, y + dy, z]

            below = [corner(*d, 0) for d in ((0, 0), (1, 0), (1, 1), (0, 1))]
            cells["hexahedron"].append(below + [number + 9 for number in below])
            for front in (((0, 1), (1, 1), (1, 2)), ((0, 1), (1, 2), (0, 2))):
                cells["wedge"].append([corner(dx, dy, z) for dy in (0, 1) for dx, z in front])
            middle = len(points)
            points.append((x + 0.5, y + 0.5, 2.5))
            low = [corner(*d, 2) for d in ((0, 0), (1, 0), (1, 1), (0, 1))]
            high = [number + 9 for number in low]
            sides = [[a, b, b + 9, a + 9] for a, b in pairwise([*low, low[0]])]
            cells["pyramid"] += [[*base, middle] for base in (low, *sides)]
            cells["tetra"] += [[*high[:3], middle], [high[0], *high[2:], middle]]
    return np.array(points, dtype=float), {shape: np.array(c) for shape, c in cells.items()}


def mixed_plate():
    """Return points and cells, by shape, of a plate of quadrilaterals and triangles, 2 x 2 mm."""
    points = [(x, y, 0.0) for y in range(3) for x in range(3)]
    quads = [[0, 1, 4, 3], [4, 5, 8, 7]]
    triangles = [[1, 2, 4], [2, 5, 4], [3, 4, 7], [3, 7, 6]]
    return np.array(points, dtype=float), {"quad": np.array(quads), "triangle": np.array(triangles)}


def second_order(points, cells):
    """Return the mesh with midside nodes, one for each edge, in the order of ``EDGES``."""
    places, middle = list(points), {}
    full = {}
    for shape, block in cells.items():
        rows = []
        for cell in block.tolist():
            for a, b in EDGES[shape]:
                key = tuple(sorted((cell[a], cell[b])))
                if key not in middle:
                    middle[key] = len(places)
                    places.append(0.5 * (points[cell[a]] + points[cell[b]]))
            rows.append(cell + [middle[tuple(sorted((cell[a], cell[b])))] for a, b in EDGES[shape]])
        full[shape] = np.array(rows)
    return np.array(places), full


# --- writers --------------------------------------------------------------------------------------

ABAQUS = {
    ("hexahedron", 8): "C3D8", ("hexahedron", 20): "C3D20R", ("wedge", 6): "C3D6",
    ("wedge", 15): "C3D15", ("pyramid", 5): "C3D5", ("tetra", 4): "C3D4", ("tetra", 10): "C3D10",
    ("quad", 4): "CPE4", ("quad", 8): "CPE8R", ("triangle", 3): "CPE3", ("triangle", 6): "CPE6",
}  # fmt: skip
NASTRAN = {"hexahedron": "CHEXA", "wedge": "CPENTA", "pyramid": "CPYRAM", "tetra": "CTETRA"}
UNIVERSAL = {
    ("hexahedron", 8): 115, ("hexahedron", 20): 116, ("wedge", 6): 112, ("wedge", 15): 113,
    ("tetra", 4): 111, ("tetra", 10): 118, ("quad", 4): 54, ("quad", 8): 55, ("triangle", 3): 51,
    ("triangle", 6): 52,
}  # fmt: skip


def abaqus(points, cells):
    """Return a flat Abaqus file."""
    lines = ["*Heading", " mixed", "*Node"]
    lines += [f"{n:7d}, {x:.6f}, {y:.6f}, {z:.6f}" for n, (x, y, z) in enumerate(points, 1)]
    number = 0
    for shape, block in cells.items():
        lines.append(f"*Element, type={ABAQUS[shape, block.shape[1]]}, elset=Column")
        for cell in block + 1:
            number += 1
            texts = [str(number), *map(str, cell)]
            lines.append(", ".join(texts[:16]) + ("," if len(texts) > 16 else ""))
            lines += [", ".join(texts[16:])] * (len(texts) > 16)
    return "\n".join([*lines, ""])


def nastran(points, cells, form="small"):
    """Return a bulk data file in small, large or free fields."""
    lines = ["SOL 101", "CEND", "BEGIN BULK", "$ nodes"]
    number = 0
    for n, place in enumerate(points, 1):
        if form == "free":
            lines.append(f"GRID,{n},,{','.join(f'{v:g}' for v in place)}")
        elif form == "large":
            x, y, z = (f"{v:16.9E}" for v in place)
            lines += [f"GRID*   {n:16d}{'':16}{x}{y}*G{n}", f"*G{n}".ljust(8) + z]
        else:
            lines.append(f"GRID    {n:8d}{'':8}" + "".join(f"{v:8.4f}" for v in place))
    for shape, block in cells.items():
        for cell in block + 1:
            number += 1
            fields = [str(number), "7", *map(str, cell)]
            if form == "free":
                lines.append(",".join([NASTRAN[shape], *fields[:8]]))
                lines += [",".join(["+", *fields[k : k + 8]]) for k in range(8, len(fields), 8)]
                continue
            for k in range(0, len(fields), 8):
                head = NASTRAN[shape] if k == 0 else "+"
                lines.append(f"{head:8}" + "".join(f"{text:>8}" for text in fields[k : k + 8]))
    return "\n".join([*lines, "PSOLID,7,1", "ENDDATA", ""])


def universal(points, cells):
    """Return a universal file.

    In elements of second order the nodes go around the faces, with midside nodes between corners.
    """
    rings = {
        "tetra": (0, 4, 1, 5, 2, 6, 7, 8, 9, 3),
        "wedge": (0, 6, 1, 7, 2, 8, 12, 13, 14, 3, 9, 4, 10, 5, 11),
        "hexahedron": (0, 8, 1, 9, 2, 10, 3, 11, 16, 17, 18, 19, 4, 12, 5, 13, 6, 14, 7, 15),
        "quad": (0, 4, 1, 5, 2, 6, 3, 7),
        "triangle": (0, 3, 1, 4, 2, 5),
    }
    lines = ["    -1", "  2411"]
    for n, place in enumerate(points, 1):
        lines += [f"{n:10d}{1:10d}{1:10d}{11:10d}", "".join(f"{v:25.16E}" for v in place)]
    lines += ["    -1", "    -1", "  2412"]
    number = 0
    for shape, block in cells.items():
        count = block.shape[1]
        ring = list(rings[shape]) if count == len(rings[shape]) else list(range(count))
        for cell in block + 1:
            number += 1
            kind = UNIVERSAL[shape, count]
            lines.append("".join(f"{v:10d}" for v in (number, kind, 1, 1, 7, count)))
            nodes = cell[ring]
            lines += ["".join(f"{v:10d}" for v in nodes[k : k + 8]) for k in range(0, count, 8)]
    return "\n".join([*lines, "    -1", ""])
