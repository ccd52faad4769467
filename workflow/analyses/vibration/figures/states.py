"""Figure of a vibration case: nodes of a contact that stick, slip and lift off."""

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
from workflow.analyses.vibration.figures.columns import largest_at, shown_responses
from workflow.analyses.vibration.output.outcome import VibrationContents
from workflow.pictures.panels import legend_of_colours, new_figure, rounded
from workflow.pictures.style import BLUE, GREY, ORANGE, PALE, YELLOW

# Most forces, each with a row of maps.
MOST_PADS = 4
# States of a node in a cycle, numbered from 0, with colours.
KINDS = {
    "sticks": BLUE,
    "slips, up to half of the cycle": YELLOW,
    "slips longer": ORANGE,
    "lifts off for part of the cycle": GREY,
    "always open": PALE,
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
OCTAVES = {"below the peak": 0.5, "at the peak": 1.0, "above the peak": 2.0}
# Heights of the margins of the maps of the pad, and of a row of maps [inch].
AROUND_PADS, PAD_ROW = 1.8, 3.6


def pad_states(file: h5py.File, contents: VibrationContents) -> Figure:
    """Draw the state of the nodes on the pad: below, at and above the peak of each force."""
    shown = shown_responses(file, contents, MOST_PADS)
    figure = new_figure(_title(shown), AROUND_PADS + PAD_ROW * len(shown), compress=True)
    panels = figure.subplots(len(shown), len(OCTAVES), sharex=True, sharey=True, squeeze=False)
    for row, response in zip(panels, shown, strict=True):
        for axis, (name, factor) in zip(row, OCTAVES.items(), strict=True):
            place = _point_near(response, factor * float(response.attrs["resonance"]))
            frequency = rounded(response["frequency"][place], 4)
            _draw_pad(axis, file["contact"], kinds_of(response)[place])
            axis.set_title(f"{load_text(response.attrs)}, {frequency} Hz, {name}")
        row[0].set_ylabel("y [mm]")
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
    return f"Touching nodes that only stick at the peak: {' and '.join(texts)}"


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
