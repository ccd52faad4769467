"""Figure of a wear run by method full: friction of the half-space and of the structure."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sa_solver.types import Array
from workflow.analyses.wear.output.layout import WearContents
from workflow.case.text.readable import percent
from workflow.pictures.fields import PROFILE_MARGIN, centres, middle, near_middle, view_of
from workflow.pictures.panels import (
    blocks,
    force_unit,
    label_rows,
    legend_below,
    new_figure,
    panel_rows,
    whole_ticks,
)
from workflow.pictures.scales import TO_MICRONS
from workflow.pictures.style import BLACK, BLUE, GREEN, ORANGE
from workflow.shell.output.results import grid_of

COLOURS = BLUE, ORANGE, GREEN
FIELDS = (
    ("pressure", "pressure [MPa]", 1.0),
    ("shear", "shear qx [MPa]", 1.0),
    ("slip", "slip along x [µm]", TO_MICRONS),
)
LOADS = {"Qx": "tangential\nforce Qx", "Mz": "moment Mz"}
# Moments below this share of P times the face's length are not shown.
NOTHING = 1e-4


def half_space_and_structure(file: h5py.File, contents: WearContents) -> Figure:
    """Draw Qx and Mz by increment, then p, qx and slip along x in some increments."""
    names, place = contents.names, "" if contents.line else " at y = 0"
    loads = _shown_loads(file, contents)
    rows = len(loads) + len(FIELDS)
    figure = new_figure(_largest_difference(file, contents), 3.0 * rows * blocks(len(names)))
    axes = panel_rows(figure, rows, len(names), sharex="row")
    for column, interface in zip(axes.T, names, strict=True):
        for axis, (name, scale, _) in zip(column, loads, strict=False):
            _draw_loads(axis, file, contents, interface, name, scale)
        for axis, (name, _, scale) in zip(column[len(loads) :], FIELDS, strict=True):
            _draw_profiles(axis, file, contents, interface, name, scale)
        column[0].set_title(f"{interface}: resultants of the unworn cycle")
        crosses = f"; crosses: {contents.loads}" if contents.structure else ""
        column[len(loads)].set_title(f"{interface}: along x{place}{crosses}")
    _cut(axes[len(loads) :, 0], file, contents)
    labels = [f"{LOADS[name]} [{unit}{contents.per}]" for name, _, unit in loads]
    label_rows(axes, labels + [label for _, label, _ in FIELDS])
    legend_below(figure, [*axes[0], axes[len(loads), 0]], columns=3)
    return figure


def _cut(axes: Iterable[Axes], file: h5py.File, contents: WearContents) -> None:
    """Limit the axes to the contact and a margin."""
    views = [
        view_of(
            [field["pressure"][()] for field in _compared(file, name).values()],
            grid_of(file["grid"][name]),
            PROFILE_MARGIN,
        )
        for name in contents.names
    ]
    for axis in axes:
        axis.set_xlim(min(view.x[0] for view in views), max(view.x[1] for view in views))


def _compared(file: h5py.File, interface: str) -> dict[str, h5py.Group]:
    """Return the half-space's fields, by increment."""
    groups = file["comparison"][interface]
    return {key: group for key, group in groups.items() if key != "load_history"}


def _shown_loads(file: h5py.File, contents: WearContents) -> list[tuple[str, float, str]]:
    """Return name, scale and unit of the resultants that are not negligible."""
    histories = [
        file[f"{group}/{name}/load_history"]
        for group in ("structure", "comparison")
        for name in contents.names
    ]
    force, moment = (
        max(float(np.abs(history[key][()]).max()) for history in histories) for key in ("P", "Mz")
    )
    arm = max(max(grid_of(file["grid"][name]).size) for name in contents.names)
    scale, unit = force_unit(force)
    return [
        ("Qx", scale, unit),
        # A line contact has no Mz.
        *([("Mz", 1e-3, "N m")] if moment > NOTHING * force * arm and not contents.line else []),
    ]


def _draw_loads(
    axis: Axes, file: h5py.File, contents: WearContents, interface: str, name: str, scale: float
) -> None:
    structure = file[f"structure/{interface}/load_history"]
    half_space = file[f"comparison/{interface}/load_history"]
    increments = np.arange(1, len(structure["P"]) + 1)
    sliding = half_space["sliding"][()].astype(bool)
    axis.plot(increments, scale * structure[name][()], "-", color=BLACK, label=contents.loads)
    values = scale * half_space[name][()]
    for mask, fill, text in (
        (~sliding, "white", "half-space, force imposed"),
        (sliding, ORANGE, "half-space, sliding: energy imposed"),
    ):
        if mask.any():
            look: dict[str, Any] = {"color": ORANGE, "mfc": fill, "ms": 6, "label": text}
            axis.plot(increments[mask], values[mask], "D", **look)
    axis.set_xlabel("increment")
    whole_ticks(axis.xaxis)


def _draw_profiles(
    axis: Axes, file: h5py.File, contents: WearContents, interface: str, name: str, scale: float
) -> None:
    grid, compared = grid_of(file["grid"][interface]), _compared(file, interface)
    for (key, group), colour in zip(compared.items(), COLOURS, strict=False):
        field = group[name][()]
        along = field if field.ndim == 2 else field[0]
        label = f"increment {int(key) + 1}"
        axis.plot(centres(grid, 0), scale * middle(along, 0), color=colour, label=label)
        # Loads of another code may be resultants alone, without tractions or slip.
        if contents.structure:
            place, values = nodes_on_middle(file["structure"][interface], name, int(key))
            axis.plot(place, scale * values, "x", color=colour, mew=2)
    axis.set_xlabel("x [mm]")


def nodes_on_middle(
    face: h5py.Group, name: str, increment: int, direction: int = 0
) -> tuple[Array, Array]:
    """Return places and values of a field (x component) at the nodes nearest to a middle line."""
    coordinates, field = face["coordinates"][()], face[name][increment]
    near = near_middle(coordinates, direction)
    return coordinates[near, direction], (field if field.ndim == 1 else field[0])[near]


def _largest_difference(file: h5py.File, contents: WearContents) -> str:
    """Return the title: the largest difference of Q between half-space and structure."""
    largest = 0.0
    for interface in file["comparison"]:
        structure = file[f"structure/{interface}/load_history"]
        half_space = file[f"comparison/{interface}/load_history"]
        friction = float(file[f"structure/{interface}"].attrs["friction"])
        limit = friction * structure["P"][()]
        gap = np.hypot(
            half_space["Qx"][()] - structure["Qx"][()], half_space["Qy"][()] - structure["Qy"][()]
        )
        largest = max(largest, float((gap[limit > 0.0] / limit[limit > 0.0]).max(initial=0.0)))
    text = percent(largest)
    by = f"less than {text.lstrip('< ')}" if text.startswith("<") else f"up to {text}"
    return f"Tangential forces on the half-space differ by {by} of µP from {contents.loads}"
