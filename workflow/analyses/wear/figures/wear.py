"""Figures of a wear run: peak pressure, worn profiles, kinetics; and the list of all figures."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sa_solver.types import Array, Grid
from wear.kinetics import LinearRegime
from workflow.analyses.wear.figures.bolts import bolts
from workflow.analyses.wear.figures.comparison import half_space_and_structure, nodes_on_middle
from workflow.analyses.wear.figures.error_budget import error_budget
from workflow.analyses.wear.figures.loops import loops
from workflow.analyses.wear.figures.resultants import resultants
from workflow.analyses.wear.figures.structure_stress import notch_stress, structure_stress
from workflow.analyses.wear.figures.subsurface import fretting_life, subsurface_stress
from workflow.analyses.wear.output.layout import EXTRAPOLATION, WearContents
from workflow.pictures.fields import (
    MAP_PERCENTILE,
    MAX_PROFILES,
    PROFILE_MARGIN,
    Map,
    centres,
    draw_maps,
    middle,
    view_of,
)
from workflow.pictures.panels import (
    Figures,
    blocks,
    change,
    grouped_ticks,
    label_rows,
    largest_course,
    legend_below,
    new_figure,
    panel_rows,
    present,
    rounded,
    shaded,
    volume_unit,
)
from workflow.pictures.scales import TO_MICRONS
from workflow.pictures.style import BLACK, BLUE, GREEN, HEADROOM, ORANGE, PURPLE
from workflow.shell.output.results import grid_of

# Colour, marker, its size and fill: bodies of one material wear equally, and the second must not
# hide the first.
BODY_STYLES: tuple[dict[str, Any], ...] = (
    {"color": BLUE, "marker": "o", "markersize": 9, "mfc": "none"},
    {"color": ORANGE, "marker": "s", "markersize": 5},
)

# Heights are shown up to this many worn depths, because rounded edges are much deeper than early
# wear.
HEIGHT_IN_DEPTHS = 2.0
# Margin below the lowest height, in worn depths.
BELOW = 0.15
# Points of the uncertainty band, which is curved.
BAND_POINTS = 50
# Titles of profiles along x and along y; a line contact has no y.
ALONG = "along x at y = 0", "along y at x = 0"
ALONG_LINE = ("along x",)


def figures_of(contents: WearContents) -> Figures:
    """Return the figures of a run, by name; the most important one comes first."""
    drawn = {
        "bolts": (bolts, bool(contents.bolts)),
        "pressure_profiles": (pressure_profiles, True),
        "pressure_maps": (pressure_maps, not contents.line),
        "worn_profiles": (worn_profiles, contents.worn),
        "kinetics": (kinetics, contents.worn),
        "resultants": (resultants, True),
        "error_budget": (error_budget, True),
        "structure_stress": (structure_stress, contents.structure),
        "notch_stress": (notch_stress, bool(contents.notches)),
        "half_space_and_structure": (half_space_and_structure, contents.comparison),
        "loops": (loops, contents.loops),
        "subsurface_stress": (subsurface_stress, contents.sections),
        "fretting_life": (fretting_life, bool(contents.cracking)),
    }
    return present(drawn, contents)


# --- pressure -----------------------------------------------------------------------------------


def pressure_maps(file: h5py.File, contents: WearContents) -> Figure:
    """Draw the peak-load pressure of every face, unworn and worn, on one colour scale."""
    rows, peaks = [], {}
    for name in contents.names:
        grid = grid_of(file["grid"][name])
        fields = _pressures(file, contents, name)
        peaks[name] = [field.max() for field in fields.values()]
        rows.append(
            [
                Map(_map_title(name, _cycles(file, name, jump), field, grid), field, grid)
                for jump, field in fields.items()
            ]
        )
    title = f"The largest pressure at peak load {largest_course(peaks, 'MPa')}"
    beyond = f"the highest {100 - MAP_PERCENTILE:g}% of the cells are beyond the colour scale"
    return draw_maps(title, rows, "pressure [MPa]", f"white: no contact; {beyond}")


def _map_title(interface: str, cycles: str, field: Array, grid: Grid) -> str:
    closed = grid.cell_area * np.count_nonzero(field > 0.0)
    largest, area = rounded(float(field.max())), rounded(closed)
    return f"{interface}, {cycles}: at most {largest} MPa, {area} mm² in contact"


def _pressures(file: h5py.File, contents: WearContents, interface: str) -> dict[str, Array]:
    """Return the pressure at peak load of the first and last jump, by jump."""
    contact = file["contact"][interface]
    return {jump: contact[jump]["pressure"][()] for jump in _ends(contents)}


def _shown_span(file: h5py.File, contents: WearContents, direction: int) -> tuple[float, float]:
    """Return the range of contact of all faces along x (0) or y (1), with a margin [mm]."""
    views = [
        view_of(
            list(_pressures(file, contents, name).values()),
            grid_of(file["grid"][name]),
            PROFILE_MARGIN,
        )
        for name in contents.names
    ]
    return min(view[direction][0] for view in views), max(view[direction][1] for view in views)


def pressure_profiles(file: h5py.File, contents: WearContents) -> Figure:
    """Draw the peak-load pressure along both middle lines of each face, with coarse solutions."""
    names, along = contents.names, ALONG_LINE if contents.line else ALONG
    figure = new_figure(_edge_peak(file, contents), (1.0 + 4.0 * len(along)) * blocks(len(names)))
    axes = panel_rows(figure, len(along), len(names), sharex="row")
    for column, name in zip(axes.T, names, strict=True):
        for direction, axis in enumerate(column):
            _draw_profile(axis, file, contents, name, direction)
            axis.set_title(f"{name}, {along[direction]}")
    label_rows(axes, ["pressure at peak load [MPa]"] * len(along))
    for direction, axis in enumerate(axes[:, 0]):  # rows share it: only once all is drawn
        axis.set(xlim=_shown_span(file, contents, direction), ylim=(0.0, None))
    legend_below(figure, axes.flat, columns=2)
    return figure


def _draw_profile(
    axis: Axes, file: h5py.File, contents: WearContents, interface: str, direction: int
) -> None:
    """Draw the pressure along x (``direction`` 0) or y (1) through the middle."""
    contact, grid = file["contact"][interface], grid_of(file["grid"][interface])
    for jump, colour in zip(_ends(contents), (BLUE, ORANGE), strict=False):
        on = " on" if contents.nodes else ""
        label = f"{contents.wears}{on} {_cells(grid)}, {_cycles(file, interface, jump)}"
        profile = middle(contact[jump]["pressure"][()], direction)
        axis.plot(centres(grid, direction), profile, color=colour, label=label)
    if interface in contents.coarse:
        coarse = grid_of(contact["coarse"])
        profile = middle(contact["coarse"]["pressure"][()], direction)
        label = f"half-space {_cells(coarse)}, unworn"
        axis.plot(centres(coarse, direction), profile, "o", color=BLACK, mfc="none", label=label)
    if contents.structure:
        place, pressure = _nodal_pressure(file, interface, direction)
        axis.plot(place, pressure, "x", color=PURPLE, mew=2, label="finite elements, unworn")
    axis.set_xlabel(("x [mm]", "y [mm]")[direction])


def _nodal_pressure(file: h5py.File, interface: str, direction: int) -> tuple[Array, Array]:
    """Return places and peak-load pressures of the FE nodes nearest to the middle line."""
    peak = int(file.attrs["peak_increment"])
    return nodes_on_middle(file["structure"][interface], "pressure", peak, direction)


def _edge_peak(file: h5py.File, contents: WearContents) -> str:
    """Return the title: the pressure peak along x of the most loaded face, by every method."""
    unworn = contents.jump_names[0]
    peaks = {
        name: middle(file["contact"][name][unworn]["pressure"][()], 0).max()
        for name in contents.names
    }
    name = max(peaks, key=lambda name: peaks[name])
    by = {f"on {_cells(grid_of(file['grid'][name]))}": peaks[name]}
    if name in contents.coarse:
        coarse = file["contact"][name]["coarse"]
        by[f"on {_cells(grid_of(coarse))}"] = middle(coarse["pressure"][()], 0).max()
    if contents.structure:
        by["by finite elements"] = _nodal_pressure(file, name, 0)[1].max()
    texts = [f"{rounded(float(peak))} MPa {how}" for how, peak in by.items()]
    place = f" on {name}" if len(contents.names) > 1 else ""
    return f"Unworn peak pressure{place}: {', '.join(texts)}"


# --- wear ---------------------------------------------------------------------------------------


def worn_profiles(file: h5py.File, contents: WearContents) -> Figure:
    """Draw surfaces and worn depth along x in the middle of each face, as cycles go by."""
    names, (lower, upper) = contents.names, contents.bodies
    figure = new_figure("", 9.5 * blocks(len(names)))
    axes = panel_rows(figure, 2, len(names))
    deepest = {}
    for column, name in zip(axes.T, names, strict=True):
        deepest[name] = _draw_wear(column, file, contents, name)
        column[0].set_title(f"{name}: {upper} (above) and {lower} (below)")
        column[1].set(title=f"{name}: worn depth of both bodies together", xlabel="x [mm]")
    place = "" if contents.line else " at y = 0"
    most = max(deepest.values())
    figure.suptitle(f"Wear removes up to {rounded(most)} µm{place}", fontweight="bold")
    low, high = axes[0, 0].get_ylim()
    if most:
        lowest = min(float(np.min(line.get_ydata())) for axis in axes[0] for line in axis.lines)
        low, high = max(low, lowest - BELOW * most), min(high, HEIGHT_IN_DEPTHS * most)
    axes[0, 0].set_ylim(low, high)
    axes[0, 0].set_xlim(_shown_span(file, contents, 0))
    axes[1, 0].invert_yaxis()
    label_rows(axes, ("height of the surfaces [µm]", "worn depth, both bodies [µm]"))
    legend_below(figure, [axes[0, 0]])
    return figure


def _draw_wear(
    axes: Iterable[Axes], file: h5py.File, contents: WearContents, interface: str
) -> float:
    """Draw heights above and depths below, a colour per number of cycles; return the depth [µm]."""
    heights, depths = axes
    surfaces, x = file["surfaces"][interface], centres(grid_of(file["grid"][interface]), 0)
    unworn = _middle_heights(surfaces[contents.jump_names[0]])
    for jump, colour in shaded(contents.jump_names, MAX_PROFILES):
        worn = _middle_heights(surfaces[jump])
        for height, label in zip(worn, (_cycles(file, interface, jump), None), strict=True):
            heights.plot(x, height, color=colour, label=label)
        depth = np.abs(worn - unworn).sum(axis=0)
        depths.plot(x, depth, color=colour)
    return float(depth.max())


def _middle_heights(surfaces: h5py.Group) -> Array:
    """Return the heights of both bodies along x at y = 0 ``(2, nx)`` [µm]."""
    return TO_MICRONS * np.stack([middle(surfaces[f"body_{body}"][()], 0) for body in (1, 2)])


def kinetics(file: h5py.File, contents: WearContents) -> Figure:
    """Draw depth, volume and area over the cycles, with linear regimes and extrapolations."""
    groups = {name: file["kinetics"][name] for name in contents.names}
    cycles, per = file["kinetics/cycles"][()], contents.per
    volumes = [sum(group[f"volume_{body}"][-1] for body in (1, 2)) for group in groups.values()]
    scale, unit = volume_unit(max(volumes))
    total = f"{rounded(scale * sum(volumes))} {unit}{per}"
    together = " from all contacts together" if len(volumes) > 1 else ""
    title = f"Wear removes {total}{together} in {cycles[-1]:,.0f} cycles"
    figure = new_figure(title, 12.0 * blocks(len(groups)))
    axes = panel_rows(figure, 3, len(groups))
    for column, (name, group) in zip(axes.T, groups.items(), strict=True):
        depth, volume, area = column
        _draw_area(area, cycles, group, name, per)
        _draw_kinetics(depth, cycles, group, "depth", contents.bodies, TO_MICRONS)
        _draw_kinetics(volume, cycles, group, "volume", contents.bodies, scale)
        depth.set_title(f"{name}: largest depth, {_regime(group, cycles)}")
        volume.set_title(f"{name}: worn volume, {_rate(group, per)}")
        area.set_xlabel("cycles")
    for line in (axes[2, 0].xaxis, axes[1, 0].yaxis):
        grouped_ticks(line)
    largest = max(group["area"][()].max() for group in groups.values())
    axes[2, 0].set_ylim(0.0, HEADROOM * largest)
    label_rows(
        axes, ("largest depth [µm]", f"worn volume [{unit}{per}]", f"contact area [mm²{per}]")
    )
    # Entries are collected from all panels, since not every one has a linear regime.
    legend_below(figure, axes.flat)
    return figure


def _draw_kinetics(
    axis: Axes,
    cycles: Array,
    group: h5py.Group,
    quantity: str,
    bodies: tuple[str, str],
    scale: float = 1.0,
) -> None:
    """Draw both bodies and their sum; dashed beyond the computed cycles."""
    worn = [scale * group[f"{quantity}_{body}"][()] for body in (1, 2)]
    for values, name, look in zip(worn, bodies, BODY_STYLES, strict=True):
        axis.plot(cycles, values, linestyle="", label=name, **look)
    total = worn[0] + worn[1]
    axis.plot(cycles, total, "-", color=BLACK, label="both bodies")
    linear_from = float(group.attrs[f"{quantity}_linear_from"])
    rate, trend, scatter = (
        scale * float(group.attrs[f"{quantity}_{name}"]) for name in ("rate", "trend", "scatter")
    )
    if np.isfinite(rate):
        regime = LinearRegime(linear_from, rate, cycles[-1], total[-1], trend, scatter)
        _draw_extrapolation(axis, regime)
        axis.axvspan(linear_from, cycles[-1], color=GREEN, alpha=0.15, lw=0, label="linear regime")


def _draw_extrapolation(axis: Axes, regime: LinearRegime) -> None:
    """Draw the line beyond the computed cycles, dashed, with its uncertainty band."""
    beyond = regime.last_cycles * np.array([1.0, EXTRAPOLATION])
    label = "extrapolated (not computed)"
    axis.plot(beyond, regime.extrapolate(beyond), "--", color=BLACK, label=label)
    fine = np.linspace(beyond[0], beyond[1], BAND_POINTS)
    line, reach = regime.extrapolate(fine), regime.uncertainty(fine)
    look: dict[str, Any] = {"color": BLACK, "alpha": 0.2, "lw": 0}
    label = "uncertainty of the extrapolation"
    axis.fill_between(fine, line - reach, line + reach, label=label, **look)


def _draw_area(axis: Axes, cycles: Array, group: h5py.Group, interface: str, per: str) -> None:
    area = group["area"][()]
    axis.plot(cycles, area, "o-", color=PURPLE, markersize=4)
    axis.set_title(
        f"{interface}: contact area at peak load, {change(area[0], area[-1], f'mm²{per}')}"
    )


def _rate(group: h5py.Group, per: str) -> str:
    """Return the volume rate of the linear regime, for a title."""
    rate = 1e6 * float(group.attrs["volume_rate"])
    if not np.isfinite(rate):
        return "no linear regime, no extrapolation"
    scale, unit = volume_unit(rate)
    return f"{rounded(scale * rate)} {unit}{per} per 10⁶ cycles at the end"


def _regime(group: h5py.Group, cycles: Array) -> str:
    """Return when linear growth of the depth starts, for a title."""
    linear_from = float(group.attrs["depth_linear_from"])
    if np.isfinite(linear_from):
        return f"linear from {linear_from:,.0f} cycles"
    return f"not yet linear at {cycles[-1]:,.0f}"


# --- reading ------------------------------------------------------------------------------------


def _ends(contents: WearContents) -> list[str]:
    """Return the first and last jump; only one if nothing wore."""
    return list(dict.fromkeys(jump for _, jump in contents.ends))


def _cycles(file: h5py.File, interface: str, jump: str) -> str:
    """Return the number of cycles of a jump, in words."""
    cycles = float(file["contact"][interface][jump].attrs["cycles"])
    return f"{cycles:,.0f} cycles" if cycles else "unworn"


def _cells(grid: Grid) -> str:
    """Return the grid's size in words."""
    return f"{grid.shape[0]} cells" if grid.line else f"{grid.shape[0]} x {grid.shape[1]} cells"
