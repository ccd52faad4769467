"""Main results of two specimens: change of pads and stiffness under each normal force."""

from __future__ import annotations

from collections.abc import Iterator

from workflow.analyses.specimens.case import SpecimensCase
from workflow.models.stress.layout import MOMENTS
from workflow.shell.analysis import Summary
from workflow.shell.output.quantities import CurvesOf, NumberOf, SummaryQuantity
from workflow.shell.output.summary import estimate, reported

FREE = "free specimens"
UNCOUPLED = "the difference to a cycle with pressure and shear coupled"
# Quantities of the pads, unworn and worn.
STATE = {
    "stick_stiffness": NumberOf(
        "N/mm", "tangential stiffness while nothing slips", "N/um", leading=True
    ),
    "secant_stiffness": NumberOf("N/mm", "slope of the loop up to half of its force", "N/um"),
    "area": NumberOf("mm^2", "contact area"),
    "peak_pressure": NumberOf("MPa", "largest pressure", leading=True),
    "energy_per_cycle": NumberOf("N mm", "energy dissipated in a cycle"),
}
# Quantities of each body.
WORN = {
    "depths": NumberOf("mm", "largest depth worn", leading=True),
    "volumes": NumberOf("mm^3", "volume worn", leading=True),
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
    load, leads = f"loads.{number}", number in (0, len(summary["loads"]) - 1)
    for name, worn in WORN.items():
        for body in (1, 2):
            of_body = worn._replace(text=f"{worn.text} from body {body}")
            yield of_body.at(group, f"{load}.{name}.{body - 1}", leads)
    for name, declared in STATE.items():
        known = {}
        if beside := COUPLED.get(name):
            path = f"{load}.coupled_cycle.{beside}_difference"
            known = estimate(summary, path, UNCOUPLED)
        for moment in MOMENTS:
            of_moment = declared._replace(text=f"{declared.text}, {moment}")
            path = f"{load}.{moment}.{name}"
            yield of_moment.at(group, path, leads, **(known if moment == "unworn" else {}))
    yield NumberOf("N mm", "energy dissipated by all cycles").at(group, f"{load}.energy")
    for name in ("stiffness", "pressure"):
        steady = NumberOf("1", f"cycles after which {name} is steady")
        yield steady.at(group, f"{load}.steady.{name}.cycles")
