"""Plausibility warnings: values that a case may have, but that are probably a mistaken unit.

This module holds the plausible range of single entries. The ranges are wider than anything that
machines, rigs or laboratories have. Each kind of case checks combinations of its entries itself
(``Case.plausibility_warnings``).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fnmatch import fnmatchcase
from math import pi, sqrt

import numpy as np
from pydantic import BaseModel

from sa_solver.types import Array
from workflow.case.fields import Quantity
from workflow.case.sections import Case, entry_of
from workflow.case.text.plain import between, display_unit, plain
from workflow.messages.warning_kinds import Notice, WarningKind
from workflow.models.checks.limits import USUAL_FRICTION

# Aspect ratio of cells above which a grid wastes most of them.
SQUARE = 5.0
# Pressures below WEAK [MPa] and above BEYOND times the yield stress do not occur in tests. No
# material bears more than the share STRENGTH of its Young's modulus.
WEAK, BEYOND, STRENGTH = 1e-3, 5.0, 0.1
# Roundings that fall off by less than this [mm] are smaller than the roughness.
ROUND = 1e-4
# Ratio of stroke to contact width that tests hardly ever exceed, even tests of wear.
LONG = 50.0
# Measured heights are not roughness if they span more than the share STEEP of a face, or less
# than FINE [mm].
STEEP, FINE = 0.3, 1e-5


@dataclass(frozen=True)
class Usual:
    """Plausible range of entries whose dotted paths match: from ``low`` to ``high`` in ``unit``.

    A value of 0 means that the effect is absent, and gives no warning.
    """

    path: str
    unit: str
    low: float
    high: float


USUAL = (
    # From soft polymers to diamond; rubber deforms too much for half-spaces.
    Usual("materials.*.young", "MPa", 300.0, 1.3e6),
    Usual("materials.*.poisson", "1", 0.1, 0.5),
    Usual("materials.*.density", "t/mm^3", 5e-10, 2.3e-8),
    Usual("materials.*.expansion", "1/K", 1e-7, 3e-4),
    Usual("materials.*.yield_stress", "MPa", 2.0, 2e4),
    Usual("friction.coefficient", "1", *USUAL_FRICTION),
    Usual("joint.friction", "1", *USUAL_FRICTION),
    # Metals wear 1e2 to 1e6 um^3 per joule.
    Usual("wear.*.[ck]*", "1/MPa", 1e-12, 1e-5),
    Usual("wear.*.coefficient", "1", 1e-9, 3e-2),
    Usual("wear.*.hardness", "MPa", 100.0, 1e5),
    Usual("wear.cycles", "1", 1.0, 1e11),
    # 100 to 25,000 rpm.
    Usual("*.rotation_speed", "rad/s", 10.0, 2600.0),
    Usual("structure.loads.*.speed", "rad/s", 10.0, 2600.0),
    # Rotations of remote displacements are linearized: their squares are neglected.
    Usual("structure.loads.*.rotation.*", "rad", 1e-8, 0.05),
    Usual("load_path.airfoil_mass", "t", 5e-6, 0.1),
    # The stroke of a joint that frets.
    Usual("drive.stroke", "mm", 1e-4, 1.0),
    Usual("*.stroke", "mm", 1e-4, 30.0),
    Usual("loops.amplitude", "mm", 1e-5, 1.0),
    Usual("*.amplitude", "mm", 1e-6, 10.0),
    # Interfaces have 0.1 to 1000 N/um; springs of rigs cover a wider range.
    Usual("joint.stiffness", "N/mm", 50.0, 1e7),
    Usual("joint.normal_stiffness", "N/mm", 50.0, 1e7),
    Usual("structure.springs.*", "N/mm", 0.05, 1e7),
    Usual("structure.masses.*", "t", 1e-6, 5.0),
    Usual("joint.normal_load", "N", 0.01, 1e6),
    Usual("excitation.force", "N", 1e-3, 2e4),
    Usual("forces.*", "N", 1e-3, 2e4),
    Usual("wear.force", "N", 1e-3, 2e4),
    Usual("evolution.*.change", "1", 0.005, 20.0),
    Usual("evolution.*.final", "1", 0.05, 20.0),
    Usual("structure.radius", "mm", 0.01, 1e5),
    Usual("structure.radius_*", "mm", 0.01, 1e5),
    Usual("structure.half_width", "mm", 0.005, 100.0),
    Usual("structure.flank_length", "mm", 0.5, 200.0),
    Usual("structure.slot_length", "mm", 1.0, 1000.0),
    Usual("structure.rim_radius", "mm", 20.0, 2000.0),
    Usual("structure.strip_width", "mm", 0.05, 50.0),
    Usual("structure.chamfer_depth", "mm", 0.01, 50.0),
    Usual("structure.diameter", "mm", 0.5, 500.0),
    Usual("structure.*_fillet", "mm", 0.05, 100.0),
    Usual("structure.slot_clearance", "mm", 0.01, 50.0),
    Usual("structure.neck_width", "mm", 0.5, 500.0),
    Usual("structure.lug_height", "mm", 0.1, 200.0),
    Usual("structure.loads.*.pressure", "MPa", 1e-3, 5e3),
    Usual("mesh.size", "mm", 0.05, 100.0),
    Usual("*.frequency", "Hz", 1e-4, 1e5),
    Usual("stress.life.depth", "mm", 1e-3, 1.0),
)

# Units that the number may have been meant in, the likeliest first, with their size in base
# units.
MEANT: dict[str, tuple[tuple[str, float], ...]] = {
    "MPa": (("GPa", 1e3), ("Pa", 1e-6), ("kPa", 1e-3)),
    "t/mm^3": (("kg/m³", 1e-12), ("g/cm³", 1e-9), ("t/mm³", 1.0)),
    "rad/s": (("rpm", pi / 30.0),),
    "t": (("kg", 1e-3),),
    "mm": (("mm", 1.0), ("µm", 1e-3), ("m", 1e3), ("nm", 1e-6)),
    "N": (("N", 1.0), ("kN", 1e3)),
    "N/mm": (("N/um", 1e3), ("N/m", 1e-3), ("N/mm", 1.0), ("kN/mm", 1e3)),
    "Hz": (("kHz", 1e3), ("Hz", 1.0)),
    "1": (("%", 0.01),),
}


def plausibility_warnings_of(case: Case) -> Iterator[Notice]:
    """Yield a plausibility warning for each value, or combination of values, that is unlikely."""
    yield from _unusual(case)
    yield from _hardly_round(case)
    yield from case.plausibility_warnings()


def _unusual(case: Case) -> Iterator[Notice]:
    """Yield a warning for each value outside its usual range, with the range and a likely unit."""
    for path, number, quantity in _quantities(case):
        usual = next(
            (u for u in USUAL if u.unit == quantity.unit and fnmatchcase(path, u.path)), None
        )
        if usual is None or number == 0.0 or usual.low <= abs(number) <= usual.high:
            continue
        value, range_text = plain(number, usual.unit), between(usual.low, usual.high, usual.unit)
        text = f"{path}: {value}; usual: {range_text}{_question(abs(number), usual)}"
        yield Notice(WarningKind.UNUSUAL_VALUE, text)


def _hardly_round(section: BaseModel, path: str = "") -> Iterator[Notice]:
    """Yield warnings about rounded edges and ends of faces in a section that are nearly flat."""
    for name in ("edge", "end"):
        width, radius = (getattr(section, f"{name}_{of}", None) for of in ("width", "radius"))
        if width is not None and radius is not None and 0.5 * width**2 / radius < ROUND:
            yield Notice(
                WarningKind.UNUSUAL_LENGTH,
                f"{path}{name}_radius: {plain(radius, 'mm')} over {name}_width "
                f"{plain(width, 'mm')} gives a rounding only "
                f"{plain(0.5 * width**2 / radius, 'mm', 3)} deep: are the units right?",
            )
    for name in type(section).model_fields:
        value = getattr(section, name)
        items = enumerate(value) if isinstance(value, tuple) else [("", value)]
        for index, item in items:
            if isinstance(item, BaseModel):
                place = f"{path}{name}" + (f".{index}" if index != "" else "")
                yield from _hardly_round(item, f"{place}.")


def _quantities(section: BaseModel, path: str = "") -> Iterator[tuple[str, float, Quantity]]:
    """Yield path, value and quantity of every number in a section."""
    for name, field in type(section).model_fields.items():
        value, quantity = getattr(section, name), entry_of(field)
        items = enumerate(value) if isinstance(value, tuple) else [("", value)]
        for index, item in items:
            place = f"{path}{name}" + (f".{index}" if index != "" else "")
            if isinstance(item, BaseModel):
                yield from _quantities(item, f"{place}.")
            elif isinstance(quantity, Quantity) and isinstance(item, float):
                yield place, float(item), quantity


def _question(number: float, usual: Usual) -> str:
    """Return the value that was probably meant, as a question; empty if no unit is plausible."""
    for written in (number / display_unit(number, usual.unit)[0], number):
        for unit, size in MEANT.get(usual.unit, ()):
            if usual.low <= written * size <= usual.high and written * size != number:
                return f"; {written:.6g} {unit} meant?"
    for factor in (0.1, 10.0) if usual.unit == "1" else ():
        if usual.low <= factor * number <= usual.high:
            return f"; {factor * number:.6g} meant?"
    return ""


def uneven_cells(sides: tuple[float, float], cells: tuple[int, int]) -> Iterator[Notice]:
    """Yield a warning if the cells of an area grid are far from square."""
    if 1 in cells:
        return
    dx, dy = (side / count for side, count in zip(sides, cells, strict=True))
    ratio = max(dx / dy, dy / dx)
    if ratio > SQUARE:
        yield Notice(
            WarningKind.LONG_CELLS,
            f"contact.grid: cells of {plain(dx, 'mm', 4)} x {plain(dy, 'mm', 4)} are {ratio:.0f} "
            "times longer than wide; usual: nearly square",
        )


def pressed(
    path: str, pressure: float, yields: Iterable[float | None], moduli: Iterable[float] = ()
) -> Iterator[Notice]:
    """Yield a warning if ``pressure`` [MPa] is implausible for these yield stresses [MPa].

    If no yield stress is known, Young's ``moduli`` [MPa] give the limit.
    """
    if 0.0 < pressure < WEAK:
        yield Notice(
            WarningKind.UNUSUAL_LOAD,
            f"{path}: gives a pressure of only about {plain(pressure, 'MPa', 3)}: is its unit "
            "right?",
        )
    limits = [limit for limit in yields if limit is not None]
    if limits and pressure > BEYOND * min(limits):
        yield Notice(
            WarningKind.UNUSUAL_LOAD,
            f"{path}: gives a pressure of about {plain(pressure, 'MPa', 3)}, "
            f"{pressure / min(limits):.0f} times the yield stress: is its unit right?",
        )
    elif pressure > STRENGTH * min(moduli, default=np.inf):
        yield Notice(
            WarningKind.UNUSUAL_LOAD,
            f"{path}: gives a pressure of about {plain(pressure, 'MPa', 3)}, more than any "
            "material with such a Young's modulus bears: is its unit right?",
        )


def hertz(load: float, radius: float, modulus: float, line: bool) -> tuple[float, float]:
    """Return half width [mm] and peak pressure [MPa] of a ball, or of a cylinder for a ``line``.

    :mod:`sa_solver.reference.hertz` has the same formulas, but is slow to import for a mere check.
    """
    if line:
        half_width = sqrt(4.0 * load * radius / (pi * modulus))
        return half_width, 2.0 * load / (pi * half_width)
    half_width = (0.75 * load * radius / modulus) ** (1.0 / 3.0)
    return half_width, 1.5 * load / (pi * half_width**2)


def long_stroke(path: str, stroke: float, width: float) -> Iterator[Notice]:
    """Yield a warning if the stroke [mm] is very large compared with the contact ``width`` [mm]."""
    if stroke > LONG * width:
        yield Notice(
            WarningKind.LONG_STROKE,
            f"{path}: {plain(stroke, 'mm')} is {stroke / width:.0f} times the width of the "
            f"contact, about {plain(width, 'mm', 3)}: is its unit right?",
        )


def heights(path: str, values: Array, sides: tuple[float, float]) -> Iterator[Notice]:
    """Yield a warning if heights [mm] of a file are implausible for a face of these sides [mm]."""
    reach = float(np.ptp(values))
    if reach > STEEP * min(sides):
        other = "µm"
    elif 0.0 < reach < FINE:
        other = "m"
    else:
        return
    yield Notice(
        WarningKind.UNUSUAL_LENGTH,
        f"{path}: heights over {plain(reach, 'mm', 3)} on a face of {plain(min(sides), 'mm')}; "
        f"they are read in mm: are they in {other}?",
    )


def idle_steps(path: str, step: float | None, cycles: float) -> Iterator[Notice]:
    """Yield a warning if the wear step has more cycles than the whole run."""
    if step is not None and step > cycles:
        yield Notice(
            WarningKind.STEP_LONGER_THAN_RUN,
            f"{path}: {step:g} cycles, but the run has {cycles:g}: it makes one jump; usual: ten "
            "or more",
        )
