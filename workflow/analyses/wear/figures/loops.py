"""Figure of the tangential loops on worn contacts, and of their results for joint laws.

Bars are the estimated errors due to grid and increments.
"""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sa_solver.types import Array
from workflow.analyses.wear.output.layout import WearContents
from workflow.analyses.wear.output.loop_table import SLIDES
from workflow.pictures.panels import (
    blocks,
    label_rows,
    largest_course,
    legend_below,
    new_figure,
    panel_rows,
    shaded,
)
from workflow.pictures.scales import PER_MICRON, TO_JOULES, TO_MICRONS
from workflow.pictures.style import BLACK, BLUE, GREEN, HEADROOM, ORANGE, PURPLE

# Largest number of loops in a panel without too much overlap.
MOST_LOOPS = 6
# Values with estimated errors, and the factor to the unit in which they are drawn.
SHOWN = {"kt": PER_MICRON, "mu": 1.0, "energy_per_loop": 1.0}
COLOURS = (BLUE, ORANGE, GREEN, PURPLE, BLACK)


def loops(file: h5py.File, contents: WearContents) -> Figure:
    """Draw loops at several numbers of cycles, and below them stiffness and energy over wear."""
    groups, per = file["loops"], contents.per
    ends = {name: list(PER_MICRON * _column(group, "kt")) for name, group in groups.items()}
    title = f"The tangential stiffness {largest_course(ends, f'N/µm{per}')}"
    high = 5.0 * blocks(len(groups))
    figure = new_figure(title, high + 4.5)
    parts = figure.subfigures(2, 1, squeeze=False, height_ratios=(high, 4.5))
    top, bottom = parts[:, 0]
    upper = panel_rows(top, 1, len(groups))
    for axis, (name, group) in zip(upper[0], groups.items(), strict=True):
        _draw_loops(axis, group)
        axis.set(title=name, xlabel="tangential displacement [µm]")
    label_rows(upper, [f"tangential force [N{per}]"])
    legend_below(top, upper.flat)
    _draw_evolution(bottom, groups, per)
    return figure


def _draw_loops(axis: Axes, group: h5py.Group) -> None:
    """Draw first loading and loop, with one colour per number of cycles."""
    for jump, colour in shaded(sorted(group), MOST_LOOPS):
        loop = group[jump]
        cycles = float(loop.attrs["cycles"])
        label = f"{cycles:,.0f} cycles" if cycles else "unworn"
        displacement, force = TO_MICRONS * loop["displacement"][()], loop["force"][()]
        axis.plot(displacement, force, color=colour, label=label)


def _draw_evolution(figure: Any, groups: h5py.Group, per: str) -> None:
    """Draw stiffness, friction and energy per loop over the energy that wear has dissipated."""
    panels = stiffness, friction, energy = figure.subplots(1, 3)
    mobilised = any(np.any(_column(group, "sliding") < SLIDES) for group in groups.values())
    for number, (name, group) in enumerate(groups.items()):
        colour = COLOURS[number % len(COLOURS)]
        worn = TO_JOULES * _column(group, "energy")
        # Interfaces under equal loads coincide: markers shrink so that the last does not hide the
        # first.
        size = 8.0 - 4.0 * number / len(groups)
        look = {"color": colour, "marker": "o", "mfc": "none", "label": name, "markersize": size}
        for axis, (key, scale) in zip(panels, SHOWN.items(), strict=True):
            values, errors = (scale * _column(group, column) for column in (key, f"{key}_error"))
            axis.errorbar(worn, values, errors, capsize=2.0, **look)
    for axis in panels:
        axis.set_xlabel(f"dissipated energy [J{per}]")
        axis.set_ylim(0.0, HEADROOM * max(axis.dataLim.y1, 1e-300))
    stiffness.set(title="stiffness while stuck", ylabel=f"stiffness kt [N/µm{per}]")
    friction.set_title("friction" + ", only mobilised" * mobilised)
    friction.set_ylabel("coefficient of friction µ")
    energy.set(title="energy per loop", ylabel=f"dissipated energy [mJ{per}]")
    if len(groups) > 1:
        legend_below(figure, [stiffness])


def _column(group: h5py.Group, name: str) -> Array:
    """Return a value of every loop of an interface, in the order of the jumps."""
    return np.array([float(group[jump].attrs[name]) for jump in sorted(group)])
