"""Figure of the error budget: estimated errors of the main results due to each approximation."""

from __future__ import annotations

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sa_solver.types import Array
from workflow.analyses.wear.output.layout import RESULTS, WearContents
from workflow.models.budget.names import PARTS
from workflow.pictures.panels import legend_below, new_figure
from workflow.pictures.style import AMBER, BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY

COLOURS = dict(zip(PARTS, (BLUE, ORANGE, GREEN, PURPLE, SKY, AMBER, BLACK), strict=True))

# Height of a bar in inches.
HEIGHT = 0.55


def error_budget(file: h5py.File, contents: WearContents) -> Figure:
    """Draw bars of the parts of every error, with a panel for each contact and each body."""
    panels = [(name, file["error"][name]) for name in contents.names]
    if contents.structure:
        panels += [
            (name, body["error"]) for name, body in file["bodies"].items() if "error" in body
        ]
    title = "Estimated errors of the main results, by source"
    bars = [1 + len(group) for _, group in panels]
    figure = new_figure(title, 1.5 + HEIGHT * sum(bars))
    grid = {"height_ratios": bars}
    axes = figure.subplots(len(panels), squeeze=False, sharex=True, gridspec_kw=grid)[:, 0]
    for axis, (name, group) in zip(axes, panels, strict=True):
        _draw(axis, group)
        axis.set_title(name)
    axes[-1].set_xlabel("estimated error [%], above 0: the result is too large")
    legend_below(figure, axes)
    return figure


def _draw(axis: Axes, group: h5py.Group) -> None:
    """Draw the parts, those that make a result too small to the left of 0, and the total."""
    results = [result for result in RESULTS if result in group]
    columns = np.array([group[result][()] for result in results])
    places, parts, totals = np.arange(len(results)), columns[:, :-1], 100.0 * columns[:, -1]
    known = 100.0 * np.nan_to_num(parts)
    signs = [np.where(known > 0.0, known, 0.0), np.where(known < 0.0, known, 0.0)]
    for sizes in signs:
        ends = np.cumsum(sizes, axis=1)
        for number, part in enumerate(PARTS):
            axis.barh(
                places,
                sizes[:, number],
                left=ends[:, number] - sizes[:, number],
                color=COLOURS[part],
                label=part if sizes is signs[0] else None,
            )
    axis.scatter(totals, places, color=BLACK, marker="|", s=300, zorder=3, label="all together")
    axis.axvline(0.0, color=BLACK, linewidth=1.0)
    axis.axvline(100.0 * group.attrs["accuracy"], color=BLACK, linestyle=":", label="accuracy")
    axis.set_yticks(places, list(map(_name, results, totals, parts)))
    axis.invert_yaxis()
    axis.use_sticky_edges = False
    axis.margins(x=0.05)


def _name(result: str, total: float, parts: Array) -> str:
    """Return the label of a result: its error and, below, its unknown parts."""
    unknown = [part for part, value in zip(PARTS, parts, strict=True) if np.isnan(value)]
    nothing = unknown and total == 0.0
    text = f"{RESULTS[result]}: {'?' if nothing else f'{total:.1f} %'}"
    return f"{text}\n({', '.join(unknown)} unknown)" if unknown else text
