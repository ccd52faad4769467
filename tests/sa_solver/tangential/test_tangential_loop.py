"""Tangential loops against Mindlin, Jenkins and Masing, for similar and dissimilar bodies."""

import numpy as np
import pytest

from sa_solver.contact import FrictionalContact
from sa_solver.cycles import tangential_loop as loops
from sa_solver.cycles.tangential_loop import LoopFailure, LoopPath, march_loop
from sa_solver.half_space.operator import HalfSpace
from sa_solver.reference.hertz import HertzCylinder
from sa_solver.reference.line_partial_slip import ShearedCylinder
from sa_solver.reference.mindlin import ShearedSphere
from sa_solver.tangential.contact import TangentialContact
from sa_solver.types import ElasticPair, Grid, Material

LOAD, RADIUS, FRICTION = 400.0, 10.0, 0.7
SLIDING = FRICTION * LOAD
PLAIN, TITANIUM = Material(115e3, 0.0), Material(115e3, 0.29)
STEEL, SOFT = Material(200e3, 0.3), Material(10e3, 0.2)

# What a grid of so many cells over a sphere's contact leaves; the contact's area comes in cells, so
# that it does not fall steadily.
CELLS, GRID_ERROR = 64, 1e-3


def sphere(body_1, body_2=None):
    return ShearedSphere(LOAD, RADIUS, body_1, body_2 or body_1, FRICTION)


def run(case, path, cells=CELLS):
    """Return the loop of a sphere on a grid that is just larger than its contact."""
    size = 2.2 * case.contact.contact_radius
    grid = Grid.covering((size, size), (cells, cells))
    pair = ElasticPair(case.body_1, case.body_2)
    contact = FrictionalContact(HalfSpace(grid, pair), case.friction)
    return march_loop(contact, case.contact.gap(grid.x, grid.y), path)


def press_flat(pair, cells, path, friction=FRICTION):
    """Return a flat punch 2 mm wide, in plane strain."""
    grid = Grid.line_contact(2.0, cells)
    contact = FrictionalContact(HalfSpace(grid, pair), friction)
    return march_loop(contact, np.zeros(grid.shape), path)


@pytest.fixture(scope="module")
def partial():
    """Return the loop of a sphere with ν = 0, in partial slip at 3/4 of the sliding force."""
    return run(sphere(PLAIN), LoopPath(LOAD, 0.75 * SLIDING, "force"))


@pytest.fixture(scope="module")
def sliding():
    """Return the loop of this sphere, with three times the displacement at the onset of sliding."""
    return run(sphere(PLAIN), LoopPath(LOAD, 3.0 * sphere(PLAIN).displacement(SLIDING)))


# --- partial slip -------------------------------------------------------------------------------


def test_energy_and_amplitude_are_mindlins(partial):
    case = sphere(PLAIN)
    assert partial.energy == pytest.approx(case.loop_energy(0.75 * SLIDING), rel=GRID_ERROR)
    assert partial.amplitude == pytest.approx(case.displacement(0.75 * SLIDING), rel=GRID_ERROR)
    assert partial.force_amplitude == pytest.approx(0.75 * SLIDING, rel=1e-9)
    assert partial.friction == pytest.approx(0.75 * FRICTION, rel=1e-9)
    assert not partial.slides
    assert partial.border_load == 0.0


def test_first_loading_is_cattaneos(partial):
    displacement, force = partial.loading
    exact = np.array([sphere(PLAIN).displacement(Q) for Q in force])
    np.testing.assert_allclose(displacement, exact, atol=GRID_ERROR * exact[-1])


def test_sliding_share_is_that_of_the_annulus(partial):
    """The load on r > c is P (1 - c²/a²)^(3/2); cells at its rim count completely."""
    case = sphere(PLAIN)
    ratio = case.stick_radius(0.75 * SLIDING) / case.contact.contact_radius
    assert partial.sliding == pytest.approx((1.0 - ratio**2) ** 1.5, abs=0.02)


@pytest.mark.parametrize("material", [PLAIN, TITANIUM])
def test_stiffness_is_mindlins(material):
    """The compliance is 1/kt = Σ (2-ν)/G / 8a, also for ν > 0, because nothing slips."""
    loop = run(sphere(material), LoopPath(LOAD, 0.1 * SLIDING, "force", increments=2))
    expected = 1.0 / sphere(material).tangential_compliance
    assert loop.stiffness == pytest.approx(expected, rel=GRID_ERROR)


def test_branches_are_first_loading_doubled(partial):
    """Masing's rule, exact for ν = 0 on any grid."""
    displacement, force = partial.loading
    back, forth = (branch for branch in partial._branches)
    scale = 1e-7 * displacement[-1]
    np.testing.assert_allclose(displacement[-1] - back[0], 2.0 * displacement, atol=scale)
    np.testing.assert_allclose(force[-1] - back[1], 2.0 * force, atol=1e-9 * SLIDING)
    np.testing.assert_allclose(displacement[-1] + forth[0], 2.0 * displacement, atol=scale)


@pytest.mark.slow
def test_energy_does_not_depend_on_the_increments_and_the_area_does_by_their_square():
    """For ν = 0 cells slip only at |q| = µp, so that the energy of slip is exact.

    The area by trapezoids is too small.
    """
    by_count = {
        count: run(sphere(PLAIN), LoopPath(LOAD, 0.75 * SLIDING, "force", count), cells=32)
        for count in (6, 12, 24)
    }
    energies = [loop.energy for loop in by_count.values()]
    np.testing.assert_allclose(energies, energies[0], rtol=1e-6)
    missing = np.array([loop.energy - loop.work for loop in by_count.values()])
    assert np.all(missing > 0.0)
    np.testing.assert_allclose(missing[:-1] / missing[1:], 4.0, rtol=0.15)
    assert missing[-1] < 3e-3 * energies[0]


def test_slope_after_a_reversal_tends_to_the_stuck_stiffness():
    """The first increments slip: the secant is that of Mindlin, less than the tangent."""
    case, amplitude = sphere(PLAIN), 0.75 * SLIDING
    secants = []
    for count in (3, 6):
        loop = run(case, LoopPath(LOAD, amplitude, "force", count))
        step = 2.0 * amplitude / count
        expected = step / (2.0 * case.displacement(0.5 * step))
        displacement, force = loop.cycle
        secants.append(float((force[1] - force[0]) / (displacement[1] - displacement[0])))
        assert secants[-1] == pytest.approx(expected, rel=2.0 * GRID_ERROR)
    # The difference is of first order in the increment.
    extrapolated = 2.0 * secants[1] - secants[0]
    assert secants[0] < secants[1] < loop.stiffness
    assert extrapolated == pytest.approx(loop.stiffness, rel=0.01)


def test_both_axes_are_equal_for_a_sphere():
    along, across = (
        run(sphere(TITANIUM), LoopPath(LOAD, 0.5 * SLIDING, "force", 4, axis), cells=24)
        for axis in ("x", "y")
    )
    np.testing.assert_allclose(across.displacement, along.displacement, rtol=1e-7, atol=1e-12)
    assert across.energy == pytest.approx(along.energy, rel=1e-6)
    assert across.stiffness == pytest.approx(along.stiffness, rel=1e-9)


def test_line_contact():
    pair = ElasticPair(TITANIUM, TITANIUM)
    line = ShearedCylinder(HertzCylinder(LOAD, RADIUS, pair.contact_modulus), FRICTION)
    grid = Grid.line_contact(2.2 * line.contact.half_width, 128)
    contact = FrictionalContact(HalfSpace(grid, pair), FRICTION)
    height = line.contact.gap(grid.x)
    loop = march_loop(contact, height, LoopPath(LOAD, 0.75 * SLIDING, "force", 6))
    datum = contact.half_space.datum
    expected = line.displacement(0.75 * SLIDING, datum)
    assert loop.energy == pytest.approx(line.loop_energy(0.75 * SLIDING), rel=GRID_ERROR)
    assert loop.amplitude == pytest.approx(expected, rel=GRID_ERROR)
    # Stuck: q = Q/π sqrt(a²-x²) moves it by (2Q/πE*) ln(2L/a); singular ends have errors 1/cells.
    logarithm = np.log(2.0 * datum / line.contact.half_width)
    stuck = 0.5 * np.pi * pair.contact_modulus / logarithm
    assert loop.stiffness == pytest.approx(stuck, rel=1.0 / 128)


# --- sliding ------------------------------------------------------------------------------------


def test_sliding_loop_of_a_sphere(sliding):
    """The area of the loop of ±µP is 0.8 µP δ1 at the onset δ1 of sliding.

    Beyond the onset it grows by 4 µP per stroke.
    """
    onset = sphere(PLAIN).displacement(SLIDING)
    assert sliding.slides
    assert sliding.friction == pytest.approx(FRICTION, rel=1e-7)
    assert sliding.residual_stiffness == pytest.approx(0.0, abs=1e-6 * sliding.stiffness)
    assert sliding.energy == pytest.approx(4.0 * SLIDING * (3.0 - 0.8) * onset, rel=GRID_ERROR)
    assert sliding.work == pytest.approx(sliding.energy, rel=0.02)


def test_flat_punch_is_a_jenkins_element():
    """The shear µ p(P) - µ p(P - Q/µ) is proportional to p: all stick, then all slide.

    The energy is 4 µP (A - µP/kt), to the solver's tolerance on any grid, and so is the friction by
    opening.
    """
    pair = ElasticPair(TITANIUM, TITANIUM)
    loop = press_flat(pair, 32, LoopPath(LOAD, 0.02))
    assert loop.amplitude == pytest.approx(0.02, rel=1e-12)
    expected = 4.0 * SLIDING * (0.02 - SLIDING / loop.stiffness)
    assert loop.energy == pytest.approx(expected, rel=1e-6)
    assert loop.friction == pytest.approx(FRICTION, rel=1e-8)
    assert loop.area == pytest.approx(2.0)
    assert loop.border_load > 0.0
    elastic = loop.loading[1] < 0.99 * SLIDING
    displacement, force = (column[elastic] for column in loop.loading)
    np.testing.assert_allclose(force, loop.stiffness * displacement, atol=1e-6 * SLIDING)


# --- stiffness of the stuck contact -------------------------------------------------------------


def test_stuck_stiffness_agrees_with_friction_without_limit():
    grid = Grid.covering((1.0, 1.2), (20, 18))
    half_space = HalfSpace(grid, ElasticPair(TITANIUM, TITANIUM))
    pressed = grid.x**2 + 1.7 * grid.y**2 < 0.15
    limit = np.where(pressed, 1e9, 0.0)
    motion = {"shift_x": 0.0, "shift_y": 1e-3, "twist": 0.0}
    state = TangentialContact(half_space).solve(limit, **motion, tolerance=1e-11)
    stiffness = loops.stuck_stiffness(half_space, pressed, LoopPath(1.0, 1.0, axis="y"))
    assert stiffness == pytest.approx(state.Qy / 1e-3, rel=1e-9)


def test_stuck_dissimilar_bodies_are_softer_where_pressure_is_free():
    """Compared with dense algebra for held tilts and imposed moments, always with constant P."""
    grid = Grid.covering((1.0, 1.0), (6, 5))
    half_space = HalfSpace(grid, ElasticPair(STEEL, SOFT))
    count = 30
    units = np.eye(3 * count).reshape(-1, 3, *grid.shape)
    compliance = np.stack([half_space.displacement(unit).ravel() for unit in units], axis=1)
    one, zero = np.ones(count), np.zeros(count)
    x, y = (np.broadcast_to(coordinate, grid.shape).ravel() for coordinate in (grid.x, grid.y))
    motion = np.concatenate([one, zero, zero])
    stiffness = {}
    for moments, modes in ((None, [one]), ((0.0, 0.0), [one, x, y])):
        held = np.stack([np.concatenate([zero, zero, mode]) for mode in modes], axis=1)
        size = 3 * count + held.shape[1]
        matrix = np.zeros((size, size))
        matrix[: 3 * count, : 3 * count] = compliance
        matrix[: 3 * count, 3 * count :] = held
        matrix[3 * count :, : 3 * count] = held.T
        traction = np.linalg.solve(matrix, np.append(motion, np.zeros(held.shape[1])))
        expected = float(motion @ traction[: 3 * count]) * grid.cell_area
        path = LoopPath(1.0, 1.0, moments=moments)
        pressed = np.ones(grid.shape, dtype=bool)
        stiffness[moments] = loops.stuck_stiffness(half_space, pressed, path)
        assert stiffness[moments] == pytest.approx(expected, rel=1e-9)
    assert stiffness[0.0, 0.0] < stiffness[None]


# --- dissimilar bodies --------------------------------------------------------------------------


def test_dissimilar_bodies_slide_symmetrically_and_close():
    """With β = 0.35 Mindlin's stiffness and energy, which neglect β, are within 2 %."""
    case = sphere(STEEL, SOFT)
    onset = case.displacement(SLIDING)
    loop = run(case, LoopPath(LOAD, 2.5 * onset, increments=8), cells=16)
    assert loop.closure <= loops.CLOSED
    assert loop.slides
    assert loop.friction == pytest.approx(FRICTION, rel=1e-6)
    assert loop.energy == pytest.approx(4.0 * SLIDING * (2.5 - 0.8) * onset, rel=0.02)
    assert loop.work == pytest.approx(loop.energy, rel=0.02)
    assert loop.stiffness == pytest.approx(1.0 / case.tangential_compliance, rel=0.02)


def test_dissimilar_bodies_in_partial_slip_are_marched_until_they_close():
    """The slip by pressing takes several cycles to be forgotten."""
    path = LoopPath(LOAD, 0.4 * SLIDING, "force", 6)
    loop = run(sphere(STEEL, SOFT), path, cells=12)
    assert loop.closure <= loops.CLOSED
    assert len(loop.force) > 1 + 3 * 6
    assert len(loop.cycle[0]) == 1 + 2 * 6
    assert loop.work == pytest.approx(loop.energy, rel=0.05)


# --- what is imposed ----------------------------------------------------------------------------


def test_moments_and_tilts():
    """Moments determine the position of the pressure; without them the bodies do not tilt."""
    grid = Grid.covering((1.0, 1.0), (16, 16))
    contact = FrictionalContact(HalfSpace(grid, ElasticPair(TITANIUM, TITANIUM)), FRICTION)
    height = (grid.x**2 + grid.y**2) / 400.0
    pressed = {
        moments: loops._press(contact, height, LoopPath(LOAD, 1e-3, moments=moments))
        for moments in ((0.0, 0.0), (0.0, -40.0), None)
    }
    assert pressed[0.0, -40.0].resultants[4] == pytest.approx(-40.0, rel=1e-8)
    assert pressed[0.0, -40.0].rigid[4] != 0.0
    np.testing.assert_allclose(pressed[None].traction, pressed[0.0, 0.0].traction, atol=1e-3)
    loop = march_loop(contact, height, LoopPath(LOAD, 1e-4, moments=(0.0, -40.0)))
    assert loop.amplitude == pytest.approx(1e-4, rel=1e-9)


def test_a_loop_that_does_not_converge_is_an_error(monkeypatch):
    monkeypatch.setattr(loops, "STUCK_ITERATIONS", 1)
    with pytest.raises(LoopFailure, match="stuck contact"):
        run(sphere(TITANIUM), LoopPath(LOAD, 0.1 * SLIDING, "force", 2), cells=16)
