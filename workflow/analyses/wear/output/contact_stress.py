"""Stress under the contacts of a wear run: warnings, entries of results and of the summary."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from sa_solver.half_space.stress import von_mises
from sa_solver.half_space.subsurface import COMPONENTS
from sa_solver.ties import first_largest
from sa_solver.types import Array
from workflow.analyses.wear.case.base import WearCase
from workflow.case.text.readable import percent
from workflow.messages.warning_kinds import WarningKind
from workflow.models.stress.contact_stress import STUCK_SHARE, BodyStress, InterfaceStress
from workflow.models.stress.layout import MOMENTS
from workflow.shell.output.results import ResultsWriter
from workflow.shell.terminal.reporter import Reporter

# Ruiz's maps that the summary reports; of other parameters it reports the parameter alone.
RUIZ = ("cracking_parameter", "friction_parameter", "tension")


# --- results --------------------------------------------------------------------------------------


def write_stress(writer: ResultsWriter, stress: InterfaceStress, case: WearCase) -> None:
    """Write the section to ``stress/section`` and maps to ``stress/life``, by interface."""
    if stress.planes.settings.section != "none":
        _write_section(writer, f"stress/section/{stress.name}", stress, case)
    if stress.mapped:
        _write_life(writer, f"stress/life/{stress.name}", stress)


def _write_section(
    writer: ResultsWriter, group: str, stress: InterfaceStress, case: WearCase
) -> None:
    planes, terms = stress.planes, case.terms(stress.name)
    attributes = {"axis": planes.settings.section, "at": planes.at, "components": COMPONENTS}
    attributes["bulk_stress"] = stress.bulk
    limits = {n: terms.materials[n - 1].yield_stress for n in terms.strained}
    attributes |= {f"yield_stress_{n}": y for n, y in limits.items() if np.isfinite(y)}
    writer.put(group, {"along": planes.along, "depths": planes.depths}, **attributes)
    for moment, contact in stress.moments.items():
        for number, body in contact.bodies.items():
            assert body.section is not None
            section = {"stress": body.section, "von_mises": von_mises(body.section)}
            writer.put(f"{group}/{moment}/body_{number}", section)


def _write_life(writer: ResultsWriter, group: str, stress: InterfaceStress) -> None:
    for moment, contact in stress.moments.items():
        writer.put(f"{group}/{moment}", {"left_out": contact.left_out})
        for number, body in contact.bodies.items():
            writer.put(f"{group}/{moment}/body_{number}", body.maps)
    settings = stress.planes.settings
    attributes = {"parameter": settings.parameter, "depth": settings.critical_distance}
    writer.put(group, {}, **attributes, bulk_stress=stress.bulk)


# --- summary --------------------------------------------------------------------------------------


def stress_summary(stress: InterfaceStress, case: WearCase) -> dict[str, Any]:
    """Return the largest values, their places and their ratios worn to unworn, by body."""
    numbers: dict[str, Any] = {"convolutions": stress.convolutions, "bulk": stress.bulk}
    settings = stress.planes.settings
    if settings.section != "none":
        numbers["von_mises"] = _of_bodies(stress, case, partial(_largest_von_mises, stress))
    if not stress.mapped:
        return numbers
    numbers["left_out"] = {m: len(contact.left_out) for m, contact in stress.moments.items()}
    for name in RUIZ if settings.parameter == "ruiz" else (settings.parameter,):
        numbers[name] = _of_bodies(stress, case, partial(_largest, stress, name))
    return numbers


def _of_bodies(
    stress: InterfaceStress, case: WearCase, largest: Callable[[BodyStress], dict[str, float]]
) -> dict[str, Any]:
    numbers = {}
    for number in case.terms(stress.name).strained:
        values = {m: largest(moment.bodies[number]) for m, moment in stress.moments.items()}
        before, after = (values[moment]["value"] for moment in MOMENTS)
        name = case.bodies[number - 1]
        numbers[name] = values | {"ratio": after / before if before else None}
    return numbers


def _largest_von_mises(stress: InterfaceStress, body: BodyStress) -> dict[str, float]:
    assert body.section is not None
    # Stress outside the body is nan.
    values, planes = np.nan_to_num(von_mises(body.section)), stress.planes
    i, k = np.unravel_index(first_largest(values), values.shape)
    along, across = ("y", "x") if planes.settings.section == "y" else ("x", "y")
    place = {along: float(planes.along[i]), across: planes.at, "depth": float(planes.depths[k])}
    return {"value": float(values.max()), **place}


def _largest(stress: InterfaceStress, name: str, body: BodyStress) -> dict[str, float]:
    values = body.maps[name]
    grid, depth = stress.planes.grid, stress.planes.settings.critical_distance
    i, j = np.unravel_index(first_largest(values), values.shape)
    place = {"x": float(grid.x[i, 0]), "y": float(grid.y[0, j])}
    return {"value": float(values.max()), **place, "depth": depth}


# --- warnings -------------------------------------------------------------------------------------


def report_stress(
    stresses: Sequence[InterfaceStress], peak: int, with_structure: bool, reporter: Reporter
) -> None:
    """Report what the stress under the contacts lacks; ``peak`` is the increment of peak load."""
    _report_stick(np.array([stress.stuck for stress in stresses]), peak, reporter)
    for stress in stresses:
        if not with_structure:
            reporter.log(
                f"{stress.name}: the stress under the contact is that of its tractions alone"
            )
        elif warning := stress.carried_warning:
            reporter.warn(*warning)


def _report_stick(unknown: Array, peak: int, reporter: Reporter) -> None:
    """Warn of increments with unknown shear, given its load share ``unknown`` ``(contacts, t)``."""
    why = "contact.method: normal does not know the shear where a contact sticks; full does"
    worst = unknown.max(axis=0)
    if worst[peak] > STUCK_SHARE:
        reporter.warn(
            WarningKind.UNKNOWN_SHEAR,
            f"up to {percent(worst[peak])} of the peak load sticks, so stress.section lacks its "
            f"shear, and stress.life the stress of that increment: {why}",
        )
    if count := int((worst > STUCK_SHARE).sum()):
        reporter.warn(
            WarningKind.UNKNOWN_SHEAR,
            f"stress.life leaves out {count} of {len(worst)} increments, in which up to "
            f"{percent(worst.max())} of the load sticks: {why}",
        )
