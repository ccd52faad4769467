"""What a finished wear run leaves: results, summary, ParaView files, figures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from sa_solver.normal import NormalContactError
from sa_solver.types import LoadHistory
from wear.coupled import KINETICS, CoupledState
from wear.interface import CycleTractions, FaceLoads, FirstContact
from wear.kinetics import LinearRegime, linear_regime
from wear.steppers import root_mean_square
from workflow.analyses.contact.datasets import pressure_field, traction_fields
from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.comparison import comparison_summary, write_comparison
from workflow.analyses.wear.contact_loops import (
    loops_sentence,
    warn_of_border,
    write_loop_tables,
    write_loops,
)
from workflow.analyses.wear.contact_stage import ContactStage
from workflow.analyses.wear.contact_stress import InterfaceStress, contact_stresses
from workflow.analyses.wear.datasets import (
    cycles_column,
    kinetics_columns,
    put_face,
    surface_heights,
)
from workflow.analyses.wear.layout import EXTRAPOLATION, Contents
from workflow.analyses.wear.load_source import LoadSource
from workflow.analyses.wear.structure_stage import StructureStage
from workflow.analyses.wear.uniformity import uniformities
from workflow.analyses.wear.worn_faces import worn_faces, write_worn_faces
from workflow.analyses.wear.worn_structure import WornStructure, resultants_at, worn_structure
from workflow.shell.analysis import Run
from workflow.shell.dataset import Dataset
from workflow.shell.folder import OutputFolder
from workflow.shell.reporter import Reporter
from workflow.shell.results import ResultsWriter, run_results
from workflow.shell.store import read_arrays
from workflow.shell.summary import finish

# What the file of a jump has of each interface.
JUMP_FIELDS = {"surfaces": ("body_1", "body_2"), "contact": ("pressure", "shear", "slip")}


@dataclass(frozen=True)
class Outcome:
    """Everything a wear run found.

    ``unworn`` are the loads of the faces before wear and ``first`` the contact of that cycle, by
    interface; ``worn`` the tractions of a cycle at the end, none where no stress is asked for.
    """

    case: WearCase
    source: LoadSource
    stages: list[ContactStage]
    state: CoupledState
    unworn: Sequence[FaceLoads]
    first: list[FirstContact]
    worn: list[CycleTractions]

    @cached_property
    def regimes(self) -> dict[str, dict[str, LinearRegime | None]]:
        """Linear regimes of depth and volume, both bodies together, by interface."""
        columns = {"depth": slice(0, 2), "volume": slice(2, 4)}
        cycles, kinetics = self.state.cycles, self.state.kinetics
        return {
            stage.name: {
                name: linear_regime(cycles, kinetics[:, number, pick].sum(axis=1))
                for name, pick in columns.items()
            }
            for number, stage in enumerate(self.stages)
        }


@dataclass(frozen=True)
class PeakHistory:
    """The contact at peak load after every jump, unworn first.

    ``area`` in contact [mm²] and largest ``pressure`` [MPa].
    """

    area: list[float]
    pressure: list[float]

    def summary(self) -> dict[str, Any]:
        """The first pressure, the last pressure and the last area."""
        pressures = {"unworn": self.pressure[0], "worn": self.pressure[-1]}
        return {"peak_pressure": pressures, "area": self.area[-1]}


def write_output(outcome: Outcome, run: Run[WearCase]) -> None:
    """Write all files of a finished run; the summary comes last and marks it as finished."""
    folder, reporter, structure = run.folder, run.reporter, None
    if isinstance(outcome.source, StructureStage):
        structure = worn_structure(
            outcome.source,
            outcome.stages,
            outcome.state,
            outcome.case.friction,
            folder,
            reporter,
        )
    with reporter.stage("stress under the contacts"):
        stresses = contact_stresses(
            outcome.case,
            outcome.source.peak,
            outcome.stages,
            list(zip(outcome.unworn, outcome.first, strict=True)),
            outcome.worn,
            reporter,
        )
    with reporter.stage("results"):
        recorded, contents = _write_results(outcome, structure, stresses, run)
    run.draw(contents)
    worn_nodes = _write_worn_nodes(outcome, folder, reporter)
    loops = write_loop_tables(folder, outcome.source.line)
    warn_of_border(loops, outcome.case.loops, reporter)
    _warn_of_steps(outcome, reporter)
    summary = _summary(outcome, structure, stresses, recorded)
    for name, written in worn_nodes.items():
        summary[name]["worn_nodes"] = written
    for name, found in loops.items():
        summary[name]["loops"] = found
    uniform = uniformities(outcome.source, outcome.stages, outcome.state.interfaces)
    for name, own in uniform.items():
        summary[name]["uniformity"] = vars(own)
    lines = [
        *_lines(outcome, summary),
        *(f"  {own.sentence(name)}" for name, own in uniform.items()),
        *(f"  {loops_sentence(name, own, outcome.source.line)}" for name, own in loops.items()),
    ]
    finish(run, summary, lines)
    folder.discard(folder.jumps.name)


def _write_worn_nodes(
    outcome: Outcome, folder: OutputFolder, reporter: Reporter
) -> dict[str, dict[str, Any]]:
    """Worn surfaces at the user's own nodes, where the loads or the mesh are the user's."""
    pairs = zip(outcome.stages, outcome.state.interfaces, strict=True)
    faces = [
        face
        for number, (stage, state) in enumerate(pairs)
        for face in worn_faces(outcome.source.user_faces(number), stage, state)
    ]
    return write_worn_faces(faces, folder, reporter)


def _write_results(
    outcome: Outcome,
    structure: WornStructure | None,
    stresses: list[InterfaceStress],
    run: Run[WearCase],
) -> tuple[dict[str, PeakHistory], Contents]:
    """Write ``results.h5``; what the jumps recorded, by interface, and what is there."""
    case, source = outcome.case, outcome.source
    attributes = {
        "friction": case.friction.at(0.0),
        "peak_increment": source.peak,
        "bodies": list(case.bodies),
    }
    coarse: list[str] = []
    with run_results(run, case, attributes, source.line) as writer:
        for stage, result, loads in zip(outcome.stages, outcome.first, outcome.unworn, strict=True):
            writer.put_grid(f"grid/{stage.name}", stage.grid, stage.face.frame)
            put_face(writer, f"structure/{stage.name}", stage.face, loads)
            if _write_coarse(writer, stage, loads.loads, source.peak):
                coarse.append(stage.name)
            dissipated = "energy dissipated in each increment, half-space pressure"
            energy = {"energy_half_space": Dataset(result.energy, "N mm", dissipated)}
            writer.put(f"contact/{stage.name}", energy)
            if result.cycle:
                write_comparison(writer, stage.name, result.cycle, loads.loads, source.peak)
        recorded = _write_jumps(writer, outcome, run.folder)
        _write_kinetics(writer, outcome, recorded)
        write_loops(writer, run.folder, outcome.state.jump)
        if structure is not None:
            structure.write(writer)
        for stress in stresses:
            stress.write(writer)
    contents = Contents(
        names=tuple(sorted(stage.name for stage in outcome.stages)),
        bodies=case.bodies,
        jumps=outcome.state.jump,
        line=source.line,
        mix=outcome.unworn[0].loads.mixed,
        structure=structure is not None,
        coarse=tuple(coarse),
        comparison=case.contact.method == "full",
        loops=case.loops.wanted,
        sections=case.stress.section != "none",
        life=tuple(sorted(stress.name for stress in stresses if stress.mapped)),
    )
    return recorded, contents


def _write_coarse(
    writer: ResultsWriter, stage: ContactStage, loads: LoadHistory, peak: int
) -> bool:
    """The peak load on a grid as coarse as the mesh, to compare with; whether there is one.

    None where the moments put that load outside the middles of the coarse cells: no reason to lose
    the run.
    """
    try:
        pressure = stage.coarse_pressure(loads, peak)
    except NormalContactError:
        return False
    grid = stage.coarse_grid
    shape = {"shape": grid.shape, "pitch": grid.pitch, "line": grid.line}
    writer.put(f"contact/{stage.name}/coarse", {"pressure": pressure_field(pressure)}, **shape)
    return True


def _write_jumps(
    writer: ResultsWriter, outcome: Outcome, folder: OutputFolder
) -> dict[str, PeakHistory]:
    """Copy surfaces and contacts of all jumps; what they come to, by interface."""
    recorded = {stage.name: PeakHistory([], []) for stage in outcome.stages}
    for jump in range(outcome.state.jump + 1):
        arrays, attributes = read_arrays(folder.jump(jump))
        for stage in outcome.stages:
            surfaces, contact = (
                {name: arrays[f"{kind}/{stage.name}/{name}"] for name in names}
                for kind, names in JUMP_FIELDS.items()
            )
            place, cycles = f"{stage.name}/{jump:05d}", attributes["cycles"]
            writer.put(f"surfaces/{place}", surface_heights(**surfaces), cycles=cycles)
            writer.put(f"contact/{place}", traction_fields(**contact), cycles=cycles)
            pressure = contact["pressure"]
            area = np.count_nonzero(pressure > 0.0) * stage.grid.cell_area
            recorded[stage.name].area.append(area)
            recorded[stage.name].pressure.append(float(pressure.max()))
    return recorded


def _write_kinetics(
    writer: ResultsWriter, outcome: Outcome, recorded: dict[str, PeakHistory]
) -> None:
    state = outcome.state
    writer.put("kinetics", {"cycles": cycles_column(state.cycles)})
    for number, stage in enumerate(outcome.stages):
        columns = kinetics_columns(state.kinetics[:, number], np.array(recorded[stage.name].area))
        regimes = {
            f"{name}_{attribute}": value
            for name, regime in outcome.regimes[stage.name].items()
            for attribute, value in _regime_attributes(regime).items()
        }
        writer.put(f"kinetics/{stage.name}", columns, **regimes)


def _regime_attributes(regime: LinearRegime | None) -> dict[str, float]:
    """A linear regime as attributes, not numbers where there is none."""
    if regime is None:
        return dict.fromkeys(("linear_from", "rate", "trend", "scatter"), np.nan)
    return {
        "linear_from": regime.start,
        "rate": regime.rate,
        "trend": regime.trend,
        "scatter": regime.scatter,
    }


def _summary(
    outcome: Outcome,
    structure: WornStructure | None,
    stresses: list[InterfaceStress],
    recorded: dict[str, PeakHistory],
) -> dict[str, Any]:
    state = outcome.state
    stress = {own.name: {"stress": own.summary()} for own in stresses}
    return {
        "per_length": outcome.source.line,
        "cycles": float(state.cycles[-1]),
        "jumps": state.jump,
        "work": vars(state.spent),
        **({"structure": structure.summary(state)} if structure else {}),
        **{
            stage.name: _interface_summary(outcome, number)
            | (structure.interface_summary(number) if structure else {})
            | recorded[stage.name].summary()
            | stress.get(stage.name, {})
            | {"worn_area": _worn_area(outcome, number)}
            for number, stage in enumerate(outcome.stages)
        },
        "kinetics": {
            "cycles": state.cycles.tolist(),
            **{
                stage.name: dict(zip(KINETICS, state.kinetics[:, number].T.tolist(), strict=True))
                | {"area": recorded[stage.name].area}
                for number, stage in enumerate(outcome.stages)
            },
        },
    }


def _worn_area(outcome: Outcome, number: int) -> float:
    """Area that has worn by the end [mm²]."""
    worn = np.count_nonzero(outcome.state.interfaces[number].surfaces.depth > 0.0)
    return worn * outcome.stages[number].grid.cell_area


def _interface_summary(outcome: Outcome, number: int) -> dict[str, Any]:
    stage, first = outcome.stages[number], outcome.first[number]
    unworn = outcome.unworn[number]
    loads = unworn.loads
    last = dict(zip(KINETICS, outcome.state.kinetics[-1, number].tolist(), strict=True))
    return {
        **last,
        "peak_load": {"unworn": resultants_at(loads, outcome.source.peak)},
        "slip_per_cycle": _slip_per_cycle(unworn, first),
        "energy_per_cycle": {
            "half_space": float(first.energy.sum()),
            "structure": loads.mean_energy,
        },
        **({"by_increment": comparison_summary(first.cycle, loads)} if first.cycle else {}),
        "step_error": _step_error(outcome, number),
        "explicit_limit": first.stable_cycles if np.isfinite(first.stable_cycles) else None,
        "contact_residual": first.largest_residual,
        "convolutions": first.spent.convolutions,
        "linear_regime": {
            name: None if regime is None else _regime_summary(regime)
            for name, regime in outcome.regimes[stage.name].items()
        },
    }


def _regime_summary(regime: LinearRegime) -> dict[str, Any]:
    """A linear regime, and where it leads with its uncertainty."""
    cycles = np.array(EXTRAPOLATION * regime.last_cycles)
    return vars(regime) | {
        "extrapolated": {
            "cycles": float(cycles),
            "value": float(regime.extrapolate(cycles)),
            "uncertainty": float(regime.uncertainty(cycles)),
        }
    }


def _step_error(outcome: Outcome, number: int) -> dict[str, float] | None:
    """Estimated errors by wear steps of depth (root mean square) and volume, relative.

    None where they are unknown or nothing is worn.
    """
    own = outcome.state.interfaces[number]
    depth = own.surfaces.depth
    if outcome.case.wear.step.kind == "explicit" or not depth.any():
        return None
    volume = float(depth.sum()) * outcome.stages[number].grid.cell_area
    return {
        "depth": root_mean_square(own.error, depth) / root_mean_square(depth, depth),
        "volume": abs(own.volume_error) / volume,
    }


def _warn_of_steps(outcome: Outcome, reporter: Reporter) -> None:
    """Automatic steps that did not meet their tolerance."""
    wear = outcome.case.wear
    if not wear.step.automatic:
        return
    for number, stage in enumerate(outcome.stages):
        found = _step_error(outcome, number)
        if found is None:
            continue
        asked = wear.tolerance
        if wear.depth_tolerance is not None:
            depth = outcome.state.interfaces[number].surfaces.depth
            asked = wear.depth_tolerance / root_mean_square(depth, depth)
        if max(found.values()) > asked:
            reporter.warn(
                f"{stage.name}: wear steps leave an estimated error of {max(found.values()):.2%} "
                f"where {asked:.2%} was asked for (wear.tolerance): try wear.step.kind: "
                "second_order, or a smaller tolerance"
            )


def _slip_per_cycle(unworn: FaceLoads, first: FirstContact) -> float:
    """Largest path of slip [mm] per unworn, mean cycle: of the half-space where loads have none."""
    slip = unworn.slip
    if first.cycle and not slip.any():
        slip = np.stack([state.slip for state in first.cycle])
    return float(np.tensordot(unworn.loads.share, np.hypot(slip[:, 0], slip[:, 1]), 1).max())


def _lines(outcome: Outcome, summary: dict[str, Any]) -> Iterator[str]:
    """The end of the run in a few lines."""
    yield f"{summary['cycles']:.6g} cycles in {summary['jumps']} jumps"
    name_1, name_2 = outcome.case.bodies
    unit = "mm^3/mm" if outcome.source.line else "mm^3"
    for stage in outcome.stages:
        own = summary[stage.name]
        peaks = own["peak_pressure"]
        yield (
            f"  {stage.name}: worn {own['depth_1'] * 1e3:.3g} um ({name_1}), "
            f"{own['depth_2'] * 1e3:.3g} um ({name_2}); {own['volume_1']:.3g}, "
            f"{own['volume_2']:.3g} {unit}; peak pressure {peaks['unworn']:.0f} -> "
            f"{peaks['worn']:.0f} MPa"
        )
