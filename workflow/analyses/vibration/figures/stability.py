"""Curves of motions in figures: unstable parts dashed, and marks where stability changes."""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from sa_solver.types import Array
from workflow.pictures.style import BLACK

# Line styles by code of stability. Between two points, the smaller code counts.
LINES: dict[int, Any] = {1: "-", 0: ":", -1: "--"}
WORDS = {0: "stability unknown", -1: "unstable"}
# Marks of bifurcations, with their names.
MARKS = {
    "fold": ("s", "fold"),
    "branching": ("^", "branch point"),
    "period_doubling": ("D", "period doubling"),
    "neimark_sacker": ("*", "second frequency (Neimark-Sacker)"),
    "jump": ("X", "joints change it abruptly"),
}
MARK: dict[str, Any] = {"markersize": 6, "linestyle": "none", "zorder": 5}


def draw_motions(axis: Axes, group: h5py.Group, x: Array, y: Array, **look: Any) -> None:
    """Draw a curve of motions ``(n,)``, dashed if unstable; solid if stability is not computed."""
    codes = _codes(group)
    if not codes.any():
        axis.plot(x, y, "-", **look)
        return
    parts = np.minimum(codes[:-1], codes[1:]) if len(codes) > 1 else codes
    label = look.pop("label", None)
    for code, line in LINES.items():
        for first, last in _runs(parts == code):
            axis.plot(x[first : last + 1], y[first : last + 1], line, label=label, **look)
            label = None


def draw_amplitudes(axis: Axes, group: h5py.Group, factor: float, **look: Any) -> None:
    """Draw the main observed amplitude times a ``factor`` over the frequency, as motions are.

    Bifurcations are marked.
    """
    amplitude = group["amplitude"][()]
    size = factor * (amplitude if amplitude.ndim == 1 else amplitude[:, -1])
    draw_motions(axis, group, group["frequency"][()], size, **look)
    if "bifurcations" in group:
        found = group["bifurcations"]
        places = zip(found["frequency"][()], factor * found["amplitude"][()], strict=True)
        for kind, place in zip(found.attrs["kind"], places, strict=True):
            axis.plot(*place, MARKS[kind][0], color=look["color"], **MARK)


def _codes(group: h5py.Group) -> np.ndarray:
    """Return the codes of stability of the motions, empty if there is no such column."""
    return np.asarray(group["stability"][()]) if "stability" in group else np.zeros(0, int)


def _runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """Return first and past-the-last index of each run of true ``flags``."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    return [(int(first), int(last)) for first, last in zip(edges[::2], edges[1::2], strict=True)]


def explain_stability(axis: Axes, groups: list[h5py.Group]) -> None:
    """Add entries to the legend for the lines and marks of stability on these curves."""
    known = [codes for codes in map(_codes, groups) if codes.any()]
    codes = {int(code) for of_curve in known for code in of_curve}
    for code, word in WORDS.items():
        if code in codes:
            axis.add_line(Line2D([], [], color=BLACK, linestyle=LINES[code], label=word))
    kinds = {
        kind
        for group in groups
        if "bifurcations" in group
        for kind in group["bifurcations"].attrs["kind"]
    }
    for kind, (mark, word) in MARKS.items():
        if kind in kinds:
            axis.add_line(Line2D([], [], color=BLACK, marker=mark, label=word, **MARK))
