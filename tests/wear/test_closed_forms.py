"""Worn shapes with closed forms: a patch, a cylinder and a sphere that slide without end.

Both bodies together lose the depth W = κ p per cycle where they touch. A contact that has worn for
long no longer depends on how it began, and p follows from the growth of W.

**A patch** of fixed outline, pressed flat. The gap stays closed: u + W is a plane and u = K p, so
that K p' + κ p is a plane, and p tends to the pressure at which W' is a plane: it is uniform, P/A,
if the patch may not tilt or is pressed at its centre. The deviation decays with the modes of K
between pressures without resultant: exp(-κ N/λ), λ the eigenvalues (Goryacheva 1998, Contact
Mechanics in Tribology, ch. 6).

**A parabola** x²/2R or (x² + y²)/2R is closed over |x| < b or r < b: W = (b² - x²)/2R - [u(x) -
u(b)]. For b much larger than the first contact a, wear is much more than elastic deformation and
the bodies conform, W = (b² - x²)/2R and V = (2/3) b³/R per length, or π b⁴/4R; W' is uniform, hence
p = P/2b or P/π b². With u of that pressure (Johnson 1985, eqs 2.30b and 3.29), P/πE* = a²/4R and
P/E* = 4 a³/3R, the elastic deformation reduces them, to first order in ε = (a/b)² and (a/b)³, to

    cylinder  V = (2/3) (b³/R) (1 - 3ε/4)        W(0) = (b²/2R) (1 - ε ln 2)
    sphere    V = (π b⁴/4R) (1 - 64 ε/9π²)       W(0) = (b²/2R) (1 - (16/3π)(1 - 2/π) ε)

and, the pressure being P dW(0)/dV as b grows,

    cylinder  p(0) = (P/2b) / (1 - ε/4)
    sphere    p(0) = (P/π b²) (1 + (8/3π)(1 - 2/π) ε) / (1 - 16 ε/9π²)
"""

import numpy as np
import pytest
import scipy.linalg

from sa_solver.half_space.operator import HalfSpace
from sa_solver.load_history import LoadHistory
from sa_solver.normal.contact import NormalContact
from sa_solver.types import Array, ElasticPair, Grid, Material
from tests.marks import slow
from tests.oracles.worn_shapes import worn_cylinder, worn_sphere
from wear.contact.moving import LARGE_STROKE, passages
from wear.laws import EnergyLaw
from wear.steps.stepping import SlidingCycle, WearingContact, WearState
from wear.surfaces import Surfaces

BODY = Material(115e3, 0.29)
PAIR = ElasticPair(BODY, BODY)
MODULUS = PAIR.contact_modulus
RADIUS, FRICTION, STROKE, COEFFICIENT = 10.0, 0.5, 0.02, 5e-6
TOLERANCE = 1e-10
# Depth per pressure and cycle of either body; a cycle slides twice the stroke.
KAPPA = COEFFICIENT * FRICTION * 2.0 * STROKE


def unworn(grid: Grid, form: Array) -> WearState:
    """Return the state before the first cycle."""
    return WearState.unworn(np.ascontiguousarray(np.broadcast_to(form, grid.shape)))


def cycle_of(load: float, increments: int) -> LoadHistory:
    """Return a cycle of equal increments."""
    zero = np.zeros(increments)
    columns = dict.fromkeys(("Qx", "Qy", "Mx", "My", "Mz", "Edx", "Edy"), zero)
    return LoadHistory(P=zero + load, **columns, sliding=np.ones(increments, dtype=bool))


class March:
    """A form that slides as a whole and wears implicitly, with given shares of both bodies."""

    def __init__(
        self, grid: Grid, form: Array, load: float, shares: tuple[float, float] = (1.0, 1.0)
    ) -> None:
        cycle = SlidingCycle(cycle_of(load, 1), np.full((1, *grid.shape), 2.0 * STROKE))
        laws = EnergyLaw(shares[0] * COEFFICIENT), EnergyLaw(shares[1] * COEFFICIENT)
        contact = NormalContact(HalfSpace(grid, PAIR))
        self._wearing = WearingContact(contact, laws, FRICTION, cycle, TOLERANCE)
        self._state = unworn(grid, form)

    def step(self, cycles: float) -> None:
        self._state = self._wearing.implicit_step(self._state, cycles).state

    def to_volume(self, volume: float, load: float, steps: int) -> float:
        """Wear a given volume of both bodies together, in steps that grow with the contact.

        Return the volume in the middle of the last step: the pressure of an implicit step is that
        of its middle, but for the square of the step.
        """
        cycles = volume / (2.0 * KAPPA * load) * np.linspace(0.0, 1.0, steps + 1) ** 2
        for jump in np.diff(cycles):
            self.step(float(jump))
        return float(cycles[-2:].mean() * 2.0 * KAPPA * load)

    @property
    def surfaces(self) -> Surfaces:
        return self._state.surfaces

    @property
    def depth(self) -> Array:
        return self.surfaces.depth

    @property
    def pressure(self) -> Array:
        return self._wearing.solve(self.surfaces, 0, self._state.starts.get(0)).pressure


# --- a patch ------------------------------------------------------------------------------------


def punch(grid: Grid, half_width: float, half_length: float = np.inf) -> Array:
    """Return a flat punch on a step that never touches."""
    return np.where((np.abs(grid.x) < half_width) & (np.abs(grid.y) < half_length), 0.0, 1.0)


@pytest.mark.parametrize(
    ("grid", "form", "area"),
    [
        (Grid.line_contact(1.2, 60), punch(Grid.line_contact(1.2, 60), 0.5), 1.0),
        (
            Grid.covering((1.2, 0.8), (24, 16)),
            punch(Grid.covering((1.2, 0.8), (24, 16)), 0.5, 0.3),
            0.6,
        ),
    ],
)
def test_pressure_on_a_fixed_patch_tends_to_uniform(grid: Grid, form: Array, area: float) -> None:
    load = 100.0 * area
    march = March(grid, form, load)
    first = march.pressure[form == 0.0]
    assert first.max() > 2.0 * load / area  # the edges of a new patch carry most
    spread = []
    for _ in range(5):
        for _ in range(10):
            march.step(5.0)
        spread.append(np.ptp(march.pressure[form == 0.0]) / (load / area))
    assert np.all(np.diff(spread) < 0.0)
    for _ in range(30):
        march.step(500.0)
    np.testing.assert_allclose(march.pressure[form == 0.0], load / area, rtol=1e-7)
    assert not march.depth[form > 0.0].any()


def test_pressure_on_a_patch_becomes_uniform_as_its_modes_decay() -> None:
    """Backward Euler divides each mode by 1 + 2κΔN/λ per step: exact, and of first order in ΔN.

    λ comes from the dense compliance, between pressures that are even in x and have no resultant.
    """
    grid, load, jump = Grid.line_contact(1.2, 60), 100.0, 1.0
    form = punch(grid, 0.5)
    on = np.flatnonzero(form == 0.0)
    march = March(grid, form, load)
    space = HalfSpace(grid, PAIR)
    units = np.eye(grid.shape[0])[on].reshape(-1, *grid.shape)
    compliance = np.stack([space.normal(unit).ravel()[on] for unit in units], axis=1)
    # Remove resultant and moment, which a rigid motion of the patch carries.
    plane = np.stack([np.ones(len(on)), grid.x.ravel()[on]], axis=1)
    free = scipy.linalg.null_space(plane.T)
    lengths, modes = np.linalg.eigh(free.T @ compliance @ free)
    modes = free @ modes
    begun = modes.T @ march.pressure.ravel()[on]
    for _ in range(12):
        march.step(jump)
    expected = modes @ (begun / (1.0 + 2.0 * KAPPA * jump / lengths) ** 12) + load
    assert np.ptp(expected) > 0.3 * load  # far from over
    np.testing.assert_allclose(march.pressure.ravel()[on], expected, rtol=1e-6)


# --- a cylinder and a sphere --------------------------------------------------------------------


@pytest.mark.parametrize("shares", [(1.0, 1.0), (0.0, 2.0), (1.5, 0.5)])
def test_a_cylinder_becomes_conforming(shares: tuple[float, float]) -> None:
    """At a/b = 0.2 depth and pressure are met to 0.2 %, and the width to a cell, on either body."""
    grid, load, volume = Grid.line_contact(1.4, 140), 50.0, 2.0 / 3.0 * 0.5**3 / RADIUS
    march = March(grid, grid.x**2 / (2.0 * RADIUS), load, shares)
    middle = march.to_volume(volume, load, 60)
    b, depth, _ = worn_cylinder(load, volume, RADIUS, MODULUS)
    assert march.depth.sum() * grid.cell_area == pytest.approx(volume, rel=1e-9)
    assert march.depth.max() == pytest.approx(depth, rel=2e-3)
    *_, pressure = worn_cylinder(load, middle, RADIUS, MODULUS)
    np.testing.assert_allclose(march.pressure[65:75], pressure, rtol=2e-3)
    half = 0.5 * np.count_nonzero(march.depth) * grid.pitch[0]
    assert half == pytest.approx(b, abs=grid.pitch[0])
    # Each body wears by its own share.
    whole = sum(shares)
    np.testing.assert_allclose(march.surfaces.depth_1, shares[0] / whole * march.depth, atol=1e-15)


def test_a_sphere_becomes_conforming() -> None:
    grid, load = Grid.covering((1.2, 1.2), (60, 60)), 20.0
    volume = 0.25 * np.pi * 0.5**4 / RADIUS
    march = March(grid, (grid.x**2 + grid.y**2) / (2.0 * RADIUS), load)
    middle = march.to_volume(volume, load, 30)
    b, depth, _ = worn_sphere(load, volume, RADIUS, MODULUS)
    assert march.depth.sum() * grid.cell_area == pytest.approx(volume, rel=1e-9)
    assert march.depth.max() == pytest.approx(depth, rel=3e-3)
    *_, pressure = worn_sphere(load, middle, RADIUS, MODULUS)
    np.testing.assert_allclose(march.pressure[27:33, 27:33], pressure, rtol=3e-3)
    area = np.count_nonzero(march.depth) * grid.cell_area
    assert np.sqrt(area / np.pi) == pytest.approx(b, abs=grid.pitch[0])


@pytest.mark.slow
def test_the_worn_cylinder_converges_with_grid_and_jumps() -> None:
    """The depth converges in first order with pitch and steps, to within the (a/b)⁴ neglected."""
    load, volume = 50.0, 2.0 / 3.0 * 0.5**3 / RADIUS
    _, depth, _ = worn_cylinder(load, volume, RADIUS, MODULUS)
    errors = []
    for count in (35, 70, 140, 280):
        grid = Grid.line_contact(1.4, count)
        march = March(grid, grid.x**2 / (2.0 * RADIUS), load)
        march.to_volume(volume, load, count // 4)
        errors.append(abs(march.depth.max() / depth - 1.0))
    assert errors[-1] < 1e-3, errors


# --- symmetry -----------------------------------------------------------------------------------


def test_symmetric_problems_stay_symmetric_over_100_jumps() -> None:
    """Symmetry holds to 1e-8 of the depth while the contact grows to three times its width.

    It is that about both axes and both diagonals.
    """
    grid, load = Grid.covering((1.0, 1.0), (25, 25)), 20.0
    march = March(grid, (grid.x**2 + grid.y**2) / (2.0 * RADIUS), load)
    march.to_volume(0.25 * np.pi * 0.4**4 / RADIUS, load, 100)
    depth = march.depth
    for mirrored in (depth[::-1], depth[:, ::-1], depth.T, depth[::-1, ::-1].T):
        np.testing.assert_allclose(mirrored, depth, atol=1e-8 * depth.max())


# --- surfaces that pass over each other ---------------------------------------------------------


class MovingMarch:
    """March over a stroke that is not small: body 1 passes under the grid of body 2."""

    def __init__(
        self, grid: Grid, form: Array, load: float, stroke: float, each_way: int, share: float
    ) -> None:
        """Set up the march; ``share`` of the wear is body 1's."""
        out = np.linspace(-0.5 * stroke, 0.5 * stroke, each_way + 1)
        x = np.concatenate([out, out[-2::-1]])
        path = np.stack([x, np.zeros_like(x)], axis=1)
        count, passed = 2 * each_way, passages(grid, np.stack([path[:-1], path[1:]], axis=1))
        slip = np.full((count, *grid.shape), stroke / each_way)
        laws = EnergyLaw(share * COEFFICIENT), EnergyLaw((1.0 - share) * COEFFICIENT)
        cycle = SlidingCycle(cycle_of(load, count), slip, passages=passed)
        contact = NormalContact(HalfSpace(grid, PAIR))
        self._wearing = WearingContact(contact, laws, FRICTION, cycle, TOLERANCE)
        self._state = unworn(grid, form)
        self._per_cycle = COEFFICIENT * FRICTION * load * 2.0 * stroke

    def to_volume(self, volume: float, steps: int, kind: str = "implicit") -> None:
        """Wear a given volume of both bodies together."""
        cycles = volume / self._per_cycle * np.linspace(0.0, 1.0, steps + 1) ** 2
        for jump in np.diff(cycles):
            step = getattr(self._wearing, f"{kind}_step")
            self._state = step(self._state, float(jump)).state

    @property
    def depth_1(self) -> Array:
        return self._state.surfaces.depth_1

    @property
    def depth_2(self) -> Array:
        return self._state.surfaces.depth_2


@pytest.mark.parametrize("stroke", [0.1, slow(2.0)])
def test_a_flat_that_does_not_wear_stays_out_of_it(stroke: float) -> None:
    """If only the cylinder wears, its shape is that of small strokes, however far it slides."""
    width = 1.4 + stroke
    grid, load = Grid.line_contact(width, round(width / 0.02)), 50.0
    volume = 2.0 / 3.0 * 0.5**3 / RADIUS
    march = MovingMarch(grid, grid.x**2 / (2.0 * RADIUS), load, stroke, 4, 0.0)
    march.to_volume(volume, 15)
    _, depth, _ = worn_cylinder(load, volume, RADIUS, MODULUS)
    assert not march.depth_1.any()
    assert march.depth_2.max() == pytest.approx(depth, rel=3e-3)


@pytest.mark.parametrize("stroke", [1.5, slow(3.0)])
def test_over_a_long_stroke_the_slider_wears_alone_and_the_flat_evenly(stroke: float) -> None:
    """The cylinder wears as on a new flat, and the flat evenly except for its ends.

    The cylinder's own volume gives its half width b. The flat is V1/s deep, up to b + s/2. The ends
    take 2b of the stroke, where the walls, W(0) 4b/3s high, carry some of the load: the slider's
    form is accurate to (b/s)².
    """
    width, load, volume = stroke + 1.2, 20.0, 2.0 / 3.0 * 0.3**3 / RADIUS
    grid = Grid.line_contact(width, round(width / 0.02))
    march = MovingMarch(grid, grid.x**2 / (2.0 * RADIUS), load, stroke, 10, 0.5)
    march.to_volume(2.0 * volume, 12)
    b, depth, _ = worn_cylinder(load, volume, RADIUS, MODULUS)
    tolerance = (b / stroke) ** 2
    for worn in (march.depth_1, march.depth_2):
        assert worn.sum() * grid.cell_area == pytest.approx(volume, rel=1e-9)
    assert march.depth_2.max() == pytest.approx(depth, rel=tolerance)
    half = [0.5 * np.count_nonzero(worn) * grid.pitch[0] for worn in (march.depth_1, march.depth_2)]
    assert half[1] == pytest.approx(b, abs=grid.pitch[0])
    assert half[0] == pytest.approx(half[1] + 0.5 * stroke, abs=1.01 * grid.pitch[0])
    middle = march.depth_1[np.abs(grid.x) < 0.2]
    np.testing.assert_allclose(middle, volume / stroke, rtol=tolerance)


@pytest.mark.slow
def test_neglecting_the_motion_costs_the_square_of_the_stroke() -> None:
    """At a stroke of a tenth of the contact the motion matters by less than 1 %.

    :data:`wear.contact.moving.LARGE_STROKE` relies on this.
    """
    grid, load, volume = Grid.line_contact(1.6, 80), 50.0, 2.0 / 3.0 * 0.5**3 / RADIUS
    form = grid.x**2 / (2.0 * RADIUS)
    still = March(grid, form, load)
    still.to_volume(volume, load, 20)
    width = np.count_nonzero(still.depth) * grid.pitch[0]
    errors = []
    for share in (LARGE_STROKE, 2.0 * LARGE_STROKE):
        march = MovingMarch(grid, form, load, share * width, 4, 0.5)
        march.to_volume(volume, 20)
        pairs = (march.depth_1, still.surfaces.depth_1), (march.depth_2, still.surfaces.depth_2)
        errors.append(
            [
                *(abs(moved.max() / other.max() - 1.0) for moved, other in pairs),
                *(np.abs(moved - other).sum() / other.sum() for moved, other in pairs),
            ]
        )
    assert max(errors[0]) < 0.01
    rates = np.log2(np.array(errors[1]) / errors[0])
    np.testing.assert_allclose(rates, 2.0, atol=0.35)
