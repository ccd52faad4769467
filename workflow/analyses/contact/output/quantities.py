"""Main results of a contact under loads: its last state, and its last closed cycle."""

from __future__ import annotations

from workflow.analyses.contact.case import BodiesCase
from workflow.analyses.contact.output.layout import LAYOUT
from workflow.layout.declared import unit_in
from workflow.shell.analysis import Summary
from workflow.shell.output.quantities import CurvesOf, NumberOf, SummaryQuantity
from workflow.shell.output.summary import estimate, reported

LAST, LOOP = "after the last increment", "last closed cycle"
MOTIONS = {
    "approach": "motion of the bodies towards each other",
    "shift_x": "relative motion along x",
    "shift_y": "relative motion along y",
    "tilt_x": "tilt about x",
    "tilt_y": "tilt about y",
    "twist": "twist about z",
}
# Quantities of a contact over an area or a line, which has half widths.
NUMBERS = {
    "peak_pressure": NumberOf("MPa", "largest pressure", leading=True),
    "central_pressure": NumberOf("MPa", "pressure in the middle"),
    "contact_radius": NumberOf("mm", "contact radius (of a disk of equal area)", leading=True),
    "contact_half_width": NumberOf("mm", "contact half width", leading=True),
    "contact_area": NumberOf("mm^2", "contact area"),
    "peak_shear": NumberOf("MPa", "largest shear", leading=True),
    "stick_radius": NumberOf("mm", "stick radius (of a disk of equal area)", leading=True),
    "stick_half_width": NumberOf("mm", "stick half width", leading=True),
    "flattening": NumberOf("mm", "largest depth by which the surfaces have yielded"),
    "flattened_volume": NumberOf("mm^3", "volume displaced by yield (not worn)"),
    "flattened_area": NumberOf("mm^2", "area that has yielded"),
    "cumulative_energy": NumberOf("N mm", "energy dissipated so far"),
}
# Forces and motions below this share of the largest are rounding.
ROUNDING = 1e-9
FORCES = "P", "Qx", "Qy"
BY_INCREMENTS = "the increments of the load"
# Curves by which runs are compared, in addition to the numbers.
CURVES = (
    CurvesOf("pressure along x in the middle, last increment", "contact/bodies/-1/pressure"),
    CurvesOf("shear along x in the middle, last increment", "contact/bodies/-1/shear"),
    CurvesOf("tangential force over motion", "history/Qx", "shift_x"),
    CurvesOf("normal force over approach", "history/P", "approach"),
)


def main_results(case: BodiesCase, summary: Summary) -> list[SummaryQuantity]:
    """Return the main results of the last state and cycle, with the error of each by increments."""
    last, loop = summary["states"][-1], summary["loop"] or {}
    line, history = "contact_half_width" in last, LAYOUT.datasets("history")

    def of(
        text: str, path: str, unit: str, where: str = LAST, leading: bool = False
    ) -> SummaryQuantity:
        place = "loop" if where == LOOP else "last"
        error = f"increments_error.{place}.{path.rpartition('.')[2]}"
        known = estimate(summary, error, BY_INCREMENTS)
        return SummaryQuantity(where, text, path, unit, leading=leading, **known)

    quantities = [
        of(f"{history[name].description}, {name}", f"states.-1.{name}", history[name].unit_in(line))
        for name in _large(last, FORCES)
    ]
    quantities += [
        of(MOTIONS[name], f"states.-1.{name}", history[name].unit, leading=name == "approach")
        for name in _large(last, ("approach", "shift_x", "shift_y"))
    ]
    for name, number in NUMBERS.items():
        unit = unit_in(line, number.unit)
        quantities.append(of(number.text, f"states.-1.{name}", unit, leading=number.leading))
    if loop:
        force, motion = history[loop["force"]], loop["motion"]
        quantities += [
            of("energy dissipated", "loop.energy", unit_in(line, "N mm"), LOOP, leading=True),
            of(f"amplitude of the {MOTIONS[motion]}", "loop.amplitude", history[motion].unit, LOOP),
            of(
                f"amplitude of the {force.description}",
                "loop.force_amplitude",
                force.unit_in(line),
                LOOP,
            ),
        ]
    return reported(summary, quantities)


def _large(numbers: Summary, names: tuple[str, ...]) -> list[str]:
    """Return the names whose numbers are more than rounding."""
    largest = max(abs(numbers[name]) for name in names)
    return [name for name in names if abs(numbers[name]) > ROUNDING * largest]
