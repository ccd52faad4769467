"""Exceptions of the libraries: a common base class, and two kinds that a caller can act on.

Every exception of ``sa_solver``, ``wear`` and ``fe_models`` is a :class:`FretscaleError`. Each is
also a ValueError or a RuntimeError, so that code which does not know these classes can still handle
them. A message is one sentence that says what is wrong and what to give or try instead.
"""

from __future__ import annotations

from typing import Any


class FretscaleError(Exception):
    """Base class of all exceptions that fretscale raises on purpose."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Return what pickles the exception with its cause, which tells the kind of a failure.

        Python pickles no cause, so that an exception of a worker process would lose it.
        """
        reduced = super().__reduce__()
        assert isinstance(reduced, tuple)  # the class and its arguments
        cause = self.__cause__ if isinstance(self.__cause__, FretscaleError) else None
        return *reduced[:2], {**vars(self), "__cause__": cause}


class InputError(FretscaleError, ValueError):
    """Invalid input: data that are meaningless or admit no solution."""


class ConvergenceError(FretscaleError, RuntimeError):
    """Failure of a numerical method to converge, although a solution may exist."""


class ContactProblemError(InputError):
    """Contact problem without a solution: invalid fields, or loads that no contact can carry."""
