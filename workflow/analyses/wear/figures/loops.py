"""Figure of the tangential loops on worn contacts, and of what they give for joint laws."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from sa_solver.types import Array
from workflow.pictures.fields import line_contacts, spread
from workflow.pictures.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# More loops than this in a panel overlap.
MOST_LOOPS = 6
CYCLE_COLOURS = "viridis"
COLOURS = (BLUE, ORANGE, GREEN, PURPLE, BLACK)
# Of the panels that begin at 0, over the largest value.
HEADROOM = 1.1
MICRO = 1e3  # mm to µm; its inverse N/mm to N/µm


def loops(file: h5py.File) -> Figure:
    """Loops at several numbers of cycles, above stiffness and energy over cumulative energy."""
    groups = file["loops"]
    count = len(groups)
    figure = new_figure(_title(groups, _per(file)), 9.0)
    top, bottom = figure.subfigures(2, 1, squeeze=False, height_ratios=(1.1, 1.0))[:, 0]
    upper = top.subplots(1, count, sharey=True, squeeze=False)[0]
    for axis, (name, group) in zip(upper, groups.items(), strict=True):
        _draw_loops(axis, group)
        axis.set_title(name)
        axis.set_xlabel("displacement [µm]")
    upper[0].set_ylabel(f"force [N{_per(file)}]")
    _draw_evolution(bottom, groups, _per(file))
    return figure


def _draw_loops(axis: Axes, group: h5py.Group) -> None:
    """First loading thin, then the loop; one colour per number of cycles."""
    from matplotlib import colormaps

    chosen = spread(sorted(group), MOST_LOOPS)
    for number, jump in enumerate(chosen):
        loop = group[jump]
        colour = colormaps[CYCLE_COLOURS](0.9 * number / max(len(chosen) - 1, 1))
        cycles = float(loop.attrs["cycles"])
        label = f"{cycles:,.0f} cycles" if cycles else "unworn"
        displacement, force = MICRO * loop["displacement"][()], loop["force"][()]
        axis.plot(displacement, force, color=colour, label=label)
    axis.legend(loc="best")


def _draw_evolution(figure: Any, groups: h5py.Group, per: str) -> None:
    """Stiffness and energy per loop over the energy that wear has dissipated."""
    stiffness, energy = figure.subplots(1, 2)
    for number, (name, group) in enumerate(groups.items()):
        colour = COLOURS[number % len(COLOURS)]
        worn = 1e-3 * _column(group, "energy")
        # Interfaces under one load are alike: the last must not hide the first.
        size = 8.0 - 4.0 * number / len(groups)
        look: dict[str, Any] = {"color": colour, "marker": "o", "mfc": "none", "label": name}
        stiffness.plot(worn, _column(group, "kt") / MICRO, markersize=size, **look)
        energy.plot(worn, _column(group, "energy_per_loop"), markersize=size, **look)
    for axis in (stiffness, energy):
        axis.set_xlabel(f"energy dissipated so far [J{per}]")
        axis.set_ylim(0.0, HEADROOM * axis.dataLim.y1)
    stiffness.set_title("stiffness of the stuck contact")
    stiffness.set_ylabel(f"kt [N/µm{per}]")
    energy.set_title("energy per loop")
    energy.set_ylabel(f"energy [mJ{per}]")
    stiffness.legend(loc="best")


def _column(group: h5py.Group, name: str) -> Array:
    """A value of every loop of an interface, in the order of the jumps."""
    return np.array([float(group[jump].attrs[name]) for jump in sorted(group)])


def _title(groups: h5py.Group, per: str) -> str:
    texts = []
    for name, group in groups.items():
        first, last = _column(group, "kt")[[0, -1]] / MICRO
        texts.append(f"{name} {first:.4g} → {last:.4g}")
    return f"Tangential stiffness: {', '.join(texts)} N/µm{per}"


def _per(file: h5py.File) -> str:
    """What units of forces and energies end in."""
    return "/mm" if line_contacts(file) else ""


LOOP_FIGURES = {"loops": (loops, ("loops",))}
