"""Figure of a vibration case: frequencies over the speed of an engine, with its orders."""

from __future__ import annotations

import h5py
import numpy as np
from matplotlib.figure import Figure

from workflow.analyses.vibration.case.excitation import under_in
from workflow.analyses.vibration.output.outcome import VibrationContents
from workflow.pictures.panels import grouped_ticks, legend_below, new_figure, rounded, shaded
from workflow.pictures.style import BLACK

# More resonances than this would overlap.
MOST_DOTS = 8
# Orders drawn in addition to that of the excitation, as multiples of it.
MULTIPLES = 2, 3
STYLES = {"free": ":", "stuck": "--"}


def engine_orders(file: h5py.File, contents: VibrationContents) -> Figure:
    """Draw the line of the excitation's order, those of its harmonics, and the resonances on it."""
    order = float(file.attrs["engine_order"])
    responses = [file["responses"][name] for name in contents.responses]
    frequencies = np.concatenate([response["frequency"][()] for response in responses])
    span = np.array([frequencies.min(), frequencies.max()])
    figure = new_figure(_title(responses, order), 7.0)
    axis = figure.subplots()
    speeds = 60.0 * span / order
    for name, style in STYLES.items():
        modes = file["linear"].attrs[name]
        for number, mode in enumerate(modes[(modes > span[0]) & (modes < span[1])]):
            label = f"natural frequency, joints {name}" if number == 0 else None
            axis.axhline(mode, color=BLACK, linestyle=style, linewidth=0.8, label=label)
    axis.plot(speeds, span, color=BLACK, label=f"order {order:g}")
    for multiple in (m for m in MULTIPLES if m * span[0] < span[1]):
        label = f"order {multiple * order:g}"
        axis.plot(speeds, multiple * span, color=BLACK, linewidth=0.5, label=label)
    for name, colour in shaded(contents.responses, MOST_DOTS):
        numbers = file["responses"][name].attrs
        at = 60.0 * float(numbers["resonance"]) / order
        label = f"resonance {under_in(numbers)}"
        axis.plot(at, numbers["resonance"], "o", color=colour, label=label, zorder=4)
    axis.set(xlabel="engine speed [rpm]", ylabel="frequency [Hz]", xlim=speeds, ylim=(0.0, span[1]))
    grouped_ticks(axis.xaxis)
    legend_below(figure, [axis], columns=4)
    return figure


def _title(responses: list[h5py.Group], order: float) -> str:
    ends = [responses[0].attrs, responses[-1].attrs][: len(responses)]
    at = (
        f"at {rounded(60.0 * numbers['resonance'] / order, 4)} rpm {under_in(numbers)}"
        for numbers in ends
    )
    return f"Engine order {order:g} meets the resonance {' and '.join(at)}"
