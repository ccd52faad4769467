"""Pressure peaks at the rounded edges of a flank that the contact grid cuts off."""

from __future__ import annotations

from collections.abc import Iterator

from sa_solver.reference.flat_rounded import FlatRoundedPunch
from workflow.analyses.wear.structures.dovetail.case import DovetailCase
from workflow.case.text.readable import percent
from workflow.messages.warning_kinds import Notice, WarningKind
from workflow.models.contact import FaceContact

# Share of the edge peak, from a closed form, that the grid may miss.
PEAK_ERROR = 0.05


def warnings(case: DovetailCase, stage: FaceContact, load: float) -> Iterator[Notice]:
    """Yield a warning for each edge whose pressure peak the grid misses."""
    for edge, error in edge_peak_errors(case, stage, load).items():
        if abs(error) > PEAK_ERROR:
            yield Notice(
                WarningKind.EDGE_PEAK_MISSED,
                f"{stage.name}: the grid misses {percent(abs(error))} of the pressure peak at the "
                f"{edge}: refine contact.grid or increase structure.{edge}_radius",
            )


def edge_peak_errors(case: DovetailCase, stage: FaceContact, load: float) -> dict[str, float]:
    """Return the relative error of edge peaks on the grid, under a centred ``load``.

    The plane strain profile across the flank represents both kinds of edges: the peak at the slot
    ends is set by the same short side. The reference is the closed form.
    """
    if load <= 0.0:
        return {}
    dovetail = case.structure
    half_width = 0.5 * dovetail.flank_length
    width, radius = dovetail.end_width, dovetail.end_radius
    per_length, radii = load, {"edge": dovetail.edge_radius}
    if not (stage.grid.line or width is None or radius is None):
        per_length = load / (dovetail.slot_length - 2.0 * width)
        radii["end"] = radius
    modulus = stage.pair.contact_modulus
    return {
        edge: FlatRoundedPunch(half_width, radius, per_length, modulus).peak_error(pitch)
        for (edge, radius), pitch in zip(radii.items(), stage.grid.pitch, strict=False)
    }
