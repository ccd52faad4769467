"""Figure of a fit: data, curve with its band, and residuals, for each kind of data."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sa_solver.types import Array
from workflow.case.units import to_base
from workflow.fit.fitting import ENERGY, Fitted, FittedSeries
from workflow.pictures.panels import legend_below, new_figure, volume_unit
from workflow.pictures.style import BLACK, BLUE, ORANGE, write_figures
from workflow.shell.output.tables import heading

# Heights of a row of panels, and of title and legend [inches].
ROW, REST = 3.0, 1.3
# Smallest range of residuals shown, and the 95 % lines, both in standard deviations.
LEAST, LINES = 3.0, 1.96
# Ratio of energies above which their axis is logarithmic.
DECADES = 1e3
# Number of points of a curve; the first point after zero energy, relative to the smallest datum.
POINTS, EARLIEST = 200, 1e-6
# Margin to the left of zero energy, relative to the smallest datum.
MARGIN = 0.2


def write_figure(fitted: Fitted, path: Path) -> None:
    """Draw the fit and write it to ``path``."""
    write_figures([(path.stem, partial(figure, fitted))], path.parent)


def figure(fitted: Fitted) -> Figure:
    """Return the figure: a row per kind of data, with data and curve left and residuals right."""
    drawn = new_figure(fitted.given.file.title, REST + ROW * len(fitted.series))
    axes = drawn.subplots(
        len(fitted.series), 2, squeeze=False, sharex="row", width_ratios=(1.6, 1.0)
    )
    for place, (series, (left, right)) in enumerate(zip(fitted.series, axes, strict=True)):
        here = fitted.fit.problem.places == place
        _draw_data(left, fitted, series, here)
        _draw_residuals(right, series, fitted.fit.standardised[here])
        for axis in (left, right):
            _label(axis, series)
    legend_below(drawn, axes[:, 0])
    return drawn


def _draw_data(axis: Axes, fitted: Fitted, series: FittedSeries, here: Array) -> None:
    scale, unit = _scale(series)
    places = series.along.factor * series.column.against
    axis.errorbar(
        places,
        scale * series.column.values,
        yerr=scale * fitted.fit.deviations[here],
        fmt="o",
        color=BLACK,
        ms=4.0,
        lw=0.8,
        label="measured, one standard deviation",
    )
    if series.curve is None:
        axis.plot(places, scale * fitted.fit.fitted[here], "x", color=BLUE, label="fit")
    else:
        _draw_curve(axis, fitted, series, series.curve, scale)
    called = series.name.replace("_", " ")
    axis.set_ylabel(heading(called, unit))


def _draw_curve(
    axis: Axes,
    fitted: Fitted,
    series: FittedSeries,
    curve: Callable[[Array], Callable[[Array], Array]],
    scale: float,
) -> None:
    places = _spread(series)
    predict = curve(places)
    middle, half = scale * predict(fitted.fit.values), scale * fitted.fit.band(predict)
    axis.plot(series.along.factor * places, middle, color=BLUE, label="fit")
    axis.fill_between(
        series.along.factor * places,
        middle - half,
        middle + half,
        color=BLUE,
        alpha=0.25,
        lw=0.0,
        label="95 % band of the fit",
    )


def _draw_residuals(axis: Axes, series: FittedSeries, residuals: Array) -> None:
    axis.plot(series.along.factor * series.column.against, residuals, "o", color=ORANGE, ms=4.0)
    for level in (-LINES, 0.0, LINES):
        axis.axhline(level, color=BLACK, lw=0.8, ls="-" if level == 0.0 else "--")
    most = max(LEAST, 1.1 * float(np.abs(residuals).max()))
    axis.set_ylim(-most, most)
    axis.set_ylabel("residual [standard deviations]")


def _label(axis: Axes, series: FittedSeries) -> None:
    axis.set_xlabel(heading(series.along.name, series.along.unit))
    energy = series.along.factor * series.column.against
    if _is_wide(series):
        smallest = energy[energy > 0.0].min()
        # Linear up to the smallest energy, so that zero energy has its place too.
        axis.set_xscale("symlog", linthresh=smallest)
        axis.set_xlim(
            -MARGIN * smallest if energy.min() == 0.0 else smallest / 2.0, 2.0 * energy.max()
        )


def _is_wide(series: FittedSeries) -> bool:
    energy = series.column.against
    return series.along == ENERGY and bool(energy.max() > DECADES * energy[energy > 0.0].min())


def _spread(series: FittedSeries) -> Array:
    """Return the places of the curve ``(m,)``, none of them beyond the data."""
    energy = series.column.against
    if series.along != ENERGY:
        return energy  # forward and backward, since it is a loop
    if not _is_wide(series):
        return np.linspace(energy.min(), energy.max(), POINTS)
    smallest = energy[energy > 0.0].min()
    wide = np.geomspace(smallest, energy.max(), POINTS)
    if energy.min() > 0.0:
        return wide
    return np.concatenate([np.zeros(1), np.geomspace(EARLIEST * smallest, smallest, POINTS), wide])


def _scale(series: FittedSeries) -> tuple[float, str]:
    """Return the factor and unit in which values are drawn, "" for no unit."""
    if series.unit == "1":
        return 1.0, ""
    if series.unit == "mm^3":
        return volume_unit(float(np.abs(series.column.values).max()))
    return 1.0 / to_base(f"1 {series.unit}", None), series.unit.replace("um", "µm")
