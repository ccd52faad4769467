"""Figure of a vibration case: frequencies over the speed of an engine, with its orders."""

from __future__ import annotations

import h5py
import numpy as np
from matplotlib.figure import Figure

from workflow.analyses.vibration.case.excitation import load_text
from workflow.analyses.vibration.output.outcome import VibrationContents
from workflow.pictures.panels import legend_below, new_figure, shaded
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
            label = f"natural, joints {name}" if number == 0 else None
            axis.axhline(mode, color=BLACK, linestyle=style, linewidth=0.8, label=label)
    axis.plot(speeds, span, color=BLACK, label=f"order {order:g}")
    for multiple in MULTIPLES:
        label = f"order {multiple * order:g}"
        axis.plot(speeds, multiple * span, color=BLACK, linewidth=0.5, label=label)
    for name, colour in shaded(contents.responses, MOST_DOTS):
        numbers = file["responses"][name].attrs
        at = 60.0 * float(numbers["resonance"]) / order
        axis.plot(at, numbers["resonance"], "o", color=colour, label=load_text(numbers), zorder=4)
    axis.set(xlabel="speed [rpm]", ylabel="frequency [Hz]", xlim=speeds, ylim=(0.0, span[1]))
    legend_below(figure, [axis], columns=4)
    return figure


def _title(responses: list[h5py.Group], order: float) -> str:
    ends = [responses[0].attrs, responses[-1].attrs][: len(responses)]
    at = (
        f"{60.0 * numbers['resonance'] / order:.4g} rpm, {load_text(numbers)}" for numbers in ends
    )
    return f"Engine order {order:g} meets resonance at {'; '.join(at)}"
