"""The error budget as a run tells it: in a few lines, in warnings, in the summary and results."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from workflow.analyses.wear.budget.parts import ResultError
from workflow.analyses.wear.layout import PARTS, RESULTS
from workflow.shell.dataset import Dataset

Budget = Mapping[str, Mapping[str, ResultError]]  # by interface and result

# Pressure at the edges that wear makes, and stress below them, may be so many times farther off:
# the finer the cells, the larger they are.
AT_EDGES, EDGES = 5.0, ("worn_peak_pressure", "life")
# Parts below this share of the total are not worth a word in a line.
WORTH_TELLING = 0.1


def summary_of(errors: Mapping[str, ResultError]) -> dict[str, Any]:
    """By result, its parts and their ``total``; None for what nobody knows."""
    return {name: {**error.parts, "total": error.total} for name, error in errors.items()}


def datasets_of(errors: Mapping[str, ResultError]) -> dict[str, Dataset]:
    """By result, its parts in the order of ``PARTS``, nan for unknown ones, and their total."""
    what = (
        f"estimated relative errors by {', '.join(PARTS)}, above 0 where too much is told, and "
        "their total"
    )
    return {
        name: Dataset(
            np.array([*(_number(error.parts.get(p, 0.0)) for p in PARTS), error.total]), "1", what
        )
        for name, error in errors.items()
    }


def _number(part: float | None) -> float:
    return np.nan if part is None else part


def sentence(errors: Mapping[str, ResultError]) -> str:
    """What is left of every result, and by what."""
    return "; ".join(f"{RESULTS[name]} {_shown(error)}" for name, error in errors.items())


def _shown(error: ResultError) -> str:
    least = WORTH_TELLING * error.total
    worth = [(name, part) for name, part in error.largest if part and abs(part) >= least]
    parts = [f"{name} {part:{'+' if name in error.signed else ''}.1%}" for name, part in worth]
    parts += [f"{name} unknown" for name in error.unknown]
    return f"{error.total:.1%}" + (f" ({', '.join(parts)})" if parts else "")


def warning_of(
    name: str, errors: Mapping[str, ResultError], accuracy: float, settings: Mapping[str, str]
) -> str | None:
    """Results that are farther off than the ``accuracy``, and the setting of the largest part."""
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
    listed = ", ".join(f"{RESULTS[name]} {error.total:.1%}" for name, error in beyond.items())
    asked = f"{100.0 * accuracy:g} % ({AT_EDGES:g} times that at worn edges)"
    return (
        f"{name}: estimated errors beyond the accuracy of {asked}: {listed}; mostly by {most}: "
        f"{settings[most]}"
    )
