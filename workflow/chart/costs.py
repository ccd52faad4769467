"""Costs of finished runs: seconds, convolutions and contact solves."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

from workflow.case.sections import ASIDE, Case
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.folders.store import read_bytes

# Sections of a case that do not affect the structural stages.
NOT_STRUCTURAL = {*ASIDE, "contact", "wear", "coupling", "stress"}
# Stages whose results are cached for all runs of the same structure, whatever its friction and the
# increments of its load path. The first result of FRICTION is cached for equal friction and path.
CONDENSED = ("mesh", "condensation", "reduction")
LOADED = {"load_path", "friction"}
FRICTION = "structural friction"
# Stage that is not counted, because charts switch figures off.
PICTURES = "paraview and figures"
# A finished stage in ``run.log``.
STAGE = re.compile(r"\d\d:\d\d:\d\d (?P<name>[a-z][a-z ,-]*): (?P<seconds>\d+\.\d\d) s")


@dataclass(frozen=True)
class RunCost:
    """Cost of a run: waiting time in seconds, number of convolutions, and of contact solves."""

    seconds: float
    convolutions: int
    solves: int


def stage_seconds(log: str) -> dict[str, list[float]]:
    """Return the seconds of each stage of a run, in order, from the text of its ``run.log``.

    A resumed run continues its log, but its summary counts from the resumption only.
    """
    seconds: dict[str, list[float]] = {}
    for line in log.splitlines():
        if match := STAGE.fullmatch(line):
            seconds.setdefault(match["name"], []).append(float(match["seconds"]))
    return seconds


def costs(
    cases: Sequence[Case], folders: Sequence[Path], summaries: Sequence[Mapping[str, Any]]
) -> list[RunCost]:
    """Return the cost of each run, as if nothing came from the cache.

    A cached stage costs as much as the longest such stage among all runs of the same structure.
    """
    stages = [
        stage_seconds(read_bytes(OutputFolder(folder).log).decode("utf-8", "replace"))
        for folder in folders
    ]
    cacheable = [_cacheable_stages(*run) for run in zip(cases, stages, strict=True)]
    cold: dict[tuple[str, str], float] = {}
    for stage, (key, warm) in chain.from_iterable(of_run.items() for of_run in cacheable):
        cold[stage, key] = max(cold.get((stage, key), 0.0), warm)
    paid = []
    for logged, of_run, summary in zip(stages, cacheable, summaries, strict=True):
        seconds = {name: sum(durations) for name, durations in logged.items() if name != PICTURES}
        for stage, (key, warm) in of_run.items():
            seconds[stage] += cold[stage, key] - warm
        paid.append(RunCost(sum(seconds.values()), *_work(summary)))
    return paid


def _cacheable_stages(
    case: Case, stages: Mapping[str, Sequence[float]]
) -> dict[str, tuple[str, float]]:
    """Return the stages of a run that may be cached, each with its cache key and seconds."""
    condensed = case.model_dump_json(exclude=NOT_STRUCTURAL | LOADED)
    cacheable = {name: (condensed, max(stages[name])) for name in CONDENSED if name in stages}
    if FRICTION in stages:
        # The first solve is of the unworn cycle; later ones are of worn faces and never cached.
        cacheable[FRICTION] = case.model_dump_json(exclude=NOT_STRUCTURAL), stages[FRICTION][0]
    return cacheable


def _work(summary: Mapping[str, Any]) -> tuple[int, int]:
    """Return the convolutions and contact solves of a run."""
    work = summary.get("work", {})
    convolutions = work.get("convolutions", summary.get("convolutions", 0))
    return int(convolutions), int(work.get("contact_solves", len(summary.get("states", ()))))
