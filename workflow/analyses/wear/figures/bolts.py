"""Figure of bolts: their tension as contacts wear, and over a cycle."""

from __future__ import annotations

import h5py
import numpy as np
from matplotlib.figure import Figure

from workflow.analyses.wear.output.layout import WearContents
from workflow.pictures.panels import (
    blocks,
    grouped_ticks,
    label_rows,
    largest_course,
    legend_below,
    new_figure,
    panel_rows,
    whole_ticks,
)
from workflow.pictures.style import BLUE, HEADROOM, ORANGE


def bolts(file: h5py.File, contents: WearContents) -> Figure:
    """Draw the tension at peak load over the cycles, and in each increment, unworn and worn."""
    groups = {name: file["bolts"][name] for name in contents.bolts}
    cycles, unit = file["kinetics/cycles"][()], f"N{contents.per}"
    ends = {name: [group["tension"][0], group["tension"][-1]] for name, group in groups.items()}
    title = f"The bolt tension at peak load {largest_course(ends, unit)}"
    figure = new_figure(title, 7.0 * blocks(len(groups)))
    axes = panel_rows(figure, 2, len(groups), "row")
    largest = 0.0
    for (over, within), (name, group) in zip(axes.T, groups.items(), strict=True):
        over.plot(cycles, group["tension"][()], color=BLUE, marker="o", markersize=4)
        over.set(title=f"{name}: at peak load", xlabel="cycles")
        grouped_ticks(over.xaxis)
        for moment, colour in (("unworn", BLUE), ("worn", ORANGE)):
            tension = group[f"tension_{moment}"][()]
            increments = np.arange(1, len(tension) + 1)
            within.plot(increments, tension, color=colour, marker="o", markersize=4, label=moment)
            largest = max(largest, float(tension.max()))
        within.set(title=f"{name}: over a cycle", xlabel="increment")
        whole_ticks(within.xaxis)
    for row in axes:
        row[0].set_ylim(0.0, HEADROOM * largest)
    label_rows(axes, (f"bolt tension [{unit}]",) * 2)
    legend_below(figure, axes[1])
    return figure
