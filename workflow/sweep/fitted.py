"""Sample of the parameters of a fit, with the distributions and the correlation from the fit.

Each distribution is normal with two half widths: the best value is the median, and the 95 % bounds,
from Student's distribution or from the profile, are the 2.5 and 97.5 % quantiles. A parameter that
was fitted as its logarithm is drawn as its logarithm. The normal numbers have the correlation of
the fit (Nelsen 2006, *An Introduction to Copulas*, section 2.3). Values beyond the limits of a
parameter are set to the limit.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sa_solver.types import Array
from workflow.case.source import read_text
from workflow.errors import UserError

# 97.5 % quantile of the normal distribution, in standard deviations.
REACH = 1.959963984540054
# Digits of values: correlated parameters are known together far better than each alone.
SIGNIFICANT = 10


@dataclass(frozen=True)
class DrawnParameter:
    """Parameter in its ``unit`` ("1" for none): ``value``, 95 % ``bounds``, and limits ``allowed``.

    ``entries`` are the entries of a case that contain it: several, where functions share it.
    """

    name: str
    value: float
    unit: str
    bounds: tuple[float, float]
    allowed: tuple[float, float]
    logarithmic: bool
    entries: tuple[str, ...]

    def at(self, normal: Array) -> Array:
        """Return the values ``(n,)`` for standard normal numbers ``(n,)``."""
        ends = np.array([self.bounds[0], self.value, self.bounds[1]])
        lower, best, upper = np.log(ends) if self.logarithmic else ends
        width = np.where(normal < 0.0, best - lower, upper - best) / REACH
        drawn = best + width * normal
        return np.clip(np.exp(drawn) if self.logarithmic else drawn, *self.allowed)

    def written(self, value: float) -> float | str:
        """Return a value as it is written in a case."""
        number = f"{value:.{SIGNIFICANT}g}"
        return float(number) if self.unit == "1" else f"{number} {self.unit}"


@dataclass(frozen=True)
class FittedSample:
    """Parameters that entries of a case contain, and their ``correlation`` ``(p, p)``."""

    parameters: tuple[DrawnParameter, ...]
    correlation: Array

    @property
    def entries(self) -> list[str]:
        """Paths of all entries that vary."""
        return [entry for parameter in self.parameters for entry in parameter.entries]

    def draw(self, normal: Array) -> Array:
        """Return values ``(n, p)`` for independent standard normal numbers ``(n, p)``."""
        sizes, directions = np.linalg.eigh(self.correlation)
        # The root is symmetric, so that each column keeps its even spread as far as possible.
        root = (directions * np.sqrt(np.maximum(sizes, 0.0))) @ directions.T
        tied = normal @ root
        columns = [parameter.at(z) for parameter, z in zip(self.parameters, tied.T, strict=True)]
        return np.stack(columns, axis=1)

    def columns(self, shares: Array) -> dict[str, list[float | str]]:
        """Return the values of each entry for independent shares ``(n, p)`` from 0 to 1."""
        from scipy.special import ndtri

        return self.given(ndtri(shares))

    def given(self, normal: Array) -> dict[str, list[float | str]]:
        """Return the values of each entry for independent standard normal numbers ``(n, p)``."""
        return {
            entry: [parameter.written(float(value)) for value in column]
            for parameter, column in zip(self.parameters, self.draw(normal).T, strict=True)
            for entry in parameter.entries
        }

    def with_others(self, others: Sequence[DrawnParameter]) -> FittedSample:
        """Return a sample with further parameters, which are uncorrelated with all others."""
        here, count = len(self.parameters), len(self.parameters) + len(others)
        correlation = np.eye(count)
        correlation[:here, :here] = self.correlation
        return FittedSample((*self.parameters, *others), correlation)


def read_fit(path: Path) -> FittedSample:
    """Return the parameters in the ``summary.json`` of a fit.

    Raises UserError for another file, for a fit without a parameter of a case, and for a parameter
    that the data do not determine.
    """
    try:
        summary = json.loads(read_text(path))
        reported = summary["parameters"]
        parameters = [
            _parameter(name, reported[name]) for name in reported if reported[name]["entries"]
        ]
        names, matrix = summary["correlation"]["parameters"], summary["correlation"]["matrix"]
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        if isinstance(error, UserError):
            raise
        raise UserError(
            f"{path}: no result of a fit; allowed: summary.json of `fretscale fit`"
        ) from None
    if not parameters:
        raise UserError(f"{path}: no parameter that a case has; allowed: a fit with one")
    here = [names.index(parameter.name) for parameter in parameters]
    return FittedSample(tuple(parameters), _correlation(matrix, here))


def _parameter(name: str, reported: Mapping[str, Any]) -> DrawnParameter:
    if not reported["determined"]:
        raise UserError(
            f"{name}: not determined by the fit ({reported['doubt']}); allowed: a fit that holds it"
        )
    lower, upper = reported["allowed"]
    return DrawnParameter(
        name,
        float(reported["value"]),
        str(reported["unit"]),
        (float(reported["bounds"][0]), float(reported["bounds"][1])),
        (-math.inf if lower is None else lower, math.inf if upper is None else upper),
        bool(reported["fitted_as_logarithm"]),
        tuple(reported["entries"]),
    )


def _correlation(matrix: Sequence[Sequence[float]], here: Sequence[int]) -> Array:
    """Return the correlation of some of the parameters."""
    return np.array([[matrix[i][k] for k in here] for i in here], dtype=np.float64)
