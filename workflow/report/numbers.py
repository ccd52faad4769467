"""Main results as tables: those of several groups side by side where they have the same names."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from workflow.case.readable import percent, readable
from workflow.report.page import Html, element, lines, note, table
from workflow.shell.quantities import Quantity
from workflow.shell.summary import number_at, required_number

# Groups side by side in a table at most, for it to be read on a sheet of paper.
COLUMNS = 4
# Share of their names that groups in one table have in common.
ALIKE = 0.5

Groups = dict[str, dict[str, Quantity]]


def results(quantities: Sequence[Quantity], summary: Mapping[str, Any]) -> Html:
    """Tables of all quantities, and what their errors are of."""
    parts = []
    for family in _families(quantities):
        names = list(family)
        for first in range(0, len(names), COLUMNS):
            shown = {name: family[name] for name in names[first : first + COLUMNS]}
            parts.append(_table(shown, summary))
    return lines([*parts, *_notes(quantities)])


def _families(quantities: Iterable[Quantity]) -> list[Groups]:
    """Quantities by group and name, groups with alike names together."""
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


def _table(groups: Groups, summary: Mapping[str, Any]) -> Html:
    names = dict.fromkeys(name for named in groups.values() for name in named)
    rows = (
        [name, *(_cell(named.get(name), summary) for named in groups.values())] for name in names
    )
    return table(["", *groups], rows, numbers=range(1, len(groups) + 1))


def _cell(quantity: Quantity | None, summary: Mapping[str, Any]) -> object:
    if quantity is None:
        return "–"
    return value_of(quantity, required_number(summary, quantity.path))


def value_of(quantity: Quantity, value: float) -> Html:
    """A value with its unit and its estimated error."""
    shown = readable(value, quantity.unit, quantity.error, quantity.everyday)
    if quantity.error is None:
        return element("span", str(shown))
    return element(
        "span", f"{shown} ", element("span", f"± {percent(quantity.error)}", cls="error")
    )


def _notes(quantities: Sequence[Quantity]) -> list[Html]:
    """What the errors are of, and what has none."""
    known = [quantity for quantity in quantities if quantity.error is not None]
    if not known:
        return [note("None of these results has an estimated error.")]
    sources = dict.fromkeys(quantity.error_of for quantity in known)
    covers = "; ".join(
        f"{_named(known, source)}: {source}" if len(sources) > 1 else source for source in sources
    )
    text = f"± is the estimated relative error, of {covers}."
    rest = " Results without it have none that is known." if len(known) < len(quantities) else ""
    return [note(text + rest)]


def _named(quantities: Sequence[Quantity], source: str) -> str:
    """The names of those whose error is of a source, the first ones."""
    names = list(dict.fromkeys(q.name for q in quantities if q.error_of == source))
    return ", ".join(names[:3]) + (", …" if len(names) > 3 else "")


# --- error budget -------------------------------------------------------------------------------


def error_budget(quantities: Sequence[Quantity], summary: Mapping[str, Any]) -> Html:
    """Parts of every error that has parts; empty where none has."""
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
        "What each part leaves of a result, relative to it, below 0 where it is known to be told "
        "too small; “?” is not known, “–” does not apply. The total adds parts of known sign, half "
        "of each besides, and the others by their sizes."
    )
    numbers = range(1, len(columns) + 2)
    return lines([table(["", *columns, "total"], rows, numbers), explained])


def _parts(summary: Mapping[str, Any], path: str) -> Mapping[str, Any]:
    node: Any = summary
    for key in path.split("."):
        node = node[key]
    parts: Mapping[str, Any] = node
    return parts


def _part(parts: Mapping[str, Any], name: str) -> str:
    if name not in parts:
        return "–"
    value = number_at(parts, name)
    if value is None:
        return "?"
    return f"{'−' if value < 0.0 else ''}{percent(abs(value))}"
