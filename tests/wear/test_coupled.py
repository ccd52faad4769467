"""The coupled loop, with sources of loads that are formulas.

**A cylinder** that slides as a whole under a constant load has a known worn shape
(``tests/wear/test_closed_forms.py``).

**A flat patch** of area A is pressed by a load that falls linearly with its mean worn depth, P = P0
(1 - h/h0) with h = V/A. It slides as a whole, so that the volume per cycle is c P whatever the
pressure distribution: V' = c P0 (1 - V/(A h0)), V = A h0 (1 - exp(-N/N0)), N0 = A h0/(c P0). Loads
that stay constant during a jump are Euler's method for this equation.
"""

import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sa_solver.types import Array
from tests.marks import slow
from tests.oracles.worn_shapes import worn_cylinder
from tests.wear.formula_loads import (
    AREA,
    COEFFICIENTS,
    FALL,
    FRICTION,
    LOAD,
    PAIR,
    PER_LOAD,
    RADIUS,
    SCALE,
    SLIP,
    Falling,
    cylinder,
    falling,
    in_turn,
    patch,
    run,
    run_constant,
)
from wear.contact.drive import Drive
from wear.contact.interface import InterfaceState, MotionError
from wear.coupled import CoupledWear
from wear.coupled_state import Observer
from wear.evolution import EnergyTable
from wear.laws import EnergyLaw, EvolvingLaw
from wear.schedule import CoupledSettings, JumpSize
from wear.steps.full_cycle import CycleStart
from wear.steps.implicit import ImplicitStepper
from wear.steps.step_errors import ErrorControl
from wear.steps.stepping import ContactFailure

# --- against closed forms -------------------------------------------------------------------------


def test_a_cylinder_wears_to_its_closed_form() -> None:
    """A cylinder in automatic steps meets the closed form to 1 %, and its volume exactly."""
    load, volume = 50.0, 2.0 / 3.0 * 0.5**3 / RADIUS
    contact = cylinder(stepper=ImplicitStepper(ErrorControl(0.01)))
    settings = CoupledSettings(volume / (PER_LOAD * load))
    end = run_constant(settings, load, contact)
    assert end.cycles[-1] == pytest.approx(settings.cycles, rel=1e-12)
    assert end.volume == pytest.approx(volume, rel=1e-9)
    b, depth, _ = worn_cylinder(load, volume, RADIUS, PAIR.contact_modulus)
    worn = end.interfaces[0].surfaces.depth
    assert worn.max() == pytest.approx(depth, rel=1e-2)
    half = 0.5 * np.count_nonzero(worn) * contact.grid.pitch[0]
    assert half == pytest.approx(b, abs=contact.grid.pitch[0])
    assert end.solutions == 1
    assert end.drift.max() == 0.0


def test_volume_is_coefficient_times_energy() -> None:
    """The volume of both bodies follows from the energy µ P s of all cycles after every jump."""
    load = 50.0
    end = run_constant(CoupledSettings(1e6, JumpSize(2.5e5)), load, cylinder())
    _, _, volume_1, volume_2, energy = end.kinetics[:, 0].T
    assert len(energy) == 5
    np.testing.assert_allclose(volume_1, COEFFICIENTS[0] * energy, rtol=1e-10)
    np.testing.assert_allclose(volume_2, COEFFICIENTS[1] * energy, rtol=1e-10)
    np.testing.assert_allclose(energy, FRICTION * load * SLIP * end.cycles, rtol=1e-9)


def exact_volume(cycles: float) -> float:
    """Return the volume of the patch by an independent integrator."""

    def rate(_: float, volume: Array) -> Array:
        return PER_LOAD * LOAD * (1.0 - volume / (AREA * FALL))

    solution = solve_ivp(rate, (0.0, cycles), [0.0], rtol=1e-10, atol=1e-14)
    return float(solution.y[0, -1])


def test_loads_that_fall_with_wear_follow_their_differential_equation() -> None:
    """Loads solved after every jump are exactly Euler's method, and converge in first order."""
    errors = []
    for jumps in (5, 10, 20):
        jump = SCALE / jumps
        states = run(
            CoupledSettings(SCALE, JumpSize(jump), resultants="every"), falling(), [patch()]
        )
        assert states[-1].jump == jumps
        euler = AREA * FALL * (1.0 - (1.0 - jump / SCALE) ** np.arange(jumps + 1))
        volumes = states[-1].kinetics[:, 0, 2:4].sum(axis=1)
        np.testing.assert_allclose(volumes, euler, rtol=1e-8, atol=1e-15)
        errors.append(volumes[-1] / exact_volume(SCALE) - 1.0)
    assert errors[-1] < 0.02
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 2.0, rtol=0.1)


@pytest.mark.parametrize("drift", [0.02, 0.1, 0.3])
def test_drift_asks_for_as_many_solutions_as_it_should(drift: float) -> None:
    """The number of solutions is that of the drift rule applied to the known loads."""
    jumps, source = 25, falling()
    jump = 2.0 * SCALE / jumps
    settings = CoupledSettings(2.0 * SCALE, JumpSize(jump), drift=drift)
    states = run(settings, source, [patch()])
    volume, load, solved, drifts = 0.0, LOAD, [], [0.0]
    for _ in range(jumps):
        volume += PER_LOAD * load * jump
        now = LOAD * (1.0 - volume / (AREA * FALL))
        drifts.append(abs(now - load) / load)
        if drifts[-1] > drift:
            load = now
            solved.append(now)
    assert 1 < len(solved) < jumps or drift == 0.02
    assert states[-1].solutions == 1 + len(solved)
    np.testing.assert_allclose([asked for (asked,) in source.solved], solved, rtol=1e-7)
    np.testing.assert_allclose(states[-1].drift, drifts, rtol=1e-6, atol=1e-9)
    assert source.probed == 1 + jumps
    assert states[-1].volume == pytest.approx(volume, rel=1e-8)


def test_constant_resultants_are_never_asked_for_again() -> None:
    source = falling()
    settings = CoupledSettings(SCALE, JumpSize(0.2 * SCALE), resultants="constant")
    end = run(settings, source, [patch()])[-1]
    assert (end.solutions, source.solved, source.probed) == (1, [], 1)
    assert end.volume == pytest.approx(PER_LOAD * LOAD * SCALE, rel=1e-8)


def test_a_source_receives_changing_friction() -> None:
    """The source receives one coefficient per contact, by the energy that each has dissipated."""
    reported = []

    class Listening(Falling):
        def worn(self, depths, friction=None):
            reported.append(friction)
            return super().worn(depths, friction)

    def friction(energy: float) -> float:
        return FRICTION / (1.0 + energy)

    contacts = [patch(friction=friction)] * 2
    source = Listening((LOAD, 0.5 * LOAD), FALL, contacts[0].grid)
    settings = CoupledSettings(
        0.2 * SCALE, JumpSize(0.1 * SCALE), resultants="every", friction="evolving"
    )
    states = run(settings, source, contacts)
    energies = states[-1].kinetics[1:, :, 4]
    np.testing.assert_allclose(reported, FRICTION / (1.0 + energies))


# --- observers ------------------------------------------------------------------------------------


class Diary(Observer):
    """Observer that records all events."""

    def __init__(self) -> None:
        self.events: list[tuple] = []

    @contextmanager
    def stage(self, name):
        self.events.append(("stage", name))
        yield
        self.events.append(("over", name))

    def begin(self, state):
        self.events.append(("begin", state))

    def jump_started(self, state, cycles):
        self.events.append(("jumping", state, cycles))

    def jump_finished(self, before, after):
        self.events.append(("jumped", before, after))


def test_observers_see_every_state_once_and_in_order() -> None:
    diaries = Diary(), Diary()
    settings = CoupledSettings(SCALE, JumpSize(0.3 * SCALE), drift=0.4)
    states = run(settings, falling(), [patch()], *diaries)
    assert diaries[0].events == diaries[1].events
    seen = [event for event in diaries[0].events if event[0] not in ("stage", "over")]
    assert seen[0] == ("begin", states[0])
    for number, (started, finished) in enumerate(zip(seen[1::2], seen[2::2], strict=True)):
        assert started[0] == "jumping"
        assert started[1] is states[number]
        assert finished[1] is states[number]
        assert finished[2] is states[number + 1]
        cycles = states[number + 1].cycles[-1] - states[number].cycles[-1]
        assert started[2] == pytest.approx(cycles)
    assert len(seen) == 1 + 2 * (len(states) - 1)
    stages = [event[1] for event in diaries[0].events if event[0] == "stage"]
    assert stages.count("wear") == stages.count("drift probe") == len(states) - 1
    assert stages.count("structural friction") == states[-1].solutions - 1
    assert stages[0] == "contact, first cycle"


def test_an_observer_may_be_anything() -> None:
    """The base class has methods for all events, which do nothing."""
    run(CoupledSettings(SCALE), falling(), [patch()], Observer())


# --- a run goes on --------------------------------------------------------------------------------


def numbers(state: InterfaceState) -> dict[str, object]:
    """Return all numbers of a state by name."""
    parts: dict[str, object] = {}
    for name, value in vars(state).items():
        if name in ("surfaces", "loads", "link") or isinstance(value, CycleStart):
            parts |= {f"{name}.{part}": field for part, field in vars(value).items()}
        elif name == "starts":
            for t, start in value.items():
                parts |= {f"{name}.{t}.{part}": field for part, field in vars(start).items()}
        elif isinstance(value, InterfaceState):
            parts |= {f"{name}.{part}": field for part, field in numbers(value).items()}
        else:
            parts[name] = value
    return parts


def same(one: InterfaceState, other: InterfaceState) -> None:
    """Return whether two states are identical bit for bit."""
    mine, its = numbers(one), numbers(other)
    assert mine.keys() == its.keys()
    for name, value in mine.items():
        np.testing.assert_array_equal(value, its[name], err_msg=name)


@pytest.mark.parametrize("method", ["normal", slow("full")])
def test_resuming_from_any_state_ends_bit_for_bit_the_same(method: str) -> None:
    """Two contacts under drifting loads resume bit for bit, with new contacts and a new source."""
    loads, control = (LOAD, 0.6 * LOAD), ErrorControl(0.02)
    motions = np.zeros((2, 6))
    motions[:, 1] = [-0.25 * SLIP, 0.25 * SLIP]
    settings = {
        "method": method,
        "stepper": ImplicitStepper(control),
        "drive": Drive((False, True, True, False, False, True), motions),
        "tolerance": 1e-8,
    }
    contacts = [patch(name=name, **settings) for name in ("left", "right")]
    coupling = CoupledSettings(0.3 * SCALE, drift=0.05)
    states = run(coupling, falling(*loads), contacts)
    assert len(states) > 3
    assert states[-1].solutions > 1
    for begun in states[:-1]:
        loop = CoupledWear(coupling, falling(*loads), in_turn(contacts))
        *_, end = loop.march(begun)
        for name in ("cycles", "kinetics", "drift", "solved_resultants"):
            np.testing.assert_array_equal(getattr(end, name), getattr(states[-1], name))
        assert end.solutions == states[-1].solutions
        for one, other in zip(end.interfaces, states[-1].interfaces, strict=True):
            same(one, other)


def test_a_state_that_has_ended_stays() -> None:
    settings = CoupledSettings(SCALE, JumpSize(0.5 * SCALE))
    states = run(settings, falling(), [patch()])
    assert list(CoupledWear(settings, falling(), in_turn([patch()])).march(states[-1])) == []


# --- failures -------------------------------------------------------------------------------------


def test_a_failure_names_its_contact() -> None:
    contacts = [patch(name="left"), patch(name="right", tolerance=1e-30)]
    source = falling(LOAD, LOAD)
    with pytest.raises(ContactFailure, match="right: increment 1: "):
        run(CoupledSettings(SCALE), source, contacts)


def test_a_law_that_changes_from_place_to_place_does_not_move() -> None:
    law = EvolvingLaw(EnergyLaw(1e-6), EnergyTable(), "local")
    contact = patch(laws=(law, law), follow=True)
    with pytest.raises(MotionError, match="neglect the motion"):
        run(CoupledSettings(SCALE), falling(), [contact])


# --- what it needs --------------------------------------------------------------------------------


@pytest.mark.slow
def test_it_needs_neither_cases_nor_finite_elements() -> None:
    """Running this file in a process of its own imports neither of them."""
    code = f"""
import runpy, sys
scene = runpy.run_path({str(Path(__file__))!r})
settings = scene["CoupledSettings"](scene["SCALE"])
states = scene["run"](settings, scene["falling"](), [scene["patch"]()])
assert states[-1].volume > 0.0
found = {{name.partition(".")[0] for name in sys.modules}}
assert not found & {{"workflow", "fe_models", "pydantic", "h5py", "rich", "click"}}, found
"""
    root = Path(__file__).parents[2]
    subprocess.run([sys.executable, "-c", code], cwd=root, check=True)
