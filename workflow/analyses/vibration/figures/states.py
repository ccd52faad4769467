"""Figures of a vibration case: nodes of a contact that stick, slip and lift off."""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from sa_solver.types import Array, Indices
from workflow.analyses.vibration.case.excitation import load_text, under_in
from workflow.analyses.vibration.case.pad_nodes import rows_and_columns
from workflow.analyses.vibration.figures.columns import (
    along,
    by_distance,
    draw_response,
    label_columns,
    largest_at,
    mark_resonance,
    shown_responses,
)
from workflow.analyses.vibration.output.outcome import VibrationContents
from workflow.pictures.panels import legend_of_colours, new_figure
from workflow.pictures.style import BLUE, ORANGE

# Most forces with readable maps of the pad.
MOST_PADS = 6
# States of a node in a cycle, numbered from 0, with colours (Okabe and Ito's, and greys).
KINDS = {
    "sticks": BLUE,
    "slips, up to half of the cycle": "#F0E442",
    "slips longer": ORANGE,
    "lifts off for part of the cycle": "#8A8A8A",
    "always open": "#E3E3E3",
}
STICKS, SLIPS_BRIEFLY, SLIPS_LONG, LIFTS_OFF, OPEN = range(len(KINDS))
CELLS: dict[str, Any] = {
    "cmap": ListedColormap(list(KINDS.values())),
    "vmin": -0.5,
    "vmax": len(KINDS) - 0.5,
}
HALF = 0.5
# Tolerance on shares of a cycle, for rounding.
ROUNDING = 1e-9
# Frequencies of the maps of the pad, over that of the peak: an octave below and above, or the end
# of the curve.
OCTAVES = {"below": 0.5, "at the peak": 1.0, "above": 2.0}
# Heights of the margins of the maps of the pad, and of the maps [inch]. With more columns than
# ``WIDE`` the maps are lower.
AROUND_PADS, PAD_ROWS, WIDE = 2.4, 6.6, 4


def node_states(file: h5py.File, contents: VibrationContents) -> Figure:
    """Draw the state of every node over frequency, below the response, under some forces."""
    shown = shown_responses(file, contents)
    figure = new_figure(_title(shown), 8.5)
    panels = figure.subplots(
        2, len(shown), sharex=True, sharey="row", squeeze=False, height_ratios=(1.0, 1.6)
    )
    order, ticks = by_distance(file)
    for (top, bottom), response in zip(panels.T, shown, strict=True):
        draw_response(top, response)
        edges, points = along(response)
        kinds = kinds_of(response)[points][:, order]
        bottom.grid(visible=False)
        bottom.pcolormesh(edges, np.arange(len(order) + 1), kinds.T, **CELLS)
        mark_resonance(bottom, response)
    label_columns(panels, shown[0])
    panels[1, 0].set_ylabel("nodes by distance from the middle [mm]")
    panels[1, 0].set_yticks(*ticks)
    legend_of_colours(figure, KINDS)
    return figure


def pad_states(file: h5py.File, contents: VibrationContents) -> Figure:
    """Draw the state of the nodes on the pad: below, at and above the peak of each force."""
    shown = shown_responses(file, contents, MOST_PADS)
    height = PAD_ROWS * min(1.0, WIDE / len(shown))
    figure = new_figure(_title(shown), AROUND_PADS + height, compress=True)
    panels = figure.subplots(len(OCTAVES), len(shown), sharex=True, sharey=True, squeeze=False)
    for row, (name, factor) in zip(panels, OCTAVES.items(), strict=True):
        for axis, response in zip(row, shown, strict=True):
            place = _point_near(response, factor * float(response.attrs["resonance"]))
            frequency = response["frequency"][place]
            _draw_pad(axis, file["contact"], kinds_of(response)[place])
            axis.set_title(f"{load_text(response.attrs)}, {frequency:.4g} Hz", fontsize="small")
        row[0].set_ylabel(f"{name}\ny [mm]")
    for axis in panels[-1]:
        axis.set_xlabel("x [mm]")
    legend_of_colours(figure, KINDS)
    return figure


def kinds_of(response: h5py.Group) -> Indices:
    """Return the state of every node at every point of a curve ``(p, j)``: index in ``KINDS``."""
    slip, apart = response["nodes/slip"][()], response["nodes/separated"][()]
    kinds = np.where(slip <= ROUNDING, STICKS, SLIPS_LONG)
    kinds[(slip > ROUNDING) & (slip <= HALF)] = SLIPS_BRIEFLY
    kinds[apart > ROUNDING] = LIFTS_OFF
    kinds[apart >= 1.0 - ROUNDING] = OPEN
    return kinds


def _title(shown: list[h5py.Group]) -> str:
    texts = []
    for response in (shown[0], shown[-1])[: len(shown)]:
        kinds = kinds_of(response)[_point_near(response, float(response.attrs["resonance"]))]
        touching = int((kinds != OPEN).sum())
        sticking = int((kinds == STICKS).sum())
        texts.append(f"{sticking} of {touching} {under_in(response.attrs)}")
    return f"Nodes that touch and only stick at the peak: {', '.join(texts)}"


def _point_near(response: h5py.Group, frequency: float) -> int:
    """Return the point of a curve nearest to a frequency, after clipping that to its span."""
    curve, amplitude = response["frequency"][()], response["amplitude"][:, -1]
    inside = np.clip([frequency], curve.min(), curve.max())
    return int(largest_at(curve, amplitude, inside)[0])


# --- on the pad ---------------------------------------------------------------------------------


def _draw_pad(axis: Axes, contact: h5py.Group, kinds: Indices) -> None:
    """Draw one coloured cell per node, or dots where the nodes are not in rows and columns."""
    x, y = contact["x"][()], contact["y"][()]
    axis.set_aspect("equal")
    axis.grid(visible=False)
    numbers = rows_and_columns(x, y)
    if numbers is None:
        axis.scatter(x, y, c=kinds, **CELLS)
        return
    edges = (_edges(x[numbers].mean(axis=1)), _edges(y[numbers].mean(axis=0)))
    axis.pcolormesh(*edges, kinds[numbers].T, edgecolors="white", linewidth=0.5, **CELLS)


def _edges(lines: Array) -> Array:
    """Return edges of the cells around ascending ``lines``, with whole first and last cells."""
    between = 0.5 * (lines[1:] + lines[:-1])
    return np.concatenate([[2.0 * lines[0] - between[0]], between, [2.0 * lines[-1] - between[-1]]])
