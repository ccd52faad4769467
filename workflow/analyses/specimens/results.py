"""Output of a run of specimens: results, reduced models, summary, ParaView files and figures."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from fe_models.joints.reduced_contact import masing_loop
from fe_models.joints.reduction import ReducedModel, save_reduced
from fe_models.matrices import write_matrices
from sa_solver.types import Array
from workflow.analyses.specimens.case import SpecimensCase
from workflow.analyses.specimens.outcome import KeptState, LoadOutcome, SpecimensOutcome
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
from workflow.analyses.specimens.wear import BlockState
from workflow.analyses.wear.output.datasets import cycles_column, face_mesh, kinetics_columns
from workflow.shell.analysis import Run
from workflow.shell.folders.store import replacing_hdf5
from workflow.shell.output.dataset import Dataset, described
from workflow.shell.output.results import CurveAxis, On, ResultsWriter, run_results
from workflow.shell.output.summary import finish
from workflow.shell.terminal.reporter import Reporter

# Name of the pad's grid, and of the two shapes that are compared with a half-space.
PAD = "pad"
SHAPES = "unworn", "worn"

# Unit and description of results.
FREQUENCIES = {
    "full": ("Hz", "natural frequencies of the free body, finite elements"),
    "reduced": ("Hz", "natural frequencies of the free body, reduced model"),
}
KINETICS = {
    "energy_per_cycle": ("N mm", "energy dissipated in a cycle"),
    "stick_stiffness": ("N/mm", "tangential stiffness with all contact stuck"),
    "approach": ("mm", "motion of body 1 towards body 2"),
    "peak_pressure": ("MPa", "largest pressure"),
    "pressure_deviation": ("1", "root mean square of pressure/mean - 1 over the pad"),
    "friction": ("1", "largest tangential over normal force"),
    # Infinite where no node slides.
    "stable_cycles": ("1", "cycles of constant shape beyond which errors of shape grow"),
}
# Fields at the nodes of the pad or the cells of its grid; tractions are those of first loading.
PAD_FIELDS = {
    "pressure": ("MPa", "contact pressure"),
    "shear_x": ("MPa", "shear on body 2 along x at the end of first loading"),
    "cycle_slip": ("mm", "path of slip along x in a cycle"),
}
NODAL_FIELDS = {
    "gap": ("mm", "distance of the deformed faces"),
    "worn_1": ("mm", "worn depth of body 1"),
    "worn_2": ("mm", "worn depth of body 2"),
    "secant_stiffness": ("N/mm", "slope of the loop up to half of its largest force"),
}
RING_LOOP = {
    "ring_displacement": ("mm", "motion of body 2's ring along x"),
    "ring_force": ("N", "force along x that moves body 2's ring"),
}


def write_specimens_output(outcome: SpecimensOutcome, run: Run[SpecimensCase]) -> None:
    """Write all files of a finished run; the summary comes last and marks it as finished."""
    folder, reporter = run.folder, run.reporter
    with reporter.stage("results"):
        what = "reduced models of the specimens, to build rigs of"
        with folder.filling("reduced", what) as reduced:
            for number, model in enumerate(outcome.model.reduction.models, 1):
                with replacing_hdf5(reduced / f"body_{number}.h5") as stream:
                    save_reduced(stream, model)
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
    with run_results(run, case, {"friction": case.friction.coefficient}) as writer:
        writer.put_contents(None)
        writer.put_grid(f"grid/{PAD}", outcome.half_space.grid, face.frame)
        shares = {"area": Dataset(areas, "mm^2", "contact area that belongs to each node")}
        writer.put("specimens/pad", face_mesh(face) | shares)
        for number, both in enumerate(outcome.model.reduction.frequencies, 1):
            writer.put(f"specimens/body_{number}", described(FREQUENCIES, both))
        for number, load in enumerate(outcome.loads):
            _put_load(writer, f"loads/{number}", load, areas)


def _put_load(writer: ResultsWriter, group: str, load: LoadOutcome, areas: Array) -> None:
    writer.put(group, {}, normal_force=load.force, unit="N")
    writer.put(f"{group}/kinetics", _kinetics(load.blocks, areas), CurveAxis("cycles"))
    for number, kept in enumerate(load.kept):
        name, loop = f"{group}/states/{number:05d}", masing_loop(kept.curve)
        numbers = {"cycles": kept.block.cycles, "energy": kept.block.energy}
        writer.put(name, _state(kept, areas), **numbers)
        writer.put(f"{name}/loop", described(RING_LOOP, (loop.displacement, loop.force)))
    for shape, beside in zip(SHAPES, load.half_space, strict=True):
        name = f"{group}/half_space/{shape}"
        fields = beside.pressure, beside.shear, 4.0 * beside.slip
        first_loading = beside.displacement, beside.force
        writer.put(name, described(PAD_FIELDS, fields), On(f"grid/{PAD}"))
        writer.put(f"{name}/first_loading", described(RING_LOOP, first_loading))
    marched = load.marched.displacement, load.marched.force
    writer.put(f"{group}/coupled_cycle", described(RING_LOOP, marched))


def _kinetics(blocks: tuple[BlockState, ...], areas: Array) -> dict[str, Dataset]:
    """Return numbers at the start of every cycle block, ``(blocks + 1,)`` each."""
    worn = [
        (*(d.max() for d in state.depths), *(d @ areas for d in state.depths), state.energy)
        for state in blocks
    ]
    rows = [
        (
            state.contact.energy,
            state.contact.stick_stiffness,
            state.contact.normal.approach,
            state.contact.normal.pressure.max(),
            pressure_deviation(areas, state.contact.normal.pressure),
            state.contact.friction,
            state.stable_cycles,
        )
        for state in blocks
    ]
    return {
        "cycles": cycles_column(np.array([state.cycles for state in blocks])),
        **kinetics_columns(np.array(worn), np.array([s.contact.normal.area for s in blocks])),
        **described(KINETICS, np.array(rows).T),
    }


def _state(kept: KeptState, areas: Array) -> dict[str, Dataset]:
    """Return fields of the pad in a worn state, at its nodes."""
    block, contact = kept.block, kept.block.contact
    fields = contact.normal.pressure, contact.tangential.shear / areas, contact.cycle_slip
    secant = np.array(kept.curve.secant_stiffness(SLOPE_SHARE))
    return described(PAD_FIELDS, fields) | described(
        NODAL_FIELDS, (contact.normal.gap, *block.depths, secant)
    )


# --- summary ------------------------------------------------------------------------------------


def _summary(outcome: SpecimensOutcome, reporter: Reporter) -> dict[str, Any]:
    model, wear = outcome.model, outcome.model.case.wear
    loads = [load_summary(outcome, load) for load in outcome.loads]
    for load in loads:
        if late(load):
            reporter.warn(
                f"{load['normal_force']:g} N: steady only near the end of the run; raise "
                "wear.energy or wear.cycles to be sure"
            )
    coefficients = wear.body_1.rate(1.0), wear.body_2.rate(1.0)  # reports need laws of energy
    return {
        "structure": {"nodes": model.node_count(), "pad_nodes": len(model.face)},
        **model.case.told_surfaces(),
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
