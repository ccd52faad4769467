"""Joints of two condensed bodies compared with direct solutions of glued or separated bodies."""

import numpy as np
import pytest
import scipy.sparse as sp
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTri

from fe_models.dovetail import dovetail_structure
from fe_models.joints.joint import join
from fe_models.loads.constraints import Constraints
from fe_models.meshes.trace import LinearTrace
from fe_models.supported_body import SupportedBody, interface_nodes
from sa_solver.types import Material

ORDERS = [1, 2]
STEEL, TITANIUM = Material(200e3, 0.3, 7.8e-9), Material(115e3, 0.29, 4.43e-9)


def nodal_trace(elastic, face, nodes):
    """Return nodal values ``(3 n, 3 all)`` of the linear field closest to a displacement.

    They are found by Gauss's rule on the face, in least squares.
    """
    mesh, corners = elastic.body.mesh, elastic.body.facets(face)
    trace = np.zeros((len(nodes), len(elastic.nodes)))
    products = np.zeros((len(nodes), len(nodes)))
    place = {node: row for row, node in enumerate(nodes)}
    points, weights = get_quadrature(RefTri, 4)
    linear = np.array([1.0 - points.sum(axis=0), *points])
    middles, parents = elastic.midsides(face)
    between = {tuple(sorted(pair)): m for pair, m in zip(parents.tolist(), middles, strict=True)}
    for triangle in corners:
        edges = mesh.p[:, triangle[1:]] - mesh.p[:, triangle[:1]]
        measure = np.linalg.norm(np.cross(*edges.T)) * weights
        shapes = dict(zip(triangle, linear, strict=True))
        if between:
            shapes = {n: f * (2.0 * f - 1.0) for n, f in shapes.items()} | {
                between[tuple(sorted((triangle[i], triangle[j])))]: 4.0 * linear[i] * linear[j]
                for i, j in ((0, 1), (1, 2), (2, 0))
            }
        for one, test in zip(triangle, linear, strict=True):
            for other, trial in zip(triangle, linear, strict=True):
                products[place[one], place[other]] += measure @ (test * trial)
            for node, shape in shapes.items():
                trace[place[one], node] += measure @ (test * shape)
    return np.kron(np.linalg.solve(products, trace), np.eye(3))


class Stacked:
    """Held box with a floating one on it that is pulled at its top; both spin."""

    def __init__(self, box, order):
        self.lower = box((2, 3, 2), (0.0, 0.0, 0.0), (2.0, 3.0, 1.5), STEEL, order)
        self.upper = box((2, 3, 3), (0.0, 0.0, 1.5), (2.0, 3.0, 4.0), TITANIUM, order)
        self.nodes_1 = self.vertices(self.lower, "z1")
        self.nodes_2 = self.vertices(self.upper, "z0")
        rng = np.random.default_rng(0)
        self.axes, _ = np.linalg.qr(rng.standard_normal((3, 3)))
        self.constraints = []
        for elastic in (self.lower, self.upper):
            constraints = Constraints(len(elastic.nodes))
            if elastic is self.lower:
                constraints.hold(elastic.boundary_nodes("z0"))
            self.constraints.append(constraints)
        pull = self.upper.traction_load("z1", lambda x: x[0], np.array([0.6, 0.0, 0.8]))
        self.loads = [
            np.stack([1e6 * e.centrifugal_load(), second], axis=1)
            for e, second in ((self.lower, 0.0 * self.lower.centrifugal_load()), (self.upper, pull))
        ]
        frames = np.tile(self.axes, (len(self.nodes_1), 1, 1))
        self.bodies = [
            SupportedBody(
                elastic, constraints, nodes, frames, loads, trace=LinearTrace.of(elastic, face)
            )
            for elastic, constraints, face, nodes, loads in zip(
                (self.lower, self.upper),
                self.constraints,
                ({"z1": self.nodes_1}, {"z0": self.nodes_2}),
                (self.nodes_1, self.nodes_2),
                self.loads,
                strict=True,
            )
        ]

    @staticmethod
    def vertices(elastic, face):
        nodes = elastic.body.vertices(face)
        x, y, _ = elastic.nodes[nodes].T
        return nodes[np.lexsort((x, y))]

    def joined(self):
        return join([body.condense() for body in self.bodies])

    def direct(self, relative, amplitudes):
        """Solve both bodies with u_2 = u_1 + w on the face as constraints of one dense system.

        Returns the forces on body 2 in the frame and the displacements of both bodies.
        """
        matrices, loads = [], []
        for elastic, constraints, load in zip(
            (self.lower, self.upper), self.constraints, self.loads, strict=True
        ):
            t = constraints.transformation()
            matrices.append((t, (t.T @ elastic.stiffness @ t).toarray()))
            loads.append(t.T @ load @ amplitudes)
        sizes = [len(load) for load in loads]
        traces = [
            nodal_trace(elastic, face, nodes) @ t
            for elastic, face, nodes, (t, _) in zip(
                (self.lower, self.upper),
                ("z1", "z0"),
                (self.nodes_1, self.nodes_2),
                matrices,
                strict=True,
            )
        ]
        # Saddle point: the multipliers are the contact forces on body 2.
        count, total = len(traces[0]), sum(sizes)
        system = np.zeros((total + count, total + count))
        system[: sizes[0], : sizes[0]] = matrices[0][1]
        system[sizes[0] : total, sizes[0] : total] = matrices[1][1]
        jump = np.hstack([-traces[0], traces[1]])
        system[total:, :total] = jump
        system[:total, total:] = -jump.T
        right = np.concatenate([*loads, (relative @ self.axes).ravel()])
        solution = np.linalg.solve(system, right)
        force = solution[total:].reshape(-1, 3) @ self.axes.T
        return force, (
            matrices[0][0] @ solution[: sizes[0]],
            matrices[1][0] @ solution[sizes[0] : total],
        )


@pytest.fixture(scope="module", params=ORDERS)
def stacked(request, box):
    return Stacked(box, request.param)


@pytest.mark.parametrize("apart", [0.0, 1e-3])
def test_joint_is_the_direct_solution(stacked, apart):
    """Compare glued bodies (w = 0) and a given relative displacement, inside, too."""
    joint = stacked.joined()
    amplitudes = np.array([2.0, 30.0])
    relative = apart * np.random.default_rng(1).standard_normal((len(stacked.nodes_1), 3))
    expected, displacements = stacked.direct(relative, amplitudes)
    force = joint.stiffness @ relative.ravel() + joint.loads @ amplitudes
    scale = np.abs(expected).max()
    np.testing.assert_allclose(force.reshape(-1, 3), expected, atol=1e-9 * scale)

    lower, interface = stacked.bodies[0].respond(-force, amplitudes)
    upper = stacked.bodies[1].recover(interface + relative.ravel(), force, amplitudes)
    for displacement, exact in zip((lower, upper), displacements, strict=True):
        np.testing.assert_allclose(displacement, exact, atol=1e-9 * np.abs(exact).max())


def condensed(rng, size, rank):
    """Return a stiffness of that rank and two load cases that it can balance."""
    root = rng.standard_normal((size, rank))
    return root @ root.T, root @ rng.standard_normal((rank, 2))


def test_projected_joint_is_the_direct_solution():
    """Check equilibrium of both bodies with u_2 = N u_1 + w, body 1 with fewer nodes."""
    rng = np.random.default_rng(0)
    first, second = condensed(rng, 18, 18), condensed(rng, 24, 18)
    projection = sp.random(24, 18, 0.3, "csr", random_state=rng)
    joint = join([first, second], projection)
    relative, amplitudes = rng.standard_normal(24), np.array([2.0, -3.0])
    n = projection.toarray()
    system = np.block(
        [
            [first[0], np.zeros((18, 24)), n.T],
            [np.zeros((24, 18)), second[0], -np.eye(24)],
            [-n, np.eye(24), np.zeros((24, 24))],
        ]
    )
    right = np.concatenate([first[1] @ amplitudes, second[1] @ amplitudes, relative])
    expected = np.linalg.solve(system, right)[-24:]
    force = joint.stiffness @ relative + joint.loads @ amplitudes
    np.testing.assert_allclose(force, expected, atol=1e-9 * np.abs(expected).max())
    assert joint.rigid_modes == 6


def test_identity_projects_as_none_does(stacked):
    pair = [body.condense() for body in stacked.bodies]
    identity = sp.identity(3 * len(stacked.nodes_2), format="csr")
    plain, projected = join(pair), join(pair, identity)
    scale = np.abs(plain.stiffness).max()
    np.testing.assert_allclose(projected.stiffness, plain.stiffness, atol=1e-12 * scale)
    np.testing.assert_allclose(projected.loads, plain.loads, atol=1e-12 * np.abs(plain.loads).max())


def test_floating_body_has_six_rigid_modes(stacked):
    joint = stacked.joined()
    values = np.linalg.eigvalsh(joint.stiffness)
    assert joint.rigid_modes == 6
    assert np.abs(values[:6]).max() < 1e-10 * values[-1]
    assert joint.smallest == pytest.approx(values[6], rel=1e-6)
    assert joint.largest == pytest.approx(values[-1], rel=1e-9)


def test_stiffness_of_the_joint_is_symmetric(stacked):
    stiffness = stacked.joined().stiffness
    assert np.abs(stiffness - stiffness.T).max() < 1e-12 * np.abs(stiffness).max()


def test_resolvent(stacked):
    joint = stacked.joined()
    resolvent = joint.resolvent()
    identity = np.eye(len(joint.stiffness))
    product = resolvent.inverse @ (joint.stiffness + resolvent.rho * identity)
    np.testing.assert_allclose(product, identity, atol=1e-9)
    assert resolvent.rho == pytest.approx(np.sqrt(joint.smallest * joint.largest))


def test_linear_displacements_are_their_own_trace(box):
    """Check elements of second order in rotated frames."""
    stacked = Stacked(box, 2)
    body, elastic = stacked.bodies[1], stacked.upper
    gradient, shift = np.random.default_rng(0).standard_normal((2, 3, 3))
    moved = elastic.nodes @ gradient.T + shift[0]
    expected = (moved[stacked.nodes_2] @ stacked.axes.T).ravel()
    np.testing.assert_allclose(body.at_interface(moved.ravel()), expected, atol=1e-10)


@pytest.mark.parametrize("order", ORDERS)
def test_uniform_pressure_crosses_the_interface(box, order):
    """Check that glued bodies of one material carry p times the nodal areas."""
    stacked = Stacked(box, order)
    stacked.lower = box((2, 3, 2), (0.0, 0.0, 0.0), (2.0, 3.0, 1.5), TITANIUM, order)
    pressure, normal = 50.0, np.array([0.0, 0.0, 1.0])
    bodies = []
    for elastic, face, nodes in (
        (stacked.lower, "z1", stacked.nodes_1),
        (stacked.upper, "z0", stacked.nodes_2),
    ):
        constraints = Constraints(len(elastic.nodes))
        if elastic is stacked.lower:
            # It is on a smooth table, with just enough further supports to keep it in place.
            constraints.slide(*elastic.boundary_normals("z0"))
            origin, corner = (
                np.linalg.norm(elastic.nodes - [0.0, y, 0.0], axis=1).argmin() for y in (0.0, 3.0)
            )
            constraints.hold(np.array([origin]))
            constraints.slide(np.array([corner]), np.array([[1.0, 0.0, 0.0]]))
        trace = LinearTrace.of(elastic, {face: nodes})
        frames = np.tile(np.eye(3), (len(nodes), 1, 1))
        load = np.zeros((3 * len(elastic.nodes), 1))
        if elastic is stacked.upper:
            press = elastic.traction_load("z1", lambda x: np.full_like(x[0], -pressure), normal)
            load[:, 0] = press
        bodies.append(SupportedBody(elastic, constraints, nodes, frames, load, trace=trace))
    joint = join([body.condense() for body in bodies])
    force = joint.loads[:, 0].reshape(-1, 3)
    nodes, weights = box((2, 3, 3), (0.0, 0.0, 1.5), (2.0, 3.0, 4.0), TITANIUM, 1).boundary_weights(
        "z0"
    )
    areas = weights[np.searchsorted(nodes, stacked.nodes_2)]
    np.testing.assert_allclose(force[:, 2], pressure * areas, rtol=1e-8)
    np.testing.assert_allclose(force[:, :2], 0.0, atol=1e-8 * pressure)


def test_tied_interface_node_is_refused(box):
    stacked = Stacked(box, 1)
    stacked.constraints[0].average(stacked.nodes_1[:1], stacked.nodes_1[None, 1:3])
    with pytest.raises(ValueError, match="couples nodes of a contact face"):
        SupportedBody(
            stacked.lower,
            stacked.constraints[0],
            stacked.nodes_1,
            np.tile(np.eye(3), (len(stacked.nodes_1), 1, 1)),
            stacked.loads[0],
        )


def test_dovetail_has_five_rigid_modes(structure, joint):
    """Check that H has no stiffness to all motions of the blade except along the slot."""
    assert joint.rigid_modes == 5
    along = np.array([0.0, 1.0, 0.0])
    blade = structure.mesh.bodies[1]
    _, axes = interface_nodes(structure.mesh.faces_of(1), blade)
    at = np.concatenate([blade.points[face.nodes_2] for face in structure.mesh.interfaces])
    free = structure.bodies[1].free_motions(np.zeros(3), 250.0)
    assert len(free) == 5
    for shift, turn in free.reshape(-1, 2, 3):
        motion = shift + np.cross(turn / 250.0, at)
        w = np.einsum("nab,nb->na", axes, motion).ravel()
        assert np.abs(joint.stiffness @ w).max() < 1e-9 * joint.largest * np.abs(w).max()
    w = np.einsum("nab,b->na", axes, along).ravel()
    assert np.abs(joint.stiffness @ w).max() > 1e-4 * joint.largest


def test_order_2_dovetail_is_softer(dovetail, titanium, mission):
    """Check that its larger displacement space gives more energy under the same loads."""
    mesh = dovetail.mesh((4, 4), 15.0, notch=16)
    energies = []
    for order in ORDERS:
        structure = dovetail_structure(dovetail, mesh, titanium, titanium, mission, order)
        joint = structure.condense()
        assert joint.rigid_modes == 5
        stiffness = np.asarray(joint.stiffness)
        assert np.abs(stiffness - stiffness.T).max() < 1e-12 * joint.largest
        w = np.random.default_rng(0).standard_normal((len(stiffness), 10))
        energies.append(np.einsum("an,an->n", w, stiffness @ w))
    assert np.all(energies[1] < energies[0])
