"""Error estimates that no other test compares with the true error: see docs/estimates.md."""

import numpy as np
import pytest

from fe_models.dynamics.excitation import HammerBlow, HarmonicForce
from fe_models.dynamics.motion import Start, quadratic
from fe_models.dynamics.rig import Link, lumped_rig
from fe_models.dynamics.transient.newmark import TimeStepControl, integrate
from fe_models.joints.reduced_contact import FrettingConditions, ReducedPair
from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.contact import NormalContact
from sa_solver.reference.hertz import HertzSphere
from sa_solver.types import ElasticPair, Grid, Material
from tests.oracles.event_driven import SliderJoints, integrate_exactly
from tests.oracles.two_mass_rig import two_mass_rig
from tests.reduced_pads import FRICTION, STROKE, coarse_pads
from tests.workflow.vibration.time_scenes import RIG, run
from wear.joints.jenkins import Jenkins
from workflow.analyses.specimens.run import QUARTER
from workflow.models.budget.convergence import richardson

# --- Newmark's steps ------------------------------------------------------------------------------


@pytest.mark.parametrize("per_period", [20, 60])
def test_the_error_of_steps_in_time_is_that_of_the_whole_motion(per_period):
    """A free mass on a spring has a period longer by (ωh)²/12, also after a resumption."""
    rig = lumped_rig({"a": 2e-3}, {Link("a"): 400.0}, [[Link("a")]], 0.0)
    circular = np.sqrt(400.0 / 2e-3)
    period = 2.0 * np.pi / circular
    control, end = TimeStepControl(period / per_period), Start(np.ones(1))
    for _ in range(3):
        motion = integrate(rig, None, None, 3.0 * period, control, end)
        exact, end = np.cos(circular * motion.times), motion.end
        true = np.abs(motion.displacement[:, 0] - exact).max()
        assert true / 3.0 < motion.error < 3.0 * true


@pytest.mark.parametrize("tolerance", [None, 1e-5])
@pytest.mark.parametrize(("force", "step"), [("blow", 2e-5), ("blow", 4e-5), ("shaken", 1e-4)])
def test_with_friction_too(force, step, tolerance):
    """Two masses on a slider, hit or shaken, are compared with event-driven integration.

    Friction excites their second mode, 16 or more steps long, which is soon out of phase.
    """
    rig, driven = two_mass_rig((21.2e-3, 1.2e-3), (1.4e3, 273e3), 1e-3), np.array([1.0, 0.0])
    forces = {"blow": HammerBlow(driven, 100.0, 4e-4), "shaken": HarmonicForce(driven, 75.0, 100.0)}
    joints = SliderJoints(np.array([27.3e3]), np.array([30.0]), np.array([880.0]))
    law, duration, row = Jenkins(27.3e3, 0.5, 60.0, 880.0), 0.05, 4e-4
    exact = integrate_exactly(rig, joints, forces[force], duration, row)
    control = TimeStepControl(step, tolerance, every=round(row / step))
    motion = integrate(rig, law, forces[force], duration, control)
    apart = np.sqrt(quadratic(rig.mass, motion.displacement - exact.displacement))
    true = (apart / np.sqrt(quadratic(rig.mass, exact.displacement)).max()).max()
    assert true / 3.0 < motion.error < 3.0 * true


def test_the_error_of_a_single_step_is_its_own():
    rig = lumped_rig({"a": 2e-3}, {Link("a"): 400.0}, [[Link("a")]], 0.0)
    motion = integrate(rig, None, None, 1e-3, TimeStepControl(1e-3), Start(np.ones(1)))
    true = abs(motion.displacement[-1, 0] - np.cos(np.sqrt(400.0 / 2e-3) * 1e-3))
    assert true / 3.0 < motion.error < 3.0 * true


# --- ladders --------------------------------------------------------------------------------------


@pytest.mark.parametrize("room", [1.25, 1.4, 1.6])
def test_ladders_of_grids_estimate_the_error_from_hertz(room):
    """The error of the central pressure is found within a factor of three for any position."""
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
    reported = richardson(found, [1.0 / count for count in counts], 2.0).error
    true = abs(found[-1] - hertz.peak_pressure)
    assert true / 3.0 < reported < 3.0 * true


# --- specimens ------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("curved", [False, True])
def test_the_coupled_cycle_gives_the_error_of_the_uncoupled_one(curved):
    """The energy at 250 N is compared, with the increments of a run and six times as many."""
    face, stiffness = coarse_pads()
    pair = ReducedPair.from_stiffness(face, *stiffness)
    gap = face.gap if curved else np.zeros(len(face))
    given = FrettingConditions(250.0, STROKE, FRICTION)
    uncoupled = pair.fretting_cycle(gap, given).energy
    reported, true = (
        uncoupled / float(pair.coupled_cycle(gap, given, count).energy.sum()) - 1.0
        for count in (QUARTER, 6 * QUARTER)
    )
    assert reported == pytest.approx(true, rel=0.3)


# --- rigs that age --------------------------------------------------------------------------------


@pytest.mark.slow
def test_steady_states_of_an_ageing_rig_are_as_many_as_it_takes(tmp_path):
    """The reported error is the actual one within a factor of three."""
    stiffer = "\nevolution: {stiffness: {kind: arrhenius, change: 3, scale: 40 J}}\n"
    loud = "excitation.force=150 N", "excitation.steady=1e-6", "excitation.periods=400"
    few, many = (
        run(tmp_path, RIG + stiffer, *loud, f"ageing={{energy: 100 J, tolerance: {tolerance}}}")
        for tolerance in (3e-2, 3e-5)
    )
    reported = few["ageing"]["relative_error"]
    assert few["ageing"]["steady_states"] < many["ageing"]["steady_states"]
    true = abs(few["cycles"] / many["cycles"] - 1.0)
    assert true / 3.0 < reported < 3.0 * true
