"""Table of the runs of a sweep: a row for each, with the numbers of its summary."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sa_solver.types import Array
from workflow.layout.declared import unit_in
from workflow.runs.job import Finished
from workflow.shell.output.tables import heading, write_table
from workflow.sweep.design import SweepRun
from workflow.sweep.schema import WrittenNumber, amount_of

DONE, FAILED = "done", "failed"
# Results of an interface in wear runs, with units.
WEAR_UNITS = {
    "depth": "mm",
    "depth_1": "mm",
    "depth_2": "mm",
    "volume": "mm^3",
    "volume_1": "mm^3",
    "volume_2": "mm^3",
    "energy": "N mm",
    "peak_pressure.unworn": "MPa",
    "peak_pressure.worn": "MPa",
}
# For other kinds of run every number is a column except these; of a path only the last state.
LEFT_OUT = ("seconds", "versions")
PATH = "states"


@dataclass(frozen=True)
class SweepRow:
    """One run: its values of the varied entries, how it ended, and its results."""

    run: SweepRun
    finished: Finished

    @property
    def done(self) -> bool:
        """True if the run has finished."""
        return self.finished.summary is not None

    @property
    def seconds(self) -> float | None:
        """Seconds of all stages of the run."""
        summary = self.finished.summary
        return None if summary is None else round(sum(summary["seconds"].values()), 2)

    def numbers(self) -> dict[str, float]:
        """Return the results by path in the summary."""
        summary = self.finished.summary
        if summary is None:
            return {}
        return _wear_numbers(summary) if "kinetics" in summary else dict(_numbers(summary))


def interfaces_of(summary: Mapping[str, Any]) -> list[str]:
    """Return the names of the contacts that wear; empty for other kinds of run."""
    return [name for name in summary.get("kinetics", {}) if name != "cycles"]


def _wear_numbers(summary: dict[str, Any]) -> dict[str, float]:
    """Return the final results of a wear run; depth and volume are sums over both bodies."""
    results: dict[str, float] = {"cycles": summary["cycles"], "jumps": summary["jumps"]}
    for name in interfaces_of(summary):
        interface = summary[name]
        numbers = {key: interface[key] for key in WEAR_UNITS if key in interface}
        numbers |= {
            key: interface[f"{key}_1"] + interface[f"{key}_2"] for key in ("depth", "volume")
        }
        numbers |= {f"peak_pressure.{when}": p for when, p in interface["peak_pressure"].items()}
        results |= {f"{name}.{key}": numbers[key] for key in WEAR_UNITS}
    return results | dict(_numbers(summary.get("work", {}), "work."))


def _numbers(node: Any, path: str = "") -> Iterator[tuple[str, float]]:
    """Yield all numbers below a node with their dotted paths."""
    if isinstance(node, dict):
        for key, value in node.items():
            if not path and key == PATH and value:
                yield from _numbers(value[-1], f"{PATH}.-1.")
            elif path or key not in LEFT_OUT:
                yield from _numbers(value, f"{path}{key}.")
    elif isinstance(node, list):
        for index, value in enumerate(node):
            yield from _numbers(value, f"{path}{index}.")
    elif isinstance(node, int | float) and not isinstance(node, bool):
        yield path.rstrip("."), node


# --- columns ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Varied:
    """Varied entry: its values as ``texts``, without the ``unit`` where all values share it.

    ``numbers`` ``(runs,)`` are in ``unit``, that of the first value; None where some value is not a
    number.
    """

    path: str
    unit: str
    texts: list[str]
    numbers: Array | None

    @property
    def heading(self) -> str:
        """Path and unit."""
        return heading(self.path, self.unit)


def varied_in(rows: Sequence[SweepRow]) -> list[Varied]:
    """Return the varied entries over the runs, as written."""
    return [_varied(path, [row.run.values[path] for row in rows]) for path in rows[0].run.values]


def _varied(path: str, values: list[Any]) -> Varied:
    amounts = [amount for value in values if (amount := amount_of(value)) is not None]
    if len(amounts) < len(values):
        return Varied(path, "", [_text(value) for value in values], None)
    unit = amounts[0].unit
    shared = all(amount.unit == unit for amount in amounts)
    texts = [_text(number) for number in ([a.number for a in amounts] if shared else values)]
    return Varied(path, unit, texts, np.array([amount.over(unit) for amount in amounts]))


def _text(value: object) -> str:
    """Return a value as the text of a cell."""
    if isinstance(value, tuple):
        return " ".join(map(_text, value))
    if isinstance(value, bool):
        return str(value).lower()
    return (
        str(WrittenNumber(float(value)).written) if isinstance(value, int | float) else str(value)
    )


def columns_of(rows: Sequence[SweepRow]) -> dict[str, Array]:
    """Return all results of the runs ``(runs,)``, by path; NaN where a run has none."""
    by_run = [row.numbers() for row in rows]
    names = dict.fromkeys(name for numbers in by_run for name in numbers)
    return {
        name: np.array([numbers.get(name, np.nan) for numbers in by_run], dtype=np.float64)
        for name in names
    }


def unit_of(name: str, rows: Sequence[SweepRow]) -> str:
    """Return the unit of a column of a wear run; "" for counts and ratios, and for other runs."""
    unit = WEAR_UNITS.get(name.partition(".")[2], "")
    if not unit:
        return ""
    summaries = [row.finished.summary for row in rows if row.finished.summary]
    per_length = {bool(summary["per_length"]) for summary in summaries if "per_length" in summary}
    return " or ".join(dict.fromkeys(unit_in(line, unit) for line in sorted(per_length)))


# --- the file -----------------------------------------------------------------------------------


def write_sweep_table(rows: Sequence[SweepRow], path: Path) -> None:
    """Write the table as CSV: name, varied values, how the run ended, and its results.

    Numbers are in base units, with all their digits; cells of a run that failed are empty.
    """
    columns: dict[str, Sequence[Any]] = {"name": [row.run.name for row in rows]}
    columns |= {_heading(varied): varied.texts for varied in varied_in(rows)}
    columns |= {
        "status": [DONE if row.done else FAILED for row in rows],
        "message": [row.finished.error for row in rows],
        "seconds": [row.seconds for row in rows],
    }
    for name, column in columns_of(rows).items():
        columns[heading(name, unit_of(name, rows))] = [_cell(number) for number in column.tolist()]
    write_table(path, columns)


def _heading(varied: Varied) -> str:
    """Return the path of an entry, with its unit unless the cells contain it."""
    cells_have_it = any(varied.unit and varied.unit in text for text in varied.texts)
    return varied.path if cells_have_it else varied.heading


def _cell(number: float) -> float | None:
    """Return the number, as an integer if possible; None if the run has no such number."""
    if np.isnan(number):
        return None
    return int(number) if number.is_integer() and abs(number) < 1e15 else number


def spread(values: Array) -> dict[str, float] | None:
    """Return the spread of values over the runs; None where no run has one."""
    known = values[np.isfinite(values)]
    if not known.size:
        return None
    names = "least", "quartile_1", "median", "quartile_3", "largest"
    quantiles = np.quantile(known, [0.0, 0.25, 0.5, 0.75, 1.0]).tolist()
    return {
        **dict(zip(names, quantiles, strict=True)),
        "mean": float(known.mean()),
        "deviation": float(known.std(ddof=1)) if known.size > 1 else 0.0,
    }
