"""Figures of a chart: error against cost for each axis, and for all together."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from math import inf, isfinite, log10
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator
from matplotlib.transforms import Bbox

from workflow.case.text.typeset import typeset
from workflow.chart.ladder import ROUNDING, Ladder, Point
from workflow.chart.run import Chart
from workflow.pictures.panels import legend_below, new_figure
from workflow.pictures.style import (
    AMBER,
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    YELLOW,
    write_figures,
)

COSTS = {"seconds": "computing time on this machine [s]", "convolutions": "convolutions"}
COLOURS = (BLUE, ORANGE, GREEN, PURPLE, AMBER, SKY, YELLOW, BLACK, GREY)
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">")
HEIGHT = 6.6
LEGEND_COLUMNS = 4
LEGEND_SIZE = 10
# Factor between the extreme errors or costs and the limits of the axes.
MARGIN = 3.0
# Decimals of the logarithms of cost and error to which rungs must agree to share one mark.
PLACE = 2
# Largest number of quantities that are drawn one by one: more would hide the rungs.
MOST_QUANTITIES = 4
# Errors of all axes are drawn down to this share of the accuracy; smaller ones decide nothing.
DEEPEST = 1e-3
# Smallest error drawn where only references ran.
SMALLEST = 1e-12
# Room for the name of the most expensive rung, relative to the width of the plot.
LAST_NAME = 0.25
NAME_SIZE = 9
# Offsets [points] and alignment of a name from its mark; the first free one is used.
OFFSETS: tuple[tuple[int, int, str], ...] = (
    (10, 6, "left"),
    (10, -14, "left"),
    (-10, 6, "right"),
    (-10, -14, "right"),
    (12, -4, "left"),
    (-12, -4, "right"),
)
# Half the width of a mark [pixels].
HALF_MARK = 5.0

Place = tuple[float, float]


def write_chart_figures(chart: Chart, folder: Path) -> list[Path]:
    """Draw a figure for each axis and one for all, as PNG files, and return their paths."""
    ladders = [ladder for ladder in chart.ladders if ladder.rungs]
    drawn: dict[str, Callable[[], Figure]] = {
        f"chart_{ladder.axis.name}": partial(axis_figure, ladder, chart.accuracy)
        for ladder in ladders
    }
    if len(drawn) > 1:
        drawn["chart_all"] = partial(all_figure, chart)
    return write_figures(drawn.items(), folder)


def axis_figure(ladder: Ladder, accuracy: float) -> Figure:
    """Draw error against seconds and against convolutions, with a line for each branch."""
    chosen = ladder.cheapest(accuracy)
    which = "none of these settings" if chosen is None else chosen.name
    what = ladder.axis.what
    title = f"{what[0].upper()}{what[1:]}: {which} suffices for {100 * accuracy:g} %"
    figure = new_figure(title, HEIGHT)
    bottom = _bottom([ladder])
    panels = _panels(figure, [ladder])
    for axis, cost in panels:
        branches = list(dict.fromkeys(rung.setting.branch for rung in ladder.rungs))
        for number, branch in enumerate(branches):
            rungs = [rung for rung in ladder.rungs if rung.setting.branch == branch]
            label = branch if len(branches) > 1 else ""
            _draw_line(axis, rungs, cost, bottom, number, label or None)
        _draw_baseline(axis, ladder, cost, bottom)
        _draw_frontier(axis, ladder.rungs, cost, bottom)
        _draw_floor(axis, ladder)
        if len(branches) == 1 and 1 < len(ladder.references) <= MOST_QUANTITIES:
            _draw_quantities(axis, ladder, cost)
        _finish(axis, cost, accuracy, (bottom, _top([ladder], accuracy)))
    _label(figure)
    figure.draw_without_rendering()
    for axis, cost in panels:
        marks = [_place(rung, cost, bottom) for rung in ladder.rungs]
        _name_marks(axis, _names(ladder.rungs, cost, bottom), marks)
    return figure


def all_figure(chart: Chart) -> Figure:
    """Draw the efficient rungs of all axes, each varied alone about the case's own settings."""
    ladders = [ladder for ladder in chart.ladders if ladder.rungs]
    lowest = max(_bottom(ladders), DEEPEST * chart.accuracy)
    title = "Error against cost of each setting, varied alone"
    figure = new_figure(title, HEIGHT)
    for axis, cost in _panels(figure, ladders):
        for number, ladder in enumerate(ladders):
            baseline = [ladder.baseline] if ladder.baseline else []
            _draw_line(axis, baseline, cost, lowest, number, None)
            _draw_line(axis, _frontier(ladder.rungs, cost), cost, lowest, number, ladder.axis.name)
            _draw_baseline(axis, ladder, cost, lowest)
        axis.axhline(lowest, color=BLACK, lw=0.6, ls=":", label="errors below the shown range")
        _finish(axis, cost, chart.accuracy, (lowest, _top(ladders, chart.accuracy)))
    _label(figure)
    return figure


# --- parts --------------------------------------------------------------------------------------


def _panels(figure: Figure, ladders: Sequence[Ladder]) -> list[tuple[Axes, str]]:
    """Return axes for each cost that is known for the runs."""
    rungs = [rung for ladder in ladders for rung in ladder.rungs]
    known = [cost for cost in COSTS if any(getattr(rung.cost, cost) for rung in rungs)]
    axes = figure.subplots(1, len(known), sharey=True, squeeze=False)
    return list(zip(axes[0], known, strict=True))


def _bottom(ladders: Sequence[Ladder]) -> float:
    """Return the height at which rungs without an error are drawn, below every error and floor."""
    errors = [rung.error for ladder in ladders for rung in ladder.rungs]
    seen = [*errors, *(ladder.floor for ladder in ladders)]
    return min((error for error in seen if ROUNDING < error < inf), default=SMALLEST) / MARGIN


def _top(ladders: Sequence[Ladder], accuracy: float) -> float:
    """Return a height above every error."""
    errors = [rung.error for ladder in ladders for rung in ladder.rungs if isfinite(rung.error)]
    return MARGIN * max([accuracy, *errors])


def _place(rung: Point, cost: str, bottom: float) -> Place:
    """Return cost and error of a rung in the figure."""
    size = float(getattr(rung.cost, cost))
    return max(size, 1e-2), max(rung.error, bottom)


def _draw_line(
    axis: Axes, rungs: Sequence[Point], cost: str, bottom: float, number: int, label: str | None
) -> None:
    """Draw a branch, with full marks for resolved rungs and hollow marks for others."""
    if not rungs:
        return
    colour, marker = COLOURS[number % len(COLOURS)], MARKERS[number % len(MARKERS)]
    places = [_place(rung, cost, bottom) for rung in rungs]
    joined = [
        place
        for rung, place in zip(rungs, places, strict=True)
        if rung.error > 0.0 and rung.setting.step is not None
    ]
    if joined:
        axis.plot(*zip(*joined, strict=True), "-", color=colour, alpha=0.6, lw=1.2)
    for rung, place in zip(rungs, places, strict=True):
        hollow = rung.unresolved or rung.error == 0.0
        axis.plot(*place, marker, color=colour, mfc="white" if hollow else colour, ms=8, zorder=3)
    if any(rung.error == 0.0 for rung in rungs):
        axis.axhline(bottom, color=BLACK, lw=0.6, ls=":")
    if label:
        axis.plot([], [], f"-{marker}", color=colour, ms=8, label=label)


def _names(rungs: Sequence[Point], cost: str, bottom: float) -> list[tuple[str, Place]]:
    """Return names of marks and their places, first the case's own, then the efficient ones.

    Marks at the same place share one name.
    """
    frontier = _frontier(rungs, cost)
    first = sorted(rungs, key=lambda rung: (not rung.baseline, rung not in frontier))
    together: dict[Place, list[Point]] = {}
    for rung in first:
        x, y = _place(rung, cost, bottom)
        together.setdefault((round(log10(x), PLACE), round(log10(y), PLACE)), []).append(rung)
    named = []
    for group in together.values():
        names = [rung.name.removeprefix(f"{rung.setting.branch}, ") for rung in group]
        named.append((" and ".join(names), _place(group[0], cost, bottom)))
    return named


def _draw_baseline(axis: Axes, ladder: Ladder, cost: str, bottom: float) -> None:
    """Circle the case as written."""
    if ladder.baseline is not None:
        place = _place(ladder.baseline, cost, bottom)
        axis.plot(*place, "o", mfc="none", mec=BLACK, mew=1.6, ms=17, zorder=4)
    axis.plot([], [], "o", mfc="none", mec=BLACK, mew=1.6, ms=13, label="the case as written")


def _frontier(rungs: Sequence[Point], cost: str) -> list[Point]:
    """Return the efficient rungs, the cheapest first."""
    efficient = [rung for rung in rungs if getattr(rung, f"by_{cost}")]
    return sorted(efficient, key=lambda rung: rung.bound, reverse=True)


def _draw_frontier(axis: Axes, rungs: Sequence[Point], cost: str, bottom: float) -> None:
    """Draw the efficient frontier as steps: the smallest error for no more than a given cost."""
    places = [_place(rung, cost, bottom) for rung in _frontier(rungs, cost)]
    if places:
        costs, errors = zip(*places, strict=True)
        label = "smallest error for the cost"
        look: dict[str, Any] = {"color": GREY, "alpha": 0.45, "lw": 5.0, "zorder": 1}
        axis.step(costs, errors, where="post", label=label, **look)


def _draw_floor(axis: Axes, ladder: Ladder) -> None:
    if ladder.floor > 0.0 and isfinite(ladder.floor):
        axis.axhspan(0.0, ladder.floor, color=ORANGE, alpha=0.12, lw=0, zorder=0)
        axis.axhline(ladder.floor, color=ORANGE, lw=0.8, alpha=0.6)
        axis.plot([], [], "-", color=ORANGE, alpha=0.3, lw=8, label="uncertainty of the reference")


def _draw_quantities(axis: Axes, ladder: Ladder, cost: str) -> None:
    """Draw the error of each quantity where it is resolved; its slope shows the order."""
    for number, (quantity, reference) in enumerate(ladder.references.items(), 1):
        places = [
            (_place(rung, cost, 0.0)[0], abs(rung.values[quantity] / reference.value - 1.0))
            for rung in ladder.rungs
        ]
        seen = [place for place in places if place[1] > reference.floor]
        if seen:
            colour = COLOURS[number % len(COLOURS)]
            name = quantity.removeprefix("states.-1.").replace("_", " ")
            axis.plot(*zip(*seen, strict=True), ":", color=colour, lw=1.6, zorder=2, label=name)


def _finish(axis: Axes, cost: str, accuracy: float, ends: tuple[float, float]) -> None:
    """Set scales and labels; ``ends`` are the lowest and the highest error shown."""
    axis.axhline(
        accuracy, color=BLACK, lw=1.0, ls="--", label=f"required accuracy: {100 * accuracy:g} %"
    )
    axis.set(xlabel=COSTS[cost], xscale="log", yscale="log", ylim=(ends[0] / 1.6, ends[1]))
    low, high = axis.get_xlim()
    high *= (high / low) ** LAST_NAME
    axis.set_xlim(low, high)
    axis.xaxis.set_major_locator(LogLocator(subs=(1, 2, 3, 5, 7) if high < 20 * low else (1, 3)))
    axis.xaxis.set_major_formatter(lambda cost, _: typeset(f"{cost:g}"))
    axis.xaxis.set_minor_formatter("")
    axis.yaxis.set_major_formatter(lambda share, _: typeset(f"{100 * share:g}"))
    axis.yaxis.set_minor_formatter("")


def _label(figure: Figure) -> None:
    figure.axes[0].set_ylabel("largest relative error [%]")
    legend_below(figure, figure.axes[:1], columns=LEGEND_COLUMNS, fontsize=LEGEND_SIZE)


# --- names --------------------------------------------------------------------------------------


def _name_marks(axis: Axes, names: Iterable[tuple[str, Place]], marks: Sequence[Place]) -> None:
    """Write each name next to its place, clear of all ``marks`` and of earlier names.

    Names without room are left out, so the most important ones must come first. The layout of the
    figure must be computed before.
    """
    taken = [_box(axis, place) for place in marks]
    for name, place in names:
        for across, up, side in OFFSETS:
            text = axis.annotate(
                name,
                place,
                (across, up),
                textcoords="offset points",
                fontsize=NAME_SIZE,
                ha=side,
            )
            text.set_in_layout(False)
            box = text.get_window_extent()
            if _inside(box, axis.bbox) and not any(box.overlaps(other) for other in taken):
                taken.append(box)
                break
            text.remove()


def _box(axis: Axes, place: Place) -> Bbox:
    """Return the box of a mark [pixels]."""
    x, y = axis.transData.transform(place)
    return Bbox.from_extents(x - HALF_MARK, y - HALF_MARK, x + HALF_MARK, y + HALF_MARK)


def _inside(box: Bbox, room: Bbox) -> bool:
    return bool(box.x0 >= room.x0 and box.x1 <= room.x1 and box.y0 >= room.y0 and box.y1 <= room.y1)
