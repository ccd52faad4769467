"""Layout of the results of a vibration that wears its contact."""

from __future__ import annotations

from workflow.analyses.vibration.output import layout as vibration
from workflow.analyses.vibration.output.outcome import RESPONSES
from workflow.analyses.vibration_wear.output.outcome import (
    CONTACT,
    EVOLUTION,
    HALF_SPACE,
    LOOP,
    NODES,
    PLACES,
    POSITION,
    SLIDERS,
    WORN,
)
from workflow.layout.declared import CELLS, GRID, Declarations, Layout, over
from workflow.models.vibration.amount import ExcitationSize


def layout_of(amount: ExcitationSize) -> Layout:
    """Return the layout of a case whose excitation has an amount: a force or a level."""
    response = f"{RESPONSES}/<response>"
    return Layout(
        {
            "grid": GRID,
            PLACES: _PLACES,
            EVOLUTION: _EVOLUTION,
            f"{WORN}/<state>/{CONTACT}": {
                **over(
                    CELLS,
                    pressure=("MPa", "at rest"),
                    gap=("mm", "at rest"),
                    onset=("mm", "motion of the joint from rest up to which each cell sticks"),
                ),
                **_worn(CELLS),
                **over(CELLS, energy=("N/mm", "per area, in such a cycle")),
            },
            f"{WORN}/<state>/{SLIDERS}": over(
                "slider",
                reach=("mm", "motion at which each slider gives way"),
                stiffness=("N/mm", "of its spring"),
                normal_load=("N", "that presses it"),
                energy=("N mm", "that it dissipates in a cycle under the force that wears"),
            ),
            f"{WORN}/<state>/{LOOP}": over(
                "point",
                displacement=(
                    "mm",
                    "of the joint or the mean of all, or between the targets, under the force that "
                    "wears",
                ),
                force=("N", "of the joint along it"),
            ),
            f"{WORN}/<state>/{HALF_SPACE}": over(
                "point",
                displacement=("mm", "of the bodies, as far to and fro"),
                force=("N", "between them, of the whole tangential problem"),
            ),
            f"{WORN}/<state>/{NODES}": {
                **over(
                    "node",
                    gap=("mm", "of the worn bodies without load; below 0 what it closes"),
                    normal_force=("N", "of each node at rest"),
                ),
                **_worn("node"),
                **over("node", energy=("N mm", "that each node dissipates in such a cycle")),
            },
            f"{WORN}/<state>/{response}": vibration.layout_of(amount).datasets(response),
        },
        coordinates=dict.fromkeys(GRID, "grid"),
    )


def _worn(dims: str) -> Declarations:
    """Return wear and slip at cells or nodes."""
    return over(
        dims,
        depth_1=("mm", "worn from body 1"),
        depth_2=("mm", "worn from body 2"),
        path=("mm", "of slip in a cycle under the force that wears"),
    )


_OVER_CYCLES, _OF_FORCES = "cycles", "cycles excitation"
_ON_PLANE = "of each node on the contact plane, from the middle of all"
_PLACES = {
    **over("node", area=("mm^2", "area that belongs to each node")),
    **over("node axis", normal=("1", "out of body 1, what the joints' points meet")),
    **over("node axis", **{POSITION: ("mm", "of each node, x, y, z")}),
    **over(
        "node", x=("mm", _ON_PLANE), y=("mm", _ON_PLANE), name=("1", "of the point of each contact")
    ),
}
_EVOLUTION = {
    **over(
        _OVER_CYCLES,
        cycles=("1", "under the force that wears"),
        energy=("N mm", "dissipated so far"),
        volume=("mm^3", "worn from both bodies"),
        depth=("mm", "largest of both bodies together"),
        area=("mm^2", "in contact at rest"),
        touching=("1", "nodes in contact at rest"),
        peak_pressure=("MPa", "at rest"),
        step_error=("1", "that wear steps leave of depth or volume, the larger"),
        friction=("1", "coefficient"),
        stiffness=(
            "N/mm",
            "of all that touches, stuck; over what opens between the targets, or their mean",
        ),
        full_slip=("mm", "motion of the joint from rest at which all of it slides"),
        stroke=("mm", "of the joint from end to end, under the force that wears"),
        frequency=("Hz", "of the motion that wears"),
        energy_per_cycle=("N mm", "that joints dissipate under the force that wears"),
        work_per_cycle=("N mm", "of the force that wears"),
        damped_per_cycle=("N mm", "by the damping of the structure, in the same motion"),
    ),
    **over("cycles mode", stuck=("Hz", "natural frequencies with the contact stuck")),
    **over(
        _OF_FORCES,
        resonance=("Hz", "under each force"),
        receptance=("mm/N", "largest amplitude of the last mass over the force, under each"),
    ),
}
