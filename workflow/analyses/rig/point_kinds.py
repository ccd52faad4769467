"""Points by name: each one, and all of a kind, such as pad 1, pad 2, ..."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

# Points without a kind that fit into a message.
MOST_LISTED = 12


def kind_of(point: str) -> str:
    """What a point's name begins with, before its number; nothing where it has none."""
    kind, _, number = point.rpartition(" ")
    return kind if number.isdecimal() else ""


def matching(points: Sequence[str], wanted: str) -> list[str]:
    """The point of that name, or all of that kind; none if there are none."""
    if wanted in points:
        return [wanted]
    return [point for point in points if wanted and kind_of(point) == wanted]


def known(points: Sequence[str]) -> str:
    """The points that there are, those of a kind together."""
    kinds = Counter(map(kind_of, points))
    told = [f"{kind}, {kind} 1 to {kind} {count}" for kind, count in kinds.items() if kind]
    single = [point for point in points if not kind_of(point)]
    more = [f"and {len(single) - MOST_LISTED} more"] if len(single) > MOST_LISTED else []
    return ", ".join([*told, *single[:MOST_LISTED], *more])
