"""Masing's rule for distributed sliders: loops with memory, without the individual sliders.

A joint of sliders with distributed limits (Iwan 1966) follows a curve T(d) on first loading, where
d is the distance from rest. After a reversal at d1 with the force F1 it follows the same curve
doubled, F = F1 ∓ 2 T(|d - d1|/2). An inner loop that closes is forgotten, and the curve that it
left continues as if the loop had not occurred (Masing 1926; for sliders Iwan, J. Appl. Mech. 33,
1966, 893). The turning points of the loops still open are therefore all the memory of the joint.

The energy lost is exact too. A loop of amplitude d encloses 8 W - 4 d T, with W = ∫ T. A slider
that slips by s on first loading slips by 2 s on each of the two branches of the loop. On the first
curve the loss is a quarter of the loop's, L(d) = 2 W - d T, and on a doubled one 2 L(|d - d1|/2).

Here T is that of sliders distributed by a power law up to a largest reach φ, at which all remaining
sliders slip at once; with x = d/φ < 1

    T = K φ (x - c x^m / m),   φ = limit / (K (1 - c/m)),
    L = K φ² c x^(m+1) (m - 1) / (m (m + 1)),

and T = limit, L = L(φ) + limit (d - φ) beyond. K is the stiffness when all sliders stick, c the
share of it that the distributed sliders have, and m > 1 the exponent of their distribution. c = 1,
m = 2 is the uniform Iwan joint, c = 0 the Jenkins element.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property
from math import copysign

import numpy as np
from numba import vectorize

from sa_solver.types import Array
from wear.joints.compiled import compiled
from wear.joints.law import JointState
from wear.joints.parameters import Parameter, UniaxialLaw, amplitudes, parameter_columns

SliderCurve = tuple[float, float, float, float]
"""Parameters K, limit, c and m of the curve."""

# Columns of a state: displacement; number of turning points; the curve (K, limit, c, m) to which
# the forces of the turning points belong; then displacement and force of each turning point.
DISPLACEMENT, DEPTH, CURVE, POINTS = 0, 1, 2, 6
# Number of turning points for which a state at rest has room; a steady cycle needs two.
FEWEST_POINTS = 4


@compiled()
def first_curve(curve: SliderCurve, distance: float) -> tuple[float, float, float]:
    """Return T, T' and L at ``distance`` >= 0 on the curve (K, limit, c, m)."""
    stiffness, limit, share, exponent = curve
    reach = limit / (stiffness * (1.0 - share / exponent))
    x, beyond = 1.0, distance - reach
    if beyond < 0.0:
        x, beyond = distance / reach, 0.0
    # A power takes longer than everything else, and the uniform joint does not need one.
    power = share * (x if exponent == 2.0 else x ** (exponent - 1.0))
    lost = (
        stiffness * reach * reach * power * x * x * (exponent - 1.0) / (exponent * (exponent + 1.0))
    )
    if x < 1.0:
        return stiffness * distance * (1.0 - power / exponent), stiffness * (1.0 - power), lost
    return limit, 0.0, lost + limit * beyond


@compiled()
def _on_curve(
    curve: SliderCurve, memory: Array, depth: int, displacement: float
) -> tuple[float, float, float]:
    """Return force, slope and energy lost since the last of ``depth`` turning points, or rest."""
    if depth == 0:
        force, slope, lost = first_curve(curve, abs(displacement))
        return copysign(force, displacement), slope, lost
    place = POINTS + 2 * (depth - 1)
    distance = displacement - memory[place]
    force, slope, lost = first_curve(curve, 0.5 * abs(distance))
    return memory[place + 1] + copysign(2.0 * force, distance), slope, 2.0 * lost


@compiled()
def _refresh_forces(curve: SliderCurve, memory: Array) -> None:
    """Compute the forces at the turning points again if they belong to other parameters."""
    if (memory[CURVE], memory[CURVE + 1], memory[CURVE + 2], memory[CURVE + 3]) == curve:
        return
    for depth in range(int(memory[DEPTH])):
        place = POINTS + 2 * depth
        memory[place + 1] = _on_curve(curve, memory, depth, memory[place])[0]
    for i in range(4):
        memory[CURVE + i] = curve[i]


@compiled()
def turns(memory: Array, depth: int, end: float) -> bool:
    """Return whether a motion to ``end`` reverses on the present curve."""
    start: float = memory[DISPLACEMENT]
    origin: float = 0.0 if depth == 0 else memory[POINTS + 2 * (depth - 1)]
    return start != origin and (end > start) != (start > origin)


@compiled()
def _closing(memory: Array, depth: int) -> float:
    """Return where the present loop, the last of ``depth``, closes and the outer curve resumes."""
    closing: float = -memory[POINTS] if depth == 1 else memory[POINTS + 2 * (depth - 2)]
    return closing


@compiled()
def advance_masing(
    curve: SliderCurve, residual: float, memory: Array, increment: float
) -> tuple[float, float, float]:
    """Advance one joint by one increment, and change its ``memory`` in place.

    Return force, tangent and energy lost. ``memory`` is the row of a state and must have room for
    one more turning point. Each increment adds at most one turning point, and each is removed once:
    the effort per increment is constant on average.
    """
    _refresh_forces(curve, memory)
    here, depth, lost = memory[DISPLACEMENT], int(memory[DEPTH]), 0.0
    end = here + increment
    if end == here:
        force, slope, _ = _on_curve(curve, memory, depth, end)
        return force + residual * end, slope + residual, 0.0
    if turns(memory, depth, end):
        place = POINTS + 2 * depth
        memory[place + 1] = _on_curve(curve, memory, depth, here)[0]
        memory[place] = here
        depth += 1
    sign = copysign(1.0, increment)
    while depth > 0:
        closing = _closing(memory, depth)
        if sign * (closing - end) > 0.0:
            break
        lost += _on_curve(curve, memory, depth, closing)[2]
        lost -= _on_curve(curve, memory, depth, here)[2]
        here, depth = closing, max(depth - 2, 0)
    force, slope, since = _on_curve(curve, memory, depth, end)
    lost += since - _on_curve(curve, memory, depth, here)[2]
    memory[DISPLACEMENT], memory[DEPTH] = end, depth
    # The loss is a sum of differences of an increasing function: only rounding makes it negative.
    return force + residual * end, slope + residual, max(lost, 0.0)


@compiled()
def _columns_for(state: JointState) -> int:
    """Return the number of columns with room for one more turning point.

    It is doubled when full, and halved when mostly empty.
    """
    needed = 0
    for j in range(len(state)):
        needed = max(needed, POINTS + 2 * (int(state[j, DEPTH]) + 1))
    columns: int = state.shape[1]
    if needed > columns:
        return 2 * columns
    if 4 * needed < columns:
        return columns // 2
    return columns


@compiled()
def _respond(
    parameters: Array, state: JointState, increment: Array
) -> tuple[Array, Array, Array, Array]:
    joints = len(state)
    force, tangent = np.empty((joints, 1)), np.empty((joints, 1, 1))
    new, lost = np.zeros((joints, _columns_for(state))), np.empty(joints)
    for j in range(joints):
        joint = parameters[j % len(parameters)]
        used = POINTS + 2 * int(state[j, DEPTH])
        new[j, :used] = state[j, :used]
        curve = (joint[0], joint[2], joint[3], joint[4])
        force[j, 0], tangent[j, 0, 0], lost[j] = advance_masing(
            curve, joint[1], new[j], increment[j, 0]
        )
    return force, tangent, new, lost


@vectorize(cache=True)  # type: ignore[no-untyped-call]
def _loop_energy(
    amplitude: float, stiffness: float, limit: float, share: float, exponent: float
) -> float:
    return 4.0 * first_curve((stiffness, limit, share, exponent), amplitude)[2]


@dataclass(frozen=True)
class MasingLaw(UniaxialLaw):
    """Base class of joints with distributed sliders.

    All parameters are numbers or ``(n,)``. Raises :class:`wear.joints.parameters.JointError` if one
    is out of range.

    A state stores displacements. If parameters change, its forces become those of a joint that has
    always had the new ones; the energy that the change releases is not counted as dissipated. Any
    number of open loops is remembered, at the cost of copying 16 bytes each per call.

    Parameters
    ----------
    stiffness
        Stiffness K when all sliders stick [N/mm].
    friction
        Coefficient of friction µ.
    normal_load
        Normal load N [N]; µN is the force when all sliders slide.
    residual_stiffness
        Stiffness kr in parallel with the sliders [N/mm].
    """

    columns = POINTS + 2 * FEWEST_POINTS
    kernel = staticmethod(_respond)

    @property
    @abstractmethod
    def spread(self) -> tuple[Parameter, Parameter]:
        """Share c of the stiffness, and exponent m of the distribution, of distributed sliders."""

    @cached_property
    def parameters(self) -> Array:
        return parameter_columns(self.stiffness, self.residual_stiffness, self.limit, *self.spread)

    def loop_energy(self, amplitude: Parameter) -> Array:
        """Return the energy of a cycle between ± ``amplitude`` [mm]: 4 L(A) [N mm]."""
        energy: Array = _loop_energy(
            amplitudes(amplitude), self.stiffness, self.limit, *self.spread
        )
        return energy
