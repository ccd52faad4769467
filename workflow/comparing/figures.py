"""Figures with the curves of several runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from sa_solver.types import Array
from workflow.comparing.compared import ComparedRuns
from workflow.pictures.panels import grouped_ticks, legend_below, new_figure
from workflow.pictures.style import AMBER, BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY
from workflow.shell.output.curves import Curve, axis_labels, curves_of_run, largest, suited_units

HEIGHT = 6.0  # [inches]
# Curves with no more points than this have marks, as points that coincide make no line.
FEW_POINTS = 8
COLOURS = BLUE, ORANGE, GREEN, PURPLE, SKY, AMBER, BLACK
STYLES = "-", "--", "-.", ":"
# Ratio of the ranges of curves above which a logarithmic axis shows them.
MUCH_SMALLER = 50.0
# More curves than this in a panel cannot be distinguished.
MOST = len(COLOURS) * len(STYLES)

Curves = dict[str, dict[str, Curve]]
"""Curves by title and name of the run."""


def figures_of(comparison: ComparedRuns) -> dict[str, Callable[[], Figure]]:
    """Return a drawing function for each title of curves that two runs or more have in common.

    Curves of one title must have the same units.
    """
    shared: Curves = {}
    for run in comparison.runs[:MOST]:
        for curve in curves_of_run(run.folder, comparison.analysis.curves):
            shared.setdefault(curve.title, {})[run.name] = curve
    alike = {title: _alike(curves) for title, curves in shared.items()}
    return {
        title: partial(_draw, title, curves) for title, curves in alike.items() if len(curves) > 1
    }


def _alike(curves: dict[str, Curve]) -> dict[str, Curve]:
    """Return the curves with the units of the first: forces of line contacts are per mm."""
    units = _units(next(iter(curves.values())))
    return {name: curve for name, curve in curves.items() if _units(curve) == units}


def _draw(title: str, curves: dict[str, Curve]) -> Figure:
    figure = new_figure(f"{title[:1].upper()}{title[1:]}, {len(curves)} runs", HEIGHT)
    axis = figure.subplots()
    first = next(iter(curves.values()))
    (x_unit, x_size), (y_unit, y_size) = suited_units(curves.values())
    for number, (name, curve) in enumerate(curves.items()):
        many = len(curves) > len(COLOURS)
        look = STYLES[number // len(COLOURS) if many else number % len(STYLES)]
        axis.plot(
            curve.x / x_size,
            curve.y / y_size,
            look,
            color=COLOURS[number % len(COLOURS)],
            label=name,
            marker="o" if len(curve.x) <= FEW_POINTS else None,
        )
    if _much_smaller([curve.x for curve in curves.values()]):
        axis.set_xscale("log", nonpositive="mask")
    if first.logarithmic or _much_smaller([curve.y for curve in curves.values()]):
        axis.set_yscale("log", nonpositive="mask")
    for line in (axis.xaxis, axis.yaxis):
        if line.get_scale() == "linear":
            grouped_ticks(line)
    axis.set(**axis_labels(first, x_unit, y_unit))
    legend_below(figure, [axis], columns=3)
    return figure


def _much_smaller(values: Sequence[Array]) -> bool:
    """Return whether some curves are too small to be seen on the same linear axis as others.

    A logarithmic axis is possible only if no value is negative.
    """
    reached = [largest(those) for those in values]
    seen = min(reached) * MUCH_SMALLER >= max(reached) or min(reached) == 0.0
    return not seen and all(np.nanmin(those) >= 0.0 for those in values)


def _units(curve: Curve) -> tuple[str, str]:
    return curve.x_unit, curve.y_unit
