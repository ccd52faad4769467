"""Estimates of error that no other test holds against the truth: see docs/estimates.md."""

from itertools import pairwise

import numpy as np
import pytest

from fe_models.dynamics.motion import Start
from fe_models.dynamics.newmark import TimeStepControl, integrate
from fe_models.dynamics.rig import Link, lumped_rig
from fe_models.reduced_contact import FrettingConditions, ReducedPair
from sa_solver.half_space import HalfSpace
from sa_solver.normal import NormalContact
from sa_solver.reference.hertz import HertzSphere
from sa_solver.types import ElasticPair, Grid, Material
from tests.reduced_pads import FRICTION, STROKE, coarse_pads
from tests.workflow.test_time_cases import RIG, run
from workflow.analyses.specimens.run import QUARTER
from workflow.shell.convergence import richardson

# --- Newmark's steps ------------------------------------------------------------------------------


@pytest.mark.parametrize("per_period", [20, 60])
def test_the_error_of_a_step_in_time_is_that_of_one_step(per_period):
    """A free mass on a spring, each step begun on the closed form: (ωh)³/12 of the amplitude.

    The whole motion has the errors of all of its steps: its period is longer by (ωh)²/12.
    """
    rig = lumped_rig({"a": 2e-3}, {Link("a"): 400.0}, [[Link("a")]], 0.0)
    periods, circular = 3, np.sqrt(400.0 / 2e-3)
    step = 2.0 * np.pi / circular / per_period
    times = step * np.arange(periods * per_period + 1)
    exact, velocity = np.cos(circular * times), -circular * np.sin(circular * times)

    def moved(x, v, duration):
        start = Start(np.array([x]), np.array([v]))
        return integrate(rig, None, None, duration, TimeStepControl(step), start)

    one = max(
        abs(moved(x, v, step).displacement[-1, 0] - after)
        for (x, after), v in zip(pairwise(exact), velocity[:-1], strict=True)
    )
    motion = moved(1.0, 0.0, times[-1])
    whole = np.abs(motion.displacement[:, 0] - exact).max()
    assert motion.error == pytest.approx(one, rel=0.01)
    assert motion.error * motion.steps == pytest.approx(whole, rel=0.15)


# --- ladders --------------------------------------------------------------------------------------


@pytest.mark.parametrize("room", [1.25, 1.4, 1.6])
def test_ladders_of_grids_say_how_far_hertz_is(room):
    """Of the pressure in the middle, within a factor of three, however the contact lies."""
    material = Material(115e3, 0.29)
    pair = ElasticPair(material, material)
    hertz = HertzSphere(100.0, 10.0, pair.contact_modulus)
    counts, found = (16, 32, 64), []
    for count in counts:
        grid = Grid.covering((2.0 * room * hertz.contact_radius,) * 2, (count, count))
        height = (grid.x**2 + grid.y**2) / 20.0
        pressure = NormalContact(HalfSpace(grid, pair)).solve(height, 100.0).pressure
        half = count // 2
        found.append(float(pressure[half - 1 : half + 1, half - 1 : half + 1].mean()))
    told = richardson(found, [1.0 / count for count in counts], 2.0).error
    true = abs(found[-1] - hertz.peak_pressure)
    assert true / 3.0 < told < 3.0 * true


# --- specimens ------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("curved", [False, True])
def test_the_coupled_cycle_says_what_the_uncoupled_one_leaves(curved):
    """Of the energy at 250 N, with the increments of a run and with six times as many."""
    face, stiffness = coarse_pads()
    pair = ReducedPair.from_stiffness(face, *stiffness)
    gap = face.gap if curved else np.zeros(len(face))
    given = FrettingConditions(250.0, STROKE, FRICTION)
    uncoupled = pair.fretting_cycle(gap, given).energy
    told, true = (
        uncoupled / float(pair.coupled_cycle(gap, given, count).energy.sum()) - 1.0
        for count in (QUARTER, 6 * QUARTER)
    )
    assert told == pytest.approx(true, rel=0.3)


# --- rigs that age --------------------------------------------------------------------------------


@pytest.mark.slow
def test_steady_states_of_an_ageing_rig_are_as_many_as_it_takes(tmp_path):
    """What is told is the change by the last doubling: more than the more of them leave."""
    stiffer = "\nevolution: {stiffness: {kind: arrhenius, change: 3, scale: 5 J}}\n"
    loud = "excitation.force=150 N", "excitation.steady=1e-6", "excitation.periods=400"
    few, many = (
        run(tmp_path, RIG + stiffer, *loud, f"ageing={{energy: 100 J, tolerance: {tolerance}}}")
        for tolerance in (3e-2, 3e-5)
    )
    told = few["ageing"]["relative_error"]
    assert few["ageing"]["steady_states"] < many["ageing"]["steady_states"]
    assert 1e-3 < told <= 3e-2
    assert abs(few["cycles"] / many["cycles"] - 1.0) < told
