"""Figures of a sweep: results of its runs, as bands over the cycles and against varied entries."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sa_solver.types import Array
from workflow.pictures.panels import (
    blocks,
    grouped_ticks,
    label_rows,
    legend_below,
    new_figure,
    panel_rows,
    plain_ticks,
    rounded,
    volume_unit,
)
from workflow.pictures.scales import TO_MICRONS
from workflow.pictures.style import BLACK, BLUE, ORANGE, write_figures
from workflow.sweep.table import SweepRow, Varied, columns_of, interfaces_of, unit_of, varied_in

# Largest number of runs that can be distinguished as separate lines.
LINES = 30
# Ratio of largest to smallest above which an axis is logarithmic.
LOGARITHMIC = 30.0
# Fewest runs for which a rank correlation is meaningful.
FEWEST_TO_CORRELATE = 6
# Quantities of wear runs to show, with labels; other runs show the first of OTHERS that they have.
WEAR = {"depth": "largest depth, both bodies", "volume": "worn volume, both bodies"}
OTHERS = (
    ("states.-1.peak_pressure", "peak pressure at the end", "MPa"),
    ("loop.energy", "energy of the last closed cycle", "N mm"),
    ("states.-1.cumulative_energy", "energy dissipated on the path", "N mm"),
)
MOST_ROWS = 2
# Result of line contacts only, whose energies are per length.
LINE_CONTACT = "states.-1.contact_half_width"


def write_sweep_figures(title: str, rows: Sequence[SweepRow], folder: Path) -> list[Path]:
    """Draw the figures of a sweep as PNG files; return their paths."""
    figures = {}
    if names := _wearing(rows):
        figures["kinetics"] = partial(kinetics_bands, title, rows, names)
    if panels := _panels(rows, names):
        for varied in varied_in(rows):
            name = "against_" + re.sub(r"[^\w-]", "_", varied.path)
            figures[name] = partial(against, title, varied, panels)
    return write_figures(figures.items(), folder)


def _wearing(rows: Sequence[SweepRow]) -> list[str]:
    """Return the interfaces that wear in any of the runs."""
    summaries = [row.finished.summary or {} for row in rows]
    return list(dict.fromkeys(name for summary in summaries for name in interfaces_of(summary)))


# --- over the cycles ----------------------------------------------------------------------------


def kinetics_bands(title: str, rows: Sequence[SweepRow], names: Sequence[str]) -> Figure:
    """Draw depth and volume of all runs against cycles, by interface."""
    done = [row.finished.summary for row in rows if row.finished.summary]
    statistics = "medians (and ranges) at the end"
    figure = new_figure(f"{title}: {len(done)} runs, {statistics}", 9.0 * blocks(len(names)))
    axes = panel_rows(figure, 2, len(names))
    scales = _scales(rows, names)
    for column, name in zip(axes.T, names, strict=True):
        summaries = [summary for summary in done if name in interfaces_of(summary)]
        for axis, quantity in zip(column, WEAR, strict=True):
            scale, unit = scales[quantity]
            last = _draw_bands(axis, summaries, name, quantity, scale)
            low, middle, high = (float(np.quantile(last, q)) for q in (0.0, 0.5, 1.0))
            values = f"{quantity} {rounded(middle)} ({rounded(low)} to {rounded(high)})"
            axis.set_title(f"{name}: {values} {unit}")
        column[-1].set_xlabel("cycles")
        grouped_ticks(column[-1].xaxis)
    label_rows(axes, [f"{label} [{scales[quantity][1]}]" for quantity, label in WEAR.items()])
    legend_below(figure, [axes[0, 0]])
    return figure


def _draw_bands(
    axis: Axes, summaries: Sequence[dict[str, Any]], name: str, quantity: str, scale: float
) -> Array:
    """Draw the bands of the runs; return their last values ``(runs,)``."""
    curves = [_curve(summary, name, quantity, scale) for summary in summaries]
    cycles = np.unique(np.concatenate([counts for counts, _ in curves]))
    # A run has no values beyond its end.
    values = np.array([np.interp(cycles, *curve, right=np.nan) for curve in curves])
    median = _fill_bands(axis, cycles, values.T)
    if len(curves) <= LINES:
        for index, curve in enumerate(curves):
            label = None if index else "each run"
            axis.plot(*curve, color=BLACK, lw=0.6, alpha=0.5, label=label)
    axis.plot(cycles, median, color=ORANGE, lw=2.2, label="median")
    return np.array([curve[1][-1] for curve in curves])


def _fill_bands(axis: Axes, places: Array, values: Sequence[Array] | Array) -> Array:
    """Draw range and middle half of the finite values at each place; return the medians."""
    quantiles = [np.nanquantile(at, [0.0, 0.25, 0.5, 0.75, 1.0]) for at in values]
    low, quarter, median, three, high = np.transpose(quantiles)
    look: dict[str, Any] = {"color": BLUE, "lw": 0}
    axis.fill_between(places, low, high, alpha=0.15, label="all runs", **look)
    axis.fill_between(places, quarter, three, alpha=0.35, label="middle half", **look)
    return median


def _curve(summary: dict[str, Any], name: str, quantity: str, scale: float) -> tuple[Array, Array]:
    """Return cycles ``(j,)`` and the wear of both bodies together ``(j,)``."""
    kinetics = summary["kinetics"][name]
    worn = np.array(kinetics[f"{quantity}_1"]) + np.array(kinetics[f"{quantity}_2"])
    return np.array(summary["kinetics"]["cycles"]), scale * worn


# --- against varied entries ---------------------------------------------------------------------


@dataclass(frozen=True)
class Panel:
    """Results of the runs ``(runs,)``, NaN for a failed one, with label and title."""

    label: str
    title: str
    values: Array


def _panels(rows: Sequence[SweepRow], names: Sequence[str]) -> list[list[Panel]]:
    """Return panels by row and column of a figure, for the wearing interfaces ``names`` if any."""
    columns = columns_of(rows)
    if names:
        scales = _scales(rows, names)
        return [
            [
                Panel(
                    f"{words} [{scales[quantity][1]}]",
                    f"{name}: {quantity} at the end",
                    scales[quantity][0] * columns[f"{name}.{quantity}"],
                )
                for name in names
            ]
            for quantity, words in WEAR.items()
        ]
    shown = [quantity for quantity in OTHERS if quantity[0] in columns][:MOST_ROWS]
    per = "/mm" if LINE_CONTACT in columns else ""
    return [
        [Panel(f"{text} [{unit}{per if unit == 'N mm' else ''}]", text, columns[name])]
        for name, text, unit in shown
    ]


def _scales(rows: Sequence[SweepRow], names: Sequence[str]) -> dict[str, tuple[float, str]]:
    """Return scale and unit of the worn depths and volumes of all interfaces."""
    columns = columns_of(rows)
    volumes = np.concatenate([columns[f"{name}.volume"] for name in names])
    scale, unit = volume_unit(float(np.nanmax(volumes)))
    per = unit_of(f"{names[0]}.volume", rows).replace("^3", "³").removeprefix("mm³")
    return {"depth": (TO_MICRONS, "µm"), "volume": (scale, f"{unit}{per}")}


def against(title: str, varied: Varied, panels: list[list[Panel]]) -> Figure:
    """Draw results of the runs against one varied entry."""
    rows, columns = len(panels), len(panels[0])
    figure = new_figure(f"{title}: results against {varied.path}", 4.5 * rows * blocks(columns))
    axes = panel_rows(figure, rows, columns)
    places, ticks = _places(varied)
    for axis, panel in zip(axes.flat, (panel for row in panels for panel in row), strict=True):
        _draw_against(axis, places, panel)
        correlation = "" if ticks else _correlation(places, panel.values)
        axis.set_title(f"{panel.title}{correlation}")
        if ticks:
            axis.set_xticks(range(len(ticks)), ticks)
        elif places.min() > 0.0 and places.max() > LOGARITHMIC * places.min():
            axis.set_xscale("log")
            plain_ticks(axis.xaxis)
    for axis in axes[-1]:
        axis.set_xlabel(varied.heading)
    label_rows(axes, [row[0].label for row in panels])
    legend_below(figure, [axes[0, 0]])
    return figure


def _places(varied: Varied) -> tuple[Array, list[str]]:
    """Return the place of each run on the axis, and tick labels if the values are not numbers."""
    if varied.numbers is not None:
        return varied.numbers, []
    words = list(dict.fromkeys(varied.texts))
    return np.array([words.index(text) for text in varied.texts], dtype=np.float64), words


def _draw_against(axis: Axes, places: Array, panel: Panel) -> None:
    """Draw a dot for each run; if runs share values, also the spread and median at each value."""
    done = np.isfinite(panel.values)
    distinct = np.unique(places[done])
    groups = [panel.values[done & (places == place)] for place in distinct]
    if len(distinct) > 1 and any(len(group) > 1 for group in groups):
        median = _fill_bands(axis, distinct, groups)
        axis.plot(distinct, median, color=ORANGE, lw=2.2, label="median")
    axis.plot(places[done], panel.values[done], "o", color=BLACK, ms=5, alpha=0.6, label="a run")
    if not done.all():
        bottom = axis.get_xaxis_transform()
        style: dict[str, Any] = {"color": ORANGE, "ms": 9, "mew": 2, "clip_on": False}
        failed = places[~done]
        axis.plot(failed, 0.0 * failed, "x", transform=bottom, label="a run that failed", **style)


def _correlation(places: Array, values: Array) -> str:
    """Return Spearman's rank correlation, for a title."""
    done = np.isfinite(values)
    if np.count_nonzero(done) < FEWEST_TO_CORRELATE or np.ptp(places[done]) == 0.0:
        return ""
    if np.ptp(values[done]) == 0.0:
        return ", equal in all runs"
    from scipy.stats import spearmanr

    rank = float(spearmanr(places[done], values[done]).statistic)
    return f", rank correlation {rank:+.2f}"
