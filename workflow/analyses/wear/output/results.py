"""Output of a finished wear run: results, summary, ParaView files, figures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from sa_solver.normal.contact import NormalContactError
from sa_solver.types import Array, Progress
from wear.contact.contacts import KINETICS
from wear.kinetics import LinearRegime
from workflow.analyses.wear.budget.finding import ProbeResults, error_budget
from workflow.analyses.wear.budget.report import (
    Budget,
    arrays_of,
    sentences,
    summary_of,
)
from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.checks.comparison import comparison_summary, write_comparison
from workflow.analyses.wear.checks.run_errors import warn_of_errors
from workflow.analyses.wear.checks.uniformity import uniformities
from workflow.analyses.wear.output.contact_stress import (
    report_stress,
    stress_summary,
    write_stress,
)
from workflow.analyses.wear.output.datasets import kinetics_columns, put_face
from workflow.analyses.wear.output.layout import (
    EXTRAPOLATION,
    LAYOUT,
    WearContents,
    energy_name,
)
from workflow.analyses.wear.output.link_report import link_summary
from workflow.analyses.wear.output.outcome import Outcome
from workflow.analyses.wear.worn.contact_loops import (
    Measurements,
    loops_sentence,
    warn_of_border,
    write_loop_tables,
    write_loops,
)
from workflow.analyses.wear.worn.worn_faces import write_worn_faces
from workflow.analyses.wear.worn.worn_structure import (
    WornStructure,
    load_ranges,
    resultants_at,
    worn_structure,
)
from workflow.case.text.plain import shares
from workflow.layout.declared import Arrays
from workflow.models.budget.outcome import STOPPED, InterfaceOutcome
from workflow.models.stress.contact_stress import InterfaceStress, contact_stresses, cycles_of
from workflow.models.structure import StructureLoads
from workflow.shell.analysis import Run
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.folders.store import read_arrays
from workflow.shell.output.results import ResultsWriter, run_results
from workflow.shell.output.summary import finish
from workflow.shell.terminal.reporter import Reporter

# Attributes of the kinetics for each linear regime; nan if there is none.
REGIME_ATTRIBUTES = {"linear_from": "start", "rate": "rate", "trend": "trend", "scatter": "scatter"}

# Depths up to this [mm] are rounding of contacts that stick.
NOTHING = 1e-10


@dataclass(frozen=True)
class PeakHistory:
    """The contact at peak load after every jump, unworn first.

    ``area`` is the contact area [mm²], ``width`` its extent along x [mm] and ``pressure`` the
    largest pressure [MPa].
    """

    area: list[float]
    width: list[float]
    pressure: list[float]

    def summary(self) -> dict[str, Any]:
        """Return the first and last pressure and width, and the last area."""
        pressures = {"unworn": self.pressure[0], "worn": self.pressure[-1]}
        widths = {"unworn": self.width[0], "worn": self.width[-1]}
        return {"peak_pressure": pressures, "contact_width": widths, "area": self.area[-1]}


def write_output(outcome: Outcome, probe_results: ProbeResults, run: Run[WearCase]) -> None:
    """Write all files of a finished run; the summary comes last and marks it as finished.

    ``probe_results`` returns the results of the probe runs, which have started already.
    """
    case, source, state = outcome.case, outcome.source, outcome.state
    folder, reporter = run.folder, run.reporter
    faces = [(contact.stage, contact.state) for contact in outcome.interfaces]
    structure = None
    if isinstance(source, StructureLoads):
        moves = case.output.paraview
        structure = worn_structure(source, faces, case.friction_evolves, moves, folder, reporter)
        structure.warn(case.accuracy, reporter)
    with reporter.stage("stress under the contacts", "steps") as reported:
        stresses = _stresses(outcome, structure, reporter, reported)
    budget = error_budget(outcome, reporter, probe_results)
    with reporter.stage("results"):
        recorded, contents, measured = _write_results(outcome, structure, stresses, budget, run)
    run.draw(contents)
    worn_nodes = write_worn_faces(source, faces, folder, reporter)
    loops = write_loop_tables(folder, measured, source.line)
    warn_of_border(loops, case.loops, reporter)
    drift = float(state.drift.max(initial=0.0))
    warn_of_errors(case, outcome.interfaces, budget, drift, reporter)
    summary = _summary(outcome, structure, stresses, budget, recorded)
    uniform = uniformities(source, faces)
    uniformity = {name: vars(alike) for name, alike in uniform.items()}
    further = {"worn_nodes": worn_nodes, "loops": loops, "uniformity": uniformity}
    for key, by_interface in further.items():
        for name, numbers in by_interface.items():
            summary[name][key] = numbers
    lines = [
        *_lines(outcome, summary, budget),
        *(f"  {sentence}" for sentence in (structure.sentences() if structure else ())),
        *(f"  {alike.sentence(name)}" for name, alike in uniform.items()),
        *(f"  {loops_sentence(name, loop, source.line)}" for name, loop in loops.items()),
    ]
    finish(run, summary, lines)


def _stresses(
    outcome: Outcome, structure: WornStructure | None, reporter: Reporter, progress: Progress
) -> list[InterfaceStress]:
    """Return the stress under every contact; empty if the case does not request it."""
    settings, peak = outcome.case.stress.described(), outcome.source.peak
    if not settings.under_contacts:
        return []
    stressed = None if structure is None else structure.stressed
    cycles = [
        cycles_of(contact.stage, number, (contact.begin, contact.end), contact.unworn, stressed)
        for number, contact in enumerate(outcome.interfaces)
    ]
    stresses = contact_stresses(settings, peak, cycles, progress)
    report_stress(stresses, peak, structure is not None, reporter)
    return stresses


def _write_results(
    outcome: Outcome,
    structure: WornStructure | None,
    stresses: list[InterfaceStress],
    budget: Budget,
    run: Run[WearCase],
) -> tuple[dict[str, PeakHistory], WearContents, Measurements]:
    """Write ``results.h5``; return peak histories by interface, its contents, and loops."""
    case, source = outcome.case, outcome.source
    attributes = {
        "friction": case.friction.at(0.0),
        "peak_increment": source.peak,
        "bodies": list(case.bodies),
    }
    coarse: list[str] = []
    nodes = case.contact.method == "nodes"
    with run_results(run, case, LAYOUT, attributes, source.line) as writer:
        for contact in outcome.interfaces:
            stage, first, loads = contact.stage, contact.first, contact.unworn.loads
            writer.put_grid(f"grid/{stage.name}", stage.grid, stage.face.frame)
            drive = stage.settings.drive
            place, known = f"structure/{stage.name}", source.slip_known
            put_face(writer, place, stage.face, contact.unworn, drive, known)
            writer.put(place, {}, friction=stage.settings.friction(0.0))
            if not nodes and _write_coarse(writer, contact, source.peak):
                coarse.append(stage.name)
            energy = {energy_name(nodes): first.energy}
            writer.put(f"contact/{stage.name}", energy | _holding_moments(contact))
            if first.cycle:
                write_comparison(writer, stage.name, first.cycle, loads, source.peak)
        recorded, kept = _write_jumps(writer, outcome, run.folder)
        _write_kinetics(writer, outcome, recorded)
        loops = write_loops(writer, kept)
        if structure is not None:
            structure.write(writer, case.accuracy)
            structure.bolts.write(writer, kept)
        for stress in stresses:
            write_stress(writer, stress, case)
        for name, errors in budget.items():
            writer.put(f"error/{name}", arrays_of(errors), accuracy=case.accuracy)
        contents = WearContents(
            names=tuple(sorted(contact.stage.name for contact in outcome.interfaces)),
            bodies=case.bodies,
            jumps=outcome.state.jump,
            line=source.line,
            mix=outcome.interfaces[0].unworn.loads.mixed,
            dissipation=source.slip_known,
            structure=structure is not None,
            notches=() if structure is None else structure.notches,
            mission=structure is not None and bool(structure.shown),
            nodes=nodes,
            bolts=() if structure is None else structure.bolts.names,
            coarse=tuple(coarse),
            comparison=case.contact.method == "full",
            loops=case.loops.wanted,
            sections=case.stress.section != "none",
            life=tuple(sorted(stress.name for stress in stresses if stress.mapped)),
            cracking=tuple(sorted(stress.name for stress in stresses if stress.cracking)),
            strained=case.every_terms[0].strained,
            worn=any(found.kinetics[-1, :2].max() > NOTHING for found in outcome.interfaces),
        )
        writer.put_contents(contents)
    return recorded, contents, loops


def _holding_moments(contact: InterfaceOutcome) -> dict[str, Array]:
    """Return the moments ``(t,)`` that hold the tilt, if it is held."""
    if contact.stage.settings.drive.tilt == "free":
        return {}
    return {
        f"{name}_{when}": getattr(loads, name)
        for when, loads in contact.carried.items()
        for name in (("My",) if contact.stage.grid.line else ("Mx", "My"))
    }


def _write_coarse(writer: ResultsWriter, contact: InterfaceOutcome, peak: int) -> bool:
    """Write the peak load on a grid as coarse as the mesh; return whether it exists.

    It does not exist if the moments put the load outside the centres of the coarse cells, which is
    no reason to end the run.
    """
    stage = contact.stage
    try:
        pressure = stage.coarse_pressure(contact.unworn.loads, contact.first.link, peak)
    except NormalContactError:
        return False
    grid = stage.coarse_grid
    place = f"contact/{stage.name}/coarse"
    writer.put_grid(place, grid)
    writer.put(place, {"pressure": pressure})
    return True


def _write_jumps(
    writer: ResultsWriter, outcome: Outcome, folder: OutputFolder
) -> tuple[dict[str, PeakHistory], list[Arrays]]:
    """Copy surfaces and contacts of all jumps.

    Returns the peak histories by interface, and of each jump the cycles and what else is kept.
    """
    recorded = {contact.stage.name: PeakHistory([], [], []) for contact in outcome.interfaces}
    grids = [contact.stage.grid for contact in outcome.interfaces]
    kept: list[Arrays] = []
    for jump in range(outcome.state.jump + 1):
        arrays, attributes = read_arrays(folder.jump(jump))
        for (name, peaks), grid in zip(recorded.items(), grids, strict=True):
            pressure = arrays[f"contact/{name}/pressure"]
            for group in (f"surfaces/{name}/", f"contact/{name}/"):
                places = [place for place in arrays if place.startswith(group)]
                fields = {place.removeprefix(group): arrays.pop(place) for place in places}
                writer.put(f"{group}{jump:05d}", fields, cycles=attributes["cycles"])
            peaks.area.append(np.count_nonzero(pressure > 0.0) * grid.cell_area)
            peaks.width.append(_extent(pressure) * grid.pitch[0])
            peaks.pressure.append(float(pressure.max()))
        kept.append({**arrays, **attributes})
    return recorded, kept


def _extent(pressure: Array) -> int:
    """Return the number of cells along x from the first to the last pressed one."""
    pressed = np.flatnonzero((pressure > 0.0).any(axis=1))
    return int(np.ptp(pressed)) + 1 if pressed.size else 0


def _write_kinetics(
    writer: ResultsWriter, outcome: Outcome, recorded: dict[str, PeakHistory]
) -> None:
    writer.put("kinetics", {"cycles": outcome.state.cycles})
    for contact in outcome.interfaces:
        name = contact.stage.name
        columns = kinetics_columns(contact.kinetics, np.array(recorded[name].area))
        regimes = {
            f"{quantity}_{attribute}": np.nan if regime is None else getattr(regime, field)
            for quantity, regime in contact.regimes.items()
            for attribute, field in REGIME_ATTRIBUTES.items()
        }
        writer.put(f"kinetics/{name}", columns, **regimes)


def _summary(
    outcome: Outcome,
    structure: WornStructure | None,
    stresses: list[InterfaceStress],
    budget: Budget,
    recorded: dict[str, PeakHistory],
) -> dict[str, Any]:
    state, contacts = outcome.state, outcome.interfaces
    stress = {of.name: {"stress": stress_summary(of, outcome.case)} for of in stresses}
    return {
        "per_length": outcome.source.line,
        "cycles": float(state.cycles[-1]),
        "jumps": state.jump,
        "work": vars(state.cost),
        **outcome.case.surfaces_summary(),
        **({"structure": structure.summary(state)} if structure else {}),
        **{
            name: _interface_summary(outcome, contact)
            | (structure.interface_summary(number, recorded[name].width[0]) if structure else {})
            | recorded[name].summary()
            | stress.get(name, {})
            | {"worn_area": contact.worn_area, "error": summary_of(budget[name])}
            for number, (name, contact) in enumerate(zip(recorded, contacts, strict=True))
        },
        "kinetics": {
            "cycles": state.cycles.tolist(),
            **{
                name: dict(zip(KINETICS, contact.kinetics.T.tolist(), strict=True))
                | {"area": recorded[name].area}
                for name, contact in zip(recorded, contacts, strict=True)
            },
        },
    }


def _interface_summary(outcome: Outcome, contact: InterfaceOutcome) -> dict[str, Any]:
    first, loads = contact.first, contact.carried["unworn"]
    wearing = "nodes" if outcome.case.contact.method == "nodes" else "half_space"
    known = outcome.source.slip_known
    return {
        **dict(zip(KINETICS, contact.kinetics[-1].tolist(), strict=True)),
        "peak_load": {
            when: resultants_at(carried, outcome.source.peak)
            for when, carried in contact.carried.items()
        },
        "load_range": {when: load_ranges(loads) for when, loads in contact.carried.items()},
        **_tilt_summary(contact),
        "slip_per_cycle": contact.slip_per_cycle,
        "energy_per_cycle": {
            wearing: float(first.energy.sum()),
            **({"structure": loads.mean_energy} if known else {}),
        },
        **({"by_increment": comparison_summary(first.cycle, loads, known)} if first.cycle else {}),
        "step_error": contact.step_error,
        "increments_error": contact.increments_error,
        "stopped": contact.stopped,
        "explicit_limit": first.stable_cycles if np.isfinite(first.stable_cycles) else None,
        "contact_residual": first.largest_residual,
        "link": link_summary(first.link),
        "convolutions": first.cost.convolutions,
        "linear_regime": {
            name: None if regime is None else _regime_summary(regime)
            for name, regime in contact.regimes.items()
        },
    }


def _tilt_summary(contact: InterfaceOutcome) -> dict[str, Any]:
    """Return whether the tilt is held, and the largest moments that hold it [N mm]."""
    tilt = contact.stage.settings.drive.tilt
    if tilt == "free":
        return {"tilt": tilt}
    cycles = contact.carried.items()
    largest = {when: float(np.hypot(loads.Mx, loads.My).max()) for when, loads in cycles}
    return {"tilt": tilt, "holding_moment": largest}


def _regime_summary(regime: LinearRegime) -> dict[str, Any]:
    """Return a linear regime with its extrapolation and uncertainty."""
    cycles = np.array(EXTRAPOLATION * regime.last_cycles)
    return vars(regime) | {
        "extrapolated": {
            "cycles": float(cycles),
            "value": float(regime.extrapolate(cycles)),
            "uncertainty": float(regime.uncertainty(cycles)),
        }
    }


def _lines(outcome: Outcome, summary: dict[str, Any], budget: Budget) -> Iterator[str]:
    """Yield the results of the run in a few lines."""
    yield f"{summary['cycles']:.6g} cycles in {summary['jumps']} jumps"
    name_1, name_2 = outcome.case.bodies
    unit = "mm^3/mm" if outcome.source.line else "mm^3"
    for contact in outcome.interfaces:
        name = contact.stage.name
        numbers, peaks = summary[name], summary[name]["peak_pressure"]
        yield (
            f"  {name}: worn {numbers['depth_1'] * 1e3:.3g} um, {numbers['volume_1']:.3g} {unit} "
            f"({name_1}); {numbers['depth_2'] * 1e3:.3g} um, {numbers['volume_2']:.3g} {unit} "
            f"({name_2})"
        )
        pressures = f"{peaks['unworn']:.0f} -> {peaks['worn']:.0f} MPa"
        yield f"  {name}: peak pressure {pressures}; tilt {numbers['tilt']}"
        if contact.stopped is not None:
            yield (
                f"  {name}: wear stopped (depth and volume within {shares(STOPPED)}) after "
                f"{contact.stopped:.3g} cycles"
            )
        yield from (f"  {name}: {line}" for line in sentences(budget[name]))
