"""Display of a comparison: text on the terminal, a table, and an HTML page."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from io import StringIO
from itertools import groupby
from typing import Any

from rich.box import SIMPLE
from rich.console import Console
from rich.table import Column, Table

from workflow.case.text.readable import percent, readable
from workflow.case.text.typeset import given
from workflow.case.text.typeset import number as printed
from workflow.comparing.compared import NOTHING, ComparedQuantity, ComparedRuns
from workflow.report.numbers import value_of
from workflow.report.page import (
    Html,
    code,
    contents_of,
    element,
    note,
    page,
    picture,
    section,
    table,
)
from workflow.shell.terminal.screen import tables_console

# Mark of a difference that exceeds both estimated errors.
BEYOND = "!"
MEANING = (
    f"{BEYOND} marks differences from the first run that exceed the estimated errors of both "
    "together; where an error is unknown, nothing is marked."
)
# Ratios beyond LARGE are shown as a factor of two digits, not in per cent.
LARGE, FACTOR_DIGITS = 5.0, 1.0
# Width in columns of text that goes to a file.
FILE_WIDTH = 140


def show(comparison: ComparedRuns) -> None:
    """Print the differences of the cases and all quantities on the terminal."""
    _print(comparison, tables_console(FILE_WIDTH))


def text_of(comparison: ComparedRuns) -> str:
    """Return the comparison as text."""
    console = Console(file=StringIO(), width=FILE_WIDTH, highlight=False, markup=False)
    with console.capture() as printed:
        _print(comparison, console)
    return "\n".join(line.rstrip() for line in printed.get().splitlines())


def _print(comparison: ComparedRuns, console: Console) -> None:
    if comparison.entries:
        entries = Table(Column("case"), *comparison.names, box=SIMPLE)
        for path, texts in comparison.entries.items():
            entries.add_row(path, *texts)
        console.print(entries)
    else:
        console.print("The cases are the same.")
    columns = (Column(name, justify="right") for name in comparison.names)
    numbers = Table(Column(""), *columns, box=SIMPLE)
    for group, rows in groupby(comparison.rows, lambda row: row.first.group):
        numbers.add_section()
        numbers.add_row(group)
        for row in rows:
            cells = (_text(row, number) for number in range(len(comparison.runs)))
            numbers.add_row(f"  {row.first.name}", *cells)
    console.print(numbers)
    console.print(MEANING)


def _text(row: ComparedQuantity, number: int) -> str:
    """Return a value, and its difference from that of the first run."""
    quantity, value = row.quantities[number], row.values[number]
    if quantity is None or value is None:
        return NOTHING
    shown = str(readable(value, quantity.unit, quantity.error, row.everyday))
    return " ".join([shown, *_apart(row, number)])


def _apart(row: ComparedQuantity, number: int) -> Iterator[str]:
    difference = row.difference(number)
    if difference is not None:
        yield f"({_signed(difference)})"
    if row.beyond(number):
        yield BEYOND


def _signed(difference: float) -> str:
    """Return a relative difference in per cent, a large one as a factor."""
    if not math.isfinite(difference):
        return "from 0"
    factor = 1.0 + difference
    if factor >= LARGE or 0.0 < factor <= 1.0 / LARGE:
        return f"× {readable(factor, '1', FACTOR_DIGITS)}"
    size = percent(abs(difference))
    return size if size.startswith(("0 ", "<")) else f"{'−' if difference < 0.0 else '+'}{size}"


# --- table --------------------------------------------------------------------------------------


def columns_of(comparison: ComparedRuns) -> dict[str, list[Any]]:
    """Return all quantities in base units; estimated errors and differences are relative."""
    rows, names = comparison.rows, comparison.names
    columns: dict[str, list[Any]] = {
        "of": [row.first.group for row in rows],
        "quantity": [row.first.name for row in rows],
        "path": [row.first.path for row in rows],
        "unit": [row.first.unit for row in rows],
    }
    for number, name in enumerate(names):
        columns[name] = [row.values[number] for row in rows]
        columns[f"{name}, estimated error"] = [row.errors[number] for row in rows]
        if number:
            columns[f"{name}, difference"] = [row.difference(number) for row in rows]
            columns[f"{name}, exceeds errors"] = [row.beyond(number) for row in rows]
    return columns


# --- page ---------------------------------------------------------------------------------------


def comparison_page(comparison: ComparedRuns, figures: dict[str, str]) -> str:
    """Return the whole page; ``figures`` are SVG texts by their titles."""
    names = comparison.names
    pictures = [picture(svg, title) for title, svg in figures.items()]
    parts = [
        section("The runs", _runs(comparison)),
        section("Differences of their cases", _entries(comparison)),
        section("Results", _results(comparison), note(MEANING)),
        section("Curves", element("div", *pictures, cls="small") if pictures else ""),
    ]
    title = " and ".join(names) if len(names) == 2 else f"{len(names)} runs side by side"
    lead = f"{len(names)} runs compared; the reference "
    header = element(
        "header",
        element("h1", title),
        element("p", f"{lead}is {names[0]}.", cls="lead"),
    )
    return page(title, header, contents_of(parts), *parts)


def _runs(comparison: ComparedRuns) -> Html:
    rows = []
    for run in comparison.runs:
        warnings = len(run.run.summary["warnings"])
        version = run.run.summary["versions"]["fretscale"]
        seconds = sum(run.run.summary["seconds"].values())
        rows.append([run.name, run.run.case.title, version, str(warnings), f"{seconds:.0f} s"])
    head = ["run", "title", "fretscale", "warnings", "time"]
    return table(head, rows, numbers=(3, 4), stacks=True)


def _entries(comparison: ComparedRuns) -> Html:
    if not comparison.entries:
        return element("p", "Nothing that affects results.")
    rows = [[code(path), *map(given, texts)] for path, texts in comparison.entries.items()]
    return table(["", *comparison.names], rows)


def _results(comparison: ComparedRuns) -> Html:
    runs = range(len(comparison.runs))
    rows: list[list[object]] = []
    for group, those in groupby(comparison.rows, lambda row: row.first.group):
        rows.append([printed(group)])
        rows += [[row.first.name, *(_cell(row, number) for number in runs)] for row in those]
    return table(["", *comparison.names], rows, numbers=range(1, len(comparison.runs) + 1))


def _cell(row: ComparedQuantity, number: int) -> object:
    quantity, value = row.quantities[number], row.values[number]
    if quantity is None or value is None:
        return NOTHING
    alike = row.difference(number) == 0.0
    apart = "" if alike else " ".join(_apart(row, number))
    look = "bad" if row.beyond(number) else "error"
    reported = element("div", element("span", apart, cls=look)) if apart else Html("")
    return element("div", value_of(replace(quantity, everyday=row.everyday), value), reported)
