"""Figures of a wear run: resultants, peak pressure, worn profiles, kinetics."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from sa_solver.types import Array, Grid
from wear.kinetics import LinearRegime
from workflow.analyses.wear.figures.comparison import half_space_and_structure
from workflow.analyses.wear.figures.loops import LOOP_FIGURES
from workflow.analyses.wear.figures.structure_stress import structure_stress
from workflow.analyses.wear.figures.subsurface import STRESS_FIGURES
from workflow.analyses.wear.layout import body_names, jump_names
from workflow.pictures.fields import (
    MAP_PERCENTILE,
    MAX_PROFILES,
    centres,
    draw_map,
    line_contacts,
    map_top,
    middle,
    near_middle,
    spread,
)
from workflow.pictures.style import BLACK, BLUE, FONT_SIZE, GREEN, ORANGE, PURPLE, new_figure
from workflow.shell.results import grid_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BODY_STYLES = {1: (BLUE, "o"), 2: (ORANGE, "s")}
CYCLE_COLOURS = "viridis"

# The rounding is many times deeper than young wear: heights are shown up to so many depths.
HEIGHT_IN_DEPTHS = 2.0
# How far the kinetics are extended, in computed numbers of cycles.
EXTRAPOLATION = 2.0
# Of the band of its uncertainty, which is curved.
BAND_POINTS = 50
# What a profile along x and one along y show; a line contact has no y.
ALONG = "along x at y = 0", "along y at x = 0"
ALONG_LINE = ("along x",)

# --- resultants ---------------------------------------------------------------------------------


def resultants(file: h5py.File) -> Figure:
    """P, Qx within the Coulomb limits, and energy per increment, one column per interface."""
    interfaces = list(file["structure"])
    figure = new_figure(f"Resultants over {_cycles_shown(file)}: {_who_slides(file)}", 9.0)
    axes = figure.subplots(3, len(interfaces), sharex=True, sharey="row", squeeze=False)
    per = _per_length(file)
    for column, interface in zip(axes.T, interfaces, strict=True):
        history = {k: v[()] for k, v in file["structure"][interface]["load_history"].items()}
        increments = np.arange(1.0, len(history["P"]) + 1.0)
        _draw_normal_force(column[0], increments, history, interface, per)
        _draw_tangential_force(column[1], increments, history, float(file.attrs["friction"]))
        half_space = file.get(f"contact/{interface}/energy_half_space")
        # As the half-space's, that of an increment of a mix is per mean cycle.
        energy = history.get("share", 1.0) * (history["Edx"] + history["Edy"])
        _draw_energy(column[2], increments, energy, half_space, per)
        column[2].set_xlabel("increment")
    labels = f"P [kN{per}]", f"Qx [kN{per}]", f"energy per\nincrement [N mm{per}]"
    for axis, label in zip(axes[:, 0], labels, strict=True):
        axis.set_ylabel(label)
    axes[0, 0].set_ylim(bottom=0.0)
    return figure


def _cycles_shown(file: h5py.File) -> str:
    """One cycle, or those of a mix with their shares, by which energies are drawn."""
    loads = next(iter(file["structure"].values()))["load_history"]
    if "share" not in loads:
        return "one cycle"
    _, first = np.unique(loads["block"][()], return_index=True)
    return f"a mix of {', '.join(f'{share:.0%}' for share in loads['share'][()][first])}"


def _who_slides(file: h5py.File) -> str:
    """What the faces do, for the title."""
    sliding = [group["load_history/sliding"][()] for group in file["structure"].values()]
    count, total = sum(int(s.sum()) for s in sliding), sum(len(s) for s in sliding)
    if count == 0:
        return "no face slides as a whole"
    return f"faces slide as a whole in {count / total:.0%} of the increments"


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
    for mask, style, name in (
        (~sliding, "o", "at least partly stuck"),
        (sliding, "D", "slides as a whole"),
    ):
        fill = "white" if style == "o" else GREEN
        axis.plot(increments[mask], force[mask], style, color=GREEN, mfc=fill, ms=6, label=name)
    axis.set_title(f"slides as a whole in increments {_ranges(increments[sliding])}")
    axis.legend(loc="lower right")


def _ranges(numbers: Iterable[Any]) -> str:
    """``1-3, 7`` of ``1, 2, 3, 7``; ``none`` of nothing."""
    runs: list[list[int]] = []
    for number in map(int, numbers):
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    texts = (f"{run[0]}–{run[-1]}" if len(run) > 1 else f"{run[0]}" for run in runs)
    return ", ".join(texts) or "none"


def _draw_energy(
    axis: Axes, increments: Array, structure: Array, half_space: h5py.Dataset | None, per: str
) -> None:
    total = f"{structure.sum():.4g} N mm{per}"
    axis.bar(increments, structure, width=0.8, color="#9DC3DE", label=f"finite elements: {total}")
    title = f"{total} by finite elements"
    if half_space is not None:
        fine = half_space[()]
        name = f"half-space: {fine.sum():.4g} N mm{per}"
        axis.plot(increments, fine, "D", color=ORANGE, markersize=5, label=name)
        title = f"half-space {_change(structure.sum(), fine.sum())} against FE"
    axis.set_title(f"energy over the cycle: {title}")
    axis.legend(loc="best")


def _change(before: float, after: float) -> str:
    """Relative change, for a title."""
    return f"{after / before - 1.0:+.1%}" if before else "(no reference)"


# --- pressure -----------------------------------------------------------------------------------


def pressure_maps(file: h5py.File) -> Figure:
    """Peak-load pressure of every face, unworn above worn, on one colour scale."""
    states = [(name, jump) for name in file["contact"] for jump in _ends(file, name)]
    fields = [file["contact"][name][jump]["pressure"][()] for name, jump in states]
    top = map_top(fields)
    figure = new_figure(
        f"Largest pressure at peak load: {_peak_change(file)}", 2.0 * len(states) + 1
    )
    axes = figure.subplots(len(states), 1, sharex=True, squeeze=False)[:, 0]
    for axis, (name, jump), field in zip(axes, states, fields, strict=True):
        image = draw_map(axis, field, _grid(file, name), top)
        cycles = _cycles(file, name, jump)
        axis.set_title(f"{name}, {cycles}: largest {field.max():.0f} MPa, {_open(field)}")
    axes[-1].set_xlabel("y [mm]")
    figure.supylabel("x [mm]", fontsize=FONT_SIZE)
    label = f"pressure [MPa]; white: open; arrow: highest {100 - MAP_PERCENTILE:g}% of the cells"
    figure.colorbar(image, ax=axes, label=label, extend="max", shrink=0.8, pad=0.01)
    return figure


def _open(field: Array) -> str:
    """The share of the face's grid that is open."""
    return f"{np.mean(field <= 0.0):.0%} of the grid open"


def _peak_change(file: h5py.File) -> str:
    """Largest pressure of each face, unworn and worn."""
    texts = []
    for name in file["contact"]:
        peaks = [file["contact"][name][jump]["pressure"][()].max() for jump in _ends(file, name)]
        texts.append(f"{name} " + " → ".join(f"{peak:.0f}" for peak in peaks) + " MPa")
    return ", ".join(texts)


def pressure_profiles(file: h5py.File) -> Figure:
    """Peak-load pressure along both middle lines of each face, with the coarse solutions."""
    interfaces = list(file["contact"])
    along = ALONG_LINE if line_contacts(file) else ALONG
    directions = len(along)
    figure = new_figure(_edge_peak(file), 4.5 * directions)
    axes = figure.subplots(directions, len(interfaces), sharey="row", sharex="row", squeeze=False)
    for column, interface in zip(axes.T, interfaces, strict=True):
        for direction, axis in enumerate(column):
            _draw_profile(axis, file, interface, direction)
            axis.set_title(f"{interface}, {along[direction]}")
    axes[0, 0].legend(loc="upper center")
    for axis in axes[:, 0]:
        axis.set_ylabel("pressure [MPa]")
        axis.set_ylim(bottom=0.0)  # rows share it: only once all is drawn
    return figure


def _draw_profile(axis: Axes, file: h5py.File, interface: str, direction: int) -> None:
    """Pressure along x (``direction`` 0) or y (1) through the middle."""
    contact, grid = file["contact"][interface], _grid(file, interface)
    for jump, colour in zip(_ends(file, interface), (BLUE, ORANGE), strict=False):
        label = f"half-space {_cells(grid)}, {_cycles(file, interface, jump)}"
        profile = middle(contact[jump]["pressure"][()], direction)
        axis.plot(centres(grid, direction), profile, color=colour, label=label)
    if "coarse" in contact:
        coarse = grid_of(contact["coarse"])
        profile = middle(contact["coarse"]["pressure"][()], direction)
        label = f"half-space {_cells(coarse)}, unworn"
        axis.plot(centres(coarse, direction), profile, "o", color=BLACK, mfc="none", label=label)
    if f"structure/{interface}/pressure" in file:
        place, pressure = _nodes_on_middle(file, interface, direction)
        axis.plot(place, pressure, "x", color=PURPLE, mew=2, label="finite elements, unworn")
    axis.set_xlabel(("x [mm]", "y [mm]")[direction])


def _nodes_on_middle(file: h5py.File, interface: str, direction: int) -> tuple[Array, Array]:
    """Places and pressures at peak load of the FE nodes nearest to the middle line."""
    group = file["structure"][interface]
    coordinates, pressure = group["coordinates"][()], group["pressure"][_peak(file)]
    near = near_middle(coordinates, direction)
    return coordinates[near, direction], pressure[near]


def _edge_peak(file: h5py.File) -> str:
    """Largest pressure at y = 0 of the face where it is largest, by every method."""
    unworn = {name: file["contact"][name][_ends(file, name)[0]] for name in file["contact"]}
    peaks = {name: middle(group["pressure"][()], 0).max() for name, group in unworn.items()}
    name = max(peaks, key=lambda name: peaks[name])
    text = f"Edge peak on the {name}: {peaks[name]:.0f} MPa"
    if coarse := file["contact"][name].get("coarse"):
        peak = middle(coarse["pressure"][()], 0).max()
        cells = "" if line_contacts(file) else " cells"
        text += f"; {_cells(grid_of(coarse))}{cells} see {peak:.0f} MPa"
    if f"structure/{name}/pressure" in file:
        text += f", finite elements {_nodes_on_middle(file, name, 0)[1].max():.0f} MPa"
    return text


# --- wear ---------------------------------------------------------------------------------------


def worn_profiles(file: h5py.File) -> Figure:
    """Both surfaces and the depth worn off, along x in the middle of each face, as cycles go by."""
    interfaces = list(file["surfaces"])
    figure = new_figure("", 9.0)
    axes = figure.subplots(2, len(interfaces), sharex=True, sharey="row", squeeze=False)
    lower, upper = body_names(file).values()
    deepest = []
    for column, interface in zip(axes.T, interfaces, strict=True):
        deepest.append(_draw_wear(column, file, interface))
        column[0].set_title(f"{interface}: {upper} (above) and {lower} (below)")
        column[1].set_title(f"{interface}: depth worn off both bodies")
        column[1].set_xlabel("x [mm]")
    texts = (f"{name} {depth:.3g} µm" for name, depth in zip(interfaces, deepest, strict=True))
    place = "" if line_contacts(file) else " at y = 0"
    figure.suptitle(f"Depth worn off{place}, at most: {', '.join(texts)}", fontweight="bold")
    low, high = axes[0, 0].get_ylim()
    axes[0, 0].set_ylim(low, min(high, HEIGHT_IN_DEPTHS * max(deepest)) if any(deepest) else high)
    axes[1, 0].invert_yaxis()
    axes[0, 0].legend(loc="upper center", ncols=2)
    axes[0, 0].set_ylabel("height [µm]")
    axes[1, 0].set_ylabel("wear depth [µm]")
    return figure


def _draw_wear(axes: Iterable[Axes], file: h5py.File, interface: str) -> float:
    """Heights above, depths below, one colour per number of cycles; returns the last depth [µm]."""
    from matplotlib import colormaps

    heights, depths = axes
    surfaces, x = file["surfaces"][interface], centres(_grid(file, interface), 0)
    unworn = _middle_heights(surfaces[jump_names(file, interface)[0]])
    chosen = spread(jump_names(file, interface), MAX_PROFILES)
    for number, jump in enumerate(chosen):
        colour = colormaps[CYCLE_COLOURS](0.9 * number / max(len(chosen) - 1, 1))
        worn = _middle_heights(surfaces[jump])
        for height, label in zip(worn, (_cycles(file, interface, jump), None), strict=True):
            heights.plot(x, height, color=colour, label=label)
        depth = np.abs(worn - unworn).sum(axis=0)
        depths.plot(x, depth, color=colour)
    return float(depth.max())


def _middle_heights(surfaces: h5py.Group) -> Array:
    """Heights of both bodies along x at y = 0, ``(2, nx)`` [µm]."""
    return 1e3 * np.stack([middle(surfaces[f"body_{body}"][()], 0) for body in (1, 2)])


def kinetics(file: h5py.File) -> Figure:
    """Depth, volume and area over the cycles, with linear regimes and where they lead."""
    interfaces = [name for name in file["kinetics"] if name != "cycles"]
    cycles = file["kinetics/cycles"][()]
    unit = f"mm³{_per_length(file)}"
    totals = (f"{name} {_worn_volume(file, name):.3g} {unit}" for name in interfaces)
    title = f"Worn off in {cycles[-1]:,.0f} cycles: {', '.join(totals)}"
    with_area = all("area" in file["kinetics"][name] for name in interfaces)
    rows = 3 if with_area else 2
    figure = new_figure(title, 4.0 * rows + 1.0)
    axes = figure.subplots(rows, len(interfaces), sharex=True, sharey="row", squeeze=False)
    for column, interface in zip(axes.T, interfaces, strict=True):
        group = file["kinetics"][interface]
        if with_area:
            _draw_area(column[2], cycles, group)
            axes[2, 0].set_ylim(0.0, max(axes[2, 0].get_ylim()[1], 1.1 * group["area"][()].max()))
        _draw_kinetics(column[0], cycles, group, "depth", 1e3)
        _draw_kinetics(column[1], cycles, group, "volume", 1.0)
        column[0].set_title(f"{interface}: largest depth, {_regime(group, cycles)}")
        column[1].set_title(f"{interface}: volume, {_rate(group)}")
        column[-1].set_xlabel("cycles")
        column[-1].xaxis.set_major_formatter("{x:,.0f}")
        column[-1].locator_params(axis="x", nbins=5)
    axes[0, 0].set_ylabel("largest depth [µm]")
    axes[1, 0].set_ylabel(f"volume [mm³{_per_length(file)}]")
    if with_area:
        axes[2, 0].set_ylabel(f"area [mm²{_per_length(file)}]")
    # Not every panel has a linear regime: the legend takes each name from the first that has it.
    named: dict[str, Any] = {}
    for axis in axes.flat:
        handles, names = axis.get_legend_handles_labels()
        named |= dict(zip(names, handles, strict=True))
    figure.legend(named.values(), named.keys(), loc="outside lower center", ncols=len(named))
    return figure


def _draw_kinetics(
    axis: Axes, cycles: Array, group: h5py.Group, quantity: str, scale: float
) -> None:
    """Both bodies and their sum; dashed beyond the computed cycles."""
    names = body_names(group.file)
    worn = {body: scale * group[f"{quantity}_{body}"][()] for body in (1, 2)}
    for body, (colour, marker) in BODY_STYLES.items():
        # Bodies of one material wear alike: the second must not hide the first.
        size = 9 if body == 1 else 5
        fill = "none" if body == 1 else colour
        axis.plot(
            cycles,
            worn[body],
            marker,
            color=colour,
            mfc=fill,
            ms=size,
            label=names[body],
        )
    total = np.sum(list(worn.values()), axis=0)
    axis.plot(cycles, total, "-", color=BLACK, label="both")
    linear_from = float(group.attrs[f"{quantity}_linear_from"])
    # Older files do not have all of it.
    rate, trend, scatter = (
        scale * float(group.attrs.get(f"{quantity}_{name}", 0.0))
        for name in ("rate", "trend", "scatter")
    )
    if np.isfinite(rate):
        regime = LinearRegime(linear_from, rate, cycles[-1], total[-1], trend, scatter)
        _draw_extrapolation(axis, regime)
    if np.isfinite(linear_from):
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


def _draw_area(axis: Axes, cycles: Array, group: h5py.Group) -> None:
    area = group["area"][()]
    axis.plot(cycles, area, "o-", color=PURPLE, markersize=4)
    axis.set_title(f"{group.name.split('/')[-1]}: contact at peak load, {_change(*area[[0, -1]])}")


def _worn_volume(file: h5py.File, interface: str) -> float:
    """Volume worn off both bodies in the end [mm³]."""
    group = file["kinetics"][interface]
    return float(sum(group[f"volume_{body}"][-1] for body in (1, 2)))


def _rate(group: h5py.Group) -> str:
    """Volume rate of the linear regime, for a title."""
    rate = float(group.attrs["volume_rate"])
    if not np.isfinite(rate):
        return "no linear regime, no extrapolation"
    unit = f"mm³{_per_length(group.file)}"
    return f"{1e6 * rate:.3g} {unit} per 10⁶ cycles at the end"


def _regime(group: h5py.Group, cycles: Array) -> str:
    """From when the depth grows linearly, for a title."""
    linear_from = float(group.attrs["depth_linear_from"])
    if np.isfinite(linear_from):
        return f"linear from {linear_from:,.0f} cycles"
    return f"not yet linear at {cycles[-1]:,.0f}"


# --- reading ------------------------------------------------------------------------------------


def _ends(file: h5py.File, interface: str) -> list[str]:
    """First and last jump; one where nothing wore."""
    jumps = jump_names(file, interface)
    return jumps[:1] + jumps[1:][-1:]


def _cycles(file: h5py.File, interface: str, jump: str) -> str:
    """How worn a jump is, in words."""
    cycles = float(file["contact"][interface][jump].attrs["cycles"])
    return f"{cycles:,.0f} cycles" if cycles else "unworn"


def _peak(file: h5py.File) -> int:
    return int(file.attrs["peak_increment"])


def _per_length(file: h5py.File) -> str:
    """What units of forces and volumes end in."""
    return "/mm" if line_contacts(file) else ""


def _cells(grid: Grid) -> str:
    """The grid's size in words."""
    return f"{grid.shape[0]} strips" if grid.line else f"{grid.shape[0]} x {grid.shape[1]}"


def _grid(file: h5py.File, interface: str) -> Grid:
    return grid_of(file["grid"][interface])


def figures_of(file: h5py.File) -> dict[str, Callable[[h5py.File], Figure]]:
    """The figures there are data for, by name."""
    return {
        name: draw
        for name, (draw, needed) in (FIGURES | LOOP_FIGURES | STRESS_FIGURES).items()
        if all(group in file for group in needed)
        and not (draw is pressure_maps and line_contacts(file))
    }


CONTACT = ("grid", "contact", "surfaces")
# What each figure is called, and the groups it needs.
FIGURES: dict[str, tuple[Callable[[h5py.File], Figure], tuple[str, ...]]] = {
    "resultants": (resultants, ("structure", "grid")),
    "pressure_maps": (pressure_maps, CONTACT),
    "pressure_profiles": (pressure_profiles, CONTACT),
    "worn_profiles": (worn_profiles, CONTACT),
    "kinetics": (kinetics, ("kinetics",)),
    "structure_stress": (structure_stress, ("bodies", "grid")),
    "half_space_and_structure": (half_space_and_structure, ("comparison", "structure", "grid")),
}
