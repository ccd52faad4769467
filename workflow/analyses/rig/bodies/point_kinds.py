"""Points by name: single ones, and all of a kind, such as pad 1, pad 2, ..."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

# Most points without a kind that a message lists.
MOST_LISTED = 12


def kind_of(point: str) -> str:
    """Return the part of a point's name before its number, or an empty text if it has no number."""
    kind, _, number = point.rpartition(" ")
    return kind if number.isdecimal() else ""


def matching(points: Sequence[str], wanted: str) -> list[str]:
    """Return the point of that name, or all points of that kind; empty if there are none."""
    if wanted in points:
        return [wanted]
    return [point for point in points if wanted and kind_of(point) == wanted]


def known(points: Sequence[str]) -> str:
    """Return a list of all points as text, with those of a kind together."""
    kinds = Counter(map(kind_of, points))
    reported = [f"{kind}, {kind} 1 to {kind} {count}" for kind, count in kinds.items() if kind]
    single = [point for point in points if not kind_of(point)]
    more = [f"and {len(single) - MOST_LISTED} more"] if len(single) > MOST_LISTED else []
    return ", ".join([*reported, *single[:MOST_LISTED], *more])
