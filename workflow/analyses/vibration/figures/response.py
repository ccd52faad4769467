"""Figures of a vibration case: forced response, resonances and states of the joints."""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from workflow.analyses.vibration.case.excitation import amount_in, load_text, under_in
from workflow.analyses.vibration.figures.engine import engine_orders
from workflow.analyses.vibration.figures.loops import loops
from workflow.analyses.vibration.figures.modes import modes
from workflow.analyses.vibration.figures.ring import nodal_diameters
from workflow.analyses.vibration.figures.shares import MOST_JOINTS, joint_states, node_shares
from workflow.analyses.vibration.figures.stability import (
    draw_amplitudes,
    draw_motions,
    explain_stability,
)
from workflow.analyses.vibration.figures.states import pad_states
from workflow.analyses.vibration.output.outcome import VibrationContents
from workflow.models.vibration.amount import ExcitationSize
from workflow.pictures.panels import (
    Figures,
    legend_below,
    new_figure,
    plain_ticks,
    present,
    rounded,
    shaded,
)
from workflow.pictures.scales import TO_MICRONS
from workflow.pictures.style import BLACK, BLUE, HEADROOM

# More curves than this would overlap.
MOST_CURVES = 8
TO_PERCENT = 1e2
LIMIT: dict[str, Any] = {"color": BLACK, "linewidth": 0.8}
STYLES = {"free": ":", "stuck": "--"}
ASKED: dict[str, Any] = {"markersize": 4.5, "markerfacecolor": "white"}
# A full turn, and a quarter of one, which is the lag at resonance [°]. Phases begin within half a
# turn of that lag.
TURN, QUARTER = 360.0, 90.0
# Factors for the room above the highest peak and below the lowest response.
ABOVE, BELOW = 3.0, 0.5


def figures_of(contents: VibrationContents) -> Figures:
    """Return the figures of a run, by name."""
    many = contents.joints > MOST_JOINTS
    drawn = {
        "frequency_response": (frequency_response, True),
        "resonance": (resonance, len(contents.responses) > 1 or contents.backbone),
        "modes": (modes, bool(contents.modes)),
        "engine_orders": (engine_orders, contents.engine),
        "nodal_diameters": (nodal_diameters, contents.diameters),
        "loops": (loops, bool(contents.loops)),
        "joint_states": (joint_states, contents.joints and not many),
        "node_shares": (node_shares, many),
        "pad_states": (pad_states, contents.places),
    }
    return present(drawn, contents)


def _shown(file: h5py.File, contents: VibrationContents) -> list[tuple[h5py.Group, Any]]:
    """Return the responses to show, each with its colour; of many responses, only some."""
    chosen = shaded(contents.responses, MOST_CURVES)
    return [(file["responses"][name], colour) for name, colour in chosen]


def _seen(file: h5py.File) -> str:
    """Return the name of the observed displacement, which is relative to a moving ground."""
    first, *_ = file["responses"].values()
    against = " against the ground" if "absolute_amplitude" in first else ""
    return f"{file.attrs['seen'][-1]}{against}"


def _amount_of(file: h5py.File) -> ExcitationSize:
    """Return the kind of factor of the responses: forces, or levels of an excitation."""
    first, *_ = file["responses"].values()
    return amount_in(first.attrs)[0]


# --- frequency response -------------------------------------------------------------------------


def frequency_response(file: h5py.File, contents: VibrationContents) -> Figure:
    """Draw the observed amplitude over the force, a curve per force, with limits and phase.

    The limits are those of the linear structure, with joints free and stuck.
    """
    figure = new_figure(_title(file), 9.0)
    axis, phase = figure.subplots(2, 1, sharex=True, height_ratios=(2.4, 1.0))
    peaks, lows = [], []
    linear = file["linear"]
    for name, style in STYLES.items():
        frequency, receptance = linear["frequency"][()], TO_MICRONS * linear[name][()]
        label = f"joints {name}: {rounded(frequency[receptance.argmax()], 4)} Hz"
        axis.plot(frequency, receptance, style, label=label, **LIMIT)
    for response, colour in _shown(file, contents):
        _, force = amount_in(response.attrs)
        label = f"{load_text(response.attrs)}: {rounded(response.attrs['resonance'], 4)} Hz"
        draw_amplitudes(axis, response, TO_MICRONS / force, color=colour, label=label)
        _draw_phase(phase, response, color=colour)
        peaks.append(TO_MICRONS * float(response.attrs["amplitude"]) / force)
        lows.append(TO_MICRONS * response["amplitude"][:, -1].min() / force)
        axis.plot(response.attrs["resonance"], peaks[-1], "o", color=colour, markersize=5)
        if contents.at:
            asked = response["at"]
            sizes = TO_MICRONS * asked["amplitude"][:, -1] / force
            axis.plot(asked["frequency"][()], sizes, "D", color=colour, **ASKED)
    drawn = [response for response, _ in _shown(file, contents)]
    drawn += _draw_further(axis, file, contents, phase)
    explain_stability(axis, drawn)
    _over_frequency(axis, file)
    axis.set_xlabel("")
    phase.set(xlabel="frequency [Hz]", ylabel="phase [°]")
    phase.yaxis.set_major_locator(MultipleLocator(QUARTER))
    amount = _amount_of(file)
    axis.set_ylabel(f"amplitude of {_seen(file)} / {amount.name} [{amount.receptance[1]}]")
    axis.set_ylim(BELOW * min(lows), ABOVE * max(peaks))
    plain_ticks(axis.yaxis)
    legend_below(figure, [axis], columns=4, title="resonance frequency")
    return figure


def _draw_phase(axis: Axes, motions: h5py.Group, **look: Any) -> None:
    """Draw the phase of harmonic 1 along a curve, without jumps by a turn."""
    phases = np.degrees(np.unwrap(motions["phase"][()]))
    phases -= TURN * np.round((phases[0] + QUARTER) / TURN)
    draw_motions(axis, motions, motions["frequency"][()], phases, **look)


def _draw_further(
    axis: Axes, file: h5py.File, contents: VibrationContents, phase: Axes | None = None
) -> list[h5py.Group]:
    """Draw further branches in the colours of their forces, and return these branches.

    With a panel for the ``phase``, amplitudes are divided by the force.
    """
    amount = _amount_of(file).name
    colours = {response.attrs[amount]: colour for response, colour in _shown(file, contents)}
    branches = [
        branch
        for branch in file.get("further_branches", {}).values()
        if branch.attrs[amount] in colours
    ]
    for branch in branches:
        force = float(branch.attrs[amount])
        factor, colour = TO_MICRONS / (1.0 if phase is None else force), colours[force]
        draw_amplitudes(axis, branch, factor, color=colour, linewidth=1.4)
        if phase is not None:
            _draw_phase(phase, branch, color=colour, linewidth=1.4)
    return branches


def _over_frequency(axis: Axes, file: h5py.File) -> None:
    """Set logarithmic axes over the frequencies of all curves."""
    responses = file["responses"].values()
    frequencies = np.concatenate([response["frequency"][()] for response in responses])
    axis.set(xscale="log", yscale="log", xlabel="frequency [Hz]")
    axis.set_xlim(frequencies.min(), frequencies.max())
    plain_ticks(axis.xaxis)


def _title(file: h5py.File) -> str:
    responses = [file["responses"][name] for name in sorted(file["responses"])]
    first, last = responses[0].attrs, responses[-1].attrs
    before, after = (
        f"{rounded(ends['resonance'], 4)} Hz {under_in(ends)}" for ends in (first, last)
    )
    if len(responses) == 1:
        return f"The resonance is at {before}"
    moves = "rises" if last["resonance"] > first["resonance"] else "falls"
    return f"The resonance {moves} from {before} to {after}"


# --- resonance ----------------------------------------------------------------------------------


def resonance(file: h5py.File, contents: VibrationContents) -> Figure:
    """Draw amplitudes with the backbone of phase resonance; frequency and damping against force."""
    figure = new_figure(_resonance_title(file), 8.0)
    places = figure.add_gridspec(2, 2, width_ratios=(1.25, 1.0))
    axis = figure.add_subplot(places[:, 0])
    _draw_amplitudes(axis, file, contents)
    top = figure.add_subplot(places[0, 1])
    bottom = figure.add_subplot(places[1, 1], sharex=top)
    if contents.backbone:
        for panel, name, factor in ((top, "frequency", 1.0), (bottom, "damping", TO_PERCENT)):
            force = file["backbone"][_amount_of(file).name][()]
            values = factor * file["backbone"][name][()]
            panel.plot(force, values, color=BLACK, linewidth=1.0, label="phase resonance")
    _draw_peaks(top, file, "resonance", 1.0)
    _draw_peaks(bottom, file, "damping", TO_PERCENT)
    top.set_ylabel("resonance frequency [Hz]")
    amount = _amount_of(file)
    bottom.set(xlabel=f"{amount.name} [{amount.unit}]", ylabel="damping ratio [%]", xscale="log")
    plain_ticks(bottom.xaxis)
    legend_below(figure, [axis, top], columns=5)
    return figure


def _draw_amplitudes(axis: Axes, file: h5py.File, contents: VibrationContents) -> None:
    for response, colour in _shown(file, contents):
        look = {"color": colour, "label": load_text(response.attrs), "linewidth": 1.4}
        draw_amplitudes(axis, response, TO_MICRONS, **look)
    drawn = [response for response, _ in _shown(file, contents)]
    drawn += _draw_further(axis, file, contents)
    _over_frequency(axis, file)
    if contents.backbone:
        backbone = file["backbone"]
        look = {"color": BLACK, "label": "phase resonance", "zorder": 4, "linewidth": 1.0}
        draw_amplitudes(axis, backbone, TO_MICRONS, **look)
        drawn.append(backbone)
    explain_stability(axis, drawn)
    axis.set_ylabel(f"amplitude of {_seen(file)} [µm]")
    axis.set_title("responses and backbone" if contents.backbone else "responses")
    plain_ticks(axis.yaxis)


def _draw_peaks(axis: Axes, file: h5py.File, name: str, factor: float) -> None:
    """Draw the value at the peak of each response as a dot."""
    peaks = [response.attrs for response in file["responses"].values()]
    forces = [amount_in(peak)[1] for peak in peaks]
    values = [factor * peak[name] for peak in peaks]
    axis.plot(forces, values, "o", color=BLUE, label="largest amplitude")
    axis.set_ylim(0.0, HEADROOM * max(axis.dataLim.y1, 1e-300))


def _resonance_title(file: h5py.File) -> str:
    peaks = [response.attrs for response in file["responses"].values()]
    resonances = [float(peak["resonance"]) for peak in peaks]
    most = max(peaks, key=lambda peak: float(peak["damping"]))
    return (
        f"Resonance from {rounded(min(resonances), 4)} to {rounded(max(resonances), 4)} Hz; "
        f"the damping ratio reaches {rounded(TO_PERCENT * most['damping'])} % {under_in(most)}"
    )
