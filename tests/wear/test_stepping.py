"""Cycle-jumped wear of one interface: conservation, stability, convergence.

A ball on a small grid under one or several loads, sliding as a whole unless said otherwise.
"""

import numpy as np
import pytest

from sa_solver.half_space import HalfSpace
from sa_solver.normal import NormalContact
from sa_solver.types import Array, ElasticPair, Grid, LoadHistory, Material
from wear.laws import Archard, Energy, EnergyAmplitude, WearLaw
from wear.stepping import ContactFailure, WearingContact
from wear.surfaces import Surfaces

GRID = Grid.covering((4.0, 4.0), (24, 24))
RADIUS, LOAD = 40.0, 2000.0
BODY = Material(12e4 * (1 - 0.3**2), 0.3)
PAIR = ElasticPair(BODY, BODY)
MODULUS = PAIR.contact_modulus  # 6e4 MPa
FRICTION, SLIP = 0.4, 0.02
TOLERANCE = 1e-9
BALL = (GRID.x**2 + GRID.y**2) / (2.0 * RADIUS)
EQUAL: tuple[WearLaw, WearLaw] = (Energy(1e-8), Energy(1e-8))


def loads(*normal: float) -> LoadHistory:
    """A cycle of centred normal loads."""
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
    return WearingContact(contact, laws, FRICTION, history, slip, TOLERANCE)


def step(own: WearingContact, kind: str, surfaces: Surfaces, cycles: float):
    return getattr(own, f"{kind}_step")(surfaces, {}, cycles)


def march(own: WearingContact, kind: str, cycles: float, jumps: int) -> Surfaces:
    """Surfaces after ``cycles`` in so many equal jumps."""
    surfaces = Surfaces.unworn(BALL)
    starts: dict = {}
    for _ in range(jumps):
        surfaces, result = getattr(own, f"{kind}_step")(surfaces, starts, cycles / jumps)
        starts = {t: state.start for t, state in result.states.items()}
    return surfaces


# --- conservation -------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["explicit", "implicit"])
def test_worn_volume_is_coefficient_times_energy(kind: str) -> None:
    """V = α E for each body by its own α, over a cycle of unequal loads and uneven slips."""
    laws = Energy(1e-8), Energy(3.7e-8)
    history = loads(500.0, 2000.0, 1200.0)
    slip = SLIP * np.random.default_rng(0).random((3, *GRID.shape))
    own, surfaces = wearing(laws, history, slip), Surfaces.unworn(BALL)
    energy, cycles = 0.0, 0.4 * wearing(laws).stable_cycles()
    for _ in range(4):
        surfaces, result = step(own, kind, surfaces, cycles)
        energy += result.energy.sum() * cycles
    for law, depth in zip(laws, (surfaces.depth_1, surfaces.depth_2), strict=True):
        assert depth.sum() * GRID.cell_area == pytest.approx(law.coefficient * energy, rel=1e-10)


@pytest.mark.parametrize("kind", ["explicit", "implicit"])
def test_energy_of_a_sliding_cycle_is_friction_times_load_times_slip(kind: str) -> None:
    history = loads(500.0, 0.0, 2000.0)
    _, result = step(wearing(history=history), kind, Surfaces.unworn(BALL), 100.0)
    np.testing.assert_allclose(result.energy, FRICTION * SLIP * history.P, rtol=1e-9)


@pytest.mark.parametrize("kind", ["explicit", "implicit"])
def test_mixed_laws_wear_each_body_by_its_own(kind: str) -> None:
    """Archard on body 1, energy on body 2; only their shares of the pressure differ."""
    laws = Archard(1e-4, 3500.0), Energy(1e-8)
    surfaces, result = step(wearing(laws), kind, Surfaces.unworn(BALL), 1000.0)
    share = 1e-4 / 3500.0 / (1e-8 * FRICTION)
    np.testing.assert_allclose(surfaces.depth_1, share * surfaces.depth_2, rtol=1e-12)
    volume = 1e-4 / 3500.0 * SLIP * LOAD * 1000.0
    assert surfaces.depth_1.sum() * GRID.cell_area == pytest.approx(volume, rel=1e-9)
    depth, both = result.per_cycle(GRID.cell_area)
    assert depth == pytest.approx(surfaces.depth_1.max() / 1000.0, rel=1e-12)
    assert both == pytest.approx(volume / 1000.0 * (1.0 + 1.0 / share), rel=1e-9)


def test_equal_bodies_wear_equally_and_surfaces_add_up() -> None:
    surfaces = march(wearing(), "implicit", 1e5, 3)
    np.testing.assert_array_equal(surfaces.depth_1, surfaces.depth_2)
    np.testing.assert_array_equal(surfaces.gap, BALL + surfaces.depth_1 + surfaces.depth_2)
    lower, upper = surfaces.heights
    np.testing.assert_allclose(upper - lower, surfaces.gap, rtol=1e-15)


def test_uniform_wear_of_both_bodies_changes_no_pressure() -> None:
    own, surfaces = wearing(), Surfaces.unworn(BALL)
    layer = np.full(GRID.shape, 0.01)
    before = own.solve(surfaces, 0, None)
    after = own.solve(surfaces.worn(layer, 2.0 * layer), 0, None)
    np.testing.assert_allclose(after.pressure, before.pressure, atol=1e-6 * before.pressure.max())
    assert after.approach - before.approach == pytest.approx(0.03, rel=1e-6)


def test_a_law_without_coefficient_wears_nothing() -> None:
    own = wearing((Energy(0.0), Energy(0.0)))
    for kind in ("explicit", "implicit"):
        surfaces, result = step(own, kind, Surfaces.unworn(BALL), 1e6)
        assert not surfaces.depth_1.any()
        assert result.energy.sum() > 0.0
    assert own.stable_cycles() == np.inf


# --- what a cycle consists of -------------------------------------------------------------------


def test_working_increments_end_with_the_heaviest() -> None:
    history = loads(100.0, 500.0, 300.0, 0.0, 200.0, 400.0)
    slip = np.full((6, *GRID.shape), SLIP)
    slip[5] = 0.0
    assert wearing(history=history, slip=slip).working == [2, 4, 0, 1]


@pytest.mark.parametrize("kind", ["explicit", "implicit"])
def test_a_stuck_cycle_wears_nothing(kind: str) -> None:
    own = wearing(slip=np.zeros((1, *GRID.shape)))
    surfaces, result = step(own, kind, Surfaces.unworn(BALL), 1e6)
    assert own.working == []
    assert not surfaces.depth_1.any()
    assert result.energy.sum() == 0.0
    assert own.stable_cycles() == np.inf


def test_unsolvable_contact_is_a_failure_that_names_its_increment() -> None:
    own = wearing()
    own._tolerance = 1e-300
    with pytest.raises(ContactFailure, match="increment 1: "):
        own.solve(Surfaces.unworn(BALL), 0, None)


# --- physics ------------------------------------------------------------------------------------


def test_wear_of_a_ball_flattens_the_peak_and_widens_the_contact() -> None:
    own = wearing()
    peaks, areas = [], []
    for jumps in range(6):
        cycles = jumps * own.stable_cycles()
        surfaces = march(own, "implicit", cycles, jumps) if jumps else Surfaces.unworn(BALL)
        pressure = own.solve(surfaces, 0, None).pressure
        assert pressure.sum() * GRID.cell_area == pytest.approx(LOAD, rel=1e-9)
        peaks.append(pressure.max())
        areas.append(np.count_nonzero(pressure))
    assert np.all(np.diff(peaks) < 0.0)
    assert np.all(np.diff(areas) >= 0)
    assert areas[-1] > areas[0]


# --- stability ----------------------------------------------------------------------------------


def roughness(surfaces: Surfaces) -> float:
    """Size of the shortest wavelength (signs alternating both ways) inside the contact [mm]."""
    signs = (-1.0) ** np.add.outer(np.arange(GRID.shape[0]), np.arange(GRID.shape[1]))
    rough = surfaces.gap - BALL
    for axis in (0, 1):  # a smooth surface has next to none of its second differences
        for _ in range(2):
            rough = np.diff(rough, 2, axis=axis) / 4.0
    inner = slice(7, -7)
    return float(np.abs(np.mean((rough * signs[2:-2, 2:-2])[inner, inner])))


def grown(kind: str, share: float, steps: int = 8) -> float:
    """Growth of a small roughness over steps of ``share`` of the stable jump."""
    signs = (-1.0) ** np.add.outer(np.arange(GRID.shape[0]), np.arange(GRID.shape[1]))
    own = wearing()
    surfaces = Surfaces(BALL, 1e-6 * signs, np.zeros(GRID.shape))
    cycles, before = share * own.stable_cycles(), roughness(surfaces)
    for _ in range(steps):
        surfaces, _ = step(own, kind, surfaces, cycles)
    return roughness(surfaces) / before


def test_explicit_steps_amplify_roughness_above_the_stable_jump_only() -> None:
    """Each step multiplies it by about 1 - 2 share."""
    assert grown("explicit", 0.8) < 0.1  # 0.6^8 = 0.02
    assert grown("explicit", 1.3) > 10.0  # 1.6^8 = 43


@pytest.mark.parametrize("share", [1.3, 20.0])
def test_implicit_steps_never_amplify_roughness(share: float) -> None:
    assert grown("implicit", share) < 0.1


def test_stable_jump_follows_its_formula() -> None:
    """κ s ΔN = 1.161 dx/E*, κ s of both bodies."""
    both = (1e-8 + 3e-8) * FRICTION * SLIP
    expected = 1.161 * (4.0 / 24) / MODULUS / both
    own = wearing((Energy(1e-8), Energy(3e-8)))
    assert own.stable_cycles() == pytest.approx(expected, rel=1e-12)


# --- convergence --------------------------------------------------------------------------------


@pytest.mark.parametrize("laws", [EQUAL, (EnergyAmplitude(4e-8, 0.02),) * 2])
def test_explicit_and_implicit_meet_at_first_order(laws: tuple[WearLaw, WearLaw]) -> None:
    """Their difference halves as jumps double, and both extrapolate to one depth."""
    own = wearing(laws, loads(1000.0, LOAD))
    cycles = 3.0 * own.stable_cycles()
    depth = {
        (kind, jumps): march(own, kind, cycles, jumps).depth_1
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
