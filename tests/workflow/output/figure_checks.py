"""Checks of any figure: nothing is cut, covered, empty or without limits."""

from collections.abc import Iterator
from itertools import combinations
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure
from matplotlib.text import Annotation, Text
from matplotlib.transforms import Bbox

# Of a map's panel, the least share that data take; of the figure's width, the least of a map's
# longer side.
LEAST_SHOWN, LEAST_LENGTH = 0.4, 0.25
# Texts may come so close [pixels], which their boxes have above and below letters.
CLOSE = 3.0


def problems(figure: Figure) -> list[str]:
    """Return the problems of a figure that has been laid out."""
    return [
        *_empty(figure),
        *_unbounded(figure),
        *_cut(figure),
        *_overlaps(figure),
        *_covered(figure),
        *_white_maps(figure),
    ]


def _panels(figure: Figure) -> list[Axes]:
    """Return the visible axes except colour bars."""
    return [axis for axis in figure.axes if axis.get_visible() and axis.get_label() != "<colorbar>"]


def _empty(figure: Figure) -> Iterator[str]:
    for axis in _panels(figure):
        drawn = [*axis.lines, *axis.collections, *axis.images, *axis.patches]
        if not any(artist.get_visible() for artist in drawn):
            yield f"a panel without anything: {_name(axis)}"


def _unbounded(figure: Figure) -> Iterator[str]:
    for axis in _panels(figure):
        if not np.isfinite([*axis.get_xlim(), *axis.get_ylim()]).all():
            yield f"limits that are no numbers: {_name(axis)}"


def _name(axis: Axes) -> str:
    return axis.get_title(loc="left") or axis.get_ylabel() or axis.get_xlabel() or "no name"


# --- texts ---------------------------------------------------------------------------------------


def _texts(figure: Figure) -> list[tuple[str, Text, Bbox]]:
    """Return all visible texts with their boxes."""
    numbers, drawn = set(), set()
    for axis in figure.axes:
        for line in (axis.xaxis, axis.yaxis):
            for tick in [*line.get_major_ticks(), *line.get_minor_ticks()]:
                numbers |= {tick.label1, tick.label2}
            if axis.get_visible() and line.get_visible():
                # Those within the limits only.
                drawn |= {word for t in line._update_ticks() for word in (t.label1, t.label2)}
    hidden = {word for axis in figure.axes if not axis.get_visible() for word in axis.findobj(Text)}
    return [
        (text.get_text(), text, text.get_window_extent())
        for text in figure.findobj(Text)
        if text.get_visible()
        and text.get_text().strip()
        and text not in hidden
        and (text not in numbers or text in drawn)
    ]


def _cut(figure: Figure) -> Iterator[str]:
    width, height = figure.bbox.width, figure.bbox.height
    for words, _, box in _texts(figure):
        if box.x0 < -1 or box.y0 < -1 or box.x1 > width + 1 or box.y1 > height + 1:
            yield f"cut: {words!r}"


def _overlaps(figure: Figure) -> Iterator[str]:
    for (one, first, a), (other, second, b) in combinations(_texts(figure), 2):
        across = min(a.x1, b.x1) - max(a.x0, b.x0)
        along = min(a.y1, b.y1) - max(a.y0, b.y0)
        if isinstance(first, Annotation) and isinstance(second, Annotation):
            continue
        if across > CLOSE and along > CLOSE:
            yield f"one over the other: {one!r}, {other!r}"


# --- legends -------------------------------------------------------------------------------------


def _covered(figure: Figure) -> Iterator[str]:
    """Yield legends that cover points of curves."""
    legends = [axis.get_legend() for axis in _panels(figure) if axis.get_legend()]
    boxes = [legend.get_window_extent() for legend in [*legends, *figure.legends]]
    for part in figure.subfigs:
        boxes += [legend.get_window_extent() for legend in part.legends]
    for axis in _panels(figure):
        seen = axis.get_window_extent()
        for places in _points(axis):
            inside = places[_within(places, seen)]
            if any(_within(inside, box).any() for box in boxes):
                yield f"a legend over data: {_name(axis)}"
                break


def _points(axis: Axes) -> Iterator[Any]:
    """Yield the positions of drawn points and of the lines between them [pixels]."""
    for line in axis.lines:
        data = np.asarray(line.get_xydata(), dtype=float)
        if line.get_transform() != axis.transData or len(data) == 0:
            continue
        places = line.get_transform().transform(data)
        places = places[np.isfinite(places).all(axis=1)]
        if line.get_linestyle() != "None" and len(places) > 1:
            share = np.linspace(0.0, 1.0, 10, endpoint=False)[:, None, None]
            between = (1.0 - share) * places[:-1] + share * places[1:]
            places = np.concatenate([between.reshape(-1, 2), places[-1:]])
        yield places
    for dots in axis.collections:
        if isinstance(dots, PathCollection):
            yield dots.get_offset_transform().transform(dots.get_offsets())


def _within(places: Any, box: Bbox) -> Any:
    low, high = np.array(box.min), np.array(box.max)
    return np.all((places > low) & (places < high), axis=-1)


# --- maps ----------------------------------------------------------------------------------------


def _white_maps(figure: Figure) -> Iterator[str]:
    """Yield figures whose maps are mostly white around their data, or too small."""
    maps = [axis for axis in _panels(figure) if axis.images]
    if maps and max(map(shown_share, maps)) < LEAST_SHOWN:
        yield f"maps of {max(map(shown_share, maps)):.0%} data: {_name(maps[0])}"
    for axis in maps:
        box = axis.get_window_extent()
        if max(box.width, box.height) < LEAST_LENGTH * figure.bbox.width:
            yield f"a map of {box.width:.0f} x {box.height:.0f} pixels: {_name(axis)}"


def shown_share(axis: Axes) -> float:
    """Return the share of a map's panel that the bounding box of its data takes."""
    values = np.ma.asarray(axis.images[-1].get_array())
    there = ~np.ma.getmaskarray(values)
    left, right, bottom, top = axis.images[-1].get_extent()
    share = 1.0
    for direction, (low, high), ends in (
        (0, (left, right), axis.get_xlim()),
        (1, (bottom, top), axis.get_ylim()),
    ):
        places = np.flatnonzero(there.any(axis=direction))
        pitch = (high - low) / there.shape[1 - direction]
        share *= (np.ptp(places) + 1) * pitch / abs(ends[1] - ends[0]) if len(places) else 0.0
    return share
