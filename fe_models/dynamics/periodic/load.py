"""Periodic loads on a structure, by their harmonics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fe_models.dynamics.periodic.harmonics import ComplexArray, HarmonicBalanceError, Resolution
from sa_solver import checks
from sa_solver.types import Array


@dataclass(frozen=True)
class PeriodicLoad:
    """Periodic forces on a structure [N], by harmonic.

    Parameters
    ----------
    waves
        Complex amplitudes w ``(n,)`` of the harmonics for a force of 1. The force is Re w
        exp(ikωt), so that -1j makes a sine.
    static
        Constant force ``(n,)``, independent of the force factor.
    inertial
        Amplitudes ``(n,)`` [N s²] by harmonic that are multiplied by the square of the angular
        frequency. For a ground that moves with the displacement X along a rigid translation r they
        are M r X; displacements are then relative to the ground.

    Examples
    --------
    A sine of twice the frequency acts together with a constant force F. The latter moves the mass
    by F / k, since a joint without friction transmits nothing.

    >>> import numpy as np
    >>> from fe_models.dynamics import *
    >>> from wear.joints import Jenkins, PeriodicMarch
    >>> rig = lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]], damping_ratio=0.02)
    >>> point = unit_force(rig, "m")
    >>> load = PeriodicLoad({2: -1j * point}, static=5.0 * point)
    >>> free = PeriodicMarch(Jenkins(stiffness=1e3, friction=0.0, normal_load=10.0))
    >>> problem = HarmonicBalance(rig, free, load, Resolution((0, 1, 2), 64))
    >>> motion = problem.solve(frequency=20.0, force=1.0)
    >>> print(f"{motion.amplitude(0, harmonic=0).real:.4f} mm of {5.0 / 1e3:.4f}")
    0.0050 mm of 0.0050
    """

    waves: Mapping[int, ComplexArray]
    static: Array | None = None
    inertial: Mapping[int, ComplexArray] = field(default_factory=dict)

    @property
    def harmonics(self) -> set[int]:
        """Harmonics of the load, without the static one."""
        return {*self.waves, *self.inertial}

    def amplitude(self, harmonic: int, angular: float, force: float) -> ComplexArray:
        """Return the complex amplitude ``(n,)`` [N] of the load in one harmonic.

        Parameters
        ----------
        harmonic
            Number of the harmonic.
        angular
            Its angular frequency kω [rad/s].
        force
            Force factor of the load.
        """
        nothing = np.zeros(1)
        growing = self.waves.get(harmonic, nothing)
        growing = growing + angular**2 * self.inertial.get(harmonic, nothing)
        constant = nothing if harmonic or self.static is None else self.static
        return np.asarray(force * growing + constant, dtype=complex)

    def __post_init__(self) -> None:
        found: dict[str, dict[int, ComplexArray]] = {"waves": {}, "inertial": {}}
        for name, waves in found.items():
            for harmonic, wave in getattr(self, name).items():
                checks.whole("a harmonic", harmonic, HarmonicBalanceError)
                what = f"forces of harmonic {harmonic}"
                waves[harmonic] = checks.complex_array(
                    what, wave, (None,), error=HarmonicBalanceError
                )
        checks.settle(self, **found)
        if self.static is not None:
            static = checks.array("static forces", self.static, (None,), error=HarmonicBalanceError)
            checks.settle(self, static=static)

    def check(self, resolution: Resolution, size: int) -> None:
        """Raise :class:`HarmonicBalanceError` unless a problem of ``size`` displacements fits."""
        lacking = sorted(self.harmonics - set(resolution.harmonics))
        static = self.static is not None and np.any(self.static)
        if lacking or (static and resolution.harmonics[0] != 0):
            raise HarmonicBalanceError(
                f"the load has harmonics {lacking or [0]}, which the resolution lacks: add them"
            )
        forces = [*self.waves.values(), *self.inertial.values()]
        lengths = {len(force) for force in forces}
        lengths.add(size if self.static is None else len(self.static))
        if lengths != {size}:
            raise HarmonicBalanceError(
                f"forces on {sorted(lengths)} displacements of a structure of {size}: give as many"
            )
