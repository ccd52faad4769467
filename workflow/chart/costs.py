"""What a finished run has cost."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workflow.case.sections import Case
from workflow.shell.folder import OutputFolder

# Sections of a case that the structural stages do not look at.
NOT_STRUCTURAL = {"title", "contact", "wear", "coupling", "stress", "output", "assumed", "expect"}
# Stages whose results runs of the same structure find in the cache, whatever its friction and how
# its load path is divided; and the one whose first result they find where these are the same too.
CONDENSED = ("mesh", "condensation", "reduction")
LOADED = {"load_path", "friction"}
FRICTION = "structural friction"
# Nobody waits for pictures that are switched off.
PICTURES = "paraview and figures"
# A finished stage in ``run.log``.
STAGE = re.compile(r"\d\d:\d\d:\d\d (?P<name>[a-z][a-z ,-]*): (?P<seconds>\d+\.\d\d) s")


@dataclass(frozen=True)
class Cost:
    """Seconds that a user waits, convolutions, and contacts solved."""

    seconds: float
    convolutions: int
    solves: int


def stage_seconds(log: str) -> dict[str, list[float]]:
    """Seconds of each stage of a run, in turn, from the text of its ``run.log``.

    The log goes on where a run was resumed; the summary counts from there.
    """
    found: dict[str, list[float]] = {}
    for line in log.splitlines():
        if match := STAGE.fullmatch(line):
            found.setdefault(match["name"], []).append(float(match["seconds"]))
    return found


def costs(
    cases: Sequence[Case], folders: Sequence[Path], summaries: Sequence[Mapping[str, Any]]
) -> list[Cost]:
    """Cost of each run, with what it found in the cache at the price of the run that computed it.

    That is the longest of all runs of the same structure.
    """
    stages = [stage_seconds(OutputFolder(own).log.read_text(encoding="utf-8")) for own in folders]
    cold: dict[tuple[str, str], float] = {}
    for case, own in zip(cases, stages, strict=True):
        for stage, (key, seconds) in _found_by_others(case, own).items():
            cold[stage, key] = max(cold.get((stage, key), 0.0), seconds)
    return [
        Cost(_seconds(case, own, cold), *_work(summary))
        for case, own, summary in zip(cases, stages, summaries, strict=True)
    ]


def _found_by_others(
    case: Case, stages: Mapping[str, Sequence[float]]
) -> dict[str, tuple[str, float]]:
    """Stages of a run that may be found in the cache: by what, and their seconds here."""
    condensed = case.model_dump_json(exclude=NOT_STRUCTURAL | LOADED)
    found = {name: (condensed, max(stages[name])) for name in CONDENSED if name in stages}
    if FRICTION in stages:
        # The first is the unworn cycle; those after it are of worn faces and never kept.
        found[FRICTION] = case.model_dump_json(exclude=NOT_STRUCTURAL), stages[FRICTION][0]
    return found


def _seconds(
    case: Case, stages: Mapping[str, Sequence[float]], cold: Mapping[tuple[str, str], float]
) -> float:
    seconds = {name: sum(own) for name, own in stages.items() if name != PICTURES}
    for stage, (key, own) in _found_by_others(case, stages).items():
        seconds[stage] += cold[stage, key] - own
    return sum(seconds.values())


def _work(summary: Mapping[str, Any]) -> tuple[int, int]:
    """Convolutions and contact solves of a run."""
    work = summary.get("work", {})
    convolutions = work.get("convolutions", summary.get("convolutions", 0))
    return int(convolutions), int(work.get("contact_solves", len(summary.get("states", ()))))
