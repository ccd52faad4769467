"""Figures of a sweep: 95 % bands of the curves by which runs of an analysis are compared."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sa_solver.types import Array
from workflow.pictures.panels import legend_below, new_figure, panel_grid
from workflow.pictures.style import BLACK, BLUE, ORANGE, write_figures
from workflow.shell.analysis import Analysis
from workflow.shell.output.curves import Curve, axis_labels, curves_of_run, suited_units
from workflow.sweep.bands import FEWEST, Piece, curve_band, quantiles
from workflow.sweep.first_order import sides
from workflow.sweep.table import SweepRow

# Heights of a row of panels, and of title and legend [inches].
ROW, REST = 4.0, 1.3
# Largest number of runs drawn where there is no band.
MOST_RUNS = 100

Curves = dict[str, list[Curve]]
"""Curves of the runs by title."""


@dataclass(frozen=True)
class Way:
    """Way to make a band of runs: the fewest runs, the function of its ``sides``, and labels."""

    fewest: int
    sides: Callable[[Array], Array]
    band: str
    middle: str


OF_A_SAMPLE = Way(FEWEST, quantiles, "95 % of the runs at each place", "median")


def to_first_order(runs: int) -> Way:
    """Return the way that needs all ``runs``, which are spaced about one in the middle."""
    return Way(runs, sides, "95 % to first order", "best values")


def write_band_figures(
    title: str,
    analysis: Analysis[Any],
    rows: Sequence[SweepRow],
    folder: Path,
    way: Way = OF_A_SAMPLE,
) -> list[Path]:
    """Draw the bands of all curves that enough runs have, a figure for each horizontal axis.

    Returns the paths of the figures.
    """
    figures: dict[str, Curves] = {}
    for name, curves in _curves(analysis, rows).items():
        if len(curves) >= way.fewest and _changes(curves):
            along = re.sub(r"[^\w-]+", "_", curves[0].x_name)
            figures.setdefault(f"bands_over_{along}", {})[name] = curves
    drawn = {name: partial(_draw, title, way, curves) for name, curves in figures.items()}
    return write_figures(drawn.items(), folder)


def _curves(analysis: Analysis[Any], rows: Sequence[SweepRow]) -> Curves:
    """Return the curves of the finished runs, by title."""
    curves: Curves = {}
    for row in rows:
        if row.done:
            for curve in curves_of_run(row.finished.folder, analysis.curves):
                curves.setdefault(curve.title, []).append(curve)
    return curves


def _changes(curves: Sequence[Curve]) -> bool:
    """Return whether any run has another curve than the first."""
    first = curves[0]
    return any(
        len(c.x) != len(first.x) or not np.array_equal(c.y, first.y) or np.any(c.x != first.x)
        for c in curves
    )


def _draw(title: str, way: Way, panels: Curves) -> Figure:
    columns = min(len(panels), 2)
    most = max(map(len, panels.values()))
    figure = new_figure(f"{title}: {most} runs", REST + ROW * -(-len(panels) // columns))
    axes = panel_grid(figure, len(panels), columns)
    for axis, (name, curves) in zip(axes, panels.items(), strict=True):
        _draw_panel(axis, way, name, curves)
    legend_below(figure, axes)
    return figure


def _draw_panel(axis: Axes, way: Way, name: str, curves: Sequence[Curve]) -> None:
    first = curves[0]
    (x_unit, x_size), (y_unit, y_size) = suited_units(curves)
    shown = [(curve.x / x_size, curve.y / y_size) for curve in curves]
    if pieces := curve_band(shown, way.fewest, way.sides):
        _draw_band(axis, way, pieces)
        axis.set_title(name)
    else:
        for number, (x, y) in enumerate(shown[:MOST_RUNS]):
            axis.plot(x, y, color=BLACK, lw=0.5, alpha=0.4, label=None if number else "each run")
        axis.set_title(
            f"{name}: no band, because the curves of the runs turn back at different places"
        )
    if first.logarithmic:
        axis.set_yscale("log", nonpositive="mask")
    axis.set(**axis_labels(first, x_unit, y_unit))


def _draw_band(axis: Axes, way: Way, pieces: Sequence[Piece]) -> None:
    look: dict[str, Any] = {"color": BLUE, "alpha": 0.3, "lw": 0}
    for number, piece in enumerate(pieces):
        labels = (None, None) if number else (way.band, way.middle)
        axis.fill_between(piece.places, piece.lower, piece.upper, label=labels[0], **look)
        axis.plot(piece.places, piece.median, color=ORANGE, label=labels[1])
