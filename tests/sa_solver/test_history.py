"""Histories: what is chosen and why, legs in one step, errors measured and their rate."""

from itertools import pairwise

import numpy as np
import pytest

from sa_solver.contact import FrictionalContact
from sa_solver.half_space import HalfSpace
from sa_solver.history import ContactLoadPath, HistoryError, march_history, turning_points
from sa_solver.normal import NormalContact
from sa_solver.reference.line_partial_slip import ciavarella_jaeger
from sa_solver.types import ElasticPair, Grid, Material

FRICTION, LOAD = 0.6, 300.0
SLIDING = FRICTION * LOAD


def ball(poisson, cells=32):
    material = Material(115e3, poisson)
    grid = Grid.covering((0.9, 0.9), (cells, cells))
    half_space = HalfSpace(grid, ElasticPair(material, material))
    return half_space, (grid.x**2 + grid.y**2) / 20.0


def cylinder(cells=128):
    material = Material(115e3, 0.3)
    grid = Grid.strips(2.0, cells)
    return HalfSpace(grid, ElasticPair(material, material)), grid.x**2 / 60.0


def path(shares, press=3, strain=None, turned=0.0):
    """Pressing in a few increments, then shear forces."""
    shares = np.array(shares)
    values = np.zeros((press + len(shares), 6))
    values[:press, 0] = LOAD * np.arange(1, press + 1) / press
    values[press:, 0] = LOAD
    values[press:, 1] = SLIDING * shares * np.cos(turned)
    values[press:, 2] = SLIDING * shares * np.sin(turned)
    if strain is not None:
        strain = np.r_[np.zeros(press), strain * shares]
    return ContactLoadPath(values, strain=strain)


def legs(*points, steps=6):
    ends = [0.0, *points]
    parts = [np.linspace(a, b, steps + 1)[1:] for a, b in pairwise(ends)]
    return np.concatenate(parts)


CYCLE = legs(0.8, -0.8, 0.5)


def test_turning_points():
    assert turning_points(path(CYCLE)) == [2, 8, 14, 20]
    assert turning_points(path(legs(0.5))) == [2, 8]


@pytest.mark.parametrize("contact", [cylinder(), ball(0.0)], ids=["line", "nu=0"])
def test_legs_in_one_step_are_exact_where_slip_keeps_its_direction(contact):
    half_space, height = contact
    full = march_history(half_space, height, path(CYCLE), FRICTION, history="full", tolerance=1e-10)
    auto = march_history(half_space, height, path(CYCLE), FRICTION, tolerance=1e-10)
    assert auto.method == "reversals"
    assert auto.reason == "similar bodies, pressure constant while the shear load turns"
    assert auto.error is None
    assert auto.indices == [2, 8, 14, 20]
    for index, state in zip(auto.indices, auto.states, strict=True):
        expected = full.states[index]
        scale = FRICTION * expected.pressure.max()
        np.testing.assert_allclose(state.shear, expected.shear, atol=1e-6 * scale)
        np.testing.assert_allclose(state.rigid, expected.rigid, rtol=1e-6, atol=1e-12)
    by_leg = [sum(full.states[k].energy.sum() for k in range(a, b)) for a, b in ((3, 9), (9, 15))]
    assert [state.energy.sum() for state in auto.states[1:3]] == pytest.approx(by_leg, rel=1e-6)


def test_legs_with_poisson_ratio_have_a_measured_error():
    half_space, height = ball(0.45)
    full = march_history(half_space, height, path(CYCLE), FRICTION, history="full")
    auto = march_history(half_space, height, path(CYCLE), FRICTION)
    scale = FRICTION * full.states[-1].pressure.max()
    true = np.abs(auto.states[-1].shear - full.states[-1].shear).max() / scale
    assert auto.method == "reversals"
    assert auto.error is not None
    assert auto.error_of == "the last leg in two steps"
    assert 0.0 < auto.error < 0.1
    assert 0.1 * true < auto.error + 1e-3


def test_bulk_stress_in_proportion_is_a_leg_too():
    half_space, height = cylinder()
    loading = path(CYCLE, strain=2e-4)
    full = march_history(half_space, height, loading, FRICTION, history="full", tolerance=1e-10)
    auto = march_history(half_space, height, loading, FRICTION, tolerance=1e-10)
    scale = FRICTION * full.states[-1].pressure.max()
    assert auto.method == "reversals"
    np.testing.assert_allclose(auto.states[-1].shear, full.states[-1].shear, atol=1e-5 * scale)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ("pressure", "the normal load changes while shear is on"),
        ("energy", "sliding is given by its energy"),
        ("direction", "the shear load changes direction"),
        ("dissimilar", "the bodies are dissimilar"),
    ],
)
def test_auto_says_why_it_takes_every_increment(change, reason):
    half_space, height = cylinder(32)
    loading = path([0.2, 0.4, 0.1])
    energy = None
    if change == "pressure":
        loading.values[-1, 0] *= 1.1
    if change == "direction":
        loading.values[-1, 2] = 3.0
    if change == "energy":
        energy = np.zeros((len(loading), 2))
    if change == "dissimilar":
        pair = ElasticPair(Material(115e3, 0.3), Material(70e3, 0.3))
        half_space = HalfSpace(half_space.grid, pair)
    loading = ContactLoadPath(loading.values, energy=energy)
    history = march_history(half_space, height, loading, FRICTION)
    assert history.method == "full"
    assert history.reason == reason
    assert history.indices == list(range(6))
    if change != "direction":
        with pytest.raises(HistoryError, match="use full or auto"):
            march_history(half_space, height, loading, FRICTION, history="reversals")


@pytest.mark.slow
def test_the_error_of_a_full_path_falls_with_its_increments():
    """Load that turns in the plane: backward steps are of first order, and so is their estimate."""
    half_space, height = ball(0.3, 24)
    histories = []
    for steps in (8, 16, 32):
        angle = np.linspace(0.0, 0.5 * np.pi, steps + 1)[1:]
        values = np.zeros((steps + 2, 6))
        values[:, 0] = LOAD
        values[1:, 1] = 0.8 * SLIDING
        values[2:, 1] = 0.8 * SLIDING * np.cos(angle)
        values[2:, 2] = 0.8 * SLIDING * np.sin(angle)
        histories.append(
            march_history(
                half_space, height, ContactLoadPath(values), FRICTION, estimate_error=True
            )
        )
    errors = [history.error for history in histories]
    scale = FRICTION * histories[0].states[-1].pressure.max()
    true = np.abs(histories[1].states[-1].shear - histories[2].states[-1].shear).max() / scale
    assert histories[0].error_of == "the same path with half the increments"
    assert 1.4 < errors[0] / errors[1] < 3.0
    assert 1.4 < errors[1] / errors[2] < 3.0
    assert 0.3 * true < errors[1] < 4.0 * true


def test_no_error_where_every_increment_turns_back():
    half_space, height = cylinder(32)
    zigzag = path([0.5, -0.5, 0.5, -0.5], press=1)
    history = march_history(
        half_space, height, zigzag, FRICTION, history="full", estimate_error=True
    )
    assert history.error is None


def test_first_loading_of_a_line_contact_is_two_normal_problems(monkeypatch):
    """The same as Newton's method finds, and as the reference makes of any pressure solver."""
    half_space, _ = cylinder(256)
    grid = half_space.grid
    height = np.maximum(np.abs(grid.x) - 0.4, 0.0) ** 2 / 20.0
    for sign in (1.0, -1.0):
        loading = path(sign * np.asarray(legs(0.7)))
        history = march_history(half_space, height, loading, FRICTION, tolerance=1e-10)
        assert history.method == "ciavarella_jaeger"
        two = history.states[-1]
        with monkeypatch.context() as patch:
            patch.setattr(FrictionalContact, "two_normal_problems", lambda *_: False)
            newton = march_history(half_space, height, loading, FRICTION, tolerance=1e-10)
        assert newton.method == "reversals"
        one = newton.states[-1]
        limit = FRICTION * one.pressure.max()
        np.testing.assert_allclose(two.shear, one.shear, atol=1e-6 * limit)
        np.testing.assert_allclose(two.slip, one.slip, atol=1e-7 * abs(one.rigid[1]))
        np.testing.assert_allclose(two.displacement, one.displacement, atol=1e-7 * one.rigid[0])
        assert two.rigid == pytest.approx(one.rigid, rel=1e-7, abs=1e-12)
        assert two.energy == pytest.approx(one.energy, rel=1e-6, abs=1e-15)
        assert two.resultants == pytest.approx(loading.values[-1], rel=1e-8, abs=1e-8 * LOAD)
        np.testing.assert_array_equal(two.sticking, one.sticking)
        assert two.convolutions < one.convolutions

    def pressure(load):
        return NormalContact(half_space).solve(height, load, tilt_y=0.0, tolerance=1e-10).pressure

    expected = ciavarella_jaeger(pressure, LOAD, -0.7 * SLIDING, FRICTION)
    np.testing.assert_allclose(two.shear[0], expected, atol=1e-6 * np.abs(expected).max())


def test_progress_and_failure(monkeypatch):
    half_space, height = cylinder(32)
    rows = []
    march_history(
        half_space,
        height,
        path([0.3, 0.6]),
        FRICTION,
        history="full",
        progress=lambda row, state: rows.append((row, state.converged)),
    )
    assert rows == [(row, True) for row in range(5)]
    advance = FrictionalContact.advance

    def fails(self, before, height, load):
        state = advance(self, before, height, load)
        object.__setattr__(state, "converged", load.values[1] == 0.0)
        return state

    monkeypatch.setattr(FrictionalContact, "advance", fails)
    stopped = march_history(half_space, height, path([0.3, 0.6]), FRICTION, history="full")
    assert stopped.indices == [0, 1, 2, 3]
    assert not stopped.states[-1].converged
