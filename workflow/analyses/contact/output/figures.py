"""Figures of a contact run: profiles and maps of pressure and shear, force against motion."""

from __future__ import annotations

from itertools import pairwise

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from sa_solver.types import Array, Grid
from workflow.analyses.contact.output.layout import BODIES, ContactContents
from workflow.case.text.readable import percent
from workflow.models.uncoupled.load_table import FORCES, MOTIONS
from workflow.pictures.fields import (
    FLAT,
    MARGIN,
    MAX_PROFILES,
    PROFILE_MARGIN,
    FaceWindow,
    centres,
    draw_map,
    is_upright,
    middle,
    name_sides,
    scaled_panels,
    view_of,
)
from workflow.pictures.panels import (
    Figures,
    legend_below,
    legend_of_colours,
    new_figure,
    rounded,
    shaded,
    spread,
)
from workflow.pictures.scales import TO_MICRONS
from workflow.pictures.style import BLACK, BLUE, GREEN, ORANGE, PALE_BLUE, PALE_ORANGE, SHADE
from workflow.shell.output.results import grid_of, own

# One style per profile, as those of a closed cycle coincide.
DASHES = ("-", "--", "-.", ":", (0, (8, 2)), (0, (1, 3)))
STICK, SLIP = PALE_BLUE, PALE_ORANGE
# Resultants in words, by their first letter.
NAMES = {"P": "normal force", "Q": "tangential force", "M": "moment"}
# Number of arrows along the longer side of a map.
ARROWS = 17
# Least number of points of a curve.
FEWEST_POINTS = 3


def figures_of(contents: ContactContents) -> Figures:
    """Return the figures of a run, by name."""
    return {
        "profiles": profiles,
        **({} if contents.line else {"maps": maps}),
        **({"forces": forces} if contents.increments >= FEWEST_POINTS else {}),
    }


# --- profiles -----------------------------------------------------------------------------------


def profiles(file: h5py.File) -> Figure:
    """Draw pressure and any shear along x through the centre, at turning points of the path."""
    names = _shown(file)
    along = _main_shear(file, names)
    sheared = any(_states(file)[name]["shear"][along].any() for name in names)
    last = _last_touching(file)
    figure = new_figure(_profile_title(file, last), 9.5 if sheared else 5.5)
    axes = figure.subplots(1 + sheared, 1, sharex=True, squeeze=False)[:, 0]
    x = centres(_grid(file), 0)
    for (name, colour), dashes in zip(shaded(names, MAX_PROFILES), DASHES, strict=False):
        state = _states(file)[name]
        look = {"color": colour, "linestyle": dashes, "label": _loads(file, name)}
        fields = state["pressure"][()], state["shear"][along]
        for axis, field in zip(axes, fields, strict=False):
            axis.plot(x, middle(field, 0), **look)
    place = "" if _grid(file).line else " at y = 0"
    axes[0].set(ylabel="pressure [MPa]", ylim=(0.0, None), title=f"pressure{place}")
    if sheared:
        state = _states(file)[last]
        known = state["limit"] if "limit" in state else state["pressure"]
        factor = 1.0 if "limit" in state else float(file.attrs["friction"])
        limit = factor * middle(known[()], 0)
        label = f"±µp in increment {_states(file)[last].attrs['increment']}"
        axes[1].fill_between(x, -limit, limit, color=SHADE, alpha=0.4, lw=0, label=label)
        component = "xy"[along]
        axes[1].set_ylabel(f"shear q{component} [MPa]")
        axes[1].set_title(f"shear along {component}{place}")
    axes[-1].set(xlabel="x [mm]", xlim=_view(file, names, PROFILE_MARGIN).x)
    legend_below(figure, axes, columns=3, title="increment: loads")
    return figure


def _profile_title(file: h5py.File, name: str) -> str:
    state = _states(file)[name]
    pressure, shear = state["pressure"][()].max(), np.hypot(*state["shear"][()]).max()
    sheared = f" and the largest shear {rounded(shear, 4)} MPa" if shear else ""
    return f"The peak pressure is {rounded(pressure, 4)} MPa{sheared} in {_increment(state)}"


def _shown(file: h5py.File) -> list[str]:
    """Return names of the states to show: the turning points of the path, evenly chosen if many."""
    names = list(_states(file))
    rows = file["history/increment"][()] - 1
    path = np.stack([file["path"][name][()][rows] for name in own(file["path"])], axis=1)
    steps = np.sign(np.diff(path, axis=0))
    turns = [
        name for name, (a, b) in zip(names[1:], pairwise(steps), strict=False) if (a != b).any()
    ]
    chosen = [*turns, names[-1]] if turns else names
    return spread(chosen, MAX_PROFILES)


def _main_shear(file: h5py.File, names: list[str]) -> int:
    """Return the larger component of shear on the profile: 0 for x, 1 for y."""
    fields = [_states(file)[name]["shear"][()] for name in names]
    largest = [max(np.abs(middle(field[axis], 0)).max() for field in fields) for axis in (0, 1)]
    return int(largest[1] > largest[0])


def _loads(file: h5py.File, name: str) -> str:
    """Return the increment and the loads that are not 0, for a legend."""
    increment = int(_states(file)[name].attrs["increment"])
    history = file["history"]
    row = int(np.flatnonzero(history["increment"][()] == increment)[0])
    largest = max(np.abs(history[key][()]).max() for key in FORCES)
    texts = [
        f"{key} {history[key][row]:.3g} {history[key].attrs['unit']}"
        for key in FORCES
        if abs(history[key][row]) > 1e-6 * largest or key == "P"
    ]
    return f"{increment}: " + ", ".join(texts)


def _view(file: h5py.File, names: list[str], margin: float = MARGIN) -> FaceWindow:
    """Return the region in contact at these states, with a margin."""
    fields = [_states(file)[name]["pressure"][()] for name in names]
    return view_of(fields, _grid(file), margin)


# --- maps ---------------------------------------------------------------------------------------


def maps(file: h5py.File) -> Figure:
    """Draw pressure, stick and slip regions, and shear, at the last state in contact.

    Without shear, only the pressure is drawn.
    """
    name = _last_touching(file)
    state, grid, view = _states(file)[name], _grid(file), _view(file, [name])
    pressure, shear = state["pressure"][()], state["shear"][()]
    turned = is_upright([view])
    height = view.size[not turned] / view.size[turned]
    panels = 1 + bool(shear.any())
    columns = 1 if height <= FLAT else panels
    figure, axes = scaled_panels(_maps_title(file, name), [height] * (panels // columns), columns)
    first = axes.flat[0]
    image = draw_map(first, pressure, grid, float(pressure.max()) or 1.0, view, turned)
    first.set_title("pressure")
    figure.colorbar(image, ax=first, label="pressure [MPa]", pad=0.01)
    if panels > 1:
        _draw_regions(figure, axes.flat[1], state, grid, view, turned)
    name_sides(axes, turned)
    return figure


def _maps_title(file: h5py.File, name: str) -> str:
    """Return the title: the peak pressure and, with shear, how much of the contact sticks."""
    state = _states(file)[name]
    peak = f"the peak pressure is {rounded(float(state['pressure'][()].max()), 4)} MPa"
    if state["shear"][()].any():
        peak += f" and {percent(_stuck(state))} of the contact sticks"
    return f"In {_increment(state)}, {peak}"


def _stuck(state: h5py.Group) -> float:
    """Return the share of the contact that sticks."""
    pressed = state["pressure"][()] > 0.0
    stuck = np.count_nonzero(pressed & state["sticking"][()].astype(bool))
    return stuck / max(int(np.count_nonzero(pressed)), 1)


def _increment(state: h5py.Group) -> str:
    return f"increment {state.attrs['increment']}"


def _last_touching(file: h5py.File) -> str:
    """Return the name of the last state in contact, or of the last state if there is none."""
    names = list(_states(file))
    touching = [name for name in names if _states(file)[name]["pressure"][()].any()]
    return (touching or names)[-1]


def _draw_regions(
    figure: Figure, axis: Axes, state: h5py.Group, grid: Grid, view: FaceWindow, turned: bool
) -> None:
    """Draw the regions of stick and slip, with the shear."""
    pressed, sticks = state["pressure"][()] > 0.0, state["sticking"][()].astype(bool)
    # 0 open, 1 stick, 2 slip.
    regions = np.where(pressed, np.where(sticks, 1.0, 2.0), 0.0)
    shown = draw_map(axis, regions, grid, 2.0, view, turned)
    shown.set_cmap(ListedColormap(["white", STICK, SLIP]))
    _draw_arrows(axis, state["shear"][()], grid, view, turned)
    axis.set_title("shear on body 2 (arrows)")
    legend_of_colours(figure, {"sticks": STICK, "slips": SLIP})


def _draw_arrows(axis: Axes, shear: Array, grid: Grid, view: FaceWindow, turned: bool) -> None:
    """Draw the shear at places in view, ``ARROWS`` along its longer side."""
    apart = max(view.size) / ARROWS
    places = []
    for direction in (0, 1):
        centre, (low, high) = centres(grid, direction), view[direction]
        step = max(1, round(apart / grid.pitch[direction]))
        places.append(np.flatnonzero((centre >= low) & (centre <= high))[step // 2 :: step])
    q = np.array([component[np.ix_(*places)] for component in shear])
    size = np.hypot(*q)
    if not size.any():
        return
    at = np.array(np.meshgrid(grid.x.ravel()[places[0]], grid.y.ravel()[places[1]], indexing="ij"))
    order = slice(None, None, -1 if turned else 1)
    there = size > 0.0
    axis.quiver(
        *at[order, there],
        *q[order, there],
        angles="xy",
        scale_units="xy",
        scale=float(size.max()) / apart,  # as long as they are apart
        color=BLACK,
        width=0.004,
        zorder=3,
    )


# --- force against motion -----------------------------------------------------------------------


def forces(file: h5py.File) -> Figure:
    """Draw the force with the most work against its motion, and the energy dissipated."""
    history = file["history"]
    force, motion = _driven(history)
    values, motions = history[force][()], history[motion][()]
    energy = np.cumsum(history["Edx"][()] + history["Edy"][()])
    # No line is drawn between turning points, as the path between them is not computed.
    line = "o-" if history.attrs["method"] == "full" else "o"
    figure = new_figure(_forces_title(history, energy[-1]), 6.0)
    left, right = figure.subplots(1, 2)
    # To thousandths of mm or rad.
    moved, words = TO_MICRONS * motions, motion.replace("_", " ")
    left.plot(moved, values, line, color=BLUE, markersize=4)
    left.plot(moved[-1:], values[-1:], "D", color=ORANGE, label="last increment")
    left.set_xlabel(f"{words} [{'mrad' if history[motion].attrs['unit'] == 'rad' else 'µm'}]")
    left.set_ylabel(f"{NAMES[force[0]]} {force} [{history[force].attrs['unit']}]")
    left.set_title(f"{force} against the {words} of body 1")
    legend_below(figure, [left])
    right.plot(history["increment"][()], energy, line, color=GREEN, markersize=4)
    right.set(xlabel="increment", title="energy dissipated by slip")
    right.set_ylabel(f"dissipated energy [{_in_millijoules(history)}]")
    return figure


def _forces_title(history: h5py.Group, energy: float) -> str:
    text = f"Slip dissipates {rounded(energy)} {_in_millijoules(history)} in total"
    if history.attrs["method"] != "full":
        text += " (only turning points are computed)"
    return text


def _in_millijoules(history: h5py.Group) -> str:
    """Return the unit of the energies, with mJ for N mm."""
    return str(history["Edx"].attrs["unit"]).replace("N mm", "mJ")


def _driven(history: h5py.Group) -> tuple[str, str]:
    """Return force and motion with the largest product of ranges; shear goes before pressure."""
    pairs = list(zip(FORCES, MOTIONS, strict=True))
    work = {
        pair: float(np.ptp(history[pair[0]][()]) * np.ptp(history[pair[1]][()])) for pair in pairs
    }
    shearing = [pair for pair in pairs if pair[0] in ("Qx", "Qy", "Mz") and work[pair] > 0.0]
    largest = max(work.values())
    return max(
        [pair for pair in shearing if work[pair] > 1e-6 * largest] or pairs, key=work.__getitem__
    )


def _states(file: h5py.File) -> h5py.Group:
    """Return the states of the computed increments."""
    return file["contact"][BODIES]


def _grid(file: h5py.File) -> Grid:
    return grid_of(file["grid"][BODIES])
