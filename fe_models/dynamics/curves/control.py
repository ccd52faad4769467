"""How long the steps along a curve of solutions may be, and when it is given up."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from sa_solver import checks
from sa_solver.errors import InputError


@dataclass(frozen=True)
class ContinuationControl:
    """Steps along a curve, as shares of the unknowns and of λ.

    ``first``, ``least`` and ``most`` sizes; ``iterations`` of Newton's method that are wanted, and
    ``max_iterations``, after which a step is halved; ``max_angle`` [degrees] by which the tangent
    may turn in one step; ``max_points`` on one curve; ``tolerance`` of Newton's method.
    Each new λ is told to ``watch``. Raises InputError for sizes that are not above zero, and for
    counts below one.

    Examples
    --------
    A branch whose points are limited says that it did not get to the end:

    >>> import numpy as np
    >>> from fe_models.dynamics import *
    >>> from wear.joints import Jenkins, PeriodicMarch
    >>> rig = lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]], damping_ratio=0.02)
    >>> load = PeriodicLoad({1: -1j * unit_force(rig, "m")})
    >>> law = Jenkins(stiffness=1e3, friction=0.5, normal_load=10.0)
    >>> problem = HarmonicBalance(rig, PeriodicMarch(law), load, Resolution((1,), 64))
    >>> control = ContinuationControl(max_points=3)
    >>> branch = along_frequency(problem, 1.0, (100.0, 300.0), control=control)
    >>> print(branch.message.partition(" and ")[0], branch.frequencies.max() < 300.0)
    the curve has 3 points True
    """

    first: float = 0.02
    least: float = 1e-6
    most: float = 0.3
    iterations: int = 4
    max_iterations: int = 8
    max_angle: float = 30.0
    max_points: int = 2000
    tolerance: float = 1e-10
    watch: Callable[[float], None] = lambda parameter: None

    def __post_init__(self) -> None:
        sizes = ("first", "least", "most", "max_angle", "tolerance")
        checks.numbers(self, *sizes, above=0.0, infinite=True)
        for name in ("iterations", "max_iterations", "max_points"):
            if checks.whole(name, getattr(self, name)) < 1:
                raise InputError(f"{name} = {getattr(self, name)}: give 1 or more")
