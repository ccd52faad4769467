"""Record that all benchmarks append to."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest

from sa_solver.transforms import passes as loops

RECORD = Path(__file__).with_name("record.csv")


@pytest.fixture(autouse=True)
def compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compile loops from the start, as the steady state is measured."""
    monkeypatch.setattr(loops, "PAYS", 0)


@pytest.fixture(scope="module")
def record() -> Iterator[dict[str, float]]:
    measures: dict[str, float] = {}
    yield measures
    new = not RECORD.exists()
    with RECORD.open("a", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        if new:
            writer.writerow(["date", "measure", "value"])
        date = datetime.now(UTC).date().isoformat()
        for name, value in measures.items():
            print(f"\n{name:<55} {value:10.4g}", end="")
            writer.writerow([date, name, f"{value:.4g}"])
