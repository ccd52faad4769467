"""Main results of a wear run: wear of every contact, and pressures and stresses there."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.output.layout import RESULTS
from workflow.analyses.wear.output.measures import interfaces
from workflow.layout.declared import unit_in
from workflow.models.stress.layout import MOMENTS
from workflow.shell.analysis import Summary
from workflow.shell.output.quantities import CurvesOf, SummaryQuantity
from workflow.shell.output.summary import estimate, number_at, reported

# Source of estimated errors in the report: totals of the error budget.
BUDGET = "all parts of the error budget below"
LOOP_ERROR = "grid and increments of the loop, but not the errors of the worn surfaces"
STRUCTURE = "structure"
# Description of element quality, defined as gmsh's gamma.
QUALITY = "inscribed over circumscribed radius, 1: regular"
# Tangential forces below this share of the normal force are due to asymmetry of the mesh.
LITTLE = 0.01
# Forces below this share of another force are rounding.
ROUNDING = 1e-9
WORN = MOMENTS[-1]
# Unit and name of the fretting parameters.
PARAMETERS = {
    "cracking_parameter": ("N^2/mm^3", "Ruiz's cracking parameter"),
    "smith_watson_topper": ("MPa", "Smith-Watson-Topper parameter"),
    "findley": ("MPa", "Findley's parameter"),
}
# Curves by which runs are compared, in addition to the numbers.
CURVES = (
    CurvesOf("depth worn from body 1", "kinetics/*/depth_1"),
    CurvesOf("depth worn from body 2", "kinetics/*/depth_2"),
    CurvesOf("volume worn from body 1", "kinetics/*/volume_1"),
    CurvesOf("volume worn from body 2", "kinetics/*/volume_2"),
    CurvesOf("pressure across the middle, unworn", "contact/*/00000/pressure"),
    CurvesOf("pressure across the middle, worn", "contact/*/-1/pressure"),
    CurvesOf("tangential loop, worn", "loops/*/-1/force", "displacement"),
    CurvesOf("kt of tangential loops", "loops_over_energy/*/kt"),
    CurvesOf("mu of tangential loops", "loops_over_energy/*/mu"),
)


def main_results(case: WearCase, summary: Summary) -> list[SummaryQuantity]:
    """Return the results of every interface, bolt and body of the structure."""
    quantities = [
        quantity
        for name in interfaces(summary)
        for quantity in (*_worn(case, summary, name), *_stressed(case, summary, name))
    ]
    return reported(summary, [*quantities, *_of_bolts(summary), *_of_structure(summary)])


def named(body: str) -> str:
    """Return a body's name as words: names of bodies are keys."""
    return body.replace("_", " ")


def _worn(case: WearCase, summary: Summary, name: str) -> Iterator[SummaryQuantity]:
    """Yield wear, pressures and loads of an interface."""
    line = summary["per_length"]
    of = partial(SummaryQuantity, name)
    results = "depth", "volume", "peak_pressure", "worn_peak_pressure"
    error = {key: _budgeted(summary, name, key) for key in results}
    for number, body in enumerate(case.bodies, 1):
        text = f"largest depth worn from {named(body)}"
        yield of(text, f"{name}.depth_{number}", "mm", leading=True, **error["depth"])
    for number, body in enumerate(case.bodies, 1):
        text, unit = f"volume worn from {named(body)}", unit_in(line, "mm^3")
        yield of(text, f"{name}.volume_{number}", unit, leading=True, **error["volume"])
    yield of("worn area", f"{name}.worn_area", unit_in(line, "mm^2"))
    pressures = zip(MOMENTS, ("peak_pressure", "worn_peak_pressure"), strict=True)
    for moment, of_pressure in pressures:
        path, leading = f"{name}.peak_pressure.{moment}", moment != WORN  # it has no limit there
        yield of(f"largest pressure, {moment}", path, "MPa", leading=leading, **error[of_pressure])
    yield of("contact width along x at peak load, unworn", f"{name}.contact_width.unworn", "mm")
    path = f"{name}.elements_across"
    yield of("elements across the contact at peak load, unworn", path, "1")
    yield of("contact area at peak load, worn", f"{name}.area", unit_in(line, "mm^2"))
    for load, text in (("P", "normal force P"), ("Qx", "tangential force Qx")):
        for moment in MOMENTS:
            path = f"{name}.peak_load.{moment}.{load}"
            if not _is_there(summary, path, f"{name}.peak_load.{moment}.P"):
                continue
            yield of(f"{text} at peak load, {moment}", path, unit_in(line, "N"))
    yield from _load_ranges(summary, name)
    yield of("largest slip path in a cycle, unworn", f"{name}.slip_per_cycle", "mm")
    for wears in ("half_space", "nodes"):
        path = f"{name}.energy_per_cycle.{wears}"
        yield of("energy dissipated in a cycle, unworn", path, unit_in(line, "N mm"))
    yield of("energy dissipated by all cycles", f"{name}.energy", unit_in(line, "N mm"))


def _is_there(summary: Summary, path: str, beside: str) -> bool:
    """Return whether a force is more than rounding compared with another."""
    force, other = (number_at(summary, place) for place in (path, beside))
    return force is not None and abs(force) > ROUNDING * abs(other or 0.0)


def _load_ranges(summary: Summary, name: str) -> Iterator[SummaryQuantity]:
    """Yield the ranges of tangential forces in a cycle, with their increments."""
    unit = unit_in(summary["per_length"], "N")
    for moment in MOMENTS:
        ranges = summary[name].get("load_range", {}).get(moment, {})
        for load in ("Qx", "Qy"):
            if not _acts(ranges, load):
                continue
            for end in ("least", "largest"):
                yield SummaryQuantity(
                    name,
                    f"{end} tangential force {load} in a cycle, {moment}",
                    f"{name}.load_range.{moment}.{load}.{end}",
                    unit,
                    where=f"increment {ranges[load][f'{end}_at']}",
                )


def _acts(ranges: Summary, load: str) -> bool:
    """Return whether a force is not small compared with the normal force."""
    if load not in ranges:
        return False
    reached = max(abs(ranges[load][end]) for end in ("least", "largest"))
    return bool(reached > LITTLE * ranges["P"]["largest"])


def _stressed(case: WearCase, summary: Summary, name: str) -> Iterator[SummaryQuantity]:
    """Yield tangential loops, stress and fretting parameters under an interface."""
    of, per = partial(SummaryQuantity, name), "/mm" if summary["per_length"] else ""
    for moment in MOMENTS:
        path = f"{name}.loops.{moment}"
        text, unit = f"tangential stiffness of the loop, {moment}", f"N/mm{per}"
        yield of(text, f"{path}.kt", unit, everyday=f"N/um{per}", **_of_loop(summary, path, "kt"))
        text = f"largest tangential over normal force of the loop, {moment}"
        yield of(text, f"{path}.mu", "1", **_of_loop(summary, path, "mu"))
        text = f"energy of the tangential loop, {moment}"
        key = "energy_per_loop"
        yield of(text, f"{path}.{key}", f"N mm{per}", **_of_loop(summary, path, key))
    error = _budgeted(summary, name, "life")
    for key, (unit, text) in {"von_mises": ("MPa", "von Mises stress"), **PARAMETERS}.items():
        for body in case.bodies:
            for moment in MOMENTS:
                leading = key in PARAMETERS and moment == "worn"
                known, whose = (error if leading else {}), f"under the face of {named(body)}"
                path = f"{name}.stress.{key}.{body}.{moment}.value"
                yield of(f"largest {text} {whose}, {moment}", path, unit, leading=leading, **known)


def _of_loop(summary: Summary, path: str, key: str) -> dict[str, Any]:
    """Return the estimated error of a value of a loop."""
    value, error = (number_at(summary, f"{path}.{name}") for name in (key, f"{key}_error"))
    return {"error": error / value, "error_of": LOOP_ERROR} if value and error is not None else {}


def _budgeted(summary: Summary, name: str, result: str) -> dict[str, Any]:
    """Return the total error of a result in the error budget, and the path of its parts."""
    path = f"{name}.error.{result}"
    known = estimate(summary, f"{path}.total", BUDGET)
    return known | {"budget": (RESULTS[result], path)} if known else {}


def _of_bolts(summary: Summary) -> Iterator[SummaryQuantity]:
    """Yield the tension of every bolt at peak load, and the share lost by wear."""
    unit = unit_in(summary["per_length"], "N")
    for bolt in summary.get(STRUCTURE, {}).get("bolts", {}):
        of, path = partial(SummaryQuantity, named(bolt)), f"{STRUCTURE}.bolts.{bolt}"
        yield of("shortening", f"{path}.shortening", "mm")
        for moment in MOMENTS:
            text = f"tension at peak load, {moment}"
            yield of(text, f"{path}.tension.{moment}.peak", unit)
        yield of("share of the tension that is lost", f"{path}.lost", "1", leading=True)


def _of_structure(summary: Summary) -> Iterator[SummaryQuantity]:
    """Yield the largest stress of every body off the contact faces, and its elements."""
    # Bodies have the names of the mesh file.
    for body in summary.get(STRUCTURE, {}).get("mesh", {}):
        of, mesh = partial(SummaryQuantity, named(body)), f"{STRUCTURE}.mesh.{body}"
        for moment in MOMENTS:
            path = f"{STRUCTURE}.peak_stress.{moment}.{body}.notch"
            text = f"largest von Mises stress on the free surface, {moment}"
            error = _mesh_error(summary, path)
            yield of(text, f"{path}.von_mises", "MPa", leading=moment == WORN, **error)
        yield of("elements", f"{mesh}.elements", "1")
        for size in ("smallest", "median", "largest"):
            yield of(f"{size} element (longest edge)", f"{mesh}.size.{size}", "mm")
        yield of(f"worst element ({QUALITY})", f"{mesh}.worst_quality", "1")


def _mesh_error(summary: Summary, path: str) -> dict[str, Any]:
    """Return the error of a stress, or a note if the stress grows with every refinement."""
    error = number_at(summary, f"{path}.error")
    if error is not None and error >= 1.0:
        return {"where": "mesh-dependent"}
    return estimate(summary, f"{path}.error", "the mesh")
