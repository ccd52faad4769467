"""Published computations of other codes beside own ones, for `docs/validation.md`.

Both models of I. Llavori are in Abaqus: level sets on a fixed mesh, and meshes of the surfaces.
"""

from __future__ import annotations

from collections.abc import Callable

import h5py
import numpy as np
from matplotlib.figure import Figure
from validation_results import DATA, Finished, number, width_above

from sa_solver.types import Array
from workflow.pictures.panels import legend_below, new_figure
from workflow.pictures.style import BLUE, ORANGE, PURPLE

Done = Callable[[str], Finished]
"""Function that returns a finished run by its name."""

HEADINGS = ("test", "quantity", "computed", "level sets", "meshes of the surfaces")
# Runs that end at cycles of a published profile, other than the case of the test itself.
SHORTER = {1e5: "cruzado_800m", 2e5: "cruzado_1600m", 3e5: "cruzado_2400m"}
METRES = 8e-3  # per cycle of 4 mm either way
PEAK = 836.41  # p0 of the partial slip [MPa], by which its tractions are printed
# Increments of the partial slip: loaded and unloaded; columns of both models in the data.
STATES = {"loaded": (21, 3, 4), "unloaded": (41, 5, 6)}
LEVEL_SETS = {"ls": "", "marker": "o", "color": BLUE, "mfc": "none", "ms": 9,
              "label": "Abaqus, level sets"}  # fmt: skip
MESHES = {"ls": "", "marker": "x", "color": PURPLE, "ms": 8, "label": "Abaqus, meshes"}


def codes(done: Done) -> list[list[str]]:
    """Return the table of the page."""
    return [
        list(HEADINGS),
        *_scars(done, "McColl 2004", "mccoll_2004", "{:,.0f} cycles", 1.0),
        *_scars(done, "Cruzado 2010", "cruzado_2010", "{:.0f} m", METRES),
        *partial_slip(done("llavori_2026")),
    ]


def abaqus(name: str) -> Array:
    """Return what the two models give for a case, one row per place or number of cycles."""
    return np.genfromtxt(DATA / f"{name}_abaqus.csv", delimiter=",", comments="#", skip_header=5)


def _scars(done: Done, test: str, name: str, after: str, unit: float) -> list[list[str]]:
    """Return the rows of depths in the middle and of the last width at half of that."""
    rows = []
    for cycles, *depths, _, _ in abaqus(name):
        value, error, _ = scar(done, name, cycles)
        what = f"depth in the middle after {after.format(unit * cycles)} [µm]"
        rows.append([test, what, number(value, error), *(number(depth, None) for depth in depths)])
    *_, level, mesh = abaqus(name)[-1]
    _, _, width = scar(done, name, cycles)
    what = f"width at half depth after {after.format(unit * cycles)} [mm]"
    return [*rows, [test, what, *(number(given, None) for given in (width, level, mesh))]]


def scar(done: Done, name: str, cycles: float) -> tuple[float, float, float]:
    """Return depth in the middle [µm], its error and the width at half of it [mm]."""
    run = done(SHORTER.get(cycles, name) if name == "cruzado_2010" else name)
    reached, places, depths = run.depths()
    profile = np.array([np.interp(cycles, reached, depth) for depth in depths.T])
    value = float(np.interp(0.0, places, profile))
    # Between the cells, as the published widths are taken between nodes.
    fine = np.linspace(places[0], places[-1], 100 * len(places))
    width = width_above(fine, np.interp(fine, places, profile), 0.5 * value)
    return value, value * run["interface.error.depth.total"], width


def partial_slip(run: Finished) -> list[list[str]]:
    """Return the rows of tractions in partial slip."""
    table, test = abaqus("llavori_2026"), "Llavori 2026"
    middle = np.argmin(np.abs(table[:, 0]))
    pressure = run["states.1.central_pressure"]
    rows = [[test, "pressure in the middle [MPa]", number(pressure, None)]]
    rows[0] += [number(PEAK * value, None) for value in table[middle, 1:3]]
    for state, (increment, *columns) in STATES.items():
        own = np.interp(table[:, 0], *shear(run, increment))
        rows.append([test, f"shear in the middle, {state} [MPa]", number(own[middle], None)])
        rows[-1] += [number(PEAK * table[middle, column], None) for column in columns]
        rows.append([test, f"largest shear at a node, {state} [MPa]", number(own.max(), None)])
        rows[-1] += [number(PEAK * table[:, column].max(), None) for column in columns]
    return rows


def shear(run: Finished, increment: int) -> tuple[Array, Array]:
    """Return places [mm] and the shear there [MPa]."""
    with h5py.File(run.folder / "results.h5") as file:
        fields = file[f"contact/bodies/{increment:05d}"]
        return np.asarray(fields["shear"].dims[1][0]), np.asarray(fields["shear"][0, :, 0])


def llavori_figure(run: Finished) -> Figure:
    """Draw the shear in partial slip beside that of both models."""
    table = abaqus("llavori_2026")
    figure = new_figure("Llavori 2026: shear in partial slip, loaded and unloaded", 4.2)
    panels = figure.subplots(1, 2, sharey=True)
    for axis, (state, (increment, level, mesh)) in zip(panels, STATES.items(), strict=True):
        axis.plot(*shear(run, increment), color=ORANGE, label="computed")
        for column, style in ((level, LEVEL_SETS), (mesh, MESHES)):
            axis.plot(table[:, 0], PEAK * table[:, column], **style)
        axis.set(xlabel="x [mm]", title=state.capitalize())
    panels[0].set(ylabel="shear [MPa]")
    legend_below(figure, panels)
    return figure
