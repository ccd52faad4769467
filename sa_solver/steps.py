"""Long computations in steps whose results can be stored, so that an interrupted run can resume.

A method passes its steps to a :class:`Steps` object and knows nothing of files. The result of a
step must follow from the state of the method before the step, and the method must use nothing of
the step but its result. A run that reads the result of a step from an earlier run then ends in the
same state, bit for bit, as a run that computes it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeVar

T = TypeVar("T")


class Steps(Protocol):
    """Runner of the steps of a method, which takes them in the order in which they are passed.

    A step may have steps of its own. ``name`` identifies a step.
    """

    def __call__(self, name: str, step: Callable[[], T]) -> T:
        """Return the result of ``step``, computed or read from storage."""
        ...

    def march(self, name: str, state: T, advance: Callable[[T], T | None]) -> T:
        """Return the last state of a sequence in which each state follows from the one before.

        ``advance`` returns the next state, or None after the last. Only the latest state is needed
        to continue.
        """
        ...


class _Computed:
    """Runner that computes every step and stores nothing."""

    def __call__(self, name: str, step: Callable[[], T]) -> T:
        return step()

    def march(self, name: str, state: T, advance: Callable[[T], T | None]) -> T:
        while (following := advance(state)) is not None:
            state = following
        return state


COMPUTED: Steps = _Computed()
"""Runner for methods that need not resume: every step is computed, nothing is stored."""
