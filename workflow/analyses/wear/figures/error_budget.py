"""Figure of the error budget: estimated errors of the main results due to each approximation."""

from __future__ import annotations

from collections.abc import Sequence

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sa_solver.types import Array
from workflow.analyses.wear.output.layout import RESULTS, WearContents
from workflow.case.text.readable import percent
from workflow.models.budget.names import PARTS
from workflow.pictures.panels import legend_below, new_figure
from workflow.pictures.style import AMBER, BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, YELLOW

COLOURS = dict(zip(PARTS, (BLUE, ORANGE, YELLOW, GREEN, PURPLE, SKY, AMBER, BLACK), strict=True))

# Height of a bar in inches, and the largest error that is drawn: from there on, nothing is known.
HEIGHT, MOST = 0.55, 1.0


def error_budget(file: h5py.File, contents: WearContents) -> Figure:
    """Draw bars of the parts of every error, with a panel for each contact and each body."""
    panels = [(name, file["error"][name]) for name in contents.names]
    if contents.structure:
        panels += [
            (name, body["error"]) for name, body in file["bodies"].items() if "error" in body
        ]
    bars = [len(group) for _, group in panels]
    figure = new_figure(_title(panels), 1.5 + HEIGHT * (sum(bars) + len(bars)))
    grid = {"height_ratios": bars}
    axes = figure.subplots(len(panels), squeeze=False, sharex=True, gridspec_kw=grid)[:, 0]
    for axis, (name, group) in zip(axes, panels, strict=True):
        _draw(axis, group)
        axis.set_title(name)
    low, high = axes[-1].get_xlim()
    axes[-1].set_xlim(max(low, -100.0 * MOST), min(high, 100.0 * MOST))
    axes[-1].set_xlabel("estimated error [%] (above 0: the result is too large)")
    legend_below(figure, axes)
    return figure


def _title(panels: Sequence[tuple[str, h5py.Group]]) -> str:
    """Return a title on the result with the largest error."""
    totals = {
        (name, result): float(group[result][-1])
        for name, group in panels
        for result in RESULTS
        if result in group
    }
    name, result = max(totals, key=lambda key: totals[key])
    return (
        f"Largest estimated error: {_text(totals[name, result])} of the {RESULTS[result]} ({name})"
    )


def _text(total: float) -> str:
    """Return an error in per cent."""
    return percent(total) if total <= MOST else f"over {percent(MOST)}"


def _draw(axis: Axes, group: h5py.Group) -> None:
    """Draw the parts, those that make a result too small to the left of 0, and the total."""
    results = [result for result in RESULTS if result in group]
    columns = np.array([group[result][()] for result in results])
    places, parts, totals = np.arange(len(results)), columns[:, :-1], columns[:, -1]
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
    axis.scatter(100.0 * totals, places, color=BLACK, marker="|", s=300, zorder=3, label="total")
    axis.axvline(0.0, color=BLACK, linewidth=1.0)
    axis.axvline(
        100.0 * group.attrs["accuracy"], color=BLACK, linestyle=":", label="required accuracy"
    )
    axis.set_yticks(places, list(map(_name, results, totals, parts)))
    axis.invert_yaxis()
    axis.use_sticky_edges = False
    axis.margins(x=0.05)


def _name(result: str, total: float, parts: Array) -> str:
    """Return the label of a result: its error and, below, its unknown parts."""
    unknown = [part for part, value in zip(PARTS, parts, strict=True) if np.isnan(value)]
    nothing = unknown and total == 0.0
    text = f"{RESULTS[result]}: {'unknown' if nothing else _text(total)}"
    return f"{text}\n({', '.join(unknown)} unknown)" if unknown else text
