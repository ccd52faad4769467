"""Output of a vibration case: results, tables, ParaView files, figures and the summary."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import degrees, pi
from typing import Any

from workflow.analyses.vibration.case.vibration_case import VibrationCase
from workflow.analyses.vibration.output.harmonics import write_harmonics
from workflow.analyses.vibration.output.layout import bifurcation_columns, layout_of
from workflow.analyses.vibration.output.outcome import (
    AT,
    BACKBONE,
    BIFURCATIONS,
    DIAMETERS,
    FORCE_SWEEPS,
    FURTHER,
    HARMONICS,
    LOOPS,
    MODES,
    NODES,
    RESONANCE,
    RESPONSES,
    RING,
    Answers,
    Bifurcations,
    Curves,
    Response,
    VibrationOutcome,
)
from workflow.analyses.vibration.stability import bifurcation_arrays
from workflow.case.text.plain import counted
from workflow.case.text.readable import percent
from workflow.layout.declared import Layout
from workflow.models.vibration.amount import ExcitationSize
from workflow.shell.analysis import Run
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.output.results import ResultsWriter, run_results
from workflow.shell.output.summary import finish
from workflow.shell.output.tables import DIGITS, heading, write_curves, write_table

TO_MICRONS, PER_MICRON = 1e3, 1e-3  # mm to µm, N/mm to N/µm
TO_RPM = 30.0 / pi  # rad/s to rpm


def write_vibration_output(outcome: VibrationOutcome, run: Run[VibrationCase]) -> None:
    """Write all files of a finished run; the summary comes last and marks it as finished."""
    folder, reporter = run.folder, run.reporter
    with reporter.stage("results"):
        _write_results(outcome, run)
        _write_tables(outcome, folder)
    run.draw(outcome.contents)
    finish(run, _summary(outcome), _lines(outcome))


# --- results ------------------------------------------------------------------------------------


def _write_results(outcome: VibrationOutcome, run: Run[VibrationCase]) -> None:
    case = outcome.case
    attributes = {
        "analysis": case.analysis,
        "law": case.law_names,
        "seen": list(outcome.labels),
        "engine_order": case.engine_order,
    }
    with run_results(run, case, layout_of(case.amount), attributes) as writer:
        writer.put_contents(outcome.contents)
        limits = {name: outcome.numbers[name] for name in ("free", "stuck", "sliding")}
        writer.put("linear", outcome.linear, **limits)
        writer.put("names", outcome.names)
        if outcome.diameters is not None:
            ring = outcome.numbers[RING]
            writer.put(DIAMETERS, outcome.diameters, **ring)
        if outcome.contact is not None:
            writer.put("contact", outcome.contact)
        for number, response in enumerate(outcome.responses):
            _put_response(writer, f"{RESPONSES}/{number:05d}", case.amount, response)
        if outcome.backbone is not None:
            writer.put(BACKBONE, outcome.backbone.arrays, **outcome.backbone.numbers)
            _put_bifurcations(writer, BACKBONE, outcome.backbone.bifurcations, case.amount)
        for number, branch in enumerate(outcome.further):
            place = f"{FURTHER}/{number:05d}"
            writer.put(place, branch.arrays, **branch.numbers)
            _put_bifurcations(writer, place, branch.bifurcations, case.amount)
        for number, sweep in enumerate(outcome.force_sweeps):
            place = f"{FORCE_SWEEPS}/{number:05d}"
            writer.put(place, sweep.arrays, **sweep.numbers)
            _put_bifurcations(writer, place, sweep.bifurcations, case.amount)
        for number, mode in enumerate(outcome.modes):
            place = f"{MODES}/{number:05d}"
            writer.put(place, mode.arrays, **mode.numbers)


def _put_response(
    writer: ResultsWriter, place: str, amount: ExcitationSize, response: Response
) -> None:
    put_response_curves(writer, place, amount, response)
    writer.put(f"{place}/{NODES}", response.nodes)
    if response.resonance is not None:
        writer.put(f"{place}/{RESONANCE}", response.resonance)
    for number, loop in enumerate(response.loops):
        writer.put(f"{place}/{LOOPS}/{number:05d}", loop.arrays, **loop.numbers)
    if response.answers is not None:
        writer.put(f"{place}/{AT}", response.answers.arrays)
    for of, arrays in response.harmonics.items():
        writer.put(f"{place}/{HARMONICS}/{of}", arrays)
    _put_bifurcations(writer, place, response.bifurcations, amount)


def _put_bifurcations(
    writer: ResultsWriter, place: str, bifurcations: Bifurcations, amount: ExcitationSize
) -> None:
    """Write the bifurcations of the curve at a place, if there are any."""
    if bifurcations:
        kinds = [str(found["kind"]) for found in bifurcations]
        arrays = bifurcation_arrays(bifurcations, amount)
        writer.put(f"{place}/{BIFURCATIONS}", arrays, kind=kinds)


def put_response_curves(
    writer: ResultsWriter, place: str, amount: ExcitationSize, response: Response
) -> None:
    """Write the curves of a response and its numbers."""
    numbers = {amount.name: response.force, **response.numbers}
    writer.put(place, response.curves, **numbers)


# --- tables -------------------------------------------------------------------------------------


def _write_tables(outcome: VibrationOutcome, folder: OutputFolder) -> None:
    """Write responses, backbone, force sweeps and all other curves as CSV."""
    layout = layout_of(outcome.case.amount)
    _write_responses(outcome, folder, layout)
    if outcome.diameters is not None:
        path = folder.reserve(f"{DIAMETERS}.csv", "natural frequencies, over nodal diameters")
        write_curves(path, outcome.diameters, layout.datasets(DIAMETERS))
    if outcome.backbone is not None:
        path = folder.reserve(
            f"{BACKBONE}.csv", f"phase resonance, over the {outcome.case.amount.name}"
        )
        write_curves(path, outcome.backbone.arrays, layout.datasets(BACKBONE))
    for number, sweep in enumerate(outcome.force_sweeps):
        what = f"response at {sweep.numbers['frequency']:g} Hz, over the {outcome.case.amount.name}"
        path = folder.reserve(f"force_sweep_{number:05d}.csv", what)
        write_curves(path, sweep.arrays, layout.datasets(f"{FORCE_SWEEPS}/-"))
    for mode in outcome.modes:
        what = f"mode {mode.numbers['mode']}, over its amplitude"
        path = folder.reserve(f"mode_{mode.numbers['mode']:05d}.csv", what)
        write_curves(path, mode.arrays, layout.datasets(f"{MODES}/-"))
    amount = outcome.case.amount
    for number, branch in enumerate(outcome.further):
        what = f"further branch {amount.under(branch.numbers[amount.name])}, over frequency"
        path = folder.reserve(f"further_branch_{number:05d}.csv", what)
        write_curves(path, branch.arrays, layout.datasets(f"{FURTHER}/-"))
    found = list(_every_bifurcation(outcome))
    if found:
        path = folder.reserve(f"{BIFURCATIONS}.csv", "where the stability of motions changes")
        columns: dict[str, list[Any]] = {
            "curve": [curve for curve, _ in found],
            "kind": [each["kind"] for _, each in found],
        }
        for name, declared in bifurcation_columns(amount).items():
            columns[heading(name, declared.unit)] = [each[name] for _, each in found]
        write_table(path, columns, DIGITS)


def _write_responses(outcome: VibrationOutcome, folder: OutputFolder, layout: Layout) -> None:
    """Write responses, their harmonics, their finest loops, and motions at given frequencies."""
    place = f"{RESPONSES}/-"
    declared = layout.datasets(place)
    for number, response in enumerate(outcome.responses):
        under = f"{outcome.case.amount.under(response.force)}"
        path = folder.reserve(f"frf_{number:05d}.csv", f"response {under}, over frequency")
        write_curves(path, response.curves, declared)
        path = folder.reserve(f"joints_{number:05d}.csv", f"what each joint does {under}")
        nodes = {"frequency": response.curves["frequency"], **response.nodes}
        write_curves(path, nodes, {**declared, **layout.datasets(f"{place}/{NODES}")})
        if response.loops:
            path = folder.reserve(f"loop_{number:05d}.csv", f"loop of the joints {under}")
            write_curves(path, response.loops[-1].arrays, layout.datasets(f"{place}/{LOOPS}/-"))
        if response.answers is not None:
            path = folder.reserve(f"at_{number:05d}.csv", f"motions {under}, as requested")
            write_curves(path, response.answers.arrays, layout.datasets(f"{place}/{AT}"))
        what = f"harmonics of places and joints {under}, at resonance and as requested"
        path = folder.reserve(f"harmonics_{number:05d}.csv", what)
        write_harmonics(path, outcome.names, response)


def _every_bifurcation(outcome: VibrationOutcome) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield all bifurcations, each with the name of the curve that it is on."""
    for response in outcome.responses:
        yield from (
            (outcome.case.amount.told(response.force), found) for found in response.bifurcations
        )
    for number, branch in enumerate(outcome.further):
        yield from ((f"further branch {number}", found) for found in branch.bifurcations)
    if outcome.backbone is not None:
        yield from ((BACKBONE, found) for found in outcome.backbone.bifurcations)
    for sweep in outcome.force_sweeps:
        at = f"{sweep.numbers['frequency']:g} Hz"
        yield from ((at, found) for found in sweep.bifurcations)


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
        summary[BACKBONE] = {"points": points, **_curve_summary(outcome.backbone)}
    if outcome.force_sweeps:
        summary[FORCE_SWEEPS] = [_curve_summary(sweep) for sweep in outcome.force_sweeps]
    if outcome.further:
        summary[FURTHER] = [_curve_summary(branch) for branch in outcome.further]
    if outcome.modes:
        summary[MODES] = [dict(mode.numbers) for mode in outcome.modes]
    return summary


def _curve_summary(curve: Curves) -> dict[str, Any]:
    summary = dict(curve.numbers)
    if curve.bifurcations:
        summary[BIFURCATIONS] = [dict(found) for found in curve.bifurcations]
    return summary


def _response_summary(amount: ExcitationSize, response: Response) -> dict[str, Any]:
    summary = {amount.name: response.force, **response.numbers}
    if response.bifurcations:
        summary[BIFURCATIONS] = [dict(found) for found in response.bifurcations]
    if response.loops:
        summary[LOOPS] = [dict(loop.numbers) for loop in response.loops]
    if response.answers is not None:
        summary[AT] = [dict(numbers) for numbers in response.answers.numbers]
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
        f"{case.amount.told(response.force)}: resonance {numbers['resonance']:.5g} Hz",
        f"{label} moves {TO_MICRONS * numbers['amplitude']:.4g} um{_beside(numbers)}",
        f"damping {percent(numbers['damping'])}",
        f"slips {percent(numbers['slip'])} of the cycle",
        f"{numbers['points']} points",
        f"error {numbers['error']:.1e}",
    ]
    said = []
    if numbers["folds"]:
        said.append(counted(len(numbers["folds"]), "fold"))
    if numbers.get("unstable_points"):
        said.append(f"{numbers['unstable_points']} of them unstable")
    return "; ".join([", ".join(parts), *said])


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
        f"{amount.told(numbers[amount.name])}: a further branch from "
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
        f"{amount.told(high)}"
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
