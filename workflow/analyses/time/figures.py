"""Figures of a case in time: loops, evolution of the joint, and responses of the rig."""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sa_solver.types import Array
from workflow.analyses.time.outcome import MotionContents
from workflow.case.text.plain import times
from workflow.pictures.panels import (
    Figures,
    course,
    grouped_ticks,
    legend_below,
    new_figure,
    panel_grid,
    plain_ticks,
    present,
    rounded,
    shaded,
    widen,
)
from workflow.pictures.scales import PER_MICRON, TO_JOULES, TO_MICRONS
from workflow.pictures.style import BLACK, BLUE, GREEN, HEADROOM, ORANGE, PURPLE

# More curves than this in a panel would overlap.
MOST_CURVES = 6
# mm/s² to m/s².
TO_METRES = 1e-3
# Parameters: colour, factor from the unit of the file to that shown, and label.
SHOWN = {
    "friction": (BLUE, 1.0, "coefficient of friction µ"),
    "stiffness": (ORANGE, PER_MICRON, "stiffness kt [N/µm]"),
    "residual_stiffness": (PURPLE, PER_MICRON, "residual stiffness [N/µm]"),
    "normal_load": (GREEN, 1.0, "normal load [N]"),
}
LAW_NAMES = {
    "bouc_wen": "Bouc-Wen",
    "jenkins": "Jenkins",
    "uniform_iwan": "uniform Iwan",
    "four_parameter_iwan": "four-parameter Iwan",
    "friction_contact": "friction contact",
}
# The first mode is shown up to this multiple of the highest frequency of its peaks.
FIRST_MODE = 2.0
# Motions are shown until they have decayed to this share of their largest value.
FADED = 0.02
# Most points of a time history that a picture can resolve.
MOST_POINTS = 20_000


def figures_of(contents: MotionContents) -> Figures:
    """Return the figures of a run, by name."""
    groups = contents.curves
    drawn = {
        "loops": (loops, "loop" in groups),
        "frequency_response": (frequency_response, "frequency_response" in groups),
        "ring_down": (ring_down, "ring_down" in groups),
        # A figure of the ring-down shows the motion too.
        "motion": (motion, "motion" in groups and "ring_down" not in groups),
        "evolution": (evolution, bool(contents.evolution)),
    }
    return present(drawn, contents)


def _states(
    file: h5py.File, contents: MotionContents, group: str
) -> list[tuple[str, Any, h5py.Group]]:
    """Return label, colour and curves of the states that have a group; of many states, some."""
    states = file["states"]
    return [
        (_label(states[name], contents.aged), colour, states[name][group])
        for name, colour in shaded(contents.curves[group], MOST_CURVES)
    ]


def _label(state: h5py.Group, aged: bool) -> str:
    energy = TO_JOULES * float(state.attrs["energy"])
    text = f"{rounded(energy, 4)} J" if energy else "unworn"
    if aged and state.attrs["cycles"]:
        text += f", {state.attrs['cycles']:,.0f} cycles"
    return text


# --- loops and evolution ------------------------------------------------------------------------


def loops(file: h5py.File, contents: MotionContents) -> Figure:
    """Draw force against displacement of the joint over a closed cycle, at several energies."""
    shown = _states(file, contents, "loop")
    figure = new_figure(_loops_title([_area(loop) for _, _, loop in shown]), 7.0)
    axis = figure.subplots()
    for label, colour, loop in shown:
        displacement, force = TO_MICRONS * loop["displacement"][()], loop["force"][()]
        axis.plot(displacement, force, color=colour, label=label)
    axis.set(xlabel="displacement of the joint [µm]", ylabel="force of the joint [N]")
    axis.set_title(f"{LAW_NAMES[file.attrs['law']]} joint: steady cycles")
    legend_below(figure, [axis], columns=3, title="energy dissipated before")
    return figure


def _loops_title(energies: list[float]) -> str:
    if len(energies) == 1:
        return f"A cycle dissipates {rounded(energies[0])} mJ"
    return f"The energy dissipated in a cycle {course(energies, 'mJ')}"


def _area(loop: h5py.Group) -> float:
    """Return the area of a closed loop [N mm]."""
    return float(abs(np.trapezoid(loop["force"][()], loop["displacement"][()])))


def evolution(file: h5py.File, contents: MotionContents) -> Figure:
    """Draw the parameters that change over the dissipated energy, and below them the cycles."""
    group = file["evolution"]
    present = [name for name in SHOWN if name in contents.evolution]
    panels = [name for name in present if np.ptp(group[name][()]) > 0.0]
    panels = panels or ["friction", "stiffness"]
    count = len(panels) + 2 * contents.aged
    rows = -(-count // 2)
    figure = new_figure(_evolution_title(group, panels, contents.aged), 1.3 + 3.4 * rows)
    axes = panel_grid(figure, count)
    for name, axis in zip(panels, axes, strict=False):
        _draw_parameter(axis, file, name)
    if contents.aged:
        _draw_ageing(axes[-2], axes[-1], group)
    legend_below(figure, axes)
    return figure


def _draw_parameter(axis: Axes, file: h5py.File, name: str) -> None:
    colour, factor, label = SHOWN[name]
    group = file["evolution"]
    axis.plot(TO_JOULES * group["energy"][()], factor * group[name][()], color=colour)
    states = list(file["states"].values())
    energies = [TO_JOULES * float(state.attrs["energy"]) for state in states]
    values = [factor * float(state.attrs[name]) for state in states]
    axis.plot(energies, values, "o", color=BLACK, mfc="none", label="reported states")
    axis.set(xlabel="dissipated energy [J]", ylabel=label)
    axis.set_ylim(0.0, HEADROOM * max(axis.dataLim.y1, 1e-300))


def _draw_ageing(left: Axes, right: Axes, group: h5py.Group) -> None:
    """Draw the energy of a cycle, and the number of cycles so far, over the dissipated energy."""
    energy = TO_JOULES * group["energy"][()]
    left.plot(energy, group["energy_per_cycle"][()], color=BLUE)
    left.set(ylabel="energy per cycle [mJ]", ylim=(0.0, HEADROOM * max(left.dataLim.y1, 1e-300)))
    right.plot(energy, group["cycles"][()], color=ORANGE)
    right.set(ylabel="cycles", ylim=(0.0, None))
    grouped_ticks(right.yaxis)
    for axis in (left, right):
        axis.set_xlabel("dissipated energy [J]")


def _evolution_title(group: h5py.Group, panels: list[str], aged: bool) -> str:
    texts = []
    for name in panels[:2]:
        _, factor, label = SHOWN[name]
        word, _, unit = label.rstrip("]").partition(" [")
        texts.append(f"{word} {course(factor * group[name][()], unit)}".strip())
    during = f" in {times(round(group['cycles'][-1]))} cycles" if aged else ""
    return f"The {' and the '.join(texts)}{during}"


# --- hammer blows -------------------------------------------------------------------------------


def frequency_response(file: h5py.File, contents: MotionContents) -> Figure:
    """Draw acceleration over force: over all frequencies, and the first mode enlarged."""
    shown = _states(file, contents, "frequency_response")
    figure = new_figure(_response_title(shown), 8.5)
    top, bottom = figure.subplots(2, 1)
    first = max(_first(response, "frequency") for _, _, response in shown)
    for label, colour, response in shown:
        frequency, magnitude = response["frequency"][()], TO_METRES * response["magnitude"][()]
        for axis in (top, bottom):
            axis.semilogy(frequency, magnitude, color=colour, label=label)
    top.set_xlim(0.0, FIRST_MODE * first)
    lowest = min(_first(response, "frequency") for _, _, response in shown) / FIRST_MODE
    inside = [_within(response, lowest, FIRST_MODE * first) for _, _, response in shown]
    top.set_ylim(0.5 * min(map(np.min, inside)), 2.0 * max(map(np.max, inside)))
    highest = max(float(response["frequency"][-1]) for _, _, response in shown)
    top.set_title("first mode")
    bottom.set(title="whole record", xlabel="frequency [Hz]", xlim=(0.0, highest))
    for axis in (top, bottom):
        axis.set_ylabel("acceleration / force [m/s²/N]")
        plain_ticks(axis.yaxis)
    legend_below(figure, [top], title="energy dissipated before")
    return figure


def _within(response: h5py.Group, lowest: float, highest: float) -> Array:
    """Return magnitudes between two frequencies."""
    frequency = response["frequency"][()]
    return TO_METRES * response["magnitude"][()][(frequency > lowest) & (frequency < highest)]


def _first(response: h5py.Group, name: str) -> float:
    """Return frequency or peak of the first resonance."""
    return float(response.parent.attrs[f"first_{name}"])


def _response_title(shown: list[tuple[str, Any, h5py.Group]]) -> str:
    peaks = [_first(response, "frequency") for _, _, response in shown]
    heights = [TO_METRES * _first(response, "peak") for _, _, response in shown]
    if len(shown) == 1:
        return f"The first mode is at {rounded(peaks[0])} Hz"
    return f"The first mode {course(peaks, 'Hz')} with wear, its peak {course(heights, 'm/s²/N')}"


# Least ranges of the axes of a ring-down, as smaller changes are noise: of the frequency [%], and
# of the damping, as a share.
LEAST_SOFTENING, LEAST_DAMPING = 0.1, 0.1


def ring_down(file: h5py.File, contents: MotionContents) -> Figure:
    """Draw frequency and damping of the first mode against its amplitude, and the motion itself."""
    shown = _states(file, contents, "motion")
    figure = new_figure(_ring_down_title(shown), 9.0)
    places = figure.add_gridspec(2, 2, height_ratios=(1.0, 1.3))
    history = figure.add_subplot(places[0, :])
    left, right = (figure.add_subplot(places[1, place]) for place in (0, 1))
    for label, colour, moved in shown:
        stuck, envelope = float(moved.parent.attrs["stuck"][0]), moved.parent.get("ring_down")
        missing = "" if envelope else ", no ring-down"
        _draw_history(history, moved, colour, f"{label}: stuck {stuck:.4g} Hz{missing}")
        if not envelope:
            continue
        amplitude = TO_MICRONS * envelope["amplitude"][()]
        softened = 100.0 * (envelope["frequency"][()] / stuck - 1.0)
        left.semilogx(amplitude, softened, color=colour)
        right.loglog(amplitude, 100.0 * np.abs(envelope["damping_ratio"][()]), color=colour)
    history.set(xlabel="time [s]", ylabel=f"displacement of {_seen(file)} [µm]")
    legend_below(figure, [history], columns=2, title="energy dissipated before")
    left.set_ylabel("frequency change from the stuck joint [%]")
    right.set_ylabel("damping ratio [%]")
    for axis in (left, right):
        axis.set_xlabel(f"amplitude of {_seen(file)} [µm]")
        plain_ticks(axis.xaxis)
    widen(left, LEAST_SOFTENING)
    widen(right, LEAST_DAMPING)
    plain_ticks(right.yaxis)
    return figure


def _ring_down_title(shown: list[tuple[str, Any, h5py.Group]]) -> str:
    """Return the title: the lowest frequency of the first mode, and its highest damping."""
    found = [
        (100.0 * (envelope["frequency"][()].min() / moved.parent.attrs["stuck"][0] - 1.0), envelope)
        for _, _, moved in shown
        if (envelope := moved.parent.get("ring_down"))
    ]
    if not found:
        return "The motion has no ring-down of the first mode"
    lowest = min(change for change, _ in found)
    damping = max(100.0 * np.abs(envelope["damping_ratio"][()]).max() for _, envelope in found)
    return (
        f"The first mode is up to {abs(lowest):.2g} % below the stuck joint's, "
        f"its damping ratio up to {damping:.2g} %"
    )


def _draw_history(axis: Axes, moved: h5py.Group, colour: Any, label: str) -> None:
    """Draw the main observed displacement until it has decayed."""
    end = _faded(moved)
    displacement = TO_MICRONS * moved["displacement"][:end, -1]
    axis.plot(moved["time"][:end], displacement, color=colour, label=label, linewidth=1.0)


def _faded(moved: h5py.Group) -> int:
    """Return the number of samples until the main observed displacement has decayed."""
    displacement = moved["displacement"][:, -1]
    away = np.abs(displacement - displacement[-1])
    large = np.flatnonzero(away > FADED * away.max())
    return int(large[-1]) + 1 if large.size else len(displacement)


# --- forces -------------------------------------------------------------------------------------


def motion(file: h5py.File, contents: MotionContents) -> Figure:
    """Draw force, displacement and the energy that the joint has dissipated, over time."""
    shown = _states(file, contents, "motion")
    lost = [float(history["dissipated"][-1]) for _, _, history in shown]
    figure = new_figure(f"The energy dissipated in the motion {course(lost, 'mJ')}", 9.0)
    top, middle, bottom = figure.subplots(3, 1, sharex=True)
    longest = max(_faded(history) for _, _, history in shown)
    for label, colour, history in shown:
        every = max(1, longest // MOST_POINTS)
        time = history["time"][()][:longest:every]
        look = {"color": colour, "label": label, "linewidth": 1.0}
        if label == shown[0][0]:
            top.plot(time, history["excitation"][:longest:every], color=BLACK, linewidth=1.0)
        middle.plot(time, TO_MICRONS * history["displacement"][:longest:every, -1], **look)
        bottom.plot(time, history["dissipated"][:longest:every], **look)
    top.set_ylabel("exciting force [N]")
    middle.set_ylabel(f"displacement of {_seen(file)} [µm]")
    bottom.set(xlabel="time [s]", ylabel="dissipated energy [mJ]")
    legend_below(figure, [middle], title="energy dissipated before")
    return figure


def _seen(file: h5py.File) -> str:
    """Return the name of the main observed displacement, which is the last one."""
    return str(file.attrs["seen"][-1])
