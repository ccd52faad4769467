"""Comparison of the values that a case expects with those that its run computed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from workflow.case.fields import in_unit_of
from workflow.case.sections import Case, Expectation
from workflow.shell.output.summary import required_number


@dataclass(frozen=True)
class Verdict:
    """Result of comparing one expectation with the computed value.

    ``expected`` and ``computed`` are in the ``unit`` in which the case writes the value, "" for a
    bare number. ``error`` is relative to the expected value, or absolute in that unit if it is 0.
    """

    entry: Expectation
    expected: float
    computed: float
    unit: str
    error: float

    @property
    def met(self) -> bool:
        return self.error <= self.entry.tolerance

    @property
    def error_text(self) -> str:
        return f"{self.error:.2%}" if self.expected else f"{self.error:.1e}"


def verdicts(case: Case, summary: Mapping[str, Any]) -> list[Verdict]:
    """Compare every expectation of a case with the summary.

    Raises QuantityError if the summary has no number for an expected quantity.
    """
    return [verdict_of(entry, summary) for entry in case.expect]


def verdict_of(entry: Expectation, summary: Mapping[str, Any]) -> Verdict:
    """Compare one expectation with the summary. Raises QuantityError as :func:`verdicts`."""
    computed = required_number(summary, entry.quantity)
    (value, unit), (number, _) = (in_unit_of(entry.value, n) for n in (entry.value, computed))
    return Verdict(entry, value, number, unit, abs(number - value) / (abs(value) or 1.0))
