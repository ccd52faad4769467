"""Choices of settings that a case leaves open: decisions, their reasons and their report."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from workflow.case.text.readable import percent
from workflow.messages.warning_kinds import WarningKind
from workflow.shell.terminal.reporter import Reporter

# Relative tolerance on an error that equals its allowed part except for rounding.
ROUNDING = 1e-9


@dataclass(frozen=True)
class Decision:
    """Decision on one setting: the ``chosen`` values by dotted entry, the main one first, and why.

    ``allowed`` is the part of the accuracy that the setting may use and ``error`` the estimated
    part it uses, both relative to depth and volume; None without an estimate. ``probe`` has the
    results of probe runs.
    """

    chosen: Mapping[str, Any]
    why: str
    allowed: float | None = None
    error: float | None = None
    probe: Mapping[str, Any] = field(default_factory=dict)
    seconds: float = 0.0

    @property
    def value(self) -> Any:
        """Value of the main entry."""
        return next(iter(self.chosen.values()))

    @property
    def met(self) -> bool:
        """True if the estimated error is within the allowed part, or no part is allotted."""
        if self.allowed is None:
            return True
        return self.error is not None and self.error <= self.allowed * (1.0 + ROUNDING)

    def timed(self, begin: float) -> Decision:
        """Return the decision with the seconds since ``time.perf_counter()`` returned ``begin``."""
        return replace(self, seconds=_since(begin))

    @property
    def record(self) -> dict[str, Any]:
        """The decision as data for JSON."""
        (entry, value), *also = self.chosen.items()
        further = {**vars(self), "also": dict(also), "met": self.met}
        del further["chosen"]
        return {"entry": entry, "value": value, **further}


def _since(begin: float) -> float:
    return round(time.perf_counter() - begin, 2)


def record_of(decisions: Sequence[Decision], accuracy: float, begin: float) -> dict[str, Any]:
    """Return the decisions since ``begin`` that are to meet ``accuracy``, as data for JSON."""
    records = [decision.record for decision in decisions]
    known = all(decision.met or decision.error is not None for decision in decisions)
    estimated = sum(decision.error or 0.0 for decision in decisions)
    return {
        "accuracy": accuracy,
        "budget": {record["entry"]: record["allowed"] for record in records},
        "estimated_error": estimated,
        "met": known and estimated <= accuracy * (1.0 + ROUNDING),
        "chosen": {k: value for decision in decisions for k, value in decision.chosen.items()},
        "decisions": records,
        "seconds": _since(begin),
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
            reporter.say(f"{error}; probes took {seconds:.1f} s")
    if not record["met"]:
        missed = ", ".join(d["entry"] for d in record["decisions"] if not d["met"])
        reporter.warn(WarningKind.CHOICE_INACCURATE, f"{error}, shares not met: {missed}")
