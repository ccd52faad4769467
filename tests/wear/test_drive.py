"""Contacts driven by forces and motions: other marches of a history, and closed forms."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sa_solver.contact import FrictionalContact
from sa_solver.half_space.operator import HalfSpace
from sa_solver.load_history import LoadHistory
from sa_solver.types import Array, ElasticPair, Grid, Material
from tests.wear.contact import contacts
from tests.wear.contact.contacts import BODY, FRICTION, PAIR, STEEL
from wear.contact.drive import Drive
from wear.contact.face_loads import CycleLoads
from wear.contact.interface import InterfaceContact
from wear.steps.full_cycle import march_cycle
from wear.steps.stepping import ContactFailure

RADIUS = 10.0
BALL = Grid.covering((0.8, 0.8), (20, 20))
SPHERE = (BALL.x**2 + BALL.y**2) / (2.0 * RADIUS)


def loads_of(**columns: list[float]) -> LoadHistory:
    """Return the forces of a cycle; those that are not given are 0."""
    count = len(next(iter(columns.values())))
    names = ("P", "Qx", "Qy", "Mx", "My", "Mz", "Edx", "Edy")
    given = {name: np.array(columns.get(name, np.zeros(count)), dtype=float) for name in names}
    return LoadHistory(**given, sliding=np.zeros(count, dtype=bool))


def interface(gap: Array, drive: Drive, grid: Grid = BALL, **settings: Any) -> InterfaceContact:
    """Return a contact whose motion wears it in place."""
    return contacts.interface(grid, gap, drive, follow=False, tolerance=1e-8, **settings)


# --- cycles ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("other", [BODY, STEEL], ids=["similar", "dissimilar"])
def test_forces_and_the_motions_that_they_make_are_one_problem(other: Material) -> None:
    """Imposing the rigid motions that forces and bulk stress have caused gives the same contact."""
    loads = loads_of(
        P=[60.0, 80.0, 60.0, 0.0],
        Qx=[15.0, -20.0, 5.0, 0.0],
        Qy=[0.0, 4.0, -4.0, 0.0],
        My=[0.5, -0.5, 0.2, 0.0],
        Mz=[0.5, -0.2, 0.0, 0.0],
    )
    contact = FrictionalContact(HalfSpace(BALL, ElasticPair(BODY, other)), FRICTION, 1e-10)
    strain = np.array([1e-4, -1e-4, 5e-5, 0.0])
    forced = march_cycle(contact, SPHERE, loads, Drive(strain=strain))
    motions = np.array([state.rigid for state in forced])
    moved = march_cycle(contact, SPHERE, loads, Drive((True,) * 6, motions, strain))
    # Where motions are imposed, a cycle that opens is marched twice like any other.
    for one, other_state in zip(forced[:3], moved[:3], strict=True):
        scale = one.pressure.max()
        np.testing.assert_allclose(one.traction, other_state.traction, atol=2e-5 * scale)
        np.testing.assert_allclose(one.resultants, other_state.resultants, atol=2e-4 * 80.0)


def test_bodies_that_part_meet_where_their_motion_has_led_them() -> None:
    """Bodies moved by 1 mm while apart meet without slip and shear; moved back, as before."""
    loads = loads_of(P=[50.0, 50.0, 0.0, 50.0, 0.0])
    motions = np.zeros((5, 6))
    motions[:, 1] = [0.0, 2e-4, 1.0, 1.0, 0.0]
    drive = Drive((False, True, True, True, True, True), motions)
    contact = FrictionalContact(HalfSpace(BALL, PAIR), FRICTION)
    states = march_cycle(contact, SPHERE, loads, drive)
    assert not states[0].shear.any()
    assert states[1].resultants[1] > 1.0  # body 1 drags body 2 along
    assert not states[2].traction.any()
    assert not states[3].shear.any()
    np.testing.assert_allclose(states[3].pressure, states[0].pressure, rtol=1e-6)


@pytest.mark.parametrize("other", [BODY, STEEL], ids=["similar", "dissimilar"])
def test_a_cycle_that_creeps_is_marched_until_it_repeats(other: Material) -> None:
    """With pressure that varies while shear rotates, two passes are not enough."""
    loads = loads_of(
        P=[40.0, 85.0, 55.0, 35.0, 80.0, 60.0],
        Qx=[15.0, -30.0, 20.0, -14.0, 25.0, -10.0],
        Qy=[5.0, 8.0, -6.0, 3.0, -8.0, 6.0],
    )
    contact = FrictionalContact(HalfSpace(BALL, ElasticPair(BODY, other)), FRICTION)
    states = march_cycle(contact, SPHERE, loads, Drive.by_forces("held"))
    limit = FRICTION * max(state.pressure.max() for state in states)
    state, values = states[-1], Drive.by_forces("held").increments(loads)
    for load, before in zip(values, states, strict=True):
        state = contact.advance(state, SPHERE, load)
        np.testing.assert_allclose(state.shear, before.shear, atol=5e-3 * limit)
        np.testing.assert_allclose(state.slip, before.slip, atol=2e-2 * np.abs(before.slip).max())


# --- wear -----------------------------------------------------------------------------------------


def test_a_held_approach_wears_until_nothing_is_pressed() -> None:
    """Both surfaces together then lack the interpenetration δ - h, and the force is 0."""
    approach, motions = 2e-3, np.zeros((2, 6))
    motions[:, 0], motions[:, 1] = approach, [0.01, -0.01]
    drive = Drive((True, True, True, True, True, True), motions)
    slip = np.broadcast_to(np.array([0.02, -0.02])[:, None, None] * [[1.0], [0.0]], (2, 2, 400))
    contact = interface(SPHERE, drive)
    history = CycleLoads(loads_of(P=[1.0, 1.0]), slip)
    state, first = contact.begin(history, 1e9)
    carried = [drive.carried(BALL, history.loads, first.pressure).P[0]]
    for jump in range(12):
        cycles = 3.0 ** (jump + 1)
        state, _ = contact.jump(state, cycles, cycles)
        pressure = np.stack([start.pressure for start in state.starts.values()])
        carried.append(drive.carried(BALL, state.loads, pressure).P[0])
    np.testing.assert_allclose(state.surfaces.depth, np.maximum(approach - SPHERE, 0.0), atol=2e-6)
    assert np.all(np.diff(carried) < 0.0)
    assert carried[-1] < 2e-3 * carried[0]
    # The unworn force is Hertz's, within the error of 20 cells.
    hertz = 4.0 / 3.0 * PAIR.contact_modulus * np.sqrt(RADIUS) * approach**1.5
    assert carried[0] == pytest.approx(hertz, rel=0.02)


def test_partial_slip_wears_a_cylinder_down_to_its_stick_zone() -> None:
    """Slipping cells wear off until |x| < c carries all of P (Goryacheva, Rajeev and Farris 2001).

    There the surfaces are unworn and touch over a width 2c of their own: p = E*/2R √(c² - x²) + (P
    - π E* c²/4R) / (π √(c² - x²)), with Cattaneo's c/a = √(1 - Q/µP) as long as Q is constant. The
    error with cells of c/16 is 1.4 %.
    """
    load, shear = 400.0, 100.0
    modulus, grid = PAIR.contact_modulus, Grid.line_contact(0.9, 72)
    half = np.sqrt(4.0 * load * RADIUS / (np.pi * modulus))
    stick = half * np.sqrt(1.0 - shear / (FRICTION * load))
    loads = loads_of(P=[load, load], Qx=[shear, -shear])
    contact = interface(grid.x**2 / (2.0 * RADIUS), Drive.by_forces("held"), grid, method="full")
    state, _ = contact.begin(CycleLoads(loads, np.zeros((2, 2, grid.shape[0]))), 1e7)
    for cycles in 3e4 * 2.0 ** np.arange(7):
        state, _ = contact.jump(state, cycles, cycles)
    pressure, x = contact.fields(state, 0).pressure.ravel(), grid.x.ravel()
    inside = np.abs(x) < 0.7 * stick
    root = np.sqrt(stick**2 - x[inside] ** 2)
    own = np.pi * modulus * stick**2 / (4.0 * RADIUS)
    limit = modulus / (2.0 * RADIUS) * root + (load - own) / (np.pi * root)
    np.testing.assert_allclose(pressure[inside], limit, rtol=0.02)
    carried = pressure[np.abs(x) < stick + grid.pitch[0]].sum() * grid.pitch[0]
    assert carried == pytest.approx(load, rel=1e-3)
    assert state.surfaces.depth[inside].max() < 1e-5 * state.surfaces.depth.max()


def test_a_cycle_of_forces_wears_what_its_friction_dissipates() -> None:
    """Both bodies together lose V = 2 α E under P that changes and Q that rotates."""
    loads = loads_of(P=[40.0, 60.0, 40.0], Qx=[12.0, 0.0, -12.0], Qy=[0.0, 15.0, -5.0])
    contact = interface(SPHERE, Drive.by_forces("held"), method="full")
    state, _ = contact.begin(CycleLoads(loads, np.zeros((3, 2, 400))), 5e3)
    state, _ = contact.jump(state, 5e3, 5e3)
    volume = state.surfaces.depth.sum() * BALL.cell_area
    assert state.energy > 0.0
    assert volume == pytest.approx(2.0 * 1e-8 * state.energy, rel=1e-9)


def test_more_shear_than_friction_carries_is_reported() -> None:
    loads = loads_of(P=[40.0, 40.0], Qx=[21.0, -21.0])
    contact = interface(SPHERE, Drive.by_forces("held"), method="full")
    history = CycleLoads(loads, np.zeros((2, 2, 400)))
    with pytest.raises(ContactFailure, match=r"increment 1: .* Qx = 21 N"):
        contact.begin(history, 1.0)
    weaker = replace(history, loads=loads_of(P=[40.0, 40.0], Qx=[19.0, -19.0]))
    assert contact.begin(weaker, 1.0)[1].energy.sum() > 0.0
