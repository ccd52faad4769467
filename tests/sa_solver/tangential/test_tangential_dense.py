"""Tangential contact against dense matrices and a method without FFT and preconditioner."""

import numpy as np
import pytest

from sa_solver.half_space.operator import HalfSpace
from sa_solver.rigid_modes import PlanarModes
from sa_solver.tangential.contact import TangentialContact
from sa_solver.tangential.disk_gradient import gradients_on_disks
from sa_solver.tangential.problem import BoxOperator, TangentialProblem
from sa_solver.types import ElasticPair, Grid, Material

MATERIAL = Material(115e3, 0.35)
PAIR = ElasticPair(MATERIAL, MATERIAL)
GRID = Grid((8, 8), (0.05, 0.04))
LIMIT = 100.0 * np.maximum(0.0, 0.04 - GRID.x**2 - 1.5 * GRID.y**2) / 0.04
UNIT = LIMIT.sum() * GRID.cell_area


def matrix():
    """Return K ``(128, 128)``, column by column."""
    half_space = HalfSpace(GRID, PAIR)
    units = np.eye(128).reshape(128, 2, 8, 8)
    return np.stack([half_space.shear(unit).ravel() for unit in units], axis=1)


def admm(stiffness, limit, offset, modes, target, iterations=20000):
    """Solve by alternating directions: the quadratic problem with equalities, then the disks."""
    penalty = np.sqrt(np.prod(np.linalg.eigvalsh(stiffness)[[0, -1]]))
    count = len(target)
    size = len(stiffness)
    saddle = np.zeros((size + count, size + count))
    saddle[:size, :size] = stiffness + penalty * np.eye(size)
    saddle[:size, size:] = -modes.T
    saddle[size:, :size] = modes
    inverse = np.linalg.inv(saddle)
    inside, price = np.zeros(size), np.zeros(size)
    for _ in range(iterations):
        right = np.r_[penalty * (inside - price) - offset, target]
        free = (inverse @ right)[:size]
        shear = (free + price).reshape(2, -1)
        magnitude = np.hypot(*shear)
        factor = np.minimum(1.0, limit / np.maximum(magnitude, 1e-300))
        inside = (shear * factor).ravel()
        price = price + free - inside
        if np.abs(free - inside).max() < 1e-11 * limit.max():
            break
    return inside.reshape(2, -1)


def dense_solution(offset, loads):
    pressed = (LIMIT > 0.0).ravel()
    both = np.tile(pressed, 2)
    modes = PlanarModes.on(GRID)
    shapes = modes.fields().reshape(3, -1)[:, both]
    target = np.array(loads) / (modes.lengths * GRID.cell_area)
    stiffness = matrix()[np.ix_(both, both)]
    shear = np.zeros((2, 64))
    shear[:, pressed] = admm(
        stiffness, LIMIT.ravel()[pressed], offset.ravel()[both], shapes, target
    )
    return shear.reshape(2, 8, 8)


@pytest.mark.parametrize(
    "loads",
    [(0.5, 0.0, 0.0), (0.0, 0.0, 0.05), (0.4, -0.3, 0.03), (0.69, 0.69, 0.0), (-0.2, 0.5, -0.06)],
)
def test_dense_solution(loads):
    """With forces and a moment, from rest and from a twisted state."""
    loads = UNIT * np.array(loads)
    solver = TangentialContact(HalfSpace(GRID, PAIR))
    rest = np.zeros((2, 8, 8))
    before = solver.solve(LIMIT, Qx=-0.4 * UNIT, Mz=0.05 * UNIT, tolerance=1e-11)
    for offset in (rest, -before.displacement):
        state = solver.solve(LIMIT, offset, *loads, tolerance=1e-11)
        expected = dense_solution(offset, loads)
        np.testing.assert_allclose(state.shear, expected, atol=1e-6 * LIMIT.max())


@pytest.mark.parametrize("share", [0.3, 0.99])
def test_projected_gradients_reach_the_same(share):
    half_space = HalfSpace(GRID, PAIR)
    modes = PlanarModes.on(GRID)
    loads = share * UNIT * np.array([0.8, 0.6, 0.0])
    problem = TangentialProblem(
        LIMIT, np.zeros((2, 8, 8)), modes, loads / GRID.cell_area, BoxOperator(half_space)
    )
    start = problem.balanced(np.zeros((2, 8, 8)))
    assert start is not None
    slow = gradients_on_disks(problem, start, 1e-10, 3000)
    fast = TangentialContact(half_space).solve(LIMIT, None, *loads, tolerance=1e-10)
    assert slow.converged
    np.testing.assert_allclose(slow.shear, fast.shear, atol=1e-6 * LIMIT.max())
    assert slow.rigid[0] == pytest.approx(fast.shift_x, rel=1e-6)
    assert slow.rigid[1] == pytest.approx(fast.shift_y, rel=1e-6)


@pytest.mark.parametrize("cells", [0, 3, 32])
def test_the_approximate_inverse_of_shear(cells):
    """The inverse is symmetric and positive, with a small condition number for any compliance."""
    operator, compliance = BoxOperator(HalfSpace(GRID, PAIR)), np.zeros(GRID.shape)
    compliance.ravel()[20 : 20 + cells] = np.geomspace(0.3, 3e3, cells) * operator.self_compliance
    windows, rest = operator.windows(compliance)
    inverse = np.diag(np.tile(rest.ravel(), 2))
    for level, window in windows:
        units = window * np.eye(128).reshape(128, 2, 8, 8)
        columns = [window * operator.precondition(unit, level) for unit in units]
        inverse += np.reshape(columns, (128, 128)).T
    np.testing.assert_allclose(inverse, inverse.T, atol=1e-12 * inverse.max())
    assert np.linalg.eigvalsh(inverse).min() > 0.0
    whole = matrix() + np.diag(np.tile(compliance.ravel(), 2))
    values = np.sort(np.linalg.eigvals(inverse @ whole).real)
    assert values[-1] < 6.0 * values[0]


def test_modes_and_their_sums():
    """Sums, motions and products are compared with the fields themselves."""
    rng = np.random.default_rng(0)
    modes = PlanarModes.on(GRID).cropped((slice(1, 6), slice(2, 8)))
    field, tensor = rng.standard_normal((2, 5, 6)), rng.standard_normal((3, 5, 6))
    shapes = modes.fields()
    np.testing.assert_allclose(modes.sums(field), np.tensordot(shapes, field, 3), atol=1e-12)
    xx, xy, yy = tensor
    turned = np.stack(
        [xx * shapes[:, 0] + xy * shapes[:, 1], xy * shapes[:, 0] + yy * shapes[:, 1]], axis=1
    )
    expected = np.tensordot(shapes, turned, axes=([1, 2, 3], [1, 2, 3]))
    np.testing.assert_allclose(modes.products(xx, xy, yy), expected, atol=1e-12)
