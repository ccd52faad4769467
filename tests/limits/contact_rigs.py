"""A body on a contact, and the rig of the thesis, at the limits of harmonic balance."""

from __future__ import annotations

import numpy as np

from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.periodic.load import PeriodicLoad
from fe_models.dynamics.rig import Link, lumped_rig, unit_force
from tests.oracles.two_mass_rig import two_mass_rig
from wear.joints.friction_contact import FrictionContact
from wear.joints.jenkins import Jenkins
from wear.joints.periodic.march import PeriodicMarch

SOLVED = 1e-8
KT, KN, MU = 300.0, 400.0, 0.5
ALONG = ("x", "y", "z")


def body(normal=900.0, ratio=0.01):
    """Return a mass on springs with one contact; without ``normal`` only that holds it along z."""
    springs = {Link("x"): 500.0, Link("y"): 700.0}
    if normal:
        springs[Link("z")] = normal
    joint = [Link(name) for name in ALONG]
    return lumped_rig(dict.fromkeys(ALONG, 2e-3), springs, [joint], ratio)


def balance(model, law, waves, static=0.0, highest=5, samples=128):
    """Return the balance of a model under cosines ``waves`` and a ``static`` load along z."""
    wave = sum(amplitude * unit_force(model, name) for name, amplitude in waves.items())
    load = PeriodicLoad({1: wave}, static * unit_force(model, "z"))
    resolution = Resolution(tuple(range(highest + 1)), samples)
    return HarmonicBalance(model, PeriodicMarch(law), load, resolution)


def contact(load=0.0, gap=0.0):
    return FrictionContact(KT, KN, MU, load, gap)


def linear(model, held, frequency, force):
    """Return complex amplitudes ``(n,)`` of a structure with joint springs ``held`` ``(j d,)``."""
    omega = 2.0 * np.pi * frequency
    stiffness = model.stiffness + model.connection.T @ np.diag(held) @ model.connection
    dynamic = stiffness + 1j * omega * model.damping - omega**2 * model.mass
    return np.linalg.solve(dynamic, force)


def rig(highest=15, samples=256):
    """Return the thesis's rig with one Jenkins joint."""
    model = two_mass_rig((21.152e-3, 1.189e-3), (1.3469e3, 273e3), 0.001)
    load = PeriodicLoad({1: -1j * unit_force(model, "m1")})
    harmonics = tuple(range(1, highest + 1, 2))
    joints = PeriodicMarch(Jenkins(45e3, 0.88, 60.0))
    return HarmonicBalance(model, joints, load, Resolution(harmonics, samples))
