"""Length of wear steps: rates of convergence, error control, and sums over a run."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from sa_solver.half_space.operator import HalfSpace
from sa_solver.load_history import LoadHistory
from sa_solver.normal.contact import NormalContact
from sa_solver.types import Array, ElasticPair, Grid, Material
from tests.marks import slow
from wear.contact.drive import Drive
from wear.laws import EnergyLaw
from wear.steps.implicit import ImplicitStepper, SecondOrderStepper
from wear.steps.marching import advance_cycles
from wear.steps.step_errors import ErrorControl, root_mean_square, steps_to_come
from wear.steps.steppers import ExplicitStepper
from wear.steps.stepping import SlidingCycle, WearingContact, WearState
from wear.worn import Cost, WearStep

BODY = Material(115e3, 0.29)
GRID = Grid.line_contact(8.0, 40)
HALF_SPACE = HalfSpace(GRID, ElasticPair(BODY, BODY))
CONTACT = NormalContact(HALF_SPACE)
X = GRID.x / 4.0
FRICTION, MEAN = 0.4, 200.0
LAWS = EnergyLaw(1e-8), EnergyLaw(2e-8)


def history(P: Array, My: Array) -> LoadHistory:
    zero = np.zeros(len(P))
    columns = dict.fromkeys(("Qx", "Qy", "Mx", "Mz", "Edx", "Edy"), zero)
    return LoadHistory(P=P, My=My, **columns, sliding=zero > 0.0)


def cycle(scale: Array | float = 1.0) -> SlidingCycle:
    """Return three loads off centre with dissimilar slips, scaled by ``scale`` ``(nx, 1)``."""
    P = MEAN * 8.0 * np.array([0.7, 1.0, 0.85])
    slip = [0.02 * (1.0 + 0.4 * np.sin(k + X)) * scale for k in (0.0, 2.0, 4.0)]
    return SlidingCycle(history(P, P * [0.2, -0.1, 0.05]), np.stack(slip))


def wearing(scale: Array | float = 1.0) -> WearingContact:
    return WearingContact(CONTACT, LAWS, FRICTION, cycle(scale), 1e-10)


def waved() -> WearState:
    """Return a flat worn to uniform pressure with a long wave on it: everything touches."""
    dished = -HALF_SPACE.normal(np.full(GRID.shape, 0.85 * MEAN))
    gap = dished + 1e-4 * np.cos(2.0 * X)
    return WearState.unworn(gap)


def rounded() -> WearState:
    """Return a flat with rounded edges: the contact grows as it wears."""
    gap = np.maximum(np.abs(GRID.x) - 2.0, 0.0) ** 2 / 60.0
    return WearState.unworn(gap)


def unchanging(state: WearState) -> WearingContact:
    return CONSTANT


def evolving(state: WearState) -> WearingContact:
    """Return the contact of a state whose slip grows with wear, as that of the half-space does."""
    return wearing(1.0 + state.surfaces.depth / 4e-3)


CONSTANT = wearing()
LIMIT = CONSTANT.stable_cycles(waved())


# --- order --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("stepper", "order", "fewest", "contact_at"),
    [
        (ExplicitStepper(), 1, 12, unchanging),
        (ExplicitStepper(), 1, 12, evolving),
        (ImplicitStepper(), 1.5, 6, unchanging),
        (ImplicitStepper(), 1.5, 6, evolving),
        (SecondOrderStepper(), 2, 4, unchanging),
        slow(SecondOrderStepper(), 2, 4, evolving),
    ],
)
def test_order_of_convergence(stepper, order, fewest, contact_at) -> None:
    """The depth converges everywhere at the order of the method, also with slips that change."""
    cycles = 6.0 * LIMIT
    jumps = fewest, 2 * fewest, 4 * fewest
    coarse, middle, fine = (
        advance_in(stepper, waved(), cycles, count, contact_at) for count in jumps
    )
    rate = np.log2(np.abs(coarse - middle).max() / np.abs(middle - fine).max())
    assert rate == pytest.approx(order, abs=0.25)


@pytest.mark.slow
def test_methods_agree_in_the_limit() -> None:
    cycles = 6.0 * LIMIT
    ends = []
    for stepper in (ExplicitStepper(), ImplicitStepper(), SecondOrderStepper()):
        coarse, fine = [advance_in(stepper, waved(), cycles, jumps) for jumps in (32, 64)]
        order = 2 if isinstance(stepper, SecondOrderStepper) else 1
        ends.append(fine + (fine - coarse) / (2**order - 1))
    for end in ends[1:]:
        np.testing.assert_allclose(end, ends[0], rtol=2e-4)


def advance_in(
    stepper, state: WearState, cycles: float, jumps: int, contact_at=unchanging
) -> Array:
    for _ in range(jumps):
        state = stepper.step(state, cycles / jumps, cycles, contact_at).state
    return state.surfaces.depth


# --- automatic length -----------------------------------------------------------------------------


def automatic(stepper, cycles: float) -> WearStep:
    """Return a run whose steps choose their own length."""
    state = rounded()
    first = CONSTANT.cycle(state, CONSTANT.dissipating)
    starts = {t: solved.start for t, solved in first.states.items()}
    limit = CONSTANT.stable_cycles(state)
    state = replace(state, starts=starts, next_cycles=4.0 * limit)
    end = advance_cycles(stepper, state, cycles, cycles, unchanging)
    return replace(end, cost=end.cost + Cost(len(first.states)))


@cache
def exact_depth(cycles: float, steps: int = 30) -> Array:
    """Return the depth at the end of a run by steps of second order, accurate to 1e-3."""
    state = rounded()
    for _ in range(steps):
        state = CONSTANT.second_order_step(state, cycles / steps).state
    return state.surfaces.depth


def errors(state: WearState, exact: Array) -> tuple[float, float]:
    """Return the estimated and the true relative error of the depth."""
    size = root_mean_square(exact, exact)
    estimate = root_mean_square(np.add(*state.errors), exact)
    return estimate / size, root_mean_square(state.surfaces.depth - exact, exact) / size


@pytest.mark.slow
@pytest.mark.parametrize("kind", [ImplicitStepper, SecondOrderStepper])
def test_automatic_steps_meet_their_tolerance_and_grow_fewer_with_it(kind) -> None:
    """The estimated error is within a factor of three of the true one."""
    cycles = 100.0 * CONSTANT.stable_cycles(rounded())
    exact = exact_depth(cycles, 100)  # accurate to 2e-5
    steps = []
    for tolerance in (0.02, 1e-3, 2e-4):
        end = automatic(kind(ErrorControl(tolerance)), cycles)
        estimate, error = errors(end.state, exact)
        assert estimate < tolerance
        assert error < 1.1 * tolerance
        assert error / 3.0 < estimate < 3.0 * error
        assert end.state.surfaces.depth.max() == pytest.approx(exact.max(), rel=tolerance)
        steps.append(end.cost.steps)
    assert steps == sorted(set(steps))


def strang_step(state: WearState, cycles: float, contact_at) -> WearState:
    """Take a step over all increments and back, with the slips half-way for all of it."""
    out = contact_at(state).implicit_step(state, 0.5 * cycles, back=True)
    middle = contact_at(out.state)
    out = middle.implicit_step(state, 0.5 * cycles, back=True)
    return middle.implicit_step(out.state, 0.5 * cycles).state


@pytest.mark.parametrize("contact_at", [unchanging, evolving])
@pytest.mark.parametrize("lengths", [(1.0, 1.0, 2.0, 2.0), (1.0, 1.5, 2.0, 0.5), (2.0, 0.1, 1.0)])
def test_the_companion_takes_steps_of_twice_the_length(lengths, contact_at) -> None:
    """The companion goes out in one step and back in the next; V = α E holds for both runs.

    The two steps may differ in length. Of two equal steps, the slips half-way are estimated from
    the other run: the error of a hundredth is due to that alone.
    """
    unit, state, alone, coarse = 0.4 * LIMIT, waved(), waved(), waved()
    for cycles in lengths:
        state = ImplicitStepper().step(state, cycles * unit, 100.0 * unit, contact_at).state
        alone = strang_step(alone, cycles * unit, contact_at)
    pairs = [sum(lengths)] if len(lengths) == 3 else [sum(lengths[:2]), sum(lengths[2:])]
    for pair in pairs:
        coarse = strang_step(coarse, pair * unit, contact_at)
    np.testing.assert_allclose(state.surfaces.depths, alone.surfaces.depths, rtol=1e-7)
    missed = np.subtract(state.coarse_run.surfaces.depths, state.surfaces.depths)
    guessed = contact_at is evolving and lengths[0] == lengths[1]
    np.testing.assert_allclose(
        state.coarse_run.surfaces.depths,
        coarse.surfaces.depths,
        rtol=1e-7,
        atol=0.01 * np.abs(missed).max() if guessed else 0.0,
    )
    assert state.coarse_run.coarse is None
    np.testing.assert_allclose(state.errors, missed / (2.0**state.order - 1.0), atol=1e-18)
    volume = state.coarse_run.surfaces.depth.sum() * GRID.cell_area
    assert volume == pytest.approx(3e-8 * state.coarse_run.energy, rel=1e-10)


def test_the_last_of_an_odd_number_of_steps_is_two() -> None:
    """The last step is compared as well, with one of its length."""
    state, cycles = waved(), 0.4 * LIMIT
    step = ImplicitStepper().step(state, cycles, cycles, unchanging)
    fine = strang_step(strang_step(state, 0.5 * cycles, unchanging), 0.5 * cycles, unchanging)
    whole = strang_step(state, cycles, unchanging)
    np.testing.assert_allclose(step.state.surfaces.depths, fine.surfaces.depths, rtol=1e-7)
    np.testing.assert_allclose(
        step.state.coarse_run.surfaces.depths, whole.surfaces.depths, rtol=1e-7
    )


def test_a_companion_half_way_goes_on_where_increments_become_equal() -> None:
    """The companion has worn as many cycles as the others, and takes its own steps from there."""
    cycles = 0.4 * LIMIT
    same = history(8.0 * MEAN * np.ones(3), np.zeros(3))
    alike = replace(CONSTANT, sliding=SlidingCycle(same, np.full((3, *GRID.shape), 0.02)))
    half_way = ImplicitStepper().step(waved(), cycles, 10.0 * cycles, unchanging).state
    after = ImplicitStepper().step(half_way, cycles, 10.0 * cycles, lambda _: alike).state
    assert half_way.coarse_run.coarse is not None
    assert after.coarse_run.coarse is None
    own = alike.implicit_step(replace(half_way.coarse_run, coarse=None), cycles).state
    np.testing.assert_array_equal(after.coarse_run.surfaces.depths, own.surfaces.depths)


def test_steps_that_go_alone_are_the_same_without_their_companion() -> None:
    compared, alone = (
        advance_cycles(ImplicitStepper(alone=one), waved(), LIMIT, 2.0 * LIMIT, evolving)
        for one in (False, True)
    )
    assert compared.state.coarse is not None
    assert alone.state.coarse is None
    for ours, theirs in zip(
        alone.state.surfaces.depths, compared.state.surfaces.depths, strict=True
    ):
        np.testing.assert_array_equal(ours, theirs)
    assert alone.cost.contact_solves < compared.cost.contact_solves


@pytest.mark.parametrize("kind", [ImplicitStepper, slow(SecondOrderStepper)])
def test_steps_stay_short_enough_to_compare(kind) -> None:
    """The run is ten times as long as three dissimilar loads need to press all waves away.

    Ever longer steps would reach the same surfaces, whatever their length, and not those of short
    steps: the estimate would be a tenth of the error.
    """
    cycles = 1000.0 * CONSTANT.stable_cycles(rounded())
    exact = exact_depth(cycles, 60)  # accurate to 6e-4, a sixth of the error
    estimate, error = errors(automatic(kind(ErrorControl(0.01)), cycles).state, exact)
    assert 1e-4 < error < 0.01
    assert error / 3.0 < estimate < 3.0 * error


def test_steps_under_equal_loads_may_have_any_length() -> None:
    loads, slip = history(np.full(2, MEAN), np.zeros(2)), np.full((2, *GRID.shape), 0.01)
    alike = replace(CONSTANT, sliding=SlidingCycle(loads, slip))
    assert alike.comparable_cycles(rounded()) == np.inf
    twice = replace(
        CONSTANT, sliding=SlidingCycle(loads, slip * np.array([1.0, 2.0])[:, None, None])
    )
    assert twice.comparable_cycles(rounded()) < np.inf


def test_automatic_steps_take_a_sixth_of_the_explicit_ones() -> None:
    """One per cent of depth and volume costs a sixth of explicit steps at their limit.

    The companion takes a third of that.
    """
    cycles = 150.0 * CONSTANT.stable_cycles(rounded())
    explicit = automatic(ExplicitStepper(fraction=1.0), cycles)
    implicit = automatic(ImplicitStepper(ErrorControl(0.01)), cycles)
    assert implicit.cost.contact_solves <= explicit.cost.contact_solves / 6.0
    depth, other = (end.state.surfaces.depth for end in (implicit, explicit))
    assert depth.max() == pytest.approx(other.max(), rel=0.01)
    assert depth.sum() == pytest.approx(other.sum(), rel=0.01)


def test_an_absolute_tolerance_is_a_depth() -> None:
    """The error of a step is bounded in mm, whatever the depth at the end."""
    cycles = 100.0 * CONSTANT.stable_cycles(rounded())
    exact = exact_depth(cycles)
    worn = exact > 0.0
    allowed = 0.01 * float(np.sqrt(np.mean(exact[worn] ** 2)))
    absolute, relative = (
        automatic(ImplicitStepper(control), cycles)
        for control in (ErrorControl(absolute=allowed), ErrorControl(relative=0.01))
    )
    # The companion may take one step more or less.
    assert abs(absolute.cost.steps - relative.cost.steps) <= 4
    assert root_mean_square(absolute.state.surfaces.depth - exact, exact) < allowed


def test_a_step_that_was_too_long_is_taken_again() -> None:
    """A first guess a hundred times too long costs contact problems, not accuracy."""
    cycles = 100.0 * CONSTANT.stable_cycles(rounded())
    exact = exact_depth(cycles)
    end = advance_cycles(ImplicitStepper(ErrorControl(0.01)), rounded(), cycles, cycles, unchanging)
    assert end.cost.contact_solves > 3 * end.cost.steps
    assert end.state.surfaces.depth.max() == pytest.approx(exact.max(), rel=0.01)


def test_explicit_steps_keep_to_their_share_of_the_limit() -> None:
    limit = CONSTANT.stable_cycles(rounded())
    end = advance_cycles(
        ExplicitStepper(fraction=0.5), rounded(), 10.0 * limit, 10.0 * limit, unchanging
    )
    assert end.cost.steps >= 20


@pytest.mark.parametrize(
    "stepper",
    [
        ExplicitStepper(0.9),
        ExplicitStepper(),
        ImplicitStepper(),
        ImplicitStepper(ErrorControl(0.01)),
        SecondOrderStepper(),
    ],
)
def test_steps_add_up_to_the_cycles_asked_for(stepper) -> None:
    """The energy of gross sliding is µ Σ p s over exactly these cycles."""
    cycles = 3.3 * LIMIT
    state = advance_cycles(stepper, waved(), cycles, 10.0 * cycles, unchanging).state
    volume = state.surfaces.depth.sum() * GRID.cell_area
    assert volume == pytest.approx(3e-8 * state.energy, rel=1e-10)
    assert state.energy == pytest.approx(
        advance_cycles(ImplicitStepper(), waved(), cycles, cycles, unchanging).state.energy,
        rel=0.01,
    )


@pytest.mark.parametrize("kind", [ImplicitStepper, slow(SecondOrderStepper)])
def test_the_volume_has_an_error_of_its_own(kind) -> None:
    """Pressure does not correct the volume where slip grows with wear; the estimate shows it."""
    cycles, control = 6.0 * LIMIT, ErrorControl(0.02)
    reference = advance_in(SecondOrderStepper(), waved(), cycles, 12, evolving)
    state = advance_cycles(kind(control), waved(), cycles, cycles, evolving).state
    error = float((state.surfaces.depth - reference).sum())
    assert float(np.sum(state.errors)) == pytest.approx(error, rel=0.3)
    assert abs(error) < 0.02 * reference.sum()


# --- wear that comes to an end --------------------------------------------------------------------

HELD = Drive((True, False, False, True, True, False), np.array([[1e-3, 0, 0, 0, 0, 0]]))
"""A strip held where it was brought, until nothing presses: its rate falls by all decades."""


def held() -> WearingContact:
    loads = history(np.ones(1), np.zeros(1))
    sliding = SlidingCycle(loads, np.full((1, *GRID.shape), 0.02), drive=HELD)
    return WearingContact(CONTACT, LAWS, FRICTION, sliding, 1e-10)


def test_steps_grow_where_wear_slows_down() -> None:
    """Each factor of the cycles takes equally many steps, and the depth is right at any time."""
    contact, unworn = held(), WearState.unworn(GRID.x**2 / 2e4)
    first = contact.cycle(unworn, contact.dissipating)
    starts = {t: solved.start for t, solved in first.states.items()}
    limit = contact.stable_cycles(replace(unworn, starts=starts))
    rate = first.per_cycle(GRID.cell_area)[1]
    begun = replace(unworn, starts=starts, volume_rate=rate, next_cycles=4.0 * limit)
    taken = []
    for times in (1e2, 1e5, 1e8):
        cycles = times * limit
        stepper = ImplicitStepper(ErrorControl(0.01))
        end = advance_cycles(stepper, begun, cycles, cycles, lambda _: contact)
        taken.append(end.cost.steps)
        fixed = begun
        for jump in np.diff(np.r_[0.0, cycles * np.geomspace(1e-4, 1.0, 150)]):
            fixed = contact.implicit_step(fixed, float(jump)).state
        volumes = [state.surfaces.depth.sum() for state in (end.state, fixed)]
        assert volumes[0] == pytest.approx(volumes[1], rel=0.01)
    np.testing.assert_allclose(
        fixed.surfaces.depth, np.maximum(1e-3 - unworn.surfaces.gap, 0.0), atol=1e-6
    )
    assert np.diff(taken).max() < 30
    assert taken[0] < 100


def test_what_is_to_come_is_bounded_by_a_rate_that_falls() -> None:
    """A rate of r exp(-n d) gives at least 1 + 1/d steps, and no more than are left."""
    before, after = (replace(rounded(), volume_rate=rate) for rate in (1.0, np.exp(-0.25)))
    assert steps_to_come(before, after, 10.0, 1e6) == pytest.approx(5.0)
    assert steps_to_come(before, after, 10.0, 30.0) == 3.0
    assert steps_to_come(after, before, 10.0, 1e6) == 1e5
