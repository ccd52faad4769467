"""The unit of length of a mesh file."""

from __future__ import annotations

from dataclasses import dataclass

# Units of length by their size in mm, and forces in N that go with them in a consistent system.
SIZES = {"mm": 1.0, "um": 1e-3, "cm": 10.0, "m": 1000.0, "in": 25.4, "ft": 304.8}
POUND_FORCE = 4.4482216152605
FORCES = dict.fromkeys(SIZES, 1.0) | dict.fromkeys(("in", "ft"), POUND_FORCE)


@dataclass(frozen=True)
class LengthUnit:
    """A unit of length: its ``name``, its ``size`` in mm, and why it is that one, in words.

    There is no ``source`` where nothing says it.

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
        """Size in N of the unit of force that forces of the file are taken to have."""
        return FORCES.get(self.name, 1.0)
