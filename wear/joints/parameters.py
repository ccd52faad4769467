"""Checked parameters of joint laws, and the response of a compiled kernel.

A kernel takes the parameters of ``n`` joints as one array ``(m, p)``, with a row per joint or a
single row for all of them, and loops over the joints. A call for a few joints costs microseconds,
most of it for the arrays that it returns.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, fields
from typing import ClassVar

import numpy as np

from sa_solver.errors import InputError
from sa_solver.types import Array
from wear.joints.law import JointResponse, JointState

Parameter = float | Array


class JointError(InputError):
    """Parameters of a joint law are out of range, or arrays do not fit its joints."""


def require(name: str, value: Parameter, proper: np.ndarray, range_text: str) -> None:
    """Raise :class:`JointError` unless a parameter is ``proper`` for every joint."""
    if not np.all(proper):
        raise JointError(f"{name} of a joint is {value}: it must be {range_text}")


def require_positive(**values: Parameter) -> None:
    """Raise :class:`JointError` with the name of the first of ``values`` that is not positive."""
    for name, value in values.items():
        given = np.asarray(value)
        require(name, value, (given > 0.0) & (given < np.inf), "finite and above 0")


def require_not_negative(**values: Parameter) -> None:
    """Raise :class:`JointError` with the name of the first of ``values`` that is negative."""
    for name, value in values.items():
        given = np.asarray(value)
        require(name, value, (given >= 0.0) & (given < np.inf), "finite and 0 or more")


def require_one_each(*values: Parameter) -> None:
    """Raise :class:`JointError` unless ``values`` are numbers or arrays of one length."""
    shapes = {np.shape(value) for value in values} - {()}
    if len(shapes) > 1 or any(len(shape) > 1 for shape in shapes):
        given = ", ".join(str(shape) for shape in sorted(shapes))
        raise JointError(
            f"parameters have the shapes {given}: each must be a number or one per joint"
        )


def parameter_columns(*values: Parameter) -> Array:
    """Return parameters, numbers or ``(n,)``, as columns ``(m, p)``; one row if all are numbers."""
    columns = np.empty((max(np.size(value) for value in values), len(values)))
    for place, value in enumerate(values):
        columns[:, place] = value
    return columns


class CompiledLaw(ABC):
    """Base class of laws whose response is a compiled loop over joints.

    ``columns`` is the number of columns of a state at rest.
    """

    directions: ClassVar[int]
    columns: ClassVar[int]

    @staticmethod
    @abstractmethod
    def kernel(
        parameters: Array, state: Array, increment: Array
    ) -> tuple[Array, Array, Array, Array]:
        """Advance all joints in a compiled loop; return the fields of :class:`JointResponse`."""

    @property
    @abstractmethod
    def parameters(self) -> Array:
        """Parameters for compiled loops ``(n, p)``, or ``(1, p)`` if all are numbers."""

    def rest(self, joints: int) -> JointState:
        """Return the state of ``joints`` joints that have never moved."""
        return np.zeros((joints, self.columns))

    def respond(self, state: JointState, increment: Array) -> JointResponse:
        """Advance the joints of ``state`` by ``increment`` ``(n, d)`` [mm].

        Raise :class:`JointError` if shapes differ: the kernel itself checks no bounds.
        """
        return JointResponse(*self.kernel(self.parameters, state, self.fitting(state, increment)))

    def fitting(self, state: JointState, increment: Array) -> Array:
        """Return ``increment`` ``(n, d)`` as a kernel takes it.

        Raises :class:`JointError` where the increment or the law does not fit the state.
        """
        shape, laws = (len(state), self.directions), len(self.parameters)
        if increment.shape != shape:
            raise JointError(f"the increment has shape {increment.shape}: it must be {shape}")
        if laws not in (1, len(state)):
            raise JointError(
                f"the law has parameters of {laws} joints, the state is of {len(state)}: give as "
                "many of both, or numbers as parameters"
            )
        return np.ascontiguousarray(increment, float)


@dataclass(frozen=True)
class UniaxialLaw(CompiledLaw):
    """Base class of laws along one direction with friction.

    All parameters are numbers or ``(n,)``. Raises :class:`JointError` if one is out of range.

    Parameters
    ----------
    stiffness
        Stiffness of the sticking joint [N/mm].
    friction
        Coefficient of friction µ.
    normal_load
        Normal load N [N].
    residual_stiffness
        Stiffness that remains when all of the joint slides [N/mm].
    """

    directions = 1

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

    @abstractmethod
    def loop_energy(self, amplitude: Parameter) -> Array:
        """Return the energy of a settled cycle between ± ``amplitude`` [mm] in N mm."""

    @property
    def limit(self) -> Array:
        """Force µN when all of the joint slides [N]."""
        return np.multiply(self.friction, self.normal_load)
