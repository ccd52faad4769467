"""Layout of the results of a contact case, and loads and tractions for all analyses."""

from __future__ import annotations

from dataclasses import dataclass

from sa_solver.types import Array, LoadHistory
from workflow.layout.declared import CELLS, GRID, Declarations, Layout, over

# Name of the only interface of a contact case.
BODIES = "bodies"


@dataclass(frozen=True)
class ContactContents:
    """Contents of ``results.h5`` of a contact case: a ``line`` contact or one over an area.

    ``increments`` is the number of computed increments, not of all in the path.
    """

    line: bool
    increments: int


# Dimensions of a vector field along the face, of components x and y.
VECTOR = f"component {CELLS}"


def loads_over(dim: str) -> Declarations:
    """Return the quantities of the increments of a path or cycle, along a dimension."""
    return over(
        dim,
        P=("N", "normal force on body 2"),
        Qx=("N", "tangential force on body 2 along x"),
        Qy=("N", "tangential force on body 2 along y"),
        Mx=("N mm", "moment of the pressure about x"),
        My=("N mm", "moment of the pressure about y"),
        Mz=("N mm", "moment of the shear about z"),
        Edx=("N mm", "energy dissipated in the increment by slip along x"),
        Edy=("N mm", "energy dissipated in the increment by slip along y"),
        sliding=("1", "whether the whole face slides"),
    )


def rigid_motions_over(dim: str) -> Declarations:
    """Return the rigid motions of the increments of a path, along a dimension."""
    return over(
        dim,
        approach=("mm", "motion of body 1 towards body 2"),
        shift_x=("mm", "motion of body 1 relative to body 2 along x"),
        shift_y=("mm", "motion of body 1 relative to body 2 along y"),
        tilt_x=("rad", "rotation of body 1 relative to body 2 about x"),
        tilt_y=("rad", "rotation of body 1 relative to body 2 about y"),
        twist=("rad", "rotation of body 1 relative to body 2 about z"),
    )


# Loads of a cycle; the last two are those of a mix of missions.
LOAD_HISTORY = {
    **loads_over("increment"),
    **over(
        "increment",
        share=("1", "of the mission's cycles among all cycles of the mix"),
        block=("1", "mission of the mix, counted from 0"),
    ),
}
TRACTIONS = {
    **over(CELLS, pressure=("MPa", "contact pressure")),
    **over(
        VECTOR,
        shear=(
            "MPa",
            "shear on body 2, x and y; in a wear run µp where the structure slips, else 0",
        ),
        slip=("mm", "slip of body 2 over body 1 in the increment, x and y"),
    ),
}
# Results of a contact case.
LAYOUT = Layout(
    {
        f"grid/{BODIES}": GRID,
        f"surfaces/{BODIES}": over(CELLS, height=("mm", "gap before loading")),
        "path": {
            **loads_over("row"),
            **rigid_motions_over("row"),
            **over(
                "row",
                bulk_stress_1=("MPa", "stress along x in body 1 far below the contact"),
                bulk_stress_2=("MPa", "stress along x in body 2 far above the contact"),
            ),
        },
        "history": {
            **over("increment", increment=("1", "row of the path, counted from 1")),
            **loads_over("increment"),
            **rigid_motions_over("increment"),
        },
        f"contact/{BODIES}/<increment>": {
            **TRACTIONS,
            **over(
                CELLS,
                gap=("mm", "distance of the deformed faces"),
                sticking=("1", "whether the cell is pressed and its shear below µp"),
            ),
        },
    },
    coordinates=dict.fromkeys(GRID, f"grid/{BODIES}"),
)


def load_columns(loads: LoadHistory) -> dict[str, Array]:
    """Return the columns of a load history, with those of a mix only if there is one."""
    names = LOAD_HISTORY if loads.mixed else loads_over("increment")
    return {name: getattr(loads, name) for name in names}
