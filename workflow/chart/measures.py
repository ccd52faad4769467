"""What a finished run is measured by: numbers of its summary and fields, and what they cost."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from sa_solver.types import Array, Grid
from workflow.case import Case, VibrationCase, WearCase
from workflow.folder import OutputFolder
from workflow.store import grid_of

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

WORN = ("depth_1", "depth_2", "volume_1", "volume_2")
# What contact cases are compared by where they expect nothing.
CONTACT = (
    *("states.-1.approach", "states.-1.central_pressure", "states.-1.shift_x"),
    *("states.-1.stick_radius", "states.-1.stick_half_width", "loop.energy"),
)
# What the motions under every force are compared by: a resonance's frequency says little, where the
# amplitude hardly changes with it.
MOTIONS = "amplitude", "energy_per_cycle", "loops.-1.energy"
# Quantities of a computed increment counted from the first, which is another one with other steps.
FROM_THE_FIRST = re.compile(r"states\.\d")
MIDDLE = "middle"
# Rows on either side of the middle of a face whose mean is its middle section.
MIDDLE_ROWS = 1


@dataclass(frozen=True)
class Cost:
    """Seconds that a user waits, convolutions, and contacts solved."""

    seconds: float
    convolutions: int
    solves: int


# --- numbers ------------------------------------------------------------------------------------


def number_at(summary: Mapping[str, Any], path: str) -> float | None:
    """The number that a dotted path leads to; None where there is none."""
    node: Any = summary
    for key in path.split("."):
        if isinstance(node, list) and key.lstrip("-").isdecimal():
            place = int(key)
            node = node[place] if -len(node) <= place < len(node) else None
        else:
            node = node.get(key) if isinstance(node, Mapping) else None
    return None if isinstance(node, bool) or not isinstance(node, int | float) else float(node)


def default_quantities(case: Case, summary: Mapping[str, Any]) -> list[str]:
    """What a case is compared by: depth and volume of wear, motions, else what it expects to find.

    Quantities that are 0 are left out: nothing is relative to them.
    """
    if isinstance(case, WearCase):
        paths = [f"{name}.{worn}" for name, worn in product(interfaces(summary), WORN)]
    elif isinstance(case, VibrationCase):
        count = len(case.forces)
        paths = [f"responses.{n}.{moved}" for n, moved in product(range(count), MOTIONS)]
    else:
        paths = [own.quantity for own in case.expect if own.value] or list(CONTACT)
    return [path for path in paths if number_at(summary, path)]


def interfaces(summary: Mapping[str, Any]) -> list[str]:
    """Names of the contacts of a wear run."""
    return [name for name, own in summary.items() if isinstance(own, Mapping) and "depth_1" in own]


def extra_quantities(summary: Mapping[str, Any]) -> list[str]:
    """Numbers of a wear run that are told beside the quantities."""
    return [f"{name}.peak_pressure.worn" for name in interfaces(summary)]


# --- fields -------------------------------------------------------------------------------------


def worn_depths(folder: Path, names: Iterable[str]) -> dict[str, tuple[Grid, Array, Array]]:
    """Grid of each interface and worn depths ``(nx, ny)`` of body 1 and body 2 [mm]."""
    found = {}
    with h5py.File(OutputFolder(folder).results) as file:
        for name in names:
            jumps = file["surfaces"][name]
            first, last = (jumps[jump] for jump in (min(jumps), max(jumps)))
            depths = [abs(last[body][()] - first[body][()]) for body in ("body_1", "body_2")]
            found[name] = grid_of(file["grid"][name]), depths[0], depths[1]
    return found


def middle_sections(folder: Path, names: Iterable[str]) -> dict[str, dict[str, float]]:
    """Largest depth [mm] and worn area [mm²] of each body in the middle of each face.

    A line contact is its own middle section: two and three dimensions can be compared by it.
    """
    sections = {}
    for name, (grid, *depths) in worn_depths(folder, names).items():
        half = grid.shape[1] // 2
        rows = slice(max(0, half - MIDDLE_ROWS), half + MIDDLE_ROWS)
        profiles = [np.mean(depth[:, rows] if half else depth, axis=1) for depth in depths]
        sections[name] = {
            **{f"depth_{k}": float(own.max()) for k, own in enumerate(profiles, 1)},
            **{f"area_{k}": float(own.sum()) * grid.pitch[0] for k, own in enumerate(profiles, 1)},
        }
    return sections


def middle_quantities(summary: Mapping[str, Any]) -> list[str]:
    """Paths of the numbers of :func:`middle_sections` in a summary that has them."""
    sections: Mapping[str, Mapping[str, float]] = summary.get(MIDDLE, {})
    return [f"{MIDDLE}.{name}.{key}" for name, own in sections.items() for key in own if own[key]]


def profile_difference(
    own: Mapping[str, tuple[Grid, Array, Array]], other: Mapping[str, tuple[Grid, Array, Array]]
) -> float | None:
    """Largest difference of depth anywhere, over the largest depth of ``other``; both bodies.

    None where the grids are not of one dimension.
    """
    largest = 0.0
    for name, (grid, *depths) in own.items():
        reference, *finer = other[name]
        if grid.line != reference.line:
            return None
        there = _resampled(sum(finer), reference, grid)
        scale = float(np.max(sum(finer)))
        if scale > 0.0:
            largest = max(largest, float(np.max(np.abs(sum(depths) - there))) / scale)
    return largest


def _resampled(field: Any, grid: Grid, onto: Grid) -> Array:
    """A field of one grid at the cells of another over the same face."""
    from scipy.interpolate import RegularGridInterpolator

    if grid.line:
        values: Array = np.interp(onto.x.ravel(), grid.x.ravel(), field.ravel())[:, None]
        return values
    axes = grid.x.ravel(), grid.y.ravel()
    inside = [np.clip(c.ravel(), a[0], a[-1]) for c, a in zip((onto.x, onto.y), axes, strict=True)]
    points = np.meshgrid(*inside, indexing="ij")
    resampled: Array = RegularGridInterpolator(axes, field)(tuple(points))
    return resampled


# --- costs --------------------------------------------------------------------------------------


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
