"""Contents of ``summary.json`` that all runs share, in addition to the numbers of the analysis."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from itertools import chain
from typing import Any

from workflow.shell.analysis import Run
from workflow.shell.folders.versions import versions
from workflow.shell.output.measured import comparison_warnings, lines_of_measured
from workflow.shell.output.quantities import SummaryQuantity

# Number of stages whose seconds are shown at the end; the summary has all of them.
MOST_STAGES = 3


def finish(run: Run[Any], numbers: Mapping[str, Any], lines: Iterable[str]) -> None:
    """Write the summary of a run, which marks it as finished, and report how it ended.

    The intermediate files are removed. ``numbers`` are the results of the analysis, ``lines`` the
    same in short.
    """
    from workflow.shell.terminal.reporter import TERMINAL

    reporter, measured = run.reporter, run.measured()
    reporter.warn_each(comparison_warnings(measured))
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
    reporter.say(f"  took {reporter.elapsed:.1f} s, most of it: {most}")


def finite(value: float) -> float | None:
    """Return a finite value, or None, because JSON has no infinity."""
    return value if math.isfinite(value) else None


class QuantityError(ValueError):
    """Error for a path that leads to no number of a summary; the message says where it ends."""


def required_number(summary: Mapping[str, Any], path: str) -> float:
    """Return the number at a dotted path. Raises QuantityError."""
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
    """Return the path with negative list positions counted from the first: 4 for -1, say."""
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
    """Return the number at a dotted path, or None if there is none."""
    try:
        return required_number(summary, path)
    except QuantityError:
        return None


def reported(
    summary: Mapping[str, Any], quantities: Iterable[SummaryQuantity]
) -> list[SummaryQuantity]:
    """Return the quantities for which the summary has a number."""
    return [quantity for quantity in quantities if number_at(summary, quantity.path) is not None]


def estimate(summary: Mapping[str, Any], path: str, what: str) -> dict[str, Any]:
    """Return the relative error at a path, and what it covers, as fields of a quantity."""
    error = number_at(summary, path)
    return {} if error is None else {"error": abs(error), "error_of": what}
