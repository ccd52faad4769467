"""Unit of length of a mesh file."""

from __future__ import annotations

from dataclasses import dataclass

# Size of the units of length in mm, and the forces in N that belong to them in a consistent system.
SIZES = {"mm": 1.0, "um": 1e-3, "cm": 10.0, "m": 1000.0, "in": 25.4, "ft": 304.8}
POUND_FORCE = 4.4482216152605
FORCES = dict.fromkeys(SIZES, 1.0) | dict.fromkeys(("in", "ft"), POUND_FORCE)


@dataclass(frozen=True)
class LengthUnit:
    """Unit of length: its ``name``, its ``size`` in mm, and in words where it comes from.

    ``source`` is empty if the file states no unit.

    Examples
    --------
    >>> from fe_models.readers.length_unit import LengthUnit
    >>> print(LengthUnit())
    taken as mm, the file says no unit
    >>> print(LengthUnit("in", 25.4, "as joint.unv:2 says"))
    in in, as joint.unv:2 says, converted to mm
    """

    name: str = "mm"
    size: float = 1.0
    source: str = ""

    def __str__(self) -> str:
        if not self.source:
            return "taken as mm, the file says no unit"
        return f"in {self.name}, {self.source}" + ", converted to mm" * (self.size != 1.0)

    @property
    def force(self) -> float:
        """Size in N of the unit of force that forces of the file are assumed to have."""
        return FORCES.get(self.name, 1.0)
