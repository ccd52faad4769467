"""Figures of the stress under the contacts: sections at peak load, and the fretting parameter."""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import AbstractPathEffect, withStroke
from matplotlib.ticker import MaxNLocator

from sa_solver.types import Array, Grid
from workflow.analyses.wear.layout import MOMENTS, Contents
from workflow.pictures.fields import centres, draw_map, map_top
from workflow.pictures.panels import changes, new_figure
from workflow.pictures.scales import TO_MICRONS
from workflow.pictures.style import BLACK, BLUE, FONT_SIZE, ORANGE
from workflow.shell.results import grid_of

COLOURS = "magma_r"
LEVELS = 24
# Name of what a map shows, its symbol and unit, by the parameter of the case.
PARAMETERS = {
    "ruiz": ("cracking_parameter", "Ruiz's F2", "N²/mm³"),
    "smith_watson_topper": ("smith_watson_topper", "SWT parameter", "MPa"),
    "findley": ("findley", "Findley's parameter", "MPa"),
}


# --- sections -----------------------------------------------------------------------------------


def subsurface_stress(file: h5py.File, contents: Contents) -> Figure:
    """Von Mises stress in the section of every contact at peak load, unworn above worn."""
    sections = file["stress/section"]
    # By moment, both bodies together.
    fields = {name: _values(group, "von_mises").swapaxes(0, 1) for name, group in sections.items()}
    # Outside a body stress is not a number.
    largest = {name: np.nanmax(field, axis=(1, 2, 3)) for name, field in fields.items()}
    top = float(max(moments.max() for moments in largest.values()))
    title = f"Von Mises stress under the contact at peak load: {changes(largest, '.0f', ' MPa')}"
    figure = new_figure(title, 9.0)
    axes = figure.subplots(2, len(sections), sharex="col", sharey=True, squeeze=False)
    for column, (name, group) in zip(axes.T, sections.items(), strict=True):
        for axis, moment, field in zip(column, MOMENTS, fields[name], strict=True):
            colours = _draw_section(axis, group, field, top)
            _draw_yield(axis, group, field)
            axis.set_title(f"{name}, {moment}: at most {np.nanmax(field):.0f} MPa")
        along = str(group.attrs["axis"])
        other = "x" if along == "y" else "y"
        column[-1].set_xlabel(f"{along} [mm], at {other} = {group.attrs['at']:.3g} mm")
    lower, upper = contents.bodies
    for axis in axes[:, 0]:
        axis.set_ylabel(f"z [mm]: {lower} below, {upper} above")
    whole = all(group.attrs["bulk_stress"] for group in sections.values())
    label = f"von Mises stress{'' if whole else ' of the contact alone'} [MPa]"
    figure.colorbar(colours, ax=axes, label=label, shrink=0.8, pad=0.01)
    return figure


def _values(group: h5py.Group, field: str) -> Array:
    """A field of both bodies, unworn and worn, ``(2, 2, ...)``."""
    return np.array(
        [[group[f"{moment}/body_{body}/{field}"][()] for moment in MOMENTS] for body in (1, 2)]
    )


def _heights(group: h5py.Group, body: int) -> Array:
    """Heights of a section's points in the interface frame [mm]."""
    return (-1.0 if body == 1 else 1.0) * group["depths"][()]


def _draw_section(axis: Axes, group: h5py.Group, field: Array, top: float) -> Any:
    """Body 1 below and body 2 above the surface, on one colour scale; returns the colours."""
    axis.grid(visible=False)
    for body, values in zip((1, 2), field, strict=True):
        colours = axis.contourf(
            group["along"][()],
            _heights(group, body),
            values.T,
            levels=MaxNLocator(LEVELS).tick_values(0.0, max(top, 1.0)),
            cmap=COLOURS,
        )
    axis.axhline(0.0, color=BLACK, lw=0.8)
    return colours


def _draw_yield(axis: Axes, group: h5py.Group, field: Array) -> None:
    """Where a body with a yield stress would yield."""
    halo: list[AbstractPathEffect] = [withStroke(linewidth=3.0, foreground="white")]
    for body, values in zip((1, 2), field, strict=True):
        limit = group.attrs.get(f"yield_stress_{body}", np.inf)
        if np.nanmax(values) > limit:
            place = group["along"][()], _heights(group, body)
            lines = axis.contour(*place, values.T, levels=[limit], colors=BLUE, linewidths=1.5)
            lines.set_path_effects(halo)
            for label in axis.clabel(lines, fmt=f"yields at {limit:.0f} MPa"):
                label.set_path_effects(halo)


# --- fretting parameter -------------------------------------------------------------------------


def fretting_life(file: h5py.File, contents: Contents) -> Figure:
    """The fretting parameter over every contact, both bodies, unworn beside worn."""
    groups = {name: file["stress/life"][name] for name in contents.life}
    grids = [grid_of(file["grid"][name]) for name in groups]
    life = groups[contents.life[0]].attrs
    parameter, symbol, unit = PARAMETERS[life["parameter"]]
    fields = {name: _values(group, parameter) for name, group in groups.items()}
    largest = changes({name: field.max(axis=(0, 2, 3)) for name, field in fields.items()}, ".3g")
    depth = TO_MICRONS * float(life["depth"])
    title = f"{symbol} [{unit}] {depth:.3g} µm below the surface: {largest}"
    label = f"{symbol}{'' if life['bulk_stress'] else ' of the contact alone'} [{unit}]"
    draw = _curves if contents.line else _maps
    return draw(title, label, fields, grids, contents.bodies)


def _maps(
    title: str, label: str, fields: dict[str, Array], grids: list[Grid], bodies: tuple[str, str]
) -> Figure:
    top = map_top([field.ravel() for field in fields.values()])
    figure = new_figure(title, 1.0 + 2.8 * len(fields))
    axes = figure.subplots(2 * len(fields), 2, sharex=True, sharey=True, squeeze=False)
    rows = [
        (name, body, grid, moments)
        for (name, of_bodies), grid in zip(fields.items(), grids, strict=True)
        for body, moments in zip(bodies, of_bodies, strict=True)
    ]
    for line, (name, body, grid, moments) in zip(axes, rows, strict=True):
        for axis, moment, field in zip(line, MOMENTS, moments, strict=True):
            image = draw_map(axis, field, grid, top)
            axis.set_title(f"{name}, {body}, {moment}: at most {field.max():.3g}")
    for axis in axes[-1]:
        axis.set_xlabel("y [mm]")
    figure.supylabel("x [mm]", fontsize=FONT_SIZE)
    figure.colorbar(image, ax=axes, label=f"{label}; white: 0", extend="max", shrink=0.8, pad=0.01)
    return figure


def _curves(
    title: str, label: str, fields: dict[str, Array], grids: list[Grid], bodies: tuple[str, str]
) -> Figure:
    """Line contacts: the parameter over x."""
    figure = new_figure(title, 9.0)
    axes = figure.subplots(2, len(grids), sharex=True, sharey=True, squeeze=False)
    for column, (name, of_bodies), grid in zip(axes.T, fields.items(), grids, strict=True):
        for axis, body, moments in zip(column, bodies, of_bodies, strict=True):
            for moment, field, colour in zip(MOMENTS, moments, (BLUE, ORANGE), strict=True):
                look = {"color": colour, "label": f"{moment}: at most {field.max():.3g}"}
                axis.plot(centres(grid, 0), field[:, 0], **look)
            axis.set_title(f"{name}, {body}")
            axis.legend(loc="upper center")
        column[-1].set_xlabel("x [mm]")
    for axis in axes[:, 0]:
        axis.set_ylabel(label)
    return figure
