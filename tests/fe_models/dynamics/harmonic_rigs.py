"""Rigs whose steady vibration several test modules compute."""

from __future__ import annotations

from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.periodic.load import PeriodicLoad
from fe_models.dynamics.rig import Link, lumped_rig, unit_force
from tests.oracles.two_mass_rig import two_mass_rig
from wear.joints.jenkins import Jenkins
from wear.joints.periodic.march import PeriodicMarch

EXACT = 1e-9
KT, MU, LOAD = 45e3, 0.88, 60.0
REACH = MU * LOAD / KT
JENKINS = PeriodicMarch(Jenkins(KT, MU, LOAD))
ODD = tuple(range(1, 16, 2))


def rig(ratio=0.001):
    """Return the rig of the thesis."""
    return two_mass_rig((21.152e-3, 1.189e-3), (1.3469e3, 273e3), ratio)


def sine(model, name="m1"):
    return PeriodicLoad({1: -1j * unit_force(model, name)})


def balance(model, joints=JENKINS, harmonics=ODD, samples=256, load=None):
    return HarmonicBalance(model, joints, load or sine(model), Resolution(harmonics, samples))


def contact_rig():
    """Return a mass on springs along x and y, which only its contact holds along z."""
    return lumped_rig(
        {"x": 2e-3, "y": 2e-3, "z": 2e-3},
        {Link("x"): 500.0, Link("y"): 700.0},
        [[Link("x"), Link("y"), Link("z")]],
        0.01,
    )


def pressed(model, load, tangential, normal=0.0):
    waves = {1: tangential * unit_force(model, "x") + normal * unit_force(model, "z")}
    return PeriodicLoad(waves, load * unit_force(model, "z"))
