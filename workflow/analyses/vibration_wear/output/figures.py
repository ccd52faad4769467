"""Figures of a vibration case with wear: responses as wear grows, evolution and scar."""

from __future__ import annotations

from functools import partial
from typing import Any

import h5py
import numpy as np
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from sa_solver.types import Array, Indices
from workflow.analyses.vibration.case.pad_nodes import rows_and_columns
from workflow.analyses.vibration.figures.stability import draw_motions, explain_stability
from workflow.analyses.vibration_wear.output.outcome import VibrationWearContents
from workflow.case.text.plain import times
from workflow.models.vibration.amount import FORCE, LEVEL, ExcitationSize
from workflow.pictures.panels import (
    Figures,
    course,
    legend_below,
    new_figure,
    plain_ticks,
    rounded,
    shaded,
    spread,
    widen,
)
from workflow.pictures.scales import PER_MICRON, TO_MICRONS
from workflow.pictures.style import BLACK, BLUE, GREEN, ORANGE, PURPLE
from workflow.shell.output.results import grid_of

# More curves, or panels, than this would overlap.
MOST_STATES, MOST_FORCES = 6, 3
# Place of the unworn contact on a logarithmic axis, relative to the first worn one.
BEFORE = 0.1
# Datasets that are shown along the pad; the latter two are divided by the area of each node.
PROFILE = {
    "gap": "gap without load [µm]",
    "normal_force": "pressure at rest [MPa]",
    "energy": "energy per cycle\nand area [mJ/mm²]",
}
# Line from peak to peak.
PEAKS: dict[str, Any] = {
    "color": BLACK,
    "marker": "o",
    "markersize": 3.5,
    "linewidth": 0.9,
    "zorder": 4,
    "label": "peaks of all states",
}
FORCE_COLOURS = (BLUE, ORANGE, GREEN, PURPLE)
# Curves over the cycles: dataset, scale and label.
OVER_CYCLES = (
    ("stiffness", PER_MICRON, "stiffness while stuck [N/µm]"),
    ("stroke", TO_MICRONS, "stroke [µm]"),
    ("energy_per_cycle", 1.0, "energy per cycle [mJ]"),
    ("depth", TO_MICRONS, "largest worn depth [µm]"),
)
ON_GRID = "area", 1.0, "contact area [mm²]"
AT_NODES = "touching", 1.0, "nodes in contact"
# Most decades with a number along the cycles.
MOST_DECADES = 3
# Smallest range of a panel over the cycles, relative to its largest value.
LEAST = 0.02
# Numbers in titles: dataset, scale, unit and description.
STUCK = "stuck", 1.0, "Hz", "The first natural frequency of the stuck contact"
STIFFNESS = "stiffness", PER_MICRON, "N/µm", "The stiffness of the stuck contact"
DEEPEST = "depth", TO_MICRONS, "µm", "The largest worn depth"
LOOP_ENERGY = "energy_per_cycle", 1.0, "mJ", "The energy dissipated in a cycle"


def figures_of(contents: VibrationWearContents) -> Figures:
    """Return the figures of a run, by name."""
    return {
        "frequency_response": frequency_response,
        "evolution": partial(evolution, contents=contents),
        **({} if contents.at_nodes else {"scar": scar}),
        **({"profile": profile} if contents.at_nodes and contents.on_plane else {}),
        "loops": partial(loops, contents=contents),
    }


def frequency_response(file: h5py.File) -> Figure:
    """Draw the last mass's amplitude over the force, a panel per force and a curve per state.

    A line leads from peak to peak. Curves are dashed where motions are unstable.
    """
    forces, amount = list(file.attrs["forces"]), _amount(file)
    shown = spread(range(len(forces)), MOST_FORCES)
    figure = new_figure(_change(file, *STUCK), 4.0 * len(shown) + 0.5)
    panels = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
    states = shaded(sorted(file["worn"]), len(file["worn"]))
    named = set(spread([name for name, _ in states], MOST_STATES))
    for axis, place in zip(panels, shown, strict=True):
        responses = [file[f"worn/{name}/responses/{place:05d}"] for name, _ in states]
        for response, (name, colour) in zip(responses, states, strict=True):
            frequency, amplitude = response["frequency"][()], response["amplitude"][:, -1]
            look = {"color": colour}
            if name in named:
                cycles = _cycles(file["worn"][name])
                look["label"] = f"{cycles}: {response.attrs['resonance']:.4g} Hz"
            receptance = TO_MICRONS * amplitude / forces[place]
            draw_motions(axis, response, frequency, receptance, **look)
        peaks = np.array(list(map(_peak, responses)))
        axis.plot(peaks[:, 0], TO_MICRONS * peaks[:, 1] / forces[place], **PEAKS)
        explain_stability(axis, responses)
        over = f"amplitude / {amount.name} [{amount.receptance[1]}]"
        axis.set(title=amount.as_text(forces[place]), ylabel=over, yscale="log")
        axis.legend(
            loc="center left", bbox_to_anchor=(1.0, 0.5), title="cycles: resonance frequency"
        )
    panels[-1].set(xlabel="frequency [Hz]", xscale="log")
    for side in (panels[-1].xaxis, *(axis.yaxis for axis in panels)):
        plain_ticks(side)
    return figure


def _peak(response: h5py.Group) -> tuple[float, float]:
    """Return frequency [Hz] and amplitude [mm] at resonance, NaN at an end of the curve."""
    frequency, at = response["frequency"][()], float(response.attrs["resonance"])
    inside = frequency.min() < at < frequency.max()
    return (at, float(response.attrs["amplitude"])) if inside else (np.nan, np.nan)


def _amount(file: h5py.File) -> ExcitationSize:
    """Return the kind of factor of the responses: forces, or levels of an excitation."""
    return LEVEL if file.attrs.get("amount") == LEVEL.name else FORCE


def evolution(file: h5py.File, contents: VibrationWearContents) -> Figure:
    """Draw stiffness, resonances, motion and scar against cycles, from the unworn contact on."""
    history, forces = file["evolution"], list(file.attrs["forces"])
    cycles = history["cycles"][()]
    place = np.append(BEFORE * cycles[1], cycles[1:])
    figure = new_figure(_change(file, *STIFFNESS), 9.0)
    panels = figure.subplots(2, 3, sharex=True)
    frequency, *others = panels.flat
    frequency.plot(place, history["stuck"][:, 0], "--", color=BLACK, label="contact stuck")
    columns = spread(range(len(forces)), len(FORCE_COLOURS))
    for column, colour in zip(columns, FORCE_COLOURS, strict=False):
        label = _amount(file).as_text(forces[column])
        frequency.plot(place, history["resonance"][:, column], "o-", color=colour, label=label)
    frequency.set_ylabel("resonance frequency [Hz]")
    legend_below(figure, [frequency], title="resonance")
    curves = *OVER_CYCLES, AT_NODES if contents.at_nodes else ON_GRID
    for axis, (name, scale, label) in zip(others, curves, strict=True):
        axis.plot(place, scale * history[name][()], "o-", color=BLUE)
        axis.set_ylabel(label)
    for axis in panels.flat:
        widen(axis, LEAST * axis.dataLim.y1)
    for axis in panels[-1]:
        axis.set(xlabel="cycles", xscale="log")
    _name_unworn(panels[0, 0].xaxis, place)
    return figure


def _name_unworn(line: Axis, place: Array) -> None:
    """Set ticks at decades of the cycles, and one for the unworn contact at the first place."""
    first, last = np.ceil(np.log10(place[1])), np.floor(np.log10(place[-1]))
    decades = 10.0 ** np.arange(first, max(first, last) + 1.0)
    shown = spread([*decades], MOST_DECADES)
    line.set_ticks([place[0], *shown], ["unworn", *(f"{cycles:,.0f}" for cycles in shown)])
    line.set_minor_locator(NullLocator())


def scar(file: h5py.File) -> Figure:
    """Draw worn depth, pressure at rest and energy of a cycle, across the middle along x."""
    grid = grid_of(file["grid"])
    middle, along = grid.shape[1] // 2, grid.x[:, 0]
    figure = new_figure(_change(file, *DEEPEST), 9.0)
    depth, pressure, energy = figure.subplots(3, 1, sharex=True)
    for state, colour in _states(file):
        contact, label = state["contact"], _cycles(state)
        worn = TO_MICRONS * (contact["depth_1"][:, middle] + contact["depth_2"][:, middle])
        depth.plot(along, worn, color=colour, label=label)
        pressure.plot(along, contact["pressure"][:, middle], color=colour)
        energy.plot(along, contact["energy"][:, middle], color=colour)
    depth.invert_yaxis()
    depth.set_ylabel("worn depth [µm]")
    legend_below(figure, [depth], title="cycles")
    pressure.set_ylabel("pressure at rest [MPa]")
    energy.set(xlabel="x [mm]", ylabel="energy per cycle\nand area [mJ/mm²]")
    return figure


def profile(file: h5py.File) -> Figure:
    """Draw gap, pressure at rest and energy of a cycle along the pad's middle and diagonal."""
    places = {name: file["places"][name][()] for name in ("x", "y", "area")}
    sections = _sections(places["x"], places["y"])
    figure = new_figure(_change(file, *DEEPEST), 9.0)
    panels = figure.subplots(3, len(sections), sharex="col", sharey="row", squeeze=False)
    for (along, nodes, label), column in zip(sections, panels.T, strict=True):
        for state, colour in _states(file):
            area = places["area"][nodes]
            gap, force, energy = (state["nodes"][n][()][nodes] for n in PROFILE)
            curves = TO_MICRONS * gap, force / area, energy / area
            for axis, values in zip(column, curves, strict=True):
                axis.plot(along, values, ".-", color=colour, label=_cycles(state))
        column[-1].set_xlabel(label)
    for axis, label in zip(panels[:, 0], PROFILE.values(), strict=True):
        axis.set_ylabel(label)
    legend_below(figure, [panels[0, -1]], title="cycles")
    return figure


def _sections(x: Array, y: Array) -> list[tuple[Array, Indices, str]]:
    """Return lines of nodes: places along each, numbers of its nodes, and a label.

    Where nodes are not in rows and columns, there is one line of all nodes over their distance from
    the middle.
    """
    numbers = rows_and_columns(x, y)
    if numbers is None:
        distance = np.hypot(x, y)
        order = np.argsort(distance, kind="stable")
        return [(distance[order], order, "distance from the middle [mm]")]
    middle, diagonal = numbers[:, numbers.shape[1] // 2], numbers.diagonal()
    across = np.hypot(x[diagonal], y[diagonal]) * np.sign(x[diagonal])
    return [(x[middle], middle, "x [mm]"), (across, diagonal, "along the diagonal [mm]")]


def loops(file: h5py.File, contents: VibrationWearContents) -> Figure:
    """Draw loops under the force that wears; for a half-space, the full tangential problem too."""
    figure = new_figure(_change(file, *LOOP_ENERGY), 7.0)
    axis = figure.subplots()
    for state, colour in _states(file):
        label = f"{_cycles(state)}: {rounded(state.attrs['energy_per_cycle'])} mJ"
        axis.plot(*_loop(state["loop"]), color=colour, label=label)
        if not contents.at_nodes:
            axis.plot(*_loop(state["half_space_loop"]), "o", color=colour, markersize=3)
    if contents.at_nodes:
        axis.set_xlabel("displacement between the targets, or mean of the contacts [µm]")
    else:
        axis.set_xlabel("displacement of the joint [µm]")
        axis.plot([], [], "o", color=BLACK, markersize=3, label="whole tangential problem")
    axis.set_ylabel("tangential force [N]")
    legend_below(figure, [axis], columns=3, title="cycles: energy dissipated in a cycle")
    return figure


def _loop(group: h5py.Group) -> tuple[Array, Array]:
    return TO_MICRONS * group["displacement"][()], group["force"][()]


def _states(file: h5py.File) -> list[tuple[h5py.Group, Any]]:
    """Return the states to show, each with its colour."""
    return [
        (file["worn"][name], colour) for name, colour in shaded(sorted(file["worn"]), MOST_STATES)
    ]


def _cycles(state: h5py.Group) -> str:
    cycles = float(state.attrs["cycles"])
    return f"{cycles:,.0f}" if cycles > 0.0 else "unworn"


def _change(file: h5py.File, name: str, scale: float, unit: str, what: str) -> str:
    """Return a title on the change of a number from the first state to the last."""
    history = file["evolution"]
    cycles = history["cycles"][()]
    values = scale * history[name][()].reshape(len(cycles), -1)[:, 0]
    return f"{what} {course(values, unit)} in {times(round(cycles[-1]))} cycles"
