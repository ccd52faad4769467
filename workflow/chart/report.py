"""Output of a chart: tables, ``summary.json``, figures, and recommended settings."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from typing import Any

from rich.box import SIMPLE
from rich.table import Column, Table

from workflow.chart.frontier import Combination, cheapest
from workflow.chart.ladder import Ladder, Point
from workflow.chart.run import KIND, Chart
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.folders.versions import versions
from workflow.shell.output.summary import finite
from workflow.shell.output.tables import write_table
from workflow.shell.terminal.screen import tables_console

# Width in columns of tables that go to a file.
FILE_WIDTH = 120


def write_chart(chart: Chart, out: Path) -> dict[str, Path]:
    """Write ``chart.csv``, ``figures`` and, last, ``summary.json``; return the main paths."""
    from workflow.chart.figures import write_chart_figures

    folder = OutputFolder(out, KIND)
    table = folder.reserve("chart.csv", "errors and costs of every rung")
    _write_table(chart, table)
    with folder.filling("figures", "errors against costs") as figures:
        drawn = write_chart_figures(chart, figures)
    folder.write_summary(_summary(chart))
    # The last figure shows all axes.
    return {"figure": drawn[-1], "table": table} if drawn else {"table": table}


# --- recommended settings -----------------------------------------------------------------------


def sentences(chart: Chart) -> list[str]:
    """Return what to choose for the required accuracy, on each axis and on all together."""
    lines = [_choice(ladder, chart.accuracy) for ladder in chart.ladders]
    return [*lines, _together(chart)] if len(chart.ladders) > 1 else lines


def _choice(ladder: Ladder, accuracy: float) -> str:
    wanted, name = percent(accuracy), ladder.axis.name
    chosen = ladder.cheapest(accuracy)
    if chosen is not None:
        return (
            f"{name}: for {wanted} take {chosen.name}: {_costs(chosen)}, {_error(ladder, chosen)}"
        )
    best = min(ladder.rungs, key=lambda rung: rung.bound, default=None)
    if best is None:
        return f"{name}: nothing ran"
    return (
        f"{name}: for {wanted} no rung is known to be sufficient: the best, {best.name}, is "
        f"within {percent(best.bound)} ({_costs(best)})"
    )


def _costs(rung: Point) -> str:
    cost = rung.cost
    return f"{cost.seconds:.3g} s, {cost.convolutions} convolutions"


def _error(ladder: Ladder, rung: Point) -> str:
    """Return the error of a rung in words, with its uncertainty."""
    if rung.error == 0.0:
        known = f"known to {percent(ladder.floor)}" if ladder.floor else "by definition"
        return f"the reference, {known}"
    text = f"error {percent(rung.error)} ({rung.worst})"
    if rung.unresolved:
        return f"{text}, below the {percent(ladder.floor)} to which the reference is known"
    return text


def combination(chart: Chart) -> Combination | None:
    """Return the cheapest rung on every axis whose errors add up to at most the accuracy."""
    options = {ladder.axis.name: ladder.options() for ladder in chart.ladders}
    return cheapest(options, chart.accuracy)


def _together(chart: Chart) -> str:
    best = combination(chart)
    if best is None:
        return (
            f"all axes: for {percent(chart.accuracy)} no choice of rungs is known to be "
            "sufficient, because their errors, each axis varied alone, add up to more"
        )
    choice = ", ".join(f"{axis} {rung}" for axis, rung in best.rungs.items())
    return (
        f"all axes: for {percent(chart.accuracy)} take {choice}: errors, each axis varied alone, "
        f"add up to at most {percent(best.error)}, and a run takes about {best.seconds_ratio:.2g} "
        "times the seconds of the case as written"
    )


def percent(share: float) -> str:
    """Return a share in per cent with two digits, as text."""
    return f"{100 * share:.2g} %" if isfinite(share) else "an unknown error"


# --- tables -------------------------------------------------------------------------------------


def show(chart: Chart) -> None:
    """Print tables and sentences on the terminal."""
    console = tables_console(FILE_WIDTH)
    for ladder in chart.ladders:
        console.print(_table(ladder))
        for name, error in ladder.failed.items():
            console.print(f"{ladder.axis.name}: {name} failed: {error}", soft_wrap=True)
    for line in sentences(chart):
        console.print(line, soft_wrap=True)


def _table(ladder: Ladder) -> Table:
    columns = [Column(name, justify="right") for name in ("error", "s", "convolutions", "solves")]
    title = f"{ladder.axis.name}: {ladder.axis.what}{_reference(ladder)}"
    table = Table(Column("", no_wrap=True), *columns, "worst", "", title=title, box=SIMPLE)
    for rung in ladder.rungs:
        cost, marks = rung.cost, _marks(rung)
        error = "reference" if rung.error == 0.0 else percent(rung.error)
        numbers = f"{cost.seconds:.2f}", str(cost.convolutions), str(cost.solves)
        table.add_row(rung.name, error, *numbers, rung.worst, ", ".join(marks))
    return table


def _reference(ladder: Ladder) -> str:
    """Return how accurately the references are known, for a title."""
    if ladder.references and not isfinite(ladder.floor):
        return " (no reference to compare the rungs with)"
    if ladder.axis.order is None or not ladder.references:
        return ""
    known = ladder.references.values()
    orders = [reference.order for reference in known if reference.order is not None]
    observed = f", orders {min(orders):.1f} to {max(orders):.1f}" if orders else ""
    return f" (references known to {percent(ladder.floor)}{observed})"


def _marks(rung: Point) -> list[str]:
    marks = {
        "as written": rung.baseline,
        "efficient": rung.by_seconds,
        "unresolved": rung.unresolved and rung.error > 0.0,
    }
    return [name for name, on in marks.items() if on]


def _write_table(chart: Chart, path: Path) -> None:
    """Write one row for each rung; a quantity that its axis does not have is empty."""
    cells = [_cells(ladder, rung) for ladder in chart.ladders for rung in ladder.rungs]
    names = dict.fromkeys(name for part in zip(*cells, strict=True) for row in part for name in row)
    rows = [head | values | tail for head, values, tail in cells]
    write_table(path, {name: [row.get(name) for row in rows] for name in names})


def _cells(ladder: Ladder, rung: Point) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """Return the cells of a rung: its settings, its quantities, and its errors and costs."""
    cost = rung.cost
    head = {
        "axis": ladder.axis.name,
        "branch": rung.setting.branch,
        "rung": rung.name,
        "settings": " ".join(rung.setting.overrides),
        "own": rung.baseline,
        "folder": rung.folder,
    }
    tail = {
        "error": rung.error,
        "worst": rung.worst,
        "bound": rung.bound,
        "floor": ladder.floor,
        "unresolved": rung.unresolved,
        "seconds": round(cost.seconds, 2),
        "convolutions": cost.convolutions,
        "solves": cost.solves,
        "efficient_by_seconds": rung.by_seconds,
        "efficient_by_convolutions": rung.by_convolutions,
    }
    return head, {**rung.values, **rung.extras}, tail


# --- summary ------------------------------------------------------------------------------------


def _summary(chart: Chart) -> dict[str, Any]:
    best = combination(chart)
    return {
        "title": chart.title,
        "accuracy": chart.accuracy,
        "axes": {ladder.axis.name: _axis_summary(ladder, chart) for ladder in chart.ladders},
        "together": None if best is None else vars(best),
        "sentences": sentences(chart),
        "versions": versions(),
    }


def _axis_summary(ladder: Ladder, chart: Chart) -> dict[str, Any]:
    chosen = ladder.cheapest(chart.accuracy)
    return {
        "converges": ladder.axis.order is not None,
        "floor": finite(ladder.floor),
        "references": {
            quantity: {**vars(reference), "floor": finite(reference.floor)}
            for quantity, reference in ladder.references.items()
        },
        "rungs": [_rung_summary(rung) for rung in ladder.rungs],
        "failed": dict(ladder.failed),
        "chosen": None if chosen is None else chosen.name,
    }


def _rung_summary(rung: Point) -> dict[str, Any]:
    return {
        "name": rung.name,
        "branch": rung.setting.branch,
        "settings": list(rung.setting.overrides),
        "own": rung.baseline,
        "folder": f"runs/{rung.folder}",
        "values": dict(rung.values),
        "extras": dict(rung.extras),
        "error": finite(rung.error),
        "worst": rung.worst,
        "bound": finite(rung.bound),
        "unresolved": rung.unresolved,
        "efficient": {"seconds": rung.by_seconds, "convolutions": rung.by_convolutions},
        "cost": vars(rung.cost),
    }
