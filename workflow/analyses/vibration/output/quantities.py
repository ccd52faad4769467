"""Main results of a steady vibration: resonances and loops under every force."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from workflow.analyses.vibration.case.excitation import amount_in, under_in
from workflow.analyses.vibration.case.vibration_case import VibrationCase
from workflow.models.vibration.amount import LEVEL
from workflow.shell.analysis import Summary
from workflow.shell.output.quantities import CurvesOf, NumberOf, SummaryQuantity
from workflow.shell.output.summary import estimate, reported

LINEAR, RECORDS = "linear limits", "left_out_of_records"
ERROR = "harmonics and samples, for the vibration of the joints or the energy that they lose"
# Quantities of the motion at resonance.
NUMBERS = {
    "resonance": NumberOf("Hz", "resonance", leading=True),
    "amplitude": NumberOf("mm", "amplitude at resonance", leading=True),
    "receptance": NumberOf("mm/N", "amplitude over force at resonance", "um/N"),
    "energy_per_cycle": NumberOf("N mm", "energy dissipated in a cycle at resonance"),
    "damping": NumberOf("1", "damping ratio at resonance", "%", leading=True),
    "slip": NumberOf("1", "share of the cycle in which joints slip", "%", leading=True),
}
# A resonance's frequency hardly depends on the amplitude, so the error of the motion is not its
# error.
WITH_ERROR = "amplitude", "absolute_amplitude", "receptance", "energy_per_cycle"
LOOP = {
    "energy": NumberOf("N mm", "energy of the loop"),
    "stroke": NumberOf("mm", "stroke of the loop"),
    "stiffness": NumberOf("N/mm", "stick slope of the loop", "N/um"),
    "friction": NumberOf("1", "friction coefficient of the loop"),
}
# Quantities at resonance where the ground moves, or the frequency is that of an engine.
BESIDE = {
    "absolute_amplitude": NumberOf("mm", "absolute amplitude at resonance", leading=True),
    "speed": NumberOf("rad/s", "speed of the engine at resonance", "rpm", leading=True),
}
# Quantities of a motion at a frequency of the case.
ANSWER = {
    "amplitude": NumberOf("mm", "amplitude"),
    "absolute_amplitude": NumberOf("mm", "absolute amplitude"),
    "phase": NumberOf("rad", "phase by which the motion leads the force", "deg"),
    "energy_per_cycle": NumberOf("N mm", "energy dissipated in a cycle"),
}
# Quantities of a mode over its amplitude.
MODE = {
    "linear_frequency": NumberOf("Hz", "frequency of the linear mode"),
    "most_damped": NumberOf("1", "largest damping ratio", "%", leading=True),
}
# Curves by which runs are compared, in addition to the numbers.
CURVES = (
    CurvesOf("amplitude", "responses/*/amplitude", "frequency", logarithmic=True),
    CurvesOf("loop", "responses/*/loops/-1/force", "displacement"),
    CurvesOf("phase resonance", "backbone/frequency"),
    CurvesOf("mode", "modes/*/frequency", "amplitude"),
)


def main_results(case: VibrationCase, summary: Summary) -> list[SummaryQuantity]:
    """Return results of all responses, their finest loops, and the limits stuck and sliding."""
    limits = (
        SummaryQuantity(LINEAR, f"first natural frequency, joints {state}", f"{state}.0", "Hz")
        for state in ("stuck", "sliding", "free")
    )
    records = (
        SummaryQuantity(
            "excitation",
            f"share of record {number + 1} that is not used",
            f"{RECORDS}.{number}",
            "1",
        )
        for number in range(len(summary.get(RECORDS, ())))
    )
    last = len(summary["responses"]) - 1
    responses = (
        quantity
        for number, response in enumerate(summary["responses"])
        for quantity in (
            *of_response(
                under_in(response),
                f"responses.{number}",
                response,
                summary,
                number in (0, last),
            ),
            *_of(
                under_in(response),
                f"responses.{number}.loops.-1",
                LOOP,
                ("energy", "stroke"),
                summary,
            ),
            *_of_answers(under_in(response), f"responses.{number}", response, summary),
        )
    )
    modes = (
        quantity
        for number, mode in enumerate(summary.get("modes", ()))
        for quantity in _of(
            f"mode {mode['mode']}", f"modes.{number}", MODE, ("most_damped",), summary
        )
    )
    return reported(summary, [*limits, *records, *responses, *modes])


def of_response(
    group: str, path: str, response: Mapping[str, Any], summary: Summary, leads: bool
) -> Iterator[SummaryQuantity]:
    """Yield results of the response to a force or level, at a ``path`` of the summary.

    The summary of a report shows the leading ones only if the response ``leads``.
    """
    numbers = NUMBERS | {name: reported for name, reported in BESIDE.items() if name in response}
    if amount_in(response)[0] is LEVEL:
        numbers |= {"receptance": NumberOf("mm", "amplitude over level at resonance")}
    return _of(group, path, numbers, WITH_ERROR, summary, leads)


def _of_answers(
    group: str, path: str, response: Mapping[str, Any], summary: Summary
) -> Iterator[SummaryQuantity]:
    """Yield results of motions at the frequencies of the case, of each one that coexists."""
    for place, answer in enumerate(response.get("at", ())):
        count = len(answer["motions"])
        for number in range(count):
            of = f"{path}.at.{place}.motions.{number}"
            which = f", motion {number + 1} of {count}" if count > 1 else ""
            suffix = f" at {answer['frequency']:g} Hz{which}"
            reported = {
                name: declared._replace(text=declared.text + suffix)
                for name, declared in ANSWER.items()
                if name in answer["motions"][number]
            }
            yield from _of(group, of, reported, WITH_ERROR, summary)


def _of(
    group: str,
    path: str,
    numbers: Mapping[str, NumberOf],
    with_error: tuple[str, ...],
    summary: Summary,
    leads: bool = True,
) -> Iterator[SummaryQuantity]:
    """Yield results at a ``path`` of the summary; the error there applies to some of them."""
    error = estimate(summary, f"{path}.error", ERROR)
    for name, declared in numbers.items():
        known = error if name in with_error else {}
        yield declared.at(group, f"{path}.{name}", leads, **known)
