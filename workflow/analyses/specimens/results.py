"""Output of a run of specimens: results, reduced models, summary, ParaView files and figures."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from fe_models.joints.reduced_contact import masing_loop
from fe_models.joints.reduction import ReducedModel, write_reduced
from fe_models.matrices import write_matrices
from sa_solver.types import Array
from workflow.analyses.specimens.case import SpecimensCase
from workflow.analyses.specimens.layout import LAYOUT, PAD
from workflow.analyses.specimens.outcome import LoadOutcome, SpecimensOutcome, SpecimensState
from workflow.analyses.specimens.summary import (
    SLOPE_SHARE,
    collapse,
    explanation,
    frequencies,
    late,
    load_summary,
    pressure_deviation,
    reported_summary,
    tied_pad,
)
from workflow.analyses.wear.output.datasets import kinetics_columns, mesh_of
from workflow.messages.warning_kinds import WarningKind
from workflow.models.specimens.wear import BlockState
from workflow.shell.analysis import Run
from workflow.shell.folders.store import replacing_hdf5
from workflow.shell.output.results import ResultsWriter, run_results
from workflow.shell.output.summary import finish
from workflow.shell.terminal.reporter import Reporter

# The two shapes that are compared with a half-space.
SHAPES = "unworn", "worn"


def write_specimens_output(outcome: SpecimensOutcome, run: Run[SpecimensCase]) -> None:
    """Write all files of a finished run; the summary comes last and marks it as finished."""
    folder, reporter = run.folder, run.reporter
    with reporter.stage("results"):
        what = "reduced models of the specimens, to build rigs of"
        with folder.filling("reduced", what) as reduced:
            for number, model in enumerate(outcome.model.reduction.models, 1):
                with replacing_hdf5(reduced / f"body_{number}.h5") as file:
                    write_reduced(file, model)
                _write_matrices(model, reduced, f"body_{number}", run.case.output.matrix_formats)
        _write_results(outcome, run)
    run.draw(None)  # every run has the same contents
    summary = _summary(outcome, reporter)
    finish(run, summary, _lines(summary))


def _write_matrices(model: ReducedModel, folder: Path, stem: str, formats: tuple[str, ...]) -> None:
    """Write matrices for other programs, moved into the folder once they are complete."""
    with TemporaryDirectory(dir=folder) as beside:
        write_matrices(model, Path(beside), stem, formats)
        for path in Path(beside).iterdir():
            path.replace(folder / path.name)


# --- results ------------------------------------------------------------------------------------


def _write_results(outcome: SpecimensOutcome, run: Run[SpecimensCase]) -> None:
    case, face, areas = run.case, outcome.model.face, outcome.model.pair.areas
    attributes = {"friction": case.friction.coefficient}
    with run_results(run, case, LAYOUT, attributes) as writer:
        writer.put_contents(None)
        writer.put_grid(f"grid/{PAD}", outcome.half_space.grid, face.frame)
        writer.put("specimens/pad", {**mesh_of(face), "area": areas})
        for number, (full, reduced) in enumerate(outcome.model.reduction.frequencies, 1):
            writer.put(f"specimens/body_{number}", {"full": full, "reduced": reduced})
        for number, load in enumerate(outcome.loads):
            _put_load(writer, f"loads/{number}", load, areas)


def _put_load(writer: ResultsWriter, group: str, load: LoadOutcome, areas: Array) -> None:
    writer.put(group, {}, normal_force=load.force, unit="N")
    writer.put(f"{group}/kinetics", _kinetics(load.blocks, areas))
    for number, kept in enumerate(load.kept):
        name, loop = f"{group}/states/{number:05d}", masing_loop(kept.curve)
        numbers = {"cycles": kept.block.cycles, "energy": kept.block.energy}
        writer.put(name, _state(kept, areas), **numbers)
        _put_loop(writer, f"{name}/loop", loop.displacement, loop.force)
    for shape, beside in zip(SHAPES, load.half_space, strict=True):
        name, path = f"{group}/half_space/{shape}", 4.0 * beside.slip
        fields = {"pressure": beside.pressure, "shear_x": beside.shear, "cycle_slip": path}
        writer.put(name, fields)
        _put_loop(writer, f"{name}/first_loading", beside.displacement, beside.force)
    _put_loop(writer, f"{group}/coupled_cycle", load.marched.displacement, load.marched.force)


def _put_loop(writer: ResultsWriter, group: str, displacement: Array, force: Array) -> None:
    writer.put(group, {"ring_displacement": displacement, "ring_force": force})


def _kinetics(blocks: tuple[BlockState, ...], areas: Array) -> dict[str, Array]:
    """Return numbers at the start of every cycle block, ``(blocks + 1,)`` each."""
    worn = [
        (*(d.max() for d in state.depths), *(d @ areas for d in state.depths), state.energy)
        for state in blocks
    ]
    rows = [
        {
            "energy_per_cycle": state.contact.energy,
            "stick_stiffness": state.contact.stick_stiffness,
            "approach": state.contact.normal.approach,
            "peak_pressure": state.contact.normal.pressure.max(),
            "pressure_deviation": pressure_deviation(areas, state.contact.normal.pressure),
            "friction": state.contact.friction,
            "stable_cycles": state.stable_cycles,
        }
        for state in blocks
    ]
    return {
        "cycles": np.array([state.cycles for state in blocks]),
        **kinetics_columns(np.array(worn), np.array([s.contact.normal.area for s in blocks])),
        **{name: np.array([row[name] for row in rows]) for name in rows[0]},
    }


def _state(kept: SpecimensState, areas: Array) -> dict[str, Array]:
    """Return fields of the pad in a worn state, at its nodes."""
    block, contact = kept.block, kept.block.contact
    worn_1, worn_2 = block.depths
    return {
        "pressure": contact.normal.pressure,
        "shear_x": contact.tangential.shear / areas,
        "cycle_slip": contact.cycle_slip,
        "gap": contact.normal.gap,
        "worn_1": worn_1,
        "worn_2": worn_2,
        "secant_stiffness": np.array(kept.curve.secant_stiffness(SLOPE_SHARE)),
    }


# --- summary ------------------------------------------------------------------------------------


def _summary(outcome: SpecimensOutcome, reporter: Reporter) -> dict[str, Any]:
    model, wear = outcome.model, outcome.case.wear
    loads = [load_summary(outcome, load) for load in outcome.loads]
    for load in loads:
        if late(load):
            reporter.warn(
                WarningKind.NOT_STEADY,
                f"{load['normal_force']:g} N: steady only near the end of the run; raise "
                "wear.energy or wear.cycles to be sure",
            )
    coefficients = wear.body_1.rate(1.0), wear.body_2.rate(1.0)  # reports need laws of energy
    return {
        "structure": {"nodes": model.node_count(), "pad_nodes": len(model.face)},
        **outcome.case.surfaces_summary(),
        "frequencies": frequencies(outcome),
        "tied_pad": tied_pad(outcome.bulk),
        "explanation": explanation(outcome),
        "loads": loads,
        "collapse": collapse(loads),
        "reported": [reported_summary(entry, loads, coefficients) for entry in wear.reported],
    }


def _lines(summary: dict[str, Any]) -> Iterator[str]:
    """Yield lines on the results, for the end of the run."""
    body = summary["frequencies"]["body_1"]
    for name in ("full", "reduced"):
        values = ", ".join(f"{value:.0f}" for value in body[name])
        yield f"  free frequencies, {name}: {values} Hz"
    for load in summary["loads"]:
        first, last, steady = load["unworn"], load["worn"], load["steady"]["stiffness"]
        stuck, slope = (
            f"{1e-3 * first[name]:.4g} to {1e-3 * last[name]:.4g}"
            for name in ("stick_stiffness", "secant_stiffness")
        )
        yield (
            f"  {load['normal_force']:g} N: stiffness {stuck} N/um, slope of the loop {slope} N/um"
        )
        yield (
            f"    area {first['area']:.3g} to {last['area']:.3g} mm^2, stiffness steady after "
            f"{steady['cycles']:.4g} cycles, {1e-3 * steady['energy']:.4g} J"
        )
    tied = summary["tied_pad"]["tangential"]
    yield (
        f"  tied pad along x: {1e-3 * tied['specimens']:.4g} N/um, half-space "
        f"{1e-3 * tied['half_space']:.4g}: a difference of "
        f"{1e6 * tied['bulk_compliance']:.3g} nm/N"
    )
    for reported in summary["reported"]:
        if reported["coefficients"] is None:
            continue
        values = " and ".join(f"{1e12 * value:.4g}" for value in reported["coefficients"])
        yield (
            f"  {reported['normal_force']:g} N, {reported['steady']} steady after "
            f"{reported['cycles_reported']:.4g} cycles: with {values} um^3/J"
        )
