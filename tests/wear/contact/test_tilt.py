"""Contacts with a held tilt: moments that hold it, worn shapes, an independent model."""

from functools import cache
from typing import Any

import numpy as np
import pytest

from sa_solver.cycles.partial_slip import partial_slip_curve
from sa_solver.half_space.operator import HalfSpace
from sa_solver.load_history import LoadHistory
from sa_solver.normal.contact import NormalContact
from sa_solver.types import Array, ElasticPair, Grid, Tilt
from tests.marks import slow
from tests.oracles.sliding_cylinder import wear_without_tilt
from tests.wear.contact import contacts
from tests.wear.contact.contacts import BODY, COEFFICIENT, FRICTION, PAIR, STEEL
from wear.contact.drive import Drive
from wear.contact.face_loads import CycleLoads
from wear.contact.interface import InterfaceContact
from wear.steps.full_cycle import march_cycle
from wear.steps.implicit import ImplicitStepper, SecondOrderStepper
from wear.steps.step_errors import ErrorControl, root_mean_square
from wear.steps.steppers import ExplicitStepper
from wear.steps.stepping import WearState

RADIUS, SOLVED = 6.0, 1e-8


def interface(grid: Grid, gap: Array, tilt: Tilt, **settings: Any) -> InterfaceContact:
    drive = settings.pop("drive", Drive.by_forces(tilt))
    return contacts.interface(grid, gap, drive, **settings)


def reciprocating(
    grid: Grid, P: float, stroke: float, each_way: int, angle: float = 0.0
) -> CycleLoads:
    """Return motion forward and backward in equal steps, without moments."""
    step = stroke / each_way * np.array([np.cos(angle), np.sin(angle)])
    motion = np.concatenate([np.tile(step, (each_way, 1)), np.tile(-step, (each_way, 1))])
    zero = np.zeros(len(motion))
    sliding = np.ones(len(motion), dtype=bool)
    loads = LoadHistory(P + zero, *[zero] * 7, sliding=sliding)
    return CycleLoads(loads, np.repeat(motion[:, :, None], np.prod(grid.shape), axis=2))


def moved(history: CycleLoads, tilt: Tilt) -> Drive:
    """Return the imposed motion of a cycle in whose middle the bodies meet."""
    motion = history.slip.mean(axis=2)
    path = np.concatenate([np.zeros((1, 2)), np.cumsum(motion, axis=0)])
    motions = np.zeros((len(motion), 6))
    motions[:, 1:3] = 0.5 * (path.max(axis=0) + path.min(axis=0)) - path[1:]
    held = tilt == "held"
    return Drive((False, True, True, held, held, True), motions)


def worn(
    contact: InterfaceContact, history: CycleLoads, cycles: float, jumps: int
) -> tuple[WearState, float]:
    """Return the state after ``cycles`` in equal jumps, and the energy dissipated."""
    state, _ = contact.begin(history, cycles)
    for jump in range(jumps):
        state, _ = contact.jump(state, cycles / jumps, cycles * (1.0 - jump / jumps))
    return state, state.energy


# --- what holds the tilt --------------------------------------------------------------------------


def test_an_inclined_punch_is_held_by_the_moment_of_its_closed_form() -> None:
    """A full contact of half-width a, inclined by α, needs M = π a² E* α/4, and none if it is free.

    On a half-plane the pressure E* α x/2√(a² - x²) displaces by αx; ∫ x p dx is its moment.
    """
    grid, half, slope, load = Grid.line_contact(1.2, 240), 0.5, 1e-4, 50.0
    strip = np.where(np.abs(grid.x) < half, slope * grid.x, 1.0)
    history = reciprocating(grid, load, 0.01, 1)
    moments = {}
    for tilt in ("held", "free"):
        contact = interface(grid, strip, tilt, follow=False)
        _, first = contact.begin(history, 1.0)
        loads = contact.settings.drive.carried(grid, history.loads, first.pressure)
        moments[tilt] = loads.My
        assert (loads is history.loads) == (tilt == "free")
    # The gap opens towards x > 0, so the pressure sits at x < 0 and My = -Σ p x S is positive.
    closed = 0.25 * np.pi * half**2 * PAIR.contact_modulus * slope
    np.testing.assert_allclose(moments["held"], closed, rtol=1e-2)
    assert not moments["free"].any()


@pytest.mark.parametrize("method", ["normal", "full"])
@pytest.mark.parametrize("other", [BODY, STEEL], ids=["similar", "dissimilar"])
def test_the_moments_that_hold_a_tilt_leave_none_when_they_are_imposed(method, other) -> None:
    """In 3-D about both axes, over an oblique stroke on a groove, both ways are one problem."""
    grid = Grid.covering((1.0, 1.0), (20, 20))
    groove = 1e-3 * np.exp(-((grid.x - 0.04) ** 2 + (grid.y + 0.06) ** 2) / 0.02)
    gap = (grid.x**2 + grid.y**2) / (2.0 * RADIUS) - groove
    history = reciprocating(grid, 40.0, 0.02, 2, angle=0.6)
    pair, P = ElasticPair(BODY, other), 40.0
    settings = {"pair": pair, "method": method, "tolerance": SOLVED, "follow": False}
    if method == "full":
        settings["drive"] = moved(history, "held")
    contact = interface(grid, gap, "held", **settings)
    state, first = contact.begin(history, 1.0)
    loads = contact.settings.drive.carried(grid, state.loads, first.pressure)
    assert np.abs(loads.Mx).min() > 1e-3 * P
    assert np.abs(loads.My).min() > 1e-3 * P
    if method == "normal":
        for t, pressure in enumerate(first.pressure):
            free = NormalContact(HalfSpace(grid, pair)).solve(
                gap, P, float(loads.Mx[t]), float(loads.My[t]), tolerance=1e-10
            )
            assert max(abs(free.tilt_x), abs(free.tilt_y)) < 1e-6 * free.approach
            np.testing.assert_allclose(free.pressure, pressure, atol=1e-6 * pressure.max())
    for solved in first.cycle:
        assert not solved.rigid[3:5].any()
        assert solved.resultants[0] == pytest.approx(P, rel=1e-6)
    if first.cycle:
        tilted = march_cycle(contact.frictional(0.0), gap, history.loads, moved(history, "free"))
        assert np.abs([solved.rigid[3:5] for solved in tilted]).min() > 1e-7  # free ones do tilt


def test_a_groove_holds_in_mirrored_places_by_opposite_moments() -> None:
    """Off centre by the same distance on either side the moments are opposite, in the middle 0."""
    grid = Grid.line_contact(1.0, 100)
    groove = 2e-4 * np.exp(-((grid.x / 0.05) ** 2))
    contact = NormalContact(HalfSpace(grid, PAIR))
    moments = [
        contact.solve(
            grid.x**2 / (2.0 * RADIUS) + np.roll(groove, cells, axis=0), 20.0, tilt_y=0.0
        ).My
        for cells in (-3, 0, 3)
    ]
    assert moments[0] == pytest.approx(-moments[2], rel=1e-6)
    assert abs(moments[1]) < 1e-9 * abs(moments[0])
    assert abs(moments[2]) > 1e-3 * 20.0 * 0.03


def test_partial_slip_of_a_held_tilt() -> None:
    grid = Grid.covering((1.0, 1.0), (24, 24))
    gap = (grid.x**2 + grid.y**2) / (2.0 * RADIUS) + 1e-3 * (grid.x - 0.1) ** 2 * grid.x
    contact = NormalContact(HalfSpace(grid, PAIR))
    held, free = (
        partial_slip_curve(contact, gap, 40.0, tolerance=1e-8, tilt=tilt).normal
        for tilt in ("held", "free")
    )
    assert held.tilt_y == 0.0
    assert abs(held.My) > 1e-4 * 40.0
    assert free.tilt_y != 0.0
    assert free.My == pytest.approx(0.0, abs=1e-6)


# --- wear -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("tilt", ["held", "free"])
def test_an_inclined_strip_wears_off_its_slope_where_it_is_held(tilt: Tilt) -> None:
    """After long wear the pressure is uniform: W is odd in x by the slope if held, or even if free.

    W = δ - h - u with u of a uniform pressure, which is even.
    """
    grid, slope = Grid.line_contact(1.2, 48), 1e-4
    on = (np.abs(grid.x) < 0.5).ravel()
    contact = interface(grid, np.where(on[:, None], slope * grid.x, 1.0), tilt, follow=False)
    state, energy = worn(contact, reciprocating(grid, 50.0, 0.02, 1), 1e7, 40)
    depth, x = state.surfaces.depth.ravel()[on], grid.x.ravel()[on]
    odd = 0.5 * (depth - depth[::-1])
    np.testing.assert_allclose(odd, -slope * x if tilt == "held" else 0.0, atol=1e-6 * slope)
    assert energy == pytest.approx(FRICTION * 50.0 * 0.04 * 1e7, rel=1e-9)
    volume = state.surfaces.depth.sum() * grid.cell_area
    assert volume == pytest.approx(2.0 * COEFFICIENT * energy, rel=1e-9)


@cache
def in_a_model_of_its_own(
    cells_across: int, load: float, each_way: int, cells: int, cycles: float, steps: int
) -> tuple[Array, Array]:
    """Return the depths of flat and cylinder on cells of 10 µm, by the oracle's explicit steps."""
    form = (Grid.line_contact(0.01 * cells_across, cells_across).x ** 2 / (2.0 * RADIUS)).ravel()
    rate = COEFFICIENT * FRICTION * cells * 0.01 * cycles / steps
    return wear_without_tilt(form, 0.01, PAIR.contact_modulus, load, each_way, cells, rate, steps)


STEPPERS = {
    "explicit": (ExplicitStepper(0.9), 1),
    "implicit": slow(ImplicitStepper(), 40),
    "second order": (SecondOrderStepper(), 12),
}


@pytest.mark.parametrize(("stepper", "jumps"), STEPPERS.values(), ids=STEPPERS)
def test_a_sliding_cylinder_wears_as_in_a_model_of_its_own(stepper, jumps: int) -> None:
    """The depths of both bodies agree within the error of the steps.

    The stroke of 120 µm is a third of the scar. Free to tilt, the flat wears 8.5 % deeper and the
    cylinder 3.5 % less; volumes are exact in any case.
    """
    grid, load, each_way, cells, cycles = Grid.line_contact(0.6, 60), 18.5, 2, 6, 4e3
    stroke, form = each_way * cells * 0.01, (grid.x**2 / (2.0 * RADIUS)).ravel()
    expected = in_a_model_of_its_own(60, load, each_way, cells, cycles, 200)
    contact = interface(grid, form[:, None], "held", stepper=stepper, follow=True)
    state, energy = worn(contact, reciprocating(grid, load, stroke, each_way), cycles, jumps)
    assert energy == pytest.approx(FRICTION * load * 2.0 * stroke * cycles, rel=1e-9)
    for depth, own in zip(state.surfaces.depths, expected, strict=True):
        assert depth.sum() * 0.01 == pytest.approx(COEFFICIENT * energy, rel=1e-9)
        assert depth.max() == pytest.approx(own.max(), rel=4e-3)


@pytest.mark.parametrize("kind", [slow(ImplicitStepper), SecondOrderStepper])
def test_the_error_of_steps_of_moving_surfaces_is_estimated(kind) -> None:
    """The estimated error of either depth is within a factor of three, and near the tolerance."""
    grid, load, each_way, cells, cycles = Grid.line_contact(0.72, 72), 18.5, 2, 6, 1e4
    stroke, form = each_way * cells * 0.01, (grid.x**2 / (2.0 * RADIUS)).ravel()
    expected = in_a_model_of_its_own(72, load, each_way, cells, cycles, 400)
    contact = interface(grid, form[:, None], "held", stepper=kind(ErrorControl(0.01)), follow=True)
    state, _ = contact.begin(reciprocating(grid, load, stroke, each_way), cycles)
    state, _ = contact.jump(state, cycles, cycles)
    for depth, error, own in zip(state.surfaces.depths, state.errors, expected, strict=True):
        scale = root_mean_square(own, own)
        reported = root_mean_square(error, own) / scale
        true = root_mean_square(depth.ravel() - own, own) / scale
        assert max(reported, true) < 0.013
        assert true / 3.0 < reported < 3.0 * true


@pytest.mark.parametrize("other", [BODY, STEEL], ids=["similar", "dissimilar"])
def test_friction_of_the_half_space_wears_a_held_cylinder_equally(other) -> None:
    """Given slips wear the same but for the elastic part of the stroke, 1 to 3 % of the energy.

    Free to tilt, the flat wears 7 to 9 % deeper by either method.
    """
    grid, pair = Grid.line_contact(0.6, 40), ElasticPair(BODY, other)
    history = reciprocating(grid, 18.5, 0.12, 2)
    ends = {}
    for method in ("normal", "full"):
        settings = {"pair": pair, "method": method, "follow": True, "tolerance": SOLVED}
        drive = moved(history, "held")
        contact = interface(grid, grid.x**2 / 12.0, "held", drive=drive, **settings)
        state, energy = worn(contact, history, 2e3, 4)
        volume = state.surfaces.depth.sum() * grid.cell_area
        assert volume == pytest.approx(2.0 * COEFFICIENT * energy, rel=1e-9)
        ends[method] = state.surfaces.depth_1.max()
    assert ends["full"] == pytest.approx(ends["normal"], rel=3e-2)


def test_what_is_symmetric_does_not_care() -> None:
    """A cylinder with small motion wears the same held and free, within the solver's tolerance."""
    grid = Grid.line_contact(0.72, 72)
    history = reciprocating(grid, 18.5, 0.01, 2)
    held, free = (
        worn(interface(grid, grid.x**2 / 12.0, tilt, follow=False), history, 1e4, 5)[0].surfaces
        for tilt in ("held", "free")
    )
    for one, other in zip(held.depths, free.depths, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-7 * other.max())
