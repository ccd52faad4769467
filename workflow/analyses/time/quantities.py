"""Main results of joints in time: joint and rig at every energy dissipated so far."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from workflow.analyses.time.case import JointCase, RigCase, joules
from workflow.analyses.time.outcome import PARAMETERS
from workflow.case.text.readable import everyday_unit
from workflow.shell.analysis import Summary
from workflow.shell.output.quantities import CurvesOf, NumberOf, SummaryQuantity
from workflow.shell.output.summary import estimate, reported

AGEING, IN_TIME = "the jumps in energy, as an upper bound", "the time steps"
STEADY = "the intervals between steady states"
# Quantities of a state.
NUMBERS = {
    "cycles": NumberOf("1", "cycles so far"),
    "energy_per_cycle": NumberOf("N mm", "energy dissipated in a cycle", leading=True),
    "stroke": NumberOf("mm", "stroke of the joint, peak to peak"),
    "largest_displacement": NumberOf(
        "mm", "largest displacement of the reported point", leading=True
    ),
    "dissipated": NumberOf("N mm", "energy dissipated in the motion"),
    "first_frequency": NumberOf("Hz", "first peak of the response", leading=True),
    "first_peak": NumberOf("mm/s^2/N", "height of the first peak", "m/s^2/N", leading=True),
    "second_frequency": NumberOf("Hz", "second peak of the response"),
    "second_peak": NumberOf("mm/s^2/N", "height of the second peak", "m/s^2/N"),
    "ring_down.largest.damping_ratio": NumberOf(
        "1", "damping ratio as the ring-down begins", "%", leading=True
    ),
    "stuck.0": NumberOf("Hz", "first natural frequency, joint stuck"),
    "sliding.0": NumberOf("Hz", "first natural frequency, joint sliding"),
    **{
        name: NumberOf(
            parameter.unit,
            parameter.description,
            everyday_unit(parameter.unit, name),
            leading=name in ("friction", "stiffness"),
        )
        for name, parameter in PARAMETERS.items()
    },
}
# Quantities to which the error of time steps applies.
MOVED = "stroke", "largest_displacement"
# Curves by which runs are compared, in addition to the numbers.
CURVES = (
    CurvesOf("cycles", "evolution/cycles"),
    CurvesOf("stiffness of the joint", "evolution/stiffness"),
    CurvesOf("friction of the joint", "evolution/friction"),
    CurvesOf("normal load of the joint", "evolution/normal_load"),
    CurvesOf("loop in the last state", "states/-1/loop/force", "displacement"),
    CurvesOf(
        "frequency response in the last state",
        "states/-1/frequency_response/magnitude",
        logarithmic=True,
    ),
    CurvesOf("damping in the ring-down, last state", "states/-1/ring_down/damping_ratio"),
)


def main_results(case: JointCase | RigCase, summary: Summary) -> list[SummaryQuantity]:
    """Return results of every state, and of the whole life if the joint ages."""
    energy = NumberOf("N mm", "energy dissipated", leading=True)
    whole = (
        NumberOf("1", "cycles", leading=True).at("whole life", "cycles"),
        energy.at("whole life", "energy", **_of_ageing(summary)),
    )
    states = (
        quantity
        for number in range(len(summary["states"]))
        for quantity in _of_state(number, _when(number, summary), summary)
    )
    rig = SummaryQuantity("rig without its joints", "first natural frequency", "free.0", "Hz")
    return reported(summary, [*whole, *states, rig])


def _of_ageing(summary: Summary) -> dict[str, Any]:
    """Return the relative error of cycles and energies of a life."""
    ageing, cycles = summary.get("ageing") or {}, summary.get("cycles")
    if cycles and "error" in ageing:  # in cycles
        return {"error": ageing["error"] / cycles, "error_of": AGEING}
    return estimate(summary, "ageing.relative_error", STEADY)


def _when(number: int, summary: Summary) -> str:
    """Return text for the time of a state; "at the end" for the last one of a joint that ages."""
    ends = "cycles" in summary and number == len(summary["states"]) - 1
    energy = joules(summary["states"][number]["energy"])
    return "at the end" if ends else f"after {energy} dissipated"


def _of_state(number: int, when: str, summary: Summary) -> Iterator[SummaryQuantity]:
    place, ends = f"states.{number}", (0, len(summary["states"]) - 1)
    in_time = estimate(summary, f"{place}.step_error", IN_TIME)
    for name, declared in NUMBERS.items():
        known = in_time if name in MOVED else {}
        if name == "cycles":
            known = _of_ageing(summary)
        yield declared.at(when, f"{place}.{name}", number in ends, **known)
