"""Figure of the error budget: what each approximation is estimated to leave of the main results."""

from __future__ import annotations

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from workflow.analyses.wear.layout import PARTS, RESULTS, Contents
from workflow.pictures.panels import legend_below, new_figure
from workflow.pictures.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY

COLOURS = dict(zip(PARTS, (BLUE, ORANGE, GREEN, PURPLE, SKY, BLACK), strict=True))

# Of a bar, in inches.
HEIGHT = 0.55


def error_budget(file: h5py.File, contents: Contents) -> Figure:
    """Bars of the parts of every error, a panel for each contact and each body."""
    panels = [(name, file["error"][name]) for name in contents.names]
    if contents.structure:
        panels += [
            (name, body["error"]) for name, body in file["bodies"].items() if "error" in body
        ]
    title = "Estimated errors of the main results, and what leaves them"
    bars = [1 + len(group) for _, group in panels]
    figure = new_figure(title, 1.5 + HEIGHT * sum(bars))
    grid = {"height_ratios": bars}
    axes = figure.subplots(len(panels), squeeze=False, sharex=True, gridspec_kw=grid)[:, 0]
    for axis, (name, group) in zip(axes, panels, strict=True):
        _draw(axis, group)
        axis.set_title(name)
    axes[-1].set_xlabel("estimated error [%]")
    legend_below(figure, axes)
    return figure


def _draw(axis: Axes, group: h5py.Group) -> None:
    results = [result for result in RESULTS if result in group]
    parts = np.array([group[result][()] for result in results])
    places, known = np.arange(len(results)), 100.0 * np.nan_to_num(parts)
    ends = np.cumsum(known, axis=1)
    for number, part in enumerate(PARTS):
        axis.barh(
            places,
            known[:, number],
            left=ends[:, number] - known[:, number],
            color=COLOURS[part],
            label=part,
        )
    for place, (end, row) in enumerate(zip(ends[:, -1], parts, strict=True)):
        unknown = [part for part, value in zip(PARTS, row, strict=True) if np.isnan(value)]
        text = f" {end:.1f} %" + (f", {', '.join(unknown)} unknown" if unknown else "")
        axis.text(end, place, text, va="center", color=BLACK)
    axis.axvline(100.0 * group.attrs["accuracy"], color=BLACK, linestyle=":", label="accuracy")
    axis.set_yticks(places, [RESULTS[result] for result in results])
    axis.invert_yaxis()
    axis.margins(x=0.3)
