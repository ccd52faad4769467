"""Numbers of ``summary.json``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def number_at(summary: Mapping[str, Any], path: str) -> float | None:
    """The number that a dotted path leads to; None where there is none."""
    node: Any = summary
    for key in path.split("."):
        if isinstance(node, list) and key.lstrip("-").isdecimal():
            place = int(key)
            node = node[place] if -len(node) <= place < len(node) else None
        else:
            node = node.get(key) if isinstance(node, Mapping) else None
    return None if isinstance(node, bool) or not isinstance(node, int | float) else float(node)
