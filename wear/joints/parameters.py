"""Checked parameters of joint laws, and the response of a compiled kernel.

A kernel takes the parameters of ``n`` joints as one array ``(m, p)``, with a row per joint or a
single row for all of them, and loops over the joints. A call for a few joints costs microseconds,
most of it for the arrays that it returns.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import ClassVar

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array
from wear.joints.law import JointResponse, JointState

Parameter = float | Array


class JointError(InputError):
    """Parameters of a joint law are out of range, or arrays do not fit its joints."""


def settle_parameters(law: object, names: Iterable[str]) -> None:
    """Make parameters of a ``law`` numbers or arrays ``(n,)`` of one length, while it is made.

    Raises :class:`JointError` for what is neither.
    """
    for name in names:
        checks.settle(law, **{name: joint_values(name, getattr(law, name))})
    require_one_each(*(getattr(law, name) for name in names))


def joint_values(name: str, value: object) -> Parameter:
    """Return a number, or an array of them of any shape, that belongs to joints.

    Raises :class:`JointError` for anything else, and where one is masked. Whether they are finite
    is looked at with their range.
    """
    found = checks.array(f"values of {name}", value, None, error=JointError, finite=False)
    return found if found.ndim else float(found)


def amplitudes(value: object) -> Parameter:
    """Return amplitudes of a loop, a number or an array, unless one is below 0.

    Raises :class:`JointError`.
    """
    found = joint_values("amplitude", value)
    require_not_negative(amplitude=found)
    return found


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
        return JointResponse(*self.kernel(self.parameters, *self.fitting(state, increment)))

    def fitting(self, state: JointState, increment: Array) -> tuple[JointState, Array]:
        """Return ``state`` and ``increment`` ``(n, d)`` as a kernel takes them.

        Raise :class:`JointError` where the increment or the law does not fit the state.
        """
        # Iterations may come to numbers that are not finite, and find that out by themselves.
        state = checks.array("states", state, (None, None), error=JointError, finite=False)
        shape, laws = (len(state), self.directions), len(self.parameters)
        moved = checks.array("increments", increment, None, error=JointError, finite=False)
        if moved.shape != shape:
            raise JointError(f"the increment has shape {moved.shape}: it must be {shape}")
        if state.shape[1] < self.columns:
            raise JointError(f"states of {state.shape[1]} columns: give {self.columns}")
        if laws not in (1, len(state)):
            raise JointError(
                f"the law has parameters of {laws} joints, the state is of {len(state)}: give as "
                "many of both, or numbers as parameters"
            )
        return state, moved


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
        settle_parameters(self, [parameter.name for parameter in fields(self)])
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
