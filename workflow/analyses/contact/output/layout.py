"""Layout of the results of a contact case, and loads and tractions for all analyses."""

from __future__ import annotations

from dataclasses import dataclass

from sa_solver.load_history import LoadHistory
from sa_solver.types import Array
from workflow.layout.declared import GRID, Layout, declared

# Name of the only interface of a contact case.
BODIES = "bodies"


@dataclass(frozen=True)
class ContactContents:
    """Contents of ``results.h5`` of a contact case: a ``line`` contact or one over an area.

    ``increments`` is the number of computed increments, not of all in the path.
    """

    line: bool
    increments: int


LOADS = """
    P | N | {dim} | normal force on body 2
    Qx | N | {dim} | tangential force on body 2 along x
    Qy | N | {dim} | tangential force on body 2 along y
    Mx | N mm | {dim} | moment of the pressure about x
    My | N mm | {dim} | moment of the pressure about y
    Mz | N mm | {dim} | moment of the shear about z
    Edx | N mm | {dim} | energy dissipated in the increment by slip along x
    Edy | N mm | {dim} | energy dissipated in the increment by slip along y
    sliding | 1 | {dim} | whether the whole face slides
"""
"""Quantities of the increments of a path or a cycle, along a dimension."""
RIGID_MOTIONS = """
    approach | mm | {dim} | motion of body 1 towards body 2
    shift_x | mm | {dim} | motion of body 1 relative to body 2 along x
    shift_y | mm | {dim} | motion of body 1 relative to body 2 along y
    tilt_x | rad | {dim} | rotation of body 1 relative to body 2 about x
    tilt_y | rad | {dim} | rotation of body 1 relative to body 2 about y
    twist | rad | {dim} | rotation of body 1 relative to body 2 about z
"""
LOAD_HISTORY = f"""{LOADS.format(dim="increment")}
    share | 1 | increment | share of the mission's cycles among all cycles of the mix
    block | 1 | increment | mission of the mix, counted from 0
"""
"""Loads of a cycle; the last two are those of a mix of missions."""
TRACTIONS = """
    pressure | MPa | {cells} | contact pressure
    shear | MPa | {vectors} | shear on body 2, x and y; in a wear run µp where the structure slips,
        else 0
    slip | mm | {vectors} | slip of body 2 over body 1 in the increment, x and y
"""
ON_GRID = TRACTIONS.format(cells="x y", vectors="component x y")
LAYOUT = Layout.read(
    f"""
grid/{BODIES}{GRID}
surfaces/{BODIES}
    height | mm | x y | gap before loading
path{LOADS.format(dim="row")}{RIGID_MOTIONS.format(dim="row")}
    bulk_stress_1 | MPa | row | stress along x in body 1 far below the contact
    bulk_stress_2 | MPa | row | stress along x in body 2 far above the contact
history
    increment | 1 | increment | row of the path, counted from 1
    {LOADS.format(dim="increment")}{RIGID_MOTIONS.format(dim="increment")}
contact/{BODIES}/<increment>{ON_GRID}
    gap | mm | x y | distance of the deformed faces
    sticking | 1 | x y | whether the cell is pressed and its shear below µp
    limit | MPa | x y | largest shear; only where friction depends on place or pressure
    flattening | mm | x y | depth by which the surfaces have yielded so far; only with a hardness
""",
    x=f"grid/{BODIES}",
    y=f"grid/{BODIES}",
)


def load_columns(loads: LoadHistory) -> dict[str, Array]:
    """Return the columns of a load history, with those of a mix only if there is one."""
    names = declared(LOAD_HISTORY if loads.mixed else LOADS)
    return {name: getattr(loads, name) for name in names}
