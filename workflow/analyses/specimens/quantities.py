"""Main results of two specimens: change of pads and stiffness under each normal force."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from workflow.analyses.specimens.case import SpecimensCase
from workflow.models.stress.layout import MOMENTS
from workflow.shell.analysis import Summary
from workflow.shell.output.quantities import CurvesOf, SummaryQuantity
from workflow.shell.output.summary import estimate, reported

FREE = "free specimens"
UNCOUPLED = "difference to a cycle with pressure and shear coupled"
# Quantities of the pads, unworn and worn: unit, text, everyday unit.
STATE = {
    "stick_stiffness": ("N/mm", "tangential stiffness, all that touches stuck", "N/um"),
    "secant_stiffness": ("N/mm", "slope of the loop up to half of its force", "N/um"),
    "area": ("mm^2", "contact area", ""),
    "peak_pressure": ("MPa", "largest pressure", ""),
    "energy_per_cycle": ("N mm", "energy dissipated in a cycle", ""),
}
# Results of the unworn pads that are compared with a coupled cycle.
COUPLED = {"secant_stiffness": "secant_stiffness", "energy_per_cycle": "energy"}
# Curves by which runs are compared, in addition to the numbers.
CURVES = (
    CurvesOf("tangential stiffness", "loads/*/kinetics/stick_stiffness"),
    CurvesOf("contact area", "loads/*/kinetics/area"),
    CurvesOf("depth worn from body 1", "loads/*/kinetics/depth_1"),
    CurvesOf("depth worn from body 2", "loads/*/kinetics/depth_2"),
    CurvesOf("loop, worn", "loads/*/states/-1/loop/ring_force", "ring_displacement"),
)


def main_results(case: SpecimensCase, summary: Summary) -> list[SummaryQuantity]:
    """Return results under every normal force, and the first frequency of either specimen."""
    quantities = [
        quantity
        for number, force in enumerate(case.load_path.normal_forces)
        for quantity in _under(f"under {force:g} N", number, summary)
    ]
    quantities += [
        SummaryQuantity(
            FREE, f"first natural frequency of body {n}", f"frequencies.body_{n}.full.0", "Hz"
        )
        for n in (1, 2)
    ]
    return reported(summary, quantities)


def _under(group: str, number: int, summary: Summary) -> Iterator[SummaryQuantity]:
    """Yield results under one normal force."""
    of, load = partial(SummaryQuantity, group), f"loads.{number}"
    for body in (1, 2):
        yield of(f"largest depth worn from body {body}", f"{load}.depths.{body - 1}", "mm")
    for body in (1, 2):
        yield of(f"volume worn from body {body}", f"{load}.volumes.{body - 1}", "mm^3")
    for name, (unit, text, everyday) in STATE.items():
        known = {}
        if beside := COUPLED.get(name):
            path = f"{load}.coupled_cycle.{beside}_difference"
            known = estimate(summary, path, UNCOUPLED)
        unworn, worn = (f"{load}.{moment}.{name}" for moment in MOMENTS)
        yield of(f"{text}, unworn", unworn, unit, everyday=everyday, **known)
        yield of(f"{text}, worn", worn, unit, everyday=everyday)
    yield of("energy dissipated by all cycles", f"{load}.energy", "N mm")
    for name in ("stiffness", "pressure"):
        text = f"cycles after which {name} is steady"
        yield of(text, f"{load}.steady.{name}.cycles", "1")
