"""Measured points, with one standard deviation, in the figures of a run."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sa_solver.types import Array
from workflow.case.sections import Measured
from workflow.case.text.readable import everyday_unit, percent, suited
from workflow.case.units import UnitError, to_base
from workflow.errors import UserError
from workflow.pictures.panels import grouped_ticks, new_figure
from workflow.pictures.style import AMBER, BLACK, BLUE, ORANGE
from workflow.shell.analysis import Pictures
from workflow.shell.output.curves import axis_labels, largest
from workflow.shell.output.measured import MeasuredCurve, compare_with_curve
from workflow.shell.output.quantities import CurvesOf
from workflow.shell.output.tables import heading

# Name of the figure with all measured points.
MEASURED = "measured"
HIGH, REST = 4.2, 0.5  # of a row of panels, and of the title [inches]
# Pattern of the unit in the label of an axis.
IN_BRACKETS = re.compile(r".*\[(.*?)\]", re.DOTALL)
# A line of a figure is taken for a curve if they agree to this share of its extent: drawn numbers
# have been divided by a unit and are otherwise the same.
SAME = 1e-9


def with_measured(
    plain: Pictures, measured: Sequence[Measured], curves: Sequence[CurvesOf]
) -> Pictures:
    """Return pictures with points in each figure of their curves, and a figure of all points."""

    def figures_of(contents: Any) -> Mapping[str, Callable[[h5py.File], Figure]]:
        drawn = plain.figures_of(contents)
        pointed = {n: partial(_pointed, draw, measured, curves) for n, draw in drawn.items()}
        return pointed | {MEASURED: partial(_draw_all, measured, curves)}

    return Pictures(figures_of, plain.write_paraview, plain.contents)


def _found(
    measured: Sequence[Measured], curves: Sequence[CurvesOf], file: h5py.File
) -> Iterator[MeasuredCurve]:
    """Yield the entries that can be compared; a warning of the run explains why others cannot."""
    for entry in measured:
        try:
            yield compare_with_curve(entry, file, curves)
        except UserError:
            continue


def _pointed(
    draw: Callable[[h5py.File], Figure],
    measured: Sequence[Measured],
    curves: Sequence[CurvesOf],
    file: h5py.File,
) -> Figure:
    """Return a figure with points in each panel that has the line of their curve.

    Points outside the computed range are left out, as they would compress the rest; the figure of
    all points shows them.
    """
    figure = draw(file)
    for found in _found(measured, curves, file):
        for axis in figure.axes:
            units = (
                _unit(axis.get_xlabel(), found.curve.x_unit),
                _unit(axis.get_ylabel(), found.curve.y_unit),
            )
            if any(_is_of(line, found, *units) for line in list(axis.lines)):
                _draw_points(axis, found, *units, "D", BLACK, whole=False)
                _name_points(axis)
    return figure


def _name_points(axis: Axes) -> None:
    """Add an entry for the points, the last artists drawn, to the legend of a panel."""
    legend, points = axis.get_legend(), axis.containers[-1]
    handles: list[Any] = [] if legend is None else [*legend.legend_handles]
    names = [] if legend is None else [text.get_text() for text in legend.get_texts()]
    axis.legend([*handles, points], [*names, str(points.get_label())])


def _unit(label: str, base: str) -> float:
    """Return the size of the unit of an axis in the base unit; NaN if they are incompatible."""
    match = IN_BRACKETS.match(label)
    try:
        return to_base(f"1 {match[1]}", base) if match else 1.0 if base == "1" else np.nan
    except UnitError:
        return float("nan")


def _is_of(line: Line2D, found: MeasuredCurve, x_unit: float, y_unit: float) -> bool:
    """Return whether a line shows the curve, in these units."""
    drawn = (np.asarray(line.get_xdata(), float), np.asarray(line.get_ydata(), float))
    return _same(drawn[0] * x_unit, found.curve.x) and _same(drawn[1] * y_unit, found.curve.y)


def _same(drawn: Array, curve: Array) -> bool:
    if drawn.shape != curve.shape or not np.any(np.isfinite(curve)):
        return False
    size = SAME * float(np.nanmax(np.abs(curve)))
    return bool(np.allclose(drawn, curve, rtol=0.0, atol=size, equal_nan=True))


def _draw_points(
    axis: Axes,
    found: MeasuredCurve,
    x_unit: float,
    y_unit: float,
    marker: str,
    colour: str,
    whole: bool = True,
) -> None:
    points = found.points if whole else found.points.only(found.inside)
    bars = None if points.deviations is None else points.deviations / y_unit
    label = "measured" if bars is None else "measured, one standard deviation"
    axis.errorbar(
        points.x / x_unit,
        points.y / y_unit,
        bars,
        fmt=marker,
        color=colour,
        mfc="white" if marker == "o" else AMBER,
        ms=6.0,
        lw=1.2,
        capsize=3.0,
        zorder=5,
        label=label,
    )


def _draw_all(measured: Sequence[Measured], curves: Sequence[CurvesOf], file: h5py.File) -> Figure:
    """Draw each curve with its points, next to their deviations."""
    rows = list(_found(measured, curves, file))
    if not rows:
        return new_figure("No measured points can be compared; the warnings say why", REST)
    largest_share = max(float(np.abs(_deviations(found)).max()) for found in rows)
    title = (
        f"Computed curves deviate by up to {percent(largest_share)} of the largest measured value"
    )
    figure = new_figure(title, REST + HIGH * len(rows))
    panels = figure.subplots(len(rows), 2, squeeze=False)
    for (left, right), found in zip(panels, rows, strict=True):
        _draw_beside(left, right, found)
    return figure


def _deviations(found: MeasuredCurve) -> Array:
    """Return the deviations from the points, as shares of the largest measured value."""
    return (found.computed - found.points.y) / largest(found.points.y)


def _draw_beside(left: Axes, right: Axes, found: MeasuredCurve) -> None:
    curve, points = found.curve, found.points
    x_name, x_unit = suited(largest(curve.x, points.x), curve.x_unit)
    everyday = everyday_unit(curve.y_unit, curve.title)
    y_name, y_unit = suited(largest(curve.y, points.y), curve.y_unit, everyday)
    left.plot(curve.x / x_unit, curve.y / y_unit, color=BLUE, label="computed")
    _draw_points(left, found, x_unit, y_unit, "o", ORANGE)
    left.set_title(f"{curve.title[:1].upper()}{curve.title[1:]}")
    left.set(**axis_labels(curve, x_name, y_name))
    left.legend()
    off = (found.computed - points.y) / y_unit
    bars = None if points.deviations is None else points.deviations / y_unit
    right.errorbar(points.x / x_unit, off, bars, fmt="o", color=ORANGE, ms=6.0, capsize=3.0)
    right.axhline(0.0, color=BLACK, lw=0.8)
    right.set(title="Computed minus measured", xlabel=left.get_xlabel())
    right.set_ylabel(heading("deviation", y_name))
    right.set_xlim(left.get_xlim())
    for axis in (left, right):
        grouped_ticks(axis.yaxis)
