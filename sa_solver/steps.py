"""Long work in steps whose results somebody may keep, so that whoever is cut off goes on from them.

A method hands its steps over and knows nothing of files. What a step gives follows from what the
method knows before it, and a method remembers nothing else of it: then a step that is taken from
what an earlier run has kept leads to the same end, bit for bit, as one that is computed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeVar

T = TypeVar("T")


class Steps(Protocol):
    """Whoever takes the steps of a method, one after the other, in the order they are handed over.

    A step may have steps of its own. ``name`` says what a step is.
    """

    def __call__(self, name: str, step: Callable[[], T]) -> T:
        """What a ``step`` gives."""
        ...

    def march(self, name: str, state: T, advance: Callable[[T], T | None]) -> T:
        """The last of states of which each follows from the one before, which is then forgotten.

        ``advance`` gives the next, None after the last.
        """
        ...


class _Computed:
    """Every step is computed, nothing is kept."""

    def __call__(self, name: str, step: Callable[[], T]) -> T:
        return step()

    def march(self, name: str, state: T, advance: Callable[[T], T | None]) -> T:
        while (following := advance(state)) is not None:
            state = following
        return state


COMPUTED: Steps = _Computed()
"""Steps of a method that nobody interrupts."""
