"""What a vibration case leaves: results, tables, files for ParaView, figures, and the summary."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py

from workflow.analyses.vibration.figures.response import figures_of
from workflow.analyses.vibration.outcome import (
    DATASETS,
    FORCE_SWEEPS,
    LOOPS,
    NODES,
    RESONANCE,
    Curves,
    Response,
    VibrationOutcome,
)
from workflow.analyses.vibration.paraview import write_vibration
from workflow.analyses.vibration.store import put, write_table
from workflow.case.writing import dump_case
from workflow.pictures.drawing import write_pictures
from workflow.shell.folder import OutputFolder
from workflow.shell.reporter import Reporter
from workflow.shell.store import replacing
from workflow.shell.versions import versions

RESPONSES, CONTACT, LINEAR, BACKBONE = "responses", "contact", "linear", "backbone"
TO_MICRONS, PER_MICRON = 1e3, 1e-3  # mm to µm, N/mm to N/µm


def write_vibration_output(
    outcome: VibrationOutcome, folder: OutputFolder, reporter: Reporter
) -> None:
    """Write all files of a finished run; the summary comes last and marks it as finished."""
    with reporter.stage("results"):
        _write_results(outcome, folder.results)
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


def _write_results(outcome: VibrationOutcome, path: Path) -> None:
    case = outcome.case
    with replacing(path) as partial, h5py.File(partial, "w") as file:
        file.attrs.update({"title": case.title, "analysis": case.analysis, "law": case.joint.law})
        file.attrs["seen"] = list(outcome.labels)
        file.create_group("case").attrs.update({"text": dump_case(case)} | versions())
        linear = put(file, LINEAR, outcome.linear, DATASETS[LINEAR])
        linear.attrs.update({name: outcome.numbers[name] for name in ("free", "stuck", "sliding")})
        if outcome.contact is not None:
            put(file, CONTACT, outcome.contact, DATASETS[CONTACT])
        for number, response in enumerate(outcome.responses):
            _put_response(file, f"{RESPONSES}/{number:05d}", response)
        if outcome.backbone is not None:
            _put_curves(file, BACKBONE, BACKBONE, outcome.backbone)
        for number, sweep in enumerate(outcome.force_sweeps):
            _put_curves(file, f"{FORCE_SWEEPS}/{number:05d}", FORCE_SWEEPS, sweep)


def _put_response(file: h5py.File, place: str, response: Response) -> None:
    group = put(file, place, response.curves, DATASETS[RESPONSES])
    group.attrs.update({"force": response.force, **response.numbers})
    for kind, values in ((NODES, response.nodes), (RESONANCE, response.resonance)):
        if values is not None:
            put(file, f"{place}/{kind}", values, DATASETS[kind])
    for number, loop in enumerate(response.loops):
        _put_curves(file, f"{place}/{LOOPS}/{number:05d}", LOOPS, loop)


def _put_curves(file: h5py.File, place: str, kind: str, curves: Curves) -> None:
    """Curves and their numbers; those that there are not are left out."""
    numbers = {name: value for name, value in curves.numbers.items() if value is not None}
    put(file, place, curves.values, DATASETS[kind]).attrs.update(numbers)


# --- tables -------------------------------------------------------------------------------------


def _write_tables(outcome: VibrationOutcome, root: Path) -> None:
    """Responses, loops (the finest of each force), backbone and force sweeps as CSV."""
    for number, response in enumerate(outcome.responses):
        write_table(root / f"frf_{number:05d}.csv", response.curves, DATASETS[RESPONSES])
        if response.loops:
            write_table(root / f"loop_{number:05d}.csv", response.loops[-1].values, DATASETS[LOOPS])
    if outcome.backbone is not None:
        write_table(root / f"{BACKBONE}.csv", outcome.backbone.values, DATASETS[BACKBONE])
    for number, sweep in enumerate(outcome.force_sweeps):
        write_table(root / f"force_sweep_{number:05d}.csv", sweep.values, DATASETS[FORCE_SWEEPS])


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
        points = len(outcome.backbone.values["force"])
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
    (first, last), (low, high) = (backbone.values[name][[0, -1]] for name in ("frequency", "force"))
    return f"phase resonance: {first:.5g} Hz under {low:g} N, {last:.5g} Hz under {high:g} N"
