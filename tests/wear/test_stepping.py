"""Wear steps of one interface: conservation, stability, convergence.

A ball on a small grid has one or several loads, and slides as a whole unless stated otherwise.
"""

from dataclasses import replace

import numpy as np
import pytest

from sa_solver.half_space.operator import HalfSpace
from sa_solver.load_history import LoadHistory
from sa_solver.normal.contact import NormalContact
from sa_solver.types import Array, ElasticPair, Grid, Material
from tests.marks import slow
from wear.laws import ArchardLaw, EnergyAmplitudeLaw, EnergyLaw, WearLaw
from wear.steps.stepping import ContactFailure, SlidingCycle, WearingContact, WearState, WearStep
from wear.surfaces import Surfaces

GRID = Grid.covering((4.0, 4.0), (24, 24))
RADIUS, LOAD = 40.0, 2000.0
BODY = Material(12e4 * (1 - 0.3**2), 0.3)
PAIR = ElasticPair(BODY, BODY)
FRICTION, SLIP = 0.4, 0.02
TOLERANCE = 1e-9
BALL = (GRID.x**2 + GRID.y**2) / (2.0 * RADIUS)
KINDS = "explicit", "implicit", "second_order"
EQUAL: tuple[WearLaw, WearLaw] = (EnergyLaw(1e-8), EnergyLaw(1e-8))


def loads(*normal: float) -> LoadHistory:
    """Return a cycle of centred normal loads."""
    zero = np.zeros(len(normal))
    columns = dict.fromkeys(("Qx", "Qy", "Mx", "My", "Mz", "Edx", "Edy"), zero)
    return LoadHistory(P=np.array(normal), **columns, sliding=zero.astype(bool))


def wearing(
    laws: tuple[WearLaw, WearLaw] = EQUAL,
    history: LoadHistory | None = None,
    slip: Array | None = None,
) -> WearingContact:
    history = loads(LOAD) if history is None else history
    slip = np.full((len(history), *GRID.shape), SLIP) if slip is None else slip
    contact = NormalContact(HalfSpace(GRID, PAIR))
    return WearingContact(contact, laws, FRICTION, SlidingCycle(history, slip), TOLERANCE)


def unworn(gap: Array = BALL) -> WearState:
    return WearState.unworn(gap)


def step(contact: WearingContact, kind: str, state: WearState, cycles: float) -> WearStep:
    return getattr(contact, f"{kind}_step")(state, cycles)


def march(contact: WearingContact, kind: str, cycles: float, jumps: int) -> WearState:
    """Return the state after ``cycles`` in equal jumps."""
    state = unworn()
    for _ in range(jumps):
        state = step(contact, kind, state, cycles / jumps).state
    return state


# --- conservation -------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_worn_volume_is_coefficient_times_energy(kind: str) -> None:
    """V = α E holds for each body with its own α, over unequal loads and uneven slips."""
    laws = EnergyLaw(1e-8), EnergyLaw(3.7e-8)
    history = loads(500.0, 2000.0, 1200.0)
    slip = SLIP * np.random.default_rng(0).random((3, *GRID.shape))
    contact, state = wearing(laws, history, slip), unworn()
    cycles = 0.4 * contact.stable_cycles(state)
    for _ in range(4):
        before, state = state, step(contact, kind, state, cycles).state
        for name in ("depth_1", "depth_2"):
            assert np.all(getattr(state.surfaces, name) >= getattr(before.surfaces, name))
    surfaces = state.surfaces
    for law, depth in zip(laws, (surfaces.depth_1, surfaces.depth_2), strict=True):
        volume = depth.sum() * GRID.cell_area
        assert volume == pytest.approx(law.coefficient * state.energy, rel=1e-10)
    for depth, work, law in (
        (surfaces.depth_1, surfaces.work_1, laws[0]),
        (surfaces.depth_2, surfaces.work_2, laws[1]),
    ):
        np.testing.assert_allclose(depth, law.coefficient * work, rtol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_energy_of_a_sliding_cycle_is_friction_times_load_times_slip(kind: str) -> None:
    history = loads(500.0, 0.0, 2000.0)
    state = step(wearing(history=history), kind, unworn(), 100.0).state
    assert state.energy == pytest.approx(FRICTION * SLIP * history.P.sum() * 100.0, rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_mixed_laws_wear_each_body_by_its_own(kind: str) -> None:
    """With Archard's law on body 1 and the energy law on body 2, only their shares differ."""
    laws = ArchardLaw(1e-4, 3500.0), EnergyLaw(1e-8)
    state = step(wearing(laws), kind, unworn(), 1000.0).state
    surfaces, share = state.surfaces, 1e-4 / 3500.0 / (1e-8 * FRICTION)
    np.testing.assert_allclose(surfaces.depth_1, share * surfaces.depth_2, rtol=1e-12)
    volume = 1e-4 / 3500.0 * SLIP * LOAD * 1000.0
    assert surfaces.depth_1.sum() * GRID.cell_area == pytest.approx(volume, rel=1e-9)
    assert state.depth_rate == pytest.approx(surfaces.depth_1.max() / 1000.0, rel=1e-12)
    assert state.volume_rate == pytest.approx(volume / 1000.0 * (1.0 + 1.0 / share), rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_an_increment_that_happens_twice_wears_as_two(kind: str) -> None:
    """A share of 2 is the same increment twice; only the order of the parts of a step differs."""
    once = loads(LOAD)
    twice = wearing(history=replace(once, share=np.array([2.0]), block=once.block))
    state = step(twice, kind, unworn(), 500.0).state
    np.testing.assert_allclose(
        state.surfaces.depth_1,
        step(wearing(), kind, unworn(), 1000.0).state.surfaces.depth_1,
        rtol=1e-12,
    )
    assert state.energy == pytest.approx(FRICTION * SLIP * LOAD * 1000.0, rel=1e-9)


def test_equal_bodies_wear_equally_and_surfaces_add_up() -> None:
    surfaces = march(wearing(), "implicit", 1e5, 3).surfaces
    np.testing.assert_array_equal(surfaces.depth_1, surfaces.depth_2)
    np.testing.assert_array_equal(surfaces.gap, BALL + surfaces.depth_1 + surfaces.depth_2)
    lower, upper = surfaces.heights
    np.testing.assert_allclose(upper - lower, surfaces.gap, rtol=1e-15)


def test_uniform_wear_of_both_bodies_changes_no_pressure() -> None:
    contact, surfaces = wearing(), Surfaces.unworn(BALL)
    layer = np.full(GRID.shape, 0.01)
    before = contact.solve(surfaces, 0, None)
    after = contact.solve(surfaces.worn(layer, 2.0 * layer), 0, None)
    np.testing.assert_allclose(after.pressure, before.pressure, atol=1e-6 * before.pressure.max())
    assert after.approach - before.approach == pytest.approx(0.03, rel=1e-6)


def test_a_law_without_coefficient_wears_nothing() -> None:
    contact = wearing((EnergyLaw(0.0), EnergyLaw(0.0)))
    for kind in KINDS:
        state = step(contact, kind, unworn(), 1e6).state
        assert not state.surfaces.depth.any()
        assert state.energy > 0.0
    assert contact.stable_cycles(unworn()) == np.inf


# --- what a cycle consists of -------------------------------------------------------------------


def test_working_increments_end_with_the_heaviest() -> None:
    history = loads(100.0, 500.0, 300.0, 0.0, 200.0, 400.0)
    slip = np.full((6, *GRID.shape), SLIP)
    slip[5] = 0.0
    assert wearing(history=history, slip=slip).dissipating == [2, 4, 0, 1]


@pytest.mark.parametrize("off", [-1e-9, 1e-9])
def test_of_loads_that_are_held_the_first_is_the_heaviest(off: float) -> None:
    """The first of equal loads counts as the largest, whatever the structure's residuals."""
    history = loads(100.0, 500.0, 500.0 * (1.0 + off), 300.0)
    slip = np.full((4, *GRID.shape), SLIP)
    assert wearing(history=history, slip=slip).dissipating == [2, 3, 0, 1]


@pytest.mark.parametrize("kind", KINDS)
def test_a_stuck_cycle_wears_nothing(kind: str) -> None:
    contact = wearing(slip=np.zeros((1, *GRID.shape)))
    state = step(contact, kind, unworn(), 1e6).state
    assert contact.dissipating == []
    assert not state.surfaces.depth.any()
    assert state.energy == 0.0
    assert contact.stable_cycles(state) == np.inf


def test_unsolvable_contact_is_a_failure_that_names_its_increment() -> None:
    contact = replace(wearing(), tolerance=1e-300)
    with pytest.raises(ContactFailure, match="increment 1: "):
        contact.solve(Surfaces.unworn(BALL), 0, None)


# --- physics ------------------------------------------------------------------------------------


def test_wear_of_a_ball_flattens_the_peak_and_widens_the_contact() -> None:
    contact = wearing()
    limit = contact.stable_cycles(unworn())
    peaks, areas = [], []
    for jumps in range(6):
        state = march(contact, "implicit", jumps * limit, jumps) if jumps else unworn()
        pressure = contact.solve(state.surfaces, 0, None).pressure
        assert pressure.sum() * GRID.cell_area == pytest.approx(LOAD, rel=1e-9)
        peaks.append(pressure.max())
        areas.append(np.count_nonzero(pressure))
    assert np.all(np.diff(peaks) < 0.0)
    assert np.all(np.diff(areas) >= 0)
    assert areas[-1] > areas[0]


@pytest.mark.parametrize("kind", ["implicit", "second_order"])
def test_nothing_wears_where_nothing_slips(kind: str) -> None:
    """A stick zone in the middle keeps its surface to the last bit, and takes over the load."""
    slip = np.where(GRID.x**2 + GRID.y**2 < 0.2**2, 0.0, SLIP)[None]
    contact = wearing(slip=slip)
    state = march(contact, kind, 100.0 * contact.stable_cycles(unworn()), 4)
    assert not state.surfaces.depth[slip[0] == 0.0].any()
    before, after = (
        contact.solve(surfaces, 0, None).pressure[slip[0] == 0.0].sum()
        for surfaces in (Surfaces.unworn(BALL), state.surfaces)
    )
    assert after > 1.5 * before


# --- convergence --------------------------------------------------------------------------------


@pytest.mark.parametrize("laws", [EQUAL, slow((EnergyAmplitudeLaw(4e-8, 0.02),) * 2)])
def test_explicit_and_implicit_meet_at_first_order(laws: tuple[WearLaw, WearLaw]) -> None:
    """Their difference is proportional to the jumps, and both extrapolate to one depth."""
    contact = wearing(laws, loads(1000.0, LOAD))
    cycles = 3.0 * contact.stable_cycles(unworn())
    depth = {
        (kind, jumps): march(contact, kind, cycles, jumps).surfaces.depth_1
        for kind in ("explicit", "implicit")
        for jumps in (8, 16, 32)
    }
    deepest = depth["implicit", 32].max()
    apart = [
        np.abs(depth["explicit", n] - depth["implicit", n]).mean() / deepest for n in (8, 16, 32)
    ]
    rates = np.log2(np.array(apart[:-1]) / apart[1:])
    assert np.all(rates > 0.8), (apart, rates)
    explicit, implicit = (
        (2.0 * depth[kind, 32] - depth[kind, 16]).max() for kind in ("explicit", "implicit")
    )
    assert explicit == pytest.approx(implicit, rel=0.01)
