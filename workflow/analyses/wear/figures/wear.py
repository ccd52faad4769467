"""Figures of a wear run: resultants, peak pressure, worn profiles, kinetics."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import Any

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sa_solver.types import Array, Grid
from wear.kinetics import LinearRegime
from workflow.analyses.wear.figures.comparison import half_space_and_structure, nodes_on_middle
from workflow.analyses.wear.figures.error_budget import error_budget
from workflow.analyses.wear.figures.loops import loops
from workflow.analyses.wear.figures.structure_stress import structure_stress
from workflow.analyses.wear.figures.subsurface import fretting_life, subsurface_stress
from workflow.analyses.wear.layout import EXTRAPOLATION, Contents, energy_name
from workflow.pictures.fields import (
    MAP_PERCENTILE,
    MAX_PROFILES,
    centres,
    draw_map,
    map_top,
    middle,
)
from workflow.pictures.panels import Figures, changes, legend_below, new_figure, shaded
from workflow.pictures.scales import TO_MICRONS
from workflow.pictures.style import BLACK, BLUE, FONT_SIZE, GREEN, HEADROOM, ORANGE, PURPLE
from workflow.shell.results import grid_of

# Colour, marker, its size and fill: bodies of one material wear alike, and the second must not hide
# the first.
BODY_STYLES: tuple[dict[str, Any], ...] = (
    {"color": BLUE, "marker": "o", "markersize": 9, "mfc": "none"},
    {"color": ORANGE, "marker": "s", "markersize": 5},
)

# The rounding is many times deeper than young wear: heights are shown up to so many depths.
HEIGHT_IN_DEPTHS = 2.0
# Of the band of its uncertainty, which is curved.
BAND_POINTS = 50
# What a profile along x and one along y show; a line contact has no y.
ALONG = "along x at y = 0", "along y at x = 0"
ALONG_LINE = ("along x",)
NO_SLIDING = "no face slides as a whole"


def figures_of(contents: Contents) -> Figures:
    """The figures of a run, by name."""
    drawn = {
        "resultants": (resultants, True),
        "pressure_maps": (pressure_maps, not contents.line),
        "pressure_profiles": (pressure_profiles, True),
        "worn_profiles": (worn_profiles, True),
        "kinetics": (kinetics, True),
        "error_budget": (error_budget, True),
        "structure_stress": (structure_stress, contents.structure),
        "half_space_and_structure": (half_space_and_structure, contents.comparison),
        "loops": (loops, contents.loops),
        "subsurface_stress": (subsurface_stress, contents.sections),
        "fretting_life": (fretting_life, bool(contents.life)),
    }
    return {
        name: partial(draw, contents=contents) for name, (draw, there) in drawn.items() if there
    }


# --- resultants ---------------------------------------------------------------------------------


def resultants(file: h5py.File, contents: Contents) -> Figure:
    """P, Qx within the Coulomb limits, and energy per increment, one column per interface."""
    names, per = contents.names, contents.per
    title = f"Resultants over {_cycles_shown(file, contents)}: {_who_slides(file)}"
    figure = new_figure(title, 9.0)
    axes = figure.subplots(3, len(names), sharex=True, sharey="row", squeeze=False)
    for column, name in zip(axes.T, names, strict=True):
        history = {k: v[()] for k, v in file["structure"][name]["load_history"].items()}
        increments = np.arange(1.0, len(history["P"]) + 1.0)
        _draw_normal_force(column[0], increments, history, name, per)
        _draw_tangential_force(column[1], increments, history, float(file.attrs["friction"]))
        # As the half-space's, that of an increment of a mix is per mean cycle.
        share = history["share"] if contents.mix else 1.0
        energy = share * (history["Edx"] + history["Edy"])
        wearing = file["contact"][name][energy_name(contents.nodes)][()]
        _draw_energy(column[2], increments, energy, wearing, contents)
        column[2].set_xlabel("increment")
    labels = f"P [kN{per}]", f"Qx [kN{per}]", f"energy per\nincrement [N mm{per}]"
    for axis, label in zip(axes[:, 0], labels, strict=True):
        axis.set_ylabel(label)
    axes[0, 0].set_ylim(bottom=0.0)
    return figure


def _cycles_shown(file: h5py.File, contents: Contents) -> str:
    """One cycle, or those of a mix with their shares, by which energies are drawn."""
    if not contents.mix:
        return "one cycle"
    loads = file["structure"][contents.names[0]]["load_history"]
    _, first = np.unique(loads["block"][()], return_index=True)
    return f"a mix of {', '.join(f'{share:.0%}' for share in loads['share'][()][first])}"


def _who_slides(file: h5py.File) -> str:
    """What the faces do, for the title."""
    slides = [group["load_history/sliding"][()] for group in file["structure"].values()]
    share = np.mean(np.concatenate(slides))
    return f"faces slide as a whole in {share:.0%} of the increments" if share else NO_SLIDING


def _draw_normal_force(
    axis: Axes, increments: Array, history: dict[str, Array], interface: str, per: str
) -> None:
    force = history["P"] / 1e3
    axis.plot(increments, force, "o-", color=BLUE, markersize=4)
    peak = int(np.argmax(force))
    axis.set_title(f"{interface}: P peaks at {force[peak]:.3g} kN{per}, increment {peak + 1}")


def _draw_tangential_force(
    axis: Axes, increments: Array, history: dict[str, Array], friction: float
) -> None:
    limit, force = friction * history["P"] / 1e3, history["Qx"] / 1e3
    label = f"|Qx| < µP, µ = {friction:g}"
    axis.fill_between(increments, -limit, limit, color="#BBBBBB", alpha=0.5, lw=0, label=label)
    axis.plot(increments, force, "-", color=GREEN)
    sliding = history["sliding"].astype(bool)
    for mask, style, fill, name in (
        (~sliding, "o", "white", "at least partly stuck"),
        (sliding, "D", GREEN, "slides as a whole"),
    ):
        axis.plot(increments[mask], force[mask], style, color=GREEN, mfc=fill, ms=6, label=name)
    axis.set_title(f"slides as a whole in increments {_ranges(increments[sliding])}")
    axis.legend(loc="lower right")


def _ranges(numbers: Iterable[Any]) -> str:
    """``1-3, 7`` of ``1, 2, 3, 7``; ``none`` of nothing."""
    whole = np.array([*numbers], dtype=int)
    runs = np.split(whole, np.flatnonzero(np.diff(whole) > 1) + 1) if whole.size else []
    texts = (f"{run[0]}–{run[-1]}" if len(run) > 1 else f"{run[0]}" for run in runs)
    return ", ".join(texts) or "none"


def _draw_energy(
    axis: Axes, increments: Array, structure: Array, wearing: Array, contents: Contents
) -> None:
    per, wears = contents.per, contents.wears
    coarse, fine = (f"{energy.sum():.4g} N mm{per}" for energy in (structure, wearing))
    axis.bar(increments, structure, width=0.8, color="#9DC3DE", label=f"finite elements: {coarse}")
    look: dict[str, Any] = {"color": ORANGE, "markersize": 5, "label": f"{wears}: {fine}"}
    axis.plot(increments, wearing, "D", **look)
    change = _change(structure.sum(), wearing.sum())
    axis.set_title(f"energy over the cycle: {wears} {change} against FE")
    axis.legend(loc="best")


def _change(before: float, after: float) -> str:
    """Relative change, for a title."""
    return f"{after / before - 1.0:+.1%}" if before else "(no reference)"


# --- pressure -----------------------------------------------------------------------------------


def pressure_maps(file: h5py.File, contents: Contents) -> Figure:
    """Peak-load pressure of every face, unworn above worn, on one colour scale."""
    ends = _ends(contents)
    states = [(name, jump) for name in contents.names for jump in ends]
    fields = [file["contact"][name][jump]["pressure"][()] for name, jump in states]
    top, peaks = map_top(fields), np.reshape([field.max() for field in fields], (-1, len(ends)))
    largest = changes(dict(zip(contents.names, peaks, strict=True)), ".0f", " MPa")
    figure = new_figure(f"Largest pressure at peak load: {largest}", 2.0 * len(states) + 1)
    axes = figure.subplots(len(states), 1, sharex=True, squeeze=False)[:, 0]
    for axis, (name, jump), field in zip(axes, states, fields, strict=True):
        image = draw_map(axis, field, grid_of(file["grid"][name]), top)
        opened = f"{np.mean(field <= 0.0):.0%} of the grid open"
        axis.set_title(
            f"{name}, {_cycles(file, name, jump)}: largest {field.max():.0f} MPa, {opened}"
        )
    axes[-1].set_xlabel("y [mm]")
    figure.supylabel("x [mm]", fontsize=FONT_SIZE)
    label = f"pressure [MPa]; white: open; arrow: highest {100 - MAP_PERCENTILE:g}% of the cells"
    figure.colorbar(image, ax=axes, label=label, extend="max", shrink=0.8, pad=0.01)
    return figure


def pressure_profiles(file: h5py.File, contents: Contents) -> Figure:
    """Peak-load pressure along both middle lines of each face, with the coarse solutions."""
    names, along = contents.names, ALONG_LINE if contents.line else ALONG
    figure = new_figure(_edge_peak(file, contents), 4.5 * len(along))
    axes = figure.subplots(len(along), len(names), sharey="row", sharex="row", squeeze=False)
    for column, name in zip(axes.T, names, strict=True):
        for direction, axis in enumerate(column):
            _draw_profile(axis, file, contents, name, direction)
            axis.set_title(f"{name}, {along[direction]}")
    axes[0, 0].legend(loc="upper center")
    for axis in axes[:, 0]:  # rows share it: only once all is drawn
        axis.set(ylabel="pressure [MPa]", ylim=(0.0, None))
    return figure


def _draw_profile(
    axis: Axes, file: h5py.File, contents: Contents, interface: str, direction: int
) -> None:
    """Pressure along x (``direction`` 0) or y (1) through the middle."""
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
    """Places and pressures at peak load of the FE nodes nearest to the middle line."""
    peak = int(file.attrs["peak_increment"])
    return nodes_on_middle(file["structure"][interface], "pressure", peak, direction)


def _edge_peak(file: h5py.File, contents: Contents) -> str:
    """Largest pressure at y = 0 of the face where it is largest, by every method."""
    unworn = contents.jump_names[0]
    peaks = {
        name: middle(file["contact"][name][unworn]["pressure"][()], 0).max()
        for name in contents.names
    }
    name = max(peaks, key=lambda name: peaks[name])
    text = f"Edge peak on the {name}: {peaks[name]:.0f} MPa"
    if name in contents.coarse:
        coarse = file["contact"][name]["coarse"]
        peak = middle(coarse["pressure"][()], 0).max()
        cells = "" if contents.line else " cells"
        text += f"; {_cells(grid_of(coarse))}{cells} see {peak:.0f} MPa"
    if contents.structure:
        text += f", finite elements {_nodal_pressure(file, name, 0)[1].max():.0f} MPa"
    return text


# --- wear ---------------------------------------------------------------------------------------


def worn_profiles(file: h5py.File, contents: Contents) -> Figure:
    """Both surfaces and the depth worn off, along x in the middle of each face, as cycles go by."""
    names, (lower, upper) = contents.names, contents.bodies
    figure = new_figure("", 9.0)
    axes = figure.subplots(2, len(names), sharex=True, sharey="row", squeeze=False)
    deepest = []
    for column, name in zip(axes.T, names, strict=True):
        deepest.append(_draw_wear(column, file, contents, name))
        column[0].set_title(f"{name}: {upper} (above) and {lower} (below)")
        column[1].set(title=f"{name}: depth worn off both bodies", xlabel="x [mm]")
    texts = (f"{name} {depth:.3g} µm" for name, depth in zip(names, deepest, strict=True))
    place = "" if contents.line else " at y = 0"
    figure.suptitle(f"Depth worn off{place}, at most: {', '.join(texts)}", fontweight="bold")
    low, high = axes[0, 0].get_ylim()
    axes[0, 0].set_ylim(low, min(high, HEIGHT_IN_DEPTHS * max(deepest)) if any(deepest) else high)
    axes[1, 0].invert_yaxis()
    axes[0, 0].legend(loc="upper center", ncols=2)
    axes[0, 0].set_ylabel("height [µm]")
    axes[1, 0].set_ylabel("wear depth [µm]")
    return figure


def _draw_wear(axes: Iterable[Axes], file: h5py.File, contents: Contents, interface: str) -> float:
    """Heights above, depths below, one colour per number of cycles; returns the last depth [µm]."""
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
    """Heights of both bodies along x at y = 0, ``(2, nx)`` [µm]."""
    return TO_MICRONS * np.stack([middle(surfaces[f"body_{body}"][()], 0) for body in (1, 2)])


def kinetics(file: h5py.File, contents: Contents) -> Figure:
    """Depth, volume and area over the cycles, with linear regimes and where they lead."""
    groups = {name: file["kinetics"][name] for name in contents.names}
    cycles, per = file["kinetics/cycles"][()], contents.per
    volumes = {
        name: sum(group[f"volume_{body}"][-1] for body in (1, 2)) for name, group in groups.items()
    }
    totals = (f"{name} {volume:.3g} mm³{per}" for name, volume in volumes.items())
    figure = new_figure(f"Worn off in {cycles[-1]:,.0f} cycles: {', '.join(totals)}", 13.0)
    axes = figure.subplots(3, len(groups), sharex=True, sharey="row", squeeze=False)
    for column, (name, group) in zip(axes.T, groups.items(), strict=True):
        depth, volume, area = column
        _draw_area(area, cycles, group, name)
        axes[2, 0].set_ylim(0.0, max(axes[2, 0].get_ylim()[1], HEADROOM * group["area"][()].max()))
        _draw_kinetics(depth, cycles, group, "depth", contents.bodies, TO_MICRONS)
        _draw_kinetics(volume, cycles, group, "volume", contents.bodies)
        depth.set_title(f"{name}: largest depth, {_regime(group, cycles)}")
        volume.set_title(f"{name}: volume, {_rate(group, per)}")
        area.set_xlabel("cycles")
        area.xaxis.set_major_formatter("{x:,.0f}")
        area.locator_params(axis="x", nbins=5)
    labels = "largest depth [µm]", f"volume [mm³{per}]", f"area [mm²{per}]"
    for axis, label in zip(axes[:, 0], labels, strict=True):
        axis.set_ylabel(label)
    # Not every panel has a linear regime.
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
    """Both bodies and their sum; dashed beyond the computed cycles."""
    worn = [scale * group[f"{quantity}_{body}"][()] for body in (1, 2)]
    for values, name, look in zip(worn, bodies, BODY_STYLES, strict=True):
        axis.plot(cycles, values, linestyle="", label=name, **look)
    total = worn[0] + worn[1]
    axis.plot(cycles, total, "-", color=BLACK, label="both")
    linear_from = float(group.attrs[f"{quantity}_linear_from"])
    rate, trend, scatter = (
        scale * float(group.attrs[f"{quantity}_{name}"]) for name in ("rate", "trend", "scatter")
    )
    if np.isfinite(rate):
        regime = LinearRegime(linear_from, rate, cycles[-1], total[-1], trend, scatter)
        _draw_extrapolation(axis, regime)
        axis.axvspan(linear_from, cycles[-1], color=GREEN, alpha=0.15, lw=0, label="linear regime")


def _draw_extrapolation(axis: Axes, regime: LinearRegime) -> None:
    """The line beyond the computed cycles, dashed, in the band of its uncertainty."""
    beyond = regime.last_cycles * np.array([1.0, EXTRAPOLATION])
    label = "both, extrapolated (not computed)"
    axis.plot(beyond, regime.extrapolate(beyond), "--", color=BLACK, label=label)
    fine = np.linspace(beyond[0], beyond[1], BAND_POINTS)
    line, reach = regime.extrapolate(fine), regime.uncertainty(fine)
    look: dict[str, Any] = {"color": BLACK, "alpha": 0.2, "lw": 0, "label": "its uncertainty"}
    axis.fill_between(fine, line - reach, line + reach, **look)


def _draw_area(axis: Axes, cycles: Array, group: h5py.Group, interface: str) -> None:
    area = group["area"][()]
    axis.plot(cycles, area, "o-", color=PURPLE, markersize=4)
    axis.set_title(f"{interface}: contact at peak load, {_change(*area[[0, -1]])}")


def _rate(group: h5py.Group, per: str) -> str:
    """Volume rate of the linear regime, for a title."""
    rate = float(group.attrs["volume_rate"])
    if not np.isfinite(rate):
        return "no linear regime, no extrapolation"
    return f"{1e6 * rate:.3g} mm³{per} per 10⁶ cycles at the end"


def _regime(group: h5py.Group, cycles: Array) -> str:
    """From when the depth grows linearly, for a title."""
    linear_from = float(group.attrs["depth_linear_from"])
    if np.isfinite(linear_from):
        return f"linear from {linear_from:,.0f} cycles"
    return f"not yet linear at {cycles[-1]:,.0f}"


# --- reading ------------------------------------------------------------------------------------


def _ends(contents: Contents) -> list[str]:
    """First and last jump; one where nothing wore."""
    return list(dict.fromkeys(jump for _, jump in contents.ends))


def _cycles(file: h5py.File, interface: str, jump: str) -> str:
    """How worn a jump is, in words."""
    cycles = float(file["contact"][interface][jump].attrs["cycles"])
    return f"{cycles:,.0f} cycles" if cycles else "unworn"


def _cells(grid: Grid) -> str:
    """The grid's size in words."""
    return f"{grid.shape[0]} strips" if grid.line else f"{grid.shape[0]} x {grid.shape[1]}"
