"""Settings of the stress of a wear model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Grid
from workflow.models.checks.limits import MOST_POINTS

SECTIONS = "x", "y", "none"
PARAMETERS = "ruiz", "smith_watson_topper", "findley", "none"


@dataclass(frozen=True)
class Stress:
    """Stress of the bodies of a wear model and of each contact, on unworn and on worn surfaces.

    The bodies of a structure of finite elements have their stress at peak load. Under each contact
    there are a section at peak load, and a map of a parameter of fretting life.

    Parameters
    ----------
    section : {"x", "y", "none"}
        Plane of the section: x, across the face; y, along it (not in a line contact).
    at : float
        Position of the plane on the other axis, from the middle [mm].
    depth : float
        Depth of the section [mm].
    points : int
        Points of the section over its depth, denser towards the surface.
    parameter : {"ruiz", "smith_watson_topper", "findley", "none"}
        Parameter of fretting life: friction work times tension, or the worst over all planes.
    critical_distance : float
        Depth of the map [mm], at which sections begin. Stress on the surface itself depends on the
        grid.
    sensitivity : float
        Weight k of the normal stress in Findley's parameter.

    Examples
    --------
    Findley's parameter 30 µm below the contacts, without a section:

    >>> import fretscale
    >>> stress = fretscale.Stress("none", parameter="findley", critical_distance=0.03)
    >>> print(stress.under_contacts)
    True
    """

    section: Literal["x", "y", "none"] = "x"
    at: float = 0.0
    depth: float = 2.0
    points: int = 24
    parameter: Literal["ruiz", "smith_watson_topper", "findley", "none"] = "ruiz"
    critical_distance: float = 0.02
    sensitivity: float = 0.3

    def __post_init__(self) -> None:
        checks.choices(self, section=SECTIONS, parameter=PARAMETERS)
        checks.numbers(self, "at")
        checks.numbers(self, "critical_distance", above=0.0)
        checks.numbers(self, "depth", above=self.critical_distance)
        checks.numbers(self, "sensitivity", least=0.0)
        checks.wholes(self, "points", least=2, most=MOST_POINTS)

    @property
    def under_contacts(self) -> bool:
        """True if any stress under the contacts is to be computed."""
        return self.section != "none" or self.parameter != "none"

    def check(self, grid: Grid) -> None:
        """Raise InputError for a section that does not cut a contact's grid."""
        if self.section == "none":
            return
        if self.section == "y" and grid.line:
            raise InputError("section: y: a line contact has no length along y; allowed: x, none")
        reach = 0.5 * grid.size[1 if self.section == "x" else 0]
        if abs(self.at) > reach:
            raise InputError(
                f"at: {self.at:g} mm is outside the contact's grid; allowed: {-reach:.4g} "
                f"to {reach:.4g} mm"
            )
