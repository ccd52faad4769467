"""Newton's method for r(u, λ) = 0: a solution at a given λ, or across the tangent of a curve."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from typing import Generic, Protocol, TypeVar

import numpy as np

from fe_models.dynamics.curves.bordered import GMRES_TOLERANCE, LinearMap, solve_alone
from fe_models.dynamics.curves.sizes import norm
from sa_solver.types import Array

# Loosest relative residual of an iterative linear solver. Newton's method squares a small relative
# residual, so that more accurate corrections are useless. But near a resonance a small residual may
# be far from the solution: with 1e-3, curves need half as many evaluations again.
LOOSEST_TOLERANCE = 1e-4


class Linearisation(Protocol):
    """Protocol of linearised equations: r ``(n,)``, ∂r/∂u, ∂r/∂λ ``(n,)``, and their size.

    ``jacobian`` ∂r/∂u is a matrix ``(n, n)`` or a linear map. ``size`` is the norm of the terms
    whose sum is r. ``relative`` is the norm of r over ``size``: 0 if r vanishes, infinite if it is
    not finite.
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
    """Protocol of equations r(u, λ) and their derivatives, for unknowns u ``(n,)``."""

    def __call__(self, unknowns: Array, parameter: float, /) -> L_co: ...


@dataclass(frozen=True)
class NewtonControl:
    """Criteria by which Newton's method has converged or is stopped.

    Parameters
    ----------
    tolerance
        Relative residual of a solution.
    max_iterations
        Largest number of iterations.
    max_shortened
        How often a correction that does not reduce the residual is halved.
    patience
        Number of iterations in a row without a new smallest residual after which the method stops;
        None for any number.
    """

    tolerance: float = 1e-10
    max_iterations: int = 25
    max_shortened: int = 5
    patience: int | None = None


@dataclass(frozen=True)
class NewtonSolution(Generic[L]):
    """Result of Newton's method: unknowns and equations; ``message`` says why it failed, if so."""

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
    """Solve r(u, λ) = 0 at a given λ by Newton's method.

    Parameters
    ----------
    equations
        The equations.
    unknowns
        Initial guess ``(n,)``.
    parameter
        λ.
    control
        Criteria of convergence.
    """
    control = control or NewtonControl()
    result = iterate(
        lambda trial: equations(trial, parameter),
        lambda at: solve_alone(at.jacobian, -at.residual, linear_tolerance(at)),
        unknowns,
        control,
    )
    message = (
        ""
        if result.at.relative <= control.tolerance
        else f"Newton's method leaves a residual of {result.at.relative:.2g} at {parameter:g} "
        f"after {result.iterations} iterations: start from a solution nearby"
    )
    return NewtonSolution(result.unknowns, result.at, result.iterations, message)


def linear_tolerance(at: Linearisation) -> float:
    """Return the relative residual that an iterative linear solver may leave."""
    return min(max(at.relative, GMRES_TOLERANCE), LOOSEST_TOLERANCE)


def iterate(
    equations_at: Callable[[Array], L],
    correction_of: Callable[[L], Array],
    unknowns: Array,
    control: NewtonControl,
) -> NewtonSolution[L]:
    """Iterate Newton's method, and return its last state whether converged or not.

    A correction that does not reduce the residual is shortened. If shortening does not help, the
    equations have a kink there, and the full correction is taken to its other side.

    Parameters
    ----------
    equations_at
        Function that returns the equations at unknowns.
    correction_of
        Function that returns the correction for the equations there.
    unknowns
        Initial guess.
    control
        Criteria of convergence.
    """
    at = equations_at(unknowns)
    smallest, without_progress = at.relative, 0
    for iteration in range(control.max_iterations):
        if at.relative <= control.tolerance or not isfinite(at.relative):
            return NewtonSolution(unknowns, at, iteration, "")
        if without_progress == control.patience:
            return NewtonSolution(unknowns, at, iteration, "")
        try:
            correction = correction_of(at)
        except np.linalg.LinAlgError:
            return NewtonSolution(unknowns, at, iteration, "")
        residual_norm, full_step = norm(at.residual), unknowns + correction
        trial = at_full_step = equations_at(full_step)
        halvings = 0
        while norm(trial.residual) >= residual_norm and halvings < control.max_shortened:
            halvings += 1
            trial = equations_at(unknowns + 0.5**halvings * correction)
        if norm(trial.residual) < residual_norm:
            unknowns, at = unknowns + 0.5**halvings * correction, trial
        else:
            unknowns, at = full_step, at_full_step
        without_progress = 0 if at.relative < smallest else without_progress + 1
        smallest = min(smallest, at.relative)
    return NewtonSolution(unknowns, at, control.max_iterations, "")
