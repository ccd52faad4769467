"""Two blocks with meshes that have nothing in common, pressed on each other."""

import numpy as np
import scipy.sparse as sp
from skfem import MeshTet, MeshTri

from fe_models.elasticity.body import ElasticBody
from fe_models.joints.friction import FrictionalJoint
from fe_models.joints.joint import join
from fe_models.joints.mortar import mortar_interface
from fe_models.loads.constraints import Constraints
from fe_models.meshes.halving import halved
from fe_models.meshes.structure_mesh import AXES, Body
from fe_models.meshes.trace import LinearTrace
from fe_models.supported_body import SupportedBody, interface_nodes
from sa_solver.types import Frame, Material

LINE, SURFACE = 2, 3
DIMENSIONS = [LINE, SURFACE]
ORDERS = [1, 2]
# Elements of second order all of whose nodes are vertices of the body.
HALVED = "halved"
STEEL, TITANIUM = Material(200e3, 0.3), Material(115e3, 0.3)
# Error of the forces due to the friction solver; the projection is exact to rounding.
SOLVER = 1e-6

# Two blocks pressed on each other, with meshes that have nothing in common.
LOW, MIDDLE, HIGH = (0.0, 0.0, 0.0), 1.5, (2.0, 3.0, 4.0)


def block(counts, low, high, material, order, shake, seed):
    """Return a box, or a plane rectangle (X, Z), of irregular elements; boundaries x0 ... z1."""
    axes = AXES[len(counts)]
    steps = [
        np.linspace(low[axis], high[axis], n + 1) for axis, n in zip(axes, counts, strict=True)
    ]
    mesh = (MeshTri if len(counts) == LINE else MeshTet).init_tensor(*steps)
    points = mesh.p.copy()
    rng = np.random.default_rng(seed)
    for axis, step in enumerate(steps):
        inside = (mesh.p[axis] > step[0]) & (mesh.p[axis] < step[-1])
        points[axis, inside] += rng.uniform(-shake, shake, inside.sum()) * (step[1] - step[0])
    faces = {
        f"{'xyz'[axis]}{end}": (lambda x, k=k, value=value: np.isclose(x[k], value))
        for k, axis in enumerate(axes)
        for end, value in enumerate((low[axis], high[axis]))
    }
    mesh = type(mesh)(points, mesh.t).with_boundaries(faces)
    return of_kind(Body("block", mesh), material, order)


def of_kind(body, material, order):
    """Return the elastic body with elements of an ``order``, or of second order and halved."""
    if order == HALVED:
        return ElasticBody(halved(body), material, 2)
    return ElasticBody(body, material, order)


def isostatic(elastic):
    """Return constraints that only prevent the rigid motions of the body."""
    low, high = elastic.nodes.min(axis=0), elastic.nodes.max(axis=0)
    corners = [low] + [np.where(np.arange(3) == axis, high, low) for axis in range(2)]
    origin, along_x, along_y = (
        np.linalg.norm(elastic.nodes - corner, axis=1).argmin() for corner in corners
    )
    constraints = Constraints(len(elastic.nodes), elastic.dimension)
    constraints.hold(np.array([origin]))
    if elastic.dimension == LINE:
        constraints.slide(np.array([along_x]), np.array([[0.0, 1.0]]))
    else:
        x, _, z = np.eye(3)
        constraints.slide(np.array([along_x, along_y, along_y]), np.array([z, z, x]))
    return constraints


def boundary_load(elastic, stress, contact):
    """Return forces ``(size,)`` of a stress field ``(3, 3)`` on all faces except the contact.

    ``stress`` gives it at points ``(3, ...)``.
    """
    load = np.zeros(elastic.size)
    for axis in elastic.body.axes:
        for end, sense in enumerate((-1.0, 1.0)):
            name = f"{'xyz'[axis]}{end}"
            if name == contact:
                continue
            for component in elastic.body.axes:
                load += elastic.traction_load(
                    name,
                    lambda x, a=axis, c=component, s=sense: s * stress(x)[a][c] + 0.0 * x[0],
                    np.eye(3)[component],
                )
    return load


class Pressed:
    """A held block, a floating one on it, and their interface, both under a stress field."""

    def __init__(
        self, dimension, order, materials, stress, cells=((2, 3, 2), (3, 4, 3)), shake=0.2
    ):
        self.dimension = dimension
        top, bottom = (*HIGH[:2], MIDDLE), (*LOW[:2], MIDDLE)
        ends = (LOW, top), (bottom, HIGH)
        self.elastic = [
            block([cells[k][axis] for axis in AXES[dimension]], *ends[k], material, order, shake, k)
            for k, material in enumerate(materials)
        ]
        contact = "z1", "z0"
        frame = Frame(np.array([1.0, 1.5 * (dimension == SURFACE), MIDDLE]), np.eye(3))
        bodies = [elastic.body for elastic in self.elastic]
        self.interface = mortar_interface("joint", bodies[0], "z1", bodies[1], "z0", frame)
        self.projection = sp.kron(self.interface.projection, sp.identity(dimension), format="csr")
        constraints = isostatic(self.elastic[0]), Constraints(self.count(1), dimension)
        self.bodies = []
        for k, elastic in enumerate(self.elastic):
            placed = interface_nodes([(self.interface, k + 1)], elastic.body)
            trace = LinearTrace.of(elastic, {contact[k]: placed[0]})
            load = boundary_load(elastic, stress, contact[k])[:, None]
            self.bodies.append(SupportedBody(elastic, constraints[k], *placed, load, trace=trace))
        self.joint = join([body.condense() for body in self.bodies], self.projection)

    def count(self, number):
        return len(self.elastic[number].nodes)

    def glued(self):
        """Return contact forces ``(n, d)`` on body 2 without relative displacement."""
        return self.joint.loads[:, 0].reshape(-1, self.dimension)

    def rubbing(self, friction):
        """Return contact forces and relative displacements ``(n, d)`` with Coulomb friction."""
        frictional = FrictionalJoint(self.joint.resolvent(), friction)
        (state,) = frictional.march(np.ones((1, 1)), self.interface.gap)
        assert state.converged
        axes = list(AXES[self.dimension])
        return state.force[axes].T, state.displacement[axes].T

    def stresses(self, force, relative):
        """Return stresses ``(6, elements)`` of both bodies."""
        one = np.ones(1)
        first, at_1 = self.bodies[0].respond(-self.projection.T @ force.ravel(), one)
        at_2 = self.projection @ at_1 + relative.ravel()
        second = self.bodies[1].recover(at_2, force.ravel(), one)
        return [e.stress(u) for e, u in zip(self.elastic, (first, second), strict=True)]

    @property
    def areas(self):
        """Nodal areas of body 2's face, which is covered completely."""
        return self.interface.nodal_areas
