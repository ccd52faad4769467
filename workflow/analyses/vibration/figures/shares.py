"""Figures of a vibration case: shares of the period in which joints slip and are apart."""

from __future__ import annotations

import re
from typing import Any

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sa_solver.types import Array, Indices
from workflow.analyses.vibration.case.excitation import under_in
from workflow.analyses.vibration.figures.columns import (
    along,
    by_distance,
    draw_response,
    label_columns,
    mark_resonance,
    shown_responses,
)
from workflow.analyses.vibration.figures.states import KINDS, kinds_of
from workflow.analyses.vibration.output.outcome import VibrationContents
from workflow.pictures.panels import legend_of_colours, new_figure, whole_ticks
from workflow.pictures.style import BLUE, COLOUR_MAP, ORANGE, SHADE

# Most rows of joints that are still readable.
MOST_JOINTS = 6
TO_PERCENT = 1e2
# States of a joint that fill the period, from the bottom of its panel.
DOES = {"sticks or is closed": BLUE, "slips": ORANGE, "is open": SHADE}
# Heights of the response, of the panels below it, and of the margins [inch].
RESPONSE, STRIP, MAP, AROUND = 2.2, 1.5, 2.6, 1.6


def joint_states(file: h5py.File, contents: VibrationContents) -> Figure:
    """Draw for how much of the period each of a few joints sticks, slips and is apart.

    Joints that always stick, such as springs, are left out.
    """
    names, shown = _names(file), shown_responses(file, contents)
    joints = _changing(shown)
    height = AROUND + RESPONSE + STRIP * len(joints)
    figure = new_figure(_most_slipping(shown, names), height)
    panels = figure.subplots(
        *(1 + len(joints), len(shown)),
        sharex=True,
        sharey="row",
        squeeze=False,
        height_ratios=(RESPONSE, *(STRIP,) * len(joints)),
    )
    for column, response in zip(panels.T, shown, strict=True):
        draw_response(column[0], response)
        frequency, points = along(response)
        slip, apart = _shares(response, points)
        for joint, axis in zip(joints, column[1:], strict=True):
            _draw_stack(axis, frequency, [1.0 - slip - apart, slip, apart], joint)
            mark_resonance(axis, response)
    label_columns(panels, shown[0])
    for axis, joint in zip(panels[1:, 0], joints, strict=True):
        axis.set_ylabel(f"{names[joint]}: share\nof period [%]")
    legend_of_colours(figure, DOES)
    return figure


def node_shares(file: h5py.File, contents: VibrationContents) -> Figure:
    """Draw shares of the period in which many joints slip and are apart, and counts by state.

    If no joint is ever apart, there are no maps of that.
    """
    shown = shown_responses(file, contents)
    maps = ("slip", "separation")[: 1 + any(r["nodes/separated"][()].any() for r in shown)]
    title = _most_at_once(shown, "nodes" if contents.places else "joints")
    figure = new_figure(title, AROUND + RESPONSE + len(maps) * MAP + STRIP)
    panels = figure.subplots(
        *(2 + len(maps), len(shown)),
        sharex=True,
        sharey="row",
        squeeze=False,
        height_ratios=(RESPONSE, *(MAP for _ in maps), STRIP),
    )
    order, ticks, label = np.arange(contents.joints), None, "number of joint"
    if contents.places:
        order, ticks = by_distance(file)
        label = "distance from middle [mm]"
    for column, response in zip(panels.T, shown, strict=True):
        draw_response(column[0], response)
        frequency, points = along(response)
        for axis, shares in zip(column[1:-1], _shares(response, points), strict=False):
            mesh = _draw_map(axis, frequency, shares[:, order])
        kinds = kinds_of(response)[points]
        counts = [(kinds == kind).mean(axis=1, keepdims=True) for kind in range(len(KINDS))]
        _draw_stack(column[-1], frequency, counts, 0, tuple(KINDS.values()))
        for axis in column[1:]:
            mark_resonance(axis, response)
    label_columns(panels, shown[0])
    for axis, what in zip(panels[1:-1, 0], maps, strict=True):
        axis.set_ylabel(f"{what} by\n{label}")
        if ticks:
            axis.set_yticks(*ticks)
        else:
            whole_ticks(axis.yaxis)
    panels[-1, 0].set_ylabel("nodes [%]" if contents.places else "joints [%]")
    figure.colorbar(mesh, ax=panels[1:-1], label="share of period [%]", aspect=20 * len(maps))
    legend_of_colours(figure, KINDS)
    return figure


def _names(file: h5py.File) -> list[str]:
    """Return names of the joints, without the axis for joints with several directions."""
    names = []
    for row in file["names/joints"][()]:
        first, *more = (name for name in map(bytes.decode, row) if name != "ground")
        names.append(re.sub(r" [xyz]\b", "", first) if more else first)
    return names


def _changing(shown: list[h5py.Group]) -> list[int]:
    """Return joints that slip or separate at times, or the first if none does."""
    shares = [response[f"nodes/{name}"][()] for response in shown for name in ("slip", "separated")]
    return [int(j) for j in np.flatnonzero(np.any([s.any(axis=0) for s in shares], axis=0))] or [0]


# --- along the curve ----------------------------------------------------------------------------


def _shares(response: h5py.Group, points: Indices) -> tuple[Array, Array]:
    """Return shares of the period ``(c, j)`` in which joints slip, and are apart."""
    return response["nodes/slip"][()][points], response["nodes/separated"][()][points]


def _draw_stack(
    axis: Axes,
    edges: Array,
    shares: list[Array],
    joint: int,
    colours: tuple[str, ...] = tuple(DOES.values()),
) -> None:
    """Draw shares ``(c, j)`` of one joint on top of each other [%]."""
    below = np.zeros(len(edges))
    axis.grid(visible=False)
    for share, colour in zip(shares, colours, strict=True):
        # Repeat the last value, as there is one edge more than columns.
        above = below + TO_PERCENT * np.append(share[:, joint], share[-1, joint])
        axis.fill_between(edges, below, above, step="post", color=colour, linewidth=0.0)
        below = above
    axis.set_ylim(0.0, TO_PERCENT)


def _draw_map(axis: Axes, edges: Array, shares: Array) -> Any:
    axis.grid(visible=False)
    rows = np.arange(shares.shape[1] + 1)
    return axis.pcolormesh(
        *(edges, rows, TO_PERCENT * shares.T), cmap=COLOUR_MAP, vmin=0.0, vmax=TO_PERCENT
    )


# --- words --------------------------------------------------------------------------------------


def _most_slipping(shown: list[h5py.Group], names: list[str]) -> str:
    """Return text on the joint that slips longest, or is apart longest where none slips."""
    response = shown[-1]
    for word, name in (("slips", "slip"), ("is open", "separated")):
        shares = response[f"nodes/{name}"][()]
        if shares.any():
            _, joint = np.unravel_index(shares.argmax(), shares.shape)
            most = TO_PERCENT * shares.max()
            return (
                f"{names[joint]} {word} up to {most:.0f} % of the period {under_in(response.attrs)}"
            )
    return f"No joint slips or opens {under_in(response.attrs)}"


def _most_at_once(shown: list[h5py.Group], what: str) -> str:
    """Return text on the most joints that slip, and are apart, at some time of a cycle."""
    shares = [shown[-1][f"nodes/{name}"][()] for name in ("slip", "separated")]
    slip, apart = (int((share > 0.0).sum(axis=1).max()) for share in shares)
    under = under_in(shown[-1].attrs)
    opening = f"up to {apart} open" if apart else "none opens"
    return f"Up to {slip} of {shares[0].shape[1]} {what} slip {under}, and {opening}"
