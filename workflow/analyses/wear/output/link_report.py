"""Report on the link of the structure to the contact: see :mod:`wear.contact.link`."""

from __future__ import annotations

from typing import Any

from wear.contact.link import StructureLink
from workflow.case.text.readable import percent
from workflow.models.checks.warnings import link_warnings
from workflow.shell.terminal.reporter import Reporter


def link_summary(link: StructureLink) -> dict[str, Any]:
    """Return the summary of the link to the unworn structure, with details if it is corrected.

    Displacements are relative to the deflection of the half-spaces at the largest load.
    """
    if not link.corrects:
        return {"corrected": False}
    bodies, misfit, graininess = link.quality.tolist()
    return {
        "corrected": True,
        "degrees": list(link.degrees),
        "region": link.region.tolist(),
        "bodies": bodies,
        "misfit": misfit,
        "graininess": graininess,
    }


def report_link(name: str, link: StructureLink, line: bool, reporter: Reporter) -> None:
    """Log how a contact is linked, and warn if the fit error exceeds the graininess."""
    if not link.corrects:
        reporter.log(f"{name}: the bodies are taken as half-spaces")
        return
    bodies, misfit, graininess = link.quality.tolist()
    axes = "x" if line else "xy"
    fit = ", ".join(
        f"of degree {degree} for {axis} of {low:.3g} to {high:.3g} mm"
        for axis, degree, low, high in zip(axes, link.degrees, *link.region, strict=False)
    )
    reporter.log(
        f"{name}: the bodies add {percent(bodies)} to the deformation of half-spaces; fitted by "
        f"polynomials {fit}, with errors of {percent(misfit)} (smooth) and {percent(graininess)} "
        "(grainy)"
    )
    reporter.warn_each(link_warnings(name, link))
