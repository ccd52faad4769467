"""Parallel sliders with one displacement, as one joint, marched over a period.

The joints of Masing and Iwan consist of parallel sliders, which together follow any concave curve.
For a structure they are a single joint, whose force is their sum; each slider has its own
dissipated energy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sa_solver.types import Array
from wear.joints.jenkins import Jenkins
from wear.joints.parameters import JointError
from wear.joints.periodic.march import SLIP, STICK, PeriodicMarch, SettledCycle, driven_by


@dataclass(frozen=True)
class SlidersCycle(SettledCycle):
    """Settled period of the joint.

    ``by_slider`` ``(n,)`` is the energy that each slider dissipates in it [N mm].
    """

    by_slider: Array


@dataclass(frozen=True)
class ParallelSliders:
    """One joint of parallel sliders, which have the ``(n,)`` parameters of a ``law``.

    The joint slips where less than half of its stiffness is left.

    Examples
    --------
    Two sliders with one displacement of ±0.02 mm each dissipate what they would alone:

    >>> import numpy as np
    >>> from wear.joints import Jenkins, ParallelSliders
    >>> law = Jenkins(np.array([1e4, 5e3]), friction=0.5, normal_load=np.array([100.0, 40.0]))
    >>> time = 2.0 * np.pi * np.arange(64) / 64
    >>> basis = np.stack([np.cos(time), np.sin(time)], axis=1)
    >>> cycle = ParallelSliders(law).settle(np.array([[[0.02], [0.0]]]), basis, basis.T / 32)
    >>> print(cycle.by_slider.round(9), law.loop_energy(0.02))
    [3.   1.28] [3.   1.28]
    """

    law: Jenkins

    @property
    def directions(self) -> int:
        return self.law.directions

    def settle(
        self, coefficients: Array, basis: Array, weights: Array, lead: Array | None = None
    ) -> SlidersCycle:
        """Return the settled period of the joint with the ``coefficients`` ``(1, m, 1)`` [mm].

        The arguments are those of :meth:`wear.joints.periodic.march.PeriodicMarch.settle`. Raise
        :class:`JointError` for more than one joint.
        """
        coefficients = driven_by(coefficients)
        if len(coefficients) != 1:
            raise JointError(
                f"the coefficients are of {len(coefficients)} joints, the sliders of one: give the "
                "coefficients of one joint"
            )
        stiffness = np.broadcast_to(self.law.stiffness, len(self.law.parameters))
        shared = np.repeat(coefficients, len(stiffness), axis=0)
        cycle = PeriodicMarch(self.law).settle(shared, basis, weights, lead)
        held = np.where(cycle.states == STICK, stiffness, 0.0).sum(axis=1)
        return SlidersCycle(
            force=cycle.force.sum(axis=0, keepdims=True),
            samples=cycle.samples.sum(axis=1, keepdims=True),
            states=np.where(held < 0.5 * stiffness.sum(), SLIP, STICK)[:, None],
            change=cycle.change.max(keepdims=True),
            differentiate=lambda: cycle.jacobian.sum(axis=0, keepdims=True),
            dissipate=lambda: cycle.dissipated.sum(keepdims=True),
            by_slider=cycle.dissipated,
        )
