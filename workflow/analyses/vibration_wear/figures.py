"""Figures of a vibration case with wear: responses as wear grows, what changes, and the scar."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from sa_solver.types import Array, Indices
from workflow.analyses.vibration.pad_nodes import rows_and_columns
from workflow.analyses.vibration_wear.outcome import (
    CONTACT,
    EVOLUTION,
    HALF_SPACE,
    LOOP,
    NODES,
    PLACES,
    RESPONSES,
    WORN,
)
from workflow.pictures.fields import spread
from workflow.pictures.style import BLUE, GREEN, ORANGE, PURPLE, new_figure
from workflow.shell.results import grid_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# More curves, or panels, than this overlap.
MOST_STATES, MOST_FORCES = 6, 3
STATE_COLOURS = "viridis"
# mm to µm, N/mm to N/µm, N mm to J.
TO_MICRONS, PER_MICRON, TO_JOULES = 1e3, 1e-3, 1e-3
# Where the unworn contact stands on an axis of logarithms: so far before the first worn one.
BEFORE = 0.1
# What is shown along the pad: of these datasets, the latter two per area of each node.
PROFILE = {
    "gap": "gap without load [µm]",
    "normal_force": "pressure at rest [MPa]",
    "energy": "energy per cycle\nand area [mJ/mm²]",
}
FORCE_COLOURS = (BLUE, ORANGE, GREEN, PURPLE)


def figures_of(file: h5py.File) -> dict[str, Callable[[h5py.File], Figure]]:
    """The figures, by name."""
    at_nodes = PLACES in file
    return {
        "frequency_response": frequency_response,
        "evolution": evolution,
        **({"profile": profile} if at_nodes else {"scar": scar}),
        "loops": loops,
    }


def frequency_response(file: h5py.File) -> Figure:
    """Amplitude of the last mass over the force, a panel per force, a curve per state."""
    forces = list(file.attrs["forces"])
    shown = _some(len(forces), MOST_FORCES)
    figure = new_figure(_title(file), 4.0 * len(shown) + 0.5)
    panels = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
    for axis, place in zip(panels, shown, strict=True):
        for state, colour in _states(file):
            response = state[f"{RESPONSES}/{place:05d}"]
            receptance = TO_MICRONS * response["amplitude"][:, -1] / forces[place]
            label = f"{_cycles(state)}: {response.attrs['resonance']:.4g} Hz"
            axis.plot(response["frequency"][()], receptance, color=colour, label=label)
        axis.set_yscale("log")
        axis.set_title(f"{forces[place]:g} N")
        axis.set_ylabel("amplitude / force [µm/N]")
        axis.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), title="resonance")
    panels[-1].set_xscale("log")
    for setting in (panels[-1].xaxis.set_major_formatter, panels[-1].xaxis.set_minor_formatter):
        setting("{x:g}")
    panels[-1].set_xlabel("frequency [Hz]")
    return figure


def evolution(file: h5py.File) -> Figure:
    """Stiffness, resonances, motion and scar against cycles; the unworn contact at the left."""
    history, forces = file[EVOLUTION], list(file.attrs["forces"])
    cycles = history["cycles"][()]
    place = np.append(BEFORE * cycles[1], cycles[1:])
    figure = new_figure(_title(file), 9.0)
    (stiffness, frequency), (motion, depth) = figure.subplots(2, 2, sharex=True)
    stiffness.plot(place, PER_MICRON * history["stiffness"][()], "o-", color=BLUE)
    stiffness.set_ylabel("stiffness kt while the contact sticks [N/µm]")
    frequency.plot(place, history["stuck"][:, 0], "k--", label="stuck")
    for column, colour in zip(_some(len(forces), len(FORCE_COLOURS)), FORCE_COLOURS, strict=False):
        label = f"{forces[column]:g} N"
        frequency.plot(place, history["resonance"][:, column], "o-", color=colour, label=label)
    frequency.set_ylabel("resonance [Hz]")
    frequency.legend()
    _two(
        motion,
        place,
        (TO_MICRONS * history["stroke"][()], "stroke under the force that wears [µm]"),
        (history["energy_per_cycle"][()], "energy per cycle [mJ]"),
    )
    touching = ("area", "area in contact [mm²]")
    if "touching" in history:
        touching = ("touching", "nodes in contact")
    _two(
        depth,
        place,
        (TO_MICRONS * history["depth"][()], "largest worn depth [µm]"),
        (history[touching[0]][()], touching[1]),
    )
    for axis in (motion, depth):
        axis.set_xscale("log")
        axis.set_xlabel(f"cycles (unworn at {place[0]:.3g})")
    return figure


def scar(file: h5py.File) -> Figure:
    """Worn depth, pressure at rest and energy of a cycle, across the middle along x."""
    grid = grid_of(file["grid"])
    middle, along = grid.shape[1] // 2, grid.x[:, 0]
    figure = new_figure(_title(file), 9.0)
    depth, pressure, energy = figure.subplots(3, 1, sharex=True)
    for state, colour in _states(file):
        contact, label = state[CONTACT], _cycles(state)
        worn = TO_MICRONS * (contact["depth_1"][:, middle] + contact["depth_2"][:, middle])
        depth.plot(along, worn, color=colour, label=label)
        pressure.plot(along, contact["pressure"][:, middle], color=colour)
        energy.plot(along, contact["energy"][:, middle], color=colour)
    depth.invert_yaxis()
    depth.set_ylabel("worn depth [µm]")
    depth.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), title="cycles")
    pressure.set_ylabel("pressure [MPa]")
    energy.set_ylabel("energy per cycle\nand area [mJ/mm²]")
    energy.set_xlabel("x [mm]")
    return figure


def profile(file: h5py.File) -> Figure:
    """Gap, pressure at rest and energy of a cycle of nodes along the pad's middle and diagonal."""
    places = {name: file[PLACES][name][()] for name in ("x", "y", "area")}
    sections = _sections(places["x"], places["y"])
    figure = new_figure(_title(file), 9.0)
    panels = figure.subplots(3, len(sections), sharex="col", sharey="row", squeeze=False)
    for (along, nodes, label), column in zip(sections, panels.T, strict=True):
        for state, colour in _states(file):
            area = places["area"][nodes]
            gap, force, energy = (state[NODES][n][()][nodes] for n in PROFILE)
            for axis, values in zip(
                column, (TO_MICRONS * gap, force / area, energy / area), strict=True
            ):
                axis.plot(along, values, ".-", color=colour, label=_cycles(state))
        column[-1].set_xlabel(label)
    for axis, label in zip(panels[:, 0], PROFILE.values(), strict=True):
        axis.set_ylabel(label)
    panels[0, -1].legend(loc="center left", bbox_to_anchor=(1.0, 0.5), title="cycles")
    return figure


def _sections(x: Array, y: Array) -> list[tuple[Array, Indices, str]]:
    """Lines of nodes: places along each, numbers of its nodes, and what it is.

    Where nodes are not in rows and columns, all of them over their distance from the middle.
    """
    numbers = rows_and_columns(x, y)
    if numbers is None:
        distance = np.hypot(x, y)
        order = np.argsort(distance, kind="stable")
        return [(distance[order], order, "distance from the middle [mm]")]
    middle, diagonal = numbers[:, numbers.shape[1] // 2], numbers.diagonal()
    across = np.hypot(x[diagonal], y[diagonal]) * np.sign(x[diagonal])
    return [(x[middle], middle, "x [mm]"), (across, diagonal, "along the diagonal [mm]")]


def loops(file: h5py.File) -> Figure:
    """Loops under the force that wears; of a half-space also that of the tangential problem."""
    figure = new_figure(_title(file), 7.0)
    axis: Any = figure.subplots()
    for state, colour in _states(file):
        loop = state[LOOP]
        label = f"{_cycles(state)}: {state.attrs['energy_per_cycle']:.4g} mJ"
        axis.plot(
            TO_MICRONS * loop["displacement"][()], loop["force"][()], color=colour, label=label
        )
        if HALF_SPACE not in state:
            continue
        half_space = state[HALF_SPACE]
        moved = TO_MICRONS * half_space["displacement"][()]
        axis.plot(moved, half_space["force"][()], "o", color=colour, markersize=3)
    between = "between the targets" if PLACES in file else "of the joint"
    axis.set_xlabel(f"displacement {between} [µm]")
    points = "" if PLACES in file else "; points: whole tangential problem"
    axis.set_ylabel(f"force [N]{points}")
    axis.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), title="cycles, energy")
    return figure


def _two(axis: Axes, place: Array, first: tuple[Array, str], second: tuple[Array, str]) -> None:
    """Two curves on one panel, each on its own scale."""
    right = axis.twinx()
    for side, (values, label), colour in ((axis, first, BLUE), (right, second, ORANGE)):
        side.plot(place, values, "o-", color=colour)
        side.set_ylabel(label, color=colour)
    right.grid(visible=False)


def _states(file: h5py.File) -> list[tuple[h5py.Group, Any]]:
    """The states that are shown, each with its colour."""
    from matplotlib import colormaps

    names = spread(sorted(file[WORN]), MOST_STATES)
    shades = np.linspace(0.0, 0.9, len(names))
    colours = [colormaps[STATE_COLOURS](shade) for shade in shades]
    return [(file[WORN][name], colour) for name, colour in zip(names, colours, strict=True)]


def _some(count: int, most: int) -> list[int]:
    """At most so many places of ``count``, evenly spread, first and last among them."""
    return [round(place) for place in np.linspace(0, count - 1, min(most, count))]


def _cycles(state: h5py.Group) -> str:
    cycles = float(state.attrs["cycles"])
    return f"{cycles:g}" if cycles > 0.0 else "unworn"


def _title(file: h5py.File) -> str:
    history = file[EVOLUTION]
    stiffness, stuck = PER_MICRON * history["stiffness"][()], history["stuck"][:, 0]
    return (
        f"kt {stiffness[0]:.4g} to {stiffness[-1]:.4g} N/µm and stuck {stuck[0]:.4g} to "
        f"{stuck[-1]:.4g} Hz after {TO_JOULES * history['energy'][-1]:.4g} J"
    )
