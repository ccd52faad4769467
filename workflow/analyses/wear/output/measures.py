"""Quantities for comparing wear runs in a chart: depths and volumes, sections and profiles."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from sa_solver.types import Array, Grid
from workflow.analyses.wear.case.base import WearCase
from workflow.shell.analysis import ChartComparison, Summary

WORN = ("depth_1", "depth_2", "volume_1", "volume_2")
MIDDLE = "middle"
# Rows on either side of the middle of a face that are averaged for its middle section.
MIDDLE_ROWS = 1
# Name of the largest difference of the worn depth over the face.
PROFILE = "depth anywhere"
# Overrides, by entry of the summary, that skip what only quantities below the entry need.
PLAIN = {
    "stress": ("stress.section=none", "stress.life.parameter=none"),
    "error": ("error_budget=known",),
}


def quantities(case: WearCase, summary: Summary) -> list[str]:
    """Return the paths of depth and volume of every body of every interface."""
    return [f"{name}.{worn}" for name, worn in product(interfaces(summary), WORN)]


def interfaces(summary: Mapping[str, Any]) -> list[str]:
    """Return the names of the contacts of a wear run."""
    return [
        name for name, part in summary.items() if isinstance(part, Mapping) and "depth_1" in part
    ]


def extra_quantities(summary: Mapping[str, Any]) -> list[str]:
    """Return the paths of numbers that are reported in addition to the quantities."""
    return [f"{name}.peak_pressure.worn" for name in interfaces(summary)]


# --- fields -------------------------------------------------------------------------------------


WornDepths = Mapping[str, tuple[Grid, Array, Array]]


def worn_depths(folder: Path, names: Iterable[str]) -> WornDepths:
    """Return the grid of each interface and worn depths ``(nx, ny)`` of both bodies [mm]."""
    # Imported here, because files are read only when runs are compared.
    import h5py

    from workflow.shell.folders.folder import OutputFolder
    from workflow.shell.output.results import grid_of

    depths = {}
    with h5py.File(OutputFolder(folder).results) as file:
        for name in names:
            jumps = file["surfaces"][name]
            first, last = (jumps[jump] for jump in (min(jumps), max(jumps)))
            body_1, body_2 = (abs(last[b][()] - first[b][()]) for b in ("body_1", "body_2"))
            depths[name] = grid_of(file["grid"][name]), body_1, body_2
    return depths


def middle_profiles(folder: Path, names: Iterable[str]) -> dict[str, tuple[Array, Array, Array]]:
    """Return places x ``(nx,)`` and worn depths ``(nx,)`` of both bodies in mid-face [mm].

    A line contact is its own middle section, so two and three dimensions can be compared.
    """
    profiles = {}
    for name, (grid, *depths) in worn_depths(folder, names).items():
        half = grid.shape[1] // 2
        rows = slice(max(0, half - MIDDLE_ROWS), half + MIDDLE_ROWS)
        body_1, body_2 = (np.mean(d[:, rows] if half else d, axis=1) for d in depths)
        profiles[name] = grid.x.ravel(), body_1, body_2
    return profiles


def middle_sections(folder: Path, names: Iterable[str]) -> dict[str, dict[str, float]]:
    """Return the largest depth [mm] and worn area [mm²] of each body in mid-face."""
    sections = {}
    for name, (x, *profiles) in middle_profiles(folder, names).items():
        pitch = float(x[1] - x[0])
        sections[name] = {
            **{f"depth_{k}": float(depth.max()) for k, depth in enumerate(profiles, 1)},
            **{f"area_{k}": float(d.sum()) * pitch for k, d in enumerate(profiles, 1)},
        }
    return sections


def middle_quantities(summary: Mapping[str, Any]) -> list[str]:
    """Return the paths of the numbers of :func:`middle_sections` in a summary with them."""
    sections: Mapping[str, Mapping[str, float]] = summary.get(MIDDLE, {})
    return [
        f"{MIDDLE}.{name}.{key}"
        for name, section in sections.items()
        for key, number in section.items()
        if number
    ]


def profile_difference(coarse: WornDepths, fine: WornDepths) -> float | None:
    """Return the largest difference of worn depth relative to the largest depth of ``fine``.

    Depths are those of both bodies together. The result is None if the grids have different
    dimensions.
    """
    largest = 0.0
    for name, (grid, *depths) in coarse.items():
        reference, *finer = fine[name]
        if grid.line != reference.line:
            return None
        there = _resampled(sum(finer), reference, grid)
        scale = float(np.max(sum(finer)))
        if scale > 0.0:
            largest = max(largest, float(np.max(np.abs(sum(depths) - there))) / scale)
    return largest


def _resampled(field: Any, grid: Grid, onto: Grid) -> Array:
    """Return a field on one grid at the cells of another grid over the same face."""
    from scipy.interpolate import RegularGridInterpolator

    if grid.line:
        values: Array = np.interp(onto.x.ravel(), grid.x.ravel(), field.ravel())[:, None]
        return values
    axes = grid.x.ravel(), grid.y.ravel()
    inside = [np.clip(c.ravel(), a[0], a[-1]) for c, a in zip((onto.x, onto.y), axes, strict=True)]
    points = np.meshgrid(*inside, indexing="ij")
    resampled: Array = RegularGridInterpolator(axes, field)(tuple(points))
    return resampled


def _measured(folder: Path, summary: Summary) -> Summary:
    return {**summary, MIDDLE: middle_sections(folder, interfaces(summary))}


def _apart(folder: Path, reference: Path, summary: Summary) -> dict[str, float]:
    """Return the largest difference of worn depth from another run, over its largest depth."""
    names = interfaces(summary)
    difference = profile_difference(worn_depths(folder, names), worn_depths(reference, names))
    return {} if difference is None else {PROFILE: difference}


COMPARISON: ChartComparison[WearCase] = ChartComparison(
    quantities=quantities,
    extras=extra_quantities,
    sections=middle_quantities,
    plain=PLAIN,
    measured=_measured,
    apart=_apart,
)
