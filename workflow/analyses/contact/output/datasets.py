"""Datasets of loads, motions and tractions of a contact, for all analyses.

Extensive quantities are in the units of a contact over an area.
"""

from __future__ import annotations

from dataclasses import dataclass

from sa_solver.types import Array, LoadHistory
from workflow.shell.output.dataset import Dataset, described

# Name of the only interface of a contact case.
BODIES = "bodies"


@dataclass(frozen=True)
class ContactContents:
    """Contents of ``results.h5`` of a contact case: a ``line`` contact or one over an area.

    ``increments`` is the number of computed increments, not of all in the path.
    """

    line: bool
    increments: int


# Unit and description of the quantities of increments, ``(n,)`` each.
LOADS = {
    "P": ("N", "normal force on body 2"),
    "Qx": ("N", "tangential force on body 2 along x"),
    "Qy": ("N", "tangential force on body 2 along y"),
    "Mx": ("N mm", "moment of the pressure about x"),
    "My": ("N mm", "moment of the pressure about y"),
    "Mz": ("N mm", "moment of the shear about z"),
    "Edx": ("N mm", "energy dissipated in the increment by slip along x"),
    "Edy": ("N mm", "energy dissipated in the increment by slip along y"),
    "sliding": ("1", "whether the whole face slides"),
}
RIGID_MOTIONS = {
    "approach": ("mm", "motion of body 1 towards body 2"),
    "shift_x": ("mm", "motion of body 1 relative to body 2 along x"),
    "shift_y": ("mm", "motion of body 1 relative to body 2 along y"),
    "tilt_x": ("rad", "rotation of body 1 relative to body 2 about x"),
    "tilt_y": ("rad", "rotation of body 1 relative to body 2 about y"),
    "twist": ("rad", "rotation of body 1 relative to body 2 about z"),
}
# Columns for a mix of missions.
MISSIONS = {
    "share": ("1", "of the mission's cycles among all cycles of the mix"),
    "block": ("1", "mission of the mix, counted from 0"),
}


def load_columns(loads: LoadHistory) -> dict[str, Dataset]:
    """Return the columns of a load history, with those of a mix only if there is one."""
    quantities = LOADS | MISSIONS if loads.mixed else LOADS
    return described(quantities, (getattr(loads, name) for name in quantities))


def traction_fields(pressure: Array, shear: Array, slip: Array) -> dict[str, Dataset]:
    """Return tractions on body 2 and slip: ``(nx, ny)``, ``(2, nx, ny)`` and ``(2, nx, ny)``."""
    return {
        "pressure": pressure_field(pressure),
        "shear": shear_field(shear),
        "slip": slip_field(slip),
    }


def pressure_field(pressure: Array) -> Dataset:
    """Return the pressure at points of a contact."""
    return Dataset(pressure, "MPa", "contact pressure")


def shear_field(shear: Array) -> Dataset:
    """Return the shear at points of a contact, x and y."""
    what = "shear on body 2, x and y; in a wear run µp where the structure slips, else 0"
    return Dataset(shear, "MPa", what)


def slip_field(slip: Array) -> Dataset:
    """Return the slip at points of a contact, x and y."""
    return Dataset(slip, "mm", "slip of body 2 over body 1 in the increment, x and y")
