"""Figures of a sample: 95 % bands of the curves that its kind of run is compared by."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sa_solver.types import Array
from workflow.case.readable import suited
from workflow.comparing.curves import Curve, curves_in
from workflow.pictures.panels import legend_below, new_figure
from workflow.pictures.style import BLACK, BLUE, ORANGE, write_figures
from workflow.shell.analysis import Analysis
from workflow.shell.folder import OutputFolder
from workflow.sweep.bands import FEWEST, Piece, curve_band
from workflow.sweep.table import Row

HEIGHT = 6.0
# Runs shown where there is no band.
MOST_RUNS = 100


def write_band_figures(
    title: str, analysis: Analysis[Any], rows: Sequence[Row], folder: Path
) -> list[Path]:
    """Draw the bands of all curves that enough runs have; returns their paths."""
    figures = {
        "band_" + re.sub(r"[^\w-]+", "_", name): partial(_draw, title, name, curves)
        for name, curves in _curves(analysis, rows).items()
        if len(curves) >= FEWEST and _changes(curves)
    }
    return write_figures(figures.items(), folder)


def _curves(analysis: Analysis[Any], rows: Sequence[Row]) -> dict[str, list[Curve]]:
    """Curves of the runs that have ended, by title."""
    curves: dict[str, list[Curve]] = {}
    for row in rows:
        if not row.done:
            continue
        with h5py.File(OutputFolder(row.finished.folder).results) as file:
            for wanted in analysis.curves:
                for curve in curves_in(file, wanted):
                    curves.setdefault(curve.title, []).append(curve)
    return curves


def _changes(curves: Sequence[Curve]) -> bool:
    """Whether any run has another curve than the first."""
    first = curves[0]
    return any(
        len(c.x) != len(first.x) or not np.array_equal(c.y, first.y) or np.any(c.x != first.x)
        for c in curves
    )


def _draw(title: str, name: str, curves: Sequence[Curve]) -> Figure:
    first = curves[0]
    x_unit, x_size = suited(max(_largest(curve.x) for curve in curves), first.x_unit)
    y_unit, y_size = suited(max(_largest(curve.y) for curve in curves), first.y_unit)
    shown = [(curve.x / x_size, curve.y / y_size) for curve in curves]
    pieces = curve_band(shown)
    figure = new_figure(f"{title}: {len(curves)} runs", HEIGHT)
    axis = figure.subplots()
    if pieces:
        _draw_band(axis, pieces)
        axis.set_title(f"{name}: 95 % of the runs at each place")
    else:
        for number, (x, y) in enumerate(shown[:MOST_RUNS]):
            axis.plot(x, y, color=BLACK, lw=0.5, alpha=0.4, label=None if number else "each run")
        axis.set_title(f"{name}: no band, the runs do not turn back alike")
    if first.logarithmic:
        axis.set_yscale("log", nonpositive="mask")
    axis.set_xlabel(_label(first.x_name, x_unit))
    axis.set_ylabel(_label(first.y_name, y_unit))
    legend_below(figure, [axis])
    return figure


def _draw_band(axis: Axes, pieces: Sequence[Piece]) -> None:
    look: dict[str, Any] = {"color": BLUE, "alpha": 0.3, "lw": 0}
    for number, piece in enumerate(pieces):
        labels = (None, None) if number else ("95 % band", "median")
        axis.fill_between(piece.places, piece.lower, piece.upper, label=labels[0], **look)
        axis.plot(piece.places, piece.median, color=ORANGE, label=labels[1])


def _largest(values: Array) -> float:
    finite = np.abs(values[np.isfinite(values)])
    return float(finite.max()) if finite.size else 0.0


def _label(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name
