"""Figure of a wear run by method full: friction by the half-space against the structure's."""

from __future__ import annotations

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sa_solver.types import Array
from workflow.analyses.wear.layout import Contents
from workflow.pictures.fields import centres, middle, near_middle
from workflow.pictures.panels import new_figure
from workflow.pictures.scales import TO_MICRONS
from workflow.pictures.style import BLACK, BLUE, GREEN, ORANGE
from workflow.shell.results import grid_of

COLOURS = BLUE, ORANGE, GREEN
# Resultants shown, with the unit of a thousand; a line contact has no Mz.
LOADS = ("Qx", "kN"), ("Mz", "N m")
PRESSURE, SHEAR = ("pressure", "p [MPa]", 1.0), ("shear", "qx [MPa]", 1.0)
FIELDS = PRESSURE, SHEAR, ("slip", "slip x [µm]", TO_MICRONS)


def half_space_and_structure(file: h5py.File, contents: Contents) -> Figure:
    """Qx and Mz by increment, then p, qx and slip along x at some of them."""
    names, place = contents.names, "" if contents.line else " at y = 0"
    loads = LOADS[:1] if contents.line else LOADS
    rows = len(loads) + len(FIELDS)
    figure = new_figure(_largest_difference(file), 3.2 * rows)
    axes = figure.subplots(rows, len(names), sharey="row", squeeze=False)
    for column, interface in zip(axes.T, names, strict=True):
        for axis, (name, _) in zip(column, loads, strict=False):
            _draw_loads(axis, file, interface, name)
        for axis, (name, _, scale) in zip(column[len(loads) :], FIELDS, strict=True):
            _draw_profiles(axis, file, contents, interface, name, scale)
        column[0].set_title(f"{interface}: resultants of the unworn cycle")
        column[len(loads)].set_title(f"{interface}: along x{place}; crosses: finite elements")
    labels = [f"{name} [{unit}{contents.per}]" for name, unit in loads]
    for axis, label in zip(axes[:, 0], labels + [label for _, label, _ in FIELDS], strict=True):
        axis.set_ylabel(label)
    axes[0, 0].legend(loc="lower right")
    axes[len(loads), 0].legend(loc="upper center")
    return figure


def _draw_loads(axis: Axes, file: h5py.File, interface: str, name: str) -> None:
    structure = file[f"structure/{interface}/load_history"]
    half_space = file[f"comparison/{interface}/load_history"]
    increments = np.arange(1, len(structure["P"]) + 1)
    sliding = half_space["sliding"][()].astype(bool)
    axis.plot(increments, structure[name][()] / 1e3, "-", color=BLACK, label="finite elements")
    values = half_space[name][()] / 1e3
    for mask, fill, text in (
        (~sliding, "white", "half-space, force imposed"),
        (sliding, ORANGE, "half-space, sliding: energy imposed"),
    ):
        axis.plot(increments[mask], values[mask], "D", color=ORANGE, mfc=fill, ms=6, label=text)
    axis.set_xlabel("increment")


def _draw_profiles(
    axis: Axes, file: h5py.File, contents: Contents, interface: str, name: str, scale: float
) -> None:
    grid, compared = grid_of(file["grid"][interface]), file["comparison"][interface]
    shown = [key for key in compared if key != "load_history"]
    for key, colour in zip(shown, COLOURS, strict=False):
        field = compared[key][name][()]
        along = field if field.ndim == 2 else field[0]
        label = f"increment {int(key) + 1}"
        axis.plot(centres(grid, 0), scale * middle(along, 0), color=colour, label=label)
        # Loads of another code may be resultants alone, without tractions and of no slip.
        if contents.structure or (name == "slip" and file["structure"][interface][name][()].any()):
            place, values = nodes_on_middle(file["structure"][interface], name, int(key))
            axis.plot(place, scale * values, "x", color=colour, mew=2)
    axis.set_xlabel("x [mm]")


def nodes_on_middle(
    face: h5py.Group, name: str, increment: int, direction: int = 0
) -> tuple[Array, Array]:
    """Places and values of a field, or its x component, at the nodes nearest to a middle line."""
    coordinates, field = face["coordinates"][()], face[name][increment]
    near = near_middle(coordinates, direction)
    return coordinates[near, direction], (field if field.ndim == 1 else field[0])[near]


def _largest_difference(file: h5py.File) -> str:
    """How far the Q that follows from the energies is from the structure's."""
    largest = 0.0
    for interface in file["comparison"]:
        structure = file[f"structure/{interface}/load_history"]
        half_space = file[f"comparison/{interface}/load_history"]
        limit = float(file.attrs["friction"]) * structure["P"][()]
        gap = np.hypot(
            half_space["Qx"][()] - structure["Qx"][()], half_space["Qy"][()] - structure["Qy"][()]
        )
        largest = max(largest, float((gap[limit > 0.0] / limit[limit > 0.0]).max(initial=0.0)))
    return f"Half-space against finite elements: Q differs by at most {largest:.1%} of µP"
