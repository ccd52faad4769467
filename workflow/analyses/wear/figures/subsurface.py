"""Figures of the stress under the contacts: sections at peak load, and the fretting parameter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import AbstractPathEffect, withStroke
from matplotlib.ticker import MaxNLocator

from sa_solver.types import Array, Grid
from workflow.analyses.wear.output.layout import WearContents
from workflow.models.stress.layout import MOMENTS
from workflow.pictures.fields import (
    FLAT,
    PROFILE_MARGIN,
    Map,
    centres,
    colour_bar,
    draw_maps,
    scaled_panels,
    view_of,
)
from workflow.pictures.panels import (
    blocks,
    label_rows,
    largest_course,
    legend_below,
    new_figure,
    panel_rows,
    rounded,
)
from workflow.pictures.scales import TO_MICRONS
from workflow.pictures.style import BLACK, BLUE, ORANGE
from workflow.shell.output.results import grid_of

COLOURS = "magma_r"
LEVELS = 24
# Margin of sections on either side of the contact, relative to its width.
BESIDE = 0.5
# Dataset, symbol and unit of a map, by the parameter of the case.
PARAMETERS = {
    "ruiz": ("cracking_parameter", "Ruiz's F2", "N²/mm³"),
    "smith_watson_topper": ("smith_watson_topper", "SWT parameter", "MPa"),
    "findley": ("findley", "Findley's parameter", "MPa"),
}


# --- sections -----------------------------------------------------------------------------------


def subsurface_stress(file: h5py.File, contents: WearContents) -> Figure:
    """Draw the von Mises stress in the section of every contact at peak load, unworn and worn."""
    sections = file["stress/section"]
    strained = contents.strained
    # Arrays are by moment, with both bodies together.
    fields = {
        name: _values(group, "von_mises", strained).swapaxes(0, 1)
        for name, group in sections.items()
    }
    # Stress outside a body is nan.
    largest = {name: np.nanmax(field, axis=(1, 2, 3)) for name, field in fields.items()}
    top = float(max(moments.max() for moments in largest.values()))
    title = f"The largest von Mises stress below the surface {largest_course(largest, 'MPa')}"
    windows = [_window(file, contents, name) for name in sections]
    heights = [len(strained) * depth / (high - low) for (low, high), depth in windows]
    flat = max(heights) <= FLAT and len(heights) <= 2
    figure, axes = scaled_panels(title, list(np.repeat(heights, 1 + flat)), 2 - flat)
    panels = iter(axes.flat)
    for (name, group), ((low, high), depth) in zip(sections.items(), windows, strict=True):
        for moment, field in zip(MOMENTS, fields[name], strict=True):
            axis = next(panels)
            of_bodies = dict(zip(strained, field, strict=True))
            colours = _draw_section(axis, group, of_bodies, top)
            _draw_yield(axis, group, of_bodies)
            axis.set_title(f"{name}, {moment}: at most {rounded(float(np.nanmax(field)))} MPa")
            down, up = (depth if body in strained else 0.0 for body in (1, 2))
            axis.set(xlim=(low, high), ylim=(-down, up), aspect="equal")
    along, other = ("y", "x") if group.attrs["axis"] == "y" else ("x", "y")
    place = "" if contents.line else f"; at {other} = {group.attrs['at']:.3g} mm"
    for axis in axes[-1]:
        axis.set_xlabel(f"{along} [mm]")
    for axis in axes[:, 0]:
        axis.set_ylabel("z [mm]")
    whole = all(group.attrs["bulk_stress"] for group in sections.values())
    begins = TO_MICRONS * float(group["depths"][0])
    figure.supxlabel(f"{_whose_sections(contents, begins)}{place}", fontsize="small")
    label = f"von Mises stress{'' if whole else ' of the contact alone'} [MPa]"
    colour_bar(figure, colours, axes, label)
    return figure


def _whose_sections(contents: WearContents, begins: float) -> str:
    """Return which body is where in a section that starts ``begins`` µm below the surfaces."""
    lower, upper = contents.bodies
    start = f"from {begins:.3g} µm below"
    if 1 not in contents.strained:
        return f"{upper} above z = 0, {start} its surface on; {lower} is rigid"
    if 2 not in contents.strained:
        return f"{lower} below z = 0, {start} its surface on; {upper} is rigid"
    return f"{upper} above z = 0, {lower} below it, {start} their surfaces on"


def _window(
    file: h5py.File, contents: WearContents, interface: str
) -> tuple[tuple[float, float], float]:
    """Return the window of a section: along the face the contact with a margin, and the depth.

    Stress decays within the width of the contact.
    """
    grid, section = grid_of(file["grid"][interface]), file["stress/section"][interface]
    pressures = [file["contact"][interface][jump]["pressure"][()] for _, jump in contents.ends]
    view = view_of(pressures, grid, BESIDE)[1 if section.attrs["axis"] == "y" else 0]
    return view, min(float(section["depths"][-1]), 0.5 * (view[1] - view[0]))


def _values(group: h5py.Group, field: str, bodies: Sequence[int]) -> Array:
    """Return a field of these bodies, unworn and worn ``(bodies, 2, ...)``."""
    return np.array(
        [[group[f"{moment}/body_{body}/{field}"][()] for moment in MOMENTS] for body in bodies]
    )


def _heights(group: h5py.Group, body: int) -> Array:
    """Return the heights of a section's points in the interface frame [mm]."""
    return (-1.0 if body == 1 else 1.0) * group["depths"][()]


def _draw_section(axis: Axes, group: h5py.Group, field: Mapping[int, Array], top: float) -> Any:
    """Draw body 1 below and body 2 above the surface on one colour scale; return the colours."""
    axis.grid(visible=False)
    for body, values in field.items():
        colours = axis.contourf(
            group["along"][()],
            _heights(group, body),
            values.T,
            levels=MaxNLocator(LEVELS).tick_values(0.0, top or 1.0),
            cmap=COLOURS,
        )
    axis.axhline(0.0, color=BLACK, lw=0.8)
    return colours


def _draw_yield(axis: Axes, group: h5py.Group, field: Mapping[int, Array]) -> None:
    """Draw the contour of the yield stress of each body that exceeds it."""
    halo: list[AbstractPathEffect] = [withStroke(linewidth=3.0, foreground="white")]
    for body, values in field.items():
        limit = group.attrs.get(f"yield_stress_{body}", np.inf)
        if np.nanmax(values) > limit:
            place = group["along"][()], _heights(group, body)
            lines = axis.contour(*place, values.T, levels=[limit], colors=BLUE, linewidths=1.5)
            lines.set_path_effects(halo)
            for label in axis.clabel(lines, fmt=f"yields at {limit:.0f} MPa"):
                label.set_path_effects(halo)


# --- fretting parameter -------------------------------------------------------------------------


def fretting_life(file: h5py.File, contents: WearContents) -> Figure:
    """Draw the fretting parameter over every contact, for both bodies, unworn and worn."""
    groups = {name: file["stress/life"][name] for name in contents.cracking}
    life = groups[contents.cracking[0]].attrs
    parameter, symbol, unit = PARAMETERS[life["parameter"]]
    fields = {name: _values(group, parameter, contents.strained) for name, group in groups.items()}
    bodies = [contents.bodies[number - 1] for number in contents.strained]
    largest = {name: field.max(axis=(0, 2, 3)) for name, field in fields.items()}
    depth = TO_MICRONS * float(life["depth"])
    title = f"{symbol} {depth:.3g} µm below the surface {largest_course(largest, unit)}"
    label = f"{symbol}{'' if life['bulk_stress'] else ' of the contact alone'} [{unit}]"
    endangered = np.any([of_bodies.any(axis=(1, 2, 3)) for of_bodies in fields.values()], axis=0)
    panels = {
        (name, body): (grid_of(file["grid"][name]), moments)
        for name, of_bodies in fields.items()
        for body, moments, shown in zip(bodies, of_bodies, endangered, strict=True)
        if shown
    }
    draw = _curves if contents.line else _maps
    return draw(title, label, panels)


Panels = dict[tuple[str, str], tuple[Grid, Array]]
"""Grid and parameter ``(2, nx, ny)``, unworn and worn, by interface and body."""


def _maps(title: str, label: str, panels: Panels) -> Figure:
    rows = [
        [
            Map(f"{name}, {body}, {moment}: at most {rounded(float(field.max()))}", field, grid)
            for moment, field in zip(MOMENTS, moments, strict=True)
        ]
        for (name, body), (grid, moments) in panels.items()
    ]
    return draw_maps(title, rows, label, "white: zero, or outside the contact")


def _curves(title: str, label: str, panels: Panels) -> Figure:
    """Draw the parameter of line contacts over x, with a row for each body."""
    names, bodies = (list(dict.fromkeys(words)) for words in zip(*panels, strict=True))
    figure = new_figure(title, (1.0 + 3.8 * len(bodies)) * blocks(len(names)))
    axes = panel_rows(figure, len(bodies), len(names))
    spans = []
    for (name, body), (grid, moments) in panels.items():
        axis = axes[bodies.index(body), names.index(name)]
        for moment, field, colour in zip(MOMENTS, moments, (BLUE, ORANGE), strict=True):
            axis.plot(centres(grid, 0), field[:, 0], color=colour, label=moment)
        axis.set_title(
            f"{name}, {body}: at most {' → '.join(rounded(float(m.max())) for m in moments)}"
        )
        spans.append(view_of(list(moments), grid, PROFILE_MARGIN).x)
    for axis in axes[-1]:
        axis.set_xlabel("x [mm]")
    axes[0, 0].set_xlim(min(low for low, _ in spans), max(high for _, high in spans))
    axes[0, 0].set_ylim(bottom=0.0)
    label_rows(axes, [label] * len(bodies))
    legend_below(figure, axes.flat)
    return figure
