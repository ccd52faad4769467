"""Structures that vibrate with joints: models, excitations, motion in time and periodic motion.

The equation of motion is M x'' + C x' + K x = f(t) - Bᵀ F(B x). The caller supplies the joint laws
F, for example those of ``wear.joints``. The main entry points are:

- ``DynamicModel``: mass, damping and stiffness matrices, and the positions of the joints
- ``lumped_rig``, ``reduced_rig``, ``Link``: a model built from masses, springs and a reduced body
- ``damped``: a model with Rayleigh damping, a loss factor or dashpots added
- ``unit_force``, ``natural_frequencies``: a force on one point of a model; its modes
- ``ConstantForce``, ``HarmonicForce``, ``HammerBlow``, ``RecordedForce``, ``CombinedForces``
- ``integrate``, ``TimeStepControl``: time integration by Newmark's average acceleration
- ``HarmonicBalance``, ``PeriodicLoad``, ``Resolution``: periodic motions by harmonic balance
- ``along_frequency``, ``along_force``: branches of periodic motions, folds included
- ``motions_at``: all motions of a branch at one frequency
- ``along_phase_resonance``: the backbone curve of a resonance
- ``along_nonlinear_mode``, ``LinearMode``: frequency and damping of a mode against its amplitude
- ``HarmonicBalance.of_sector``, with :mod:`fe_models.dynamics.rings.sector`: one sector of a
  cyclically symmetric ring under a travelling wave
- ``Floquet``: stability of periodic motions
- ``ContinuationControl``, ``Accuracy``: step sizes along a branch, and resolution of its motions
- ``frequency_response``, ``ring_down``: evaluation of impact-hammer tests

In the example a hammer strikes a mass of 1 kg on a spring of 1 N/µm. The mass vibrates at its
natural frequency, and the damper dissipates the energy of the blow.

>>> from fe_models.dynamics import HammerBlow, Link, TimeStepControl
>>> from fe_models.dynamics import integrate, lumped_rig, natural_frequencies, unit_force
>>> rig = lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]], damping_ratio=0.01)
>>> print(f"{natural_frequencies(rig)[0]:.2f} Hz")
159.15 Hz
>>> blow = HammerBlow(unit_force(rig, "m"), peak=100.0, duration=1e-3)
>>> energies = integrate(rig, None, blow, 0.2, TimeStepControl(1e-4)).energies
>>> print(f"{energies.damping[-1] / energies.excitation[-1]:.2f} dissipated")
0.98 dissipated
"""

from typing import TYPE_CHECKING

from sa_solver.lazy import lazy_names

if TYPE_CHECKING:
    from fe_models.dynamics.curves.crossings import motions_at
    from fe_models.dynamics.curves.curve_steps import ContinuationControl
    from fe_models.dynamics.curves.forced_response import along_force, along_frequency
    from fe_models.dynamics.curves.motion_recorder import Accuracy
    from fe_models.dynamics.curves.nonlinear_mode import LinearMode, along_nonlinear_mode
    from fe_models.dynamics.curves.phase_resonance import along_phase_resonance
    from fe_models.dynamics.damping import damped
    from fe_models.dynamics.excitation import (
        CombinedForces,
        ConstantForce,
        HammerBlow,
        HarmonicForce,
        RecordedForce,
    )
    from fe_models.dynamics.model import DynamicModel
    from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
    from fe_models.dynamics.periodic.harmonics import Resolution
    from fe_models.dynamics.periodic.load import PeriodicLoad
    from fe_models.dynamics.rig import (
        Link,
        lumped_rig,
        natural_frequencies,
        reduced_rig,
        unit_force,
    )
    from fe_models.dynamics.stability.floquet import Floquet
    from fe_models.dynamics.transient.free_decay import ring_down
    from fe_models.dynamics.transient.impact_hammer import frequency_response
    from fe_models.dynamics.transient.newmark import TimeStepControl, integrate

__all__ = [
    "Accuracy",
    "CombinedForces",
    "ConstantForce",
    "ContinuationControl",
    "DynamicModel",
    "Floquet",
    "HammerBlow",
    "HarmonicBalance",
    "HarmonicForce",
    "LinearMode",
    "Link",
    "PeriodicLoad",
    "RecordedForce",
    "Resolution",
    "TimeStepControl",
    "along_force",
    "along_frequency",
    "along_nonlinear_mode",
    "along_phase_resonance",
    "damped",
    "frequency_response",
    "integrate",
    "lumped_rig",
    "motions_at",
    "natural_frequencies",
    "reduced_rig",
    "ring_down",
    "unit_force",
]

__getattr__, __dir__ = lazy_names(__name__)
