"""Joints of several laws in one structure, against each law alone and against time integration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fe_models.dynamics.excitation import CombinedForces, ConstantForce, HarmonicForce
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.periodic.load import PeriodicLoad
from fe_models.dynamics.rig import Link, lumped_rig, unit_force
from fe_models.dynamics.stability.floquet import Floquet
from fe_models.dynamics.transient.newmark import TimeStepControl, integrate
from wear.joints.bouc_wen import BoucWen
from wear.joints.elastic import ElasticStop, PolynomialSpring
from wear.joints.friction_contact import FrictionContact
from wear.joints.iwan import UniformIwan
from wear.joints.jenkins import Jenkins
from wear.joints.law import march_joints
from wear.joints.mixed import JointGroup, MixedLaw
from wear.joints.parameters import JointError
from wear.joints.periodic.march import PeriodicMarch

SLIDER = Jenkins(stiffness=1e3, friction=0.5, normal_load=10.0)
IWAN = UniformIwan(stiffness=2e3, friction=0.4, normal_load=20.0)
CONTACT = FrictionContact(stiffness=8e2, normal_stiffness=1.5e3, friction=0.3, normal_load=15.0)
ALL = MixedLaw((JointGroup(IWAN, 2), JointGroup(CONTACT, 1), JointGroup(SLIDER, 1)))


def path(steps=40, directions=3):
    """Return displacements of four joints, of which those along a line move in x alone."""
    rng = np.random.default_rng(5)
    moved = np.cumsum(0.004 * rng.standard_normal((steps, 4, directions)), axis=0)
    moved[:, [0, 1, 3], 1:] = 0.0
    return moved


def test_each_group_does_what_it_does_alone():
    """The path has many turning points, which Iwan joints must remember."""
    moved = path()
    together = march_joints(ALL, ALL.rest(4), np.zeros((4, 3)), moved)
    for group, rows in ALL.rows():
        law, own = group.law, slice(group.law.directions)
        alone = march_joints(
            law, law.rest(group.joints), np.zeros((group.joints, law.directions)),
            moved[:, rows, own],
        )  # fmt: skip
        np.testing.assert_array_equal(together.force[:, rows, own], alone.force)
        np.testing.assert_array_equal(together.dissipated[:, rows], alone.dissipated)
        assert not together.force[:, rows, law.directions :].any()


def test_periods_of_groups_and_their_derivatives():
    resolution = Resolution((0, 1, 3), 128)
    rng = np.random.default_rng(2)
    coefficients = 0.02 * rng.standard_normal((4, resolution.size, 3))
    given = resolution.basis, resolution.weights, resolution.lead
    cycle = ALL.march().settle(coefficients, *given)
    for group, rows in ALL.rows():
        own = slice(group.law.directions)
        alone = PeriodicMarch(group.law).settle(
            np.ascontiguousarray(coefficients[rows, :, own]), *given
        )
        np.testing.assert_array_equal(cycle.force[rows, :, own], alone.force)
        np.testing.assert_array_equal(cycle.samples[:, rows, own], alone.samples)
        np.testing.assert_array_equal(cycle.jacobian[rows, :, own, :, own], alone.jacobian)
        np.testing.assert_array_equal(cycle.dissipated[rows], alone.dissipated)
        np.testing.assert_array_equal(cycle.states[:, rows], alone.states)
        assert not cycle.jacobian[rows, :, group.law.directions :].any()


def test_deviations_of_groups_are_those_of_each_alone():
    """Memory that a group does not have stays as it is, and has no effect."""
    law = MixedLaw((*ALL.groups, JointGroup(ElasticStop(1e3, 0.005), 1)))
    resolution = Resolution((0, 1, 3), 128)
    coefficients = 0.02 * np.random.default_rng(2).standard_normal((5, resolution.size, 3))
    given = resolution.basis, resolution.lead
    march = law.march().linearise(coefficients, *given)
    for group, rows in law.rows():
        own = slice(group.law.directions)
        part = np.ascontiguousarray(coefficients[rows, :, own])
        alone = PeriodicMarch(group.law).linearise(part, *given)
        known = slice(alone.kept.shape[2])
        np.testing.assert_array_equal(march.kept[:, rows, known, known], alone.kept)
        np.testing.assert_array_equal(march.by_start[:, rows, known, own], alone.by_start)
        np.testing.assert_array_equal(march.by_end[:, rows, known, own], alone.by_end)
        np.testing.assert_array_equal(march.pull[rows, own, known], alone.pull)
        np.testing.assert_array_equal(march.tangent[:, rows, own, own], alone.tangent)
        np.testing.assert_array_equal(march.regimes[:, rows], alone.regimes)
        beyond = slice(alone.kept.shape[2], None)
        assert not march.pull[rows, :, beyond].any()
        assert not march.by_end[:, rows, beyond].any()
        rest = march.kept[:, rows, beyond, beyond]
        np.testing.assert_array_equal(rest, np.broadcast_to(np.eye(rest.shape[2]), rest.shape))


# One by one on masses that know nothing of each other; two axes of a contact's mass are its own.
HARDENS = PolynomialSpring(0.0, cubic=4e5)
ALONE = {"slips": SLIDER, "sticks": SLIDER, "hardens": HARDENS, "contact": CONTACT}
PULLS = {"slips": 9.0, "sticks": 0.4, "hardens": 3.0, "contact": 9.0}


def masses(names):
    """Return masses, each on its springs and its joint, with the force that excites it."""
    moving = [f"{name} {axis}" for name in names for axis in axes(name)]
    stiff = {"x": 500.0, "y": 700.0, "z": 300.0}
    nowhere = Link(None)
    directions = 3 if "contact" in names else 1
    joints = [
        [*(Link(f"{name} {axis}") for axis in axes(name)), *[nowhere] * 2][:directions]
        for name in names
    ]
    springs = {Link(name): stiff[name[-1]] for name in moving}
    model = lumped_rig(dict.fromkeys(moving, 2e-3), springs, joints, 0.05)
    push = sum(PULLS[name] * unit_force(model, f"{name} x") for name in names)
    pressed = [name for name in names if name == "contact"]
    press = sum((15.0 * unit_force(model, f"{name} z") for name in pressed), 0.0 * push)
    return model, PeriodicLoad({1: -1j * push}, press)


def axes(name):
    return "xyz" if name == "contact" else "x"


def stability(names, march):
    model, load = masses(names)
    problem = HarmonicBalance(model, march, load, Resolution((0, 1, 2, 3, 5), 256))
    motion = problem.solve(95.0, 1.0)
    assert motion.converged
    return Floquet(problem).stability(motion)


def test_stability_of_what_does_not_meet_is_that_of_each_alone():
    """The multipliers are those of each; a sticking slider is neutral, and counted once."""
    each = [stability((name,), PeriodicMarch(law)) for name, law in ALONE.items()]
    groups = tuple(JointGroup(law, 1) for law in ALONE.values())
    together = stability(tuple(ALONE), MixedLaw(groups).march())
    alone = np.sort(np.concatenate([np.abs(of.multipliers) for of in each]))[::-1]
    reported = np.abs(together.multipliers)
    np.testing.assert_allclose(reported, alone[: len(reported)], atol=2e-4)
    assert [of.neutral for of in each] == [0, 1, 0, 0]
    assert together.neutral == 1
    assert together.verdict == "stable"


def test_stability_of_spread_sliders_is_that_of_many():
    """An Iwan joint next to a spring agrees with sixty sliders; turning points come and go."""
    count = 60
    limits = 8.0 * (np.arange(count) + 0.5) / count**2 * 2.0
    many = Jenkins(2e3 / count, 1.0, limits)
    model, load = masses(("slips", "hardens"))
    rows = model.connection
    together = replace(model, connection=np.vstack([np.repeat(rows[:1], count, axis=0), rows[1:]]))
    spring = JointGroup(HARDENS, 1)
    resolution, reported = Resolution((0, 1, 2, 3, 5), 256), []
    for structure, joints in ((model, JointGroup(IWAN, 1)), (together, JointGroup(many, count))):
        march = MixedLaw((joints, spring)).march()
        problem = HarmonicBalance(structure, march, load, resolution)
        floquet = Floquet(problem)
        reported.append([])
        for frequency in (30.0, 60.0, 165.0):
            motion = problem.solve(frequency, 1.0)
            assert motion.converged
            reported[-1].append(np.abs(floquet.stability(motion).multipliers[:2]))
    np.testing.assert_allclose(reported[0], reported[1], atol=5e-3)


def test_a_line_of_sliders_stays_one():
    """Groups along one direction give a law of one direction."""
    law = MixedLaw((JointGroup(SLIDER, 1), JointGroup(BoucWen(1e3, 0.5, 10.0), 1)))
    assert law.directions == 1


def test_balance_of_harmonics_is_the_motion_in_time():
    """A contact and a slider on one mass are pressed and shaken until the motion repeats."""
    model = lumped_rig(
        {"x": 2e-3, "y": 2e-3, "z": 2e-3},
        {Link("x"): 500.0, Link("y"): 700.0, Link("z"): 300.0},
        # The slider is along x alone: nothing stretches its two other directions.
        [[Link("x"), Link("y"), Link("z")], [Link("x"), Link(None), Link(None)]],
        0.2,
    )
    law = MixedLaw((JointGroup(CONTACT, 1), JointGroup(SLIDER, 1)))
    push, press = unit_force(model, "x") + 0.1 * unit_force(model, "z"), unit_force(model, "z")
    frequency, force = 90.0, 14.0
    # Joints at rest have a preload, which this load balances.
    static = 15.0 * press
    load = PeriodicLoad({1: -1j * push}, static)
    problem = HarmonicBalance(model, law.march(), load, Resolution(tuple(range(22)), 512))
    motion = problem.solve(frequency, force)
    assert motion.converged
    assert motion.cycle.dissipated.min() > 0.0
    shaken = CombinedForces((HarmonicForce(push, force, frequency), ConstantForce(static)))
    steps, periods = 400, 10
    control = TimeStepControl(1.0 / (steps * frequency))
    moved = integrate(model, law, shaken, periods / frequency, control).displacement[-steps - 1 :]
    expected = motion.displacement(steps)
    np.testing.assert_allclose(moved[:-1], expected, atol=3e-3 * np.abs(expected).max(), rtol=0.0)


def test_numbers_of_joints_must_fit():
    with pytest.raises(JointError, match=r"5 joints .* 4"):
        ALL.rest(5)
