"""Largest numbers of steps and points of a run, and usual values.

A run beyond these limits would hardly end, and is most likely due to a mistaken unit. Models and
cases refuse it before anything is computed, with the number that it would take.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from sa_solver.errors import InputError
from workflow.messages.warning_kinds import Notice, WarningKind

if TYPE_CHECKING:
    from wear.contact.interface import FirstContact
    from wear.coupled_state import CoupledState
    from wear.schedule import CoupledSettings

MOST_JUMPS = 100_000
"""Wear jumps of a run, and explicit steps: each solves contacts, which takes milliseconds or more,
and the results have the fields after every jump.
"""

MOST_TIME_STEPS = 100_000_000
"""Time steps of a motion: each takes some 20 µs, so that these take about an hour."""

MOST_RECORDED = 500_000_000
"""Numbers in the recorded rows of a motion: 4 GB."""

MOST_POINTS = 1000
"""Points of a section over its depth: each convolves the tractions of the whole contact."""

MOST_CELLS = 4096**2
"""Cells of the grid of a contact."""

MOST_INCREMENTS = 100_000
"""Increments of a cycle of loads: each is a contact problem."""

USUAL_FRICTION = 0.02, 1.2
"""Usual coefficients of friction: lubricated surfaces to clean metals."""


def check_count(what: str, count: float, most: int, remedy: str) -> None:
    """Raise InputError if a run takes a ``count`` of more than ``most``; ``what`` are counted."""
    if count > most:
        raise InputError(f"{count:.3g} {what}, and at most {most} are possible: {remedy}")


def check_steps(
    settings: CoupledSettings,
    fraction: float | None,
    state: CoupledState[Any],
    first: Sequence[FirstContact],
) -> None:
    """Raise InputError if a run would take too many jumps, or too many explicit steps.

    Jumps of a given size are counted at the wear rates of the ``state``, explicit steps of a
    ``fraction`` of their stability limit at that of the ``first`` contacts.
    """
    if fraction is not None:
        count = settings.cycles / (fraction * min(found.stable_cycles for found in first))
        check_count("explicit wear steps", count, MOST_JUMPS, "give a larger fraction, or no steps")
    if settings.automatic or settings.ended(state):
        return
    count = settings.left(state) / settings.next_jump(state)
    check_count("wear jumps", count, MOST_JUMPS, "give a longer jump, or none")


def unstable_fraction(fraction: float | None) -> Iterator[Notice]:
    """Yield the warning for explicit steps of a ``fraction`` above their stability limit."""
    if fraction is not None and fraction > 1.0:
        yield Notice(
            WarningKind.UNSTABLE_STEPS,
            f"explicit steps of {fraction:g} times their stability limit amplify the roughness of "
            "the grid; usual: 0.9 or less",
        )
