"""``summary.json``: what every run says of itself around the numbers of its analysis."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import chain
from typing import Any

from workflow.shell.analysis import Run
from workflow.shell.measured import doubts_of_measured, lines_of_measured
from workflow.shell.quantities import Quantity
from workflow.shell.reporter import TERMINAL
from workflow.shell.versions import versions

# Stages whose seconds are told at the end; all of them are in the summary.
MOST_STAGES = 3


def finish(run: Run[Any], numbers: Mapping[str, Any], lines: Iterable[str]) -> None:
    """Write the summary of a run, which marks it as finished, and say how it ended.

    What it has found on the way is removed.

    ``numbers`` are what the analysis tells, ``lines`` the same in short.
    """
    reporter, measured = run.reporter, run.measured()
    for doubt in doubts_of_measured(measured):
        reporter.warn(doubt)
    seconds = {name: round(value, 2) for name, value in reporter.seconds.items()}
    summary = {
        "title": run.case.title,
        "assumed": list(run.case.assumed),
        **numbers,
        **({"measured": measured} if measured else {}),
        **({"choice": run.choice} if run.choice else {}),
        "warnings": reporter.warnings,
        "seconds": seconds,
        "versions": versions(),
    }
    run.report(summary)
    run.folder.finish(summary, run.provenance)
    run.folder.discard_state()
    with reporter.isolated(TERMINAL):
        for line in chain(lines, lines_of_measured(measured)):
            reporter.say(line)
    reporter.log(
        f"  seconds: {', '.join(f'{name} {value:.1f}' for name, value in seconds.items())}"
    )
    longest = sorted(seconds.items(), key=lambda item: -item[1])[:MOST_STAGES]
    most = ", ".join(f"{name} {value:.1f}" for name, value in longest)
    reporter.say(f"  took {reporter.spent:.1f} s, most of it: {most}")


class QuantityError(ValueError):
    """A dotted path that leads to no number of a summary; the message says where it ends."""


def required_number(summary: Mapping[str, Any], path: str) -> float:
    """The number that a dotted path leads to. Raises QuantityError."""
    node: Any = summary
    for key in path.split("."):
        try:
            node = node[int(key) if isinstance(node, list) else key]
        except (LookupError, TypeError, ValueError):
            raise QuantityError(f"no quantity {path} in summary.json ({key} is missing)") from None
    if isinstance(node, bool) or not isinstance(node, int | float):
        raise QuantityError(f"{path} is not a number")
    return float(node)


def counted_from_first(summary: Mapping[str, Any], path: str) -> str:
    """The path to the same number with the items of lists counted from the first: 4 for -1."""
    node: Any = summary
    keys = path.split(".")
    for place, key in enumerate(keys):
        try:
            number = int(key) if isinstance(node, list) else key
            node, whole = node[number], node
            if isinstance(whole, list) and int(key) < 0:
                keys[place] = str(len(whole) + int(key))
        except (LookupError, TypeError, ValueError):
            break
    return ".".join(keys)


def number_at(summary: Mapping[str, Any], path: str) -> float | None:
    """The number that a dotted path leads to; None where there is none."""
    try:
        return required_number(summary, path)
    except QuantityError:
        return None


def told(summary: Mapping[str, Any], quantities: Iterable[Quantity]) -> list[Quantity]:
    """Those of the quantities of which the summary has a number."""
    return [quantity for quantity in quantities if number_at(summary, quantity.path) is not None]


def estimate(summary: Mapping[str, Any], path: str, what: str) -> dict[str, Any]:
    """The relative error at a path and what it is of, as fields of a quantity."""
    error = number_at(summary, path)
    return {} if error is None else {"error": abs(error), "error_of": what}
