"""Main results of a rig that wears its contact: contact and resonances over the cycles."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from typing import Any

from workflow.analyses.vibration.case.excitation import under_in
from workflow.analyses.vibration.output.quantities import of_response
from workflow.analyses.vibration_wear.case import VibrationWearCaseBase
from workflow.analyses.vibration_wear.output.layout import layout_of
from workflow.case.text.plain import times
from workflow.case.text.readable import everyday_unit
from workflow.layout.declared import Declarations
from workflow.shell.analysis import Summary
from workflow.shell.output.quantities import CurvesOf, NumberOf, SummaryQuantity
from workflow.shell.output.summary import number_at, reported

WORN = "the wear steps, and harmonics and samples of the motion that wears"
MOTION = "harmonics and samples, for the vibration of the joints or the energy that they lose"
# Quantities of a state, whose units are those of the evolution, and whether they lead.
NUMBERS = {
    "cycles": ("cycles under the force that wears", False),
    "depth": ("largest depth worn, both bodies together", True),
    "volume": ("volume worn, both bodies together", True),
    "energy": ("energy dissipated so far", False),
    "area": ("contact area at rest", False),
    "touching": ("nodes in contact at rest", False),
    "peak_pressure": ("largest pressure at rest", True),
    "stiffness": ("tangential stiffness", True),
    "stroke": ("stroke under the force that wears", False),
    "frequency": ("frequency of the motion that wears", False),
    "energy_per_cycle": ("energy dissipated in a cycle", False),
}
# Parts of the error of each quantity, which add up, and a description of that error.
ERRORS = {
    "depth": (("step_error", "error"), WORN),
    "volume": (("step_error", "error"), WORN),
    "stroke": (("error",), MOTION),
    "energy_per_cycle": (("error",), MOTION),
}
# Curves by which runs are compared, in addition to the numbers.
CURVES = (
    CurvesOf("worn depth", "evolution/depth"),
    CurvesOf("worn volume", "evolution/volume"),
    CurvesOf("tangential stiffness", "evolution/stiffness"),
    CurvesOf(
        "amplitude in the last state",
        "worn/-1/responses/*/amplitude",
        "frequency",
        logarithmic=True,
    ),
    CurvesOf("loop in the last state", "worn/-1/loop/force", "displacement"),
)


def main_results(case: VibrationWearCaseBase, summary: Summary) -> list[SummaryQuantity]:
    """Return results of every state, the unworn one first."""
    declared = layout_of(case.amount).datasets("evolution")
    states = range(len(summary["states"]))
    return reported(summary, chain.from_iterable(_of_state(n, declared, summary) for n in states))


def _of_state(number: int, declared: Declarations, summary: Summary) -> Iterator[SummaryQuantity]:
    state = summary["states"][number]
    ends = number == len(summary["states"]) - 1
    begun = f"after {times(state['cycles'])} cycles" if state["cycles"] else "unworn"
    group = "at the end" if ends else begun
    place = f"states.{number}"
    leads = ends or number == 0
    for name, (text, leading) in NUMBERS.items():
        unit = declared[name].unit
        shown = NumberOf(unit, text, everyday_unit(unit, name), leading)
        yield shown.at(group, f"{place}.{name}", leads, **_error(name, place, summary))
    for force, response in enumerate(state["responses"]):
        under = f"{group}, {under_in(response)}"
        yield from of_response(under, f"{place}.responses.{force}", response, summary, leads)


def _error(name: str, place: str, summary: Summary) -> dict[str, Any]:
    """Return the error of a number of a state with its description, empty if a part is unknown."""
    parts, what = ERRORS.get(name, ((), ""))
    known = [number_at(summary, f"{place}.{part}") for part in parts]
    errors = [abs(part) for part in known if part is not None]
    return {"error": sum(errors), "error_of": what} if parts and len(errors) == len(parts) else {}
