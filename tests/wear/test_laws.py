"""Wear laws against values calculated by hand, in the units that users think in."""

from dataclasses import replace

import numpy as np
import pytest

from sa_solver.errors import InputError
from sa_solver.load_history import LoadHistory
from sa_solver.types import Array, ElasticPair, Grid, Material
from wear.contact.face_loads import CycleLoads
from wear.contact.interface import InterfaceContact
from wear.contact.settings import InterfaceSettings
from wear.contact.transfer import CellNodes
from wear.cracking.life import findley, ruiz
from wear.evolution import EnergyTable
from wear.kinetics import linear_regime
from wear.laws import ArchardLaw, EnergyAmplitudeLaw, EnergyLaw, EvolvingLaw, SlidingConditions
from wear.schedule import CoupledSettings, JumpSize, Stop
from wear.steps.implicit import ImplicitStepper
from wear.steps.step_errors import ErrorControl

UM3_PER_J = 1e-12  # [1/MPa]: 1e-9 mm³ per 1e3 N mm
FRICTION = 0.4


def sliding(slip: Array, friction: float = FRICTION) -> SlidingConditions:
    """Return slip on surfaces that stay new."""
    unworn = np.zeros(slip.shape[1:])
    return SlidingConditions(slip, friction, (unworn, unworn), (0.0, 0.0))


def test_energy_law_by_hand() -> None:
    """200 MPa at µ = 0.4 over 50 µm are 4 mJ/mm²; 1e4 µm³/J give 0.04 nm."""
    slip = np.full((1, 1, 1), 0.05)
    depth = EnergyLaw(1e4 * UM3_PER_J).depth_per_pressure(sliding(slip)) * 200.0
    assert depth.item() == pytest.approx(4e-8, rel=1e-12)


def test_archard_law_by_hand() -> None:
    """V = K s P / H is 1e-4 x 0.05 mm x 200 MPa / 3500 MPa, whatever the friction."""
    slip = np.full((1, 1, 1), 0.05)
    law = ArchardLaw(coefficient=1e-4, hardness=3500.0)
    for friction in (0.0, FRICTION):
        depth = law.depth_per_pressure(sliding(slip, friction)) * 200.0
        assert depth.item() == pytest.approx(1e-4 * 0.05 * 200.0 / 3500.0, rel=1e-12)


def test_archard_is_the_energy_law_with_its_coefficient_over_hardness_and_friction() -> None:
    slip = np.random.default_rng(1).random((5, 3, 4))
    archard = ArchardLaw(1e-4, 3500.0).depth_per_pressure(sliding(slip))
    energy = EnergyLaw(1e-4 / 3500.0 / FRICTION).depth_per_pressure(sliding(slip))
    np.testing.assert_allclose(archard, energy, rtol=1e-13)


def test_case_units_reach_the_law(dovetail_path) -> None:
    from workflow.kinds import load_case

    for text, value in (("1 um^3/J", 1e-12), ("1e4 um^3/J", 1e-8), ("1e-8", 1e-8)):
        case = load_case(dovetail_path, [f"wear.blade.coefficient={text}"])
        assert case.wear.blade.coefficient == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize("increments", [1, 7])
def test_amplitude_law_is_the_energy_law_at_its_reference(increments: int) -> None:
    """One cycle slides four amplitudes, however many increments it has."""
    reference = 0.075
    slip = np.random.default_rng(2).random((increments, 3, 4))
    slip *= 4.0 * reference / slip.sum(axis=0)
    amplitude = EnergyAmplitudeLaw(1e-8, reference).depth_per_pressure(sliding(slip))
    energy = EnergyLaw(1e-8).depth_per_pressure(sliding(slip))
    np.testing.assert_allclose(amplitude, energy, rtol=1e-13)


def test_amplitude_law_is_quadratic_in_slip() -> None:
    slip = np.random.default_rng(3).random((5, 3, 4))
    law = EnergyAmplitudeLaw(1e-8, 0.075)
    once, thrice = (law.depth_per_pressure(sliding(scale * slip)) for scale in (1.0, 3.0))
    np.testing.assert_allclose(thrice, 9.0 * once, rtol=1e-13)


def test_amplitude_law_by_hand() -> None:
    """The depth is α / (4 δ_ref) (Σ|Δs|) (Σ|q·Δs|), with another pressure in every increment."""
    slip, pressure = np.array([0.01, 0.0, 0.03]), np.array([100.0, 300.0, 200.0])
    law = EnergyAmplitudeLaw(1e-8, 0.075)
    depth = law.depth_per_pressure(sliding(slip[:, None, None])).ravel() @ pressure
    dissipated = FRICTION * (100.0 * 0.01 + 200.0 * 0.03)
    assert depth == pytest.approx(1e-8 / (4.0 * 0.075) * 0.04 * dissipated, rel=1e-12)


@pytest.mark.parametrize(
    "law", [ArchardLaw(1e-4, 3500.0), EnergyLaw(1e-8), EnergyAmplitudeLaw(1e-8, 0.075)]
)
def test_no_slip_no_wear(law) -> None:
    slip = np.zeros((4, 2, 2))
    slip[1, 0, 0] = 0.01
    depth = law.depth_per_pressure(sliding(slip))
    assert np.all((depth > 0.0) == (slip > 0.0))


# --- coefficients that change with energy ---------------------------------------------------------

TABLE = EnergyTable((10.0, 30.0, 40.0), (1.0, 3.0, 0.5))


def quadrature(table: EnergyTable, before: float, after: float) -> float:
    """Return the mean by Gauss points between the kinks, where the table is a straight line."""
    kinks = [e for e in (*table.energy, table.threshold) if before < e < after]
    ends = np.array([before, *sorted(kinks), after])
    points = ends[:-1, None] + np.diff(ends)[:, None] * (0.5 + np.array([-0.5, 0.5]) / np.sqrt(3.0))
    integral = table.at(points).mean(axis=1) @ np.diff(ends)
    return float(integral / (after - before))


@pytest.mark.parametrize("threshold", [0.0, 5.0, 25.0, 60.0])
@pytest.mark.parametrize("ends", [(0, 5), (2, 18), (12, 14), (0, 100), (35, 45), (50, 70)])
def test_mean_of_a_table_is_its_integral(ends: tuple[float, float], threshold: float) -> None:
    table = replace(TABLE, threshold=threshold)
    mean = float(table.mean(*ends))
    assert mean == pytest.approx(quadrature(table, *ends), rel=1e-13, abs=1e-15)


def test_table_by_hand() -> None:
    """The table is constant before 10 and after 40, and linear between."""
    np.testing.assert_allclose(
        TABLE.at(np.array([0.0, 10.0, 20.0, 30.0, 35.0, 99.0])), [1.0, 1.0, 2.0, 3.0, 1.75, 0.5]
    )
    assert float(TABLE.mean(0.0, 20.0)) == pytest.approx((10.0 + 15.0) / 20.0, rel=1e-14)
    with_threshold = replace(TABLE, threshold=20.0)
    assert float(with_threshold.mean(0.0, 30.0)) == pytest.approx(25.0 / 30.0, rel=1e-14)
    assert with_threshold.at(np.array([19.9, 20.0])).tolist() == [0.0, 2.0]


def test_steps_of_any_length_add_up() -> None:
    """Means are exact: wear does not depend on how a step is divided, however finely."""
    table = replace(TABLE, threshold=7.0)
    cuts = np.sort(np.random.default_rng(5).uniform(0.0, 60.0, 200))
    cuts = np.concatenate([[0.0], cuts, [60.0]])
    parts = float(np.sum(table.mean(cuts[:-1], cuts[1:]) * np.diff(cuts)))
    assert parts == pytest.approx(float(table.mean(0.0, 60.0)) * 60.0, rel=1e-13)


@pytest.mark.parametrize("step", [0.0, 1e-12, 1e-6])
def test_mean_of_a_short_step_is_the_value(step: float) -> None:
    """The mean keeps its digits far from 0, where a difference of integrals would lose them all."""
    table = EnergyTable((0.0, 2e9), (1.0, 3.0))
    assert float(table.mean(1e9, 1e9 + step)) == pytest.approx(2.0, rel=1e-12)


@pytest.mark.parametrize(
    ("energy", "factor"), [((), ()), ((1.0,), (1.0, 2.0)), ((1.0, 1.0), (1.0, 2.0))]
)
def test_tables_that_are_none(energy: tuple[float, ...], factor: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="give"):
        EnergyTable(energy, factor)


def random_step(seed: int) -> SlidingConditions:
    """Return energies that pass all kinks of the table somewhere."""
    rng = np.random.default_rng(seed)
    before = rng.uniform(0.0, 50.0, (3, 4))
    work = before, before + rng.uniform(0.0, 20.0, (3, 4))
    return SlidingConditions(rng.random((5, 3, 4)), FRICTION, work, (20.0, 35.0))


@pytest.mark.parametrize(
    "base", [ArchardLaw(1e-4, 3500.0), EnergyLaw(1e-8), EnergyAmplitudeLaw(1e-8, 0.1)]
)
def test_evolving_law_is_its_base_times_the_mean_factor(base) -> None:
    step = random_step(6)
    plain = base.depth_per_pressure(step)
    local = EvolvingLaw(base, TABLE, "local").depth_per_pressure(step) / plain
    means = TABLE.mean(*step.work)
    np.testing.assert_allclose(local, np.broadcast_to(means, local.shape), rtol=1e-13)
    whole = EvolvingLaw(base, TABLE, "global").depth_per_pressure(step) / plain
    np.testing.assert_allclose(whole, float(TABLE.mean(20.0, 35.0)), rtol=1e-13)


def test_laws_may_be_nested() -> None:
    """A local factor can multiply a global one."""
    step, base = random_step(7), EnergyLaw(1e-8)
    both = EvolvingLaw(EvolvingLaw(base, TABLE, "local"), TABLE, "global").depth_per_pressure(step)
    once = EvolvingLaw(base, TABLE, "local").depth_per_pressure(step)
    np.testing.assert_allclose(both, float(TABLE.mean(20.0, 35.0)) * once, rtol=1e-13)


def test_nothing_wears_below_the_threshold() -> None:
    """V = α (ΣEd - Ed_th) holds, per area and at each point if the threshold is local."""
    step = random_step(8)
    law = EvolvingLaw(EnergyLaw(1e-8), EnergyTable(threshold=30.0), "local")
    pressure = (step.work[1] - step.work[0]) / (FRICTION * step.slip.sum(axis=0))
    depth = (law.depth_per_pressure(step) * pressure).sum(axis=0)
    beyond = np.maximum(step.work[1], 30.0) - np.maximum(step.work[0], 30.0)
    np.testing.assert_allclose(depth, 1e-8 * beyond, rtol=1e-12, atol=1e-22)


STILL, ONE = np.zeros(1), np.full(1, 50.0)
CYCLE = LoadHistory(ONE, *[STILL] * 7, sliding=[True])
HOLES = np.ma.array(np.ones((1, 2, 4)), mask=False)
HOLES[0, 0, 1] = np.ma.masked


@pytest.mark.parametrize(
    "attempt",
    [
        lambda: ArchardLaw(1e-4, 0.0),
        lambda: ArchardLaw(-1e-4, 3000.0),
        lambda: EnergyLaw(np.nan),
        lambda: EnergyAmplitudeLaw(1e-8, 0.0),
        lambda: EvolvingLaw(EnergyLaw(1e-8), EnergyTable(), scope="here"),
        lambda: EnergyTable((0.0, np.nan), (1.0, 1.0)),
        lambda: EnergyTable(np.ma.array([0.0, 1.0], mask=[0, 1]), (1.0, 1.0)),
        lambda: ErrorControl(relative=-0.1),
        lambda: JumpSize(cycles=0.0),
        lambda: Stop(depth=np.nan),
        lambda: CoupledSettings(cycles=-1.0),
        lambda: CycleLoads(CYCLE, HOLES),
        lambda: CycleLoads(CYCLE, np.ones((2, 1, 4))),
        lambda: CycleLoads(CYCLE, np.ones((1, 2, 4)), force=np.ones((1, 3, 5))),
        lambda: linear_regime(np.arange(9.0), np.arange(8.0)),
        lambda: linear_regime(np.arange(9.0), np.ma.array(np.arange(9.0), mask=np.arange(9) > 5)),
        lambda: linear_regime(np.arange(9.0)[::-1], np.arange(9.0)),
        lambda: findley(np.ma.array(np.ones((3, 6)), mask=np.eye(3, 6)), 0.3),
        lambda: ruiz(np.ones((2, 6, 3)), np.ones(4)),
    ],
)
def test_what_has_no_meaning_is_refused(attempt) -> None:
    with pytest.raises(InputError):
        attempt()


def test_a_gap_may_be_a_list_and_have_holes() -> None:
    """A cylinder with a slot in its middle loses α µ P s per cycle, and nothing in the slot."""
    grid, steel = Grid.line_contact(1.4, 70), Material(210e3, 0.3)
    gap, slot = grid.x**2 / 20.0, np.abs(grid.x) < 0.05
    slip = np.zeros((1, 2, 70))
    slip[:, 0] = 0.04
    volumes = []
    for height in (np.ma.array(gap, mask=slot), gap.tolist()):
        contact = InterfaceContact(
            InterfaceSettings(
                name="cylinder",
                grid=grid,
                gap=height,
                transfer=CellNodes(grid),
                pair=ElasticPair(steel, steel),
                laws=(EnergyLaw(5e-9), EnergyLaw(5e-9)),
                friction=lambda energy: 0.5,
                stepper=ImplicitStepper(),
            )
        )
        state, _ = contact.begin(CycleLoads(CYCLE, slip.tolist()), cycles=1e5)
        state, _ = contact.jump(state, 2e4, 1e5)
        assert state.surfaces.depth[slot].any() == isinstance(height, list)
        volumes.append(contact.volume(state.surfaces.depth))
    assert volumes == pytest.approx([1e-8 * 0.5 * 50.0 * 0.04 * 2e4] * 2, rel=1e-9)
