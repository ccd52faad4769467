"""Contact loads of faces, and tables of them, shared by several test modules."""

from dataclasses import fields
from pathlib import Path

import numpy as np

import workflow.analyses.wear.structures.resultants
from fe_models.meshes.structure_mesh import Interface
from fe_models.structure import InterfaceHistory
from sa_solver.load_history import LoadHistory
from sa_solver.types import Frame
from workflow.analyses.wear.structures.resultants.faces import facets_over

FRICTION, SIZE = 0.4, (10.0, 60.0)
RECIPE = Path(workflow.analyses.wear.structures.resultants.__file__).with_name("RECIPE.md")
COLUMNS = ("P", "Qx", "Qy", "Mx", "My", "Mz", "Edx", "Edy")
GOOD = {"P": 100, "Qx": -40, "Qy": 0, "Mx": 30, "My": -20, "Mz": 5, "Edx": 2, "Edy": 0}


def random_loads(seed: int, count: int = 7) -> LoadHistory:
    """Return valid loads without a short decimal form; the last row is unloaded."""
    rng = np.random.default_rng(seed)
    P = 1e3 * rng.random(count)
    P[-1] = 0.0
    arms = rng.uniform(-0.3, 0.3, (5, count)) * P
    energy = rng.random((2, count)) / 3.0 * (P > 0.0)
    return LoadHistory(P, *arms, *energy, sliding=rng.random(count) > 0.5)


def assert_same(one: LoadHistory, two: LoadHistory) -> None:
    """Assert bitwise equality, including the signs of zeros."""
    for field in fields(LoadHistory):
        a, b = getattr(one, field.name), getattr(two, field.name)
        assert a.dtype == b.dtype
        assert a.tobytes() == b.tobytes(), field.name


def flank() -> Frame:
    """Return a frame at 45 degrees."""
    x, z = np.array([-1.0, 0.0, 1.0]) / np.sqrt(2.0), np.array([-1.0, 0.0, -1.0]) / np.sqrt(2.0)
    return Frame(np.array([15.0, 0.0, 245.0]), np.array([x, np.cross(z, x), z]))


def face_history(seed: int = 0, line: bool = False) -> InterfaceHistory:
    """Return a face of 20 x 34 nodes (or 20 along a line) with random slip."""
    rng, loads = np.random.default_rng(seed), random_loads(seed)
    x, y = 5.0 * np.sin(np.linspace(-1.3, 1.3, 20)) / np.sin(1.3), np.linspace(-30.0, 30.0, 34)
    grid = np.meshgrid(x, [0.0] if line else y, indexing="ij")
    coordinates = np.stack([axis.ravel() for axis in grid], axis=1)
    facets = facets_over(coordinates, line)
    n = len(coordinates)
    numbers = rng.permutation(10 * n)[: 2 * n].reshape(2, n)
    interface = Interface("f", flank(), coordinates, facets, *numbers, rng.random(n))
    slip = rng.standard_normal((len(loads), 2, n)) / 300.0
    shares = rng.random(n)
    force = loads.resultants[:, [1, 2, 0], None] * (shares / shares.sum())
    return InterfaceHistory(interface, loads, force, rng.random(force.shape), slip)


def table(rows: list[dict], header: dict[str, str] | None = None) -> str:
    """Return CSV text of rows by column; ``header`` renames columns."""
    names = list(rows[0])
    lines = [", ".join((header or {}).get(name, name) for name in names)]
    return "\n".join(lines + [", ".join(str(row[name]) for name in names) for row in rows]) + "\n"


def write(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "loads.csv"
    path.write_text(text, encoding="utf-8")
    return path
