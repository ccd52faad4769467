"""What the laws along one direction share: checked parameters, and a compiled kernel's response.

A kernel takes the parameters of ``n`` joints as one array ``(m, p)``, a row per joint or a single
row for all of them, and loops over the joints: a call for a few of them then costs microseconds,
most of it in making the arrays it returns.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np

from sa_solver.errors import InputError
from sa_solver.types import Array
from wear.joints.law import JointResponse, JointState

Parameter = float | Array
ResponseKernel = Callable[[Array, Array, Array], tuple[Array, Array, Array, Array]]


class JointError(InputError):
    """Parameters that a joint law cannot have, or arrays that do not fit its joints."""


def require_positive(**values: Parameter) -> None:
    """Raise :class:`JointError` naming the first of ``values`` that is not above 0 throughout."""
    for name, value in values.items():
        given = np.asarray(value)
        if not ((given > 0.0) & (given < np.inf)).all():
            raise JointError(f"{name} of a joint is {value}: it must be finite and above 0")


def require_not_negative(**values: Parameter) -> None:
    """Raise :class:`JointError` naming the first of ``values`` that is somewhere below 0."""
    for name, value in values.items():
        given = np.asarray(value)
        if not ((given >= 0.0) & (given < np.inf)).all():
            raise JointError(f"{name} of a joint is {value}: it must be finite and 0 or more")


def require_one_each(*values: Parameter) -> None:
    """Raise :class:`JointError` unless ``values`` are numbers or arrays of one length."""
    shapes = {np.shape(value) for value in values} - {()}
    if len(shapes) > 1 or any(len(shape) > 1 for shape in shapes):
        given = ", ".join(str(shape) for shape in sorted(shapes))
        raise JointError(
            f"parameters have the shapes {given}: each must be a number or one per joint"
        )


def parameter_columns(*values: Parameter) -> Array:
    """Parameters, numbers or ``(n,)``, as columns ``(m, p)``; one row where all are numbers."""
    columns = np.empty((max(np.size(value) for value in values), len(values)))
    for place, value in enumerate(values):
        columns[:, place] = value
    return columns


def kernel_response(
    kernel: ResponseKernel, parameters: Array, state: JointState, increment: Array
) -> JointResponse:
    """Advance the joints of ``state`` by ``increment`` ``(n, 1)`` [mm].

    Raises :class:`JointError` where shapes differ: the kernel itself checks no bounds.
    """
    joints = len(state)
    if increment.shape != (joints, 1):
        raise JointError(f"the increment has shape {increment.shape}: it must be ({joints}, 1)")
    if len(parameters) not in (1, joints):
        raise JointError(f"the law is that of {len(parameters)} joints, the state of {joints}")
    return JointResponse(*kernel(parameters, state, np.ascontiguousarray(increment, float)))


@dataclass(frozen=True)
class UniaxialLaw:
    """What the laws along one direction have in common: parameters, as numbers or ``(n,)``.

    ``stiffness`` [N/mm] of the stuck joint, ``friction`` µ, ``normal_load`` N [N] and
    ``residual_stiffness`` [N/mm], what is left of the slope when all of it slides. Raises
    :class:`JointError` for what they cannot be.
    """

    stiffness: Parameter
    friction: Parameter
    normal_load: Parameter
    residual_stiffness: Parameter = 0.0

    def __post_init__(self) -> None:
        require_one_each(*(getattr(self, parameter.name) for parameter in fields(self)))
        require_positive(stiffness=self.stiffness)
        require_not_negative(
            friction=self.friction,
            normal_load=self.normal_load,
            residual_stiffness=self.residual_stiffness,
        )

    @property
    def directions(self) -> int:
        return 1

    @property
    def limit(self) -> Array:
        """µN [N], the force when all of it slides."""
        return np.multiply(self.friction, self.normal_load)
