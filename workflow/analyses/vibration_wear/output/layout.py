"""Layout of the results of a vibration that wears its contact."""

from __future__ import annotations

from dataclasses import replace

from workflow.analyses.vibration.output import layout as vibration
from workflow.layout.declared import GRID, Layout
from workflow.models.vibration.amount import ExcitationSize


def layout_of(amount: ExcitationSize) -> Layout:
    """Return the layout of a case whose excitation has an amount: a force or a level."""
    response = "responses/<response>"
    curves = vibration.layout_of(amount).datasets(response)
    return replace(_LAYOUT, groups={**_LAYOUT.groups, f"worn/<state>/{response}": curves})


# Wear and slip at cells or nodes.
_WORN = """
    depth_1, depth_2 | mm | {dims} | worn from body #
    path | mm | {dims} | of slip in a cycle under the force that wears
"""
_LAYOUT = Layout.read(
    f"""
grid{GRID}
places
    area | mm^2 | node | area that belongs to each node
    normal | 1 | node axis | out of body 1, what the joints' points meet
    position | mm | node axis | of each node, x, y, z
    x, y | mm | node | of each node on the contact plane, from the middle of all
    name | 1 | node | of the point of each contact
evolution
    cycles | 1 | cycles | under the force that wears
    energy | N mm | cycles | dissipated so far
    volume | mm^3 | cycles | worn from both bodies
    depth | mm | cycles | largest of both bodies together
    area | mm^2 | cycles | in contact at rest
    touching | 1 | cycles | nodes in contact at rest
    peak_pressure | MPa | cycles | at rest
    step_error | 1 | cycles | that wear steps leave of depth or volume, the larger
    friction | 1 | cycles | coefficient
    stiffness | N/mm | cycles | of all that touches, stuck, by the opening of targets, or mean
    full_slip | mm | cycles | motion of the joint from rest at which all of it slides
    stroke | mm | cycles | of the joint from end to end, under the force that wears
    frequency | Hz | cycles | of the motion that wears
    energy_per_cycle | N mm | cycles | that joints dissipate under the force that wears
    work_per_cycle | N mm | cycles | of the force that wears
    damped_per_cycle | N mm | cycles | by the damping of the structure, in the same motion
    stuck | Hz | cycles mode | natural frequencies with the contact stuck
    resonance | Hz | cycles excitation | under each force
    receptance | mm/N | cycles excitation | largest amplitude of the last mass over each force
worn/<state>/contact
    pressure | MPa | x y | at rest
    gap | mm | x y | at rest
    onset | mm | x y | motion of the joint from rest up to which each cell sticks
    {_WORN.format(dims="x y")}
    energy | N/mm | x y | per area, in such a cycle
worn/<state>/sliders
    reach | mm | slider | motion at which each slider gives way
    stiffness | N/mm | slider | of its spring
    normal_load | N | slider | that presses it
    energy | N mm | slider | that it dissipates in a cycle under the force that wears
worn/<state>/loop
    displacement | mm | point | of the joint or the mean of all, or between the targets, under the
        force that wears
    force | N | point | of the joint along it
worn/<state>/half_space_loop
    displacement | mm | point | of the bodies, as far to and fro
    force | N | point | between them, of the whole tangential problem
worn/<state>/nodes
    gap | mm | node | of the worn bodies without load; below 0 what it closes
    normal_force | N | node | of each node at rest
    {_WORN.format(dims="node")}
    energy | N mm | node | that each node dissipates in such a cycle
""",
    x="grid",
    y="grid",
)
