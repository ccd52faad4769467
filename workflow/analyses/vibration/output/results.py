"""Output of a vibration case: results, tables, ParaView files, figures and the summary."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import degrees, pi
from pathlib import Path
from typing import Any

from workflow.analyses.vibration.case.vibration_case import VibrationCase
from workflow.analyses.vibration.output.harmonics import write_harmonics
from workflow.analyses.vibration.output.layout import bifurcation_columns, layout_of
from workflow.analyses.vibration.output.outcome import (
    Answers,
    Bifurcations,
    Curves,
    Response,
    VibrationOutcome,
)
from workflow.analyses.vibration.stability import bifurcation_arrays
from workflow.case.text.plain import counted
from workflow.case.text.readable import percent
from workflow.models.vibration.amount import ExcitationSize
from workflow.pictures.scales import PER_MICRON, TO_MICRONS
from workflow.shell.analysis import Run
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.output.results import ResultsWriter, run_results
from workflow.shell.output.summary import finish
from workflow.shell.output.tables import DIGITS, heading, write_curves, write_table

TO_RPM = 30.0 / pi  # rad/s to rpm


def write_vibration_output(outcome: VibrationOutcome, run: Run[VibrationCase]) -> None:
    """Write all files of a finished run; the summary comes last and marks it as finished."""
    with run.reporter.stage("results"):
        _write_results(outcome, run)
    run.draw(outcome.contents)
    finish(run, _summary(outcome), _lines(outcome))


# --- results ------------------------------------------------------------------------------------


def _write_results(outcome: VibrationOutcome, run: Run[VibrationCase]) -> None:
    """Write results, and all curves as CSV."""
    case, folder, layout = outcome.case, run.folder, layout_of(outcome.case.amount)
    attributes = {
        "analysis": case.analysis,
        "law": case.law_names,
        "seen": list(outcome.labels),
        "engine_order": case.engine_order,
    }
    with run_results(run, case, layout, attributes) as writer:
        writer.put_contents(outcome.contents)
        limits = {name: outcome.numbers[name] for name in ("free", "stuck", "sliding")}
        writer.put("linear", outcome.linear, **limits)
        writer.put("names", outcome.names)
        if outcome.diameters is not None:
            what = "natural frequencies, over nodal diameters"
            path = folder.reserve("nodal_diameters.csv", what)
            ring = outcome.numbers["ring"]
            writer.put_table(path, "nodal_diameters", outcome.diameters, **ring)
        if outcome.contact is not None:
            writer.put("contact", outcome.contact)
        for number, response in enumerate(outcome.responses):
            _put_response(writer, number, outcome, response, folder)
        for place, name, what, curve in _curves(outcome):
            path = folder.reserve(f"{name}.csv", what)
            writer.put_table(path, place, curve.arrays, **curve.numbers)
            _put_bifurcations(writer, place, curve.bifurcations, case.amount)
    if found := list(_every_bifurcation(outcome)):
        path = folder.reserve("bifurcations.csv", "where the stability of motions changes")
        columns: dict[str, list[Any]] = {
            "curve": [curve for curve, _ in found],
            "kind": [each["kind"] for _, each in found],
        }
        for name, declared in bifurcation_columns(case.amount).items():
            columns[heading(name, declared.unit)] = [each[name] for _, each in found]
        write_table(path, columns, DIGITS)


def _curves(outcome: VibrationOutcome) -> Iterator[tuple[str, str, str, Curves]]:
    """Yield all curves but the responses, with group, name of the table, and what it is."""
    amount = outcome.case.amount
    over = f"over the {amount.name}"
    if outcome.backbone is not None:
        yield "backbone", "backbone", f"phase resonance, {over}", outcome.backbone
    for number, branch in enumerate(outcome.further):
        what = f"further branch {amount.under(branch.numbers[amount.name])}, over frequency"
        yield f"further_branches/{number:05d}", f"further_branch_{number:05d}", what, branch
    for number, sweep in enumerate(outcome.force_sweeps):
        what = f"response at {sweep.numbers['frequency']:g} Hz, {over}"
        yield f"force_sweeps/{number:05d}", f"force_sweep_{number:05d}", what, sweep
    for number, mode in enumerate(outcome.modes):
        what = f"mode {mode.numbers['mode']}, over its amplitude"
        yield f"modes/{number:05d}", f"mode_{mode.numbers['mode']:05d}", what, mode


def _put_response(
    writer: ResultsWriter,
    number: int,
    outcome: VibrationOutcome,
    response: Response,
    folder: OutputFolder,
) -> None:
    """Write a response, its harmonics, loops and motions at given frequencies, and their tables."""
    amount, place = outcome.case.amount, f"responses/{number:05d}"
    under, layout = amount.under(response.force), layout_of(amount)

    def table(name: str, what: str) -> Path:
        return folder.reserve(f"{name}_{number:05d}.csv", what)

    path = table("frf", f"response {under}, over frequency")
    put_response_curves(writer, path, place, amount, response)
    nodes = f"{place}/nodes"
    writer.put(nodes, response.nodes)
    write_curves(
        table("joints", f"what each joint does {under}"),
        {"frequency": response.curves["frequency"], **response.nodes},
        {**layout.datasets(place), **layout.datasets(nodes)},
    )
    if response.resonance is not None:
        writer.put(f"{place}/resonance", response.resonance)
    for count, loop in enumerate(response.loops):
        writer.put(f"{place}/loops/{count:05d}", loop.arrays, **loop.numbers)
    for loop in response.loops[-1:]:
        path = table("loop", f"loop of the joints {under}")
        write_curves(path, loop.arrays, layout.datasets(f"{place}/loops/-"))
    if response.answers is not None:
        path = table("at", f"motions {under}, as requested")
        writer.put_table(path, f"{place}/at", response.answers.arrays)
    for of, arrays in response.harmonics.items():
        writer.put(f"{place}/harmonics/{of}", arrays)
    what = f"harmonics of places and joints {under}, at resonance and as requested"
    write_harmonics(table("harmonics", what), outcome.names, response)
    _put_bifurcations(writer, place, response.bifurcations, amount)


def _put_bifurcations(
    writer: ResultsWriter, place: str, bifurcations: Bifurcations, amount: ExcitationSize
) -> None:
    """Write the bifurcations of the curve at a place, if there are any."""
    if bifurcations:
        kinds = [str(found["kind"]) for found in bifurcations]
        arrays = bifurcation_arrays(bifurcations, amount)
        writer.put(f"{place}/bifurcations", arrays, kind=kinds)


def put_response_curves(
    writer: ResultsWriter, path: Path, place: str, amount: ExcitationSize, response: Response
) -> None:
    """Write the curves of a response, to the results and as a table, and its numbers."""
    numbers = {amount.name: response.force, **response.numbers}
    writer.put_table(path, place, response.curves, **numbers)


def _every_bifurcation(outcome: VibrationOutcome) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield all bifurcations, each with the name of the curve that it is on."""
    named: list[tuple[str, Response | Curves]] = [
        *(
            (outcome.case.amount.as_text(response.force), response)
            for response in outcome.responses
        ),
        *((f"further branch {number}", curve) for number, curve in enumerate(outcome.further)),
        *([] if outcome.backbone is None else [("backbone", outcome.backbone)]),
        *((f"{sweep.numbers['frequency']:g} Hz", sweep) for sweep in outcome.force_sweeps),
    ]
    for name, curve in named:
        yield from ((name, found) for found in curve.bifurcations)


# --- summary ------------------------------------------------------------------------------------


def _summary(outcome: VibrationOutcome) -> dict[str, Any]:
    summary: dict[str, Any] = {
        "law": outcome.case.law_names,
        **outcome.numbers,
        "responses": [
            _response_summary(outcome.case.amount, response) for response in outcome.responses
        ],
    }
    if outcome.backbone is not None:
        points = len(outcome.backbone.arrays["frequency"])
        summary["backbone"] = {"points": points, **_curve_summary(outcome.backbone)}
    if outcome.force_sweeps:
        summary["force_sweeps"] = [_curve_summary(sweep) for sweep in outcome.force_sweeps]
    if outcome.further:
        summary["further_branches"] = [_curve_summary(branch) for branch in outcome.further]
    if outcome.modes:
        summary["modes"] = [dict(mode.numbers) for mode in outcome.modes]
    return summary


def _curve_summary(curve: Curves | Response) -> dict[str, Any]:
    summary = dict(curve.numbers)
    if curve.bifurcations:
        summary["bifurcations"] = [dict(found) for found in curve.bifurcations]
    return summary


def _response_summary(amount: ExcitationSize, response: Response) -> dict[str, Any]:
    summary = {amount.name: response.force, **_curve_summary(response)}
    if response.loops:
        summary["loops"] = [dict(loop.numbers) for loop in response.loops]
    if response.answers is not None:
        summary["at"] = [dict(numbers) for numbers in response.answers.numbers]
    return summary


def _lines(outcome: VibrationOutcome) -> Iterator[str]:
    """Yield lines on the results, for the end of the run."""
    if outcome.case.ring is not None:
        yield f"  {outcome.case.waves}"
    for response in outcome.responses:
        yield f"  {_response_line(outcome.case, response, outcome.labels[-1])}"
        for loop in response.loops[-1:]:
            yield f"    {_loop_line(loop)}"
        if response.answers is not None:
            yield from _answer_lines(response.answers, outcome.labels[-1])
    for branch in outcome.further:
        yield f"  {_further_line(outcome.case.amount, branch)}"
    if outcome.backbone is not None:
        yield f"  {_backbone_line(outcome.case.amount, outcome.backbone)}"
    for mode in outcome.modes:
        yield f"  {_mode_line(mode)}"


def _response_line(case: VibrationCase, response: Response, label: str) -> str:
    """Return a line on the response to a force."""
    numbers = response.numbers
    parts = [
        f"{case.amount.as_text(response.force)}: resonance {numbers['resonance']:.5g} Hz",
        f"{label} moves {TO_MICRONS * numbers['amplitude']:.4g} um{_beside(numbers)}",
        f"damping {percent(numbers['damping'])}",
        f"slips {percent(numbers['slip'])} of the cycle",
        f"{numbers['points']} points",
        f"error {numbers['error']:.1e}",
    ]
    printed = []
    if numbers["folds"]:
        printed.append(counted(len(numbers["folds"]), "fold"))
    if numbers.get("unstable_points"):
        printed.append(f"{numbers['unstable_points']} of them unstable")
    return "; ".join([", ".join(parts), *printed])


def _beside(numbers: Mapping[str, Any]) -> str:
    """Return text on a moving ground and on an engine, empty without these."""
    text = ""
    if "absolute_amplitude" in numbers:
        absolute = TO_MICRONS * numbers["absolute_amplitude"]
        text += f" relative to the ground, {absolute:.4g} um absolute"
    if "speed" in numbers:
        text += f" at {TO_RPM * numbers['speed']:.5g} rpm"
    return text


def _answer_lines(answers: Answers, label: str) -> Iterator[str]:
    """Yield a line for each motion at a frequency of the case."""
    for numbers in answers.numbers:
        at = f"    at {numbers['frequency']:g} Hz"
        if numbers["message"]:
            yield f"{at}: {numbers['message']}"
        for motion in numbers["motions"]:
            yield (
                f"{at}: {label} moves {TO_MICRONS * motion['amplitude']:.4g} um{_beside(motion)}, "
                f"phase {degrees(motion['phase']):.4g} deg, "
                f"{motion['energy_per_cycle']:.4g} mJ a cycle, error {motion['error']:.1e}"
            )


def _loop_line(loop: Curves) -> str:
    numbers = loop.numbers
    lost = f"{numbers['energy']:.4g} mJ" if numbers["slip"] > 0.0 else "no slip"
    text = f"loop at {numbers['frequency']:g} Hz: {lost}"
    if numbers["stiffness"] is not None:
        text += f", sticks with {PER_MICRON * numbers['stiffness']:.4g} N/um"
    if numbers["friction"] is not None:
        text += f", friction {numbers['friction']:.3g}"
    return f"{text}, error {numbers['error']:.1e}"


def _further_line(amount: ExcitationSize, branch: Curves) -> str:
    numbers = branch.numbers
    if numbers["closed"]:
        ends = ", closed"
    else:
        ends = ", which leads to a known one" if numbers["joins"] else ""
    return (
        f"{amount.as_text(numbers[amount.name])}: a further branch from "
        f"{numbers['lowest_frequency']:.5g} to {numbers['highest_frequency']:.5g} Hz{ends}, "
        "at most "
        f"{TO_MICRONS * numbers['largest_amplitude']:.4g} um"
    )


def _backbone_line(amount: ExcitationSize, backbone: Curves) -> str:
    (first, last), (low, high) = (
        backbone.arrays[name][[0, -1]] for name in ("frequency", amount.name)
    )
    return (
        f"phase resonance: {first:.5g} Hz {amount.under(low)}, {last:.5g} Hz under "
        f"{amount.as_text(high)}"
    )


def _mode_line(mode: Curves) -> str:
    numbers = mode.numbers
    least, largest = mode.arrays["amplitude"][[0, -1]]
    first, last = numbers["frequency"]
    return (
        f"mode {numbers['mode']}: {first:.5g} Hz at {TO_MICRONS * least:.3g} um, {last:.5g} Hz at "
        f"{TO_MICRONS * largest:.3g} um, damping up to {percent(numbers['most_damped'])}, "
        f"error {numbers['error']:.1e}"
    )
