"""Main results of a wear run: what every contact has lost, and the pressures and stresses there."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.layout import MOMENTS, RESULTS
from workflow.analyses.wear.measures import interfaces
from workflow.shell.analysis import Summary
from workflow.shell.dataset import unit_in
from workflow.shell.quantities import CurvesOf, Quantity
from workflow.shell.summary import estimate, told

# Estimated errors are totals of the error budget.
BUDGET = "all parts of the error budget below"
STRUCTURE = "structure"
# Fretting parameters: unit and name.
PARAMETERS = {
    "cracking_parameter": ("N^2/mm^3", "Ruiz's cracking parameter"),
    "smith_watson_topper": ("MPa", "Smith-Watson-Topper parameter"),
    "findley": ("MPa", "Findley's parameter"),
}
# What runs are compared by, beside the numbers.
CURVES = (
    CurvesOf("depth worn from body 1", "kinetics/cycles", "kinetics/*/depth_1"),
    CurvesOf("depth worn from body 2", "kinetics/cycles", "kinetics/*/depth_2"),
    CurvesOf("volume worn from body 1", "kinetics/cycles", "kinetics/*/volume_1"),
    CurvesOf("volume worn from body 2", "kinetics/cycles", "kinetics/*/volume_2"),
    CurvesOf("pressure across the middle, unworn", "grid/*", "contact/*/00000/pressure"),
    CurvesOf("pressure across the middle, worn", "grid/*", "contact/*/-1/pressure"),
    CurvesOf("tangential loop, worn", "loops/*/-1/displacement", "loops/*/-1/force"),
)


def main_results(case: WearCase, summary: Summary) -> list[Quantity]:
    """Of every interface, and the largest stresses of the structure if there is one."""
    quantities = [
        quantity
        for name in interfaces(summary)
        for quantity in (*_worn(case, summary, name), *_stressed(case, summary, name))
    ]
    return told(summary, [*quantities, *_of_structure(case, summary)])


def named(body: str) -> str:
    """A body in words: names of bodies are keys."""
    return body.replace("_", " ")


def _worn(case: WearCase, summary: Summary, name: str) -> Iterator[Quantity]:
    """Wear, pressures and loads of an interface."""
    line = summary["per_length"]
    of = partial(Quantity, name)
    results = "depth", "volume", "peak_pressure", "worn_peak_pressure"
    error = {key: _budgeted(summary, name, key) for key in results}
    for number, body in enumerate(case.bodies, 1):
        text = f"largest depth worn from {named(body)}"
        yield of(text, f"{name}.depth_{number}", "mm", **error["depth"])
    for number, body in enumerate(case.bodies, 1):
        unit = unit_in(line, "mm^3")
        yield of(
            f"volume worn from {named(body)}", f"{name}.volume_{number}", unit, **error["volume"]
        )
    yield of("worn area", f"{name}.worn_area", unit_in(line, "mm^2"))
    pressures = zip(MOMENTS, ("peak_pressure", "worn_peak_pressure"), strict=True)
    for moment, of_pressure in pressures:
        path = f"{name}.peak_pressure.{moment}"
        yield of(f"largest pressure, {moment}", path, "MPa", **error[of_pressure])
    yield of("contact area at peak load, worn", f"{name}.area", unit_in(line, "mm^2"))
    for load, text in (("P", "normal force P"), ("Qx", "tangential force Qx")):
        for moment in MOMENTS:
            path = f"{name}.peak_load.{moment}.{load}"
            yield of(f"{text} at peak load, {moment}", path, unit_in(line, "N"))
    yield of("largest slip path in a cycle, unworn", f"{name}.slip_per_cycle", "mm")
    for wears in ("half_space", "nodes"):
        path = f"{name}.energy_per_cycle.{wears}"
        yield of("energy dissipated in a cycle, unworn", path, unit_in(line, "N mm"))
    yield of("energy dissipated by all cycles", f"{name}.energy", unit_in(line, "N mm"))


def _stressed(case: WearCase, summary: Summary, name: str) -> Iterator[Quantity]:
    """Tangential loops, stress and fretting parameters under an interface."""
    of, per = partial(Quantity, name), "/mm" if summary["per_length"] else ""
    for moment in MOMENTS:
        path = f"{name}.loops.{moment}"
        text, unit = f"tangential stiffness of the loop, {moment}", f"N/mm{per}"
        yield of(text, f"{path}.kt", unit, everyday=f"N/um{per}")
        text = f"energy of the tangential loop, {moment}"
        yield of(text, f"{path}.energy_per_loop", f"N mm{per}")
    error = _budgeted(summary, name, "life")
    for key, (unit, text) in {"von_mises": ("MPa", "von Mises stress"), **PARAMETERS}.items():
        for body in case.bodies:
            for moment in MOMENTS:
                known = error if key in PARAMETERS and moment == "worn" else {}
                path = f"{name}.stress.{key}.{body}.{moment}.value"
                yield of(
                    f"largest {text} under the face of {named(body)}, {moment}", path, unit, **known
                )


def _budgeted(summary: Summary, name: str, result: str) -> dict[str, Any]:
    """The total of the error budget of a result, and where its parts are."""
    path = f"{name}.error.{result}"
    known = estimate(summary, f"{path}.total", BUDGET)
    return known | {"budget": (RESULTS[result], path)} if known else {}


def _of_structure(case: WearCase, summary: Summary) -> Iterator[Quantity]:
    """The largest stress off the contact faces, unworn and worn."""
    for body in case.bodies:
        for moment in MOMENTS:
            path = f"{STRUCTURE}.peak_stress.{moment}.{body}.notch"
            known = estimate(summary, f"{path}.error", "what the mesh leaves of the stress")
            text = f"largest von Mises stress on the free surface of {named(body)}, {moment}"
            yield Quantity(STRUCTURE, text, f"{path}.von_mises", "MPa", **known)
