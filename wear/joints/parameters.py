"""What the joint laws share: checked parameters, and a compiled kernel's response.

A kernel takes the parameters of ``n`` joints as one array ``(m, p)``, a row per joint or a single
row for all of them, and loops over the joints: a call for a few of them then costs microseconds,
most of it in making the arrays it returns.
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
    """Parameters that a joint law cannot have, or arrays that do not fit its joints."""


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
    """Raise :class:`JointError` unless a parameter is ``proper`` throughout."""
    if not np.all(proper):
        raise JointError(f"{name} of a joint is {value}: it must be {range_text}")


def require_positive(**values: Parameter) -> None:
    """Raise :class:`JointError` naming the first of ``values`` that is not above 0 throughout."""
    for name, value in values.items():
        given = np.asarray(value)
        require(name, value, (given > 0.0) & (given < np.inf), "finite and above 0")


def require_not_negative(**values: Parameter) -> None:
    """Raise :class:`JointError` naming the first of ``values`` that is somewhere below 0."""
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
    """Parameters, numbers or ``(n,)``, as columns ``(m, p)``; one row where all are numbers."""
    columns = np.empty((max(np.size(value) for value in values), len(values)))
    for place, value in enumerate(values):
        columns[:, place] = value
    return columns


class CompiledLaw(ABC):
    """A law whose response is that of a compiled loop over its joints.

    A state at rest has so many ``columns``.
    """

    directions: ClassVar[int]
    columns: ClassVar[int]

    @staticmethod
    @abstractmethod
    def kernel(
        parameters: Array, state: Array, increment: Array
    ) -> tuple[Array, Array, Array, Array]:
        """The loop: all that :class:`JointResponse` holds."""

    @property
    @abstractmethod
    def parameters(self) -> Array:
        """What compiled loops take, ``(n, p)``, or ``(1, p)`` where all are numbers."""

    def rest(self, joints: int) -> JointState:
        """State of ``joints`` joints that have never moved."""
        return np.zeros((joints, self.columns))

    def respond(self, state: JointState, increment: Array) -> JointResponse:
        """Advance the joints of ``state`` by ``increment`` ``(n, d)`` [mm].

        Raises :class:`JointError` where shapes differ: the kernel itself checks no bounds.
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
            raise JointError(f"the law is that of {laws} joints, the state of {len(state)}")
        return JointResponse(*self.kernel(self.parameters, state, moved))


@dataclass(frozen=True)
class UniaxialLaw(CompiledLaw):
    """What the laws along one direction have in common: parameters, as numbers or ``(n,)``.

    ``stiffness`` [N/mm] of the stuck joint, ``friction`` µ, ``normal_load`` N [N] and
    ``residual_stiffness`` [N/mm], what is left of the slope when all of it slides. Raises
    :class:`JointError` for what they cannot be.
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
        """Energy lost in a settled cycle between ± ``amplitude`` [mm], in [N mm]."""

    @property
    def limit(self) -> Array:
        """µN [N], the force when all of it slides."""
        return np.multiply(self.friction, self.normal_load)
