"""Figures of a run of specimens: pad, loops, kinetics, and comparison with the half-space."""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation

from sa_solver.types import Array
from workflow.pictures.fields import centres, middle, near_middle
from workflow.pictures.panels import (
    Figures,
    course,
    legend_below,
    new_figure,
    panel_grid,
    plain_ticks,
    rounded,
    spread,
)
from workflow.pictures.scales import PER_MICRON, TO_JOULES, TO_MICRONS
from workflow.pictures.style import BLACK, BLUE, COLOUR_MAP, GREEN, ORANGE, PURPLE
from workflow.shell.output.results import grid_of

# Most normal forces that get a panel or colour of their own.
MOST_LOADS = 4
COLOURS = (BLUE, ORANGE, GREEN, PURPLE)
SHAPES = "unworn", "worn"


def figures_of(_: None) -> Figures:
    """Return the figures of a run, by name."""
    return {"pad": pad, "loops": loops, "kinetics": kinetics, "half_space": half_space}


def _loads(file: h5py.File) -> list[h5py.Group]:
    """Return groups of the forces to show, in the order of the case."""
    names = sorted(file["loads"], key=int)
    return [file["loads"][name] for name in spread(names, MOST_LOADS)]


def _force(load: h5py.Group) -> str:
    return f"{load.attrs['normal_force']:g} N"


def _states(load: h5py.Group) -> list[h5py.Group]:
    return list(load["states"].values())


# --- the pad ------------------------------------------------------------------------------------


def pad(file: h5py.File) -> Figure:
    """Draw pressure and slip path on the pad under the first force: unworn, between, worn."""
    load = _loads(file)[0]
    states = _three(load)
    peaks = [float(state["pressure"][()].max()) for state in states]
    title = f"The largest pressure on the pad under {_force(load)} {course(peaks, 'MPa')}"
    figure = new_figure(title, 7.2, compress=True)
    rows = figure.subplots(2, 3, sharex=True, sharey=True)
    for column, state in enumerate(states):
        top, bottom = rows[:, column]
        pressure, slip = state["pressure"][()], TO_MICRONS * state["cycle_slip"][()]
        cycles = f"{state.attrs['cycles']:,.0f} cycles" if column else "unworn"
        _draw_pad(figure, top, file, pressure, "pressure [MPa]")
        _draw_pad(figure, bottom, file, slip, "slip path per cycle [µm]")
        top.set_title(cycles)
        bottom.set_xlabel("x [mm]")
    for axis in rows[:, 0]:
        axis.set_ylabel("y [mm]")
    return figure


def _three(load: h5py.Group) -> list[h5py.Group]:
    """Return the unworn state, the one whose largest pressure is half way, and the last one."""
    states = _states(load)
    peaks = np.array([state["pressure"][()].max() for state in states])
    half = 0.5 * (peaks[0] + peaks[-1])
    return [states[0], states[int(np.abs(peaks - half).argmin())], states[-1]]


def _draw_pad(figure: Figure, axis: Axes, file: h5py.File, field: Array, label: str) -> None:
    """Draw a nodal field over the pad's triangles, on its own scale; white where it is 0."""
    place, triangles = file["specimens/pad/coordinates"][()], file["specimens/pad/facets"][()]
    shown = triangles[np.any(field[triangles] > 0.0, axis=1)]
    axis.set_aspect("equal")
    axis.grid(visible=False)
    half = np.abs(place).max(axis=0)
    axis.set(xlim=(-half[0], half[0]), ylim=(-half[1], half[1]))
    if not len(shown):
        return
    image = axis.tripcolor(
        Triangulation(place[:, 0], place[:, 1], shown),
        field,
        shading="gouraud",
        cmap=COLOUR_MAP,
        vmin=0.0,
    )
    figure.colorbar(image, ax=axis, label=label, pad=0.01)


# --- loops --------------------------------------------------------------------------------------


def loops(file: h5py.File) -> Figure:
    """Draw force against motion of the ring, unworn and worn, and the unworn coupled cycle."""
    loads = _loads(file)
    rows = -(-len(loads) // 2)
    figure = new_figure(_loops_title(loads), 1.0 + 4.0 * rows)
    panels = panel_grid(figure, len(loads))
    for axis, load in zip(panels, loads, strict=True):
        states = _states(load)
        ends = zip((states[0], states[-1]), (BLUE, ORANGE), SHAPES, strict=True)
        for state, colour, shape in ends:
            axis.plot(*_loop(state["loop"]), color=colour, label=f"{shape}, by Masing's rule")
        look: dict[str, Any] = {
            "markersize": 4,
            "label": "unworn, coupled and computed step by step",
        }
        axis.plot(*_loop(load["coupled_cycle"]), ".", color=BLACK, **look)
        axis.set(title=_force(load), xlabel="displacement of the ring [µm]")
        axis.set_ylabel("tangential force [N]")
    legend_below(figure, panels[:1])
    return figure


def _loop(group: h5py.Group) -> tuple[Array, Array]:
    return TO_MICRONS * group["ring_displacement"][()], group["ring_force"][()]


def _loops_title(loads: list[h5py.Group]) -> str:
    states = [_states(load) for load in loads]
    unworn, worn = (
        _range([PER_MICRON * float(kept[place]["secant_stiffness"][()]) for kept in states])
        for place in (0, -1)
    )
    return f"The slope of the loops up to half their force {_between(unworn, worn)}"


def _between(unworn: str, worn: str) -> str:
    """Say how stiffnesses [N/µm] change by wear."""
    if unworn == worn:
        return f"stays at {worn} N/µm"
    return f"is {unworn} N/µm unworn and {worn} N/µm worn"


def _range(values: list[float]) -> str:
    """Return the smallest and largest value in three digits, once where they are the same."""
    low, high = (rounded(value) for value in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"


# --- kinetics -----------------------------------------------------------------------------------


def kinetics(file: h5py.File) -> Figure:
    """Draw stiffness over cycles and over energy, area and evenness of pressure over cycles."""
    loads = _loads(file)
    figure = new_figure(_kinetics_title(loads), 9.0)
    panels = figure.subplots(2, 2)
    (over_cycles, over_energy), (areas, pressures) = panels
    for load, colour in zip(loads, COLOURS, strict=False):
        history, kept = load["kinetics"], _states(load)[1:]
        cycles, energy = history["cycles"][1:], TO_JOULES * history["energy"][1:]
        stiffness = PER_MICRON * history["stick_stiffness"][1:]
        slopes = [PER_MICRON * float(state["secant_stiffness"][()]) for state in kept]
        look: dict[str, Any] = {"color": colour}
        dots = {"markersize": 4, "linewidth": 1.0, **look}
        over_cycles.plot(cycles, stiffness, **look)
        over_cycles.plot([state.attrs["cycles"] for state in kept], slopes, "o--", **dots)
        over_energy.plot(energy, stiffness, **look)
        cost = [TO_JOULES * state.attrs["energy"] for state in kept]
        over_energy.plot(cost, slopes, "o--", **dots)
        areas.plot(cycles, history["area"][1:], label=_force(load), **look)
        pressures.plot(cycles, 100.0 * history["pressure_deviation"][1:], **look)
    _label_kinetics(panels)
    legend_below(figure, [areas])
    return figure


def _kinetics_title(loads: list[h5py.Group]) -> str:
    stuck = [load["kinetics/stick_stiffness"][()] for load in loads]
    unworn, worn = (_range([PER_MICRON * float(k[place]) for k in stuck]) for place in (0, -1))
    return f"The stiffness of the stuck pair {_between(unworn, worn)}"


def _label_kinetics(panels: Any) -> None:
    (over_cycles, over_energy), (areas, pressures) = panels
    for axis in panels.ravel():
        axis.set(xscale="log", xlabel="cycles")
        plain_ticks(axis.xaxis)
    over_energy.set_xlabel("dissipated energy [J]")
    over_cycles.set_title("stuck contact (lines), slope of the loop (dots)")
    over_energy.set_title("the same over the energy")
    for axis in (over_cycles, over_energy):
        axis.set_ylabel("tangential stiffness [N/µm]")
    areas.set(title="contact area", ylabel="contact area [mm²]", ylim=(0.0, None))
    pressures.set(title="unevenness of the pressure", ylim=(0.0, None))
    pressures.set_ylabel("rms deviation from its mean [%]")


# --- the half-space -----------------------------------------------------------------------------


def half_space(file: h5py.File) -> Figure:
    """Draw pressure and shear along x through the pad's middle, reduced model and half-space."""
    load = _loads(file)[0]
    states = _states(load)
    figure = new_figure(_half_space_title(load), 8.0)
    rows = figure.subplots(2, 2, sharex=True)
    for column, (state, shape) in enumerate(zip((states[0], states[-1]), SHAPES, strict=True)):
        beside = load["half_space"][shape]
        for axis, name in zip(rows[:, column], ("pressure", "shear_x"), strict=True):
            _draw_profile(axis, file, state, beside, name)
        rows[0, column].set_title(f"{shape}: pressure at y = 0")
        rows[1, column].set(title=f"{shape}: shear at y = 0", xlabel="x [mm]")
    rows[0, 0].set_ylabel("pressure [MPa]")
    rows[1, 0].set_ylabel("shear along x [MPa]")
    legend_below(figure, [rows[0, 0]])
    return figure


def _half_space_title(load: h5py.Group) -> str:
    """Return the title: the largest pressure of both models, unworn."""
    model, half_space = (
        rounded(float(group["pressure"][()].max()))
        for group in (_states(load)[0], load["half_space"][SHAPES[0]])
    )
    return (
        f"Unworn peak pressure under {_force(load)}: half-space {half_space} MPa, "
        f"reduced model {model} MPa"
    )


def _draw_profile(
    axis: Axes, file: h5py.File, state: h5py.Group, beside: h5py.Group, name: str
) -> None:
    """Draw cells next to y = 0 of the half-space, and nodes on it of the reduced model."""
    grid = grid_of(file["grid/pad"])
    place = file["specimens/pad/coordinates"][()]
    row = near_middle(place, 0)
    order = np.argsort(place[row, 0])
    nodal = np.abs(state[name][()])[row][order]
    cells = np.abs(middle(beside[name][()], 0))
    axis.plot(centres(grid, 0), cells, color=BLUE, label="half-space, cells")
    axis.plot(place[row, 0][order], nodal, "o", color=ORANGE, label="reduced model, nodes")
    axis.set_ylim(bottom=0.0)
