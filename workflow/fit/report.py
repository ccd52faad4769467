"""Report of a fit: text on the terminal, ``summary.json``, and tables."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from workflow.case.text.plain import aligned, counted
from workflow.case.text.readable import percent
from workflow.fit.fitting import Fitted, Parameter
from workflow.fit.section import entries_of, reported
from workflow.shell.folders.versions import versions
from workflow.shell.output.summary import finite
from workflow.shell.output.tables import heading

# Smallest correlation that is printed.
CLOSE = 0.9
# Share of a series in a parameter below which it is not printed.
LITTLE = 0.005
HEADINGS = ("parameter", "value", "+-", "95 % bounds", "decided by")


def report(fitted: Fitted) -> list[str]:
    """Return the table of parameters, followed by notes."""
    rows = [HEADINGS, *(_row(fitted, parameter) for parameter in fitted.parameters)]
    title = fitted.given.file.title
    return [title, *aligned(rows), *_series(fitted), *_tests(fitted), *_notes(fitted)]


def _row(fitted: Fitted, parameter: Parameter) -> tuple[str, ...]:
    estimate = parameter.estimate
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    if not estimate.determined:
        return parameter.path, "not determined", "", estimate.caveat, _decided(fitted, parameter)
    value, deviation, bounds = reported(parameter)
    return parameter.path, value + unit, deviation, bounds + unit, _decided(fitted, parameter)


def _decided(fitted: Fitted, parameter: Parameter) -> str:
    """Return the series that determine a parameter, the most important first."""
    names = [series.name for series in fitted.series]
    shares = parameter.estimate.shares.tolist()
    order = sorted(range(len(names)), key=lambda k: -shares[k])
    return ", ".join(f"{names[k]} {percent(shares[k])}" for k in order if shares[k] > LITTLE)


def _series(fitted: Fitted) -> list[str]:
    lines = []
    problem = fitted.fit.problem
    for place, series in enumerate(fitted.series):
        here = problem.places == place
        unit = "" if series.unit == "1" else f" {series.unit}"
        scatter = _scatter(fitted, place)
        how = "given" if series.column.deviations is not None else "of the residuals"
        count = counted(int(here.sum()), "value")
        freedom = f"{fitted.fit.freedoms[place]:.3g} degrees of freedom"
        text = f"standard deviation {scatter:.2g}{unit} ({how}), {freedom}"
        lines.append(f"{series.name}: {count}, {text}")
    return lines


def _tests(fitted: Fitted) -> list[str]:
    """Return what each file says about the parameters."""
    lines = []
    for path in fitted.tests:
        files = ", ".join(
            f"{name} {percent(share)}"
            + (f" (alone {own:.4g} +- {dev:.2g})" if math.isfinite(own) else "")
            for name, share, own, dev in fitted.shown_tests(path)
        )
        lines.append(f"{path} by file: {files}")
    return lines


def _scatter(fitted: Fitted, place: int) -> float:
    """Return the root mean square deviation of a series, in the unit of the report."""
    here = fitted.fit.problem.places == place
    root = float(np.sqrt(np.mean(fitted.fit.deviations[here] ** 2)))
    return Parameter("", fitted.series[place].unit, fitted.parameters[0].estimate).shown(root)


def _notes(fitted: Fitted) -> list[str]:
    found = fitted.fit
    how = "normal, with the given standard deviations" if found.known else "Student's"
    lines = [*fitted.reported, f"+- is one standard deviation; bounds are {how}"]
    lines += [
        f"{parameter.path}: the model is nonlinear within its bounds, which are of its profile"
        for parameter in fitted.parameters
        if parameter.estimate.determined and not parameter.estimate.straight
    ]
    lines += [
        f"{first} and {second} have a correlation of {value:.3f}: neither is determined alone"
        for first, second, value in _close(fitted)
    ]
    return lines + [f"warning: {caveat}" for caveat in fitted.plausibility_warnings]


def _close(fitted: Fitted) -> list[tuple[str, str, float]]:
    """Return the pairs of parameters with a large correlation."""
    correlation = fitted.fit.correlation
    paths = [parameter.path for parameter in fitted.parameters]
    return [
        (paths[i], paths[k], float(correlation[i, k]))
        for i in range(len(paths))
        for k in range(i + 1, len(paths))
        if abs(correlation[i, k]) > CLOSE
    ]


# --- files --------------------------------------------------------------------------------------


def summary(fitted: Fitted, section: str) -> dict[str, Any]:
    """Return the contents of ``summary.json``; each number has its unit next to it."""
    found = fitted.fit
    return {
        "title": fitted.given.file.title,
        "fit": fitted.given.file.fit,
        "parameters": {
            p.path: _of_parameter(fitted, p) | _in_a_case(fitted, p) for p in fitted.parameters
        },
        "correlation": {
            "parameters": [parameter.path for parameter in fitted.parameters],
            "matrix": [[finite(value) for value in row] for row in found.correlation.tolist()],
        },
        "series": {
            series.name: {
                "values": len(series.column.values),
                "scatter": _scatter(fitted, place),
                "unit": series.unit,
                "given": series.column.deviations is not None,
                "freedom": float(fitted.fit.freedoms[place]),
            }
            for place, series in enumerate(fitted.series)
        },
        "tests": {path: _of_tests(fitted, path) for path in fitted.tests},
        "excess": finite(found.excess),
        "starts": {"tried": found.tried, "reached": found.reached},
        **({"runs": dict(fitted.runs)} if fitted.runs else {}),
        "doubts": list(map(str, fitted.plausibility_warnings)),
        "section": section,
        "versions": versions(),
    }


def _of_parameter(fitted: Fitted, parameter: Parameter) -> dict[str, Any]:
    estimate = parameter.estimate
    known = estimate.determined
    return {
        "value": parameter.shown(estimate.value) if known else None,
        "unit": parameter.unit,
        "deviation": parameter.shown(estimate.deviation) if known else None,
        "bounds": [parameter.shown(bound) for bound in estimate.bounds] if known else None,
        "determined": known,
        "doubt": estimate.caveat,
        "fitted_as_logarithm": estimate.logarithmic,
        "bounds_of_profile": known and not estimate.straight,
        "shares": {
            series.name: round(share, 4)
            for series, share in zip(fitted.series, estimate.shares.tolist(), strict=True)
        },
        "heaviest": {
            "place": fitted.places[estimate.heaviest],
            "share": round(estimate.heaviest_share, 4),
        },
    }


def _of_tests(fitted: Fitted, path: str) -> dict[str, Any]:
    return {
        "unit": fitted.by_path[path].unit,
        "chance_to_agree": finite(fitted.tests[path].chance),
        "files": [
            {"file": name, "share": round(share, 4), "own": finite(own), "deviation": finite(dev)}
            for name, share, own, dev in fitted.shown_tests(path)
        ],
    }


def _in_a_case(fitted: Fitted, parameter: Parameter) -> dict[str, Any]:
    """Return what a sweep needs about a parameter: its entries, and its limits."""
    unknown = fitted.fit.problem.unknowns[fitted.parameters.index(parameter)]
    limits = unknown.lower, unknown.upper
    return {
        "entries": entries_of(fitted, parameter.path),
        "allowed": [finite(parameter.shown(limit)) for limit in limits],
    }


def parameter_columns(fitted: Fitted) -> dict[str, Sequence[Any]]:
    """Return the table of parameters, with a row for each."""
    rows = [_of_parameter(fitted, parameter) for parameter in fitted.parameters]
    return {
        "parameter": [parameter.path for parameter in fitted.parameters],
        "unit": [row["unit"] for row in rows],
        "value": [row["value"] for row in rows],
        "deviation": [row["deviation"] for row in rows],
        "lower": [row["bounds"] and row["bounds"][0] for row in rows],
        "upper": [row["bounds"] and row["bounds"][1] for row in rows],
        "doubt": [row["doubt"] for row in rows],
    }


def data_columns(fitted: Fitted) -> dict[str, Any]:
    """Return the table of all data, with a row for each, in the base units of their series."""
    found = fitted.fit
    series = [s.name for s in fitted.series for _ in s.column.places]
    against = np.concatenate([s.column.against for s in fitted.series])
    along = fitted.series[0].along
    return {
        "series": series,
        "place": fitted.places,
        heading(along.name.replace(" ", "_"), along.base): against,
        "measured": found.problem.data,
        "fitted": found.fitted,
        "deviation": found.deviations,
        "standardised_residual": found.standardised,
        "leverage": found.leverages,
    }
