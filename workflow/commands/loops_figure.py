"""Figure of measured loops: how they were evaluated, and the results cycle by cycle."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sa_solver.types import Array, Indices
from wear.joints.measured.loop_record import LoopBranch
from wear.joints.measured.measured_loops import MeasuredLoops
from workflow.pictures.panels import legend_below, new_figure, rounded, whole_ticks
from workflow.pictures.scales import PER_MICRON, TO_MICRONS
from workflow.pictures.style import BLACK, BLUE, GREEN, ORANGE, write_figures

# Largest number of loops drawn; of more loops, every second, third and so on is drawn.
MOST_LOOPS = 40
# Largest number of steps drawn, in the same way.
MOST_STEPS = 12
HEADROOM = 1.15


def write_figure(loops: MeasuredLoops, name: str, path: Path) -> None:
    """Draw the loops of the record ``name``."""
    write_figures([(path.stem, partial(figure, loops, name))], path.parent)


def figure(loops: MeasuredLoops, name: str) -> Figure:
    """Draw loops with the lines fitted to them, and stiffness, friction and energy per cycle."""
    drawn = new_figure(_title(loops, name), 7.0)
    left, right = drawn.subfigures(1, 2, squeeze=False, width_ratios=(1.4, 1.0))[0]
    axis = left.subplots()
    _draw_loops(axis, loops)
    legend_below(left, [axis])
    panels = right.subplots(3, 1, sharex=True)
    _draw_values(panels[0], PER_MICRON * loops.stick_stiffness, "stiffness kt [N/µm]", BLUE)
    friction, symbol = _friction(loops)
    label = f"friction {symbol}" if symbol.startswith("µ") else symbol
    _draw_values(panels[1], friction, label, ORANGE)
    _draw_values(panels[2], loops.energy, "energy per cycle [mJ]", GREEN)
    panels[2].set_xlabel("cycle of the record")
    panels[2].set_xlim(0.5, len(loops.energy) + 0.5)
    whole_ticks(panels[2].xaxis)
    return drawn


def _draw_loops(axis: Axes, loops: MeasuredLoops) -> None:
    count = len(loops.energy)
    for pair in loops.branches[:: -(-count // MOST_LOOPS)]:
        axis.plot(*_curve(loops, *pair), color="0.7", lw=0.8)
    last = int(loops.step[-1])
    for number in range(0, last + 1, -(-(last + 1) // MOST_STEPS)):
        _draw_step(axis, loops, np.flatnonzero(loops.step == number), number == 0)
    axis.set(xlabel="displacement [µm]", ylabel="tangential force [N]")


def _draw_step(axis: Axes, loops: MeasuredLoops, members: Indices, labelled: bool) -> None:
    """Draw the middle loop of a step, with the lines fitted to it."""
    middle = int(members[len(members) // 2])
    pair = loops.branches[middle]
    several = loops.step[-1] > 0
    label = "middle loop of a step" if several else f"cycle {middle + 1}"
    axis.plot(*_curve(loops, *pair), color=BLACK, lw=1.2, label=label if labelled else None)
    for number, branch in enumerate(pair):
        reported = labelled and number == 0
        _draw_stick(axis, loops, middle, branch, "slope kt while sticking" if reported else None)
        if loops.sliding[middle] > 0.0:
            # Small strokes that stick have no such line: the first one drawn has the label.
            named = "slope kr while sliding"
            new = named not in axis.get_legend_handles_labels()[1]
            _draw_sliding(axis, loops, middle, branch, named if new else None)


def _curve(loops: MeasuredLoops, *branches: LoopBranch) -> tuple[Array, Array]:
    """Return displacement [µm] and force [N] along branches."""
    samples = np.concatenate([branch.samples for branch in branches])
    return TO_MICRONS * loops.record.displacement[samples], loops.record.force[samples]


def _draw_stick(
    axis: Axes, loops: MeasuredLoops, cycle: int, branch: LoopBranch, label: str | None
) -> None:
    """Draw the slope at the beginning of a branch, over half of the height of the loop."""
    if np.isnan(loops.stick_stiffness[cycle]):
        return
    moved, force = _curve(loops, branch)
    height = branch.sense * np.array([0.0, loops.force[cycle]])
    motion = moved[0] + TO_MICRONS * height / loops.stick_stiffness[cycle]
    axis.plot(motion, force[0] + height, color=BLUE, lw=2.5, label=label)


def _draw_sliding(
    axis: Axes, loops: MeasuredLoops, cycle: int, branch: LoopBranch, label: str | None
) -> None:
    """Draw the sliding line over the part of a branch that it was fitted to."""
    moved, force = _curve(loops, branch)
    reach = moved[-1] - branch.sense * TO_MICRONS * loops.sliding[cycle] * loops.stroke[cycle]
    there = branch.sense * (moved - reach) >= 0.0
    ends = np.array([reach, moved[-1]])
    slope = loops.residual_stiffness[cycle] / TO_MICRONS
    line = force[there].mean() + slope * (ends - moved[there].mean())
    axis.plot(ends, line, color=ORANGE, lw=2.5, label=label)


def _friction(loops: MeasuredLoops) -> tuple[Array, str]:
    """Return the friction in the record, and its symbol with its unit."""
    values = np.where(loops.sliding > 0.0, loops.friction_force, loops.force)
    known = not np.isnan(loops.normal_load).any()
    values = values / loops.normal_load if known else values
    if loops.slides:
        return values, "µ" if known else "µN [N]"
    least = " at least" if not loops.sliding.any() else " (stuck: at least)"
    return values, f"µ{least}" if known else "force [N]"


def _draw_values(axis: Axes, values: Array, label: str, colour: str) -> None:
    axis.plot(np.arange(1, len(values) + 1), values, color=colour, marker="o", ms=4.0, lw=1.2)
    most = np.max(values, initial=0.0, where=np.isfinite(values))
    axis.set_ylim(0.0, HEADROOM * most if most > 0.0 else 1.0)
    axis.set_ylabel(label)


def _title(loops: MeasuredLoops, name: str) -> str:
    if (steps := int(loops.step[-1]) + 1) > 1:
        return f"{name}: {len(loops.energy)} loops in {steps} steps of similar strokes"
    values, label = _friction(loops)
    stick = PER_MICRON * loops.stick_estimate.value
    called, _, unit = label.partition(" [")
    unit = f" {unit.rstrip(']')}" if unit else ""
    equals = " " if called.endswith("least") else " = "
    known = f"kt = {rounded(stick)} N/µm, " if np.isfinite(stick) else ""
    return f"{name}: {known}{called}{equals}{rounded(float(values.mean()))}{unit}"
