"""Tests of mesh cases with more than two bodies and separate settings for each contact."""

import h5py
import numpy as np
import pytest
from skfem import MeshTri

from fe_models.meshes.structure_mesh import Body, StructureMesh, write_msh
from tests.workflow.mesh_scenes import STEEL, edit, refused, run, write_case

pytestmark = pytest.mark.usefixtures("reads_here")

WIDTH = 2.0
# Bottom and top of each, and nodes across.
LAYERS = {"base": (-1.0, 0.0, 9), "shim": (0.0, 0.5, 11), "pad": (0.5, 1.5, 8)}
SOFT = {"young": "70 GPa", "poisson": 0.33, "density": "2700 kg/m^3"}
LEGS = {"increments": [2, 3, 3, 3, 3], "cycle_from": 4, "peak_leg": 4}


def strip(name, low, high, across):
    x, z = np.linspace(0.0, WIDTH, across), np.linspace(low, high, 6)
    mesh = MeshTri.init_tensor(x, z)
    ends = {"below": lambda p: p[1] == low, "above": lambda p: p[1] == high}
    return Body(name, mesh.with_boundaries(ends))


@pytest.fixture
def strips(tmp_path):
    """Return a shim between a base and a pad that is pressed and pushed back and forth."""
    bodies = [strip(name, *layer) for name, layer in LAYERS.items()]
    write_msh(tmp_path / "strips.msh", StructureMesh(tuple(bodies), ()))
    structure = {
        "file": "strips.msh",
        "body_1": "base",
        "body_2": "pad",
        "other_bodies": [{"name": "shim", "material": SOFT}],
        "contacts": [
            {
                "name": "lower",
                "bodies": ["base", "shim"],
                "face_1": "base_above",
                "face_2": "shim_below",
                "x": [1, 0, 0],
                "friction": {"coefficient": 0.8},
            },
            {
                "name": "upper",
                "bodies": ["shim", "pad"],
                "face_1": "shim_above",
                "face_2": "pad_below",
                "x": [1, 0, 0],
                "grid": [96, 1],
                "wear": {
                    "law": "energy",
                    "body_1": {"coefficient": "4e3 um^3/J"},
                    "body_2": {"coefficient": "1e3 um^3/J"},
                },
            },
        ],
        "supports": [{"group": "base_below", "hold": "all"}],
        "loads": [
            {"kind": "pressure", "group": "pad_above", "pressure": "50 MPa", "path": [1] * 5},
            {
                "kind": "displacement",
                "group": "pad_above",
                "displacement": ["6 um", 0, 0],
                "path": [0, 1, -1, 1, -1],
            },
        ],
    }
    return write_case(tmp_path / "strips.yaml", structure, LEGS, mu=0.3, grid=(64, 1))


def test_each_contact_wears_by_its_own_terms(strips, tmp_path):
    """The upper contact slips at its friction, and its bodies wear by their laws."""
    numbers = run(strips, tmp_path / "out")
    lower, upper = numbers["lower"], numbers["upper"]
    for contact in (lower, upper):
        for load in contact["peak_load"].values():
            assert load["P"] == pytest.approx(50.0 * WIDTH, rel=1e-6)
    # Friction 0.3 slides before friction 0.8 does.
    assert upper["energy"] > 10.0 * lower["energy"]
    assert upper["volume_1"] == pytest.approx(4.0 * upper["volume_2"], rel=1e-6)
    assert upper["volume_2"] == pytest.approx(1e-9 * upper["energy"], rel=1e-6)
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        grids = {name: tuple(group.attrs["shape"]) for name, group in file["grid"].items()}
        assert grids == {"lower": (64, 1), "upper": (96, 1)}
        friction = {name: group.attrs["friction"] for name, group in file["structure"].items()}
        assert friction == {"lower": 0.8, "upper": 0.3}
        assert set(file["bodies"]) == set(LAYERS)
    peaks = numbers["structure"]["peak_stress"]["worn"]
    assert set(peaks) == set(LAYERS)
    assert numbers["structure"]["equilibrium_error"] < 1e-6


@pytest.mark.slow
def test_bodies_that_stay_as_they_are_are_condensed_once(strips, tmp_path, monkeypatch):
    """With another shim, base and pad come from the cache, and no number changes."""
    # A load more, which acts on the shim alone.
    warm = "{kind: temperature, body: shim, change: 10 K, path: [0, 1, 1, 1, 1]}"

    def bodies():
        return {path.name for path in folder.glob("body-*.h5")}

    folder = tmp_path / "used"
    monkeypatch.setenv("FRETSCALE_CACHE", str(folder))
    run(strips, tmp_path / "first")
    first = bodies()
    assert len(first) == 3
    edit(strips, "  loads:\n", f"  loads:\n  - {warm}\n")
    edit(strips, "young: 70 GPa", "young: 71 GPa\n      expansion: 2.3e-5 1/K")
    found = run(strips, tmp_path / "second")
    assert len(bodies() - first) == 1
    monkeypatch.setenv("FRETSCALE_CACHE", str(tmp_path / "new"))
    assert run(strips, tmp_path / "third")["upper"] == found["upper"]


@pytest.mark.parametrize(
    ("override", "named"),
    [
        ("structure.contacts.0.bodies=[base, shimm]", "shimm"),
        ("structure.contacts.0.bodies=[base, base]", "structure.contacts.0.bodies"),
        ("structure.other_bodies.0.name=pad", "pad"),
        ("structure.contacts.0.face_1=shim_above", "shim_above"),
        ("nonlinearity.check=true", "nonlinearity"),
    ],
)
def test_wrong_bodies_are_refused(strips, override, named):
    assert named in refused(strips, override)


@pytest.mark.slow
def test_method_full_takes_each_friction(strips, tmp_path):
    numbers = run(strips, tmp_path / "out", "contact.method=full", "wear.cycles=500")
    assert numbers["upper"]["energy"] > 10.0 * numbers["lower"]["energy"]


def test_materials_are_each_bodys_own(strips, tmp_path):
    """If the shim is a thousand times as soft, only the shim deforms."""
    stiff = STEEL | {"poisson": 0.01}
    soft = {"young": "0.2 GPa", "poisson": 0.01, "density": "1000 kg/m^3"}
    numbers = run(
        strips,
        tmp_path / "out",
        f"materials={{body_1: {stiff}, body_2: {stiff}}}".replace("'", ""),
        f"structure.other_bodies.0.material={soft}".replace("'", ""),
        "wear.cycles=500",
    )
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        moved = {name: np.ptp(file[f"bodies/{name}/unworn/displacement"][:, 2]) for name in LAYERS}
    assert moved["shim"] > 100.0 * moved["base"]
    assert numbers["upper"]["peak_load"]["unworn"]["P"] == pytest.approx(100.0, rel=1e-6)
