"""Wear of nodes: laws by hand, and steppers on equations with known solutions.

Nodes of area A on springs k, pushed together by δ, have p = (k/A) (δ - h) at the worn depth h, with
a slip s per cycle. The depth tends to δ as exp(-N/N0), N0 = A/(k α µ s), each node for itself.
"""

import re
from dataclasses import dataclass

import numpy as np
import pytest

from sa_solver.types import Array
from wear.contact.nodes import NodalContact, NodalState
from wear.evolution import EnergyTable
from wear.laws import ArchardLaw, EnergyAmplitudeLaw, EnergyLaw, EvolvingLaw
from wear.steps.marching import SubcyclingStepper, advance_cycles, rest
from wear.steps.step_errors import step_errors
from wear.steps.steppers import ExplicitStepper, HeunStepper, StabilityError

FRICTION = 0.5
AREAS = np.array([0.1, 0.2, 0.4])
SLIP = np.array([0.02, 0.01, 0.03])
STIFFNESS, PUSH = 1e3, np.array([1e-3, 2e-3, 3e-3])


@dataclass(frozen=True)
class Cycle:
    """A cycle with given fields."""

    slip: Array
    pressure: Array
    friction: float = FRICTION
    start: object = "start"

    @property
    def areas(self) -> Array:
        return AREAS

    def stable_cycles(self, depth_per_pressure: Array) -> float:
        """Return the limit of springs: an error of the depth is multiplied by 1 - (k/A) w ΔN."""
        fastest = float((STIFFNESS / AREAS * depth_per_pressure).max())
        return 2.0 / fastest if fastest > 0.0 else np.inf


LAWS = EnergyLaw(4e-8), EnergyLaw(1e-8)
# Cycles in which the remaining depth falls to 1/e.
SCALES = AREAS / (STIFFNESS * 5e-8 * FRICTION * SLIP)


def springs(state: NodalState, laws=LAWS) -> NodalContact:
    """Return the nodes on springs at the present depth."""
    pressure = STIFFNESS / AREAS * (PUSH - state.surfaces.depth)
    # Half of the slip is forward, half of it backward.
    halves = np.array([0.5, 0.5])[:, None]
    return NodalContact(laws, (Cycle(halves * SLIP, np.array([pressure, pressure])),))


def unworn() -> NodalState:
    return NodalState.unworn(np.zeros(3))


def exact(cycles: float) -> Array:
    return PUSH * (1.0 - np.exp(-cycles / SCALES))


# --- laws -----------------------------------------------------------------------------------------


PRESSURE = np.array([[100.0, 50.0, 0.0], [80.0, 60.0, 20.0]])
PATHS = np.array([[0.01, 0.02, 0.03], [0.02, 0.0, 0.01]])
SLID = (PATHS * PRESSURE).sum(axis=0)


@pytest.mark.parametrize(
    ("law", "expected"),
    [
        (EnergyLaw(2e-8), 2e-8 * FRICTION * SLID),
        (ArchardLaw(1e-4, 3500.0), 1e-4 / 3500.0 * SLID),
        (
            EnergyAmplitudeLaw(2e-8, 0.075),
            2e-8 * FRICTION * SLID * np.array([0.03, 0.02, 0.04]) / 4.0 / 0.075,
        ),
    ],
)
def test_a_law_takes_off_what_it_says(law, expected) -> None:
    """One body wears by its law per cycle; the other, without wear, keeps its depth."""
    contact = NodalContact((law, EnergyLaw(0.0)), (Cycle(PATHS, PRESSURE),))
    first, second = contact.wear(unworn())
    np.testing.assert_allclose(first, expected, rtol=1e-14)
    assert not second.any()
    step = contact.explicit_step(unworn(), 10.0)
    np.testing.assert_allclose(step.state.surfaces.depth_1, 10.0 * expected, rtol=1e-14)
    assert step.state.depth_rate == pytest.approx(expected.max())
    assert step.state.volume_rate == pytest.approx(expected @ AREAS)
    assert step.state.start == "start"


def test_energy_is_that_of_all_nodes() -> None:
    step = NodalContact(LAWS, (Cycle(PATHS, PRESSURE),)).explicit_step(unworn(), 10.0)
    np.testing.assert_allclose(step.state.surfaces.work_1, 10.0 * FRICTION * SLID)
    assert step.state.energy == pytest.approx(10.0 * FRICTION * float(SLID @ AREAS))


@pytest.mark.parametrize("scope", ["local", "global"])
def test_a_coefficient_may_change_during_a_step(scope) -> None:
    """The step uses the exact mean over the energies between its ends."""
    cycles, table = 10.0, EnergyTable((0.0, 20.0), (1.0, 5.0))
    law = EvolvingLaw(EnergyLaw(2e-8), table, scope)
    contact = NodalContact((law, law), (Cycle(PATHS, PRESSURE),))
    once, _ = contact.wear(unworn(), cycles)
    cost = FRICTION * SLID * cycles
    ended = cost if scope == "local" else float(cost @ AREAS)
    assert np.max(ended) < 20.0
    np.testing.assert_allclose(once, (1.0 + 0.1 * ended) * 2e-8 * FRICTION * SLID, rtol=1e-13)


def test_the_mean_of_two_cycles_is_that_of_what_they_take_off() -> None:
    """It is not one cycle twice as long, in which an amplitude would count twice."""
    laws = EnergyAmplitudeLaw(2e-8, 0.075), ArchardLaw(1e-4, 3500.0)
    one, other = (NodalContact(laws, (Cycle(k * PATHS, PRESSURE),)) for k in (1.0, 3.0))
    both = one.averaged(other)
    parts = zip(both.wear(unworn()), one.wear(unworn()), other.wear(unworn()), strict=True)
    for mean, first, second in parts:
        np.testing.assert_allclose(mean, 0.5 * (first + second), rtol=1e-14)
    np.testing.assert_allclose(both.work, 0.5 * (one.work + other.work), rtol=1e-14)


# --- steps ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("stepper", "order"), [("explicit", 1), ("heun", 2)])
def test_order_of_convergence(stepper, order) -> None:
    cycles, errors = float(SCALES.min()), []
    for count in (8, 16, 32):
        length = cycles / count
        method = (
            ExplicitStepper(cycles=length) if stepper == "explicit" else HeunStepper(np.inf, np.inf)
        )
        state = unworn()
        for _ in range(count):
            state = method.step(state, length, cycles, springs).state
        errors.append(np.abs(state.surfaces.depth - exact(cycles)).max())
    rates = np.log2(np.divide(errors[:-1], errors[1:]))
    np.testing.assert_allclose(rates, order, atol=0.15)


@pytest.mark.parametrize("life", [0.5, 3.0, 10.0])
def test_heuns_steps_keep_to_tolerance_and_limit_and_estimate_their_error(life) -> None:
    cycles, counts = life * float(SCALES.max()), []
    limit = springs(unworn()).stable_cycles(unworn())
    for tolerance in (0.3, 0.1, 0.03):
        taken, state, done = [], unworn(), 0.0
        while most := rest(cycles, done):
            taken.append(HeunStepper(tolerance).step(state, most, cycles - done, springs))
            state, done = taken[-1].state, done + taken[-1].cycles
        assert max(step.cycles for step in taken) <= 0.75 * limit * (1.0 + 1e-12)
        assert sum(step.cycles for step in taken) == pytest.approx(cycles)
        wanted, state = exact(cycles), taken[-1].state
        wrong, estimate = state.surfaces.depth - wanted, step_errors(state, AREAS)
        assert np.abs(wrong).max() < 0.2 * tolerance * wanted.max()
        true = np.linalg.norm(wrong) / np.linalg.norm(wanted)
        assert true / 3.0 < estimate["depth"] < 3.0 * true
        true = abs(float(AREAS @ wrong)) / float(AREAS @ wanted)
        assert true / 3.0 < estimate["volume"] < 3.0 * true
        assert all(step.cost.steps == 2 for step in taken)
        assert all(step.cost.contact_solves % 6 == 0 for step in taken)
        counts.append(len(taken))
    assert counts == sorted(counts)


def test_explicit_steps_of_a_share_of_the_limit() -> None:
    limit = springs(unworn()).stable_cycles(unworn())
    done = advance_cycles(ExplicitStepper(0.25), unworn(), 10.1 * limit, 10.1 * limit, springs)
    assert done.cost.steps == 41
    assert done.cost.contact_solves == 41


def test_given_steps_beyond_the_limit_are_refused() -> None:
    limit = springs(unworn()).stable_cycles(unworn())
    with pytest.raises(StabilityError, match=re.escape(f"take at most {limit:.4g}")):
        ExplicitStepper(cycles=1.01 * limit).step(unworn(), 1.0, 1.0, springs)
    step = ExplicitStepper(cycles=limit).step(unworn(), 10.0 * limit, 10.0 * limit, springs)
    assert step.cycles == limit


@pytest.mark.parametrize("stepper", [ExplicitStepper(0.2), HeunStepper(0.05)])
def test_an_energy_threshold_is_passed_without_an_error(stepper) -> None:
    """V = α (ΣEd - Ed_th) holds exactly; below the threshold any step is stable."""
    threshold = 0.02
    laws = tuple(EvolvingLaw(law, EnergyTable(threshold=threshold), "global") for law in LAWS)

    def contact_at(state: NodalState) -> NodalContact:
        return springs(state, laws)

    assert contact_at(unworn()).stable_cycles(unworn()) == np.inf
    cycles = 2.0 * float(SCALES.max())
    state = advance_cycles(stepper, unworn(), cycles, cycles, contact_at).state
    assert state.energy > 1.5 * threshold
    volume = float(state.surfaces.depth @ AREAS)
    assert volume == pytest.approx(5e-8 * (state.energy - threshold), rel=1e-10)


def test_stretches_ask_before_each_of_them() -> None:
    """Steps within a stretch are as in the whole, and are counted."""
    asked = []

    def longest(state: NodalState, most: float) -> float:
        asked.append(most)
        return min(most, 2.5 * length)

    length = 0.5 * springs(unworn()).stable_cycles(unworn())
    done = advance_cycles(
        SubcyclingStepper(ExplicitStepper(0.5), longest),
        unworn(),
        6.0 * length,
        6.0 * length,
        springs,
    )
    np.testing.assert_allclose(asked, [6.0 * length, 3.5 * length, length])
    assert done.cost.steps == 3 + 3 + 1


@pytest.mark.parametrize("stepper", [ExplicitStepper(0.5), HeunStepper(0.1)])
def test_volume_is_coefficient_times_energy(stepper) -> None:
    cycles = float(SCALES.max())
    state = advance_cycles(stepper, unworn(), cycles, cycles, springs).state
    volumes = [float(depth @ AREAS) for depth in state.surfaces.depths]
    np.testing.assert_allclose(volumes, np.multiply((4e-8, 1e-8), state.energy), rtol=1e-12)
