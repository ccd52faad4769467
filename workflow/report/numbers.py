"""Tables of the main results; groups with the same quantities are shown side by side."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from workflow.case.text.readable import percent, readable
from workflow.case.text.typeset import MINUS, number, unparted
from workflow.report.page import Html, element, lines, note, table, unbroken
from workflow.shell.output.quantities import SummaryQuantity
from workflow.shell.output.summary import number_at, required_number

# Largest number of groups side by side, so that a table fits on a sheet of paper.
COLUMNS = 4
# Marks that distinguish several kinds of error.
LETTERS = "abcdefgh"
# Smallest share of their names that groups in one table must have in common.
ALIKE = 0.5

Groups = dict[str, dict[str, SummaryQuantity]]


def results(quantities: Sequence[SummaryQuantity], summary: Mapping[str, Any]) -> Html:
    """Return tables of the quantities, and a note on their errors; empty without quantities."""
    if not quantities:
        return Html("")
    marks = _marks(quantities)
    parts = []
    for family in _families(quantities):
        tables = -(-len(family) // COLUMNS)
        names = list(family)
        for first in range(tables):
            shown = {name: family[name] for name in _share(names, first, tables)}
            parts.append(_table(shown, summary, marks))
    return lines([*parts, _note(quantities, marks)])


def _share(names: Sequence[str], part: int, parts: int) -> Sequence[str]:
    """Return one of ``parts`` consecutive parts of nearly equal length."""
    return names[part * len(names) // parts : (part + 1) * len(names) // parts]


def _families(quantities: Iterable[SummaryQuantity]) -> list[Groups]:
    """Return quantities by group and name, with similar groups together."""
    groups: Groups = {}
    for quantity in quantities:
        groups.setdefault(quantity.group, {})[quantity.name] = quantity
    families: list[Groups] = []
    for group, named in groups.items():
        for family in families:
            first = next(iter(family.values()))
            if len(named.keys() & first.keys()) >= ALIKE * min(len(named), len(first)):
                family[group] = named
                break
        else:
            families.append({group: named})
    return families


def _table(groups: Groups, summary: Mapping[str, Any], marks: Mapping[str, str]) -> Html:
    names = dict.fromkeys(name for named in groups.values() for name in named)
    rows = (
        [name, *(_cell(named.get(name), summary, marks) for named in groups.values())]
        for name in names
    )
    return table(
        ["", *(unparted(number(group)) for group in groups)],
        rows,
        numbers=range(1, len(groups) + 1),
    )


def _cell(
    quantity: SummaryQuantity | None, summary: Mapping[str, Any], marks: Mapping[str, str]
) -> object:
    if quantity is None:
        return "–"
    mark = marks.get(quantity.error_of, "")
    return value_of(quantity, required_number(summary, quantity.path), mark)


def value_of(quantity: SummaryQuantity, value: float, mark: str = "") -> Html:
    """Return a value with its unit and estimated error, which may have a ``mark`` for a note."""
    text = number(str(readable(value, quantity.unit, quantity.error, quantity.everyday)))
    shown = unbroken(text)
    if quantity.where:
        shown = element("span", shown, " ", element("span", unbroken(quantity.where), cls="error"))
    if quantity.error is None or value == 0.0:
        return element("span", shown)
    error = unbroken(f"± {percent(quantity.error)}")
    noted = element("sup", mark) if mark else Html("")
    return element("span", shown, " ", element("span", error, noted, cls="error"))


def _marks(quantities: Sequence[SummaryQuantity]) -> dict[str, str]:
    """Return a letter for each kind of error, or nothing if there is only one kind."""
    sources = list(dict.fromkeys(q.error_of for q in quantities if q.error is not None))
    return dict(zip(sources, LETTERS, strict=False)) if len(sources) > 1 else {}


def _note(quantities: Sequence[SummaryQuantity], marks: Mapping[str, str]) -> Html:
    """Return a note on what the errors cover and whether some results have none."""
    known = [quantity for quantity in quantities if quantity.error is not None]
    if not known:
        return note("No errors of these results are estimated.")
    rest = (
        " The errors of the other results are not estimated."
        if len(known) < len(quantities)
        else ""
    )
    covers: object = known[0].error_of
    if marks:
        sources = (element("span", element("sup", mark), f" {of}") for of, mark in marks.items())
        covers = Html("; ".join(sources))
    return note("± is the estimated relative error. It covers ", covers, f".{rest}")


# --- error budget -------------------------------------------------------------------------------


def error_budget(quantities: Sequence[SummaryQuantity], summary: Mapping[str, Any]) -> Html:
    """Return a table of the parts of each error; empty if no error has parts."""
    budgets = {q.budget: q for q in quantities if q.budget}
    parts = {path: _parts(summary, path) for _, path in budgets}
    columns = [
        name for name in dict.fromkeys(n for p in parts.values() for n in p) if name != "total"
    ]
    rows: list[list[object]] = []
    group = None
    for (name, path), quantity in budgets.items():
        if quantity.group != group:
            group = quantity.group
            rows.append([group])
        rows.append([name, *(_part(parts[path], part) for part in (*columns, "total"))])
    if not rows:
        return Html("")
    explained = note(
        "Error of a result due to each part, relative to the result; below 0 where the result is "
        "known to be too small. “?” is unknown, “–” does not apply. The total is the "
        "root of the sum of three squares: the sum of the parts of known sign, half of their root "
        "sum of squares, and the sum of the sizes of the others."
    )
    numbers = range(1, len(columns) + 2)
    return lines([table(["", *columns, "total"], rows, numbers), explained])


def _parts(summary: Mapping[str, Any], path: str) -> Mapping[str, Any]:
    node: Any = summary
    for key in path.split("."):
        node = node[key]
    parts: Mapping[str, Any] = node
    return parts


def _part(parts: Mapping[str, Any], name: str) -> object:
    if name not in parts:
        return "–"
    value = number_at(parts, name)
    if value is None:
        return "?"
    return unbroken(f"{MINUS if value < 0.0 else ''}{percent(abs(value))}")
