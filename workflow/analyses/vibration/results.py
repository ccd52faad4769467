"""What a vibration case leaves: results, tables, files for ParaView, figures, and the summary."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from workflow.analyses.vibration.case import VibrationCase
from workflow.analyses.vibration.figures.response import figures_of
from workflow.analyses.vibration.outcome import (
    FORCE_SWEEPS,
    LOOPS,
    NODES,
    RESONANCE,
    Curves,
    Response,
    VibrationOutcome,
)
from workflow.analyses.vibration.paraview import write_vibration
from workflow.pictures.drawing import write_pictures
from workflow.shell.analysis import Run
from workflow.shell.reporter import Reporter
from workflow.shell.results import ResultsWriter, run_results
from workflow.shell.tables import write_curves
from workflow.shell.versions import versions

RESPONSES, BACKBONE = "responses", "backbone"
TO_MICRONS, PER_MICRON = 1e3, 1e-3  # mm to µm, N/mm to N/µm


def write_vibration_output(outcome: VibrationOutcome, run: Run[VibrationCase]) -> None:
    """Write all files of a finished run; the summary comes last and marks it as finished."""
    folder, reporter = run.folder, run.reporter
    with reporter.stage("results"):
        _write_results(outcome, run)
        _write_tables(outcome, folder.root)
    with reporter.stage("paraview and figures"):
        write_pictures(outcome.case.output, folder, figures_of, write_vibration)
    summary = _summary(outcome, reporter)
    folder.write_summary(summary)
    for response in outcome.responses:
        for line in _lines(response, outcome.labels[-1]):
            reporter.say(f"  {line}")
    if outcome.backbone is not None:
        reporter.say(f"  {_backbone_line(outcome.backbone)}")
    seconds = ", ".join(f"{name} {value:.1f}" for name, value in summary["seconds"].items())
    reporter.say(f"  seconds: {seconds}")


# --- results ------------------------------------------------------------------------------------


def _write_results(outcome: VibrationOutcome, run: Run[VibrationCase]) -> None:
    case = outcome.case
    attributes = {"analysis": case.analysis, "law": case.joint.law, "seen": list(outcome.labels)}
    with run_results(run, case, attributes) as writer:
        limits = {name: outcome.numbers[name] for name in ("free", "stuck", "sliding")}
        writer.put("linear", outcome.linear, **limits)
        if outcome.contact is not None:
            writer.put("contact", outcome.contact)
        for number, response in enumerate(outcome.responses):
            _put_response(writer, f"{RESPONSES}/{number:05d}", response)
        if outcome.backbone is not None:
            writer.put(BACKBONE, outcome.backbone.datasets, **outcome.backbone.numbers)
        for number, sweep in enumerate(outcome.force_sweeps):
            writer.put(f"{FORCE_SWEEPS}/{number:05d}", sweep.datasets, **sweep.numbers)


def _put_response(writer: ResultsWriter, place: str, response: Response) -> None:
    put_response_curves(writer, place, response)
    for kind, datasets in ((NODES, response.nodes), (RESONANCE, response.resonance)):
        if datasets is not None:
            writer.put(f"{place}/{kind}", datasets)
    for number, loop in enumerate(response.loops):
        writer.put(f"{place}/{LOOPS}/{number:05d}", loop.datasets, **loop.numbers)


def put_response_curves(writer: ResultsWriter, place: str, response: Response) -> None:
    """The curves of a response and its numbers."""
    writer.put(place, response.curves, **{"force": response.force, **response.numbers})


# --- tables -------------------------------------------------------------------------------------


def _write_tables(outcome: VibrationOutcome, root: Path) -> None:
    """Responses, loops (the finest of each force), backbone and force sweeps as CSV."""
    for number, response in enumerate(outcome.responses):
        write_curves(root / f"frf_{number:05d}.csv", response.curves)
        if response.loops:
            write_curves(root / f"loop_{number:05d}.csv", response.loops[-1].datasets)
    if outcome.backbone is not None:
        write_curves(root / f"{BACKBONE}.csv", outcome.backbone.datasets)
    for number, sweep in enumerate(outcome.force_sweeps):
        write_curves(root / f"force_sweep_{number:05d}.csv", sweep.datasets)


# --- summary ------------------------------------------------------------------------------------


def _summary(outcome: VibrationOutcome, reporter: Reporter) -> dict[str, Any]:
    case = outcome.case
    found: dict[str, Any] = {
        "title": case.title,
        "assumed": list(case.assumed),
        "law": case.joint.law,
        **outcome.numbers,
        "responses": [_response_summary(own) for own in outcome.responses],
    }
    if outcome.backbone is not None:
        points = len(outcome.backbone.datasets["force"].values)
        found[BACKBONE] = {"points": points, **outcome.backbone.numbers}
    if outcome.force_sweeps:
        found[FORCE_SWEEPS] = [dict(sweep.numbers) for sweep in outcome.force_sweeps]
    return found | {
        "warnings": reporter.warnings,
        "seconds": {name: round(value, 2) for name, value in reporter.seconds.items()},
        "versions": versions(),
    }


def _response_summary(response: Response) -> dict[str, Any]:
    found = {"force": response.force, **response.numbers}
    if response.loops:
        found[LOOPS] = [dict(loop.numbers) for loop in response.loops]
    return found


def _lines(response: Response, label: str) -> list[str]:
    """What a force does, in a line; and its loop, in another."""
    own = response.numbers
    parts = [
        f"{response.force:g} N: resonance {own['resonance']:.5g} Hz",
        f"{label} moves {TO_MICRONS * own['amplitude']:.4g} um",
        f"damping {own['damping']:.2%}",
        f"slips {own['slip']:.0%} of the cycle",
        f"{own['points']} points",
        f"harmonics left out {own['left_out']:.1e}",
    ]
    text = ", ".join(parts) + (f"; {len(own['folds'])} folds" if own["folds"] else "")
    return [text, *(_loop_line(loop) for loop in response.loops[-1:])]


def _loop_line(loop: Curves) -> str:
    own = loop.numbers
    lost = f"{own['energy']:.4g} mJ" if own["slip"] > 0.0 else "no slip"
    text = f"  loop at {own['frequency']:g} Hz: {lost}"
    if own["stiffness"] is not None:
        text += f", sticks with {PER_MICRON * own['stiffness']:.4g} N/um"
    if own["friction"] is not None:
        text += f", friction {own['friction']:.3g}"
    return f"{text}, harmonics left out {own['left_out']:.1e}"


def _backbone_line(backbone: Curves) -> str:
    (first, last), (low, high) = (
        backbone.datasets[name].values[[0, -1]] for name in ("frequency", "force")
    )
    return f"phase resonance: {first:.5g} Hz under {low:g} N, {last:.5g} Hz under {high:g} N"
