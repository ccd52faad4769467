"""What a vibration case leaves: results, tables, files for ParaView, figures, and the summary."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from workflow.analyses.vibration.case import VibrationCase
from workflow.analyses.vibration.outcome import (
    BIFURCATIONS,
    FORCE_SWEEPS,
    FURTHER,
    LOOPS,
    NODES,
    RESONANCE,
    Bifurcations,
    Curves,
    Response,
    VibrationOutcome,
)
from workflow.analyses.vibration.stability import COLUMNS, bifurcation_datasets
from workflow.case.plain import counted
from workflow.shell.analysis import Run
from workflow.shell.folder import OutputFolder
from workflow.shell.results import Along, ResultsWriter, run_results
from workflow.shell.summary import finish
from workflow.shell.tables import DIGITS, heading, write_curves, write_table

RESPONSES, BACKBONE = "responses", "backbone"
TO_MICRONS, PER_MICRON = 1e3, 1e-3  # mm to µm, N/mm to N/µm


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
    attributes = {"analysis": case.analysis, "law": case.joint.law, "seen": list(outcome.labels)}
    with run_results(run, case, attributes) as writer:
        writer.put_contents(outcome.contents)
        limits = {name: outcome.numbers[name] for name in ("free", "stuck", "sliding")}
        writer.put("linear", outcome.linear, Along("frequency"), **limits)
        if outcome.contact is not None:
            writer.put("contact", outcome.contact)
        for number, response in enumerate(outcome.responses):
            _put_response(writer, f"{RESPONSES}/{number:05d}", response)
        if outcome.backbone is not None:
            writer.put(
                BACKBONE, outcome.backbone.datasets, Along("force"), **outcome.backbone.numbers
            )
            _put_bifurcations(writer, BACKBONE, outcome.backbone.bifurcations)
        for number, branch in enumerate(outcome.further):
            place = f"{FURTHER}/{number:05d}"
            writer.put(place, branch.datasets, Along("frequency"), **branch.numbers)
            _put_bifurcations(writer, place, branch.bifurcations)
        for number, sweep in enumerate(outcome.force_sweeps):
            place = f"{FORCE_SWEEPS}/{number:05d}"
            writer.put(place, sweep.datasets, Along("force"), **sweep.numbers)
            _put_bifurcations(writer, place, sweep.bifurcations)


def _put_response(writer: ResultsWriter, place: str, response: Response) -> None:
    put_response_curves(writer, place, response)
    for kind, datasets in ((NODES, response.nodes), (RESONANCE, response.resonance)):
        if datasets is not None:
            writer.put(f"{place}/{kind}", datasets)
    for number, loop in enumerate(response.loops):
        writer.put(f"{place}/{LOOPS}/{number:05d}", loop.datasets, **loop.numbers)
    _put_bifurcations(writer, place, response.bifurcations)


def _put_bifurcations(writer: ResultsWriter, place: str, bifurcations: Bifurcations) -> None:
    """Those of the curve at a place, if there are any."""
    if bifurcations:
        kinds = [str(found["kind"]) for found in bifurcations]
        datasets = bifurcation_datasets(bifurcations)
        writer.put(f"{place}/{BIFURCATIONS}", datasets, kind=kinds)


def put_response_curves(writer: ResultsWriter, place: str, response: Response) -> None:
    """The curves of a response and its numbers."""
    numbers = {"force": response.force, **response.numbers}
    writer.put(place, response.curves, Along("frequency"), **numbers)


# --- tables -------------------------------------------------------------------------------------


def _write_tables(outcome: VibrationOutcome, folder: OutputFolder) -> None:
    """Responses, loops (the finest of each force), backbone and force sweeps as CSV."""
    for number, response in enumerate(outcome.responses):
        under = f"under {response.force:g} N"
        path = folder.reserve(f"frf_{number:05d}.csv", f"response {under}, over frequency")
        write_curves(path, response.curves)
        if response.loops:
            path = folder.reserve(f"loop_{number:05d}.csv", f"loop of the joints {under}")
            write_curves(path, response.loops[-1].datasets)
    if outcome.backbone is not None:
        path = folder.reserve(f"{BACKBONE}.csv", "phase resonance, over the force")
        write_curves(path, outcome.backbone.datasets)
    for number, sweep in enumerate(outcome.force_sweeps):
        what = f"response at {sweep.numbers['frequency']:g} Hz, over the force"
        write_curves(folder.reserve(f"force_sweep_{number:05d}.csv", what), sweep.datasets)
    for number, branch in enumerate(outcome.further):
        what = f"further branch under {branch.numbers['force']:g} N, over frequency"
        write_curves(folder.reserve(f"further_branch_{number:05d}.csv", what), branch.datasets)
    found = list(_every_bifurcation(outcome))
    if found:
        path = folder.reserve(f"{BIFURCATIONS}.csv", "where the stability of motions changes")
        columns: dict[str, list[Any]] = {
            "curve": [curve for curve, _ in found],
            "kind": [each["kind"] for _, each in found],
        }
        for name, (unit, _) in COLUMNS.items():
            columns[heading(name, unit)] = [each[name] for _, each in found]
        write_table(path, columns, DIGITS)


def _every_bifurcation(outcome: VibrationOutcome) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """All bifurcations, each with the name of the curve that it is on."""
    for response in outcome.responses:
        yield from ((f"{response.force:g} N", found) for found in response.bifurcations)
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
        "law": outcome.case.joint.law,
        **outcome.numbers,
        "responses": [_response_summary(response) for response in outcome.responses],
    }
    if outcome.backbone is not None:
        points = len(outcome.backbone.datasets["force"].values)
        summary[BACKBONE] = {"points": points, **_curve_summary(outcome.backbone)}
    if outcome.force_sweeps:
        summary[FORCE_SWEEPS] = [_curve_summary(sweep) for sweep in outcome.force_sweeps]
    if outcome.further:
        summary[FURTHER] = [_curve_summary(branch) for branch in outcome.further]
    return summary


def _curve_summary(curve: Curves) -> dict[str, Any]:
    summary = dict(curve.numbers)
    if curve.bifurcations:
        summary[BIFURCATIONS] = [dict(found) for found in curve.bifurcations]
    return summary


def _response_summary(response: Response) -> dict[str, Any]:
    summary = {"force": response.force, **response.numbers}
    if response.bifurcations:
        summary[BIFURCATIONS] = [dict(found) for found in response.bifurcations]
    if response.loops:
        summary[LOOPS] = [dict(loop.numbers) for loop in response.loops]
    return summary


def _lines(outcome: VibrationOutcome) -> Iterator[str]:
    """The end of the run in a few lines."""
    for response in outcome.responses:
        yield f"  {_response_line(response, outcome.labels[-1])}"
        for loop in response.loops[-1:]:
            yield f"    {_loop_line(loop)}"
    for branch in outcome.further:
        yield f"  {_further_line(branch)}"
    if outcome.backbone is not None:
        yield f"  {_backbone_line(outcome.backbone)}"


def _response_line(response: Response, label: str) -> str:
    """What a force does."""
    numbers = response.numbers
    parts = [
        f"{response.force:g} N: resonance {numbers['resonance']:.5g} Hz",
        f"{label} moves {TO_MICRONS * numbers['amplitude']:.4g} um",
        f"damping {numbers['damping']:.2%}",
        f"slips {numbers['slip']:.0%} of the cycle",
        f"{numbers['points']} points",
        f"error {numbers['error']:.1e}",
    ]
    said = []
    if numbers["folds"]:
        said.append(counted(len(numbers["folds"]), "fold"))
    if numbers.get("unstable_points"):
        said.append(f"{numbers['unstable_points']} of them unstable")
    return "; ".join([", ".join(parts), *said])


def _loop_line(loop: Curves) -> str:
    numbers = loop.numbers
    lost = f"{numbers['energy']:.4g} mJ" if numbers["slip"] > 0.0 else "no slip"
    text = f"loop at {numbers['frequency']:g} Hz: {lost}"
    if numbers["stiffness"] is not None:
        text += f", sticks with {PER_MICRON * numbers['stiffness']:.4g} N/um"
    if numbers["friction"] is not None:
        text += f", friction {numbers['friction']:.3g}"
    return f"{text}, error {numbers['error']:.1e}"


def _further_line(branch: Curves) -> str:
    numbers = branch.numbers
    if numbers["closed"]:
        ends = ", closed"
    else:
        ends = ", which comes out on a known one" if numbers["joins"] else ""
    return (
        f"{numbers['force']:g} N: a further branch from {numbers['lowest_frequency']:.5g} to "
        f"{numbers['highest_frequency']:.5g} Hz{ends}, at most "
        f"{TO_MICRONS * numbers['largest_amplitude']:.4g} um"
    )


def _backbone_line(backbone: Curves) -> str:
    (first, last), (low, high) = (
        backbone.datasets[name].values[[0, -1]] for name in ("frequency", "force")
    )
    return f"phase resonance: {first:.5g} Hz under {low:g} N, {last:.5g} Hz under {high:g} N"
