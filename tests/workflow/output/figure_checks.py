"""Checks of any figure: titles, labels with units, texts that do not overlap, panels with data."""

import re
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path

import h5py
import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from workflow.kinds import analysis_of, load_case
from workflow.pictures.style import DOTS_PER_INCH, STYLE
from workflow.report.writing import pictures_of
from workflow.shell.output.results import read_contents

UNIT = re.compile(r"\[[^\[\]]+\]")
# Quantities without a unit: counts and ratios.
WITHOUT_UNIT = {
    *("cycles", "increment", "cycle of the record", "convolutions", "number of joint"),
    *("nodes in contact", "number of nodal diameters", "coefficient of friction µ", "friction"),
    *("deviation", "friction.coefficient", "friction µ", "friction µ at least"),
}
# Texts may share this many pixels, since the boxes of letters have some margin.
TOUCHING = 2.0


def problems_of_run(folder: Path) -> list[str]:
    """Return the problems of all figures of a finished run."""
    case = load_case(folder / "case.yaml")
    drawn_by, results = pictures_of(analysis_of(case), case), folder / "results.h5"
    assert drawn_by is not None
    pictures = drawn_by()
    figures = pictures.figures_of(read_contents(results, pictures.contents))
    found = []
    with h5py.File(results) as file, rc_context(STYLE):
        for name, draw in figures.items():
            found += [f"{name}: {problem}" for problem in problems(laid_out(draw(file)))]
    return found


def laid_out(figure: Figure) -> Figure:
    """Return a figure with the layout that it has when it is written."""
    figure.set_dpi(DOTS_PER_INCH)
    figure.draw_without_rendering()
    return figure


def problems(figure: Figure) -> list[str]:
    """Return the problems of a figure that has been laid out."""
    untitled = [] if figure.get_suptitle() else ["no title"]
    checks = _empty, _unbounded, _unlabelled, _overlapping, _cut_off
    return [*untitled, *(problem for check in checks for problem in check(figure))]


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


# --- labels -------------------------------------------------------------------------------------


def _unlabelled(figure: Figure) -> Iterator[str]:
    """Yield panels of which neither they nor those below or to the left have a label and a unit."""
    panels = [axis for axis in _panels(figure) if axis.axison]
    for panel in panels:
        for direction in (0, 1):
            around = [panel, *(other for other in panels if _outside(other, panel, direction))]
            labels = [_label(other, direction) for other in around]
            if not _has_words(panel, direction) and not any(map(_is_complete, labels)):
                yield f"no label with a unit along {'xy'[direction]}: {_name(panel)}, {labels[0]}"
    for bar in figure.axes:
        if bar.get_label() == "<colorbar>" and not UNIT.search(bar.get_ylabel()):
            yield f"a colour bar without a unit: {bar.get_ylabel()}"


def _outside(other: Axes, panel: Axes, direction: int) -> bool:
    """Return whether a panel is below another (direction 0) or to the left of it (1)."""
    one, two = other.get_position(), panel.get_position()
    if direction == 0:
        return bool(one.y1 <= two.y0 and min(one.x1, two.x1) > max(one.x0, two.x0))
    return bool(one.x1 <= two.x0 and min(one.y1, two.y1) > max(one.y0, two.y0))


def _label(axis: Axes, direction: int) -> str:
    label = axis.get_xlabel() if direction == 0 else axis.get_ylabel()
    return " ".join(label.split())


def _is_complete(label: str) -> bool:
    return bool(UNIT.search(label)) or label in WITHOUT_UNIT


def _has_words(axis: Axes, direction: int) -> bool:
    """Return whether the ticks of a panel are named rather than numbered."""
    texts = [text.get_text() for text in _tick_labels((axis.xaxis, axis.yaxis)[direction])]
    return any(re.search(r"[^\W\d]{2}", text) for text in texts)


# --- texts --------------------------------------------------------------------------------------


def _overlapping(figure: Figure) -> Iterator[str]:
    texts = [text for text in _texts(figure) if text.get_text().strip()]
    # The extent of an annotation itself would include its arrow.
    boxes = [(text, Text.get_window_extent(text)) for text in texts]
    for (one, box), (two, other) in combinations(boxes, 2):
        if one is not two and _overlap(box, other):
            yield f"texts overlap: {one.get_text()!r} and {two.get_text()!r}"


def _cut_off(figure: Figure) -> Iterator[str]:
    """Yield texts that end beyond the figure."""
    inside = figure.bbox.padded(TOUCHING)
    for text in _texts(figure):
        box = Text.get_window_extent(text)
        ends = inside.containsx(box.x0) and inside.containsx(box.x1)
        if text.get_text().strip() and not (ends and inside.containsy(box.y0)):
            yield f"a text is cut off: {text.get_text()!r}"


def _overlap(one: Bbox, two: Bbox) -> bool:
    wide, high = np.minimum(one.max, two.max) - np.maximum(one.min, two.min)
    return bool(wide > TOUCHING and high > TOUCHING)


def _texts(figure: Figure) -> Iterator[Text]:
    """Yield titles, labels, numbers along axes, notes and the texts of legends."""
    for part in (figure, *figure.subfigs):
        yield from part.texts
        for legend in part.legends:
            yield from _legend_texts(legend)
    for axis in figure.axes:
        if not axis.get_visible():
            continue
        yield from (axis.title, axis._left_title, *axis.texts)
        if (legend := axis.get_legend()) is not None:
            yield from _legend_texts(legend)
        if axis.axison:
            for line in (axis.xaxis, axis.yaxis):
                yield from (line.label, line.offsetText, *_tick_labels(line))


def _legend_texts(legend: Legend) -> Iterator[Text]:
    yield from (legend.get_title(), *legend.get_texts())


def _tick_labels(line: Axis) -> Iterator[Text]:
    """Yield the visible numbers along an axis, only those within its limits."""
    low, high = sorted(line.get_view_interval())
    room = 1e-9 * (high - low)
    for tick in (*line.get_major_ticks(), *line.get_minor_ticks()):
        if low - room <= tick.get_loc() <= high + room:
            yield from (text for text in (tick.label1, tick.label2) if text.get_visible())


def _name(axis: Axes) -> str:
    return axis.get_title(loc="left") or axis.get_ylabel() or axis.get_xlabel() or "no name"
