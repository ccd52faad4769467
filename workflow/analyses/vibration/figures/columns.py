"""Parts of figures with a column of panels for each of a few forces, over the frequency."""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np
from matplotlib.axes import Axes

from sa_solver.types import Array, Indices
from workflow.analyses.vibration.case.excitation import amount_in, load_text
from workflow.analyses.vibration.figures.stability import draw_motions
from workflow.analyses.vibration.output.outcome import VibrationContents
from workflow.pictures.panels import plain_ticks, rounded, spread
from workflow.pictures.scales import TO_MICRONS
from workflow.pictures.style import BLACK

# Most columns of forces that are still readable.
MOST_FORCES = 3
# Columns of a map over frequency: more than its pixels with three maps in a row.
COLUMNS = 480
MOST_TICKS = 6


def shown_responses(
    file: h5py.File, contents: VibrationContents, most: int = MOST_FORCES
) -> list[h5py.Group]:
    """Return at most so many of the responses, evenly spread over the forces."""
    return [file["responses"][name] for name in spread(contents.responses, most)]


def along(response: h5py.Group) -> tuple[Array, Indices]:
    """Return edges of columns ``(c + 1,)`` over the frequency, and the largest motion in each."""
    frequency = response["frequency"][()]
    edges = np.geomspace(frequency.min(), frequency.max(), COLUMNS + 1)
    middle = np.sqrt(edges[1:] * edges[:-1])
    return edges, largest_at(frequency, response["amplitude"][:, -1], middle)


def largest_at(frequency: Array, amplitude: Array, wanted: Array) -> Indices:
    """Return points ``(w,)`` of a curve ``(p,)`` nearest to the frequencies ``wanted``.

    Where the curve folds, it has several motions at a frequency: the largest is taken.
    """
    before, after = frequency[:-1], frequency[1:]
    low, high = np.minimum(before, after), np.maximum(before, after)
    inside = (low <= wanted[:, None]) & (wanted[:, None] <= high)
    sizes = np.where(inside, np.maximum(amplitude[:-1], amplitude[1:]), -1.0)
    segment = sizes.argmax(axis=1)
    second = np.abs(after[segment] - wanted) < np.abs(before[segment] - wanted)
    return np.asarray(segment + second)


def draw_response(axis: Axes, response: h5py.Group) -> None:
    """Draw the observed amplitude over the force, at the top of a column."""
    _, force = amount_in(response.attrs)
    size = TO_MICRONS * response["amplitude"][:, -1] / force
    draw_motions(axis, response, response["frequency"][()], size, color=BLACK)
    mark_resonance(axis, response)
    resonance = rounded(response.attrs["resonance"], 4)
    axis.set_title(f"{load_text(response.attrs)}: resonance at {resonance} Hz")


def mark_resonance(axis: Axes, response: h5py.Group) -> None:
    """Draw a line at the resonance."""
    axis.axvline(response.attrs["resonance"], color=BLACK, linestyle=":", linewidth=1.2)


def label_columns(panels: Any, response: h5py.Group) -> None:
    """Set scales and labels that the panels of all forces share."""
    amount, _ = amount_in(response.attrs)
    top = panels[0, 0]
    top.set(xscale="log", yscale="log")
    top.set_ylabel(f"amplitude / {amount.name}\n[{amount.receptance[1]}]")
    for axis in panels[-1]:
        axis.set_xlabel("frequency [Hz]")
    frequencies = response["frequency"][()]
    top.set_xlim(frequencies.min(), frequencies.max())
    for side in (panels[-1, 0].xaxis, top.yaxis):
        plain_ticks(side)


def by_distance(file: h5py.File) -> tuple[Indices, tuple[Array, list[str]]]:
    """Return the nodes by their distance from the middle, and ticks with the distances [mm]."""
    distance = np.hypot(file["contact/x"][()], file["contact/y"][()])
    order = np.argsort(distance, kind="stable")
    places = np.unique(np.linspace(0, len(order) - 1, MOST_TICKS).round().astype(int))
    return order, (places + 0.5, [f"{distance[order[place]]:.2g}" for place in places])
