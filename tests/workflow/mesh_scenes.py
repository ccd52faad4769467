"""Cases of meshes that more than one test module writes and runs."""

import json

from ruamel.yaml import YAML

from tests.workflow.commands import invoke

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
    """A case file of the given structure, steel on steel."""
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
    """The one line that refuses a case, after its ``fretscale: ``."""
    ending = invoke("check", path, *settings(overrides))
    assert ending.exit_code == 2, ending.output
    (line,) = ending.stderr.splitlines()
    return line.removeprefix("fretscale: ")


def run(case, out, *overrides):
    """The summary of a run."""
    ending = invoke("run", case, "--out", out, *settings(overrides))
    assert ending.exit_code == 0, ending.stderr
    return json.loads((out / "summary.json").read_text("utf-8"))
