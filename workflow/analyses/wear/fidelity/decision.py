"""What an axis of fidelity is, what it decides, and the share of the accuracy that it may use."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from workflow.analyses.wear.structures.dovetail.case import DovetailCase


@dataclass(frozen=True)
class Decision:
    """What one axis chose: ``value`` of the dotted ``entry``, ``why``, and the ``probe``'s numbers.

    ``also`` are entries that go with it. ``allowed`` is the axis' share of the accuracy and
    ``error`` what it is estimated to use, both relative to depth and volume; None where there is
    no estimate. ``met`` says whether the estimate is within the share.
    """

    entry: str
    value: Any
    why: str
    probe: dict[str, Any] = field(default_factory=dict)
    also: dict[str, Any] = field(default_factory=dict)
    allowed: float | None = None
    error: float | None = None
    met: bool = True
    seconds: float = 0.0

    @property
    def chosen(self) -> dict[str, Any]:
        """Values of all entries."""
        return {self.entry: self.value, **self.also}


@dataclass(frozen=True)
class Axis:
    """An approximation: its main ``entry``, its ``share`` of the accuracy, and who decides.

    ``decide`` is given the case as the axes before it left it, and the error that it may make.
    """

    entry: str
    share: float
    decide: Callable[[DovetailCase, float], Decision]
