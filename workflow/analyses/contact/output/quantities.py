"""Main results of a contact under loads: its last state, and its last closed cycle."""

from __future__ import annotations

from workflow.analyses.contact.case import BodiesCase
from workflow.analyses.contact.output.datasets import LOADS, RIGID_MOTIONS
from workflow.shell.analysis import Summary
from workflow.shell.output.dataset import unit_in
from workflow.shell.output.quantities import CurvesOf, SummaryQuantity
from workflow.shell.output.summary import estimate, told

LAST, LOOP = "after the last increment", "last closed cycle"
MOTIONS = {
    "approach": "motion of the bodies towards each other",
    "shift_x": "relative motion along x",
    "shift_y": "relative motion along y",
    "tilt_x": "tilt about x",
    "tilt_y": "tilt about y",
    "twist": "twist about z",
}
# Quantities of a contact over an area or a line, which has half widths: unit and description.
NUMBERS = {
    "peak_pressure": ("MPa", "largest pressure"),
    "central_pressure": ("MPa", "pressure in the middle"),
    "contact_radius": ("mm", "contact radius (of a disk of equal area)"),
    "contact_half_width": ("mm", "contact half width"),
    "contact_area": ("mm^2", "contact area"),
    "peak_shear": ("MPa", "largest shear"),
    "stick_radius": ("mm", "stick radius (of a disk of equal area)"),
    "stick_half_width": ("mm", "stick half width"),
    "cumulative_energy": ("N mm", "energy dissipated so far"),
}
# Forces and motions below this share of the largest are rounding.
ROUNDING = 1e-9
FORCES = "P", "Qx", "Qy"
BY_INCREMENTS = "of the increments of the load"
# Curves by which runs are compared, in addition to the numbers.
CURVES = (
    CurvesOf(
        "pressure along x in the middle, last increment",
        "grid/bodies",
        "contact/bodies/-1/pressure",
        ("mm", "MPa"),
    ),
    CurvesOf(
        "shear along x in the middle, last increment",
        "grid/bodies",
        "contact/bodies/-1/shear",
        ("mm", "MPa"),
    ),
    CurvesOf("tangential force over motion", "history/shift_x", "history/Qx", ("mm", "N")),
    CurvesOf("normal force over approach", "history/approach", "history/P", ("mm", "N")),
)


def main_results(case: BodiesCase, summary: Summary) -> list[SummaryQuantity]:
    """Return the main results of the last state and cycle, with the error of each by increments."""
    last, loop = summary["states"][-1], summary["loop"] or {}
    line = "contact_half_width" in last

    def of(text: str, path: str, unit: str, where: str = LAST) -> SummaryQuantity:
        place = "loop" if where == LOOP else "last"
        error = f"increments_error.{place}.{path.rpartition('.')[2]}"
        return SummaryQuantity(where, text, path, unit, **estimate(summary, error, BY_INCREMENTS))

    quantities = [
        of(f"{LOADS[name][1]}, {name}", f"states.-1.{name}", unit_in(line, LOADS[name][0]))
        for name in _large(last, FORCES)
    ]
    quantities += [
        of(MOTIONS[name], f"states.-1.{name}", RIGID_MOTIONS[name][0])
        for name in _large(last, ("approach", "shift_x", "shift_y"))
    ]
    for name, (unit, text) in NUMBERS.items():
        quantities.append(of(text, f"states.-1.{name}", unit_in(line, unit)))
    if loop:
        (force_unit, force), motion = LOADS[loop["force"]], loop["motion"]
        energy, amplitude = unit_in(line, "N mm"), RIGID_MOTIONS[motion][0]
        quantities += [
            of("energy dissipated", "loop.energy", energy, LOOP),
            of(f"amplitude of the {MOTIONS[motion]}", "loop.amplitude", amplitude, LOOP),
            of(
                f"amplitude of the {force}",
                "loop.force_amplitude",
                unit_in(line, force_unit),
                LOOP,
            ),
        ]
    return told(summary, quantities)


def _large(numbers: Summary, names: tuple[str, ...]) -> list[str]:
    """Return the names whose numbers are more than rounding."""
    largest = max(abs(numbers[name]) for name in names)
    return [name for name in names if abs(numbers[name]) > ROUNDING * largest]
