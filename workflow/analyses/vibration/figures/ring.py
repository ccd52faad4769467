"""Figure of a ring of sectors: natural frequencies over nodal diameters, with engine orders."""

from __future__ import annotations

import h5py
import numpy as np
from matplotlib.figure import Figure

from workflow.analyses.vibration.case.excitation import under_in
from workflow.analyses.vibration.output.outcome import VibrationContents
from workflow.pictures.panels import legend_below, new_figure, rounded, whole_ticks
from workflow.pictures.style import BLACK, BLUE, ORANGE

# Most modes that are drawn, from the lowest. More would overlap.
MOST_MODES = 8
# Factor for the room above the highest frequency that is drawn.
ABOVE = 1.15


def nodal_diameters(file: h5py.File, contents: VibrationContents) -> Figure:
    """Draw frequencies with joints free and stuck, and engine orders folded at N/2.

    The engine orders are those at the speed of the resonance.
    """
    group = file["nodal_diameters"]
    sectors, order = int(group.attrs["sectors"]), int(file.attrs["engine_order"])
    numbers = file["responses"][contents.responses[-1]].attrs
    resonance = float(numbers["resonance"])
    figure = new_figure(_title(order, numbers), 7.0)
    axis = figure.subplots()
    diameters = group["diameters"][()]
    for name, style, colour in (("free", "o:", BLUE), ("stuck", "s--", ORANGE)):
        for number, mode in enumerate(group[name][:, :MOST_MODES].T):
            label = f"natural frequency, joints {name}" if number == 0 else None
            axis.plot(diameters, mode, style, color=colour, linewidth=0.8, label=label)
    highest = ABOVE * max(resonance, group["stuck"][:, 0].max())
    orders = np.arange(int(highest / resonance * order) + 2)
    folded = np.minimum(orders % sectors, -orders % sectors)
    frequencies = orders * resonance / order
    speed = f"{rounded(60.0 * resonance / order, 4)} rpm"
    axis.plot(folded, frequencies, color=BLACK, linewidth=0.8, label=f"engine orders at {speed}")
    driven = (orders % order == 0) & (orders > 0)
    axis.plot(
        folded[driven], frequencies[driven], "D", color=BLACK, label="harmonics of the excitation"
    )
    axis.set(xlabel="number of nodal diameters", ylabel="frequency [Hz]", ylim=(0.0, highest))
    whole_ticks(axis.xaxis)
    legend_below(figure, [axis], columns=2)
    return figure


def _title(order: int, numbers: h5py.AttributeManager) -> str:
    diameters = abs(int(numbers["nodal_diameters"][list(numbers["harmonics"]).index(1)]))
    return (
        f"Engine order {order} excites {diameters} nodal diameters, with a resonance at "
        f"{rounded(numbers['resonance'], 4)} Hz {under_in(numbers)}"
    )
