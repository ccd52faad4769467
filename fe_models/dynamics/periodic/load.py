"""Periodic forces on a structure, by their harmonics.

    f(t) = s + a Re Σ (w_k + (kω)² v_k) exp(ikωt)

with the force a, and a load s that does not grow with it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fe_models.dynamics.periodic.harmonics import ComplexArray, HarmonicBalanceError
from sa_solver import checks
from sa_solver.types import Array


@dataclass(frozen=True)
class PeriodicLoad:
    """Forces on the structure [N].

    ``waves`` gives the complex amplitudes ``(n,)`` of its harmonics, for a force of 1: with w the
    force is Re w exp(ikωt), so that -1j makes a sine. ``static`` ``(n,)`` does not grow with the
    force. ``inertial`` gives amplitudes ``(n,)`` [N s²] by harmonic that are multiplied by the
    square of its angular frequency: those of a ground that moves by a given way X along a rigid
    translation r are M r X, of displacements relative to the ground.

    Examples
    --------
    A sine of twice the frequency, and a force that stays: it moves the mass by F / k, as a joint
    without friction holds nothing.

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

    def require(self, size: int) -> None:
        """Raise :class:`HarmonicBalanceError` unless forces are those on ``size`` displacements."""
        forces = [*self.waves.values(), *self.inertial.values()]
        lengths = {len(force) for force in forces} | {
            size if self.static is None else len(self.static)
        }
        if lengths != {size}:
            raise HarmonicBalanceError(
                f"forces on {sorted(lengths)} displacements of a structure of {size}: give as many"
            )

    @property
    def harmonics(self) -> set[int]:
        """Those of the force."""
        return {*self.waves, *self.inertial}

    def amplitude(self, harmonic: int, angular: float, force: float) -> ComplexArray:
        """Return the load ``(n,)`` of a harmonic at a frequency [rad/s], under a force."""
        nothing = np.zeros(1)
        growing = self.waves.get(harmonic, nothing)
        growing = growing + angular**2 * self.inertial.get(harmonic, nothing)
        constant = nothing if harmonic or self.static is None else self.static
        return np.asarray(force * growing + constant, dtype=complex)
