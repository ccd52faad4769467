"""Cases of meshes that several test modules write and run."""

import json

import numpy as np
from ruamel.yaml import YAML

from tests.workflow.command_line import invoke

STEEL = {"young": "200 GPa", "poisson": 0.3, "density": "7800 kg/m^3"}
WEAR = {
    "law": "energy",
    "body_1": {"coefficient": "1e3 um^3/J"},
    "body_2": {"coefficient": "1e3 um^3/J"},
    "cycles": 1e3,
    "step": {"kind": "implicit", "cycles": 500},
}
# Corners of the faces S1 to S4 of Abaqus' tetrahedron.
ABAQUS_FACES = ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))


def write_case(path, structure, legs, mu=0.5, grid=(16, 16), **changes):
    """Write a case file of the given structure, steel on steel."""
    case = {
        "title": "Bodies of a mesh file",
        "analysis": "wear",
        "structure": {"kind": "mesh", **structure},
        "materials": {"body_1": STEEL, "body_2": STEEL},
        "friction": {"coefficient": mu},
        "load_path": legs,
        "contact": {"grid": list(grid)},
        "wear": WEAR,
        "stress": {"section": "none", "life": {"parameter": "none"}},
        "output": {"paraview": False, "figures": False},
        **changes,
    }
    with path.open("w", encoding="utf-8") as stream:
        YAML().dump(json.loads(json.dumps(case)), stream)
    return path


def settings(overrides):
    return [part for entry in overrides for part in ("--set", entry)]


def refused(path, *overrides):
    """Return the one line that refuses a case, without its prefix ``fretscale: ``."""
    ending = invoke("check", path, *settings(overrides))
    assert ending.exit_code == 2, ending.output
    (line,) = ending.stderr.splitlines()
    return line.removeprefix("fretscale: ")


def run(case, out, *overrides):
    """Run a case and return its summary."""
    ending = invoke("run", case, "--out", out, *settings(overrides))
    assert ending.exit_code == 0, ending.stderr
    return json.loads((out / "summary.json").read_text("utf-8"))


def cube(name, size):
    """Return a cube of 2 x 2 x 2 elements, with surfaces below, above and at y = 0."""
    axis = np.linspace(0.0, size, 3).tolist()
    places = [(x, y, z) for z in axis for y in axis for x in axis]
    lines = [f"*Part, name={name}", "*Node"]
    lines += [f"{n}, {x}, {y}, {z}" for n, (x, y, z) in enumerate(places, 1)]
    lines.append("*Element, type=C3D8R")
    firsts = [1 + i + 3 * j + 9 * k for k in (0, 1) for j in (0, 1) for i in (0, 1)]
    for n, first in enumerate(firsts, 1):
        below = [first, first + 1, first + 4, first + 3]
        lines.append(f"{n}, {', '.join(str(m) for m in [*below, *(m + 9 for m in below)])}")
    for side, face, elements in (
        ("low", "S1", (1, 2, 3, 4)),
        ("high", "S2", (5, 6, 7, 8)),
        ("cut", "S3", (1, 2, 5, 6)),
    ):
        lines.append(f"*Surface, type=ELEMENT, name={name}_{side}")
        lines += [f"{n}, {face}" for n in elements]
    return "\n".join([*lines, "*End Part", ""])


ASSEMBLY = """\
*Assembly, name=Assembly
*Instance, name=Base-1, part=base
*End Instance
*Instance, name=Foot-1, part=foot
0.5, 0.5, 2.
*End Instance
*End Assembly
*Step
*Static
*End Step
"""
# Two blocks, pressed together and then pushed back and forth without sliding off.
BLOCKS = {
    "body_1": "Base-1",
    "body_2": "Foot-1",
    "contacts": [{"name": "foot", "face_1": "base_high", "face_2": "foot_low", "x": [1, 0, 0]}],
    "supports": [{"group": "base_low", "hold": "all"}],
    "loads": [
        {"kind": "pressure", "group": "foot_high", "pressure": "40 MPa", "path": [1, 1, 1, 1]},
        {"kind": "force", "group": "foot_high", "force": ["4 N", 0, 0], "path": [0, 1, -1, 1]},
    ],
}
TO_AND_FRO = {"increments": [1, 2, 2, 2], "cycle_from": 3, "peak_leg": 4}


def edit(path, old, new):
    """Replace text in a file and return its lines."""
    text = path.read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path.read_text("utf-8").splitlines()


def pressed_blocks(folder):
    """Write a case of a cube of 1 mm on one of 2 mm, as CAE would write it."""
    text = cube("base", 2.0) + cube("foot", 1.0) + ASSEMBLY
    (folder / "blocks.inp").write_text(text, encoding="utf-8")
    return write_case(folder / "blocks.yaml", {"file": "blocks.inp", **BLOCKS}, TO_AND_FRO)
