"""Figures of a contact run: profiles and maps of pressure and shear, force against motion."""

from __future__ import annotations

from itertools import pairwise

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from sa_solver.types import Array, Grid
from workflow.analyses.contact.datasets import BODIES, Contents
from workflow.analyses.contact.load_table import FORCES, MOTIONS
from workflow.pictures.fields import MAX_PROFILES, centres, draw_map, middle
from workflow.pictures.panels import Figures, new_figure, shaded, spread
from workflow.pictures.scales import TO_MICRONS
from workflow.pictures.style import BLACK, BLUE, GREEN, ORANGE
from workflow.shell.results import grid_of

# One per profile: those of a closed cycle lie on each other.
DASHES = ("-", "--", "-.", ":", (0, (8, 2)), (0, (1, 3)))
STICK, SLIP = "#9DC3DE", "#F2B48C"
# Beyond the contact, how far maps and profiles reach: as a share of the contact's size.
MARGIN = 0.25
# Arrows along either side of a map.
ARROWS = 17
# Fewer points make no curve.
FEWEST_POINTS = 3


def figures_of(contents: Contents) -> Figures:
    """The figures of a run, by name."""
    return {
        "profiles": profiles,
        **({} if contents.line else {"maps": maps}),
        **({"forces": forces} if contents.increments >= FEWEST_POINTS else {}),
    }


# --- profiles -----------------------------------------------------------------------------------


def profiles(file: h5py.File) -> Figure:
    """Pressure and shear along x through the centre, at the states where the path turns."""
    names = _shown(file)
    along = _main_shear(file, names)
    figure = new_figure(_profile_title(file, names), 8.5)
    top, bottom = figure.subplots(2, 1, sharex=True)
    x = centres(_grid(file), 0)
    for (name, colour), dashes in zip(shaded(names, MAX_PROFILES), DASHES, strict=False):
        state = file["contact"][BODIES][name]
        look = {"color": colour, "linestyle": dashes, "label": _loads(file, name)}
        top.plot(x, middle(state["pressure"][()], 0), **look)
        bottom.plot(x, middle(state["shear"][along], 0), **look)
    limit = float(file.attrs["friction"]) * middle(state["pressure"][()], 0)
    bottom.fill_between(x, -limit, limit, color="#BBBBBB", alpha=0.4, lw=0, label="±µp, last")
    component, reach = "xy"[along], _reach(file, names)
    top.set(ylabel="pressure [MPa]", ylim=(0.0, None), title="pressure at y = 0")
    bottom.set(xlabel="x [mm]", xlim=(-reach, reach), ylabel=f"shear q{component} [MPa]")
    bottom.set_title(f"shear along {component} at y = 0")
    bottom.legend(loc="center left", bbox_to_anchor=(1.0, 1.0))
    return figure


def _profile_title(file: h5py.File, names: list[str]) -> str:
    state = file["contact"][BODIES][names[-1]]
    pressure, shear = state["pressure"][()].max(), np.hypot(*state["shear"][()]).max()
    return f"Last increment: pressure at most {pressure:.4g} MPa, shear {shear:.4g} MPa"


def _shown(file: h5py.File) -> list[str]:
    """Names of the states to show: the turning points of the path, of many evenly chosen ones."""
    names = list(file["contact"][BODIES])
    rows = file["history/increment"][()] - 1
    path = np.stack([column[()][rows] for column in file["path"].values()], axis=1)
    steps = np.sign(np.diff(path, axis=0))
    turns = [
        name for name, (a, b) in zip(names[1:], pairwise(steps), strict=False) if (a != b).any()
    ]
    chosen = [*turns, names[-1]] if turns else names
    return spread(chosen, MAX_PROFILES)


def _main_shear(file: h5py.File, names: list[str]) -> int:
    """The larger component of shear on the profile: 0 for x, 1 for y."""
    fields = [file["contact"][BODIES][name]["shear"][()] for name in names]
    largest = [max(np.abs(middle(field[axis], 0)).max() for field in fields) for axis in (0, 1)]
    return int(largest[1] > largest[0])


def _loads(file: h5py.File, name: str) -> str:
    """Increment and the loads that are not 0, for a legend."""
    increment = int(file["contact"][BODIES][name].attrs["increment"])
    history = file["history"]
    row = int(np.flatnonzero(history["increment"][()] == increment)[0])
    largest = max(np.abs(history[key][()]).max() for key in FORCES)
    texts = [
        f"{key} {history[key][row]:.3g} {history[key].attrs['unit']}"
        for key in FORCES
        if abs(history[key][row]) > 1e-6 * largest or key == "P"
    ]
    return f"{increment}: " + ", ".join(texts)


def _reach(file: h5py.File, names: list[str]) -> float:
    """Half width of the view along x and y [mm]."""
    grid = _grid(file)
    pressed = np.any([file["contact"][BODIES][n]["pressure"][()] > 0.0 for n in names], axis=0)
    x, y = np.broadcast_arrays(grid.x, grid.y)
    if not pressed.any():
        return 0.5 * float(max(grid.size[0], grid.size[1] * (not grid.line)))
    far = np.max(np.abs([x[pressed], y[pressed]])) + grid.pitch[0]
    return float((1.0 + MARGIN) * far)


# --- maps ---------------------------------------------------------------------------------------


def maps(file: h5py.File) -> Figure:
    """Pressure, and where the contact sticks and slips with its shear, at the last state."""
    name = list(file["contact"][BODIES])[-1]
    state, grid, reach = file["contact"][BODIES][name], _grid(file), _reach(file, [name])
    pressure, shear = state["pressure"][()], state["shear"][()]
    # 0 open, 1 stick, 2 slip.
    regions = np.where(pressure > 0.0, np.where(state["sticking"][()], 1.0, 2.0), 0.0)
    figure = new_figure(f"Last increment, {_loads(file, name)}", 6.2)
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    turned = Grid(grid.shape[::-1], grid.pitch[::-1])  # x to the right
    image = draw_map(left, pressure.T, turned, max(float(pressure.max()), 1e-300))
    draw_map(right, regions.T, turned, 2.0).set_cmap(ListedColormap(["white", STICK, SLIP]))
    _draw_arrows(right, shear, grid, reach)
    figure.colorbar(image, ax=left, label="pressure [MPa]", shrink=0.8)
    pressed = max(int(np.count_nonzero(regions)), 1)
    stuck = np.count_nonzero(regions == 1.0) / pressed
    left.set_title(f"pressure: at most {pressure.max():.4g} MPa")
    right.set_title(f"shear on body 2: {stuck:.1%} of the contact sticks")
    right.legend(
        handles=[Patch(color=STICK, label="stick"), Patch(color=SLIP, label="slip")],
        loc="upper right",
    )
    for axis in (left, right):
        axis.set(xlabel="x [mm]", xlim=(-reach, reach), ylim=(-reach, reach))
    left.set_ylabel("y [mm]")
    return figure


def _draw_arrows(axis: Axes, shear: Array, grid: Grid, reach: float) -> None:
    """The shear at about ``ARROWS`` x ``ARROWS`` places in view."""
    places = []
    for centre, pitch in ((grid.x.ravel(), grid.pitch[0]), (grid.y.ravel(), grid.pitch[1])):
        step = max(1, round(2.0 * reach / (pitch * ARROWS)))
        places.append(np.flatnonzero(np.abs(centre) <= reach)[::step])
    qx, qy = (component[np.ix_(*places)].T for component in shear)
    shown = np.hypot(qx, qy) > 0.0
    if not shown.any():
        return
    x, y = np.meshgrid(grid.x.ravel()[places[0]], grid.y.ravel()[places[1]])
    longest = float(np.hypot(qx, qy).max()) * ARROWS / (2.0 * reach)  # as long as they are apart
    axis.quiver(
        *(x[shown], y[shown], qx[shown], qy[shown]),
        angles="xy",
        scale_units="xy",
        scale=longest,
        color=BLACK,
        width=0.004,
        zorder=3,
    )


# --- force against motion -----------------------------------------------------------------------


def forces(file: h5py.File) -> Figure:
    """The force that does the most work against its motion, and the energy dissipated."""
    history = file["history"]
    force, motion = _driven(history)
    values, motions = history[force][()], history[motion][()]
    energy = np.cumsum(history["Edx"][()] + history["Edy"][()])
    # Between turning points the path is not known.
    line = "o-" if history.attrs["method"] == "full" else "o"
    figure = new_figure(_forces_title(history, energy[-1]), 6.0)
    left, right = figure.subplots(1, 2)
    # A thousandth of mm or rad.
    moved, words = TO_MICRONS * motions, motion.replace("_", " ")
    left.plot(moved, values, line, color=BLUE, markersize=4)
    left.plot(moved[-1:], values[-1:], "D", color=ORANGE, label="last")
    left.set_xlabel(f"{words} [{'mrad' if history[motion].attrs['unit'] == 'rad' else 'µm'}]")
    left.set_ylabel(f"{force} [{history[force].attrs['unit']}]")
    left.set_title(f"{force} against {words} of body 1")
    left.legend(loc="best")
    right.plot(history["increment"][()], energy, line, color=GREEN, markersize=4)
    right.set(xlabel="increment", title="energy dissipated by slip")
    right.set_ylabel(f"energy dissipated so far [{history['Edx'].attrs['unit']}]")
    return figure


def _forces_title(history: h5py.Group, energy: float) -> str:
    text = f"{energy:.4g} {history['Edx'].attrs['unit']} dissipated in all"
    if history.attrs["method"] != "full":
        text += "; only the turning points are computed"
    return text


def _driven(history: h5py.Group) -> tuple[str, str]:
    """Force and motion with the largest product of ranges; shear goes before pressure."""
    pairs = list(zip(FORCES, MOTIONS, strict=True))
    work = {
        pair: float(np.ptp(history[pair[0]][()]) * np.ptp(history[pair[1]][()])) for pair in pairs
    }
    shearing = [pair for pair in pairs if pair[0] in ("Qx", "Qy", "Mz") and work[pair] > 0.0]
    largest = max(work.values())
    return max(
        [pair for pair in shearing if work[pair] > 1e-6 * largest] or pairs, key=work.__getitem__
    )


def _grid(file: h5py.File) -> Grid:
    return grid_of(file["grid"][BODIES])
