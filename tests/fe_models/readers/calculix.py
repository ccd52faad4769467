"""CalculiX on our meshes: its input from elastic bodies, and its results from the .dat file.

Nodes and elements are numbered from 1, those of all bodies one after the other. Numbers in the .dat
file have seven digits.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as sl

from fe_models.elasticity.body import ElasticBody
from sa_solver.types import Array, Indices

needs_ccx = pytest.mark.skipif(shutil.which("ccx") is None, reason="needs CalculiX's ccx")

TYPES = {1: "C3D4", 2: "C3D10"}
# CalculiX lists the nodes of a tetrahedron's edges as (01), (12), (02), (03), (13), (23).
EDGES = {
    frozenset(pair): k for k, pair in enumerate([(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)])
}
# xx, yy, zz, xy, xz, yz of CalculiX to xx, yy, zz, xy, yz, zx.
COMPONENTS = [0, 1, 2, 3, 5, 4]
# CalculiX's tolerances of balance and of the last correction; its defaults are 0.5 and 1 %.
BALANCED = "1.e-6, 1.e-6"
# Tension due to its penalty far from contact [MPa].
TENSION = 1e-4
# Coefficients of an equation below this share of the largest are rounding errors.
NO_COEFFICIENT = 1e-12


@dataclass
class Step:
    """Loads at the end of a step of so many ``increments``; its own ``loads`` are cards."""

    increments: int = 1
    loads: list[str] = field(default_factory=list)


@dataclass
class Job:
    """Bodies, cards of the model such as supports, and the steps of their loads."""

    bodies: Sequence[ElasticBody]
    model: list[str] = field(default_factory=list)
    steps: list[Step] = field(default_factory=lambda: [Step()])

    @property
    def offsets(self) -> Indices:
        """Number of nodes before those of each body."""
        return np.cumsum([0] + [len(body.nodes) for body in self.bodies])

    def hold(self, number: int, nodes: Indices, axes: Sequence[int] = (0, 1, 2)) -> None:
        """Hold nodes of a body along some axes."""
        self.model.append("*BOUNDARY")
        for node in self.offsets[number] + nodes + 1:
            self.model += [f"{node}, {axis + 1}, {axis + 1}" for axis in axes]

    def tie(self, relation: Array) -> None:
        """Impose Σ_j C_ij u_j = 0 in every direction, C ``(m, all nodes)``."""
        for row, dependent in zip(*_eliminated(relation), strict=True):
            others = np.flatnonzero(np.abs(row) > NO_COEFFICIENT * np.abs(row).max())
            terms = [dependent, *others[others != dependent]]
            for axis in (1, 2, 3):
                self.model += ["*EQUATION", f"{len(terms)}"]
                reported = [f"{node + 1}, {axis}, {row[node]:.12e}" for node in terms]
                self.model += [", ".join(reported[k : k + 4]) for k in range(0, len(reported), 4)]

    def load(self, number: int, forces: Array) -> None:
        """Add nodal forces ``(size,)`` on a body at the end of the last step."""
        cards = self.steps[-1].loads
        cards.append("*CLOAD")
        for node, force in enumerate(forces.reshape(-1, 3), start=self.offsets[number] + 1):
            cards += [f"{node}, {axis + 1}, {f:.12e}" for axis, f in enumerate(force) if f]

    def touch(self, boundary: str, stiffness: float, friction: float) -> None:
        """Add contact of the nodes of a boundary of the second body with one of the first.

        Its penalty is a ``stiffness`` [MPa/mm], across the faces and along them.
        """
        lower, upper = self.bodies
        nodes = self.offsets[1] + 1 + upper.body.vertices(boundary)
        sides = element_sides(lower, lower.body.mesh.boundaries[boundary])
        self.model += ["*SURFACE, NAME=slave, TYPE=NODE", *map(str, nodes)]
        self.model += ["*SURFACE, NAME=master, TYPE=ELEMENT"]
        self.model += [f"{1 + element}, S{side}" for element, side in sides]
        self.model += ["*CONTACT PAIR, INTERACTION=joint, TYPE=NODE TO SURFACE, SMALL SLIDING"]
        self.model += ["slave, master", "*SURFACE INTERACTION, NAME=joint"]
        self.model += ["*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR"]
        self.model += [f"{stiffness:.12e}, {TENSION:.12e}"]
        self.model += ["*FRICTION", f"{friction:.12e}, {stiffness:.12e}"]

    def press(self, number: int, boundary: str, pressure: float) -> None:
        """Add a pressure on a boundary, as CalculiX integrates it."""
        mesh = self.bodies[number].body.mesh
        first = 1 + sum(body.body.mesh.nelements for body in self.bodies[:number])
        cards = self.steps[-1].loads
        cards.append("*DLOAD")
        for element, side in element_sides(self.bodies[number], mesh.boundaries[boundary]):
            cards.append(f"{first + element}, P{side}, {pressure:.12e}")

    def run(self, folder: Path) -> Answer:
        """Solve the job; return displacements and stresses at the end of the last increment."""
        file = folder / "job.inp"
        file.write_text("\n".join(self._lines()) + "\n")
        done = subprocess.run(
            ["ccx", "-i", "job"], cwd=folder, capture_output=True, text=True, timeout=600
        )
        assert done.returncode == 0, done.stdout[-2000:]
        assert "*ERROR" not in done.stdout, done.stdout[-2000:]
        return Answer.read((folder / "job.dat").read_text(), self)

    def _lines(self) -> list[str]:
        lines, element = ["*NODE, NSET=all"], 1
        points = np.concatenate([body.nodes for body in self.bodies])
        for node, (x, y, z) in enumerate(points, start=1):
            lines.append(f"{node}, {x:.12e}, {y:.12e}, {z:.12e}")
        for number, (body, offset) in enumerate(zip(self.bodies, self.offsets[:-1], strict=True)):
            lines.append(f"*ELEMENT, TYPE={TYPES[body.order]}, ELSET=body{number}")
            for nodes in ordered(body)[0] + offset + 1:
                lines.append(", ".join(map(str, [element, *nodes])))
                element += 1
            material = body.material
            lines += [f"*MATERIAL, NAME=m{number}", "*ELASTIC"]
            lines += [f"{material.young:.12e}, {material.poisson:.12e}"]
            lines.append(f"*SOLID SECTION, ELSET=body{number}, MATERIAL=m{number}")
        lines += self.model
        for step in self.steps:
            lines += self._step(step)
        return lines

    def _step(self, step: Step) -> list[str]:
        share = f"{1.0 / step.increments:.12e}"
        lines = ["*STEP, INC=10000", "*STATIC", f"{share}, 1., 1.e-8, {share}"]
        lines += ["*CONTROLS, PARAMETERS=FIELD", BALANCED]
        lines += step.loads
        every = "FREQUENCY=10000"
        lines += [f"*NODE PRINT, NSET=all, {every}", "U"]
        for number in range(len(self.bodies)):
            lines += [f"*EL PRINT, ELSET=body{number}, {every}", "S"]
        return [*lines, "*END STEP"]


@dataclass(frozen=True)
class Answer:
    """Displacements ``(n, 3)`` [mm] of each body, and stresses ``(6, elements, points)``.

    Stress is that at the integration points, near the corners of the element in CalculiX's order.
    """

    displacements: list[Array]
    stresses: list[Array]

    @classmethod
    def read(cls, text: str, job: Job) -> Answer:
        """Read the last of each table."""
        tables: dict[str, Array] = {}
        parts = re.split(r"\n\s*(displacements|stresses)[^\n]*?(?:set (\S+))[^\n]*\n", text)
        for kind, name, rows in zip(parts[1::3], parts[2::3], parts[3::3], strict=True):
            numbers = [line.split() for line in rows.strip().split("\n\n")[0].splitlines()]
            tables[f"{kind} {name.upper()}"] = np.array(numbers, dtype=np.float64)
        every = tables["displacements ALL"][:, 1:4]
        displacements = np.split(every, job.offsets[1:-1])
        stresses = []
        for number, body in enumerate(job.bodies):
            table = tables[f"stresses BODY{number}"]
            found = table[:, 2:8][:, COMPONENTS].reshape(body.body.mesh.nelements, -1, 6)
            stresses.append(_at_own_corners(body, found).transpose(2, 0, 1))
        return cls(displacements, stresses)


def ordered(body: ElasticBody) -> tuple[Indices, Indices]:
    """Return the nodes of elements ``(m, 4 or 10)`` in CalculiX's order, and their corners' places.

    CalculiX's elements are right-handed, so two corners of the others are exchanged.
    """
    mesh = body.body.mesh
    corners = mesh.p[:, mesh.t]
    left = np.linalg.det(np.moveaxis(corners[:, 1:] - corners[:, :1], -1, 0)) < 0.0
    places = np.tile(np.arange(4), (mesh.nelements, 1))
    places[left] = [0, 2, 1, 3]
    if body.order == 1:
        return np.take_along_axis(mesh.t.T, places, axis=1), places
    rows = []
    for nodes, place in zip(body.body.element_nodes, places, strict=True):
        middle = [
            nodes[4 + EDGES[frozenset((place[a], place[b]))]]
            for a, b in ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
        ]
        rows.append([*nodes[place], *middle])
    return np.array(rows), places


def element_sides(body: ElasticBody, facets: Indices) -> list[tuple[int, int]]:
    """Return the elements of facets and CalculiX's numbers of their faces there, counted from 1."""
    nodes, _ = ordered(body)
    mesh, sides = body.body.mesh, []
    faces = [(0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3)]
    for facet in facets:
        element = int(mesh.f2t[0, facet])
        corners = set(mesh.facets[:, facet])
        side = next(k for k, face in enumerate(faces) if set(nodes[element, list(face)]) == corners)
        sides.append((element, side + 1))
    return sides


def stresses_of(body: ElasticBody, displacement: Array) -> Array:
    """Return stress ``(6, elements, points)`` at CalculiX's integration points.

    It is computed from our displacements.
    """
    basis = body.basis(2) if body.order == 2 else body.basis(1)
    gradient = np.stack(
        [np.asarray(basis.interpolate(u).grad) for u in displacement.reshape(-1, 3).T]
    )
    stress = body.cauchy(gradient.reshape(3, 3, -1)).reshape(6, *gradient.shape[2:])
    if body.order == 1:
        return stress
    shares = np.vstack([1.0 - basis.X.sum(axis=0), basis.X])
    near = np.argmax(shares, axis=0)
    assert sorted(near) == [0, 1, 2, 3]
    return np.asarray(stress[:, :, np.argsort(near)])


def _at_own_corners(body: ElasticBody, found: Array) -> Array:
    """Return values near the mesh's corners from those near CalculiX's, ``(m, points, 6)``."""
    if found.shape[1] == 1:
        return found
    _, places = ordered(body)
    own = np.empty_like(found)
    np.put_along_axis(own, places[:, :, None], found, axis=1)
    return own


def _eliminated(relation: Array) -> tuple[Array, Indices]:
    """Return equivalent equations that each have an unknown of their own, and these unknowns."""
    _, _, order = sl.qr(relation, mode="economic", pivoting=True)
    dependent = order[: len(relation)]
    return np.linalg.solve(relation[:, dependent], relation), dependent
