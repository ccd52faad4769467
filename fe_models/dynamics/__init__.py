"""Structures that vibrate with joints: models, excitations, motion in time and periodic motion.

M x'' + C x' + K x = f(t) - Bᵀ F(B x), with joint laws F that are handed over, such as those of
``wear.joints``. What most uses begin with:

- ``DynamicModel``: mass, damping, stiffness and where the joints are
- ``lumped_rig``, ``reduced_rig``, ``Link``: it, from masses, springs and a reduced body
- ``unit_force``, ``natural_frequencies``: a force on one of its points; its modes
- ``ConstantForce``, ``HarmonicForce``, ``HammerBlow``, ``RecordedForce``, ``CombinedForces``
- ``integrate``, ``TimeStepControl``: the motion in time, by Newmark's average acceleration
- ``HarmonicBalance``, ``PeriodicLoad``, ``Resolution``: periodic motions, by their harmonics
- ``along_frequency``, ``along_force``: branches of them, folds included
- ``along_phase_resonance``: the backbone of a resonance
- ``ContinuationControl``, ``Accuracy``: the steps along a branch, how fine its motions are
- ``frequency_response``, ``ring_down``: what a hammer's blow shows

A mass of 1 kg on a spring of 1 N/µm, struck by a hammer: it vibrates at its natural frequency, and
the energy of the blow goes into the damper.

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

from fe_models.lazy import lazy_names

if TYPE_CHECKING:
    from fe_models.dynamics.continuation import ContinuationControl as ContinuationControl
    from fe_models.dynamics.excitation import CombinedForces as CombinedForces
    from fe_models.dynamics.excitation import ConstantForce as ConstantForce
    from fe_models.dynamics.excitation import HammerBlow as HammerBlow
    from fe_models.dynamics.excitation import HarmonicForce as HarmonicForce
    from fe_models.dynamics.excitation import RecordedForce as RecordedForce
    from fe_models.dynamics.forced_response import Accuracy as Accuracy
    from fe_models.dynamics.forced_response import along_force as along_force
    from fe_models.dynamics.forced_response import along_frequency as along_frequency
    from fe_models.dynamics.free_decay import ring_down as ring_down
    from fe_models.dynamics.harmonic_balance import HarmonicBalance as HarmonicBalance
    from fe_models.dynamics.harmonic_balance import PeriodicLoad as PeriodicLoad
    from fe_models.dynamics.harmonics import Resolution as Resolution
    from fe_models.dynamics.impact_hammer import frequency_response as frequency_response
    from fe_models.dynamics.model import DynamicModel as DynamicModel
    from fe_models.dynamics.newmark import TimeStepControl as TimeStepControl
    from fe_models.dynamics.newmark import integrate as integrate
    from fe_models.dynamics.phase_resonance import along_phase_resonance as along_phase_resonance
    from fe_models.dynamics.rig import Link as Link
    from fe_models.dynamics.rig import lumped_rig as lumped_rig
    from fe_models.dynamics.rig import natural_frequencies as natural_frequencies
    from fe_models.dynamics.rig import reduced_rig as reduced_rig
    from fe_models.dynamics.rig import unit_force as unit_force

_MODULES = {
    "Accuracy": "forced_response",
    "CombinedForces": "excitation",
    "ConstantForce": "excitation",
    "ContinuationControl": "continuation",
    "DynamicModel": "model",
    "HammerBlow": "excitation",
    "HarmonicBalance": "harmonic_balance",
    "HarmonicForce": "excitation",
    "Link": "rig",
    "PeriodicLoad": "harmonic_balance",
    "RecordedForce": "excitation",
    "Resolution": "harmonics",
    "TimeStepControl": "newmark",
    "along_force": "forced_response",
    "along_frequency": "forced_response",
    "along_phase_resonance": "phase_resonance",
    "frequency_response": "impact_hammer",
    "integrate": "newmark",
    "lumped_rig": "rig",
    "natural_frequencies": "rig",
    "reduced_rig": "rig",
    "ring_down": "free_decay",
    "unit_force": "rig",
}
__all__ = [*_MODULES]
__getattr__ = lazy_names(__name__, _MODULES)
