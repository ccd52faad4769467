"""Layout of the results of two specimens."""

from __future__ import annotations

from workflow.analyses.wear.output.layout import CYCLES, KINETICS, face_mesh
from workflow.layout.declared import CELLS, GRID, Declarations, Layout, over

# Name of the pad's grid.
PAD = "pad"


def _pad_fields(dims: str) -> Declarations:
    """Return fields at the nodes or cells of the pad; tractions are those of first loading."""
    return over(
        dims,
        pressure=("MPa", "contact pressure"),
        shear_x=("MPa", "shear on body 2 along x at the end of first loading"),
        cycle_slip=("mm", "path of slip along x in a cycle"),
    )


_RING_LOOP = over(
    "point",
    ring_displacement=("mm", "motion of body 2's ring along x"),
    ring_force=("N", "force along x that moves body 2's ring"),
)
LAYOUT = Layout(
    {
        f"grid/{PAD}": GRID,
        f"specimens/{PAD}": {
            **face_mesh(),
            **over("node", area=("mm^2", "of contact area that belongs to each node")),
        },
        "specimens/<body>": over(
            "mode",
            full=("Hz", "natural frequencies of the free body, finite elements"),
            reduced=("Hz", "natural frequencies of the free body, reduced model"),
        ),
        "loads/<load>/kinetics": {
            **CYCLES,
            **KINETICS,
            **over(
                "cycles",
                energy_per_cycle=("N mm", "energy dissipated in a cycle"),
                stick_stiffness=("N/mm", "tangential stiffness with all that touches stuck"),
                approach=("mm", "motion of body 1 towards body 2"),
                peak_pressure=("MPa", "largest pressure"),
                pressure_deviation=("1", "root mean square of pressure/mean - 1 over the pad"),
                friction=("1", "largest tangential over normal force"),
                stable_cycles=("1", "cycles of constant shape beyond which errors of shape grow"),
            ),
        },
        "loads/<load>/states/<state>": {
            **_pad_fields("node"),
            **over(
                "node",
                gap=("mm", "distance of the deformed faces"),
                worn_1=("mm", "worn depth of body 1"),
                worn_2=("mm", "worn depth of body 2"),
            ),
            **over(
                "", secant_stiffness=("N/mm", "slope of the loop up to half of its largest force")
            ),
        },
        "loads/<load>/states/<state>/loop": _RING_LOOP,
        "loads/<load>/half_space/<shape>": _pad_fields(CELLS),
        "loads/<load>/half_space/<shape>/first_loading": _RING_LOOP,
        "loads/<load>/coupled_cycle": _RING_LOOP,
    },
    coordinates=dict.fromkeys(GRID, f"grid/{PAD}"),
)
