"""Figure of a vibration case: loops under all forces at one frequency, with their slopes."""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sa_solver.types import Array
from workflow.analyses.vibration.case.excitation import load_text, under_in
from workflow.analyses.vibration.output.outcome import VibrationContents
from workflow.pictures.panels import legend_below, new_figure, rounded, shaded
from workflow.pictures.scales import PER_MICRON, TO_MICRONS

# More loops than this would overlap.
MOST_LOOPS = 8
COARSE: dict[str, Any] = {"linestyle": (0, (2, 1)), "linewidth": 1.0}
# Width of the panel of branches, relative to the displacement at which the tallest loop would gain
# its height if it stuck.
REACH = 1.6
HEADROOM = 1.08


def loops(file: h5py.File, contents: VibrationContents) -> Figure:
    """Draw force against displacement in a cycle, and the rising branches from one reversal.

    For resolutions coarser than the last, the force in the harmonics alone is shown, thin and
    dashed: too few harmonics deform the loop.
    """
    chosen = shaded(contents.loops, MOST_LOOPS)
    shown = [file["responses"][name] for name, _ in chosen]
    figure = new_figure(_title(shown), 8.0)
    left, right = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
    for response, colour in zip(shown, (colour for _, colour in chosen), strict=True):
        for coarse in _resolutions(response)[:-1]:
            left.plot(*_curve(coarse, "expansion"), color=colour, **COARSE)
        left.plot(*_curve(_finest(response)), color=colour)
        _draw_branch(right, _finest(response), colour, load_text(response.attrs))
    _bound(right, [_finest(response) for response in shown])
    _label(left, right, shown[0])
    legend_below(figure, [right], columns=3, title="excitation: slope while sticking (dashed)")
    return figure


def _label(left: Axes, right: Axes, response: h5py.Group) -> None:
    finest, coarse = _finest(response), _resolutions(response)[:-1]
    text = f"{rounded(finest.attrs['frequency'], 4)} Hz, {_harmonics(finest)} harmonics"
    if coarse:
        text += f" (dashed: the force of {', '.join(map(_harmonics, coarse))} alone)"
    left.set(title=text, xlabel="displacement [µm]", ylabel="tangential force [N]")
    right.set_title("rising branches from one origin")
    right.set(xlabel="displacement since the reversal [µm]", ylabel="force since the reversal [N]")


def _resolutions(response: h5py.Group) -> list[h5py.Group]:
    """Return the loops of a force, the finest last."""
    return [response["loops"][name] for name in sorted(response["loops"])]


def _finest(response: h5py.Group) -> h5py.Group:
    return _resolutions(response)[-1]


def _harmonics(loop: h5py.Group) -> str:
    """Return the number of harmonics of the motion, without the mean, as text."""
    return str(int(np.count_nonzero(loop.attrs["harmonics"])))


def _curve(loop: h5py.Group, force: str = "force") -> tuple[Array, Array]:
    return TO_MICRONS * loop["displacement"][()], loop[force][()]


def rising_branch(displacement: Array, force: Array) -> tuple[Array, Array]:
    """Return the branch of a closed cycle ``(t,)`` from its smallest to its largest displacement.

    Both displacement and force are counted from the reversal at which the branch begins.
    """
    displacement, force = displacement[:-1], force[:-1]
    first = int(displacement.argmin())
    count = (int(displacement.argmax()) - first) % len(displacement) + 1
    branch = (first + np.arange(count)) % len(displacement)
    return displacement[branch] - displacement[first], force[branch] - force[first]


def _draw_branch(axis: Axes, loop: h5py.Group, colour: Any, label: str) -> None:
    moved, gained = rising_branch(*_curve(loop))
    slope = _slope(loop)
    text = f"{label}: {rounded(slope)} N/µm" if np.isfinite(slope) else f"{label}: none"
    axis.plot(moved, gained, color=colour, label=text)
    if np.isfinite(slope):
        top = gained.max()
        axis.plot([0.0, top / slope], [0.0, top], "--", color=colour, linewidth=1.0, zorder=3)


def _slope(loop: h5py.Group) -> float:
    """Return the slope of stick [N/µm], NaN where there is none."""
    slope = PER_MICRON * float(loop.attrs.get("stiffness", np.nan))
    return slope if slope > 0.0 else np.nan


def _bound(axis: Axes, shown: list[h5py.Group]) -> None:
    """Limit the axes to the part in which branches bend, without most of the sliding."""
    heights = [float(np.ptp(loop["force"][()])) for loop in shown]
    ways = [height / _slope(loop) for height, loop in zip(heights, shown, strict=True)]
    longest = max((way for way in ways if np.isfinite(way)), default=np.nan)
    if np.isfinite(longest):
        axis.set_xlim(0.0, REACH * longest)
    if max(heights) > 0.0:
        axis.set_ylim(0.0, HEADROOM * max(heights))


def _title(shown: list[h5py.Group]) -> str:
    slopes = np.array([_slope(_finest(response)) for response in shown])
    slides = [response for response in shown if _finest(response).attrs["slip"] > 0.0]
    text = f"A cycle dissipates {' and '.join(map(_lost, slides[:: max(1, len(slides) - 1)]))}"
    if not slides:
        text = "No loop slides"
    if np.isfinite(slopes).any():
        low, high = (rounded(slope) for slope in (np.nanmin(slopes), np.nanmax(slopes)))
        text += f"; slope while sticking {low if low == high else f'{low} to {high}'} N/µm"
    return text


def _lost(response: h5py.Group) -> str:
    """Return the energy of a loop, as text."""
    return f"{rounded(_finest(response).attrs['energy'])} mJ {under_in(response.attrs)}"
