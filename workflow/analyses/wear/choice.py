"""Choices of settings that a case leaves open: decisions, their reasons and their report."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from workflow.case.text.readable import percent
from workflow.shell.terminal.reporter import Reporter


@dataclass(frozen=True)
class Decision:
    """Decision on one setting: the ``value`` of a dotted ``entry``, the reason, and probe results.

    ``also`` are entries that go with it. ``allowed`` is the part of the accuracy that the setting
    may use and ``error`` the estimated part it uses, both relative to depth and volume; None
    without an estimate. ``met`` says whether the estimate is within the allowed part.
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
        """Values of all entries of the decision."""
        return {self.entry: self.value, **self.also}


def since(begin: float) -> float:
    """Return the seconds since ``time.perf_counter()`` returned ``begin``."""
    return round(time.perf_counter() - begin, 2)


def record_of(decisions: Sequence[Decision], accuracy: float, seconds: float) -> dict[str, Any]:
    """Return the decisions that are to meet ``accuracy`` as data for JSON."""
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
    """Report each choice with its reason, and whether the total error meets the accuracy.

    A resumed run sets ``again``: it repeats only the warning that the accuracy is not met.
    """
    if record is None:
        return
    estimated, seconds = record["estimated_error"], record["seconds"]
    error = (
        f"chosen: estimated error {percent(estimated)} of {percent(record['accuracy'])} required"
    )
    if not again:
        for decision in record["decisions"]:
            reporter.say(f"chosen: {decision['entry']}: {decision['value']}: {decision['why']}")
        if record["met"]:
            reporter.say(f"{error}, every share met; probes took {seconds:.1f} s")
    if not record["met"]:
        missed = ", ".join(d["entry"] for d in record["decisions"] if not d["met"])
        reporter.warn(f"{error}, shares not met: {missed}")
