"""What a run of specimens leaves: results, reduced models, summary, ParaView files and figures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from fe_models.reduced_contact import masing_loop
from fe_models.reduction import save_reduced
from sa_solver.types import Array
from workflow.analyses.specimens.figures import figures_of
from workflow.analyses.specimens.paraview import write_specimens
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
from workflow.case.writing import dump_case
from workflow.pictures.drawing import write_pictures
from workflow.shell.folder import OutputFolder
from workflow.shell.reporter import Reporter
from workflow.shell.store import ResultsWriter, replacing
from workflow.shell.versions import versions

if TYPE_CHECKING:
    from workflow.analyses.specimens.half_space import HalfSpaceState
    from workflow.analyses.specimens.outcome import KeptState, LoadOutcome, SpecimensOutcome
    from workflow.analyses.specimens.wear import BlockState

# Name of the pad's grid, and of the two shapes that a half-space is put beside.
PAD = "pad"
SHAPES = "unworn", "worn"


def write_specimens_output(
    outcome: SpecimensOutcome, folder: OutputFolder, reporter: Reporter
) -> None:
    """Write all files of a finished run; the summary comes last and marks it as finished."""
    with reporter.stage("results"):
        folder.reduced.mkdir(exist_ok=True)
        for number, model in enumerate(outcome.model.reduction.models, 1):
            with replacing(folder.reduced / f"body_{number}.h5") as partial:
                save_reduced(partial, model)
        _write_results(outcome, folder)
    with reporter.stage("paraview and figures"):
        write_pictures(outcome.case.output, folder, figures_of, write_specimens)
    summary = _summary(outcome, reporter)
    folder.write_summary(summary)
    _say(summary, reporter)


# --- results ------------------------------------------------------------------------------------


def _write_results(outcome: SpecimensOutcome, folder: OutputFolder) -> None:
    case, face = outcome.case, outcome.model.face
    with replacing(folder.results) as partial, h5py.File(partial, "w") as file:
        writer = ResultsWriter(file)
        file.attrs.update({"title": case.title, "friction": case.friction.coefficient})
        file.create_group("case").attrs.update({"text": dump_case(case)} | versions())
        writer.put_grid(PAD, outcome.half_space.grid, face.frame)
        writer.put("specimens/pad", coordinates=face.coordinates, facets=face.facets)
        reduction = outcome.model.reduction
        for number, (full, reduced) in enumerate(
            zip(reduction.full, reduction.reduced, strict=True), 1
        ):
            writer.put(f"specimens/body_{number}", full=full, reduced=reduced)
        for place, load in enumerate(outcome.loads):
            group = f"loads/{place}"
            _write_load(writer, group, load, outcome.pair.areas)
            file[group].attrs["normal_force"] = load.force
            file[group].attrs["unit"] = "N"


def _write_load(writer: ResultsWriter, group: str, load: LoadOutcome, areas: Array) -> None:
    writer.put(f"{group}/kinetics", **_kinetics(load.blocks, areas))
    for number, kept in enumerate(load.kept):
        name = f"{group}/states/{number:05d}"
        _write_state(writer, name, kept, areas)
        writer.file[name].attrs["cycles"] = kept.block.cycles
        writer.file[name].attrs["energy"] = kept.block.energy
    for shape, beside in zip(SHAPES, load.half_space, strict=True):
        _write_half_space(writer, f"{group}/half_space/{shape}", beside)
    marched = load.marched
    writer.put(
        f"{group}/coupled_cycle",
        ring_displacement=marched.displacement,
        ring_force=marched.force,
    )


def _kinetics(blocks: tuple[BlockState, ...], areas: Array) -> dict[str, Array]:
    """Numbers at the start of every cycle block, ``(blocks + 1,)`` each."""
    contacts = [state.contact for state in blocks]
    pressures = [contact.normal.pressure for contact in contacts]
    columns: dict[str, Any] = {
        "cycles": [state.cycles for state in blocks],
        "energy": [state.energy for state in blocks],
        "energy_per_cycle": [contact.energy for contact in contacts],
        "stick_stiffness": [contact.stick_stiffness for contact in contacts],
        "area": [contact.normal.area for contact in contacts],
        "approach": [contact.normal.approach for contact in contacts],
        "peak_pressure": [pressure.max() for pressure in pressures],
        "pressure_deviation": [pressure_deviation(areas, pressure) for pressure in pressures],
        "friction": [contact.friction for contact in contacts],
        # Infinite where nothing slides.
        "stable_cycles": [state.stable_cycles for state in blocks],
    }
    for body in (0, 1):
        columns[f"depth_{body + 1}"] = [s.depths[body].max() for s in blocks]
        columns[f"volume_{body + 1}"] = [s.depths[body] @ areas for s in blocks]
    return {name: np.array(values, dtype=np.float64) for name, values in columns.items()}


def _write_state(writer: ResultsWriter, group: str, kept: KeptState, areas: Array) -> None:
    block, curve = kept.block, kept.curve
    contact, loop = block.contact, masing_loop(curve)
    writer.put(
        group,
        pressure=contact.normal.pressure,
        gap=contact.normal.gap,
        shear_x=contact.tangential.shear / areas,
        cycle_slip=contact.cycle_slip,
        worn_1=block.depths[0],
        worn_2=block.depths[1],
        secant_stiffness=curve.secant_stiffness(SLOPE_SHARE),
    )
    writer.put(f"{group}/loop", ring_displacement=loop.displacement, ring_force=loop.force)


def _write_half_space(writer: ResultsWriter, group: str, beside: HalfSpaceState) -> None:
    writer.put(
        group,
        pressure=beside.pressure,
        shear_x=beside.shear,
        cycle_slip=4.0 * beside.slip,
    )
    writer.put(
        f"{group}/first_loading",
        ring_displacement=beside.displacement,
        ring_force=beside.force,
    )


# --- summary ------------------------------------------------------------------------------------


def _summary(outcome: SpecimensOutcome, reporter: Reporter) -> dict[str, Any]:
    case, model = outcome.case, outcome.model
    loads = [load_summary(outcome, load) for load in outcome.loads]
    for load in loads:
        if late(load):
            reporter.warn(
                f"{load['normal_force']:g} N: steady only near the end of the run; raise "
                "wear.energy or wear.cycles to be sure"
            )
    coefficients = case.wear.body_1.coefficient, case.wear.body_2.coefficient
    return {
        "title": case.title,
        "assumed": list(case.assumed),
        "structure": {"nodes": model.node_count(), "pad_nodes": len(model.face)},
        "frequencies": frequencies(outcome),
        "tied_pad": tied_pad(outcome.bulk),
        "explanation": explanation(outcome),
        "loads": loads,
        "collapse": collapse(loads),
        "reported": [reported_summary(own, loads, coefficients) for own in case.wear.reported],
        "warnings": reporter.warnings,
        "seconds": {name: round(value, 2) for name, value in reporter.seconds.items()},
        "versions": versions(),
    }


def _say(summary: dict[str, Any], reporter: Reporter) -> None:
    """The end of the run in a few lines."""
    own = summary["frequencies"]["body_1"]
    for name in ("full", "reduced"):
        values = ", ".join(f"{value:.0f}" for value in own[name])
        reporter.say(f"  free frequencies, {name}: {values} Hz")
    for load in summary["loads"]:
        first, last, steady = load["unworn"], load["worn"], load["steady"]["stiffness"]
        stuck, slope = (
            f"{1e-3 * first[name]:.4g} to {1e-3 * last[name]:.4g}"
            for name in ("stick_stiffness", "secant_stiffness")
        )
        reporter.say(
            f"  {load['normal_force']:g} N: stiffness {stuck} N/um, slope of the loop {slope} N/um"
        )
        reporter.say(
            f"    area {first['area']:.3g} to {last['area']:.3g} mm^2, stiffness steady after "
            f"{steady['cycles']:.4g} cycles, {1e-3 * steady['energy']:.4g} J"
        )
    tied = summary["tied_pad"]["tangential"]
    reporter.say(
        f"  tied pad along x: {1e-3 * tied['specimens']:.4g} N/um, half-space "
        f"{1e-3 * tied['half_space']:.4g}: a difference of "
        f"{1e6 * tied['bulk_compliance']:.3g} nm/N"
    )
    for reported in summary["reported"]:
        if reported["coefficients"] is None:
            continue
        values = " and ".join(f"{1e12 * value:.4g}" for value in reported["coefficients"])
        reporter.say(
            f"  {reported['normal_force']:g} N, {reported['steady']} steady after "
            f"{reported['cycles_reported']:.4g} cycles: with {values} um^3/J"
        )
    reporter.say(f"  seconds: {', '.join(f'{k} {v:.1f}' for k, v in summary['seconds'].items())}")
