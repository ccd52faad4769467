"""Comparison of measured points with the computed curves of a run.

Computed curves are interpolated linearly. The interpolation error is estimated from lines through
every second point, once the even and once the odd ones: if these differ by a and b from the line
through all points, the error is a b / (a + b), which is exact for equal spacing and curvature. In
the first and last intervals only one of the two lines differs, and the larger difference is an
upper bound. Where a curve takes several values at a place, as a loop does, the value nearest to
the measured one is used, which favours the computation; the summary reports it. Nothing is
extrapolated.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from sa_solver.types import Array, Mask
from workflow.case.fields import Quantity, in_unit_of, shown
from workflow.case.files.input_files import InputFileError
from workflow.case.files.table_file import TableFile, check_unit, read_table_file
from workflow.case.sections import Case, Measured
from workflow.case.text.readable import everyday_unit, percent, readable
from workflow.errors import UserError
from workflow.layout.declared import Layout
from workflow.messages.warning_kinds import Notice, WarningKind
from workflow.shell.output.curves import Curve, curves_in
from workflow.shell.output.quantities import CurvesOf

# Ending of the heading of a column of standard deviations, as in `fretscale fit`.
OF_DEVIATIONS = "_deviation"
# A point this far beyond an end of a curve, relative to the curve's extent, counts as at the end,
# because unit conversion rounds.
AT_END = 1e-9


@dataclass(frozen=True)
class MeasuredPoints:
    """Measured points, arrays ``(n,)`` in base units; ``deviations`` are None if not known."""

    x: Array
    y: Array
    deviations: Array | None

    def only(self, chosen: Mask) -> MeasuredPoints:
        """Return the points selected by a mask ``(n,)``."""
        deviations = None if self.deviations is None else self.deviations[chosen]
        return MeasuredPoints(self.x[chosen], self.y[chosen], deviations)


@dataclass(frozen=True)
class MeasuredCurve:
    """Measured points together with the computed curve that they are compared with.

    ``computed`` ``(n,)`` is NaN outside the curve. ``several`` is true if the curve takes several
    values at one of the points. ``error`` is the largest estimated interpolation error; it is None
    for a curve of two points, from which the error cannot be estimated.
    """

    entry: Measured
    curve: Curve
    points: MeasuredPoints
    computed: Array
    several: bool
    error: float | None

    @property
    def inside(self) -> Mask:
        """Mask ``(n,)`` of the points that are in the computed range."""
        return np.isfinite(self.computed)


def check_measured(case: Case, curves: Sequence[CurvesOf], layout: Layout) -> None:
    """Raise UserError, before the run begins, for points that no run could be compared with.

    ``layout`` has the units of the curves. Checks that need the results, such as which of the
    curves exist, are left to :func:`compare_with_curve`.
    """
    for number, entry in enumerate(case.measured):
        meant = [wanted for wanted in curves if _begins(entry.curve, wanted.title)]
        if not meant:
            known = "; ".join(wanted.title for wanted in curves) or "none"
            raise UserError(
                f"measured.{number}.curve: {shown(entry.curve)}: no such curve; allowed: {known}"
            )
        refusals = [
            _refusal(entry, *layout.units(wanted.y, wanted.x, line))
            for wanted in meant
            for line in (False, True)
        ]
        if all(refusals):
            raise UserError(f"measured.{number}: {refusals[0]}")


def _refusal(entry: Measured, x_unit: str, y_unit: str) -> str:
    """Return why the points cannot be read in these units; empty if they can."""
    try:
        read_points(entry, x_unit, y_unit)
    except UserError as error:
        return str(error)
    return ""


def compare_with_curve(
    entry: Measured, file: h5py.File, curves: Sequence[CurvesOf]
) -> MeasuredCurve:
    """Compare the points of an entry with its curve in a ``results.h5``. Raises UserError."""
    found = [curve for wanted in curves for curve in curves_in(file, wanted)]
    titles = [curve.title for curve in found]
    named = [c for c in found if c.title == entry.curve] or [
        c for c in found if _begins(c.title, entry.curve)
    ]
    if len(named) != 1:
        why = "several curves" if named else "no such curve in these results"
        known = "; ".join([c.title for c in named] or titles)
        raise UserError(f"{shown(entry.curve)}: {why}; allowed: {known}")
    curve = named[0]
    points = read_points(entry, curve.x_unit, curve.y_unit)
    return compared(entry, curve, points)


def compared(entry: Measured, curve: Curve, points: MeasuredPoints) -> MeasuredCurve:
    """Compare points with a curve, interpolated at each of them."""
    crossings = [_crossings(curve.x, curve.y, x) for x in points.x]
    computed = np.array([_nearest(c, y) for c, y in zip(crossings, points.y, strict=True)])
    error = _interpolation_error(curve, points.x, computed)
    several = any(np.ptp(c) > 0.0 for c in crossings if c.size > 1)
    return MeasuredCurve(entry, curve, points, computed, several, error)


def _interpolation_error(curve: Curve, x: Array, computed: Array) -> float | None:
    last = curve.x.size - 1
    if last < 2:
        return None
    differences = []
    for first in (0, 1):
        kept = np.unique([0, *range(first, last, 2), last])
        found = [
            _nearest(_crossings(curve.x[kept], curve.y[kept], place), value)
            for place, value in zip(x, computed, strict=True)
        ]
        differences.append(np.abs(np.array(found) - computed))
    even, odd = differences
    whole = np.where(even + odd > 0.0, even + odd, 1.0)
    at_end = _between(x, curve.x[:2]) | _between(x, curve.x[-2:])
    errors = np.where(at_end, np.maximum(even, odd), even * odd / whole)
    return float(np.max(errors[np.isfinite(errors)], initial=0.0))


def _between(x: Array, ends: Array) -> Mask:
    return (ends.min() <= x) & (x <= ends.max())


def read_points(entry: Measured, x_unit: str, y_unit: str) -> MeasuredPoints:
    """Return the points of an entry in base units.

    If a base unit is "", numbers are only read, in their given unit. Raises InputFileError with
    file and line, or key.
    """
    if entry.file is None:
        x = _listed("at", entry.at, x_unit)
        y = _listed("values", entry.values, y_unit)
        given = None
    else:
        at, values = entry.columns.at or "at", entry.columns.values or "values"
        table = _table(entry, entry.file, at, values)
        x, y = _with_unit(table, at, x_unit), _with_unit(table, values, y_unit)
        deviations = f"{values}{OF_DEVIATIONS}"
        given = _with_unit(table, deviations, y_unit) if deviations in table.names else None
    if entry.deviation is not None:
        given = np.full(y.size, _listed("deviation", (entry.deviation,), y_unit)[0])
    elif entry.relative_deviation is not None:
        given = entry.relative_deviation * np.abs(y)
    if given is not None and not np.all(given > 0.0):
        row = int(np.flatnonzero(given <= 0.0)[0]) + 1
        raise InputFileError(f"{shown(entry.curve)}: point {row}: no deviation; allowed: above 0")
    return MeasuredPoints(x, y, given)


def reported(found: MeasuredCurve) -> dict[str, Any]:
    """Return the comparison for the summary: computed minus measured, in base units.

    Relative deviations are relative to the mean and the rms of all measured values, since single
    values may be 0. Nothing is fitted here, so chi² is divided by the number of points.
    """
    inside, points = found.inside, found.points
    off = (found.computed - points.y)[inside]
    measured = points.y[inside]
    content = {
        "curve": found.curve.title,
        "source": found.entry.source,
        "points": int(inside.sum()),
        "outside": points.x[~inside].tolist(),
        "at_unit": found.curve.x_unit,
        "unit": found.curve.y_unit,
        "nearest_of_several_branches": found.several,
        "interpolation_error": found.error,
    }
    if not off.size:
        return content
    worst = int(np.argmax(np.abs(off)))
    mean, rms = float(off.mean()), float(np.sqrt(np.mean(off**2)))
    content |= {
        "mean_deviation": mean,
        "rms_deviation": rms,
        "relative_mean_deviation": _over(mean, float(np.mean(np.abs(measured)))),
        "relative_rms_deviation": _over(rms, float(np.sqrt(np.mean(measured**2)))),
        "largest": {
            "at": float(points.x[inside][worst]),
            "measured": float(measured[worst]),
            "computed": float(found.computed[inside][worst]),
        },
    }
    if points.deviations is not None:
        content["reduced_chi_square"] = float(np.mean((off / points.deviations[inside]) ** 2))
    return content


def tell_measured(case: Case, curves: Sequence[CurvesOf], results: Path) -> list[dict[str, Any]]:
    """Return the comparisons for the summary; ``refused`` says why one is impossible."""
    if not case.measured:
        return []
    content: list[dict[str, Any]] = []
    with h5py.File(results) as file:
        for entry in case.measured:
            try:
                content.append(reported(compare_with_curve(entry, file, curves)))
            except UserError as error:
                about = {"curve": entry.curve, "source": entry.source, "points": 0}
                content.append({**about, "refused": str(error)})
    return content


def comparison_warnings(content: Sequence[dict[str, Any]]) -> Iterator[Notice]:
    """Yield a warning for each failed comparison and for points outside the computed range."""
    for number, one in enumerate(content):
        if "refused" in one:
            text = f"measured.{number}: not compared: {one['refused']}"
            yield Notice(WarningKind.NOT_COMPARED, text)
        elif one["outside"]:
            places = ", ".join(str(readable(x, one["at_unit"])) for x in one["outside"])
            yield Notice(
                WarningKind.NOT_COMPARED,
                f"measured.{number}: {one['curve']}: not computed at {places}, which are not "
                "compared",
            )


def lines_of_measured(content: Sequence[dict[str, Any]]) -> Iterator[str]:
    """Yield a one-line text for each comparison."""
    for one in content:
        if "rms_deviation" not in one:
            continue
        unit, worst = one["unit"], one["largest"]
        chi = one.get("reduced_chi_square")
        share = one["relative_rms_deviation"]
        everyday = everyday_unit(unit, one["curve"])
        yield (
            f"  measured: {one['curve']}: {one['points']} of "
            f"{one['points'] + len(one['outside'])} points, differing by "
            f"{readable(one['rms_deviation'], unit, None, everyday)} rms"
            + (f" ({percent(share)})" if share is not None else "")
            + (f", chi² {chi:.3g} per point" if chi is not None else "")
            + f", most at {readable(worst['at'], one['at_unit'])}"
            + ("; nearest of several branches" if one["nearest_of_several_branches"] else "")
        )


def _begins(title: str, beginning: str) -> bool:
    return title == beginning or title.startswith(f"{beginning}, ")


def _over(value: float, size: float) -> float | None:
    return value / size if size else None


def _crossings(x: Array, y: Array, place: float) -> Array:
    """Return the values ``(m,)`` of a polyline ``(n,)`` at a place, several if it is a loop."""
    known = np.isfinite(x) & np.isfinite(y)
    if not known.any():
        return np.empty(0)
    near = AT_END * float(np.ptp(x[known]))
    if _within(x[known], place, near):
        place = float(np.clip(place, x[known].min(), x[known].max()))
    (x0, x1), (y0, y1) = (x[:-1], x[1:]), (y[:-1], y[1:])
    low, high = np.minimum(x0, x1), np.maximum(x0, x1)
    hit = known[:-1] & known[1:] & (low <= place) & (place <= high)
    run = (x1 - x0)[hit]
    upright = run == 0.0
    share = np.where(upright, 0.0, (place - x0[hit]) / np.where(upright, 1.0, run))
    return np.concatenate([y0[hit] + share * (y1 - y0)[hit], y1[hit][upright]])


def _within(x: Array, place: float, near: float) -> bool:
    return bool(x.min() - near <= place <= x.max() + near)


def _nearest(candidates: Array, value: float) -> float:
    """Return the candidate nearest to ``value``, or NaN without candidates."""
    if not candidates.size or not np.isfinite(value):
        return float("nan")
    return float(candidates[np.argmin(np.abs(candidates - value))])


def _table(entry: Measured, file: str, at: str, values: str) -> TableFile:
    """Return a table with places and values, whose deviations are not given twice."""
    table, deviations = read_table_file(file), f"{values}{OF_DEVIATIONS}"
    table.require([at, values], "the headings that columns names, or at and values")
    if deviations in table.names and not (entry.deviation is entry.relative_deviation is None):
        raise InputFileError(
            f"{table.place}: {deviations}: given with a deviation in the case; allowed: one of them"
        )
    return table


def _with_unit(table: TableFile, name: str, base: str) -> Array:
    if base not in ("", "1"):
        table.require_unit(name, base)
    above = 0.0 if name.endswith(OF_DEVIATIONS) else -np.inf
    return table.column(name, Quantity(base or table.unit(name) or "1", above=above))


def _listed(key: str, numbers: Sequence[float], base: str) -> Array:
    """Return numbers of the case, which must have been written in units of this dimension."""
    for number in numbers if base else ():
        _, unit = in_unit_of(number, number)
        if unit or base != "1":
            if not unit and number != 0.0:
                raise InputFileError(f"{key}: {number:g}: no unit; allowed: such as 1 {base}")
            if unit:
                check_unit(key, unit, base)
    return np.array(numbers, dtype=np.float64)
