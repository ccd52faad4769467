"""Mixes of closed cycles, each with its share, that wear as one cycle."""

from dataclasses import replace

import numpy as np
import pytest

from sa_solver.contact import FrictionalContact
from sa_solver.half_space.operator import HalfSpace
from sa_solver.load_history import LoadHistory
from sa_solver.normal.contact import NormalContact
from sa_solver.types import Array, ElasticPair, Grid, Material
from tests.marks import slow
from wear.evolution import EnergyTable
from wear.laws import EnergyAmplitudeLaw, EnergyLaw, EvolvingLaw, WearLaw
from wear.steps.full_cycle import march_cycle
from wear.steps.stepping import SlidingCycle, WearingContact, WearState

GRID = Grid.covering((4.0, 4.0), (16, 16))
BODY = Material(12e4 * (1 - 0.3**2), 0.3)
HALF_SPACE = HalfSpace(GRID, ElasticPair(BODY, BODY))
BALL = (GRID.x**2 + GRID.y**2) / 80.0
FRICTION = 0.4
ALPHA = 1e-8
LAWS: tuple[WearLaw, WearLaw] = (EnergyLaw(ALPHA), EnergyLaw(3.0 * ALPHA))
KINDS = "explicit", "implicit", "second_order"


def cycle(*normal: float, slip: float = 0.02) -> tuple[LoadHistory, Array]:
    """Return a cycle of centred loads, with a slip that grows along x."""
    zero = np.zeros(len(normal))
    columns = dict.fromkeys(("Qx", "Qy", "Mx", "My", "Mz", "Edx", "Edy"), zero)
    history = LoadHistory(P=np.array(normal), **columns, sliding=zero.astype(bool))
    sizes = slip * (1.0 + 0.2 * GRID.x) * np.ones(GRID.shape)
    return history, np.broadcast_to(sizes, (len(normal), *GRID.shape))


HEAVY, LIGHT = cycle(500.0, 2000.0, 1200.0), cycle(900.0, 300.0, slip=0.05)
MIDDLE = cycle(1500.0, 700.0, slip=0.01)


def wearing(
    *blocks: tuple[LoadHistory, Array],
    shares: tuple[float, ...] = (1.0,),
    laws: tuple[WearLaw, WearLaw] = LAWS,
) -> WearingContact:
    loads = LoadHistory.mix([loads for loads, _ in blocks], shares)
    slip = np.concatenate([slip for _, slip in blocks])
    contact = NormalContact(HALF_SPACE)
    return WearingContact(contact, laws, FRICTION, SlidingCycle(loads, slip), 1e-12)


def march(contact: WearingContact, kind: str, cycles: float, steps: int = 1) -> WearState:
    state = WearState.unworn(BALL)
    for _ in range(steps):
        state = getattr(contact, f"{kind}_step")(state, cycles / steps).state
    return state


def limit(contact: WearingContact) -> float:
    """Return the longest stable explicit step."""
    return contact.stable_cycles(WearState.unworn(BALL))


def assert_same(one: WearState, two: WearState, tolerance: float) -> None:
    for name in ("depth_1", "depth_2", "work_1", "work_2"):
        a, b = getattr(one.surfaces, name), getattr(two.surfaces, name)
        np.testing.assert_allclose(a, b, rtol=0.0, atol=tolerance * b.max(), err_msg=name)
    assert one.energy == pytest.approx(two.energy, rel=tolerance)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.5, 1.0])
def test_equal_cycles_wear_as_the_one(share: float) -> None:
    """In explicit steps, where all increments see the same surfaces, they agree to rounding."""
    single = wearing(HEAVY)
    mixed = wearing(HEAVY, HEAVY, shares=(share, 1.0 - share))
    cycles = 2.0 * limit(single)
    assert limit(mixed) == pytest.approx(limit(single), rel=1e-12)
    assert_same(march(mixed, "explicit", cycles, 4), march(single, "explicit", cycles, 4), 1e-12)


@pytest.mark.parametrize(("kind", "order"), [("implicit", 1), slow("second_order", 2)])
def test_equal_cycles_wear_as_the_one_to_the_order_of_the_step(kind: str, order: int) -> None:
    single, mixed = wearing(HEAVY), wearing(HEAVY, HEAVY, shares=(0.6, 0.4))
    cycles = 2.0 * limit(single)
    change = [
        np.abs(
            march(mixed, kind, cycles, steps).surfaces.depth
            - march(single, kind, cycles, steps).surfaces.depth
        ).sum()
        for steps in (4, 8)
    ]
    assert np.log2(change[0] / change[1]) > order - 0.35


@pytest.mark.parametrize("kind", KINDS)
def test_a_cycle_that_never_happens_changes_nothing(kind: str) -> None:
    single, mixed = wearing(HEAVY), wearing(HEAVY, LIGHT, shares=(1.0, 0.0))
    cycles = limit(single)
    assert_same(march(mixed, kind, cycles, 3), march(single, kind, cycles, 3), 1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_worn_volume_is_coefficient_times_mean_energy(kind: str) -> None:
    """The energy of a sliding cycle is known: µ Σ share P slip, here by its mean slip."""
    mixed = wearing(HEAVY, LIGHT, shares=(0.7, 0.3))
    cycles = 0.5 * limit(mixed)
    state = march(mixed, kind, cycles, 2)
    for law, depth in zip(LAWS, (state.surfaces.depth_1, state.surfaces.depth_2), strict=True):
        assert depth.sum() * GRID.cell_area == pytest.approx(
            law.coefficient * state.energy, rel=1e-12
        )
    # Loads are centred: a slip linear in x dissipates as much as its value in the middle, apart
    # from the asymmetry of the worn shape.
    mean = FRICTION * (0.7 * 0.02 * HEAVY[0].P.sum() + 0.3 * 0.05 * LIGHT[0].P.sum())
    assert state.energy == pytest.approx(mean * cycles, rel=1e-3)


def test_depth_is_the_mean_of_the_cycles_by_their_shares() -> None:
    """The step is a single explicit one, with laws linear and nonlinear in the slip."""
    for law in (EnergyLaw(ALPHA), EnergyAmplitudeLaw(ALPHA, 0.03)):
        laws = law, law
        parts = [wearing(block, laws=laws) for block in (HEAVY, LIGHT)]
        mixed = wearing(HEAVY, LIGHT, shares=(0.7, 0.3), laws=laws)
        alone = [march(contact, "explicit", 1000.0).surfaces.depth_1 for contact in parts]
        depth = march(mixed, "explicit", 1000.0).surfaces.depth_1
        np.testing.assert_allclose(depth, 0.7 * alone[0] + 0.3 * alone[1], rtol=1e-12, atol=1e-18)


@pytest.mark.slow
def test_order_of_cycles_matters_to_first_order_in_the_step() -> None:
    """Swapping two of three cycles makes a difference that halves with the steps."""
    shares = (0.3, 0.5, 0.2)
    one = wearing(LIGHT, MIDDLE, HEAVY, shares=shares)
    two = wearing(MIDDLE, LIGHT, HEAVY, shares=(0.5, 0.3, 0.2))
    cycles = 2.0 * limit(one)
    change = []
    for steps in (4, 8, 16):
        depths = [
            march(contact, "implicit", cycles, steps).surfaces.depth for contact in (one, two)
        ]
        change.append(np.abs(depths[0] - depths[1]).sum() / depths[1].sum())
    rates = np.log2(np.array(change[:-1]) / change[1:])
    assert np.all(rates > 0.8), rates
    assert change[-1] < 2e-2


def test_evolving_coefficients_follow_the_energy_of_the_mix() -> None:
    """Explicit steps from known pressures wear ∫ factor dE exactly, whatever the mix."""
    table = EnergyTable((0.0, 1e4, 3e4), (1.0, 2.0, 0.5), threshold=2e3)
    laws = (
        EvolvingLaw(EnergyLaw(ALPHA), table, "global"),
        EvolvingLaw(EnergyLaw(ALPHA), table, "global"),
    )
    mixed = wearing(HEAVY, LIGHT, shares=(0.7, 0.3), laws=laws)
    state = WearState.unworn(BALL)
    starts = {t: solved.start for t, solved in mixed.cycle(state, mixed.dissipating).states.items()}
    after = mixed.explicit_step(replace(state, starts=starts), 1500.0).state
    volume = after.surfaces.depth_1.sum() * GRID.cell_area
    assert after.energy > 3e4
    expected = ALPHA * float(table.mean(0.0, after.energy)) * after.energy
    assert volume == pytest.approx(expected, rel=1e-12)


# --- the half-space's own friction --------------------------------------------------------------


def sheared(scale: float, last: float) -> LoadHistory:
    """Return a cycle in partial slip that ends with the load ``last``."""
    P = scale * np.array([500.0, 1000.0, 1000.0, 1000.0, last])
    zero = np.zeros(len(P))
    Qx = 0.2 * P * np.array([1.0, 1.0, -1.0, 1.0, 0.0])
    return LoadHistory(P, Qx, zero, zero, zero, zero, zero, zero, zero.astype(bool))


@pytest.mark.parametrize("last", [0.0, 300.0], ids=["ends apart", "ends loaded"])
def test_each_cycle_of_a_mix_is_closed_by_itself(last: float) -> None:
    contact = FrictionalContact(HALF_SPACE, FRICTION, 1e-8)
    cycles = [sheared(1.0, last), sheared(0.6, last), sheared(1.0, last)]
    mixed = march_cycle(contact, BALL, LoadHistory.mix(cycles, (0.5, 0.3, 0.2)))
    alone = [state for history in cycles for state in march_cycle(contact, BALL, history)]
    assert len(mixed) == len(alone) == 15
    for one, two in zip(mixed, alone, strict=True):
        np.testing.assert_array_equal(one.shear, two.shear)
        np.testing.assert_array_equal(one.slip, two.slip)


# --- the history itself -------------------------------------------------------------------------


def test_a_history_is_one_cycle_unless_mixed() -> None:
    plain, other = HEAVY[0], LIGHT[0]
    assert plain.missions == [slice(0, 3)]
    assert not plain.mixed
    mixed = LoadHistory.mix([plain, other], (0.25, 0.75))
    assert mixed.mixed
    assert mixed.missions == [slice(0, 3), slice(3, 5)]
    assert mixed.share.tolist() == [0.25] * 3 + [0.75] * 2


def test_mean_energy_is_by_shares() -> None:
    cost = [replace(loads, Edx=loads.P, Edy=0.5 * loads.P) for loads in (HEAVY[0], LIGHT[0])]
    mixed = LoadHistory.mix(cost, (0.25, 0.75))
    expected = 0.25 * cost[0].mean_energy + 0.75 * cost[1].mean_energy
    assert mixed.mean_energy == pytest.approx(expected, rel=1e-14)
    assert cost[0].mean_energy == pytest.approx(1.5 * cost[0].P.sum(), rel=1e-14)
