"""Tests of vibration models that are built and run in Python."""

import warnings
from dataclasses import replace

import fretscale
import numpy as np
import pytest
import xarray

from fe_models.dynamics import Accuracy, HarmonicBalance, Link, Resolution, lumped_rig
from sa_solver import InputError
from tests.conftest import CASES
from wear.joints import Jenkins
from workflow.messages.warning_kinds import WarningKind
from workflow.models.vibration.results import LARGEST_ERROR
from workflow.shell.folders import steps

MASS, SPRING, RATIO = 1e-3, 1e3, 0.01


@pytest.fixture
def model():
    """Return a mass on a spring of equal stiffness as its joint, under a small force."""
    mass = lumped_rig({"m": MASS}, {Link("m"): SPRING}, [[Link("m")]], damping_ratio=RATIO)
    rig = fretscale.RigModel.of(mass, driven={"m": 1.0}, observed=["m"])
    law = Jenkins(stiffness=SPRING, friction=0.5, normal_load=20.0)
    sweep = fretscale.FrequencySweep(140.0, 250.0)
    return fretscale.VibrationModel(rig, law, (0.1,), sweep, Resolution((1, 3), 64))


def test_a_stuck_joint_is_a_spring(model):
    """The resonance is at sqrt(2 k/m), with amplitude F/(c ω), up to terms of ζ²."""
    results = model.run()
    response, angular = results["0.1 N"], np.sqrt(2.0 * SPRING / MASS)
    damping = 2.0 * RATIO * np.sqrt(SPRING * MASS)
    assert response.attrs["resonance"] == pytest.approx(angular / (2.0 * np.pi), rel=1e-4)
    assert response.attrs["amplitude"] == pytest.approx(0.1 / (damping * angular), rel=1e-4)
    assert response["slip"].max() == 0.0
    assert response["amplitude"].attrs["units"] == "mm"
    limit = np.interp(
        response["frequency"], results["linear"]["frequency"], results["linear"]["stuck"]
    )
    np.testing.assert_allclose(response["amplitude"][:, -1], 0.1 * limit, rtol=1e-3)


def test_a_sliding_joint_is_a_coulomb_damper(model):
    """At resonance, force and viscous damping leave 4 µN/π of harmonic 1 to friction."""
    accurate = replace(model.sweep, accuracy=Accuracy(1e-4))
    force = 1000.0
    response = replace(model, forces=(force,), sweep=accurate).run()[f"{force:g} N"]
    damping = 2.0 * RATIO * np.sqrt(SPRING * MASS)
    angular = 2.0 * np.pi * response.attrs["resonance"]
    expected = (force - 4.0 * 10.0 / np.pi) / (damping * angular)
    assert response.attrs["amplitude"] == pytest.approx(expected, rel=1e-3)


class Shares(fretscale.Observer):
    """Observer that collects what is reported as done."""

    def __init__(self):
        self.shares = []

    def reached(self, share):
        self.shares.append(share)


@pytest.mark.parametrize("upward", [True, False])
def test_observers_follow_a_curve_to_its_end(model, upward):
    watching = Shares()
    replace(model, sweep=replace(model.sweep, upward=upward)).run([watching])
    assert watching.shares == sorted(watching.shares)
    assert 0.0 < watching.shares[0] < 0.5
    assert watching.shares[-1] == pytest.approx(1.0)


class Interrupted(Shares):
    """Observer that interrupts a curve half-way."""

    def reached(self, share):
        super().reached(share)
        if share > 0.5:
            raise KeyboardInterrupt


def test_an_interrupted_curve_goes_on_from_its_checkpoint(model, tmp_path, monkeypatch):
    monkeypatch.setattr(steps, "SHARE", np.inf)  # every step is saved
    checkpoint, evaluated = fretscale.Checkpoint(tmp_path / "curve.h5"), []
    evaluate = HarmonicBalance.evaluate

    def counted(balance, *arguments):
        evaluated.append(1)
        return evaluate(balance, *arguments)

    monkeypatch.setattr(HarmonicBalance, "evaluate", counted)
    whole, work = model.run(), len(evaluated)
    with pytest.raises(KeyboardInterrupt):
        model.run([Interrupted()], checkpoint.steps(model))
    assert len(evaluated) > work
    xarray.testing.assert_identical(model.run(steps=checkpoint.steps(model)), whole)
    assert len(evaluated) == 2 * work  # no point was found again
    rougher = replace(model.law, friction=0.6)
    for wrong in (replace(model, forces=(0.2,)), replace(model, law=rougher)):
        with pytest.raises(fretscale.UserError, match="another model"):
            checkpoint.steps(wrong)


def test_a_curve_without_resonance_gives_a_warning(model):
    below = replace(model, sweep=fretscale.FrequencySweep(100.0, 120.0))
    with pytest.warns(fretscale.ModelWarning, match=r"0\.1 N") as reported:
        below.run()
    assert WarningKind.NO_RESONANCE.code in [each.message.code for each in reported]


def test_motions_less_accurate_than_asked_for_give_a_warning(model):
    """The third harmonic of a sliding joint is neither computed nor allowed here."""
    few = replace(model, forces=(100.0,), resolution=Resolution((1,), 64))

    def within(tolerance):
        return replace(model.sweep, accuracy=Accuracy(tolerance, highest=1, most_samples=64))

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        error = replace(few, sweep=within(0.5)).run()["100 N"].attrs["error"]
    assert 1e-4 < error < LARGEST_ERROR
    with pytest.warns(fretscale.ModelWarning, match=WarningKind.INACCURATE_MOTION.code):
        replace(few, sweep=within(0.5 * error)).run()


@pytest.mark.slow
def test_a_model_vibrates_as_its_case(tmp_path):
    case = fretscale.load_case(
        CASES / "rig_two_dof.yaml",
        forces=["40 N"],
        backbone=False,
        force_sweeps=[],
        stability="none",
        resolution__harmonics=3,
        resolution__samples=64,
    )
    written = fretscale.run(case, tmp_path / "out", quiet=True)
    response = fretscale.vibration_model(case).run()["40 N"]
    for name in ("frequency", "amplitude", "phase", "energy_per_cycle", "slip"):
        np.testing.assert_array_equal(response[name], written[f"responses/00000/{name}"].values)
    (numbers,) = written.summary["responses"]
    assert response.attrs["resonance"] == numbers["resonance"]
    assert response.attrs["damping"] == numbers["damping"]


def test_only_vibration_cases_have_such_a_model():
    with pytest.raises(fretscale.UserError):
        fretscale.vibration_model(CASES / "sphere_normal.yaml")


def test_forces_have_different_names(model):
    """Results of one name would replace each other."""
    for forces in ((0.1, 0.1), (0.1, 0.1 * (1.0 + 1e-9))):
        with pytest.raises(InputError, match="each once"):
            replace(model, forces=forces).run()
