"""Tests of motions in time that are built and run in Python."""

from dataclasses import replace

import fretscale
import numpy as np
import pytest
import xarray

from fe_models.dynamics import (
    HammerBlow,
    HarmonicForce,
    Link,
    RecordedForce,
    TimeStepControl,
    lumped_rig,
)
from sa_solver.errors import InputError
from wear.joints import Jenkins
from workflow.messages.warning_kinds import WarningKind
from workflow.shell.folders import steps

MASS, SPRING, FORCE, FREQUENCY = 1e-3, 1e3, 10.0, 50.0


@pytest.fixture
def model():
    """Return a mass on a spring whose joint has no friction, driven for four cycles."""
    mass = lumped_rig({"m": MASS}, {Link("m"): SPRING}, [[Link("m")]])
    rig = fretscale.RigModel.of(mass, driven={"m": 1.0}, observed=["m"])
    law = Jenkins(stiffness=SPRING, friction=0.0, normal_load=20.0)
    force = HarmonicForce(rig.driven, FORCE, FREQUENCY)
    return fretscale.MotionModel(rig, law, force, 4.0 / FREQUENCY, TimeStepControl(2e-5))


def test_a_free_mass_beats_between_force_and_spring(model):
    """From rest, x = F (sin ωt - ω/ω0 sin ω0 t) / (k - m ω²)."""
    motion = model.run()
    times = motion["time"].values
    driven, free = 2.0 * np.pi * FREQUENCY, np.sqrt(SPRING / MASS)
    expected = np.sin(driven * times) - driven / free * np.sin(free * times)
    expected *= FORCE / (SPRING - MASS * driven**2)
    off = np.abs(motion["displacement"].values[:, 0] - expected).max() / np.abs(expected).max()
    assert off < 1.5 * motion.attrs["step_error"] < 1e-2
    assert motion["dissipated"].values[-1] == 0.0
    assert motion["acceleration"].attrs["units"] == "mm/s^2"


def test_a_sliding_joint_dissipates_what_its_force_moves(model):
    """Far above its friction, the joint loses 4 µN x of every cycle; energies balance."""
    rubbing = replace(model, law=replace(model.law, friction=1e-3, stiffness=1e5))
    motion = rubbing.run()
    moved = np.abs(np.diff(motion["displacement"].values[:, 0])).sum()
    assert motion["dissipated"].values[-1] == pytest.approx(0.02 * moved, rel=1e-2)
    assert motion.attrs["balance_error"] < 1e-2


def test_long_steps_give_a_warning(model):
    with pytest.warns(fretscale.ModelWarning, match=WarningKind.LONG_TIME_STEPS.code):
        replace(model, control=TimeStepControl(1e-3)).run()


@pytest.mark.parametrize(
    "force",
    [
        HarmonicForce(np.ones(1), FORCE, FREQUENCY),
        HammerBlow(np.ones(1), FORCE, duration=2e-3),
        RecordedForce(np.ones(1), np.array([0.0, 1e-3, 0.1]), np.zeros(3)),
    ],
)
def test_a_step_resolves_the_force(model, force):
    """Steps longer than a blow would miss it."""
    replace(model, force=force, control=TimeStepControl(force.longest_step))
    with pytest.raises(InputError, match="does not resolve the force"):
        replace(model, force=force, control=TimeStepControl(1.1 * force.longest_step))


def test_a_motion_without_force_is_warned_of(model):
    """A blow after the end of the motion would give none, without an error."""
    late = HammerBlow(np.ones(1), FORCE, duration=2e-3, start=5.0)
    with pytest.warns(fretscale.ModelWarning, match="nothing moves"):
        replace(model, force=late).run()


def test_rows_are_recorded_before_the_end(model):
    with pytest.raises(InputError, match="none is recorded"):
        replace(model, control=TimeStepControl(2e-5, every=10**6))


class Counted(HarmonicForce):
    """Force that counts how often it is evaluated, and interrupts the run after so many times."""

    count, most = 0, np.inf

    def value(self, times):
        type(self).count += 1
        if self.count > self.most:
            raise KeyboardInterrupt
        return super().value(times)


def test_an_interrupted_motion_goes_on_from_its_checkpoint(model, tmp_path, monkeypatch):
    monkeypatch.setattr(steps, "SHARE", np.inf)  # every step is saved
    checkpoint = fretscale.Checkpoint(tmp_path / "motion.h5")
    force = Counted(model.rig.driven, FORCE, FREQUENCY)
    counted = replace(model, force=force)
    whole, work = counted.run(), Counted.count
    monkeypatch.setattr(Counted, "count", 0)
    monkeypatch.setattr(Counted, "most", int(0.75 * work))
    with pytest.raises(KeyboardInterrupt):
        counted.run(steps=checkpoint.steps(counted))
    monkeypatch.setattr(Counted, "count", 0)
    xarray.testing.assert_identical(counted.run(steps=checkpoint.steps(counted)), whole)
    assert Counted.count < 0.7 * work
    other = replace(counted, law=replace(counted.law, stiffness=1.01 * SPRING))
    with pytest.raises(fretscale.UserError, match="another model"):
        checkpoint.steps(other)


class Shares(fretscale.Observer):
    """Observer that collects what is reported as done."""

    def __init__(self):
        self.shares = []

    def reached(self, share):
        self.shares.append(share)


def test_observers_follow_a_motion_to_its_end(model, capsys):
    watching = Shares()
    model.run([watching, fretscale.Progress()])
    assert watching.shares == sorted(watching.shares)
    assert watching.shares[-1] == pytest.approx(1.0)
    assert capsys.readouterr().err.splitlines()[-1] == "100 %"
