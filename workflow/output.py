"""What a finished run leaves: results, summary, ParaView files, figures, the worn mesh."""

from __future__ import annotations

import json
import shutil
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import h5py
import numpy as np

from fe_models.mesh import StructureMesh, write_msh
from fe_models.remesh import worn_mesh, worn_volume
from fe_models.stress import StressField
from fe_models.structure import CycleSolution
from sa_solver.types import Array
from wear.kinetics import LinearRegime, linear_regime
from workflow.case import WearCase, dump_case
from workflow.checkpoint import KINETICS, RunState
from workflow.comparison import comparison_summary, write_comparison
from workflow.contact_stage import ContactStage, FirstContact
from workflow.figures import write_figures
from workflow.folder import OutputFolder
from workflow.paraview import write_paraview
from workflow.reporter import Reporter
from workflow.store import BODY_NAMES, ResultsWriter, read_arrays, replacing
from workflow.structure_stage import StructureStage
from workflow.versions import versions
from workflow.workers import side_by_side

RESULTANTS = ("P", "Qx", "Qy", "Mx", "My", "Mz")


@dataclass(frozen=True)
class Outcome:
    """Everything a wear run found.

    ``unworn`` and ``worn`` are the structure's cycles with the first and the last gaps, ``first``
    the contact of the unworn cycle and ``depths`` the nodal depths (body 1, body 2) at the end, by
    interface.
    """

    case: WearCase
    structure: StructureStage
    stages: list[ContactStage]
    state: RunState
    unworn: CycleSolution
    worn: CycleSolution
    first: list[FirstContact]
    depths: list[tuple[Array, Array]]

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


Stress = tuple[StressField, StressField]


def write_output(outcome: Outcome, folder: OutputFolder, reporter: Reporter) -> None:
    """Write all files of a finished run; the summary comes last and marks it as finished."""
    structure = outcome.structure
    with reporter.stage("re-meshing"):
        mesh = worn_mesh(structure.mesh, outcome.depths)
        with replacing(folder.root / "worn.msh") as partial:
            # gmsh goes by the ending; the name stays one that a resumed run clears away.
            path = partial.with_name(f"{partial.name}.msh")
            write_msh(path, mesh)
            path.replace(partial)
    with reporter.stage("stress"):
        stresses = {
            "unworn": structure.stress(outcome.unworn),
            "worn": structure.worn_stress(mesh, outcome.worn),
        }
    with reporter.stage("results"):
        _write_results(outcome, mesh, stresses, folder)
    with reporter.stage("paraview and figures"):
        _write_pictures(outcome.case, folder)
    summary = _summary(outcome, mesh, stresses, _peak_pressures(outcome, folder), reporter)
    with replacing(folder.summary) as partial:
        partial.write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    shutil.rmtree(folder.jumps)
    _say(outcome, summary, reporter)


def _write_pictures(case: WearCase, folder: OutputFolder) -> None:
    """ParaView files and figures side by side: either takes several seconds on one core."""
    wanted = {
        write_paraview: (case.output.paraview, folder.paraview),
        write_figures: (case.output.figures, folder.figures),
    }
    side_by_side(
        [(write, (folder.results, target)) for write, (on, target) in wanted.items() if on]
    )


def _write_results(
    outcome: Outcome, mesh: StructureMesh, stresses: dict[str, Stress], folder: OutputFolder
) -> None:
    structure, peak = outcome.structure, outcome.structure.peak
    with replacing(folder.results) as partial, h5py.File(partial, "w") as file:
        writer = ResultsWriter(file)
        file.attrs.update(
            {
                "title": outcome.case.title,
                "friction": outcome.case.friction.coefficient,
                "peak_increment": peak,
            }
        )
        file.create_group("case").attrs.update({"text": dump_case(outcome.case)} | versions())
        for group, solution in (("structure", outcome.unworn), ("structure_worn", outcome.worn)):
            for history in solution.histories:
                writer.put_structure(f"{group}/{history.interface.name}", history)
        for stage, result, history in zip(
            outcome.stages, outcome.first, outcome.unworn.histories, strict=True
        ):
            writer.put_grid(stage.name, stage.grid, stage.interface.frame)
            coarse = f"contact/{stage.name}/coarse"
            writer.put(coarse, pressure=stage.coarse_pressure(history.loads, peak))
            grid = stage.coarse_grid
            file[coarse].attrs.update({"shape": grid.shape, "pitch": grid.pitch})
            writer.put(f"contact/{stage.name}", energy_half_space=result.energy)
            if result.cycle:
                write_comparison(writer, stage.name, result.cycle, peak)
        _write_jumps(writer, outcome, folder)
        _write_kinetics(writer, outcome)
        for moment, shape in (("unworn", structure.mesh), ("worn", mesh)):
            for name, body, field in zip(
                BODY_NAMES.values(), (shape.body_1, shape.body_2), stresses[moment], strict=True
            ):
                writer.put_body(f"bodies/{name}/{moment}", body.mesh.p.T, body.mesh.t.T, field)


def _write_jumps(writer: ResultsWriter, outcome: Outcome, folder: OutputFolder) -> None:
    for jump in range(outcome.state.jump + 1):
        arrays, attributes = read_arrays(folder.jump(jump))
        for stage in outcome.stages:
            for kind in ("surfaces", "contact"):
                prefix = f"{kind}/{stage.name}/"
                fields = {
                    n.removeprefix(prefix): a for n, a in arrays.items() if n.startswith(prefix)
                }
                writer.put(f"{prefix}{jump:05d}", **fields)
                writer.file[f"{prefix}{jump:05d}"].attrs["cycles"] = attributes["cycles"]


def _write_kinetics(writer: ResultsWriter, outcome: Outcome) -> None:
    state = outcome.state
    writer.put("kinetics", cycles=state.cycles)
    for number, stage in enumerate(outcome.stages):
        group = f"kinetics/{stage.name}"
        columns = dict(zip(KINETICS, state.kinetics[:, number].T, strict=True))
        writer.put(group, **columns)
        for name, regime in outcome.regimes[stage.name].items():
            writer.file[group].attrs.update(
                {
                    f"{name}_linear_from": regime.start if regime else np.nan,
                    f"{name}_rate": regime.rate if regime else np.nan,
                }
            )


def _peak_pressures(outcome: Outcome, folder: OutputFolder) -> dict[str, dict[str, float]]:
    """Largest pressure at peak load before the first and after the last jump, by interface."""
    jumps = {"unworn": 0, "worn": outcome.state.jump}
    with h5py.File(folder.results, "r") as file:
        return {
            stage.name: {
                moment: float(file[f"contact/{stage.name}/{jump:05d}/pressure"][()].max())
                for moment, jump in jumps.items()
            }
            for stage in outcome.stages
        }


def _summary(
    outcome: Outcome,
    mesh: StructureMesh,
    stresses: dict[str, Stress],
    pressures: dict[str, dict[str, float]],
    reporter: Reporter,
) -> dict[str, Any]:
    state, structure = outcome.state, outcome.structure
    return {
        "title": outcome.case.title,
        "assumed": list(outcome.case.assumed),
        "cycles": float(state.cycles[-1]),
        "jumps": state.jump,
        "structure": {
            "from_cache": structure.from_cache,
            "nodes": {b.name: int(b.mesh.nvertices) for b in (mesh.body_1, mesh.body_2)},
            "rigid_modes": structure.rigid_modes,
            "solutions": state.solutions,
            "iterations": outcome.unworn.iterations,
            "residual": outcome.unworn.residual,
            "equilibrium_error": float(outcome.unworn.equilibrium.max()),
            "closure": outcome.unworn.closure,
            "drift": [float(value) for value in state.drift],
            "peak_stress": {
                moment: {
                    name: {
                        "von_mises": float(field.von_mises.max()),
                        "maximum_principal": float(field.maximum_principal.max()),
                    }
                    for name, field in zip(BODY_NAMES.values(), stresses[moment], strict=True)
                }
                for moment in stresses
            },
        },
        **{
            stage.name: _interface_summary(outcome, number, mesh)
            | {"peak_pressure": pressures[stage.name]}
            for number, stage in enumerate(outcome.stages)
        },
        "kinetics": {
            "cycles": state.cycles.tolist(),
            **{
                stage.name: dict(zip(KINETICS, state.kinetics[:, number].T.tolist(), strict=True))
                for number, stage in enumerate(outcome.stages)
            },
        },
        "warnings": reporter.warnings,
        "seconds": {name: round(value, 2) for name, value in reporter.seconds.items()},
        "versions": versions(),
    }


def _interface_summary(outcome: Outcome, number: int, mesh: StructureMesh) -> dict[str, Any]:
    stage, structure = outcome.stages[number], outcome.structure
    first = outcome.first[number]
    peak = structure.peak
    unworn, worn = (s.histories[number].loads for s in (outcome.unworn, outcome.worn))
    bodies = (
        (structure.mesh.body_1, mesh.body_1),
        (structure.mesh.body_2, mesh.body_2),
    )
    last = dict(zip(KINETICS, outcome.state.kinetics[-1, number].tolist(), strict=True))
    return {
        **last,
        "mesh_volume_1": worn_volume(*bodies[0], stage.interface, 1),
        "mesh_volume_2": worn_volume(*bodies[1], stage.interface, 2),
        "peak_load": {
            "unworn": {name: float(getattr(unworn, name)[peak]) for name in RESULTANTS},
            "worn": {name: float(getattr(worn, name)[peak]) for name in RESULTANTS},
        },
        "slip_per_cycle": float(
            np.hypot(*np.moveaxis(outcome.unworn.histories[number].slip, 1, 0)).sum(axis=0).max()
        ),
        "energy_per_cycle": {
            "half_space": float(first.energy.sum()),
            "structure": float((unworn.Edx + unworn.Edy).sum()),
        },
        **({"by_increment": comparison_summary(first.cycle, unworn)} if first.cycle else {}),
        "contact_residual": first.largest_residual,
        "convolutions": first.convolutions,
        "linear_regime": {
            name: None if regime is None else vars(regime)
            for name, regime in outcome.regimes[stage.name].items()
        },
    }


def _say(outcome: Outcome, summary: dict[str, Any], reporter: Reporter) -> None:
    """The end of the run in a few lines."""
    reporter.say(f"{summary['cycles']:.6g} cycles in {summary['jumps']} jumps")
    for stage in outcome.stages:
        own = summary[stage.name]
        peaks = own["peak_pressure"]
        reporter.say(
            f"  {stage.name}: worn {own['depth_1'] * 1e3:.3g} um (disk), "
            f"{own['depth_2'] * 1e3:.3g} um (blade); {own['volume_1']:.3g}, "
            f"{own['volume_2']:.3g} mm^3; peak pressure {peaks['unworn']:.0f} -> "
            f"{peaks['worn']:.0f} MPa"
        )
    reporter.say(f"  seconds: {', '.join(f'{k} {v:.1f}' for k, v in summary['seconds'].items())}")
