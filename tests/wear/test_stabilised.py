"""Steps of many stages: their polynomials, and nodes on an elastic body with known wear.

Pressures p = S (δ - h) at the worn depth h, with S similar to a half-space's, wear by dh/dN = w p:
the depth is δ - exp(-w S N) δ, by the eigenvectors of S.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest

from sa_solver.types import Array
from wear.contact.nodes import NodalContact, NodalState
from wear.evolution import EnergyTable
from wear.laws import EnergyLaw, EvolvingLaw
from wear.steps.marching import advance_cycles
from wear.steps.stabilised import DAMPING, StabilisedStepper, chebyshev_step, stages_for
from wear.steps.step_errors import ErrorControl, step_errors

NODES, FRICTION, SLIP, ALPHA = 40, 0.5, 0.02, 4e-8
AREAS = np.full(NODES, 0.05)
# The wave of number k is pressed away k times as fast as the longest one.
BASIS = np.linalg.qr(np.cos(np.pi * np.outer(np.arange(NODES) + 0.5, np.arange(NODES)) / NODES))[0]
ELASTIC = BASIS * (1e4 * np.arange(1.0, NODES + 1.0)) @ BASIS.T
# The initial overlap is larger at one end.
PUSH = 1e-3 * (1.0 + np.linspace(0.0, 1.0, NODES) ** 2)
WEAR = ALPHA * FRICTION * SLIP
LAWS = EnergyLaw(0.75 * ALPHA), EnergyLaw(0.25 * ALPHA)
# Cycles in which the longest wave falls to 1/e.
SCALE = 1.0 / (WEAR * 1e4)


@dataclass(frozen=True)
class Pressed:
    """A cycle of one increment at known pressures."""

    pressure: Array
    friction: float = FRICTION
    start: None = None

    @property
    def areas(self) -> Array:
        return AREAS

    @property
    def slip(self) -> Array:
        return np.full((1, NODES), SLIP)

    def stable_cycles(self, depth_per_pressure: Array) -> float:
        return 2.0 / (1e4 * NODES * float(depth_per_pressure.max()))


def pressed(state: NodalState, laws=LAWS) -> NodalContact:
    return NodalContact(laws, (Pressed((ELASTIC @ (PUSH - state.surfaces.depth))[None]),))


def exact(cycles: float) -> Array:
    decay = np.exp(-np.arange(1.0, NODES + 1.0) * cycles / SCALE)
    return PUSH - BASIS @ (decay * (BASIS.T @ PUSH))


@pytest.mark.parametrize("stages", [2, 3, 5, 9, 30])
def test_stages_are_stable_within_their_limit_and_of_second_order(stages: int) -> None:
    """On y' = z y, |R| <= 1, damped except for the longest waves, and R = 1 + z + z²/2 + O(z³)."""
    reach = 2.0 / 3.0 * (stages**2 - 1.0) * (1.0 - 2.0 * DAMPING / 15.0)
    assert stages_for(reach * (1.0 - 1e-9)) == stages
    assert stages_for(reach * 1.001) == stages + 1

    def grown(z: Array) -> Array:
        return 1.0 + chebyshev_step(lambda lost: z * (1.0 + lost), z, 1.0, stages)

    z = -reach * np.linspace(0.0, 1.0, 2001)
    assert np.abs(grown(z)).max() <= 1.0 + 1e-12
    assert np.abs(grown(z[z < -0.05 * reach])).max() < 0.97
    near = np.array([-1e-2, -5e-3])
    missed = np.abs(grown(near) - (1.0 + near + 0.5 * near**2))
    assert np.all(missed < np.abs(near) ** 3 / 6.0)


def test_steps_of_any_length_are_of_second_order() -> None:
    """Steps have two to five stages, in a time in which the shortest wave decays by e^-40."""
    counts, errors = (2, 16, 32), []
    for count in counts:
        state = NodalState.unworn(np.zeros(NODES))
        for _ in range(count):
            state = StabilisedStepper().step(state, SCALE / count, np.inf, pressed).state
        errors.append(np.linalg.norm(state.surfaces.depth - exact(SCALE)) / np.linalg.norm(PUSH))
    assert errors[0] < 5e-3
    assert errors[0] / errors[2] > 100.0
    assert np.log2(errors[1] / errors[2]) == pytest.approx(2.0, abs=0.1)


def test_the_error_is_within_the_tolerance_and_as_estimated() -> None:
    state = NodalState.unworn(np.zeros(NODES))
    state = advance_cycles(
        StabilisedStepper(ErrorControl(0.01)), state, SCALE, SCALE, pressed
    ).state
    known = exact(SCALE)
    true = np.linalg.norm(state.surfaces.depth - known) / np.linalg.norm(known)
    estimate = step_errors(state)
    assert estimate is not None
    assert true < 0.01
    assert estimate["depth"] / 3.0 < true < 3.0 * estimate["depth"]


def test_volume_is_energy_times_the_coefficient() -> None:
    """The volume is exact to rounding, however long the step."""
    state = NodalState.unworn(np.zeros(NODES))
    state = StabilisedStepper().step(state, 0.3 * SCALE, np.inf, pressed).state
    volume = float(state.surfaces.depth @ AREAS)
    assert volume == pytest.approx(ALPHA * state.energy, rel=1e-13)
    assert volume > 0.0


@pytest.mark.parametrize(("count", "left"), [(8, 1e-2), (24, 2e-3)])
def test_a_coefficient_that_changes_with_energy_is_at_its_mean(count: int, left: float) -> None:
    table = EnergyTable((0.0, 2e4), (1.0, 0.2))
    contact_at = partial(pressed, laws=tuple(EvolvingLaw(law, table, "local") for law in LAWS))
    state = NodalState.unworn(np.zeros(NODES))
    for _ in range(count):
        state = StabilisedStepper().step(state, SCALE / count, np.inf, contact_at).state
    work = state.surfaces.work_1
    mean = table.mean(np.zeros(NODES), work)
    np.testing.assert_allclose(state.surfaces.depth_1, 0.75 * ALPHA * mean * work, rtol=left)
    assert mean.min() < 0.5
