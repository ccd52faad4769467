"""A cycle with the half-space's own friction: energies, closure, dissimilar bodies."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from sa_solver.contact import FrictionalContact
from sa_solver.contact_state import ContactLoad
from sa_solver.half_space.operator import HalfSpace
from sa_solver.load_history import LoadHistory
from sa_solver.types import Array, ElasticPair, Grid, Material
from wear.contact.drive import Drive
from wear.steps.full_cycle import CLOSED, CycleStart, march_cycle, starts_near
from wear.steps.stepping import ContactFailure

TITANIUM, STEEL = Material(115e3, 0.29), Material(200e3, 0.3)
GRID = Grid.covering((11.0, 24.0), (22, 24))
GAP = (
    np.maximum(np.abs(GRID.x) - 4.0, 0.0) ** 2 / 200 + np.maximum(np.abs(GRID.y) - 9, 0) ** 2 / 400
)
FRICTION = 0.4
P = np.array([8e3, 16e3, 12e3, 8e3, 4e3, 0.0])
# The flank slides outward while the load grows, sticks when it turns, and slides back at the end.
SHARE = np.array([-1.0, -1.0, -0.5, 0.3, 1.0, 0.0])
ENERGY = np.array([2.0, 40.0, 0.1, 0.1, 15.0, 0.0])


def mission(last: float = 0.0) -> LoadHistory:
    """Return a flank's cycle; ``last`` is the load it ends with."""
    load = P.copy()
    load[-1] = last
    zero = np.zeros(len(P))
    return LoadHistory(
        P=load,
        Qx=SHARE * FRICTION * load,
        Qy=zero,
        Mx=zero,
        My=zero,
        Mz=zero,
        Edx=ENERGY,
        Edy=zero,
        sliding=np.abs(SHARE) == 1.0,
    )


def contact(pair: ElasticPair) -> FrictionalContact:
    return FrictionalContact(HalfSpace(GRID, pair), FRICTION)


@pytest.mark.parametrize("first", [TITANIUM, STEEL], ids=["similar", "dissimilar"])
def test_sliding_dissipates_what_the_structure_does(first):
    """The energies are met, although pressing dissimilar bodies rotates some of the shear."""
    loads = mission()
    states = march_cycle(contact(ElasticPair(first, TITANIUM)), GAP, loads)
    assert [state.sliding for state in states] == loads.sliding.tolist()
    for t in np.flatnonzero(loads.sliding):
        state = states[t]
        assert state.energy.sum() == pytest.approx(loads.Edx[t], rel=1e-5)
        assert not state.sticking.any()
        assert state.resultants[1] == pytest.approx(
            loads.Qx[t], rel=2e-3 if first is TITANIUM else 5e-3
        )
        assert state.resultants[2] == pytest.approx(0.0, abs=1e-5 * loads.P[t])


def test_what_sticks_carries_the_given_force():
    loads = mission()
    states = march_cycle(contact(ElasticPair(TITANIUM, TITANIUM)), GAP, loads)
    for t in np.flatnonzero(~loads.sliding & (loads.P > 0.0)):
        given = [getattr(loads, name)[t] for name in ("P", "Qx", "Qy", "Mx", "My", "Mz")]
        np.testing.assert_allclose(states[t].resultants, given, atol=1e-7 * loads.P[t])
        assert states[t].sticking.any()
        assert states[t].energy.sum() >= -1e-8 * ENERGY.max()


def test_a_cycle_that_ends_loaded_is_closed():
    """One more increment repeats the first to 1e-3 of µp, as well as sliding forgets."""
    pair = ElasticPair(TITANIUM, TITANIUM)
    loads = mission(last=4e3)
    states = march_cycle(contact(pair), GAP, loads)
    values = np.array([loads.P[0], loads.Qx[0], 0.0, 0.0, 0.0, 0.0])
    repeated = contact(pair).advance(
        states[-1], GAP, ContactLoad(values, energy=np.array([loads.Edx[0], 0.0]))
    )
    np.testing.assert_allclose(
        repeated.shear, states[0].shear, atol=1e-3 * FRICTION * states[0].pressure.max()
    )


def test_the_next_pass_knows_the_last_one():
    """With the states of the last pass as start, pressures are found at once."""
    loads, solver = mission(last=4e3), contact(ElasticPair(TITANIUM, TITANIUM))
    loads = replace(loads, Edx=0.0 * ENERGY, sliding=np.zeros(len(P), bool))
    loads = replace(loads, Qx=0.5 * loads.Qx)
    passes = march_cycle(solver, GAP, loads)
    state, convolutions = passes[-1], 0
    for t in range(len(P)):
        values = np.array([getattr(loads, name)[t] for name in ("P", "Qx", "Qy", "Mx", "My", "Mz")])
        state = solver.advance(state, GAP, ContactLoad(values))
        convolutions += state.convolutions
        atol = CLOSED * FRICTION * float(state.pressure.max())
        np.testing.assert_allclose(state.shear, passes[t].shear, rtol=0, atol=atol)
    assert sum(passed.convolutions for passed in passes) < 0.75 * convolutions


@pytest.mark.parametrize("first", [TITANIUM, STEEL], ids=["similar", "dissimilar"])
def test_a_cycle_is_found_again_from_what_is_kept_of_it(first):
    """A stored start gives the same cycle at a sixth of the cost.

    On surfaces worn by 10 nm it costs less than without a start.
    """
    loads, solver = mission(), contact(ElasticPair(first, TITANIUM))
    found = march_cycle(solver, GAP, loads)
    pressed = {t: state.pressed for t, state in enumerate(found) if loads.P[t] > 0.0}
    starts = starts_near(CycleStart.of(found), pressed, len(loads))
    again = march_cycle(solver, GAP, loads, starts=starts)
    largest = max(float(state.pressure.max()) for state in found)
    for one, other in zip(found, again, strict=True):
        np.testing.assert_allclose(one.traction, other.traction, rtol=0, atol=1e-5 * largest)
    work = [sum(state.convolutions for state in states) for states in (again, found)]
    assert work[0] < work[1] / 6
    worn = GAP + 1e-5 * found[1].pressure / found[1].pressure.max()
    near, cold = (march_cycle(solver, worn, loads, starts=known) for known in (starts, None))
    work = [sum(state.convolutions for state in states) for states in (near, cold)]
    assert work[0] < 0.7 * work[1]
    for one, other in zip(near, cold, strict=True):
        np.testing.assert_allclose(one.traction, other.traction, rtol=0, atol=1e-5 * largest)


def test_no_load_no_slip():
    states = march_cycle(contact(ElasticPair(TITANIUM, TITANIUM)), GAP, mission())
    assert not states[-1].traction.any()
    assert not states[-1].slip.any()


def test_an_increment_that_fails_is_named(monkeypatch):
    failing = contact(ElasticPair(TITANIUM, TITANIUM))
    advance = failing.advance

    def fails(*arguments):
        return replace(advance(*arguments), converged=False, message="circles; refine the grid")

    monkeypatch.setattr(failing, "advance", fails)
    with pytest.raises(ContactFailure, match=r"increment 1: .*refine the grid"):
        march_cycle(failing, GAP, mission())


@pytest.mark.parametrize("first", [TITANIUM, STEEL], ids=["similar", "dissimilar"])
def test_energy_that_is_not_met_is_reported(monkeypatch, first):
    """With a limit of one contact problem the elastic part stays unknown, which is reported."""
    monkeypatch.setattr("sa_solver.tangential.gross_slip.ITERATIONS", 1)
    with pytest.raises(ContactFailure, match=r"increment 1: .*energy"):
        march_cycle(contact(ElasticPair(first, TITANIUM)), GAP, mission())


@pytest.mark.parametrize("first", [TITANIUM, STEEL], ids=["similar", "dissimilar"])
@pytest.mark.parametrize("column", ["Qy", "My"])
def test_loads_that_no_contact_carries_are_reported(first, column):
    """Shear that friction cannot carry without sliding, and moments outside the face, are reported.

    The failure also reaches the process that asked for the contact, with its message.
    """
    loads = replace(mission(), Edx=np.zeros(len(P)), Qx=0.1 * SHARE * FRICTION * mission().P)
    values = np.where(np.arange(len(P)) == 2, 1e6, 0.0)
    with pytest.raises(ContactFailure, match=f"increment 3: .*({column}|shear)") as info:
        march_cycle(contact(ElasticPair(first, TITANIUM)), GAP, replace(loads, **{column: values}))
    for error in (info.value, info.value.__cause__):
        assert str(pickle.loads(pickle.dumps(error))) == str(error)


# --- surfaces that pass over each other -----------------------------------------------------------

AMPLITUDE, MU = 0.025, 0.9
LINE, AREA = Grid.line_contact(0.4, 96), Grid.covering((0.4, 0.4), (24, 24))
WITHOUT_NU = Material(200e3, 0.0)


def to_and_fro_over_a_ridge(grid: Grid, pair: ElasticPair, P: float, each_way: int) -> list[Array]:
    """Return the energy of a cycle over a ridge of body 1, and 4µPA less the loss at two reversals.

    Where all slides, shear is µp, which displaces the surfaces by u = K µp. Each point slides by
    the motion of the bodies but for the change of u, -2u at a reversal: 4µPA - 2 Σ_ends Σ µp u S.
    """
    t = np.arange(1, each_way + 1) / each_way
    shift = AMPLITUDE * np.concatenate([1.0 - 2.0 * t, 2.0 * t - 1.0])
    form = (grid.x**2 + (0.0 if grid.line else grid.y**2)) / 20.0
    heights = np.stack([form + 1e-3 * np.exp(-(((grid.x - x) / 0.05) ** 2)) for x in shift])
    zero = np.zeros(2 * each_way)
    loads = LoadHistory(zero + P, *[zero] * 7, sliding=zero > 1.0)
    motions = np.zeros((2 * each_way, 6))
    motions[:, 1] = shift
    drive = Drive((False, True, False, True, True, True), motions)
    half_space = HalfSpace(grid, pair)
    states = march_cycle(FrictionalContact(half_space, MU), heights, loads, drive)
    ends = [
        MU * np.stack([s.pressure, 0.0 * s.pressure]) for s in (states[each_way - 1], states[-1])
    ]
    lost = 2.0 * sum(np.vdot(shear, half_space.shear(shear)) for shear in ends) * grid.cell_area
    return [sum(state.energy.sum() for state in states), 4.0 * MU * P * AMPLITUDE - lost]


@pytest.mark.parametrize(
    ("grid", "pair", "P"),
    [
        (LINE, ElasticPair(STEEL, STEEL), 18.5),
        (LINE, ElasticPair(STEEL, Material(70e3, 0.3)), 18.5),
        (AREA, ElasticPair(WITHOUT_NU, WITHOUT_NU), 4.0),
    ],
    ids=["line", "dissimilar", "area"],
)
@pytest.mark.parametrize("each_way", [4, 8])
def test_cells_that_part_dissipate_until_they_do(grid, pair, P, each_way):
    """Without the slip of separating cells 2 to 11 % of the energy would be missing."""
    energy, expected = to_and_fro_over_a_ridge(grid, pair, P, each_way)
    assert energy == pytest.approx(expected, rel=2e-3 if each_way == 4 else 1e-3)


def test_energy_over_a_ridge_is_of_second_order():
    found = [to_and_fro_over_a_ridge(LINE, ElasticPair(STEEL, STEEL), 18.5, n) for n in (4, 8, 16)]
    errors = [abs(energy - expected) for energy, expected in found]
    assert np.log2(errors[0] / errors[2]) / 2.0 > 1.8
