"""Designs of a sweep: a grid, values in step, a Latin hypercube, or runs to first order."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from itertools import product
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from sa_solver.types import Array
from workflow.case.text.writing import scalar
from workflow.errors import CaseError
from workflow.runs.job import Job
from workflow.sweep.first_order import positions
from workflow.sweep.fitted import REACH, DrawnParameter, FittedSample
from workflow.sweep.schema import (
    DRAWN,
    MOST_RUNS,
    LogNormal,
    Normal,
    Sweep,
    Variation,
    WrittenNumber,
)

# Largest length of a folder name; a longer name is shortened with a hash.
LONGEST_NAME = 100
# Figures of every run would take longer than many a run; `set` can switch them on.
QUIET = {"output.paraview": False, "output.figures": False}


@dataclass(frozen=True)
class SweepRun:
    """One run of a sweep: its name, and the varied values, as written, by path."""

    name: str
    values: dict[str, Any]

    def job(self, sweep: Sweep) -> Job:
        """Return the job that computes this run."""
        entries = QUIET | sweep.file.set | self.values
        overrides = tuple(f"{path}={scalar(value)}" for path, value in entries.items())
        return Job(self.name, Path(sweep.file.case), overrides)


def runs_of(sweep: Sweep) -> list[SweepRun]:
    """Return the runs of a sweep, which a sample may contain twice; raise CaseError."""
    varied = sweep.file.variations()
    paths = list(varied)
    if sweep.file.design in DRAWN:
        columns = _sampled(sweep) if sweep.file.design == "sample" else _stepped(sweep)
        paths, rows = list(columns), list(zip(*columns.values(), strict=True))
    else:
        rows = _combined(sweep, [_listed(variation) for variation in varied.values()])
    named = zip(_names(_short_names(paths), rows), rows, strict=True)
    return [SweepRun(name, dict(zip(paths, row, strict=True))) for name, row in named]


def _combined(sweep: Sweep, columns: list[list[Any]]) -> list[tuple[Any, ...]]:
    place = sweep.source.where(("design",))[1]
    if sweep.file.design == "zip":
        counts = [len(column) for column in columns]
        if len(set(counts)) > 1:
            lengths = ", ".join(map(str, counts))
            raise CaseError(f"{place}: design: zip of {lengths} values; allowed: as many of each")
        return list(zip(*columns, strict=True))
    count = prod(len(column) for column in columns)
    if count > MOST_RUNS:
        raise CaseError(f"{place}: design: a grid of {count} runs; allowed: up to {MOST_RUNS}")
    return list(product(*columns))


def _listed(variation: Variation) -> list[Any]:
    """Return all values of a list or range."""
    if variation.values is not None:
        return list(variation.values)
    assert variation.range is not None
    assert variation.range.count is not None
    first, last = variation.range.ends
    share = np.linspace(0.0, 1.0, variation.range.count)
    numbers = _between(first, last, share, variation.range.scale)
    return [_written(first, number) for number in numbers]


def _between(first: WrittenNumber, last: WrittenNumber, share: Array, scale: str) -> Array:
    """Return numbers at ``share`` (0 to 1) of the way between two ends."""
    if scale == "log":
        return np.asarray(first.number * (last.number / first.number) ** share)
    return np.asarray(first.number * (1.0 - share) + last.number * share)


def _written(like: WrittenNumber, number: float) -> int | float | str:
    return like.with_number(float(number)).written


# --- samples ------------------------------------------------------------------------------------


def _sampled(sweep: Sweep) -> dict[str, list[Any]]:
    """Return a Latin hypercube: every column has one value in each of ``samples`` equal shares.

    For parameters of a fit this holds before their correlation is applied.
    """
    from scipy.stats import qmc  # takes half a second to import

    varied, fitted = sweep.file.variations(), sweep.fitted
    count = len(varied) + (len(fitted.parameters) if fitted else 0)
    draws = qmc.LatinHypercube(d=count, seed=np.random.default_rng(sweep.file.seed))
    points = draws.random(sweep.file.samples or 0)
    columns = {
        name: _drawn(variation, share)
        for (name, variation), share in zip(varied.items(), points.T, strict=False)
    }
    return columns | (fitted.columns(points[:, len(varied) :]) if fitted else {})


def _drawn(variation: Variation, share: Array) -> list[Any]:
    """Return the quantiles for each ``share``; values of a list are equally likely."""
    if variation.values is not None:
        return [variation.values[int(u * len(variation.values))] for u in share]
    if variation.range is not None:
        first, last = variation.range.ends
        numbers = _between(first, last, share, variation.range.scale)
    else:
        first, numbers = _quantiles(variation.distribution, share)
    return [_written(first, number) for number in numbers]


def _quantiles(distribution: Any, share: Array) -> tuple[WrittenNumber, Array]:
    """Return quantiles of a distribution, and an amount with their unit."""
    from scipy.special import ndtri

    if isinstance(distribution, Normal):
        mean = distribution.mean
        return mean, mean.number + distribution.deviation.number * ndtri(share)
    if isinstance(distribution, LogNormal):
        median = distribution.median
        return median, median.number * distribution.factor ** ndtri(share)
    first, last = distribution.ends
    return first, _between(first, last, share, "linear")


# --- to first order -----------------------------------------------------------------------------


def _stepped(sweep: Sweep) -> dict[str, list[Any]]:
    """Return runs with each independent normal number at the ends of its 95 %, and all at once."""
    known = sweep.fitted or FittedSample((), np.eye(0))
    varied = sweep.file.variations().items()
    known = known.with_others([_normal(name, variation.distribution) for name, variation in varied])
    return known.given(positions(len(known.parameters)))


def _normal(name: str, distribution: Any) -> DrawnParameter:
    """Return an entry with a normal or lognormal distribution in the form of a fitted parameter."""
    logarithmic = isinstance(distribution, LogNormal)
    best = distribution.median if logarithmic else distribution.mean
    if logarithmic:
        factor = distribution.factor**REACH
        bounds = best.number / factor, best.number * factor
    else:
        reach = REACH * distribution.deviation.number
        bounds = best.number - reach, best.number + reach
    return DrawnParameter(
        name, best.number, best.unit or "1", bounds, (-np.inf, np.inf), logarithmic, (name,)
    )


# --- names --------------------------------------------------------------------------------------


def _short_names(paths: list[str]) -> list[str]:
    """Return the shortest end of each path that no other path has."""
    return [_shortest(path, [other for other in paths if other != path]) for path in paths]


def _shortest(path: str, others: list[str]) -> str:
    keys = path.split(".")
    ends = [".".join(keys[-count:]) for count in range(1, len(keys) + 1)]
    return next((e for e in ends if not any(f".{o}".endswith(f".{e}") for o in others)), path)


def _names(short: list[str], rows: list[tuple[Any, ...]]) -> list[str]:
    """Return the folder of each run: the varied entries and values, which identify it later."""
    whole = ["_".join(f"{n}={scalar(v)}" for n, v in zip(short, row, strict=True)) for row in rows]
    plain = [re.sub(r"[^\w.+=-]", "", text.replace(", ", "x")) for text in whole]
    texts = {name: {w for w, p in zip(whole, plain, strict=True) if p == name} for name in plain}
    return [
        name if len(name) <= LONGEST_NAME and len(texts[name]) == 1 else _hashed(name, text)
        for name, text in zip(plain, whole, strict=True)
    ]


def _hashed(name: str, text: str) -> str:
    """Return a short name that no other run has."""
    return f"{name[: LONGEST_NAME // 2]}-{hashlib.sha256(text.encode()).hexdigest()[:8]}"
