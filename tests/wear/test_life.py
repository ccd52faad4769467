"""Fretting and fatigue parameters against closed forms, brute force and invariance."""

import itertools

import numpy as np
import pytest

from sa_solver.types import Material
from tests.given import assert_refused
from tests.marks import slow
from wear.cracking.life import PlaneSearch, StressHistoryError, findley, ruiz, smith_watson_topper
from wear.cracking.smallest_circle import smallest_circle

STEEL = Material(200e3, 0.3)
FINE = PlaneSearch(100, 20)
"""Steps small enough for tests of values that are exact."""

SENSITIVITY = 0.3
INDICES = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))


def history(**components):
    """Return the (t, 6) history with the given components."""
    names = ("xx", "yy", "zz", "xy", "yz", "zx")
    count = len(next(iter(components.values())))
    return np.stack([components.get(name, np.zeros(count)) for name in names], axis=1)


def as_tensor(stress):
    """Convert (t, 6) to (t, 3, 3)."""
    tensor = np.empty((len(stress), 3, 3))
    for component, (i, j) in zip(stress.T, INDICES, strict=True):
        tensor[:, i, j] = tensor[:, j, i] = component
    return tensor


def rotated(stress, rotation):
    tensor = rotation @ as_tensor(stress) @ rotation.T
    return np.stack([tensor[:, i, j] for i, j in INDICES], axis=1)


def rotation(seed):
    return np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))[0]


# --- Smallest circle


def smallest_by_trial(x, y):
    """Return the best of all circles on two or three of the points."""
    points = np.stack([x, y], axis=1)
    centres = [0.5 * (a + b) for a, b in itertools.combinations(points, 2)]
    for a, b, c in itertools.combinations(points, 3):
        sides = 2.0 * np.array([b - a, c - a])
        if abs(np.linalg.det(sides)) > 1e-12:
            centres.append(np.linalg.solve(sides, [b @ b - a @ a, c @ c - a @ a]))
    return min(np.linalg.norm(points - c, axis=1).max() for c in centres)


@pytest.mark.parametrize("count", [2, 3, 4, 9])
def test_smallest_circle_is_the_best_of_all(count):
    """Points are random, on lines, on a lattice or identical."""
    rng = np.random.default_rng(count)
    x, y = rng.standard_normal((2, count, 60))
    y[:, :15] = 2.0 * x[:, :15]
    x[:, 15:30], y[:, 15:30] = np.round(x[:, 15:30]), np.round(y[:, 15:30])
    x[:, 30], y[:, 30] = 1.0, -3.0
    expected = [smallest_by_trial(*points) for points in zip(x.T, y.T, strict=True)]
    np.testing.assert_allclose(smallest_circle(x, y), expected, rtol=1e-9, atol=1e-12)


def test_smallest_circle_of_many_points_on_one():
    """22 points lie all on a circle or all on a line, within 1e-13; a single point has radius 0."""
    angle = 2.0 * np.pi * np.arange(22) / 22
    noise = 1e-13 * np.random.default_rng(0).standard_normal((22, 100))
    circles = smallest_circle(np.cos(angle)[:, None] + noise, np.sin(angle)[:, None] + noise)
    np.testing.assert_allclose(circles, 1.0, rtol=1e-9)
    lines = smallest_circle(np.cos(angle)[:, None] + noise, np.cos(angle)[:, None] - noise)
    np.testing.assert_allclose(lines, np.sqrt(2.0), rtol=1e-9)
    assert not smallest_circle(np.ones((1, 4)), np.ones((1, 4))).any()


# --- Findley


@pytest.mark.parametrize("k", [0.0, 0.3, 1.0])
@pytest.mark.parametrize(("low", "high"), [(-200.0, 200.0), (0.0, 300.0), (-300.0, 100.0)])
def test_findley_uniaxial(low, high, k):
    """The value is [k σ_max + sqrt(σ_a² + k² σ_max²)] / 2, where tan 2θ = σ_a / k σ_max."""
    parameter = findley(history(xx=np.array([low, high])), k, FINE)
    amplitude = 0.5 * (high - low)
    expected = 0.5 * (k * high + np.hypot(amplitude, k * high))
    assert parameter.value == pytest.approx(expected, rel=1e-6)
    # The value is flat at its maximum: angles are accurate to the square root of its accuracy.
    double = np.arctan2(amplitude, k * high)
    assert abs(parameter.normal[0]) == pytest.approx(np.cos(0.5 * double), abs=2e-3)
    assert parameter.amplitude == pytest.approx(0.5 * amplitude * np.sin(double), rel=4e-3)
    assert parameter.amplitude + k * parameter.normal_stress == pytest.approx(
        parameter.value, rel=1e-12
    )


@pytest.mark.parametrize("k", [0.0, 0.3])
def test_findley_torsion(k):
    """The value is T sqrt(1 + k²)."""
    parameter = findley(history(xy=np.array([-150.0, 150.0])), k, FINE)
    assert parameter.value == pytest.approx(150.0 * np.sqrt(1.0 + k**2), rel=1e-6)


@pytest.mark.parametrize("ratio", [0.2, 0.5, 2.0])
def test_findley_proportional_tension_torsion(ratio):
    """Mohr's circle of centre σ/2 and radius r, reversed, gives k σ/2 + r sqrt(1 + k²)."""
    tension, torsion = 200.0, 200.0 * ratio
    cycle = np.sin(2.0 * np.pi * np.arange(8) / 8)
    parameter = findley(history(xx=tension * cycle, xy=torsion * cycle), SENSITIVITY, FINE)
    radius = np.hypot(0.5 * tension, torsion)
    expected = SENSITIVITY * 0.5 * tension + radius * np.sqrt(1.0 + SENSITIVITY**2)
    assert parameter.value == pytest.approx(expected, rel=1e-6)


def by_brute_force(stress_amplitudes, k):
    """Return Findley and SWT of harmonic stress over planes 1° apart.

    The stress is the real part of amplitudes (3, 3). On a plane the shear vector describes an
    ellipse whose larger semi-axis is the shear amplitude.
    """
    theta, phi = np.radians(np.meshgrid(np.arange(91), np.arange(360), indexing="ij"))
    normal = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
    vector = np.einsum("ij,j...->i...", stress_amplitudes, normal)
    along = np.einsum("i...,i...->...", normal, vector)
    shear = vector - normal * along
    squares = np.sum(np.abs(shear) ** 2, axis=0)
    larger = np.sqrt(0.5 * (squares + np.abs(np.sum(shear**2, axis=0))))
    trace = np.trace(stress_amplitudes)
    strain = np.abs((1.0 + STEEL.poisson) * along - STEEL.poisson * trace) / STEEL.young
    return np.max(larger + k * np.abs(along)), np.max(np.abs(along) * strain)


@pytest.mark.parametrize("phase", [0.0, 45.0, 90.0])
@pytest.mark.parametrize("ratio", [0.3, 1.0 / np.sqrt(3.0), 1.0])
def test_out_of_phase_against_brute_force(phase, ratio):
    """The error of 360 states is 4e-5 of the amplitude, that of planes 1° apart at most 2e-4."""
    angle = 2.0 * np.pi * np.arange(360) / 360
    turn = np.exp(1j * np.radians(phase))
    amplitudes = np.zeros((3, 3), dtype=complex)
    amplitudes[0, 0] = 200.0
    amplitudes[0, 1] = amplitudes[1, 0] = 200.0 * ratio * turn
    stress = history(xx=200.0 * np.cos(angle), xy=200.0 * ratio * np.cos(angle + np.radians(phase)))
    expected = by_brute_force(amplitudes, SENSITIVITY)
    assert findley(stress, SENSITIVITY, FINE).value == pytest.approx(expected[0], rel=4e-4)
    assert smith_watson_topper(stress, STEEL, FINE).value == pytest.approx(expected[1], rel=4e-4)


def test_findley_by_dense_planes_on_random_histories():
    """An independent method agrees: projections of tensors, and chords of every two states.

    The radius is between half the longest chord and 2/sqrt(3) of that (Jung).
    """
    stress = np.random.default_rng(4).standard_normal((6, 6, 3))
    parameter = findley(stress, 0.0, FINE)
    normal = PlaneSearch(5000, 0).normals
    for point in range(3):
        vector = np.einsum("tij,pj->tpi", as_tensor(stress[..., point]), normal)
        shear = vector - normal * np.einsum("tpi,pi->tp", vector, normal)[..., None]
        chords = np.linalg.norm(shear[:, None] - shear[None], axis=-1).max(axis=(0, 1))
        half = 0.5 * chords.max()
        assert half * (1.0 - 1e-3) <= parameter.value[point] <= half * 2.0 / np.sqrt(3.0)


# --- Smith, Watson and Topper


@pytest.mark.parametrize(("low", "high"), [(-200.0, 200.0), (0.0, 300.0), (-300.0, 100.0)])
def test_swt_uniaxial(low, high):
    """The value is σ_max σ_a / E on the plane across."""
    parameter = smith_watson_topper(history(xx=np.array([low, high])), STEEL, FINE)
    assert parameter.value == pytest.approx(high * 0.5 * (high - low) / STEEL.young, rel=1e-6)
    assert abs(parameter.normal[0]) == pytest.approx(1.0, abs=1e-5)
    assert parameter.normal_stress == pytest.approx(high, rel=1e-5)


def test_swt_torsion():
    """The value is T² (1+ν) / E at 45°."""
    parameter = smith_watson_topper(history(xy=np.array([-150.0, 150.0])), STEEL, FINE)
    assert parameter.value == pytest.approx(150.0**2 * 1.3 / STEEL.young, rel=1e-6)


def test_swt_proportional_tension_torsion():
    """The value is σ1 (σ1 - ν σ2) / E with the principal stresses of the reversed state."""
    parameter = smith_watson_topper(
        history(xx=np.array([-200.0, 200.0]), xy=np.array([-80.0, 80.0])), STEEL, FINE
    )
    first, second = 100.0 + np.hypot(100.0, 80.0), 100.0 - np.hypot(100.0, 80.0)
    assert parameter.value == pytest.approx(first * (first - 0.3 * second) / STEEL.young, rel=1e-6)


def test_swt_is_0_where_nothing_is_pulled():
    """Pressure acts on all planes and alternates, so that the strain does have an amplitude."""
    pressure = -100.0 - 50.0 * np.sin(np.arange(6.0))
    stress = history(xx=pressure, yy=pressure, zz=pressure)
    assert smith_watson_topper(stress, STEEL).value == 0.0


# --- Both


PARAMETERS = {
    "findley": lambda stress, search: findley(stress, SENSITIVITY, search),
    "swt": lambda stress, search: smith_watson_topper(stress, STEEL, search),
}


@pytest.mark.parametrize("parameter", PARAMETERS.values(), ids=PARAMETERS)
@pytest.mark.parametrize("seed", range(3))
def test_turning_the_body_turns_the_plane(parameter, seed):
    """Invariance is exact only with all planes: it holds within the error of the refinement."""
    stress = 100.0 * np.random.default_rng(seed).standard_normal((7, 6))
    turn = rotation(seed + 10)
    search = PlaneSearch(300, 20)
    before, after = parameter(stress, search), parameter(rotated(stress, turn), search)
    assert after.value == pytest.approx(before.value, rel=1e-4)
    assert abs(after.normal @ turn @ before.normal) == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize("parameter", PARAMETERS.values(), ids=PARAMETERS)
def test_constant_stress_has_no_amplitude(parameter):
    stress = np.tile(100.0 * np.random.default_rng(1).standard_normal((1, 6, 5)), (9, 1, 1))
    np.testing.assert_allclose(parameter(stress, FINE).amplitude, 0.0, atol=1e-12)


def test_constant_stress_is_worth_its_largest_principal_to_findley():
    stress = 100.0 * np.random.default_rng(1).standard_normal((1, 6))
    parameter = findley(stress, SENSITIVITY, FINE)
    largest = np.linalg.eigvalsh(as_tensor(stress)[0])[-1]
    assert parameter.value == pytest.approx(SENSITIVITY * largest, rel=1e-5)


@pytest.mark.parametrize("parameter", PARAMETERS.values(), ids=PARAMETERS)
def test_order_of_states_does_not_matter(parameter):
    stress = np.random.default_rng(2).standard_normal((8, 6, 4))
    forward, other = parameter(stress, PlaneSearch()), parameter(stress[::-1], PlaneSearch())
    np.testing.assert_allclose(forward.value, other.value, rtol=1e-9)


@pytest.mark.parametrize("parameter", PARAMETERS.values(), ids=PARAMETERS)
def test_maps_are_their_points(parameter):
    """Maps have the values of their points, in any shape and in more than one chunk."""
    stress = np.random.default_rng(3).standard_normal((3, 6, 70, 61))
    search = PlaneSearch(10, 1)
    maps = parameter(stress, search)
    assert maps.value.shape == (70, 61)
    assert maps.normal.shape == (3, 70, 61)
    alone = parameter(stress[:, :, 69, 60], search)
    assert maps.value[69, 60] == pytest.approx(float(alone.value), rel=1e-12)
    np.testing.assert_allclose(np.linalg.norm(maps.normal, axis=0), 1.0, rtol=1e-12)


@pytest.mark.parametrize("parameter", [slow(PARAMETERS["findley"]), PARAMETERS["swt"]])
def test_the_search_loses_what_it_says(parameter):
    """The errors are those that PlaneSearch documents, on fewer histories."""
    stress = np.random.default_rng(5).standard_normal((8, 6, 50))
    best = parameter(stress, PlaneSearch(600, 10)).value
    coarse, fine = (
        1.0 - parameter(stress, PlaneSearch(100, refinements)).value / best
        for refinements in (0, 6)
    )
    assert 0.005 < coarse.mean() < 0.04
    assert coarse.max() < 0.1
    assert fine.mean() < 1e-3
    assert fine.max() < 0.02


# --- Ruiz


def test_ruiz_by_hand():
    """±0.02 mm under 80 MPa give τδ = 1.6 N/mm and a work of 4 τδ; the tension is 300 MPa."""
    work = np.full((1, 1), 4.0 * 80.0 * 0.02)
    stress = history(xx=np.array([300.0, -200.0]), zz=np.array([-900.0, 0.0]))[..., None, None]
    parameters = ruiz(stress, work)
    assert parameters.friction_parameter.item() == pytest.approx(1.6, rel=1e-12)
    assert parameters.cracking_parameter.item() == pytest.approx(480.0, rel=1e-12)


def test_ruiz_does_not_depend_on_axes_in_the_surface():
    rng = np.random.default_rng(6)
    stress = rng.standard_normal((5, 6))
    turn = np.eye(3)
    turn[:2, :2] = [[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]]
    before, after = (ruiz(field, np.float64(1.0)) for field in (stress, rotated(stress, turn)))
    assert after.cracking_parameter == pytest.approx(before.cracking_parameter, rel=1e-12)


def test_nothing_pulled_no_cracks():
    stress = history(xx=np.array([-300.0, -10.0]), yy=np.array([-20.0, -5.0]))
    parameters = ruiz(stress, np.float64(2.0))
    assert parameters.friction_parameter > 0.0
    assert parameters.cracking_parameter == 0.0


def test_histories_without_meaning_are_refused():
    attempts = (
        lambda: findley(np.ones((6, 4)), 0.3),
        lambda: findley(np.full((4, 6), np.nan), 0.3),
        lambda: findley(np.ones((4, 6)), -0.3),
        lambda: PlaneSearch(0),
    )
    assert_refused(StressHistoryError, attempts)
