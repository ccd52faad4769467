"""Figure of the bodies of a mesh or CAD file: together, and one by one with their named faces."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from sa_solver.types import Array
from workflow.commands.assembly import DrawnBody
from workflow.pictures.panels import new_figure
from workflow.pictures.style import AMBER, BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, write_figures

# Colours of faces, which then repeat lighter and darker.
COLOURS = (BLUE, ORANGE, GREEN, PURPLE, AMBER, SKY)
SHADES = (0.0, -0.45, 0.55)
GREY = "#C8C8C8"
# Directions of view: the second shows what the first does not.
EYES = {"from above": np.array([1.0, -1.6, 1.1]), "from below": np.array([-1.0, 1.6, -1.1])}
# Brightness of faces turned away from the eye, and number of facets up to which edges are drawn.
DIMMEST, MOST_EDGES = 0.55, 6000
PANEL_HEIGHT, LEGEND_LINES, LINE_HEIGHT = 3.6, 14, 0.26
# Further faces and bodies are only counted in the figure; the command lists them.
MOST_FACES, MOST_BODIES = 18, 12


def write_figure(bodies: Sequence[DrawnBody], title: str, path: Path) -> None:
    """Draw the bodies of the file ``title``."""
    write_figures([(path.stem, partial(figure, bodies, title))], path.parent)


def figure(bodies: Sequence[DrawnBody], title: str) -> Figure:
    """Draw all bodies together, then each alone, from two sides; plane bodies from one."""
    plane = bodies[0].corners.shape[1] == 2
    shown = list(bodies[:MOST_BODIES])
    rows = (len(shown) > 1) + len(shown)
    heights = [PANEL_HEIGHT] * (len(shown) > 1) + [_height(body) for body in shown]
    more = f"; {len(bodies) - len(shown)} more are not drawn" if len(bodies) > len(shown) else ""
    drawn = new_figure(f"{title}: {_counted(len(bodies))}{more}", 0.8 + sum(heights))
    parts = drawn.subfigures(rows, 1, squeeze=False, height_ratios=heights)[:, 0]
    if len(shown) > 1:
        _draw_assembly(parts[0], bodies, plane)
    for part, body in zip(parts[rows - len(shown) :], shown, strict=True):
        _draw_body(part, body, plane)
    return drawn


def _counted(count: int) -> str:
    return "1 body" if count == 1 else f"{count} bodies"


def _height(body: DrawnBody) -> float:
    """Return the height of a row [inches]: its legend may be higher than its panels."""
    lines = len(_entries(body))
    return PANEL_HEIGHT + max(0, lines - LEGEND_LINES) * LINE_HEIGHT


def _entries(body: DrawnBody) -> list[str]:
    """Return the lines of the legend of a body."""
    faces = [f"{n} {name}" for n, name in enumerate(body.faces, 1)]
    over = len(faces) - MOST_FACES
    left = [f"and {over} more"] * (over > 0)
    return [*faces[:MOST_FACES], *left, *(f"• {name}" for name in body.points)]


def _draw_assembly(part: Any, bodies: Sequence[DrawnBody], plane: bool) -> None:
    colours = [_colour(number) for number in range(len(bodies))]
    corners = np.concatenate([body.corners for body in bodies])
    normals = np.concatenate([body.normals for body in bodies])
    fill = np.repeat([to_rgb(c) for c in colours], [len(b.corners) for b in bodies], axis=0)
    part.suptitle("all bodies", x=0.01, ha="left", fontsize=13)
    if plane:
        axes = part.subplots(1, 1, squeeze=False)[0]
        for body, colour in zip(bodies, colours, strict=True):
            _fill_plane(axes[0], body, colour)
    else:
        axes = part.subplots(1, 2, squeeze=False)[0]
        for axis, (where, eye) in zip(axes, EYES.items(), strict=True):
            _draw_surface(axis, corners, normals, fill, eye, where)
    named = [Patch(color=c, label=b.name) for c, b in zip(colours, bodies, strict=True)]
    axes[-1].legend(handles=named[:MOST_FACES], loc="center left", bbox_to_anchor=(1.0, 0.5))


def _draw_body(part: Any, body: DrawnBody, plane: bool) -> None:
    size = " x ".join(f"{v:.4g}" for v in body.extent[[0, 2] if plane else slice(None)])
    part.suptitle(f"{body.name}, {size} mm", x=0.01, ha="left", fontsize=13)
    fill = np.tile(to_rgb(GREY), (len(body.corners), 1))
    for number, rows in enumerate(body.faces.values()):
        fill[rows] = to_rgb(_colour(number))
    if plane:
        axes = part.subplots(1, 1, squeeze=False)[0]
        _fill_plane(axes[0], body, GREY)
        lines = LineCollection(list(body.corners[:, :, [0, 2]]), colors=fill, linewidths=3.0)
        axes[0].add_collection(lines)
        _number_faces(axes[0], body, np.eye(3)[[0, 2]], None)
        _mark_points(axes[0], body, np.eye(3)[[0, 2]])
    else:
        axes = part.subplots(1, 2, squeeze=False)[0]
        for axis, (where, eye) in zip(axes, EYES.items(), strict=True):
            screen = _draw_surface(axis, body.corners, body.normals, fill, eye, where)
            _number_faces(axis, body, screen, eye)
            _mark_points(axis, body, screen)
    faces = list(body.faces)[:MOST_FACES]
    handles = [Patch(color=_colour(n), label=f"{n + 1} {name}") for n, name in enumerate(faces)]
    handles += [Patch(alpha=0.0, label=text) for text in _entries(body)[len(faces) :]]
    if handles:
        axes[-1].legend(handles=handles, loc="center left", bbox_to_anchor=(1.0, 0.5))


def _colour(number: int) -> tuple[float, float, float]:
    """Return the colour of a face or body by its number from 0, lighter or darker on repetition."""
    base = np.array(to_rgb(COLOURS[number % len(COLOURS)]))
    shade = SHADES[number // len(COLOURS) % len(SHADES)]
    mixed = base + shade * (1.0 - base) if shade > 0.0 else base * (1.0 + shade)
    red, green, blue = mixed.tolist()
    return red, green, blue


def _screen(eye: Array) -> Array:
    """Return the directions to the right, up and to the eye ``(3, 3)``."""
    to_eye = eye / np.linalg.norm(eye)
    right = np.cross([0.0, 0.0, 1.0], to_eye)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(to_eye, right), to_eye])


def _draw_surface(
    axis: Axes, corners: Array, normals: Array, fill: Array, eye: Array, where: str
) -> Array:
    """Draw the facets that face the eye, the farthest first; return the directions right and up."""
    screen = _screen(eye)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    towards = (normals / np.where(lengths > 0.0, lengths, 1.0)) @ screen[2]
    seen = np.flatnonzero(towards > 0.0)
    order = seen[np.argsort(corners[seen].mean(axis=1) @ screen[2])]
    light = DIMMEST + (1.0 - DIMMEST) * towards[order, None]
    shown = fill[order] * light
    edges: Any = shown * 0.8 if len(order) < MOST_EDGES else shown
    axis.add_collection(
        PolyCollection(
            list(corners[order] @ screen[:2].T), facecolors=shown, edgecolors=edges, linewidths=0.4
        )
    )
    _to_scale(axis, corners.reshape(-1, 3) @ screen[:2].T)
    axis.set_title(where, fontsize=11)
    axis.set_axis_off()
    axis.set(xticks=[], yticks=[])
    _draw_triad(axis, screen)
    return screen[:2]


def _to_scale(axis: Axes, places: Array) -> None:
    low, high = places.min(axis=0), places.max(axis=0)
    margin = 0.06 * float(np.max(high - low))
    axis.set_xlim(low[0] - margin, high[0] + margin)
    axis.set_ylim(low[1] - margin, high[1] + margin)
    axis.set_aspect("equal")


def _draw_triad(axis: Axes, screen: Array) -> None:
    """Draw the coordinate axes in the lower left corner."""
    for letter, direction in zip("xyz", screen[:2].T, strict=True):
        axis.annotate(
            letter,
            xy=(0.0, 0.0),
            xytext=tuple(26.0 * direction),
            xycoords="axes fraction",
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize=10,
            arrowprops={"arrowstyle": "<-", "color": BLACK, "lw": 1.0, "shrinkA": 4, "shrinkB": 0},
            annotation_clip=False,
        )


def _fill_plane(axis: Axes, body: DrawnBody, colour: Any) -> None:
    """Draw all elements of a plane body."""
    places = body.body.points[:, [0, 2]]
    triangles = list(places[body.body.mesh.t.T])
    many = len(triangles) > MOST_EDGES
    axis.add_collection(
        PolyCollection(
            triangles, facecolors=colour, edgecolors=colour if many else "white", linewidths=0.4
        )
    )
    axis.set_aspect("equal")
    axis.autoscale_view()
    axis.set(xlabel="x [mm]", ylabel="z [mm]")


def _number_faces(axis: Axes, body: DrawnBody, screen: Array, eye: Array | None) -> None:
    """Write the number of each face in the middle of its visible part; equal places share one."""
    labels: dict[int, list[str]] = {}
    middles = body.corners.mean(axis=1)
    for number, rows in enumerate(list(body.faces.values())[:MOST_FACES], start=1):
        seen = rows if eye is None else rows[body.normals[rows] @ eye > 0.0]
        if len(seen):
            apart = np.linalg.norm(middles[seen] - middles[seen].mean(axis=0), axis=1)
            labels.setdefault(int(seen[np.argmin(apart)]), []).append(str(number))
    for row, numbers in labels.items():
        right, up = (screen @ middles[row]).tolist()
        axis.text(
            right,
            up,
            ", ".join(numbers),
            fontsize=11,
            fontweight="bold",
            ha="center",
            va="center",
            path_effects=[patheffects.withStroke(linewidth=3.0, foreground="white")],
        )


def _mark_points(axis: Axes, body: DrawnBody, screen: Array) -> None:
    """Draw the node sets that are not faces, as dots."""
    for places in body.points.values():
        axis.plot(*(places @ screen.T).T, ".", color=BLACK, ms=4.0)
