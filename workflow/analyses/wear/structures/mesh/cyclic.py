"""Cyclic symmetry of the bodies of a user's mesh, as a section of a case."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Annotated, Protocol

import numpy as np
from pydantic import model_validator

from workflow.analyses.wear.structures.mesh.load import Coordinate, Direction, Name
from workflow.case.fields import ScalarOrList, Whole
from workflow.case.sections import Section, disagreement, entry

if TYPE_CHECKING:
    from fe_models.cyclic import cuts as fe
    from fe_models.meshes.structure_mesh import StructureMesh
    from sa_solver.types import Indices
    from workflow.analyses.wear.structures.mesh.contacts import SupportSection
    from workflow.analyses.wear.structures.mesh.loads import Load

# Distance between matching cuts [mm] up to which they count as exact and nothing is reported.
EXACT = 1e-9

Boundaries = Annotated[tuple[Name, ...], ScalarOrList()]


class CyclicCuts(Section):
    """Cyclic symmetry: the bodies are one of equal sectors of a wheel, with equal loads in each.

    The displacements of both cuts are equal, turned by 360°/sectors about the axis (nodal diameter
    0).
    """

    low: Boundaries = entry("boundary of one cut of a body, or several that form one", "disk_low")
    high: Boundaries = entry("boundary of the other cut, or several", "disk_high")
    sectors: Annotated[int, Whole(2, 10_000)] = entry("number of equal sectors of the wheel", 24)
    axis: Direction = entry("direction of the axis [1]", [0.0, 1.0, 0.0], default=(0.0, 1.0, 0.0))
    through: tuple[Coordinate, Coordinate, Coordinate] = entry(
        "a point on the axis [mm]", [0.0, 0.0, 0.0], default=(0.0, 0.0, 0.0)
    )

    @model_validator(mode="after")
    def _is_complete(self) -> CyclicCuts:
        for key in ("low", "high"):
            if not getattr(self, key):
                raise disagreement("none; allowed: one boundary or several", key)
        if both := sorted(set(self.low) & set(self.high)):
            raise disagreement(
                f"{both[0]} is on both cuts; allowed: different boundaries", "high", "low"
            )
        return self

    def described(self) -> fe.Cyclic:
        """Return the cuts as the structure takes them."""
        from fe_models.cyclic.cuts import Cyclic

        axis, through = np.array(self.axis), np.array(self.through)
        return Cyclic(self.low, self.high, axis, through, self.sectors)

    def outline(self, mesh: StructureMesh) -> str:
        """Return a description of the cuts for the outline before a run."""
        from fe_models.cyclic.sector import sector_cuts

        low, high = (" + ".join(names) for names in (self.low, self.high))
        parts = []
        for pair in (pair for cuts in sector_cuts(mesh, [self.described()]) for pair in cuts):
            meet = "match node to node" if pair.matched else "do not match and are tied by a mortar"
            off = f", {1e3 * pair.max_distance:.2g} µm off" if pair.max_distance > EXACT else ""
            parts.append(f"{low} and {high} {meet}{off}")
        return f"one of {self.sectors}: {', '.join(parts)}"


class _Structure(Protocol):
    """A structure section with cuts, supports and loads."""

    @property
    def cyclic(self) -> Sequence[CyclicCuts]: ...
    @property
    def supports(self) -> Sequence[SupportSection]: ...
    @property
    def loads(self) -> Sequence[Load]: ...


def check_sector(
    structure: _Structure,
    mesh: StructureMesh,
    numbers: Mapping[str, Indices],
    pointing_at: Callable[[str], AbstractContextManager[None]],
) -> None:
    """Refuse cuts that do not match, and supports or loads that differ between sectors.

    ``numbers`` are the node numbers of the file, by body; ``pointing_at`` attributes a
    :class:`MeshError` to a case entry.
    """
    from fe_models.cyclic.sector import (
        check_cuts,
        check_off_cuts,
        check_same_in_all_sectors,
        check_temperatures,
        sector_cuts,
    )

    cyclic = [pair.described() for pair in structure.cyclic]
    found = sector_cuts(mesh, [])
    for index, cuts in enumerate(cyclic):
        for key, names in (("low", cuts.low), ("high", cuts.high)):
            with pointing_at(f"structure.cyclic.{index}.{key}"):
                check_cuts(mesh.bodies, cuts, names)
        with pointing_at(f"structure.cyclic.{index}"):
            found = sector_cuts(mesh, cyclic[: index + 1])
    for index, support in enumerate(structure.supports):
        with pointing_at(f"structure.supports.{index}.group"):
            check_off_cuts(mesh.bodies, support.group, cyclic)
    for index, load in enumerate(structure.loads):
        with pointing_at(f"structure.loads.{index}"):
            described = load.described()
            check_same_in_all_sectors(mesh.bodies, described, cyclic)
            check_temperatures(mesh, numbers, described, found)
