"""Layout of the results of two specimens."""

from __future__ import annotations

from workflow.analyses.wear.output.layout import CYCLES, FACE_MESH, KINETICS
from workflow.layout.declared import GRID, Layout

# Name of the pad's grid.
PAD = "pad"
# Fields at the nodes or cells of the pad; tractions are those of first loading.
_PAD = """
    pressure | MPa | {dims} | contact pressure
    shear_x | MPa | {dims} | shear on body 2 along x at the end of first loading
    cycle_slip | mm | {dims} | path of slip along x in a cycle
"""
_RING_LOOP = """
    ring_displacement | mm | point | motion of body 2's ring along x
    ring_force | N | point | force along x that moves body 2's ring
"""
LAYOUT = Layout.read(
    f"""
grid/{PAD}{GRID}
specimens/{PAD}{FACE_MESH.format(node="node", facet="facet")}
    area | mm^2 | node | contact area that belongs to each node
specimens/<body>
    full | Hz | mode | natural frequencies of the free body, finite elements
    reduced | Hz | mode | natural frequencies of the free body, reduced model
loads/<load>/kinetics{CYCLES}{KINETICS}
    energy_per_cycle | N mm | cycles | energy dissipated in a cycle
    stick_stiffness | N/mm | cycles | tangential stiffness with all contact stuck
    approach | mm | cycles | motion of body 1 towards body 2
    peak_pressure | MPa | cycles | largest pressure
    pressure_deviation | 1 | cycles | root mean square of pressure/mean - 1 over the pad
    friction | 1 | cycles | largest tangential over normal force
    stable_cycles | 1 | cycles | cycles of constant shape beyond which errors of shape grow
loads/<load>/states/<state>{_PAD.format(dims="node")}
    gap | mm | node | distance of the deformed faces
    worn_1, worn_2 | mm | node | worn depth of body #
    secant_stiffness | N/mm | | slope of the loop up to half of its largest force
loads/<load>/half_space/<shape>{_PAD.format(dims="x y")}
loads/<load>/states/<state>/loop, loads/<load>/half_space/<shape>/first_loading{_RING_LOOP}
loads/<load>/coupled_cycle{_RING_LOOP}
""",
    x=f"grid/{PAD}",
    y=f"grid/{PAD}",
)
