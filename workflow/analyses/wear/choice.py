"""What is chosen for settings that a case leaves open, why, and how that is told."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from workflow.shell.reporter import Reporter


@dataclass(frozen=True)
class Decision:
    """What was chosen: ``value`` of the dotted ``entry``, ``why``, and the ``probe``'s numbers.

    ``also`` are entries that go with it. ``allowed`` is the share of the accuracy that it may use
    and ``error`` what it is estimated to use, both relative to depth and volume; None where there
    is no estimate. ``met`` says whether the estimate is within the share.
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


def since(begin: float) -> float:
    """Seconds since ``time.perf_counter()`` was ``begin``."""
    return round(time.perf_counter() - begin, 2)


def record_of(decisions: Sequence[Decision], accuracy: float, seconds: float) -> dict[str, Any]:
    """All that was decided so that ``accuracy`` is met, as JSON can say it."""
    return {
        "accuracy": accuracy,
        "budget": {decision.entry: decision.allowed for decision in decisions},
        "estimated_error": sum(decision.error or 0.0 for decision in decisions),
        "met": all(decision.met for decision in decisions),
        "chosen": {
            name: value for decision in decisions for name, value in decision.chosen.items()
        },
        "decisions": [asdict(decision) for decision in decisions],
        "seconds": seconds,
    }


def report_choice(
    record: Mapping[str, Any] | None, reporter: Reporter, again: bool = False
) -> None:
    """What was chosen and why, a line for each entry, and whether all of it is accurate enough.

    That it is not is a warning, which a run that goes on has ``again``; the rest it has told.
    """
    if record is None:
        return
    estimated, seconds = record["estimated_error"], record["seconds"]
    error = f"chosen: estimated error {estimated:.2%} of {record['accuracy']:.2%} required"
    if not again:
        for decision in record["decisions"]:
            reporter.say(f"chosen: {decision['entry']}: {decision['value']}: {decision['why']}")
        if record["met"]:
            reporter.say(f"{error}, within every share; probes took {seconds:.1f} s")
    if not record["met"]:
        missed = ", ".join(d["entry"] for d in record["decisions"] if not d["met"])
        reporter.warn(f"{error}, not within every share: {missed}")
