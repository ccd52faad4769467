"""Recorded periods and their harmonics, and rigs under several harmonics against integration."""

import numpy as np
import pytest

from fe_models.dynamics.excitation import CombinedForces, ExcitationError, HarmonicForce
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.periodic.load import PeriodicLoad
from fe_models.dynamics.periodic.record import PeriodicRecord
from fe_models.dynamics.rig import Link, lumped_rig, unit_force
from fe_models.dynamics.transient.newmark import TimeStepControl, integrate
from wear.joints.jenkins import Jenkins
from wear.joints.periodic.march import PeriodicMarch


def uneven():
    """Return a record with uneven steps and a mean."""
    turns = np.array([0.0, 0.07, 0.2, 0.33, 0.61, 0.8, 1.0])
    return PeriodicRecord(turns, np.array([2.0, 5.0, -1.0, 0.5, 4.0, -6.0, 2.0]))


def test_harmonics_add_up_to_the_record():
    """Harmonics of straight lines fall as 1/k²: the sum is in error by about its tail."""
    record, turns = uneven(), np.linspace(0.0, 1.0, 501)
    orders, amplitudes = np.arange(2001), record.amplitudes(2000)
    again = (np.exp(2j * np.pi * np.outer(turns, orders)) @ amplitudes).real
    np.testing.assert_allclose(again, record.value(turns), atol=0.02)
    quadrature = np.mean(
        record.value(np.arange(4000) / 4000)
        * np.exp(-2j * np.pi * np.outer([0, 1, 5], np.arange(4000)) / 4000),
        axis=1,
    )
    np.testing.assert_allclose(record.amplitudes(5)[[0, 1, 5]], quadrature * [1, 2, 2], atol=1e-4)


def test_the_neglected_share_is_that_of_the_missing_harmonics():
    record, turns = uneven(), (np.arange(20000) + 0.5) / 20000
    swing = record.value(turns) - np.mean(record.value(turns))
    for highest in (1, 3, 15):
        kept = record.amplitudes(highest)
        orders = np.arange(1, highest + 1)
        shown = (np.exp(2j * np.pi * np.outer(turns, orders)) @ kept[1:]).real
        missing = np.sqrt(np.mean((swing - shown) ** 2) / np.mean(swing**2))
        assert record.left_out(highest) == pytest.approx(missing, rel=1e-4)
    assert PeriodicRecord(np.linspace(0.0, 1.0, 3), np.ones(3)).left_out(1) == 0.0


@pytest.mark.parametrize(
    ("turns", "force"),
    [
        ([0.0, 1.0], [0.0, 0.0]),
        ([0.0, 0.5, 0.9], [0.0, 1.0, 0.0]),
        ([0.0, 0.6, 0.5, 1.0], [0.0, 1.0, 1.0, 0.0]),
        ([0.0, 0.5, 1.0], [0.0, 1.0, 0.1]),
        ([0.0, 0.5, 1.0], [0.0, np.nan, 0.0]),
    ],
)
def test_invalid_periods_are_refused(turns, force):
    with pytest.raises(ExcitationError):
        PeriodicRecord(np.array(turns), np.array(force))


def test_linear_motion_is_the_sum_of_its_harmonics():
    """Each harmonic is computed separately, on a rig without friction."""
    rig = lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]], 0.02)
    free = PeriodicMarch(Jenkins(stiffness=1e3, friction=0.0, normal_load=10.0))
    waves = dict(enumerate(uneven().amplitudes(9)[:, None]))
    balance = HarmonicBalance(rig, free, PeriodicLoad(waves), Resolution(tuple(range(10)), 256))
    motion = balance.solve(40.0, 2.0)
    for order, wave in waves.items():
        angular = 2.0 * np.pi * 40.0 * order
        stiffness = 1e3 - 1e-3 * angular**2 + 1j * 0.04 * angular
        assert motion.amplitude(0, order) == pytest.approx(2.0 * wave[0] / stiffness, rel=1e-9)


def test_a_slider_under_several_harmonics_moves_as_in_time():
    """Newmark's method reaches the steady state under harmonics 1, 2 and 3 with phases."""
    springs = {Link("a"): 1e3, Link("b", "a"): 3e3}
    rig = lumped_rig({"a": 1e-3, "b": 2e-3}, springs, [[Link("b")]], 0.05)
    law, frequency = Jenkins(stiffness=2e3, friction=0.5, normal_load=10.0), 70.0
    parts = [("a", 1, 8.0, 0.0), ("b", 2, 4.0, 0.7), ("b", 3, 3.0, -1.1)]
    waves = {
        k: -1j * size * np.exp(1j * phase) * unit_force(rig, name) for name, k, size, phase in parts
    }
    resolution = Resolution(tuple(range(26)), 2048)
    balance = HarmonicBalance(rig, PeriodicMarch(law), PeriodicLoad(waves), resolution)
    motion = balance.solve(frequency, 1.0)
    assert motion.converged
    assert motion.cycle.dissipated[0] > 0.1
    forces = CombinedForces(
        tuple(
            HarmonicForce(unit_force(rig, name), size, k * frequency, phase)
            for name, k, size, phase in parts
        )
    )
    steps, periods = 600, 30
    control = TimeStepControl(1.0 / frequency / steps)
    marched = integrate(rig, law, forces, periods / frequency, control)
    last = marched.displacement[-steps - 1 : -1]
    swing, wanted = last - last.mean(axis=0), motion.displacement(steps)
    wanted = wanted - wanted.mean(axis=0)
    np.testing.assert_allclose(swing, wanted, atol=2e-3 * np.abs(wanted).max())
    lost = marched.energies.joints[-1, 0] - marched.energies.joints[-steps - 1, 0]
    assert lost == pytest.approx(motion.cycle.dissipated[0], rel=2e-3)
