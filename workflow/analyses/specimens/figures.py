"""Figures of a run of specimens: pad, loops, kinetics, and the half-space beside them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from sa_solver.types import Array
from workflow.pictures.fields import PRESSURE_COLOURS, centres, middle, near_middle, spread
from workflow.pictures.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, new_figure
from workflow.shell.results import grid_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# As many normal forces as have a separate panel or colour.
MOST_LOADS = 4
COLOURS = (BLUE, ORANGE, GREEN, PURPLE)
MICRO = 1e3  # mm to µm; its inverse N/mm to N/µm
SHAPES = "unworn", "worn"


def figures_of(file: h5py.File) -> dict[str, Callable[[h5py.File], Figure]]:
    """The figures there are data for, by name."""
    return {"pad": pad, "loops": loops, "kinetics": kinetics, "half_space": half_space}


def _loads(file: h5py.File) -> list[h5py.Group]:
    """Groups of the forces to show, in the order of the case."""
    names = sorted(file["loads"], key=int)
    return [file["loads"][name] for name in spread(names, MOST_LOADS)]


def _force(load: h5py.Group) -> str:
    return f"{load.attrs['normal_force']:g} N"


def _states(load: h5py.Group) -> list[h5py.Group]:
    return list(load["states"].values())


# --- the pad ------------------------------------------------------------------------------------


def pad(file: h5py.File) -> Figure:
    """Pressure and path of slip on the pad under the first force: unworn, between, worn."""
    load = _loads(file)[0]
    states = _three(load)
    figure = new_figure(f"The pad at {_force(load)}: {_pad_title(states)}", 7.2)
    rows = figure.subplots(2, 3, sharex=True, sharey=True)
    for column, state in enumerate(states):
        top, bottom = rows[:, column]
        pressure, slip = state["pressure"][()], MICRO * state["cycle_slip"][()]
        cycles = f"{state.attrs['cycles']:.3g} cycles" if column else "unworn"
        _draw_pad(figure, top, file, pressure, "MPa")
        _draw_pad(figure, bottom, file, slip, "µm")
        top.set_title(f"pressure, {cycles}")
        bottom.set_title("path of slip per cycle")
        bottom.set_xlabel("x [mm]")
    for axis in rows[:, 0]:
        axis.set_ylabel("y [mm]")
    return figure


def _three(load: h5py.Group) -> list[h5py.Group]:
    """Unworn, the state whose largest pressure is half way, and the last one."""
    states = _states(load)
    peaks = np.array([state["pressure"][()].max() for state in states])
    half = 0.5 * (peaks[0] + peaks[-1])
    return [states[0], states[int(np.abs(peaks - half).argmin())], states[-1]]


def _pad_title(states: list[h5py.Group]) -> str:
    first, last = (float(states[place]["pressure"][()].max()) for place in (0, -1))
    return f"pressure at most {first:.4g} MPa, worn {last:.4g} MPa"


def _draw_pad(figure: Figure, axis: Axes, file: h5py.File, field: Array, unit: str) -> None:
    """A nodal field over the pad's triangles, on its own scale; white where it is 0."""
    from matplotlib.tri import Triangulation

    place, triangles = file["specimens/pad/coordinates"][()], file["specimens/pad/facets"][()]
    shown = triangles[np.any(field[triangles] > 0.0, axis=1)]
    axis.set_aspect("equal")
    axis.grid(visible=False)
    half = np.abs(place).max(axis=0)
    axis.set_xlim(-half[0], half[0])
    axis.set_ylim(-half[1], half[1])
    if not len(shown):
        return
    image = axis.tripcolor(
        Triangulation(place[:, 0], place[:, 1], shown),
        field,
        shading="gouraud",
        cmap=PRESSURE_COLOURS,
        vmin=0.0,
    )
    figure.colorbar(image, ax=axis, label=f"[{unit}]", shrink=0.62)


# --- loops --------------------------------------------------------------------------------------


def loops(file: h5py.File) -> Figure:
    """Force against motion of the ring, unworn and worn, and the coupled cycle unworn."""
    loads = _loads(file)
    figure = new_figure(_loops_title(loads), 8.5 if len(loads) > 2 else 5.0)
    panels = figure.subplots(-(-len(loads) // 2), min(len(loads), 2), squeeze=False).ravel()
    for axis, load in zip(panels, loads, strict=False):
        states = _states(load)
        for state, colour, label in zip(
            (states[0], states[-1]), (BLUE, ORANGE), ("unworn", "worn"), strict=True
        ):
            axis.plot(*_loop(state["loop"]), color=colour, label=f"{label}, by Masing's rule")
        axis.plot(
            *_loop(load["coupled_cycle"]),
            ".",
            color=BLACK,
            markersize=4,
            label="unworn, coupled and marched",
        )
        axis.set_title(_force(load))
        axis.set_xlabel("motion of the ring [µm]")
        axis.set_ylabel("force [N]")
    for axis in panels[len(loads) :]:
        axis.set_visible(False)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def _loop(group: h5py.Group) -> tuple[Array, Array]:
    return MICRO * group["ring_displacement"][()], group["ring_force"][()]


def _loops_title(loads: list[h5py.Group]) -> str:
    slopes = [
        [float(_states(load)[place]["secant_stiffness"][()]) / MICRO for load in loads]
        for place in (0, -1)
    ]
    unworn, worn = (_range(values) for values in slopes)
    return f"Slope to half the largest force: unworn {unworn}, worn {worn} N/µm"


def _range(values: list[float]) -> str:
    """Smallest and largest in three digits, once where they are the same."""
    low, high = (f"{value:.3g}" for value in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"


# --- kinetics -----------------------------------------------------------------------------------


def kinetics(file: h5py.File) -> Figure:
    """Stiffness over cycles and over energy, area and evenness of pressure over cycles."""
    loads = _loads(file)
    figure = new_figure(_kinetics_title(loads), 9.0)
    panels = figure.subplots(2, 2)
    (over_cycles, over_energy), (areas, pressures) = panels
    for load, colour in zip(loads, COLOURS, strict=False):
        history = load["kinetics"]
        cycles, energy = history["cycles"][1:], 1e-3 * history["energy"][1:]
        stiffness = history["stick_stiffness"][1:] / MICRO
        kept = _states(load)[1:]
        slopes = [float(state["secant_stiffness"][()]) / MICRO for state in kept]
        look: dict[str, Any] = {"color": colour}
        for axis, places, name in (
            (over_cycles, cycles, "cycles"),
            (over_energy, energy, "energy"),
        ):
            axis.plot(places, stiffness, **look)
            scale = 1.0 if name == "cycles" else 1e-3
            axis.plot(
                [scale * state.attrs[name] for state in kept],
                slopes,
                "o--",
                markersize=4,
                linewidth=1.0,
                **look,
            )
        areas.plot(cycles, history["area"][1:], label=_force(load), **look)
        pressures.plot(cycles, 100.0 * history["pressure_deviation"][1:], **look)
    _label_kinetics(panels)
    return figure


def _kinetics_title(loads: list[h5py.Group]) -> str:
    values = [load["kinetics/stick_stiffness"][()] / MICRO for load in loads]
    stuck = [[float(stiffness[place]) for stiffness in values] for place in (0, -1)]
    unworn, worn = map(_range, stuck)
    return f"Stiffness of the stuck pair: unworn {unworn}, worn {worn} N/µm"


def _label_kinetics(panels: Any) -> None:
    (over_cycles, over_energy), (areas, pressures) = panels
    for axis in panels.ravel():
        axis.set_xscale("log")
        axis.set_xlabel("cycles")
    for axis in (areas, pressures):
        axis.set_ylim(bottom=0.0)
    over_energy.set_xlabel("energy dissipated so far [J]")
    over_cycles.set_title("stiffness: all stuck (lines), slope of the loop (dots)")
    over_energy.set_title("the same over the energy")
    areas.set_title("area in contact")
    pressures.set_title("unevenness of the pressure")
    for axis in (over_cycles, over_energy):
        axis.set_ylabel("tangential stiffness [N/µm]")
    areas.set_ylabel("area [mm²]")
    pressures.set_ylabel("rms of p/mean - 1 [%]")
    areas.legend(loc="lower right")


# --- the half-space -----------------------------------------------------------------------------


def half_space(file: h5py.File) -> Figure:
    """Pressure and shear along x through the middle of the pad, reduced model and half-space."""
    load = _loads(file)[0]
    states = _states(load)
    figure = new_figure(f"Reduced specimens and half-space at {_force(load)}", 8.0)
    rows = figure.subplots(2, 2, sharex=True)
    for column, (state, shape) in enumerate(zip((states[0], states[-1]), SHAPES, strict=True)):
        beside = load["half_space"][shape]
        for axis, name in zip(rows[:, column], ("pressure", "shear_x"), strict=True):
            _draw_profile(axis, file, state, beside, name)
        rows[0, column].set_title(f"{shape}: pressure at y = 0")
        rows[1, column].set_title(f"{shape}: shear along x against the motion")
        rows[1, column].set_xlabel("x [mm]")
    rows[0, 0].set_ylabel("pressure [MPa]")
    rows[1, 0].set_ylabel("shear [MPa]")
    rows[0, 0].legend(loc="best")
    return figure


def _draw_profile(
    axis: Axes, file: h5py.File, state: h5py.Group, beside: h5py.Group, name: str
) -> None:
    """Cells next to y = 0 of the half-space, nodes on it of the reduced model."""
    (grid,) = (grid_of(group) for group in file["grid"].values())
    place = file["specimens/pad/coordinates"][()]
    row = near_middle(place, 0)
    order = np.argsort(place[row, 0])
    nodal = np.abs(state[name][()])[row][order]
    cells = np.abs(middle(beside[name][()], 0))
    axis.plot(centres(grid, 0), cells, color=BLUE, label="half-space, cells")
    axis.plot(place[row, 0][order], nodal, "o", color=ORANGE, label="reduced model, nodes")
    axis.set_ylim(bottom=0.0)
