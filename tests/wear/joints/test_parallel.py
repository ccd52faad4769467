"""Parallel sliders as one joint: the sum of the sliders, and the energy of each."""

import numpy as np
import pytest

from wear.joints.jenkins import Jenkins
from wear.joints.law import march_joints
from wear.joints.parameters import JointError
from wear.joints.periodic.march import SLIP, STICK, PeriodicMarch
from wear.joints.periodic.parallel import ParallelSliders

SLIDERS = Jenkins(np.array([4.0, 3.0, 2.0, 1.0]), 0.5, np.array([0.4, 0.9, 1.2, 1.6]))
REACH = SLIDERS.limit / SLIDERS.stiffness
SAMPLES = 512
TURNS = 2.0 * np.pi * np.arange(SAMPLES) / SAMPLES
ORDERS = np.arange(1, 6, 2)
BASIS = np.concatenate([np.cos(np.outer(TURNS, ORDERS)), np.sin(np.outer(TURNS, ORDERS))], axis=1)
WEIGHTS = 2.0 / SAMPLES * BASIS.T
MOTION = np.array([0.5, 0.02, -0.05, 0.1, 0.03, 0.0])[None, :, None]


def test_they_are_the_sum_of_joints_with_the_same_motion():
    joint = ParallelSliders(SLIDERS).settle(MOTION, BASIS, WEIGHTS)
    apart = PeriodicMarch(SLIDERS).settle(np.repeat(MOTION, 4, axis=0), BASIS, WEIGHTS)
    np.testing.assert_allclose(joint.force[0], apart.force.sum(axis=0), rtol=1e-14)
    np.testing.assert_allclose(joint.samples[:, 0], apart.samples.sum(axis=1), rtol=1e-13)
    np.testing.assert_array_equal(joint.by_slider, apart.dissipated)
    assert joint.dissipated == pytest.approx(apart.dissipated.sum(), rel=1e-14)
    assert joint.force.shape == (1, 6, 1)
    assert joint.states.shape == (SAMPLES, 1)


def test_forces_are_those_of_the_law_itself():
    joint = ParallelSliders(SLIDERS).settle(MOTION, BASIS, WEIGHTS)
    path = np.tile((BASIS @ MOTION[0])[:, None], (2, 4, 1))
    history = march_joints(SLIDERS, SLIDERS.rest(4), np.zeros((4, 1)), path)
    force = history.force[SAMPLES:].sum(axis=1)
    np.testing.assert_allclose(joint.samples[:, 0], force, atol=1e-12)


def test_the_derivative_is_that_of_the_forces():
    joint, step = ParallelSliders(SLIDERS), 1e-7
    jacobian = joint.settle(MOTION, BASIS, WEIGHTS).jacobian[0, :, 0, :, 0]
    for place in range(6):
        change = np.zeros_like(MOTION)
        change[0, place, 0] = step
        after, before = (
            joint.settle(MOTION + sign * change, BASIS, WEIGHTS).force for sign in (1.0, -1.0)
        )
        slope = (after - before)[0, :, 0] / (2.0 * step)
        np.testing.assert_allclose(jacobian[:, place], slope, atol=1e-6)


def test_each_slider_travels_beyond_its_own_reach():
    amplitude = 0.5 * (REACH[1] + REACH[2])
    motion = np.zeros_like(MOTION)
    motion[0, 0, 0] = amplitude
    joint = ParallelSliders(SLIDERS).settle(motion, BASIS, WEIGHTS)
    wanted = 4.0 * SLIDERS.limit * np.maximum(amplitude - REACH, 0.0)
    np.testing.assert_allclose(joint.by_slider, wanted, rtol=1e-12)


def test_it_slips_where_less_than_half_of_the_stiffness_is_left():
    motion = np.zeros_like(MOTION)
    motion[0, 0, 0] = 0.5 * (REACH[0] + REACH[1])
    # Only the stiffest slider slips: 6 of 10 are left.
    assert np.all(ParallelSliders(SLIDERS).settle(motion, BASIS, WEIGHTS).states == STICK)
    motion[0, 0, 0] = 2.0 * REACH[-1]
    assert np.any(ParallelSliders(SLIDERS).settle(motion, BASIS, WEIGHTS).states == SLIP)


def test_more_joints_than_one_are_refused():
    with pytest.raises(JointError, match="2 joints, the sliders of one"):
        ParallelSliders(SLIDERS).settle(np.repeat(MOTION, 2, axis=0), BASIS, WEIGHTS)
