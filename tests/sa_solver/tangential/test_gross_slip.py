"""Gross slip by energies: the energies are met, and uniform pressure is the exact limit."""

from types import SimpleNamespace

import numpy as np
import pytest

from sa_solver.half_space.operator import HalfSpace
from sa_solver.tangential import gross_slip as module
from sa_solver.tangential.contact import TangentialContact
from sa_solver.tangential.gross_slip import gross_slip
from sa_solver.types import ElasticPair, Grid, Material

MATERIAL = Material(115e3, 0.29)
GRID = Grid.covering((1.0, 1.0), (32, 32))
HALF_SPACE = HalfSpace(GRID, ElasticPair(MATERIAL, MATERIAL))
REST = np.zeros((2, *GRID.shape))
BALL = 700.0 * np.sqrt(np.maximum(0.0, 1.0 - (GRID.x**2 + GRID.y**2) / 0.16))


def slide(limit, energy, force, offset=REST, direction="energies", half_space=HALF_SPACE):
    contact = TangentialContact(half_space)
    area = half_space.grid.cell_area
    states = []

    def solve(shift, tolerance):
        x, y = map(float, shift)
        twist = {} if half_space.grid.line else {"twist": 0.0}
        state = contact.solve(limit, offset, shift_x=x, shift_y=y, **twist, tolerance=tolerance)
        dissipation = -np.sum(state.shear * state.slip, axis=(1, 2)) * area
        states.append(state)
        return np.array([state.Qx, state.Qy]), dissipation

    carried = float(limit.sum()) * area
    slip = gross_slip(solve, carried, np.array(energy), np.array(force), 1e-9, direction)
    return SimpleNamespace(state=states[-1], error=slip.error)


def energies(state):
    return -np.sum(state.shear * state.slip, axis=(1, 2)) * GRID.cell_area


@pytest.mark.parametrize("signs", [(1, 1), (-1, 1), (1, -1), (-1, -1)])
def test_energies_and_signs_are_met(signs):
    wanted = np.array([5.0, 2.0])
    slid = slide(BALL, wanted, 100.0 * np.array(signs))
    assert slid.error < 1e-5
    np.testing.assert_allclose(energies(slid.state), wanted, rtol=1e-5)
    assert np.sign(slid.state.Qx) == signs[0]
    assert np.sign(slid.state.Qy) == signs[1]
    assert np.sign(slid.state.shift_x) == signs[0]
    assert np.sign(slid.state.shift_y) == signs[1]
    assert slid.state.twist == 0.0


def test_the_implied_force_is_all_that_friction_carries():
    """The force acts in the direction whose cos² and sin² are the shares of the energy."""
    carried = BALL.sum() * GRID.cell_area
    state = slide(BALL, (30.0, 10.0), (1.0, 1.0)).state
    assert np.hypot(state.Qx, state.Qy) == pytest.approx(carried, rel=2e-3)
    assert np.arctan2(state.Qy, state.Qx) == pytest.approx(np.arctan(np.sqrt(1 / 3)), abs=0.02)
    assert not state.sticking.any()


def test_uniform_pressure_slides_by_energy_over_friction():
    """Δδ = Ed/µP + Σ q·K q S/µP: the sliding distance and the elastic part before it."""
    limit = np.full(GRID.shape, 50.0)
    carried = limit.sum() * GRID.cell_area
    state = slide(limit, (40.0, 0.0), (1.0, 0.0)).state
    elastic = np.sum(state.shear * state.displacement) * GRID.cell_area
    length = 40.0 / carried + elastic / carried
    assert state.shift_x == pytest.approx(length, rel=1e-3)


def test_from_a_state_that_slid_the_other_way():
    first = slide(BALL, (4.0, 0.5), (-1.0, 1.0)).state
    second = slide(BALL, (4.0, 0.5), (1.0, -1.0), -first.displacement)
    assert second.error < 1e-5
    np.testing.assert_allclose(energies(second.state), [4.0, 0.5], rtol=1e-5)
    assert second.state.shift_x > 0.0 > second.state.shift_y


def test_a_share_that_no_direction_has_is_reported():
    """Poisson's ratio couples x and y, so that some energy is dissipated along both."""
    slid = slide(BALL, (2.0, 0.0), (1.0, 1.0))
    assert energies(slid.state).sum() == pytest.approx(2.0, rel=1e-5)
    assert 1e-5 < slid.error < 0.2


def test_a_line_contact():
    grid = Grid.line_contact(2.0, 64)
    limit = 300.0 * np.sqrt(np.maximum(0.0, 1.0 - grid.x**2 / 0.8))
    half_space = HalfSpace(grid, HALF_SPACE.pair)
    slid = slide(limit, (3.0, 0.0), (-1.0, 0.0), np.zeros((2, 64, 1)), "force", half_space)
    assert slid.error < 1e-5
    assert slid.state.Qx == pytest.approx(-limit.sum() * grid.cell_area, rel=1e-6)


def test_solves_stay_few(monkeypatch):
    monkeypatch.setattr(module, "ITERATIONS", 12)
    assert slide(BALL, (5.0, 2.0), (1.0, 1.0)).error < 1e-5


@pytest.mark.parametrize("known", [False, True])
def test_a_force_that_turns_less_than_the_motion_takes_few_solves(known):
    """The force turns by 0.3 of the angle of the motion.

    Corrections by the whole missing angle would take 40 solves.
    """
    solves = []

    def solve(shift, tolerance):
        solves.append(shift)
        length, angle = np.hypot(*shift), 0.2 + 0.3 * np.arctan2(shift[1], shift[0])
        return 100.0 * np.array([np.cos(angle), np.sin(angle)]), np.array([100.0 * length, 0.0])

    force = np.array([np.cos(0.29), np.sin(0.29)])
    near = 0.03 * np.array([np.cos(0.3), np.sin(0.3)]) if known else None
    slip = gross_slip(solve, 100.0, np.array([3.0, 0.0]), force, 1e-8, near=near)
    assert slip.error <= module.ACCURACY
    assert np.arctan2(*solves[-1][::-1]) == pytest.approx(0.3, abs=1e-5)
    assert len(solves) <= (2 if known else 5)


@pytest.mark.parametrize("energy", [0.1, 0.01])
def test_a_contact_that_begins_to_slide_meets_its_energy(energy):
    """Where a sixth or a third of the cells still stick, a motion dissipates much less than µP."""
    slid = slide(BALL, (energy, 0.0), (1.0, 0.0))
    assert energies(slid.state).sum() == pytest.approx(energy, rel=1e-6)
    assert slid.state.sticking[BALL > 0.0].any()


def test_the_force_keeps_its_direction():
    """The direction is kept for any shares of the energy, and the sum of the energy is met."""
    state = slide(BALL, (2.0, 3.0), (40.0, -10.0), direction="force").state
    assert energies(state).sum() == pytest.approx(5.0, rel=1e-5)
    assert state.Qy / state.Qx == pytest.approx(-0.25, rel=1e-4)
    assert state.Qx > 0.0
