"""Figures of the stress under the contacts: sections at peak load, and the fretting parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from sa_solver.types import Array, Grid
from workflow.analyses.wear.layout import body_names
from workflow.pictures.fields import centres, draw_map, map_top
from workflow.pictures.style import BLACK, BLUE, FONT_SIZE, ORANGE, new_figure
from workflow.shell.results import grid_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = "magma_r"
LEVELS = 24
MOMENTS = ("unworn", "worn")
# Name of what a map shows, its symbol and unit, by the parameter of the case.
PARAMETERS = {
    "ruiz": ("cracking_parameter", "Ruiz's F2", "N²/mm³"),
    "smith_watson_topper": ("smith_watson_topper", "SWT parameter", "MPa"),
    "findley": ("findley", "Findley's parameter", "MPa"),
}


# --- sections -----------------------------------------------------------------------------------


def subsurface_stress(file: h5py.File) -> Figure:
    """Von Mises stress in the section of every contact at peak load, unworn above worn."""
    sections = file["stress/section"]
    fields = {
        name: [_both_bodies(section, m) for m in MOMENTS] for name, section in sections.items()
    }
    top = max(float(field.max()) for moments in fields.values() for field in moments)
    figure = new_figure(f"Von Mises stress under the contact at peak load: {_ends(fields)}", 9.0)
    axes = figure.subplots(2, len(sections), sharex="col", sharey=True, squeeze=False)
    for column, (name, group) in zip(axes.T, sections.items(), strict=True):
        for axis, moment, field in zip(column, MOMENTS, fields[name], strict=True):
            colours = _draw_section(axis, group, field, top)
            _draw_yield(axis, group, field)
            axis.set_title(f"{name}, {moment}: at most {field.max():.0f} MPa")
        along = str(group.attrs["axis"])
        other = "x" if along == "y" else "y"
        column[-1].set_xlabel(f"{along} [mm], at {other} = {group.attrs['at']:.3g} mm")
    lower, upper = body_names(file).values()
    for axis in axes[:, 0]:
        axis.set_ylabel(f"z [mm]: {lower} below, {upper} above")
    label = "von Mises stress of the contact alone [MPa]"
    figure.colorbar(colours, ax=axes, label=label, shrink=0.8, pad=0.01)
    return figure


def _both_bodies(group: h5py.Group, moment: str) -> Array:
    """Von Mises stress ``(2, n, k)`` of body 1 and body 2 [MPa]."""
    return np.stack([group[f"{moment}/body_{body}/von_mises"][()] for body in (1, 2)])


def _ends(fields: dict[str, list[Array]]) -> str:
    """Largest stress of each contact, unworn and worn."""
    texts = (
        f"{name} " + " → ".join(f"{field.max():.0f}" for field in moments) + " MPa"
        for name, moments in fields.items()
    )
    return ", ".join(texts)


def _heights(group: h5py.Group, body: int) -> Array:
    """Heights of a section's points in the interface frame [mm]."""
    return (-1.0 if body == 1 else 1.0) * group["depths"][()]


def _draw_section(axis: Axes, group: h5py.Group, field: Array, top: float) -> Any:
    """Body 1 below and body 2 above the surface, on one colour scale; returns the colours."""
    from matplotlib.ticker import MaxNLocator

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
    from matplotlib.patheffects import AbstractPathEffect, withStroke

    halo: list[AbstractPathEffect] = [withStroke(linewidth=3.0, foreground="white")]
    for body, values in zip((1, 2), field, strict=True):
        limit = group.attrs.get(f"yield_stress_{body}", np.inf)
        if values.max() > limit:
            place = group["along"][()], _heights(group, body)
            lines = axis.contour(*place, values.T, levels=[limit], colors=BLUE, linewidths=1.5)
            lines.set_path_effects(halo)
            for label in axis.clabel(lines, fmt=f"yields at {limit:.0f} MPa"):
                label.set_path_effects(halo)


# --- fretting parameter -------------------------------------------------------------------------


def fretting_life(file: h5py.File) -> Figure:
    """The fretting parameter over every contact, both bodies, unworn beside worn."""
    grids = {name: grid_of(file["grid"][name]) for name in file["stress/life"]}
    draw = _curves if any(grid.line for grid in grids.values()) else _maps
    return draw(file, grids)


def _parameter(group: h5py.Group) -> tuple[str, str, str]:
    """Name in the file, name and unit of what is mapped."""
    return PARAMETERS[str(group.attrs["parameter"])]


def _values(group: h5py.Group, body: int) -> list[Array]:
    """The parameter of a body ``(nx, ny)``, unworn and worn."""
    return [group[f"{moment}/body_{body}/{_parameter(group)[0]}"][()] for moment in MOMENTS]


def _maps(file: h5py.File, grids: dict[str, Grid]) -> Figure:
    rows = [(name, body) for name in grids for body in (1, 2)]
    fields = [_values(file["stress/life"][name], body) for name, body in rows]
    top = map_top([field for moments in fields for field in moments])
    figure = new_figure(_title(file), 1.0 + 1.4 * len(rows))
    axes = figure.subplots(len(rows), 2, sharex=True, sharey=True, squeeze=False)
    for line, (name, body), moments in zip(axes, rows, fields, strict=True):
        for axis, moment, field in zip(line, MOMENTS, moments, strict=True):
            image = draw_map(axis, field, grids[name], top)
            body_name = body_names(file)[body]
            axis.set_title(f"{name}, {body_name}, {moment}: at most {field.max():.3g}")
    for axis in axes[-1]:
        axis.set_xlabel("y [mm]")
    figure.supylabel("x [mm]", fontsize=FONT_SIZE)
    _, symbol, unit = _parameter(file["stress/life"][rows[0][0]])
    figure.colorbar(
        image, ax=axes, label=f"{symbol} [{unit}]; white: 0", extend="max", shrink=0.8, pad=0.01
    )
    return figure


def _curves(file: h5py.File, grids: dict[str, Grid]) -> Figure:
    """Line contacts: the parameter over x."""
    figure = new_figure(_title(file), 9.0)
    axes = figure.subplots(2, len(grids), sharex=True, sharey=True, squeeze=False)
    for column, (name, grid) in zip(axes.T, grids.items(), strict=True):
        group = file["stress/life"][name]
        for axis, body in zip(column, (1, 2), strict=True):
            curves = zip(MOMENTS, _values(group, body), (BLUE, ORANGE), strict=True)
            for moment, field, colour in curves:
                label = f"{moment}: at most {field.max():.3g}"
                axis.plot(centres(grid, 0), field[:, 0], color=colour, label=label)
            axis.set_title(f"{name}, {body_names(file)[body]}")
            axis.legend(loc="upper center")
        column[-1].set_xlabel("x [mm]")
    _, symbol, unit = _parameter(group)
    for axis in axes[:, 0]:
        axis.set_ylabel(f"{symbol} [{unit}]")
    return figure


def _title(file: h5py.File) -> str:
    """What is mapped and what wear made of its largest value."""
    texts = []
    for name, group in file["stress/life"].items():
        bodies = np.array([_values(group, body) for body in (1, 2)])
        before, after = bodies.max(axis=(0, 2, 3))
        texts.append(f"{name} {before:.3g} → {after:.3g}")
    _, symbol, unit = _parameter(group)
    depth = 1e3 * float(group.attrs["depth"])
    return f"{symbol} [{unit}] {depth:.3g} µm below the surface: {', '.join(texts)}"


# What each figure is called, and the groups it needs.
STRESS_FIGURES: dict[str, tuple[Callable[[h5py.File], Figure], tuple[str, ...]]] = {
    "subsurface_stress": (subsurface_stress, ("stress/section",)),
    "fretting_life": (fretting_life, ("stress/life", "grid")),
}
