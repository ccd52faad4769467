"""Figure of a wear run's loads: resultants of every contact over a cycle, and their energies."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sa_solver.types import Array, Mask
from workflow.analyses.wear.output.layout import WearContents, energy_name
from workflow.case.text.readable import percent
from workflow.pictures.panels import (
    blocks,
    change,
    force_unit,
    label_rows,
    legend_below,
    new_figure,
    panel_rows,
    rounded,
    whole_ticks,
)
from workflow.pictures.style import BLUE, GREEN, HEADROOM, ORANGE, PALE_BLUE, SHADE
from workflow.shell.output.results import own

NO_SLIDING = "No face slides as a whole in any increment"
# Largest number of ranges of sliding increments in a title.
MOST_RANGES = 4
# Sliding distance [mm] in a cycle whose energy counts as rounding.
NOTHING = 1e-9


def resultants(file: h5py.File, contents: WearContents) -> Figure:
    """Draw P, Qx within the Coulomb limits, and energy per increment, one column per interface.

    Energies are left out where nothing is dissipated.
    """
    names, per = contents.names, contents.per
    loads = {name: _history(file, name) for name in names}
    title = f"{_who_slides(loads)} of {_cycles_shown(file, contents)}"
    largest = max(float(history["P"].max()) for history in loads.values())
    scale, unit = force_unit(largest)
    friction = {name: float(file[f"structure/{name}"].attrs["friction"]) for name in names}
    energies = {name: _energies(file, contents, name, loads[name]) for name in names}
    known = [energy for pair in energies.values() for energy in pair if energy is not None]
    dissipated = max(float(energy.sum()) for energy in known)
    rows = 2 + (dissipated > NOTHING * max(friction.values()) * largest)
    figure = new_figure(title, 3.2 * rows * blocks(len(names)))
    axes = panel_rows(figure, rows, len(names))
    for column, (name, history) in zip(axes.T, loads.items(), strict=True):
        increments = np.arange(1.0, len(history["P"]) + 1.0)
        forces = {key: scale * history[key] for key in ("P", "Qx")}
        _draw_normal_force(column[0], increments, forces["P"], name, f"{unit}{per}")
        sliding = history["sliding"].astype(bool)
        _draw_tangential_force(column[1], increments, forces, sliding, friction[name])
        for axis in column[2:]:
            _draw_energy(axis, increments, *energies[name], contents)
        column[-1].set_xlabel("increment")
        whole_ticks(column[-1].xaxis)
    labels = (f"normal force P [{unit}{per}]", f"tangential force Qx [{unit}{per}]")
    energy_label = f"energy per\nincrement [mJ{per}]"
    label_rows(axes, (*labels, energy_label)[:rows])
    # A constant force must not coincide with the border.
    largest = max(axis.dataLim.y1 for axis in axes[0])
    axes[0, 0].set_ylim(0.0, HEADROOM * largest if largest > 0.0 else None)
    legend_below(figure, axes[1:].flat)
    return figure


def _energies(
    file: h5py.File, contents: WearContents, interface: str, history: dict[str, Array]
) -> tuple[Array | None, Array]:
    """Return the energies of every increment: of the loads, if known, and of the worn model.

    In a mix they are per mean cycle.
    """
    share = history["share"] if contents.mix else 1.0
    wearing = file["contact"][interface][energy_name(contents.nodes)][()]
    if not contents.dissipation:
        return None, wearing
    return share * (history["Edx"] + history["Edy"]), wearing


def _history(file: h5py.File, interface: str) -> dict[str, Array]:
    """Return the resultants of a contact over the cycle, by name."""
    history = file["structure"][interface]["load_history"]
    return {name: history[name][()] for name in own(history)}


def _cycles_shown(file: h5py.File, contents: WearContents) -> str:
    """Return the cycles shown, in words: one, or a mix with its shares."""
    if not contents.mix:
        return "one cycle"
    loads = file["structure"][contents.names[0]]["load_history"]
    _, first = np.unique(loads["block"][()], return_index=True)
    return f"a mix of {', '.join(f'{percent(share)}' for share in loads['share'][()][first])}"


def _who_slides(loads: dict[str, dict[str, Array]]) -> str:
    """Return the share of sliding increments, for the title."""
    share = np.mean(np.concatenate([history["sliding"] for history in loads.values()]))
    return f"Faces slide as a whole in {percent(share)} of the increments" if share else NO_SLIDING


def _draw_normal_force(
    axis: Axes, increments: Array, force: Array, interface: str, unit: str
) -> None:
    axis.plot(increments, force, "o-", color=BLUE, markersize=4)
    peak = int(np.argmax(force))
    axis.set_title(
        f"{interface}: P peaks at {rounded(float(force[peak]))} {unit} in increment {peak + 1}"
    )


def _draw_tangential_force(
    axis: Axes, increments: Array, forces: dict[str, Array], sliding: Mask, friction: float
) -> None:
    limit, force = friction * forces["P"], forces["Qx"]
    label = f"|Qx| < µP, µ = {friction:g}"
    axis.fill_between(increments, -limit, limit, color=SHADE, alpha=0.5, lw=0, label=label)
    axis.plot(increments, force, "-", color=GREEN)
    for mask, style, fill, name in (
        (~sliding, "o", "white", "at least partly stuck"),
        (sliding, "D", GREEN, "slides as a whole"),
    ):
        if mask.any():
            look: dict[str, Any] = {"color": GREEN, "mfc": fill, "ms": 6, "label": name}
            axis.plot(increments[mask], force[mask], style, **look)
    which = _ranges(increments[sliding])
    axis.set_title(
        f"slides as a whole in increments {which}" if which else "partly stuck throughout"
    )


def _ranges(numbers: Iterable[Any]) -> str:
    """Return numbers as ranges: ``1–3, 7`` for ``1, 2, 3, 7``.

    If there are many ranges, only the first ones and the last are named.
    """
    whole = np.array([*numbers], dtype=int)
    runs = np.split(whole, np.flatnonzero(np.diff(whole) > 1) + 1) if whole.size else []
    texts = [f"{run[0]}–{run[-1]}" if len(run) > 1 else f"{run[0]}" for run in runs]
    if len(texts) > MOST_RANGES:
        texts = [*texts[: MOST_RANGES - 1], "...", texts[-1]]
    return ", ".join(texts)


def _draw_energy(
    axis: Axes, increments: Array, reference: Array | None, wearing: Array, contents: WearContents
) -> None:
    """Draw the energy of the loads as bars and that of the worn model as diamonds."""
    wears, loads, unit = contents.wears, contents.loads, f"mJ{contents.per}"
    after, against = float(wearing.sum()), ""
    if reference is not None:
        axis.bar(increments, reference, width=0.8, color=PALE_BLUE, label=loads)
        before = float(reference.sum())
        difference = change(before, after, unit)
        against = (
            f", {difference} against {loads}"
            if difference.endswith("%")
            else f", {loads} {rounded(before)}"
        )
    axis.plot(increments, wearing, "D", color=ORANGE, markersize=5, label=wears)
    axis.set_title(f"energy over the cycle: {wears} {rounded(after)} {unit}{against}")
