"""Long explicit steps of contacts at nodes by the Runge-Kutta-Chebyshev method.

Wear presses short waves of the surfaces away at once: dh/dN = F(h) is stiff. Its Jacobian resembles
that of diffusion, with real negative eigenvalues -λ. An explicit step of s stages of the method of
Sommeijer, Shampine and Verwer (1997, doi:10.1016/S0377-0427(97)00219-7) is of second order, and
stable for up to 2/3 (s² - 1) (1 - 2ε/15) / λ cycles. A step twice as long needs √2 times as many
solved cycles of a structure, and no derivative of F.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from math import ceil, sqrt

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebval

from sa_solver.types import Array
from wear.contact.nodes import NodalContact, NodalState
from wear.steps.steppers import ComparingStepper
from wear.worn import Cost, WearStep

DAMPING = 2.0 / 13.0
"""Damping ε: beyond 2 % of the stable length, a step leaves at most 1 - ε/3 of stiff waves."""

MARGIN = 1.1
"""Allowance for the growth of λ within a step as slip grows."""


ContactAt = Callable[[NodalState], NodalContact]


@dataclass(frozen=True)
class StabilisedStepper(ComparingStepper[NodalState, NodalContact]):
    """Stepper whose number of stages follows from the length of the step."""

    def _advance(
        self, state: NodalState, cycles: float, contact: NodalContact, at: ContactAt, last: bool
    ) -> WearStep[NodalState]:
        def rate(lost: Array) -> Array:
            stage = contact.worn(state, lost, cycles)
            return at(stage).rates(stage)

        # Explicit Euler is stable up to 2/λ.
        stages = stages_for(2.0 * MARGIN * cycles / contact.stable_cycles(state))
        lost = chebyshev_step(rate, contact.rates(state), cycles, stages)
        return WearStep(contact.worn(state, lost, cycles), cycles, Cost(stages, 0, 1))

    def _order(self, contact: NodalContact) -> float:
        return 2.0


def stages_for(decay: float) -> int:
    """Return the number of stages of a stable step, where ``decay`` is λ times its cycles."""
    return max(2, ceil(sqrt(1.0 + 1.5 * decay / (1.0 - 2.0 * DAMPING / 15.0))))


def chebyshev_step(
    rate: Callable[[Array], Array], first: Array, cycles: float, stages: int
) -> Array:
    """Return the wear in a step of ``cycles`` in at least two ``stages``.

    Parameters
    ----------
    rate
        Function that returns the rate of wear from the wear since the beginning of the step, in any
        shape.
    first
        Rate at the beginning.
    cycles
        Length of the step.
    stages
        Number of stages, two at least.
    """
    start, mixes = _coefficients(stages)
    before, now = np.zeros_like(first), start * cycles * first
    for mu, nu, last, initial in mixes:
        after = mu * now + nu * before + cycles * (last * rate(now) + initial * first)
        before, now = now, after
    return now


@cache
def _coefficients(stages: int) -> tuple[float, tuple[tuple[float, float, float, float], ...]]:
    """Return the coefficient of the first stage, and those of every further stage.

    The latter are μ, ν, and the factors of the rates at the last stage and at the beginning, as in
    (2.4) of the paper.
    """
    w0 = 1.0 + DAMPING / stages**2
    unit = np.eye(stages + 1)
    T, dT, ddT = (
        np.array([chebval(w0, chebder(row, order)) for row in unit]) for order in range(3)
    )
    w1 = dT[stages] / ddT[stages]
    b = np.empty(stages + 1)
    b[2:] = ddT[2:] / dT[2:] ** 2
    b[:2] = b[2]
    a = 1.0 - b * T
    mixes = []
    for j in range(2, stages + 1):
        mu, nu, last = (
            float(f)
            for f in (2.0 * b[j] * w0 / b[j - 1], -b[j] / b[j - 2], 2.0 * b[j] * w1 / b[j - 1])
        )
        mixes.append((mu, nu, last, -float(a[j - 1]) * last))
    return float(b[1] * w1), tuple(mixes)
