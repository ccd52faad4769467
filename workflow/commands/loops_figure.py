"""Figure of measured loops: how they were read, and what they give cycle by cycle."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sa_solver.types import Array
from wear.joints.measured_loops import MeasuredLoops
from workflow.pictures.panels import legend_below, new_figure
from workflow.pictures.scales import PER_MICRON, TO_MICRONS
from workflow.pictures.style import BLACK, BLUE, GREEN, ORANGE, write_figures

# More loops than this are drawn as every so many.
MOST_LOOPS = 40
HEADROOM = 1.15


def write_figure(loops: MeasuredLoops, name: str, path: Path) -> None:
    """Draw the loops of the record ``name``."""
    write_figures([(path.stem, partial(figure, loops, name))], path.parent)


def figure(loops: MeasuredLoops, name: str) -> Figure:
    """Loops with the lines that were laid through the middle one; stiffness, friction, energy."""
    drawn = new_figure(_title(loops, name), 7.0)
    left, right = drawn.subfigures(1, 2, squeeze=False, width_ratios=(1.4, 1.0))[0]
    axis = left.subplots()
    _draw_loops(axis, loops)
    legend_below(left, [axis])
    panels = right.subplots(3, 1, sharex=True)
    _draw_values(panels[0], PER_MICRON * loops.stick_stiffness, "kt [N/µm]", BLUE)
    _draw_values(panels[1], *_friction(loops), ORANGE)
    _draw_values(panels[2], loops.energy, "energy [mJ]", GREEN)
    panels[2].set_xlabel("cycle of the record")
    return drawn


def _draw_loops(axis: Axes, loops: MeasuredLoops) -> None:
    record, count = loops.record, len(loops.energy)
    for begin, _, end in loops.reversals[:: -(-count // MOST_LOOPS)]:
        here = slice(begin, end + 1)
        axis.plot(TO_MICRONS * record.displacement[here], record.force[here], color="0.7", lw=0.8)
    middle = count // 2
    begin, turn, end = loops.reversals[middle]
    here = slice(begin, end + 1)
    axis.plot(
        TO_MICRONS * record.displacement[here],
        record.force[here],
        color=BLACK,
        lw=1.2,
        label=f"cycle {middle + 1}",
    )
    for number, place in enumerate((begin, turn)):
        _draw_stick(axis, loops, middle, place, None if number else "stick slope kt")
    if loops.slides:
        _draw_sliding(axis, loops, middle)
    axis.set_xlabel("displacement [µm]")
    axis.set_ylabel("force [N]")


def _draw_stick(
    axis: Axes, loops: MeasuredLoops, cycle: int, place: int, label: str | None
) -> None:
    """The slope at the reversal ``place``, over half of the height of the loop."""
    record = loops.record
    forces = record.force[loops.reversals[cycle, :2]]
    start, opposite = record.force[place], forces.sum() - record.force[place]
    height = np.sign(opposite - start) * np.array([0.0, loops.force[cycle]])
    motion = record.displacement[place] + height / loops.stick_stiffness[cycle]
    axis.plot(TO_MICRONS * motion, start + height, color=BLUE, lw=2.5, label=label)


def _draw_sliding(axis: Axes, loops: MeasuredLoops, cycle: int) -> None:
    """The sliding lines over the part of the branches that they are laid through."""
    record, (begin, turn, end) = loops.record, loops.reversals[cycle]
    stroke, slope = loops.stroke[cycle], loops.residual_stiffness[cycle]
    for number, (start, stop) in enumerate(((begin, turn), (turn, end))):
        sense = np.sign(record.displacement[stop] - record.displacement[start])
        reach = record.displacement[stop] - sense * loops.sliding * stroke
        branch = slice(start, stop + 1)
        motion, force = record.displacement[branch], record.force[branch]
        there = sense * (motion - reach) >= 0.0
        ends = np.array([reach, record.displacement[stop]])
        line = force[there].mean() + slope * (ends - motion[there].mean())
        label = None if number else "sliding, slope kr"
        axis.plot(TO_MICRONS * ends, line, color=ORANGE, lw=2.5, label=label)


def _friction(loops: MeasuredLoops) -> tuple[Array, str]:
    """What the record says of friction, and what to call it."""
    if np.isnan(loops.normal_load).any():
        return (loops.friction_force, "µN [N]") if loops.slides else (loops.force, "force [N]")
    return (loops.friction, "µ") if loops.slides else (loops.mobilised, "µ at least")


def _draw_values(axis: Axes, values: Array, label: str, colour: str) -> None:
    axis.plot(np.arange(1, len(values) + 1), values, color=colour, marker="o", ms=4.0, lw=1.2)
    axis.set_ylim(0.0, HEADROOM * values.max())
    axis.set_ylabel(label)


def _title(loops: MeasuredLoops, name: str) -> str:
    values, label = _friction(loops)
    stick = PER_MICRON * loops.stick_estimate.value
    called, _, unit = label.partition(" [")
    unit = f" {unit.rstrip(']')}" if unit else ""
    equals = " " if called.endswith("least") else " = "
    return f"{name}: kt = {stick:.4g} N/µm, {called}{equals}{values.mean():.4g}{unit}"
