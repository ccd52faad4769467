"""Figures and tables of `docs/cost.md`: cost of work by its size, up to the largest.

    python docs/cost_charts.py [--draw] [CHART ...]

`make docs-figures` draws them too. Every point is measured in a separate process, as processor
seconds on one thread (`docs/cost_works.py`); with ``--draw`` the stored points are drawn again.
Each line is labelled with its slope, the exponent of the growth of the cost with size, fitted to
the upper half of the points.
"""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import ceil, inf
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from draw_gallery import ROOT, store
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from sa_solver.types import Array
from workflow.chart.figures import COLOURS, MARKERS
from workflow.pictures.panels import legend_below, new_figure, plain_ticks, spread, widen
from workflow.pictures.style import write_figures
from workflow.shell.processes import environment

FIGURES = ROOT / "docs" / "figures"
MEASURES = ("seconds", "count", "memory")
# Works that need a condensed structure; it is prepared in advance, so that its memory is excluded.
PREPARED = ("missions", "harmonics", "contacts")
HEIGHT = 5.2
# Number of labelled sizes at an axis, and smallest ratio of the ends of the axis.
TICKS, LEAST_SPAN = 4, 3.0
# Smallest number of points for a slope, and memory [GB] below which memory kept by libraries
# distorts it.
FEWEST, LEAST_MEMORY = 3, 0.02
# Columns of the table of largest sizes: processor seconds, and memory of the machine [GB].
TIMES, MACHINE = {"10 s": 10.0, "1 min": 60.0, "10 min": 600.0}, 24.0
# Largest factor of extrapolation beyond the largest measured size.
FURTHER = 2.5


@dataclass(frozen=True)
class Line:
    """Line of a chart: a ``work`` of :mod:`cost_works`, its name, and the sizes it is measured at.

    The work counts what ``counted`` names; ``largest`` describes a size in words.
    """

    work: str
    name: str
    sizes: Sequence[int]
    counted: str
    largest: Callable[[int], str]


@dataclass(frozen=True)
class CostChart:
    """Chart of works over the same kind of ``size``, in one figure."""

    title: str
    size: str
    lines: Sequence[Line]


Points = Mapping[str, Array]
"""Sizes of a work, and the values of each measure."""


def _cells(size: int) -> str:
    return f"{size}²"


def _nodes(size: int) -> str:
    return f"{size} nodes"


def _bodies(size: int) -> str:
    return f"{size} bodies"


def _harmonics(size: int) -> str:
    return f"{size} odd harmonics"


def _contacts(size: int) -> str:
    return f"{size} contacts"


CONVOLUTIONS = "convolutions"
CHARTS: Mapping[str, CostChart] = {
    "contact": CostChart(
        "A sphere pressed, and sheared by three quarters of what friction carries",
        "cells along each side",
        (
            Line("normal", "pressed", (64, 128, 256, 512, 1024, 2048, 4096), CONVOLUTIONS, _cells),
            Line(
                "friction", "pressed and sheared", (64, 128, 256, 512, 1024), CONVOLUTIONS, _cells
            ),
            Line("unlike", "unlike bodies, sheared", (64, 128, 256, 512), CONVOLUTIONS, _cells),
        ),
    ),
    "structure": CostChart(
        "The dovetail: condensed, and two missions of 22 increments with friction",
        "nodes of both contact faces",
        (
            Line("condensation", "condensed", (10, 14, 20, 28, 39), "unknowns", _nodes),
            Line("missions", "friction", (10, 14, 20, 28, 39), "iterations", _nodes),
        ),
    ),
    "bodies": CostChart(
        "Blocks on each other, 256 nodes on each face: condensed, and a cycle with friction",
        "bodies",
        (Line("stack", "blocks on each other", (2, 3, 5, 8, 12), "unknowns", _bodies),),
    ),
    "harmonics": CostChart(
        "A response of the rig's 121 contacts by harmonic balance",
        "odd harmonics, beside the mean",
        (Line("harmonics", "121 contacts", (1, 2, 3, 5, 8, 15, 31), "points", _harmonics),),
    ),
    "contacts": CostChart(
        "A response of the rig by harmonic balance, mean and five odd harmonics",
        "contacts",
        (Line("contacts", "five odd harmonics", (4, 6, 8, 10, 14), "points", _contacts),),
    ),
}


# --- measuring ----------------------------------------------------------------------------------


def measure(name: str) -> None:
    """Measure all points of a chart; each is stored at once, so that an interruption loses none."""
    chart = CHARTS[name]
    with TemporaryDirectory() as cache, environment({"FRETSCALE_CACHE": cache}):
        rows: list[dict[str, Any]] = []
        for line in chart.lines:
            for size in line.sizes:
                rows.append({"work": line.work, **_point(line.work, size)})
                print(rows[-1])  # noqa: T201
                _write(name, rows)


def _point(work: str, size: int) -> dict[str, float]:
    """Measure one point in a separate process."""
    command = [sys.executable, str(ROOT / "docs" / "cost_works.py"), work, str(size)]
    if work in PREPARED:
        subprocess.run([*command, "--prepare"], check=True)
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    found: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return found


# --- stored points ------------------------------------------------------------------------------


def stored(name: str, folder: Path = FIGURES) -> dict[str, Points]:
    """Return the stored points of a chart, by their work."""
    with (folder / f"cost_{name}.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    chart, points = CHARTS[name], {}
    for line in chart.lines:
        own = [row for row in rows if row["work"] == line.name]
        points[line.work] = {
            measure: np.array([float(row[column]) for row in own])
            for measure, column in _columns(chart).items()
        }
    return points


def _columns(chart: CostChart) -> dict[str, str]:
    """Return the column of each measure in the table."""
    counted = " or ".join(dict.fromkeys(line.counted for line in chart.lines))
    return {
        "size": chart.size,
        "seconds": "processor [s]",
        "count": counted,
        "memory": "memory [GB]",
    }


def _write(name: str, rows: Sequence[Mapping[str, Any]]) -> None:
    chart = CHARTS[name]
    names = {line.work: line.name for line in chart.lines}
    with (FIGURES / f"cost_{name}.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["work", *_columns(chart).values()])
        for row in rows:
            numbers = (f"{row[key]:.3g}" for key in ("seconds", "memory"))
            seconds, memory = numbers
            writer.writerow([names[row["work"]], row["size"], seconds, row["count"], memory])


def slope(size: Array, cost: Array) -> float | None:
    """Return the exponent by which a cost grows with size, from the upper half of its points."""
    upper = max(FEWEST, ceil(len(size) / 2))
    if len(size) < upper or cost[-upper:].min() <= 0.0:
        return None
    return float(np.polyfit(np.log(size[-upper:]), np.log(cost[-upper:]), 1)[0])


# --- figures ------------------------------------------------------------------------------------


def cost_figure(name: str) -> Figure:
    """Draw each measure against size on logarithmic axes, with a line for each work."""
    chart, points = CHARTS[name], stored(name)
    figure = new_figure(chart.title, HEIGHT)
    panels = figure.subplots(1, len(MEASURES), sharex=True)
    for axis, measure in zip(panels, MEASURES, strict=True):
        for number, line in enumerate(chart.lines):
            size, cost = points[line.work]["size"], points[line.work][measure]
            seen = _seen(measure, cost)
            style = {"color": COLOURS[number], "marker": MARKERS[number]}
            axis.plot(size[seen], cost[seen], label=_label(line, points[line.work]), **style)
        axis.set(xlabel=chart.size, ylabel=_columns(chart)[measure], xscale="log", yscale="log")
        widen(axis, LEAST_SPAN)
        plain_ticks(axis.yaxis)
        sizes = max((own["size"] for own in points.values()), key=len)
        axis.set_xticks(spread(sizes, TICKS), labels=[f"{size:g}" for size in spread(sizes, TICKS)])
        axis.xaxis.set_minor_locator(NullLocator())
    legend_below(figure, panels, columns=1)
    return figure


def _seen(measure: str, cost: Array) -> Array:
    """Return a mask of the costs that are large enough to be shown."""
    return np.asarray(cost > (LEAST_MEMORY if measure == "memory" else 0.0))


def _label(line: Line, own: Points) -> str:
    """Return the label of a line: its name and the growth of its costs."""
    grows = []
    for measure, name in (("seconds", "time"), ("memory", "memory")):
        seen = _seen(measure, own[measure])
        power = slope(own["size"][seen], own[measure][seen])
        if power is not None:
            grows.append(f"{name} {power:.1f}")
    powers = f"; powers of size: {', '.join(grows)}" if grows else ""
    return f"{line.name} ({line.counted}){powers}"


# --- largest sizes ------------------------------------------------------------------------------


def limits() -> list[list[str]]:
    """Return a table of the largest size of each work for some times and for a machine's memory.

    Between measured sizes the cost is interpolated by powers. Up to two and a half times the
    largest size it is extrapolated by the slope of the upper half, marked by "about"; beyond that
    the entry is "over" the largest size.
    """
    rows = [["work", *(f"in {time}" for time in TIMES), f"in {MACHINE:g} GB", "largest measured"]]
    for name, chart in CHARTS.items():
        points = stored(name)
        for line in chart.lines:
            own = points[line.work]
            reached = [_reach(line, own, "seconds", most) for most in TIMES.values()]
            memory = _reach(line, own, "memory", MACHINE)
            last = f"{line.largest(int(own['size'][-1]))}: {own['seconds'][-1]:.3g} s"
            held = f", {own['memory'][-1]:.2g} GB"
            rows.append([f"{_of(name)}{line.name}", *reached, memory, last + held])
    return rows


def _of(name: str) -> str:
    if name in ("contact", "structure"):
        return f"{name}, "
    return "structure, " if name == "bodies" else f"vibration by {name}, "


def _reach(line: Line, own: Points, measure: str, most: float) -> str:
    """Return the size whose cost is ``most``."""
    seen = _seen(measure, own[measure])
    size, cost = own["size"][seen], own[measure][seen]
    power = slope(size, cost)
    if cost[-1] >= most:
        found = float(np.exp(np.interp(np.log(most), np.log(cost), np.log(size))))
        return line.largest(_rounded(found))
    further = inf if power is None else (most / cost[-1]) ** (1.0 / power)
    if further > FURTHER:
        return f"over {line.largest(int(size[-1]))}"
    return f"about {line.largest(_rounded(further * size[-1]))}"


def _rounded(size: float) -> int:
    """Round to two digits."""
    digits = max(0, len(str(int(size))) - 2)
    return int(round(size, -digits))


def main(arguments: list[str]) -> None:
    """Store the charts named, or all."""
    names = [name for name in arguments if name != "--draw"] or list(CHARTS)
    for name in names:
        if "--draw" not in arguments:
            measure(name)
        with TemporaryDirectory() as folder:
            (picture,) = write_figures([(f"cost_{name}", partial(cost_figure, name))], Path(folder))
            store(picture, FIGURES / picture.name)
    with (FIGURES / "cost_limits.csv").open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(limits())


if __name__ == "__main__":
    main(sys.argv[1:])
