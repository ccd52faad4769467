"""Mesh case of a cylinder's foot on a block, both meshed in the plane and finely at the contact."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from skfem import MeshTri

from fe_models.meshes.structure_mesh import Body, StructureMesh, write_msh
from fe_models.structure import InterfaceHistory
from sa_solver.types import Array
from tests.workflow.mesh_scenes import STEEL, write_case
from wear.contact.interface import FirstContact
from workflow.analyses.wear.model import loads_of
from workflow.analyses.wear.translation import face_contact
from workflow.kinds import load_case
from workflow.models.contact import FaceContact

RADIUS, GROWTH = 400.0, 1.3
RUBBER, CERAMIC = {"young": "0.2 GPa"}, {"young": "2000 GPa"}


@dataclass(frozen=True)
class Blocks:
    """Foot over x in ``foot`` on a block over ``base`` and ``depth`` thick [mm].

    Elements have the requested size within ``fine``; ``hold`` is how the block is supported at its
    base. ``half`` of both, over x > 0, is cut by a plane of symmetry.
    """

    base: tuple[float, float]
    depth: float
    foot: tuple[float, float]
    height: float
    fine: tuple[float, float]
    hold: str = "all"
    materials: tuple[dict[str, str], dict[str, str]] = (RUBBER, CERAMIC)
    line_contact: int = 256
    half: bool = False

    def write(
        self,
        folder: Path,
        size: float,
        loads: list[dict[str, Any]],
        legs: dict[str, Any],
        friction: float = 0.0,
    ) -> Path:
        """Write the case with elements of ``size`` [mm]. Shear is imposed by ``loads`` or is 0."""
        layer = (0.0, 0.25 * (self.fine[1] - self.fine[0]))
        blocks = []
        for name, (low, high), thick, sign in (
            ("base", self.base, self.depth, -1.0),
            ("foot", self.foot, self.height, 1.0),
        ):
            fine = max(low, self.fine[0]), min(high, self.fine[1])
            z = sign * _graded((0.0, thick), (0.0, min(thick, layer[1])), size)
            blocks.append(_block(name, _graded((low, high), fine, size), np.sort(z)))
        write_msh(folder / "blocks.msh", StructureMesh(blocks, ()))
        moved = any(load["kind"] == "displacement" for load in loads)
        supports = [{"group": "base_z0", "hold": self.hold}]
        supports += [] if self.hold == "all" else [{"group": "base_x0", "hold": "x"}]
        supports += [] if moved else [{"group": "foot_z1", "hold": "x"}]
        if self.half:
            supports += [{"group": f"{name}_x0", "hold": "normal"} for name in ("base", "foot")]
        contact = {"name": "foot", "face_1": "base_z1", "face_2": "foot_z0", "x": [1, 0, 0]}
        structure = {
            "file": "blocks.msh",
            "body_1": "base",
            "body_2": "foot",
            "contacts": [contact | {"gap": {"shape": "paraboloid", "radius_x": RADIUS}}],
            "supports": supports,
            "loads": loads,
        }
        materials = {f"body_{k}": STEEL | self.materials[k - 1] for k in (1, 2)}
        grid, path = (self.line_contact, 8), folder / "blocks.yaml"
        return write_case(path, structure, legs, mu=friction, grid=grid, materials=materials)

    def press(self, folder: Path, size: float, load: float) -> Path:
        """Write the case of the foot pressed on by ``load`` [N/mm], without friction."""
        pressure = load / (self.foot[1] - self.foot[0])
        pressed = {"kind": "pressure", "group": "foot_z1", "pressure": pressure, "path": [1, 0.5]}
        return self.write(folder, size, [pressed], {"increments": [1, 1]})


def solved(path: Path, *settings: str) -> tuple[InterfaceHistory, FaceContact, FirstContact]:
    """Return the unworn cycle of the structure, the contact, and its first cycle."""
    case = load_case(path, list(settings))
    source = loads_of(case)
    (history,), stage = source.unworn(), face_contact(case, source.faces[0])
    return history, stage, stage.contact.begin(history, 1.0)[1]


def error(pressure: Array, exact: Array) -> float:
    """Return the largest relative error of a pressure where it exceeds half of its maximum."""
    inner = exact > 0.5 * exact.max()
    return float(np.abs(pressure - exact)[inner].max() / exact.max())


def _graded(ends: tuple[float, float], fine: tuple[float, float], size: float) -> Array:
    """Return coordinates with spacing ``size`` in the ``fine`` part, wider towards the ``ends``."""
    low, high = fine
    middle = np.linspace(low, high, round((high - low) / size) + 1)
    below, above = (_growing(size, abs(end - near)) for end, near in zip(ends, fine, strict=True))
    return np.concatenate([low - below[::-1], middle, high + above])


def _growing(size: float, length: float) -> Array:
    """Return distances up to a ``length`` with growing steps; none for a length of 0."""
    if length <= 0.0:
        return np.empty(0)
    steps = [GROWTH * size]
    while sum(steps) < length:
        steps.append(GROWTH * steps[-1])
    places = np.cumsum(steps)
    return np.asarray(places * (length / places[-1]))


def _block(name: str, x: Array, z: Array) -> Body:
    """Return a rectangle of triangles with boundaries x0 ... z1."""
    ends = {
        f"{axis}{end}": (lambda p, k=k, value=value: np.isclose(p[k], value))
        for k, (axis, places) in enumerate((("x", x), ("z", z)))
        for end, value in enumerate((places[0], places[-1]))
    }
    return Body(name, MeshTri.init_tensor(x, z).with_boundaries(ends))
