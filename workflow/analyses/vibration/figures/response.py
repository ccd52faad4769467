"""Figures of a vibration case: the forced response, its resonances, and what the contacts do."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from workflow.analyses.vibration.figures.axes import plain_ticks
from workflow.analyses.vibration.figures.loops import has_loops, loops
from workflow.analyses.vibration.figures.states import has_states, node_states, pad_states
from workflow.pictures.fields import spread
from workflow.pictures.style import BLACK, BLUE, ORANGE, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# More curves than this overlap.
MOST_CURVES = 8
FORCE_COLOURS = "viridis"
TO_MICRONS, TO_PERCENT = 1e3, 1e2
LIMIT: dict[str, Any] = {"color": BLACK, "linewidth": 0.8}
STYLES = {"free": ":", "stuck": "--"}
# Room above the highest peak and below the lowest response, as factors.
ABOVE, BELOW = 3.0, 0.5
HEADROOM = 1.1


def figures_of(file: h5py.File) -> dict[str, Callable[[h5py.File], Figure]]:
    """The figures there are data for, by name."""
    figures: dict[str, Callable[[h5py.File], Figure]] = {"frequency_response": frequency_response}
    if len(file["responses"]) > 1 or "backbone" in file:
        figures["resonance"] = resonance
    if has_loops(file):
        figures["loops"] = loops
    if has_states(file):
        figures |= {"node_states": node_states, "pad_states": pad_states}
    return figures


def _shown(file: h5py.File) -> list[tuple[h5py.Group, Any]]:
    """The responses, of many some, each with its colour."""
    from matplotlib import colormaps

    names = spread(sorted(file["responses"]), MOST_CURVES)
    shades = np.linspace(0.0, 0.9, len(names))
    return [
        (file["responses"][name], colormaps[FORCE_COLOURS](shade))
        for name, shade in zip(names, shades, strict=True)
    ]


def _seen(file: h5py.File) -> str:
    """What the amplitude is of."""
    return str(file.attrs["seen"][-1])


# --- frequency response -------------------------------------------------------------------------


def frequency_response(file: h5py.File) -> Figure:
    """Amplitude of what is looked at over the force, a curve per force, with linear limits."""
    figure = new_figure(_title(file), 7.0)
    axis, peaks, lows = figure.subplots(), [], []
    for name, style in STYLES.items():
        if name in file.get("linear", ()):
            _draw_limit(axis, file["linear"], name, style)
    for response, colour in _shown(file):
        force, size = float(response.attrs["force"]), TO_MICRONS * response["amplitude"][:, -1]
        label = f"{force:g} N: {response.attrs['resonance']:.4g} Hz"
        axis.plot(response["frequency"][()], size / force, color=colour, label=label)
        peaks.append(TO_MICRONS * float(response.attrs["amplitude"]) / force)
        lows.append(size.min() / force)
        axis.plot(response.attrs["resonance"], peaks[-1], "o", color=colour, markersize=5)
    _over_frequency(axis, file)
    axis.set_ylim(BELOW * min(lows), ABOVE * max(peaks))
    axis.set_ylabel(f"amplitude of {_seen(file)} / force [µm/N]")
    axis.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), title="resonance")
    return figure


def _draw_limit(axis: Axes, linear: h5py.Group, name: str, style: str) -> None:
    frequency, receptance = linear["frequency"][()], TO_MICRONS * linear[name][()]
    label = f"{name}: {frequency[receptance.argmax()]:.4g} Hz"
    axis.plot(frequency, receptance, style, label=label, **LIMIT)


def _over_frequency(axis: Axes, file: h5py.File) -> None:
    """Logarithmic axes over the frequencies of all curves."""
    responses = file["responses"].values()
    frequencies = np.concatenate([response["frequency"][()] for response in responses])
    axis.set_xscale("log")
    axis.set_yscale("log")
    plain_ticks(axis)
    axis.set_xlim(frequencies.min(), frequencies.max())
    axis.set_xlabel("frequency [Hz]")


def _title(file: h5py.File) -> str:
    responses = [file["responses"][name] for name in sorted(file["responses"])]
    first, last = responses[0].attrs, responses[-1].attrs
    if len(responses) == 1:
        return f"Resonance at {first['resonance']:.4g} Hz under {first['force']:g} N"
    return (
        f"Resonance {first['resonance']:.4g} Hz under {first['force']:g} N, "
        f"{last['resonance']:.4g} Hz under {last['force']:g} N"
    )


# --- resonance ----------------------------------------------------------------------------------


def resonance(file: h5py.File) -> Figure:
    """Amplitudes with the backbone of phase resonance; frequency and damping against force."""
    figure = new_figure(_resonance_title(file), 7.5)
    left, right = figure.subfigures(1, 2, squeeze=False, width_ratios=(1.25, 1.0))[0]
    axis = left.subplots()
    _draw_amplitudes(axis, file)
    left.legend(*axis.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    top, bottom = right.subplots(2, 1, sharex=True)
    _draw_against_force(top, file, "frequency", 1.0, BLUE)
    _draw_against_force(bottom, file, "damping", TO_PERCENT, ORANGE)
    top.set_ylabel("resonance frequency [Hz]")
    bottom.set_ylabel("damping ratio [%]")
    bottom.set_xlabel("force [N]")
    bottom.set_xscale("log")
    plain_ticks(bottom)
    top.legend(loc="best")
    return figure


def _draw_amplitudes(axis: Axes, file: h5py.File) -> None:
    for response, colour in _shown(file):
        force, size = float(response.attrs["force"]), TO_MICRONS * response["amplitude"][:, -1]
        axis.plot(
            response["frequency"][()], size, color=colour, label=f"{force:g} N", linewidth=1.4
        )
    _over_frequency(axis, file)
    if "backbone" in file:
        backbone = file["backbone"]
        look: dict[str, Any] = {"color": BLACK, "label": "phase resonance", "zorder": 4}
        axis.plot(backbone["frequency"][()], TO_MICRONS * backbone["amplitude"][()], "--", **look)
    axis.set_ylabel(f"amplitude of {_seen(file)} [µm]")
    axis.set_title("responses and backbone" if "backbone" in file else "responses")


def _draw_against_force(axis: Axes, file: h5py.File, name: str, factor: float, colour: str) -> None:
    """The value at the peak of each response as a dot, that of the backbone as a line."""
    if "backbone" in file:
        backbone = file["backbone"]
        force, values = backbone["force"][()], factor * backbone[name][()]
        axis.plot(force, values, "--", color=BLACK, label="phase resonance")
    responses = list(file["responses"].values())
    forces = [float(response.attrs["force"]) for response in responses]
    axis.plot(
        forces,
        [factor * _at_peak(response, name) for response in responses],
        "o",
        color=colour,
        label="largest amplitude",
    )
    axis.set_ylim(0.0, HEADROOM * max(axis.dataLim.y1, 1e-300))


def _at_peak(response: h5py.Group, name: str) -> float:
    """A value where the amplitude is largest."""
    return float(response.attrs["resonance" if name == "frequency" else name])


def _resonance_title(file: h5py.File) -> str:
    responses = list(file["responses"].values())
    resonances = [float(response.attrs["resonance"]) for response in responses]
    most = max(responses, key=lambda response: _at_peak(response, "damping"))
    return (
        f"Resonance between {min(resonances):.4g} and {max(resonances):.4g} Hz; most damped "
        f"under {most.attrs['force']:g} N: {TO_PERCENT * _at_peak(most, 'damping'):.3g} %"
    )
