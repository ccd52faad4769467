"""Loads, motions and tractions of a contact as datasets, whichever analysis has them.

Extensive quantities are in the units of a contact over an area.
"""

from __future__ import annotations

from dataclasses import dataclass

from sa_solver.types import Array, LoadHistory, Mask
from workflow.shell.dataset import Dataset

# Name of the only interface of a contact case.
BODIES = "bodies"


@dataclass(frozen=True)
class Contents:
    """What ``results.h5`` of a contact case holds: a ``line`` contact or one over an area.

    ``increments`` are computed, not only prescribed.
    """

    line: bool
    increments: int


def resultant_columns(
    P: Array, Qx: Array, Qy: Array, Mx: Array, My: Array, Mz: Array
) -> dict[str, Dataset]:
    """Forces and moments on body 2, ``(n,)`` each."""
    return {
        "P": Dataset(P, "N", "normal force on body 2"),
        "Qx": Dataset(Qx, "N", "tangential force on body 2 along x"),
        "Qy": Dataset(Qy, "N", "tangential force on body 2 along y"),
        "Mx": Dataset(Mx, "N mm", "moment of the pressure about x"),
        "My": Dataset(My, "N mm", "moment of the pressure about y"),
        "Mz": Dataset(Mz, "N mm", "moment of the shear about z"),
    }


def energy_columns(Edx: Array, Edy: Array) -> dict[str, Dataset]:
    """Energies of increments, ``(n,)`` each."""
    return {
        "Edx": Dataset(Edx, "N mm", "energy dissipated in the increment by slip along x"),
        "Edy": Dataset(Edy, "N mm", "energy dissipated in the increment by slip along y"),
    }


def motion_columns(
    approach: Array, shift_x: Array, shift_y: Array, tilt_x: Array, tilt_y: Array, twist: Array
) -> dict[str, Dataset]:
    """Rigid motions of body 1, ``(n,)`` each."""
    return {
        "approach": Dataset(approach, "mm", "motion of body 1 towards body 2"),
        "shift_x": Dataset(shift_x, "mm", "motion of body 1 relative to body 2 along x"),
        "shift_y": Dataset(shift_y, "mm", "motion of body 1 relative to body 2 along y"),
        "tilt_x": Dataset(tilt_x, "rad", "rotation of body 1 relative to body 2 about x"),
        "tilt_y": Dataset(tilt_y, "rad", "rotation of body 1 relative to body 2 about y"),
        "twist": Dataset(twist, "rad", "rotation of body 1 relative to body 2 about z"),
    }


def sliding_column(sliding: Mask) -> Dataset:
    """Which increments ``(n,)`` slide."""
    return Dataset(sliding, "1", "whether the whole face slides")


def load_columns(loads: LoadHistory) -> dict[str, Dataset]:
    """The columns of a load history; those of a mix only where there is one."""
    columns = {
        **resultant_columns(loads.P, loads.Qx, loads.Qy, loads.Mx, loads.My, loads.Mz),
        **energy_columns(loads.Edx, loads.Edy),
        "sliding": sliding_column(loads.sliding),
    }
    if loads.mixed:
        share = "of the mission's cycles among all cycles of the mix"
        columns |= {
            "share": Dataset(loads.share, "1", share),
            "block": Dataset(loads.block, "1", "mission of the mix, counted from 0"),
        }
    return columns


def traction_fields(pressure: Array, shear: Array, slip: Array) -> dict[str, Dataset]:
    """Tractions on body 2 and slip: ``(nx, ny)``, ``(2, nx, ny)`` and ``(2, nx, ny)``."""
    return {
        "pressure": pressure_field(pressure),
        "shear": shear_field(shear),
        "slip": slip_field(slip),
    }


def pressure_field(pressure: Array) -> Dataset:
    """Pressure at points of a contact."""
    return Dataset(pressure, "MPa", "contact pressure")


def shear_field(shear: Array) -> Dataset:
    """Shear at points of a contact, x and y."""
    what = "shear on body 2, x and y; in a wear run µp where the structure slips, else 0"
    return Dataset(shear, "MPa", what)


def slip_field(slip: Array) -> Dataset:
    """Slip at points of a contact, x and y."""
    return Dataset(slip, "mm", "slip of body 2 over body 1 in the increment, x and y")
