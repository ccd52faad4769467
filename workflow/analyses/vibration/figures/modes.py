"""Figure of the modes of a vibration case: frequency and damping over the amplitude."""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np
from matplotlib.figure import Figure

from workflow.analyses.vibration.output.outcome import VibrationContents
from workflow.pictures.panels import course, legend_below, new_figure, plain_ticks, rounded, spread
from workflow.pictures.scales import TO_MICRONS
from workflow.pictures.style import BLACK, BLUE

TO_PERCENT = 1e2
QUANTITIES = {
    "frequency": (1.0, "frequency [Hz]"),
    "damping": (TO_PERCENT, "damping ratio [%]"),
}
PHASE: dict[str, Any] = {"color": BLACK, "label": "phase resonance", "linewidth": 1.2}
# Most rows: of more modes only some are drawn.
MOST_MODES = 4
ROW_HEIGHT = 3.6
# Margin above and below a mode's curve, relative to its height.
ROOM = 0.1


def modes(file: h5py.File, contents: VibrationContents) -> Figure:
    """Draw a row for each mode, over the observed amplitude, together with phase resonance."""
    shown = spread(contents.modes, MOST_MODES)
    figure = new_figure(_title(file, contents), 1.2 + ROW_HEIGHT * len(shown))
    panels = figure.subplots(len(shown), 2, squeeze=False, sharex="row")
    for row, group in zip(panels, shown, strict=True):
        mode = file["modes"][group]
        for axis, (name, (factor, label)) in zip(row, QUANTITIES.items(), strict=True):
            size, values = TO_MICRONS * mode["amplitude"][()], factor * mode[name][()]
            if contents.backbone:
                backbone = file["backbone"]
                beside = TO_MICRONS * backbone["amplitude"][()], factor * backbone[name][()]
                axis.plot(*beside, "--", **PHASE)
            axis.plot(size, values, color=BLUE, label="mode")
            room = ROOM * float(np.ptp(values)) or ROOM * float(values.max()) or 1.0
            axis.set_xlim(size.min(), size.max())
            axis.set_ylim(values.min() - room, values.max() + room)
            axis.set(xscale="log", ylabel=label)
            axis.set_title(f"mode {mode.attrs['mode']}")
            plain_ticks(axis.xaxis)
    for axis in panels[-1]:
        axis.set_xlabel(f"amplitude of {file.attrs['seen'][-1]} [µm]")
    legend_below(figure, panels.flat)
    return figure


def _title(file: h5py.File, contents: VibrationContents) -> str:
    """Return a title on the first mode."""
    first = file["modes"][contents.modes[0]].attrs
    begin, end = first["frequency"]
    return (
        f"Mode {first['mode']} {course([begin, end], 'Hz', 4)} with its amplitude, with a damping "
        f"ratio of up to {rounded(TO_PERCENT * first['most_damped'])} %"
    )
