"""Figures of the structure's stress: a section through the contacts, and the notches."""

from __future__ import annotations

from typing import Any, NamedTuple

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation

from sa_solver.types import Array
from workflow.analyses.wear.output.body_mesh import body_mesh
from workflow.analyses.wear.output.layout import WearContents
from workflow.case.text.readable import percent
from workflow.models.stress.layout import MOMENTS
from workflow.pictures.fields import colour_bar, scaled_panels
from workflow.pictures.panels import course, rounded
from workflow.pictures.style import BLACK
from workflow.shell.output.results import grid_of

STRESS_COLOURS, CHANGE_COLOURS = "magma_r", "RdBu_r"
CHANGE = "change by wear"

# Offset of the section from the middle, relative to the body's diagonal.
BESIDE = 1e-7
# Planes y = 0 of two faces are equal within this tolerance: mesh files have six digits.
SAME_PLANE = 1e-5
# Half of the width of a notch's view relative to the local model, and the ends of the view.
NOTCH_VIEW, ENDS = 0.53, np.array([-1.0, 1.0])
RING: dict[str, Any] = {"marker": "o", "markersize": 14, "mfc": "none", "color": BLACK}
# Margin of the section around the faces, relative to their extent.
SECTION_MARGIN = 0.4


class _Section(NamedTuple):
    """Stress of one body in the section.

    ``points`` ``(n, 2)`` are to the right and up [mm]; ``triangles`` ``(m, 3)`` have the ``stress``
    ``(n,)`` [MPa] at their corners; ``outline`` ``(k, 2, 2)`` has the segments of the body's
    border.
    """

    points: Array
    triangles: np.ndarray
    stress: Array
    outline: Array


def structure_stress(file: h5py.File, contents: WearContents) -> Figure:
    """Draw the von Mises stress of both bodies around the faces: unworn, worn and change."""
    right, up = _shown_axes(file)
    low, high = _window(file)
    panels = {state: _sections(file, state) for state in _states(file)}
    ranges = {state: _range_within(low, high, cuts) for state, cuts in panels.items()}
    largest = [ranges[state][1] for state in panels if state != CHANGE]
    where = _place(file, contents)
    title = f"The largest von Mises stress {where} at peak load {course(largest, 'MPa')}"
    height = float(np.divide(*(high - low)[::-1]))
    figure, axes = scaled_panels(title, [height] * len(panels), 1)
    for axis, (state, sections) in zip(axes.flat, panels.items(), strict=True):
        least, most = ranges[state]
        signed = state == CHANGE
        colours = _draw_sections(
            axis, sections, max(-least, most) if signed else max(largest), signed
        )
        # The view shows the surroundings of the faces, where wear has an effect.
        axis.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), ylabel=f"global {'XYZ'[up]} [mm]")
        axis.set_title(f"{state}: {least:+.2g} to {most:+.2g} MPa" if signed else state)
        label = "change of the stress [MPa]" if signed else "von Mises stress [MPa]"
        figure.colorbar(colours, ax=axis, label=label, pad=0.01)
    axes[-1, 0].set_xlabel(f"global {'XYZ'[right]} [mm]")
    return figure


def notch_stress(file: h5py.File, contents: WearContents) -> Figure:
    """Draw the von Mises stress of the local models of all notches, with its largest place."""
    shown = _shown_axes(file)
    (along,) = {0, 1, 2} - set(shown)
    state = contents.states[-1][0]
    groups = {name: file["bodies"][name][state]["notch"] for name in contents.notches}
    sections = [_cut(file, of, of["von_mises"][()], of.attrs["at"]) for of in groups.values()]
    middles = [0.5 * (s.points.min(axis=0) + s.points.max(axis=0)) for s in sections]
    half = NOTCH_VIEW * max(float(np.ptp(section.points, axis=0).max()) for section in sections)
    top = max(float(section.stress.max()) for section in sections)
    title = f"Von Mises stress in the notches at peak load, {state}"
    figure, axes = scaled_panels(title, [1.0], len(sections))
    panels = zip(axes.flat, groups.items(), sections, middles, strict=True)
    for axis, (name, group), section, middle in panels:
        at, largest = group.attrs["at"], rounded(float(group.attrs["largest"][0]))
        colours = _draw_sections(axis, [section], top, signed=False)
        axis.plot(*at[shown], **RING)
        axis.set_title(f"{name}: {largest} MPa ± {percent(float(group.attrs['error']))}")
        axis.set(xlim=middle[0] + half * ENDS, ylim=middle[1] + half * ENDS)
        where = "" if contents.line else f", at {'XYZ'[along]} = {at[along]:.4g} mm"
        axis.set_xlabel(f"global {'XYZ'[shown[0]]} [mm]{where}")
    axes[0, 0].set_ylabel(f"global {'XYZ'[shown[1]]} [mm]")
    colour_bar(figure, colours, list(axes.flat), "von Mises stress [MPa]")
    return figure


def _place(file: h5py.File, contents: WearContents) -> str:
    """Return the place of the section for the title."""
    if contents.line:
        return "in plane strain"
    (name, first), *others = ((name, group.attrs) for name, group in file["grid"].items())
    y, far = first["axes"][1], SAME_PLANE * grid_of(file["grid"][name]).size[1]
    shared = all(
        abs(attributes["axes"][1] @ y) > 1.0 - SAME_PLANE
        and abs((attributes["origin"] - first["origin"]) @ y) < far
        for _, attributes in others
    )
    return "at y = 0" if shared else f"at y = 0 of {name}"


def _states(file: h5py.File) -> list[str]:
    """Return the states to show; a change needs both states on one mesh."""
    one_mesh = all(
        np.array_equal(body["unworn/elements"], body["worn/elements"])
        for body in file["bodies"].values()
    )
    return [*MOMENTS, CHANGE] if one_mesh else [*MOMENTS]


def _shown_axes(file: h5py.File) -> list[int]:
    """Return the global axes to the right and up; the third is closest to the first face's y."""
    y = np.abs(next(iter(file["grid"].values())).attrs["axes"][1])
    return [axis for axis in range(3) if axis != np.argmax(y)]


def _sections(file: h5py.File, state: str) -> list[_Section]:
    """Return the sections of both bodies in the plane y = 0 of the first face."""
    bodies = file["bodies"].values()
    if state != CHANGE:
        return [_cut(file, body[state], body[state]["von_mises"][()]) for body in bodies]
    changes = [body["worn/von_mises"][()] - body["unworn/von_mises"][()] for body in bodies]
    pairs = zip(bodies, changes, strict=True)
    return [_cut(file, body["unworn"], change) for body, change in pairs]


def _cut(
    file: h5py.File, body: h5py.Group, stress: Array, through: Array | None = None
) -> _Section:
    """Return the section of a body and a nodal stress at y = 0, or ``through`` a point ``(3,)``.

    A plane body is shown whole.
    """
    shown = _shown_axes(file)
    face = next(iter(file["grid"].values())).attrs
    mesh = body_mesh(body)
    mesh.point_data["stress"] = stress
    if body["elements"].shape[1] == 4:
        # The plane is off the middle, as a plane through nodes leaves holes between elements.
        origin = face["origin"] if through is None else through
        beside = origin + BESIDE * mesh.length * face["axes"][1]
        cut = mesh.slice(normal=face["axes"][1], origin=beside).triangulate()
    else:
        cut = mesh.extract_surface(algorithm="dataset_surface")
    border = cut.extract_feature_edges(
        feature_edges=False, non_manifold_edges=False, manifold_edges=False
    )
    return _Section(
        points=cut.points[:, shown],
        triangles=cut.regular_faces,
        stress=cut["stress"],
        outline=border.points[border.lines.reshape(-1, 3)[:, 1:]][..., shown],
    )


def _draw_sections(axis: Axes, sections: list[_Section], top: float, signed: bool) -> Any:
    """Draw colours and outlines of the bodies, and return the colours."""
    axis.set_aspect("equal")
    axis.grid(visible=False)
    for section in sections:
        axis.add_collection(LineCollection(list(section.outline), colors=BLACK, linewidths=0.8))
        colours = axis.tripcolor(
            Triangulation(section.points[:, 0], section.points[:, 1], section.triangles),
            section.stress,
            shading="gouraud",
            cmap=CHANGE_COLOURS if signed else STRESS_COLOURS,
            vmin=-top if signed else 0.0,
            vmax=top,
        )
    return colours


def _window(file: h5py.File) -> tuple[Array, Array]:
    """Return the lower left and upper right corner of the view, ``(2,)`` each [mm]."""
    shown = _shown_axes(file)
    ends = []
    for group in file["grid"].values():
        half = 0.5 * grid_of(group).size[0] * group.attrs["axes"][0]
        ends += [(group.attrs["origin"] + sign * half)[shown] for sign in (-1.0, 1.0)]
    low, high = np.min(ends, axis=0), np.max(ends, axis=0)
    margin = SECTION_MARGIN * np.max(high - low)
    return low - margin, high + margin


def _range_within(low: Array, high: Array, sections: list[_Section]) -> tuple[float, float]:
    """Return the smallest and largest stress between two corners [MPa]."""
    seen = [s.stress[np.all((s.points >= low) & (s.points <= high), axis=1)] for s in sections]
    every = np.concatenate(seen)
    return float(every.min()), float(every.max())
