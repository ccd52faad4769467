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
    depth_1, depth_2 | mm | {dims} | worn depth of body #
    path | mm | {dims} | path of slip in a cycle under the force that wears
"""
_LAYOUT = Layout.read(
    f"""
grid{GRID}
places
    area | mm^2 | node | area that belongs to each node
    normal | 1 | node axis | outward normal of body 1, which the points of joints meet
    position | mm | node axis | position of each node, x, y, z
    x, y | mm | node | place of each node on the contact plane, from the middle of all
    name | 1 | node | name of the point of each contact
evolution
    cycles | 1 | cycles | cycles under the force that wears
    energy | N mm | cycles | energy dissipated so far
    volume | mm^3 | cycles | worn volume of both bodies
    depth | mm | cycles | largest worn depth of both bodies together
    area | mm^2 | cycles | area in contact at rest
    touching | 1 | cycles | nodes in contact at rest
    peak_pressure | MPa | cycles | largest pressure at rest
    step_error | 1 | cycles | error of depth or volume due to the wear steps, the larger
    friction | 1 | cycles | coefficient of friction
    stiffness | N/mm | cycles | stiffness of all that touches, stuck, by the opening of
        targets, or the mean
    full_slip | mm | cycles | motion of the joint from rest at which all of it slides
    stroke | mm | cycles | motion of the joint from end to end, under the force that wears
    frequency | Hz | cycles | frequency of the motion that wears
    energy_per_cycle | N mm | cycles | energy that joints dissipate under the force that wears
    work_per_cycle | N mm | cycles | work of the force that wears
    damped_per_cycle | N mm | cycles | energy lost to the damping of the structure, in the same
        motion
    stuck | Hz | cycles mode | natural frequencies with the contact stuck
    resonance | Hz | cycles excitation | resonance under each force
    receptance | mm/N | cycles excitation | largest amplitude of the last mass over each force
worn/<state>/contact
    pressure | MPa | x y | pressure at rest
    gap | mm | x y | gap at rest
    onset | mm | x y | motion of the joint from rest up to which each cell sticks
    {_WORN.format(dims="x y")}
    energy | N/mm | x y | energy dissipated per area in a cycle under the force that wears
worn/<state>/sliders
    reach | mm | slider | motion at which each slider gives way
    stiffness | N/mm | slider | stiffness of the slider's spring
    normal_load | N | slider | load that presses the slider
    energy | N mm | slider | energy that the slider dissipates in a cycle
worn/<state>/loop
    displacement | mm | point | motion of the joint, or the mean of all, or between the targets,
        under the force that wears
    force | N | point | force of the joint along this motion
worn/<state>/half_space_loop
    displacement | mm | point | motion of the bodies, equally far forward and backward
    force | N | point | force between them, of the whole tangential problem
worn/<state>/nodes
    gap | mm | node | gap of the worn bodies without load; below 0 where they overlap
    normal_force | N | node | force of each node at rest
    {_WORN.format(dims="node")}
    energy | N mm | node | energy that each node dissipates in a cycle under the force that wears
""",
    x="grid",
    y="grid",
)
