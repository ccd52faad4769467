"""Picture of the contact faces before a run: position of each, and the gap between them."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from fe_models.meshes.structure_mesh import Body, Interface, StructureMesh
from sa_solver.types import Array
from workflow.pictures.panels import legend_below, new_figure, widen
from workflow.pictures.style import BLUE, COLOUR_MAP, ORANGE, write_figures

COLOURS = BLUE, ORANGE
ROW_HEIGHT = 4.6
# Opacity, so that one face is visible through the other.
ALPHA = 0.45
TO_MICRONS = 1e3
# Decimals of a micron in heights, and the least range shown: the rest is rounding.
DIGITS, LEAST = 3, 1.0


def write_faces(mesh: StructureMesh, title: str, path: Path) -> None:
    """Draw the contact faces of a mesh."""
    write_figures([(path.stem, partial(figure, mesh, title))], path.parent)


def figure(mesh: StructureMesh, title: str) -> Figure:
    """Return a figure with a row per contact, seen along its normal, line contacts sideways."""
    drawn = new_figure(f"{title}: contact faces", 0.8 + ROW_HEIGHT * len(mesh.interfaces))
    parts = drawn.subfigures(len(mesh.interfaces), 1, squeeze=False)[:, 0]
    for part, interface in zip(parts, mesh.interfaces, strict=True):
        bodies = [mesh.bodies[place] for place in interface.bodies]
        faces = [_in_frame(body, interface) for body in bodies]
        unit = "mm" if interface.line else "mm²"
        shared = interface.nodal_areas.sum()
        part.suptitle(f"{interface.name}: {shared:.4g} {unit} shared", x=0.01, ha="left")
        whole = [np.abs(body.outward(interface.name) @ interface.frame.axes[2]) for body in bodies]
        labels = [
            f"{body.name}, {area.sum():.4g} {unit}"
            for body, area in zip(bodies, whole, strict=True)
        ]
        draw = _draw_lines if interface.line else _draw_areas
        draw(part, interface, faces, labels)
    return drawn


def _in_frame(body: Body, interface: Interface) -> Array:
    """Return facet corners of a body's whole face ``(m, corners, 3)`` in the contact's frame."""
    corners = body.points[body.facets(interface.name)]
    return interface.frame.coordinates(corners.reshape(-1, 3)).reshape(corners.shape)


def _draw_areas(part: Any, interface: Interface, faces: list[Array], labels: list[str]) -> None:
    """Draw both faces over each other, and the gap where they meet."""
    over, gap = part.subplots(1, 2)
    for corners, colour in zip(faces, COLOURS, strict=True):
        fill = PolyCollection(
            list(corners[:, :, :2]), facecolors=colour, edgecolors=colour, alpha=ALPHA, lw=0.3
        )
        over.add_collection(fill)
    over.autoscale_view()
    handles = [
        Patch(color=colour, alpha=ALPHA, label=label)
        for colour, label in zip(COLOURS, labels, strict=True)
    ]
    part.legend(handles=handles, loc="outside lower center", ncols=2)
    x, y = interface.coordinates.T
    apart = np.round(TO_MICRONS * interface.gap, DIGITS)
    colours = gap.tripcolor(x, y, interface.facets, apart, shading="gouraud", cmap=COLOUR_MAP)
    colours.set_clim(apart.min(), max(apart.max(), apart.min() + LEAST))
    part.colorbar(colours, ax=gap, label="gap between the meshes [µm]", pad=0.01)
    for axis in (over, gap):
        axis.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal")
    gap.set(xlim=over.get_xlim(), ylim=over.get_ylim())


def _draw_lines(part: Any, interface: Interface, faces: list[Array], labels: list[str]) -> None:
    """Draw both faces from the side, with heights enlarged."""
    axis: Axes = part.subplots()
    for corners, colour, label in zip(faces, COLOURS, labels, strict=True):
        # Facets are separated by NaN, so that no lines connect them.
        places = np.concatenate([corners, np.full((len(corners), 1, 3), np.nan)], axis=1)
        x, _, height = places.reshape(-1, 3).T
        height = np.round(TO_MICRONS * height, DIGITS)
        axis.plot(x, height, ".-", color=colour, ms=4.0, lw=1.2, label=label)
    widen(axis, LEAST)
    axis.set(xlabel="x [mm]", ylabel="height over the contact plane [µm]")
    legend_below(part, [axis])
