"""Newton's method for r(u, λ) = 0: one solution at a given λ, or across a curve's tangent."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from typing import Generic, Protocol, TypeVar

import numpy as np

from fe_models.dynamics.curves.bordered import GMRES_TOLERANCE, LinearMap, solve_alone
from fe_models.dynamics.curves.sizes import norm
from sa_solver.types import Array

# Share of the residual that an iterative solver may leave. Newton's method squares a small relative
# residual: more digits than that has are lost again. But near a resonance what leaves little of a
# residual may be far from the solution: with 1e-3, curves take half as many evaluations again.
LOOSEST_TOLERANCE = 1e-4


class Linearisation(Protocol):
    """r ``(n,)``, ∂r/∂u, ∂r/∂λ ``(n,)``, and the norm of the terms r is the sum of.

    ∂r/∂u is a matrix ``(n, n)``, or what multiplies like one. ``relative`` is the residual's norm
    over ``size``: 0 if it vanishes, infinite if it is not a number.
    """

    @property
    def residual(self) -> Array: ...
    @property
    def jacobian(self) -> Array | LinearMap: ...
    @property
    def slope(self) -> Array: ...
    @property
    def size(self) -> float: ...
    @property
    def relative(self) -> float: ...


L = TypeVar("L", bound=Linearisation)
L_co = TypeVar("L_co", bound=Linearisation, covariant=True)


class Equations(Protocol[L_co]):
    """r(u, λ) and its derivatives, for u ``(n,)``."""

    def __call__(self, unknowns: Array, parameter: float) -> L_co: ...


@dataclass(frozen=True)
class NewtonControl:
    """When Newton's method has converged, and when it is given up.

    ``max_shortened``: how often a correction that does not lower the residual is halved.
    ``patience``: so many iterations in a row without a new least residual end it; None: any number.
    """

    tolerance: float = 1e-10
    max_iterations: int = 25
    max_shortened: int = 5
    patience: int | None = None


@dataclass(frozen=True)
class NewtonSolution(Generic[L]):
    """Unknowns for a parameter, the equations there, and a message if they are not solved."""

    unknowns: Array
    at: L
    iterations: int
    message: str

    @property
    def converged(self) -> bool:
        return not self.message


def solve(
    equations: Equations[L],
    unknowns: Array,
    parameter: float,
    control: NewtonControl | None = None,
) -> NewtonSolution[L]:
    """Newton's method at a given λ."""
    control = control or NewtonControl()
    last = iterate(
        lambda trial: equations(trial, parameter),
        lambda at: solve_alone(at.jacobian, -at.residual, linear_tolerance(at)),
        unknowns,
        control,
    )
    message = (
        ""
        if last.at.relative <= control.tolerance
        else f"Newton's method leaves a residual of {last.at.relative:.2g} at {parameter:g} after "
        f"{last.iterations} iterations: start from a solution nearby"
    )
    return NewtonSolution(last.unknowns, last.at, last.iterations, message)


def linear_tolerance(at: Linearisation) -> float:
    """Share of the residual that an iterative linear solver may leave of it."""
    return min(max(at.relative, GMRES_TOLERANCE), LOOSEST_TOLERANCE)


def iterate(
    equations_at: Callable[[Array], L],
    correction_of: Callable[[L], Array],
    unknowns: Array,
    control: NewtonControl,
) -> NewtonSolution[L]:
    """Newton's method from given unknowns; what it has when it ends, converged or not.

    A correction that does not lower the residual is shortened. Where shortening does not help, a
    corner of the equations is in the way, and the whole correction leads to its other side.
    """
    at = equations_at(unknowns)
    least, waited = at.relative, 0
    for iteration in range(control.max_iterations):
        if at.relative <= control.tolerance or not isfinite(at.relative):
            return NewtonSolution(unknowns, at, iteration, "")
        if waited == control.patience:
            return NewtonSolution(unknowns, at, iteration, "")
        try:
            correction = correction_of(at)
        except np.linalg.LinAlgError:
            return NewtonSolution(unknowns, at, iteration, "")
        left, whole = norm(at.residual), unknowns + correction
        trial = whole_at = equations_at(whole)
        shortened = 0
        while norm(trial.residual) >= left and shortened < control.max_shortened:
            shortened += 1
            trial = equations_at(unknowns + 0.5**shortened * correction)
        if norm(trial.residual) < left:
            unknowns, at = unknowns + 0.5**shortened * correction, trial
        else:
            unknowns, at = whole, whole_at
        waited = 0 if at.relative < least else waited + 1
        least = min(least, at.relative)
    return NewtonSolution(unknowns, at, control.max_iterations, "")
