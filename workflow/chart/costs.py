"""What a finished run has cost."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workflow.case.sections import Case
from workflow.shell.folder import OutputFolder
from workflow.shell.store import read_bytes

# Sections of a case that the structural stages do not look at.
NOT_STRUCTURAL = {
    "title",
    "contact",
    "wear",
    "coupling",
    "stress",
    "output",
    "assumed",
    "measured",
    "expect",
}
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
    seconds: dict[str, list[float]] = {}
    for line in log.splitlines():
        if match := STAGE.fullmatch(line):
            seconds.setdefault(match["name"], []).append(float(match["seconds"]))
    return seconds


def costs(
    cases: Sequence[Case], folders: Sequence[Path], summaries: Sequence[Mapping[str, Any]]
) -> list[Cost]:
    """Cost of each run, with what it took from the cache at the price of the run that computed it.

    That is the longest of all runs of the same structure.
    """
    stages = [
        stage_seconds(read_bytes(OutputFolder(folder).log).decode("utf-8", "replace"))
        for folder in folders
    ]
    cold: dict[tuple[str, str], float] = {}
    for case, logged in zip(cases, stages, strict=True):
        for stage, (key, seconds) in _cacheable_stages(case, logged).items():
            cold[stage, key] = max(cold.get((stage, key), 0.0), seconds)
    return [
        Cost(_seconds(case, logged, cold), *_work(summary))
        for case, logged, summary in zip(cases, stages, summaries, strict=True)
    ]


def _cacheable_stages(
    case: Case, stages: Mapping[str, Sequence[float]]
) -> dict[str, tuple[str, float]]:
    """Stages of a run that may be in the cache: by what, and their seconds here."""
    condensed = case.model_dump_json(exclude=NOT_STRUCTURAL | LOADED)
    cacheable = {name: (condensed, max(stages[name])) for name in CONDENSED if name in stages}
    if FRICTION in stages:
        # The first is the unworn cycle; those after it are of worn faces and never kept.
        cacheable[FRICTION] = case.model_dump_json(exclude=NOT_STRUCTURAL), stages[FRICTION][0]
    return cacheable


def _seconds(
    case: Case, stages: Mapping[str, Sequence[float]], cold: Mapping[tuple[str, str], float]
) -> float:
    seconds = {name: sum(durations) for name, durations in stages.items() if name != PICTURES}
    for stage, (key, warm) in _cacheable_stages(case, stages).items():
        seconds[stage] += cold[stage, key] - warm
    return sum(seconds.values())


def _work(summary: Mapping[str, Any]) -> tuple[int, int]:
    """Convolutions and contact solves of a run."""
    work = summary.get("work", {})
    convolutions = work.get("convolutions", summary.get("convolutions", 0))
    return int(convolutions), int(work.get("contact_solves", len(summary.get("states", ()))))
