"""Measured surfaces on the flanks of a dovetail, as sections of a case."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import model_validator

from workflow.analyses.contact.surfaces import MeasuredSurface, SurfacesOfTwo
from workflow.case.sections import Section, disagreement, entry, one_of

FLANKS = ("intrados", "extrados")


class FlankSurfaces(SurfacesOfTwo):
    """Measured surfaces of one flank on disk, blade or both: rows up the flank, across the slot."""

    names: ClassVar[tuple[str, str]] = ("disk", "blade")
    also_filled_in: ClassVar[tuple[str, ...]] = ("disk",)
    in_schema: ClassVar[Mapping[str, Any]] = one_of("disk", "blade")

    disk: MeasuredSurface | None = entry(
        "surface of the disk's flank, seen from the slot: columns along y of the flank's frame",
        default=None,
    )
    blade: MeasuredSurface | None = entry(
        "surface of the blade's flank, seen from outside the root: columns against y", default=None
    )


class MeasuredFlanks(Section):
    """Measured surfaces of one or both flanks, added to the flat with its rounded edges."""

    also_filled_in: ClassVar[tuple[str, ...]] = ("intrados",)
    in_schema: ClassVar[Mapping[str, Any]] = one_of(*FLANKS)

    intrados: FlankSurfaces | None = entry(
        "flank at X > 0; y of its frame is the slot's direction", default=None
    )
    extrados: FlankSurfaces | None = entry(
        "flank at X < 0; y of its frame is against the slot's direction", default=None
    )

    @model_validator(mode="after")
    def _is_one(self) -> MeasuredFlanks:
        if not self.flanks:
            raise disagreement(f"no flank; allowed: {', '.join(FLANKS)} or both", FLANKS[0])
        return self

    @property
    def flanks(self) -> dict[str, FlankSurfaces]:
        """The measured surfaces that are given, by the name of their flank."""
        both = {name: getattr(self, name) for name in FLANKS}
        return {name: surfaces for name, surfaces in both.items() if surfaces is not None}
