"""Report of the error budget: a few lines, warnings, entries of summary and results."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from sa_solver.types import Array
from workflow.analyses.wear.output.layout import RESULTS
from workflow.case.text.readable import percent
from workflow.messages.warning_kinds import Notice, WarningKind
from workflow.models.budget.names import PARTS
from workflow.models.budget.parts import ResultError

Budget = Mapping[str, Mapping[str, ResultError]]  # by interface and result

# Factor on the accuracy for pressure at worn edges, and stress below them: both grow as the cells
# become finer.
AT_EDGES, EDGES = 5.0, ("worn_peak_pressure", "life")
# Number of parts that a line lists, and the least share of the total for a part to be listed.
MOST_PARTS, WORTH_REPORTING = 2, 0.1


def summary_of(errors: Mapping[str, ResultError]) -> dict[str, Any]:
    """Return the parts of each result and their ``total``; None for unknown ones."""
    return {name: error.numbers for name, error in errors.items()}


def arrays_of(errors: Mapping[str, ResultError]) -> dict[str, Array]:
    """Return each result's parts in the order of ``PARTS``, nan if unknown, and their total."""
    return {
        name: np.array([*(_number(error.parts.get(p, 0.0)) for p in PARTS), error.total])
        for name, error in errors.items()
    }


def _number(part: float | None) -> float:
    return np.nan if part is None else part


def sentences(errors: Mapping[str, ResultError]) -> Iterator[str]:
    """Yield the error of every result, the largest parts of the worst one, and unknown parts.

    An error with an unknown part is at least that of the others. The summary has all parts.
    """
    if not errors:
        return
    listed = ", ".join(
        f"{RESULTS[name]} {'at least ' if error.unknown else ''}{percent(error.total)}"
        for name, error in errors.items()
    )
    yield f"estimated errors: {listed}"
    worst = max(errors, key=lambda name: errors[name].total)
    error = errors[worst]
    parts = [
        f"{name} {'+' if name in error.signed and part > 0.0 else ''}{percent(part)}"
        for name, part in error.largest[:MOST_PARTS]
        if part and abs(part) >= WORTH_REPORTING * error.total
    ]
    unknown = dict.fromkeys(name for error in errors.values() for name in error.unknown)
    largest = f"largest parts for {RESULTS[worst]}: {', '.join(parts)}" if parts else ""
    missing = f"unknown: {', '.join(unknown)}" if unknown else ""
    if largest or missing:
        yield "; ".join(filter(None, (largest, missing)))


def warning_of(
    name: str, errors: Mapping[str, ResultError], accuracy: float, settings: Mapping[str, str]
) -> Notice | None:
    """Return a warning about results beyond ``accuracy``, with a setting for the largest part."""
    allowed = {name: accuracy * (AT_EDGES if name in EDGES else 1.0) for name in errors}
    beyond = {name: error for name, error in errors.items() if error.total > allowed[name]}
    if not beyond:
        return None
    shares = {
        part: sum(
            abs(error.parts.get(part) or 0.0) / allowed[name] for name, error in beyond.items()
        )
        for part in PARTS
    }
    most = max(shares, key=shares.__getitem__)
    listed = ", ".join(f"{RESULTS[name]} {percent(error.total)}" for name, error in beyond.items())
    asked = f"{100.0 * accuracy:g} % ({AT_EDGES:g} times that at worn edges)"
    return Notice(
        WarningKind.ACCURACY_EXCEEDED,
        f"{name}: estimated errors exceed the accuracy of {asked}: {listed}; mainly due to "
        f"{most}: {settings[most]}",
    )
