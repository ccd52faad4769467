"""Figure of a vibration case: the forced response, force by force."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from workflow.figures.fields import spread
from workflow.figures.style import BLACK, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# More curves than this overlap.
MOST_CURVES = 8
FORCE_COLOURS = "viridis"
MICRO = 1e3  # mm to µm
LIMIT: dict[str, Any] = {"color": BLACK, "linewidth": 0.8}
STYLES = {"free": ":", "stuck": "--"}
# Room above the highest peak and below the lowest response, as factors.
ABOVE, BELOW = 3.0, 0.5


def figures_of(file: h5py.File) -> dict[str, Callable[[h5py.File], Figure]]:
    """The figures there are data for, by name."""
    return {"frequency_response": frequency_response}


def frequency_response(file: h5py.File) -> Figure:
    """Amplitude of the last mass over the force, a curve per force between the linear limits."""
    from matplotlib import colormaps

    names = spread(sorted(file["responses"]), MOST_CURVES)
    shades = np.linspace(0.0, 0.9, len(names))
    figure = new_figure(_title(file), 7.0)
    axis = figure.subplots()
    linear, shown = file["linear"], []
    for name, style in STYLES.items():
        label = f"{name}: {linear.attrs[name][0]:.4g} Hz"
        receptance = MICRO * linear[name][()]
        axis.plot(linear["frequency"][()], receptance, style, label=label, **LIMIT)
    for name, shade in zip(names, shades, strict=True):
        own = file["responses"][name]
        force, colour = float(own.attrs["force"]), colormaps[FORCE_COLOURS](shade)
        receptance = MICRO * own["amplitude"][:, -1] / force
        label = f"{force:g} N: {own.attrs['resonance']:.4g} Hz"
        axis.plot(own["frequency"][()], receptance, color=colour, label=label)
        top = MICRO * float(own.attrs["receptance"])
        axis.plot(own.attrs["resonance"], top, "o", color=colour, markersize=5)
        shown += [top, receptance.min()]
    axis.set_xscale("log")
    axis.set_yscale("log")
    for place in (axis.xaxis.set_major_formatter, axis.xaxis.set_minor_formatter):
        place("{x:g}")
    axis.set_xlim(linear["frequency"][0], linear["frequency"][-1])
    axis.set_ylim(BELOW * min(shown), ABOVE * max(shown))
    axis.set_xlabel("frequency [Hz]")
    axis.set_ylabel("amplitude of the last mass / force [µm/N]")
    axis.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), title="resonance")
    return figure


def _title(file: h5py.File) -> str:
    responses = [file["responses"][name] for name in sorted(file["responses"])]
    first, last = responses[0].attrs, responses[-1].attrs
    if len(responses) == 1:
        return f"Resonance at {first['resonance']:.4g} Hz under {first['force']:g} N"
    return (
        f"Resonance {first['resonance']:.4g} Hz under {first['force']:g} N, "
        f"{last['resonance']:.4g} Hz under {last['force']:g} N"
    )
