"""Harmonic balance of contacts in three dimensions: balances, limits, independent joints."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fe_models.dynamics.curves.forced_response import along_force
from fe_models.dynamics.model import DynamicModel
from fe_models.dynamics.periodic.load import PeriodicLoad
from fe_models.dynamics.rig import unit_force
from tests.fe_models.dynamics.harmonic_rigs import EXACT, balance, contact_rig, pressed, rig
from wear.joints.friction_contact import FrictionContact
from wear.joints.periodic.march import SEPARATED, SLIP, STICK, PeriodicMarch


def test_preload_alone_closes_the_gap():
    """The contact alone holds z, which moves by the gap plus load over kn at every frequency."""
    model, law = contact_rig(), FrictionContact(300.0, 400.0, 0.5, gap=0.01)
    problem = balance(model, PeriodicMarch(law), (0, 1, 2, 3), 64, pressed(model, 8.0, 1.0))
    still = problem.solve(30.0, 0.0)
    assert still.converged
    assert still.coefficients[0, 0, 2] == pytest.approx(0.01 + 8.0 / 400.0, rel=EXACT)
    stuck = problem.solve(30.0, 0.5)
    omega = 2.0 * np.pi * 30.0
    model_damping = model.damping[0, 0]
    wanted = 0.5 / (800.0 - 2e-3 * omega**2 + 1j * omega * model_damping)
    assert stuck.amplitude(0) == pytest.approx(wanted, rel=1e-8)
    assert np.all(stuck.cycle.states == STICK)
    slipping = problem.solve(30.0, 30.0)
    assert slipping.converged
    assert np.any(slipping.cycle.states == SLIP)


def test_contact_that_opens_and_closes_balances_in_the_mean():
    """The contact alone carries the mean load, so that its mean force is the load."""
    model, law = contact_rig(), FrictionContact(300.0, 400.0, 0.5)
    load = pressed(model, 8.0, 12.0, 2.0)
    problem = balance(model, PeriodicMarch(law), tuple(range(12)), 512, load)
    branch = along_force(problem, 40.0, (0.0, 3.0))
    assert branch.message == ""
    last = branch.solutions[-1]
    assert {SLIP, SEPARATED} <= set(np.unique(last.cycle.states))
    assert last.cycle.samples[:, 0, 2].mean() == pytest.approx(8.0, rel=1e-8)
    np.testing.assert_allclose(
        last.cycle.force[0], problem.resolution.weights @ last.cycle.samples[:, 0], atol=1e-12
    )
    assert last.cycle.samples[:, 0, 2].min() == 0.0


def test_an_open_contact_leaves_the_structure_linear():
    model = replace(contact_rig(), stiffness=np.diag([500.0, 700.0, 900.0]))
    law = FrictionContact(300.0, 400.0, 0.5, gap=1.0)
    problem = balance(
        model, PeriodicMarch(law), (0, 1, 3), 64, PeriodicLoad({1: unit_force(model, "x")})
    )
    solution = problem.solve(60.0, 2.0)
    omega = 2.0 * np.pi * 60.0
    wanted = 2.0 / (500.0 - 2e-3 * omega**2 + 1j * omega * model.damping[0, 0])
    assert solution.amplitude(0) == pytest.approx(wanted, rel=EXACT)
    assert np.all(solution.cycle.states == SEPARATED)


def test_joints_of_separate_rigs_do_not_interact():
    """Two rigs in one model move as each alone does under its own load."""
    one = rig(0.02)
    pair = DynamicModel(
        *(np.kron(np.eye(2), part) for part in (one.mass, one.damping, one.stiffness)),
        np.kron(np.eye(2), one.connection),
        ("a1", "a2", "b1", "b2"),
    )
    load = PeriodicLoad({1: -1j * np.array([1.0, 0.0, 0.6, 0.0])})
    both = balance(pair, harmonics=(1, 3, 5), load=load).solve(100.0, 70.0)
    for place, force in ((0, 70.0), (2, 42.0)):
        alone = balance(one, harmonics=(1, 3, 5)).solve(100.0, force)
        np.testing.assert_allclose(
            both.motion[:, place : place + 2], alone.motion, rtol=1e-7, atol=1e-12
        )
