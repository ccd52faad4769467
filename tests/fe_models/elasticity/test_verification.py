"""Finite elements against closed forms, with their rates of convergence, in plane and space.

With tractions of the exact solution on the boundary, L2 errors of linear elements fall as h² in
displacement and h in stress, those of quadratic ones as h³ and h². Straight sides of elements on a
curved boundary cause an error of h² in displacement; their stress errors are of order h in a layer
as thin as an element, so h^1.5 in energy.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from skfem import Basis, ElementTetP1, ElementTetP2, ElementTriP1, ElementTriP2, MeshTet, MeshTri

from fe_models.elasticity.body import ElasticBody
from fe_models.joints import friction
from fe_models.joints.friction import FrictionalJoint
from fe_models.joints.joint import join
from fe_models.loads.constraints import Constraints
from fe_models.meshes.structure_mesh import Body
from fe_models.meshes.trace import LinearTrace
from fe_models.solvers.linear_solver import factorise
from fe_models.supported_body import SupportedBody
from sa_solver.types import Material

ORDERS, DIMENSIONS = [1, 2], [2, 3]
ELEMENTS = {(2, 1): ElementTriP1, (2, 2): ElementTriP2, (3, 1): ElementTetP1, (3, 2): ElementTetP2}
MATERIAL = Material(100.0, 0.3)
AXES = np.eye(3)
OUTWARD = {
    f"{name}{end}": (2 * end - 1) * AXES["xyz".index(name)] for name in "xyz" for end in (0, 1)
}
# Quadrature degree that is exact for errors of quadratic elements with such smooth solutions.
INTEGRATION_ORDER = 6
# Tolerance of a rate between two meshes.
SLACK = 0.15


def tensor_mesh(steps, dimension):
    """Return a box of cells with named faces.

    ``steps`` are along X, Y (one cell, in space only) and Z.
    """
    axis_steps = steps if dimension == 3 else [steps[0], steps[2]]
    names = "xyz" if dimension == 3 else "xz"
    faces = {
        f"{name}{end}": (lambda x, axis=axis, value=value: np.isclose(x[axis], value))
        for axis, (name, values) in enumerate(zip(names, axis_steps, strict=True))
        for end, value in enumerate((values[0], values[-1]))
    }
    mesh = (MeshTet if dimension == 3 else MeshTri).init_tensor(*axis_steps)
    return mesh.with_boundaries(faces)


def moved(mesh, points):
    """Return the mesh with moved vertices and the same boundary names."""
    return type(mesh)(points, mesh.t).with_boundaries(mesh.boundaries)


def irregular(dimension):
    """Return a unit box whose inner vertices are moved."""
    mesh = tensor_mesh([np.linspace(0.0, 1.0, 4)] * 3, dimension)
    points = mesh.p.copy()
    inner = np.setdiff1d(np.arange(mesh.nvertices), mesh.boundary_nodes())
    points[:, inner] += np.random.default_rng(0).uniform(-0.1, 0.1, (dimension, len(inner)))
    return moved(mesh, points)


def solved(elastic, constraints, load):
    t = constraints.transformation()
    return t @ factorise((t.T @ elastic.stiffness @ t).tocsr())(t.T @ load)


def traction_forces(elastic, stress, normals):
    """Return the forces of tractions σ·n on ``normals``, given by boundary name.

    ``stress`` gives ``(3, 3, ...)`` at points.
    """
    load = np.zeros(elastic.size)
    for name, normal in normals.items():
        for row in elastic.body.axes:
            load += elastic.traction_load(
                name, lambda x, row=row, n=normal: np.tensordot(n, stress(x)[row], 1), AXES[row]
            )
    return load


def rigid_motions(points, dimension):
    """Return rigid displacements ``(motions, 3, ...)`` at points; in the plane only in it."""
    shifts = np.broadcast_to(AXES.reshape(3, 3, *[1] * (points.ndim - 1)), (3, *points.shape))
    turns = np.stack([np.cross(axis, points, axis=0, axisb=0, axisc=0) for axis in AXES])
    kept = ([0, 1, 2], [0, 1, 2]) if dimension == 3 else ([0, 2], [1])
    return np.concatenate([shifts[kept[0]], turns[kept[1]]])


def held_still(elastic, face, floats=False):
    """Hold three corners of a face across it, two along it, one along it: no load is taken.

    ``floats`` holds them along it only. In the plane it is two corners across and one along.
    """
    axes = list(elastic.body.axes)
    normal = "xyz".index(face[0])
    across = [axis for axis in axes if axis != normal]
    nodes = elastic.boundary_nodes(face)
    signs = np.where(np.eye(len(across) + 1, len(across), -1) > 0.0, 1.0, -1.0)
    corners = nodes[np.argmax(elastic.nodes[nodes][:, across] @ signs.T, axis=0)]
    constraints = Constraints(len(elastic.nodes), elastic.dimension)
    held = [] if floats else [(corners, normal)]
    held += [(corners[: len(across) - k], axis) for k, axis in enumerate(reversed(across))]
    for some, axis in held:
        constraints.slide(some, np.tile(AXES[axis][axes], (len(some), 1)))
    return constraints


def strain_of(stress, material):
    trace = np.einsum("aa...->...", stress)
    identity = AXES.reshape(3, 3, *[1] * (stress.ndim - 2))
    return ((1.0 + material.poisson) * stress - material.poisson * trace * identity) / (
        material.young
    )


@dataclass(frozen=True)
class Errors:
    """Relative errors of displacements in L2, in energy, and of element mean stresses in L2."""

    displacement: float
    energy: float
    mean_stress: float


def errors(elastic, u, displacement, stress, free=False):
    """Return errors of displacements ``(size,)`` against exact ones and their stress.

    Exact values are given at points in space. If ``free``, rigid motions are ignored.
    """
    dimension, axes = elastic.dimension, list(elastic.body.axes)
    basis = Basis(
        elastic.body.mesh, ELEMENTS[dimension, elastic.order](), intorder=INTEGRATION_ORDER
    )
    points = np.zeros((3, *basis.dx.shape))
    points[axes] = np.asarray(basis.global_coordinates())
    fields = [basis.interpolate(np.ascontiguousarray(c)) for c in u.reshape(-1, dimension).T]
    computed, gradient = np.zeros_like(points), np.zeros((3, *points.shape))
    for axis, field in zip(axes, fields, strict=True):
        computed[axis], gradient[axis, axes] = np.asarray(field), np.asarray(field.grad)
    exact, exact_stress = displacement(points), stress(points)
    difference = computed - exact
    if free:
        difference = without_rigid_motion(difference, points, basis.dx, dimension)
    strain = strain_of(exact_stress, elastic.material)
    wrong = 0.5 * (gradient + gradient.swapaxes(0, 1)) - strain
    means = np.sum(exact_stress * basis.dx, axis=-1) / basis.dx.sum(axis=1)
    components = [0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]
    stress_error = elastic.stress(u) - means[components]
    volume = basis.dx.sum(axis=1)
    return Errors(
        np.sqrt(np.sum(difference**2 * basis.dx) / np.sum(exact**2 * basis.dx)),
        np.sqrt(energy(wrong, basis.dx, elastic) / energy(strain, basis.dx, elastic)),
        np.sqrt(np.sum(stress_error**2 * volume) / np.sum(means[components] ** 2 * volume)),
    )


def energy(strain, dx, elastic):
    material = elastic.material
    trace = np.einsum("aa...->...", strain)
    density = material.lame * trace**2 + 2.0 * material.shear_modulus * np.sum(strain**2, (0, 1))
    return 0.5 * np.sum(density * dx)


def without_rigid_motion(field, points, dx, dimension):
    """Return a field less the rigid motion closest to it in L2."""
    motions = rigid_motions(points, dimension)
    gram = np.einsum("iaeq,jaeq,eq->ij", motions, motions, dx)
    share = np.linalg.solve(gram, np.einsum("iaeq,aeq,eq->i", motions, field, dx))
    return field - np.einsum("i,iaeq->aeq", share, motions)


def rates(coarse, fine):
    """Return the rates of the three errors between meshes with a ratio of two."""
    return np.log2([getattr(coarse, n) / getattr(fine, n) for n in Errors.__annotations__])


# --- Patch tests ---------------------------------------------------------------------------------


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("order", ORDERS)
def test_rigid_motions_are_all_that_takes_no_force(dimension, order):
    elastic = ElasticBody(Body("box", irregular(dimension)), MATERIAL, order)
    stiffness = elastic.stiffness.toarray()
    values = np.linalg.eigvalsh(stiffness)
    motions = rigid_motions(elastic.nodes.T, dimension)
    assert np.all(np.abs(values[: len(motions)]) < 1e-10 * values[-1])
    assert values[len(motions)] > 1e-5 * values[-1]
    for motion in motions[:, list(elastic.body.axes)]:
        u = motion.T.ravel()
        assert np.abs(stiffness @ u).max() < 1e-10 * values[-1] * np.abs(u).max()
        assert np.abs(elastic.stress(u)).max() < 1e-10 * MATERIAL.young


@pytest.mark.parametrize(
    ("dimension", "component"),
    [(2, c) for c in ("xx", "zz", "zx")] + [(3, c) for c in ("xx", "yy", "zz", "xy", "yz", "zx")],
)
@pytest.mark.parametrize("order", ORDERS)
def test_constant_stress_by_tractions(dimension, order, component):
    """Check that each unit stress on the faces of an irregular mesh is reproduced."""
    row, column = ("xyz".index(letter) for letter in component)
    elastic = ElasticBody(Body("box", irregular(dimension)), MATERIAL, order)
    unit = np.zeros((3, 3))
    unit[row, column] = unit[column, row] = 1.0
    if dimension == 2:
        # In plane strain these forces keep the sides in place.
        unit[1, 1] = MATERIAL.poisson * np.trace(unit)

    def constant(x):
        return np.multiply.outer(unit, np.ones_like(x[0]))

    normals = {name: OUTWARD[name] for name in elastic.body.mesh.boundaries}
    load = traction_forces(elastic, constant, normals)
    u = solved(elastic, held_still(elastic, "x0"), load)
    expected = unit[[0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]
    stress = elastic.stress(u)
    np.testing.assert_allclose(stress, np.tile(expected[:, None], stress.shape[1]), atol=1e-10)
    strain = strain_of(unit, MATERIAL)
    worst = errors(elastic, u, lambda x: np.einsum("ab,b...->a...", strain, x), constant, free=True)
    assert max(worst.displacement, worst.energy, worst.mean_stress) < 1e-10


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("order", ORDERS)
def test_constant_stress_crosses_a_stuck_contact(monkeypatch, dimension, order):
    """Check a block held by contact only, pressed and sheared below Coulomb's limit."""
    monkeypatch.setattr(friction, "TOLERANCE", 1e-13)
    tensor = np.array([[0.3, 0.0, 0.2], [0.0, 0.0, 0.1], [0.2, 0.1, -1.0]])
    if dimension == 2:
        tensor[1] = tensor[:, 1] = 0.0
    mesh = irregular(dimension)
    names = [name for name in mesh.boundaries if name != "z1"]
    bodies, supported = [], []
    for side in (-1.0, 1.0):
        points = mesh.p.copy()
        points[-1] = side * (1.0 - points[-1])
        elastic = ElasticBody(Body("block", moved(mesh, points)), MATERIAL, order)
        if side < 0.0:
            constraints = held_still(elastic, "z0")
        else:
            constraints = Constraints(len(elastic.nodes), dimension)
        normals = {name: OUTWARD[name] for name in names} | {"z0": side * AXES[2]}
        load = traction_forces(
            elastic, lambda x: np.multiply.outer(tensor, np.ones_like(x[0])), normals
        )
        nodes = elastic.body.vertices("z1")
        frames = np.tile(np.eye(dimension), (len(nodes), 1, 1))
        trace = LinearTrace.of(elastic, {"z1": nodes})
        supported.append(
            SupportedBody(elastic, constraints, nodes, frames, load[:, None], trace=trace)
        )
        bodies.append(elastic)
    joint = join([body.condense() for body in supported])
    frictional = FrictionalJoint(joint.resolvent(), 0.5)
    (state,) = frictional.march(np.ones((1, 1)), np.zeros(len(nodes)))
    assert state.converged
    _, areas = ElasticBody(bodies[0].body, MATERIAL, 1).boundary_weights("z1")
    np.testing.assert_allclose(state.force, np.outer(-tensor[2], areas), atol=1e-10)
    np.testing.assert_allclose(state.displacement, 0.0, atol=1e-10)


# --- A cantilever under a shear force ------------------------------------------------------------


class Cantilever:
    """Cantilever in plane strain, along X to ``LENGTH``, ``2 HALF`` high, sheared at X = 0.

    Timoshenko & Goodier 1970, *Theory of Elasticity*, art. 21, with E/(1 - ν²) and ν/(1 - ν) for E
    and ν; the tractions on both ends are those of the exact solution.
    """

    LENGTH, HALF, FORCE = 4.0, 0.5, 1.0
    THICKNESS = 0.25

    @classmethod
    def stress(cls, x):
        inertia = 2.0 * cls.HALF**3 / 3.0
        stress = np.zeros((3, *x.shape))
        stress[0, 0] = -cls.FORCE * x[0] * x[2] / inertia
        stress[1, 1] = MATERIAL.poisson * stress[0, 0]
        stress[0, 2] = stress[2, 0] = -0.5 * cls.FORCE * (cls.HALF**2 - x[2] ** 2) / inertia
        return stress

    @classmethod
    def displacement(cls, x):
        """Return the displacement without its rigid motion."""
        nu = MATERIAL.poisson / (1.0 - MATERIAL.poisson)
        bending = MATERIAL.young / (1.0 - MATERIAL.poisson**2) * 2.0 * cls.HALF**3 / 3.0
        shearing = MATERIAL.shear_modulus * 2.0 * cls.HALF**3 / 3.0
        displacement = np.zeros_like(x)
        along, across = x[0], x[2]
        displacement[0] = cls.FORCE * (
            -(along**2) * across / (2.0 * bending)
            - nu * across**3 / (6.0 * bending)
            + across**3 / (6.0 * shearing)
            + (cls.LENGTH**2 / (2.0 * bending) - cls.HALF**2 / (2.0 * shearing)) * across
        )
        displacement[2] = cls.FORCE * (
            nu * along * across**2 / (2.0 * bending)
            + along**3 / (6.0 * bending)
            - cls.LENGTH**2 * along / (2.0 * bending)
            + cls.LENGTH**3 / (3.0 * bending)
        )
        return displacement

    @classmethod
    def errors(cls, dimension, order, cells):
        """Return the errors with ``cells`` over the height."""
        steps = [
            np.linspace(0.0, cls.LENGTH, 4 * cells + 1),
            np.array([0.0, cls.THICKNESS]),
            np.linspace(-cls.HALF, cls.HALF, cells + 1),
        ]
        elastic = ElasticBody(Body("beam", tensor_mesh(steps, dimension)), MATERIAL, order)
        constraints = plane_strain(elastic)
        nodes, weights = elastic.boundary_weights("x1")
        axes = list(elastic.body.axes)
        for weight, direction in (
            (weights, AXES[0]),
            (weights, AXES[2]),
            (weights * elastic.nodes[nodes, 2], AXES[0]),
        ):
            constraints.zero_mean(nodes, weight, direction[axes])
        ends = {name: OUTWARD[name] for name in ("x0", "x1")}
        u = solved(elastic, constraints, traction_forces(elastic, cls.stress, ends))
        return errors(elastic, u, cls.displacement, cls.stress, free=True)


def plane_strain(elastic):
    """Hold sides y0 and y1 across Y in space, where they slide."""
    constraints = Constraints(len(elastic.nodes), elastic.dimension)
    if elastic.dimension == 3:
        for side in ("y0", "y1"):
            constraints.slide(*elastic.boundary_normals(side))
    return constraints


# --- A thick cylinder under pressure -------------------------------------------------------------


class Cylinder:
    """Quarter of a thick cylinder under internal ``PRESSURE``, in plane strain (Lamé)."""

    INNER, OUTER, PRESSURE, THICKNESS = 1.0, 2.0, 1.0, 0.25
    # Size of the stresses, p ri² / (ro² - ri²).
    SIZE = PRESSURE * INNER**2 / (OUTER**2 - INNER**2)

    @classmethod
    def stress(cls, x):
        square = x[0] ** 2 + x[2] ** 2
        radial = x.copy()
        radial[1] = 0.0
        outward = radial[:, None] * radial[None] / square
        plane = np.zeros((3, *x.shape))
        plane[0, 0] = plane[2, 2] = 1.0
        plane[1, 1] = 2.0 * MATERIAL.poisson
        plane[[0, 2], [0, 2]] += cls.OUTER**2 / square
        return cls.SIZE * (plane - 2.0 * cls.OUTER**2 / square * outward)

    @classmethod
    def displacement(cls, x):
        square = x[0] ** 2 + x[2] ** 2
        scale = cls.SIZE * (1.0 + MATERIAL.poisson) / MATERIAL.young
        displacement = scale * (1.0 - 2.0 * MATERIAL.poisson + cls.OUTER**2 / square) * x
        displacement[1] = 0.0
        return displacement

    @classmethod
    def errors(cls, dimension, order, cells):
        """Return the errors with ``cells`` through the wall and half as many again around."""
        angles = np.linspace(0.0, 0.5 * np.pi, 3 * cells // 2 + 1)
        steps = [
            np.linspace(cls.INNER, cls.OUTER, cells + 1),
            np.array([0.0, cls.THICKNESS]),
            angles,
        ]
        straight = tensor_mesh(steps, dimension)
        points = straight.p.copy()
        radius, angle = straight.p[0], straight.p[-1]
        points[0], points[-1] = radius * np.cos(angle), radius * np.sin(angle)
        elastic = ElasticBody(Body("ring", moved(straight, points)), MATERIAL, order)
        constraints = plane_strain(elastic)
        # The planes of symmetry.
        for side in ("z0", "z1"):
            constraints.slide(*elastic.boundary_normals(side))
        load = np.zeros(elastic.size)
        for row in (0, 2):
            load += elastic.traction_load(
                "x0", lambda x, row=row: cls.PRESSURE * x[row] / np.hypot(x[0], x[2]), AXES[row]
            )
        u = solved(elastic, constraints, load)
        return errors(elastic, u, cls.displacement, cls.stress)


# --- Rates ---------------------------------------------------------------------------------------

# By order: L2 error of displacement, energy, element means of stress.
SMOOTH = {1: [2.0, 1.0, 1.0], 2: [3.0, 2.0, 2.0]}
STRAIGHT_SIDED = {1: [2.0, 1.0, 1.0], 2: [2.0, 1.5, 1.5]}
CELLS = {1: (8, 16), 2: (4, 8)}
CASES = [(Cantilever, SMOOTH), (Cylinder, STRAIGHT_SIDED)]


@pytest.mark.parametrize(("case", "expected"), CASES)
@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("order", ORDERS)
def test_convergence(case, expected, dimension, order):
    coarse, fine = (case.errors(dimension, order, cells) for cells in CELLS[order])
    assert np.all(rates(coarse, fine) > np.array(expected[order]) - SLACK)


@pytest.mark.slow
@pytest.mark.parametrize(("case", "expected"), CASES)
@pytest.mark.parametrize("order", ORDERS)
def test_convergence_goes_on(case, expected, order):
    """Check meshes eight times as fine in the plane, and that sharp rates are not exceeded."""
    coarse, fine = (case.errors(2, order, 8 * cells) for cells in CELLS[order])
    measured = rates(coarse, fine)
    assert np.all(measured > np.array(expected[order]) - 0.05)
    assert measured[0] < expected[order][0] + 0.05
