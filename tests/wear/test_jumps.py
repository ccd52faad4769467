"""Length of the jumps of the coupled loop, their stops, and the forecast of their number."""

from itertools import islice
from types import SimpleNamespace

import numpy as np
import pytest

from sa_solver.errors import InputError
from tests.wear.formula_loads import (
    LOAD,
    PER_LOAD,
    RADIUS,
    SCALE,
    cycle,
    cylinder,
    falling,
    forward_and_backward,
    in_turn,
    patch,
    run,
    run_constant,
)
from wear.coupled import CoupledWear
from wear.load_sources import ConstantLoads
from wear.schedule import AT_STOP, CoupledSettings, JumpSize, Stop
from wear.steps.implicit import ImplicitStepper
from wear.steps.step_errors import ErrorControl


@pytest.mark.parametrize("jump", [None, 0.37 * SCALE])
@pytest.mark.parametrize("stop", [Stop(volume=4e-4), Stop(depth=3.1e-4)])
def test_a_stop_is_met_to_a_thousandth(stop: Stop, jump: float | None) -> None:
    """The stop is met whatever the jumps, and although the loads fall on the way."""
    contact = patch(stepper=ImplicitStepper(ErrorControl(0.01)))
    settings = CoupledSettings(10.0 * SCALE, JumpSize(jump), stop, "every")
    states = run(settings, falling(), [contact])
    reached = states[-1].volume if stop.volume else states[-1].depth
    assert reached == pytest.approx(stop.volume or stop.depth, rel=1.001 * AT_STOP)
    assert settings.ended(states[-1])
    assert not any(map(settings.ended, states[:-1]))
    assert states[-1].cycles[-1] < settings.cycles


@pytest.mark.parametrize(
    ("size", "column"), [(JumpSize(volume=1e-4), slice(2, 4)), (JumpSize(depth=6e-5), slice(0, 1))]
)
def test_jumps_may_be_as_long_as_they_wear(size: JumpSize, column: slice) -> None:
    """The volume of a jump follows exactly from its rate, the depth nearly: pressures even out."""
    settings = CoupledSettings(SCALE, size, resultants="constant")
    end = run_constant(settings, LOAD, patch())
    worn = np.diff(end.kinetics[:, 0, column].sum(axis=1))
    asked = size.volume or size.depth
    np.testing.assert_allclose(worn[1:-1], asked, rtol=1e-6 if size.volume else 0.15)


@pytest.mark.parametrize(
    ("jump", "tolerance", "left"),
    [
        (JumpSize(0.3 * SCALE), None, [4, 3, 2, 1, 0]),
        (JumpSize(), 0.01, None),
        (JumpSize(volume=1e-4), None, None),
    ],
    ids=["given", "automatic", "by volume"],
)
def test_jumps_that_are_left_are_foreseen(jump, tolerance, left):
    """The estimate is exact for given jumps, and within a factor of two for growing ones.

    The latter holds from the third jump on.
    """
    control = None if tolerance is None else ErrorControl(tolerance)
    settings = CoupledSettings(SCALE, jump, resultants="constant")
    histories = [cycle(LOAD, patch().grid)]
    contacts = in_turn([patch(stepper=ImplicitStepper(control))])
    loop = CoupledWear(settings, ConstantLoads(histories), contacts)
    state, _ = loop.begin(histories)
    foreseen = [loop.remaining_jumps(state)] + [
        loop.remaining_jumps(each) for each in loop.march(state)
    ]
    true = np.arange(len(foreseen))[::-1]
    assert left is None or foreseen == left
    assert foreseen[-1] == 0
    assert np.all(foreseen[2:] <= 2 * true[2:])
    assert np.all(true[2:] <= 2 * np.array(foreseen[2:]))


def test_jumps_that_grow_are_foreseen_as_they_grow() -> None:
    """After jumps of 1, 2, 4 and 8 cycles sixteen more reach 2^20 - 1; equal ones are counted."""
    settings = CoupledSettings(2.0**20 - 1.0)
    loop = CoupledWear(settings, ConstantLoads([]), in_turn([]))
    steady = SimpleNamespace(half_way=False, depth_rate=0.0, volume_rate=0.0)
    for lengths, following, left in (([1, 2, 4, 8], 16.0, 16), ([8, 8, 8], 8.0, 2**17 - 3)):
        cycles = np.cumsum([0.0, *lengths])
        steady.next_cycles = following
        state = SimpleNamespace(cycles=cycles, interfaces=(steady,))
        assert loop.remaining_jumps(state) == pytest.approx(left, abs=1)


def test_contacts_with_different_steps_end_together() -> None:
    """Contacts with different steps need no more jumps together than one after the other.

    Each takes its steps in pairs, and their numbers differ.
    """
    contacts = [cylinder(stepper=ImplicitStepper(ErrorControl(share))) for share in (0.02, 0.01)]
    histories = [forward_and_backward(load, contacts[0].grid) for load in (50.0, 20.0)]
    settings = CoupledSettings(2.0 / 3.0 * 0.5**3 / RADIUS / (PER_LOAD * 50.0))

    def jumps(of: slice) -> int:
        loop = CoupledWear(settings, ConstantLoads(histories[of]), in_turn(contacts[of]))
        state, _ = loop.begin(histories[of])
        states = list(islice(loop.march(state), 50))
        assert states[-1].cycles[-1] == pytest.approx(settings.cycles, rel=1e-12)
        return len(states)

    assert jumps(slice(0, 2)) <= jumps(slice(0, 1)) + jumps(slice(1, 2))


def test_a_jump_has_one_size() -> None:
    with pytest.raises(InputError, match="more than one size"):
        JumpSize(cycles=1.0, depth=1e-3)
