"""Building blocks of figures: empty figures, panels, colours, legends, ticks and texts."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any, Literal

import h5py
import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, NullLocator

from workflow.case.text.plain import GROUPED, times
from workflow.case.text.readable import percent
from workflow.case.text.typeset import typeset
from workflow.pictures.fitting import FittedLayout
from workflow.pictures.style import COLOUR_MAP, LAST_SHADE

Figures = Mapping[str, Callable[[h5py.File], Figure]]
"""Functions that draw the figures of results, by the figures' names."""

WIDTH_INCHES = 12.0
# Padding at the sides of a figure [inches].
PAD = 0.06
# Characters in a row of a legend below a figure, and for the handle of each entry.
ROW_WIDTH, HANDLE = 125, 7
# Largest number of panels in a row; those of further interfaces begin new rows.
MOST_COLUMNS = 3
# Labelled multiples within a decade; further numbers would touch each other.
TICKS = (2.0, 5.0)
# Ratio of the ends of a logarithmic axis from which on only decades have numbers; ratio up to which
# its numbers are those of a linear axis, and their count.
MANY_DECADES, FEW_DECADES, FEW_TICKS = 100.0, 4.0, 5
# Value from which on an axis has room for this many intervals between its numbers only.
LONG_FROM, FEWEST_TICKS = 1e6, 3
# A change is given in percent if the first value is at least this share of the last.
NEARLY_ZERO = 1e-2
# Values from the first size on are shown as whole numbers, up to the second size.
WHOLE_FROM, WHOLE_TO = 1e3, 1e7
# Forces are shown in kN from this value on [N], volumes in µm³ up to this value [mm³].
LARGE_FORCE, SMALL_VOLUME = 1e3, 1e-3


def new_figure(title: str, height: float, compress: bool = False) -> Figure:
    """Return an empty figure of this ``height`` [inches]; ``compress`` is for panels to scale."""
    figure = Figure(
        figsize=(WIDTH_INCHES, height), layout=FittedLayout(w_pad=PAD, compress=compress)
    )
    FigureCanvasAgg(figure)  # measures a text without drawing the figure, unlike others
    figure.suptitle(title, fontweight="bold")
    return figure


def blocks(columns: int) -> int:
    """Return the number of rows that ``columns`` columns are broken into."""
    return -(-columns // MOST_COLUMNS)


def panel_rows(
    figure: Any,
    rows: int,
    columns: int,
    sharex: Literal["all", "row"] = "all",
) -> Any:
    """Return the axes ``(rows, columns)`` of ``rows`` panels for every column.

    Columns beyond ``MOST_COLUMNS`` are placed below, in further :func:`blocks`. All panels of a row
    share y, and share x with all panels or with the row. The figure must be high enough.
    """
    across = min(columns, MOST_COLUMNS)
    places = figure.add_gridspec(rows * blocks(columns), across)
    axes = np.empty((rows, columns), dtype=object)
    for row, column in np.ndindex(rows, columns):
        block, place = divmod(column, MOST_COLUMNS)
        shared = axes[0 if sharex == "all" else row, 0]
        spot = places[block * rows + row, place]
        axis = figure.add_subplot(spot, sharex=shared, sharey=axes[row, 0])
        numbered = sharex == "row" or row == rows - 1
        axis.tick_params(labelleft=place == 0, labelbottom=numbered)
        axes[row, column] = axis
    return axes


def label_rows(axes: Any, labels: Iterable[str]) -> None:
    """Label the y axes of the panels at the left."""
    for row, label in zip(axes, labels, strict=True):
        for axis in row[::MOST_COLUMNS]:
            axis.set_ylabel(label)


def spread(items: Sequence[Any], most: int) -> list[Any]:
    """Return at most ``most`` of the items, evenly spread, including the first and the last."""
    places = np.linspace(0, len(items) - 1, min(most, len(items)))
    return [items[round(place)] for place in places]


def shaded(items: Sequence[Any], most: int) -> list[tuple[Any, Any]]:
    """Return at most ``most`` of the items, each with its colour; more curves would overlap."""
    chosen = spread(items, most)
    shades = colormaps[COLOUR_MAP](np.linspace(0.0, LAST_SHADE, len(chosen)))
    return list(zip(chosen, shades, strict=True))


def rounded(value: float, digits: int = 3) -> str:
    """Return a value with a few digits for a title or a legend: 0.379, 321, 16,800."""
    near = float(f"{value:.{digits}g}")
    return times(near) if WHOLE_FROM <= abs(near) < WHOLE_TO else f"{near:.{digits}g}"


def course(series: Sequence[float], unit: str, digits: int = 3) -> str:
    """Say in a title how a value changes from the first to the last: falls from 367 to 321 MPa."""
    first, last = (rounded(series[place], digits) for place in (0, -1))
    if len(series) == 1:
        return f"is {last} {unit}"
    if series[0] == 0.0:
        return f"reaches {last} {unit}"
    if first == last:
        return f"stays at {last} {unit}"
    return f"{'rises' if series[-1] > series[0] else 'falls'} from {first} to {last} {unit}"


def largest_course(values: Mapping[str, Sequence[float]], unit: str) -> str:
    """Say how the largest of some values changes, with its name if others change otherwise."""
    texts = {name: course(series, unit) for name, series in values.items()}
    name = max(values, key=lambda name: max(values[name]))
    return texts[name] if len(set(texts.values())) == 1 else f"{texts[name]} ({name})"


def change(before: float, after: float, unit: str) -> str:
    """Describe a relative change for a title, or give both values if the first is nearly zero."""
    if before > NEARLY_ZERO * abs(after):
        share = after / before - 1.0
        return f"{'+' if share > 0.0 else '-' if share < 0.0 else ''}{percent(abs(share))}"
    return f"{rounded(before)} → {rounded(after)} {unit}"


def force_unit(largest: float) -> tuple[float, str]:
    """Return the scale and the unit in which forces up to ``largest`` [N] are shown."""
    return (1e-3, "kN") if largest >= LARGE_FORCE else (1.0, "N")


def volume_unit(largest: float) -> tuple[float, str]:
    """Return the scale and the unit in which volumes up to ``largest`` [mm³] are shown."""
    return (1.0, "mm³") if largest >= SMALL_VOLUME else (1e9, "µm³")


def present(drawn: Mapping[str, tuple[Callable[..., Figure], object]], contents: Any) -> Figures:
    """Return the functions of figures, by name, whose data are there, for these ``contents``.

    ``drawn`` has each function with a value that is true if the results contain its data.
    """
    return {
        name: partial(draw, contents=contents) for name, (draw, there) in drawn.items() if there
    }


def legend_of_colours(figure: Figure, colours: Mapping[str, Any]) -> None:
    """Draw a legend below all panels that names each colour."""
    patches = [Patch(facecolor=colour, label=name) for name, colour in colours.items()]
    figure.legend(
        handles=patches, loc="outside lower center", ncols=len(patches), columnspacing=1.2
    )


def legend_below(
    figure: Any,
    axes: Iterable[Axes],
    columns: int | None = None,
    fontsize: float | None = None,
    title: str | None = None,
) -> None:
    """Draw one legend of several panels below all of them, each name once.

    By default it has as many rows as the width of a figure needs.
    """
    named: dict[str, Any] = {}
    for axis in axes:
        handles, names = axis.get_legend_handles_labels()
        named |= dict(zip(names, handles, strict=True))
    if named:
        widths = [len(name) + HANDLE for name in named]
        fitting = len(named) if sum(widths) <= ROW_WIDTH else max(1, ROW_WIDTH // max(widths))
        figure.legend(
            named.values(),
            named.keys(),
            loc="outside lower center",
            ncols=columns or fitting,
            fontsize=fontsize,
            title=title,
        )


def widen(axis: Axes, least: float) -> None:
    """Make the y axis of a panel span at least ``least``, since smaller changes do not matter.

    On a logarithmic axis, ``least`` is the relative difference of its ends.
    """
    low, high = axis.get_ylim()
    if axis.get_yscale() == "log":
        missing = ((1.0 + least) * low / high) ** 0.5
        if missing > 1.0:
            axis.set_ylim(low / missing, high * missing)
    elif (missing := 0.5 * (least - (high - low))) > 0.0:
        axis.set_ylim(low - missing, high + missing)


def plain_ticks(line: Axis) -> None:
    """Set a few plain numbers along a logarithmic axis of any range, after its limits are set."""
    low, high = line.get_view_interval()
    if high > low * MANY_DECADES:
        line.set_major_locator(LogLocator())
        line.set_minor_formatter(NullFormatter())
    elif high > low * FEW_DECADES:
        line.set_minor_locator(LogLocator(subs=TICKS))
        line.set_minor_formatter(lambda x, _: typeset(f"{x:g}"))
    else:
        line.set_major_locator(MaxNLocator(FEW_TICKS))
        line.set_minor_locator(NullLocator())
    line.set_major_formatter(lambda x, _: typeset(f"{x:g}"))


def grouped_ticks(line: Axis) -> None:
    """Set a few numbers along an axis, grouped by thousands if they are large.

    The limits of the axis must be set before.
    """
    largest = np.abs(line.get_view_interval()).max()
    grouped = "," if largest >= GROUPED else ""
    line.set_major_locator(MaxNLocator(FEW_TICKS if largest < LONG_FROM else FEWEST_TICKS))
    line.set_major_formatter(lambda x, _: typeset(f"{x:{grouped}.10g}"))


def whole_ticks(line: Axis) -> None:
    """Set whole numbers along an axis that counts."""
    line.set_major_locator(MaxNLocator(integer=True))


def panel_grid(figure: Any, count: int, columns: int = 2) -> list[Axes]:
    """Return ``count`` panels in rows; those of the last row share its whole width."""
    full, rest = divmod(count, columns)
    rows = full + bool(rest)
    places = figure.add_gridspec(rows, columns * max(rest, 1))
    axes = []
    for number in range(count):
        row, place = divmod(number, columns)
        wide = columns if row == full else max(rest, 1)
        axes.append(figure.add_subplot(places[row, place * wide : (place + 1) * wide]))
    return axes
