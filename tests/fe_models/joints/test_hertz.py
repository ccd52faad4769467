"""Hertz's contacts of finite element bodies, with the convergence rates of their meshes."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from fe_models.elasticity.body import ElasticBody
from fe_models.joints.friction import FrictionalJoint
from fe_models.joints.joint import join
from fe_models.meshes.structure_mesh import Body
from fe_models.meshes.trace import LinearTrace
from fe_models.supported_body import SupportedBody
from sa_solver.reference import hertz
from sa_solver.reference.subsurface import cylinder_stress, point_force_stress, sphere_axis_stress
from tests.fe_models.elasticity.test_verification import (
    AXES,
    MATERIAL,
    OUTWARD,
    held_still,
    tensor_mesh,
    traction_forces,
)
from tests.fe_models.joints.pressed_blocks import HALVED, of_kind


class HertzPair:
    """Two equal blocks under the tractions that Hertz's contact causes on their far faces.

    The blocks are thus cut out of half-spaces, and their size is no approximation. There are lines
    in the plane and spheres in space: a parabolic gap, contact half-width 1, without friction. The
    nodes are denser at the contact.
    """

    # Half the width of a block and its depth, in contact half-widths; nodes within REACH may touch.
    SIZE, REACH = 3.0, 1.5
    RADIUS = 100.0
    # Positions follow sinh: cells at the contact are cosh(2) = 3.8 times smaller than far away.
    GATHERED = 2.0

    def __init__(self, dimension, order, cells):
        """Build blocks with ``cells`` between nodes across and half as many in depth."""
        self.cell = 2.0 * self.SIZE / cells * self.GATHERED / np.sinh(self.GATHERED)
        self.dimension, self.order = dimension, order
        modulus = MATERIAL.young / (2.0 * (1.0 - MATERIAL.poisson**2))
        if dimension == 2:
            load = np.pi * modulus / (4.0 * self.RADIUS)
            self.exact = hertz.HertzCylinder(load, self.RADIUS, modulus)
        else:
            load = 4.0 * modulus / (3.0 * self.RADIUS)
            self.exact = hertz.HertzSphere(load, self.RADIUS, modulus)
        self.lower, self.upper = (self._block(cells, side) for side in (-1.0, 1.0))
        self.nodes = self.lower.body.vertices("contact")
        assert np.array_equal(self.nodes, self.upper.body.vertices("contact"))
        self.points = self.lower.nodes[self.nodes]

    def _block(self, cells, side):
        """Return the lower block, or its mirror image, so that the two faces match."""
        cells //= 2 if self.order == HALVED else 1
        spread = np.sinh(np.linspace(-1.0, 1.0, cells + 1) * self.GATHERED)
        across = self.SIZE * spread / spread[-1]
        across[cells // 2] = 0.0
        mesh = tensor_mesh([across, across, across[: cells // 2 + 1]], self.dimension)
        near = np.isclose(mesh.p[-1, mesh.facets], 0.0).all(axis=0)
        middles = mesh.p[:-1, mesh.facets].mean(axis=1)
        contact = np.flatnonzero(near & (np.linalg.norm(middles, axis=0) < self.REACH))
        boundaries = {n: f for n, f in mesh.boundaries.items() if n != "z1"} | {"contact": contact}
        points = mesh.p.copy()
        points[-1] *= -side
        mirrored = type(mesh)(points, mesh.t).with_boundaries(boundaries)
        return of_kind(Body("block", mirrored), MATERIAL, self.order)

    def _far_load(self, elastic, side):
        """Return the tractions on the cut faces; z0 is the far one of both blocks."""
        names = [name for name in elastic.body.mesh.boundaries if name != "contact"]
        normals = {name: OUTWARD[name] for name in names} | {"z0": side * AXES[2]}
        return traction_forces(elastic, lambda x: self.stress(x, side), normals)

    def stress(self, x, side):
        """Return the stress in the block on that ``side`` of the contact, with depth from it."""
        depth = side * x[2]
        if self.dimension == 2:
            voigt = cylinder_stress(self.exact, 0.0, x[0], depth, MATERIAL.poisson)
        else:
            voigt = np.zeros((6, *x[0].shape))
            for force, at in zip(*self._ring_forces(), strict=True):
                arms = x[0] - at[0], x[1] - at[1], depth
                voigt += force * point_force_stress(*arms, MATERIAL.poisson)[:, 2]
        # Body 1 is below, where the depth has the opposite direction.
        turned = np.array([1.0, 1.0, 1.0, 1.0, side, side]).reshape(6, *[1] * (x.ndim - 1))
        return (turned * voigt)[[[0, 3, 5], [3, 1, 4], [5, 4, 2]]]

    def _ring_forces(self):
        """Return Hertz's pressure as forces on rings, by Gauss's rule in 1 - r².

        It is accurate far from the contact.
        """
        nodes, weights = np.polynomial.legendre.leggauss(6)
        # With s = sqrt(1 - r²): p r dr = p0 s² ds.
        s, share = 0.5 * (nodes + 1.0), 0.5 * weights
        angles = (np.arange(16) + 0.5) * np.pi / 8.0
        forces = 2.0 * np.pi * self.exact.peak_pressure * s**2 * share / len(angles)
        radii = np.sqrt(1.0 - s**2)
        places = np.stack([np.outer(radii, np.cos(angles)), np.outer(radii, np.sin(angles))], -1)
        return np.repeat(forces, len(angles)), places.reshape(-1, 2)

    def shortening(self):
        """Return the approach of the far ends of the axis [mm]: ∫ ε_zz of both blocks along it."""
        nu, young = MATERIAL.poisson, MATERIAL.young

        def strain(z):
            depth = np.array([z])
            if self.dimension == 2:
                stress = cylinder_stress(self.exact, 0.0, 0.0 * depth, depth, nu)[:, 0]
            else:
                stress = sphere_axis_stress(self.exact, depth, nu)[:, 0]
            return (stress[2] - nu * (stress[0] + stress[1])) / young

        return -2.0 * quad(strain, 0.0, self.SIZE, epsabs=1e-12)[0]

    def solve(self):
        """Return relative errors of approach, half-width, peak pressure, and pressure in L2."""
        supported = []
        dimension = self.lower.dimension
        frames = np.tile(np.eye(dimension), (len(self.nodes), 1, 1))
        for elastic, side in ((self.lower, -1.0), (self.upper, 1.0)):
            constraints = held_still(elastic, "z0", floats=side > 0.0)
            trace = LinearTrace.of(elastic, {"contact": self.nodes})
            load = self._far_load(elastic, side)[:, None]
            supported.append(
                SupportedBody(elastic, constraints, self.nodes, frames, load, trace=trace)
            )
        joint = join([body.condense() for body in supported])
        # Across the contact and, in each direction, about it.
        assert joint.rigid_modes == self.dimension
        square = np.sum(self.points[:, :2] ** 2, axis=1)
        gap = square / (2.0 * self.RADIUS)
        (state,) = FrictionalJoint(joint.resolvent(), 0.0).march(np.ones((1, 1)), gap)
        assert state.converged
        return self._errors(supported, state, square)

    def _errors(self, supported, state, square):
        force = state.force[2]
        # The cut faces carry Hertz's load up to the integration error along them.
        assert force.sum() == pytest.approx(self.exact.load, rel=1e-4)
        components = state.displacement[list(self.lower.body.axes)].T.ravel()
        forces = state.force[list(self.lower.body.axes)].T.ravel()
        below, interface = supported[0].respond(-forces, np.ones(1))
        above = supported[1].recover(interface + components, forces, np.ones(1))
        ends = [self._far_end(e, u) for e, u in ((self.lower, below), (self.upper, above))]
        # Mean square distance of Hertz's pressure from the middle: 1/4 and 2/5.
        spread = {2: 0.25, 3: 0.4}[self.dimension]
        width = np.sqrt(force @ square / force.sum() / spread)
        areas = self._areas()
        x, y, _ = self.points.T
        exact = self.exact.pressure(x) if self.dimension == 2 else self.exact.pressure(x, y)
        pressure = force / areas
        trace = LinearTrace.of(self.lower, {"contact": self.nodes})
        if trace is not None:  # Forces of a linear traction give means about the nodes.
            exact = trace.products @ exact / areas
        middle = int(np.argmin(square))
        deviations = np.array(
            [
                (ends[0] - ends[1]) / self.shortening() - 1.0,
                width - 1.0,
                pressure[middle] / self.exact.peak_pressure - 1.0,
                np.sqrt(areas @ (pressure - exact) ** 2 / (areas @ exact**2)),
            ]
        )
        return np.abs(deviations)

    def _far_end(self, elastic, u):
        """Return u_z of the node on the axis, on the far face."""
        node = np.linalg.norm(np.abs(elastic.nodes) - [0.0, 0.0, self.SIZE], axis=1).argmin()
        return u.reshape(-1, self.dimension)[node, -1]

    def _areas(self):
        linear = ElasticBody(replace(self.lower.body, elements=None), MATERIAL, 1)
        nodes, weights = linear.boundary_weights("contact")
        return weights[np.searchsorted(nodes, self.nodes)]


# Errors of approach, half-width, peak and pressure are at most these times the powers of the cell
# at the contact over its half-width.
HERTZ_BOUNDS = {2: [0.8, 0.8, 0.25, 0.45], 3: [1.0, 0.8, 0.6, 0.65]}
# Halved elements of second order: on the same nodes the approach is five times as accurate, and
# vertices and midside nodes have pressures that are off in opposite directions.
HALVED_BOUNDS = {2: [0.2, 0.8, 0.8, 0.45], 3: [0.2, 0.8, 1.8, 1.0]}
HERTZ_RATES = [2.0, 2.0, 2.0, 1.0]


def check_hertz(dimension, cells):
    """Check bounds with their rates on every mesh, and the gain by second order.

    Faces in contact stay linear between vertices, where the gap is a parabola: an error of at most
    h² / 8R, and h² for the approach whatever the order of the elements. The pressure ends with an
    infinite slope within a cell, which gives h in L2.
    """
    approach = {}
    for order in cells:
        for count in cells[order]:
            pair = HertzPair(dimension, order, count)
            deviations = pair.solve()
            bounds = (HALVED_BOUNDS if order == HALVED else HERTZ_BOUNDS)[dimension]
            limit = np.array(bounds) * pair.cell ** np.array(HERTZ_RATES)
            assert np.all(deviations < limit), (order, count, deviations, limit)
            approach[order, count] = deviations[0]
    for order in cells.keys() - {1}:
        for count in set(cells[1]) & set(cells[order]):
            assert approach[order, count] < 0.5 * approach[1, count]


def test_hertz_line():
    check_hertz(2, {1: (12, 24, 48), 2: (12, 24, 48), HALVED: (12, 24, 48)})


@pytest.mark.slow
def test_hertz_line_on_fine_meshes():
    check_hertz(2, {1: (96, 192), 2: (96, 192), HALVED: (96, 192)})


@pytest.mark.slow
def test_hertz_sphere():
    check_hertz(3, {1: (8, 16, 24), 2: (8, 12), HALVED: (8, 16, 24)})
