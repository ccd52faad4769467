"""Results of the structure at the end of a run: worn mesh, stress, loads with the worn faces."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fe_models.elasticity.body import maximum_principal
from fe_models.elasticity.local_model import LocalModel
from fe_models.elasticity.nonlinear import NonlinearCheck
from fe_models.elasticity.stress import PeakStress, StressField, SurfaceHistory, steps
from fe_models.meshes.quality import element_sizes, elements_across, radius_ratios
from fe_models.meshes.remesh import oriented_elements, worn_volume
from fe_models.meshes.structure_mesh import Body, Interface, StructureMesh, write_msh
from sa_solver.half_space.stress import von_mises
from sa_solver.load_history import LoadHistory
from sa_solver.types import Tally
from wear.coupled_state import CoupledState
from workflow.analyses.wear.budget.report import arrays_of, summary_of
from workflow.analyses.wear.output.datasets import put_face
from workflow.analyses.wear.recording import reported_stage
from workflow.analyses.wear.structures.resultants.writing import put_closure
from workflow.analyses.wear.worn.bolts import BoltTensions
from workflow.case.text.readable import percent
from workflow.layout.declared import Arrays
from workflow.messages.warning_kinds import Notice, WarningKind
from workflow.models.budget.parts import ResultError
from workflow.models.contact import WornFaces
from workflow.models.stress.structure_stress import (
    StressedStructure,
    begin_worn_mesh,
    end_cycle,
    formed_meshes,
)
from workflow.models.structure import StructureLoads
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.folders.store import replacing
from workflow.shell.output.results import ResultsWriter
from workflow.shell.terminal.reporter import Reporter

RESULTANTS = ("P", "Qx", "Qy", "Mx", "My", "Mz")
FORCES = ("P", "Qx", "Qy")
# Results of a total Lagrangian check in the summary, in addition to the resultants.
MEASURES = ("slip_change", "slide", "largest_strain", "largest_rotation", "face_rotation")

# Largest number of increments shown: enough for smooth motion, few enough to store.
MOST_INCREMENTS = 48


@dataclass(frozen=True)
class WornStructure:
    """The structure before and after wear, with what is written of it.

    ``written`` are the meshes for output, in which the faces of bodies 2 have their true form.
    ``shown`` are the increments, counted from 0, in which the stresses include the surfaces.
    """

    stressed: StressedStructure
    written: dict[str, StructureMesh]
    shown: list[int]

    @property
    def stage(self) -> StructureLoads:
        """The loads of the structure."""
        return self.stressed.source

    @property
    def notches(self) -> tuple[str, ...]:
        """Names of the bodies with a local model of their notch."""
        fields = self.stressed.stresses["worn"].fields
        return tuple(field.body.name for field in fields if field.local is not None)

    @cached_property
    def bolts(self) -> BoltTensions:
        """Tensions of the bolts, unworn and worn."""
        return BoltTensions(self.stage, self.stage.on_faces(self.stressed.cycle))

    def write(self, writer: ResultsWriter, accuracy: float) -> None:
        """Write load histories of the worn faces, and all bodies unworn and worn."""
        for history in self.stage.on_faces(self.stressed.cycle):
            name = history.interface.name
            put_face(writer, f"structure_worn/{name}", history.interface, history)
            put_closure(writer, f"structure_worn/{name}", self.stressed.cycle)
            put_closure(writer, f"structure/{name}", self.stage.unworn_cycle)
        for moment, mesh in self.written.items():
            stress = self.stressed.stresses[moment]
            for body, field in zip(mesh.bodies, stress.fields, strict=True):
                writer.put(f"bodies/{body.name}/{moment}", _body(body, field))
                if (local := field.local) is not None:
                    place = f"bodies/{body.name}/{moment}/notch"
                    found = {"at": local.place, "largest": local.largest, "error": local.error}
                    writer.put(place, _body(local.body, local), **found)
            for body, surface in zip(mesh.bodies, stress.surfaces, strict=bool(self.shown)):
                mission = _mission(body, surface, self.shown)
                writer.put(f"bodies/{body.name}/{moment}/mission", mission)
        for name, errors in self._errors().items():
            writer.put(f"bodies/{name}/error", arrays_of(errors), accuracy=accuracy)

    def summary(self, state: CoupledState) -> dict[str, Any]:
        """Return statistics of the solver and the largest stresses."""
        stage, unworn = self.stage, self.stage.unworn_cycle
        bodies = self.stressed.mesh.bodies
        return {
            "from_cache": stage.from_cache,
            "joint": "sparse factors" if stage.sparse else "full matrices",
            "nodes": {body.name: int(body.mesh.nvertices) for body in bodies},
            "mesh": {body.name: _mesh_summary(body) for body in stage.mesh.bodies},
            "rigid_modes": stage.rigid_modes,
            "solutions": state.solutions,
            "iterations": unworn.iterations,
            "residual": unworn.residual,
            "equilibrium_error": float(unworn.equilibrium.max()),
            "cycles": unworn.cycles,
            "closure": unworn.closure,
            "nonlinearity": nonlinearity_summary(stage),
            "drift": [float(value) for value in state.drift],
            **self.bolts.summary(),
            "error": {name: summary_of(errors) for name, errors in self._errors().items()},
            "peak_stress": {
                moment: {
                    body.name: {
                        **_peak(field.peak),
                        "at_contact": field.peak.at_contact,
                        "notch": _notch(field),
                    }
                    for body, field in zip(bodies, stress.fields, strict=True)
                }
                for moment, stress in self.stressed.stresses.items()
            },
        }

    def warn(self, accuracy: float, reporter: Reporter) -> None:
        """Warn of notches whose stress has an error due to the mesh above ``accuracy``."""
        bodies = self.stressed.mesh.bodies
        for body, *fields in zip(bodies, *self._fields, strict=True):
            notches = [field.notch for field in fields if field.notch is not None]
            worst = max(notches, key=lambda notch: notch.error, default=None)
            if worst is not None and worst.error > accuracy:
                kind, why = self._why(worst, accuracy)
                reporter.warn(
                    kind,
                    f"{body.name}: the largest stress on the free surface, {worst.von_mises:.0f} "
                    f"MPa at {_place(worst)}, {why}",
                )

    @property
    def _fields(self) -> tuple[tuple[StressField, ...], ...]:
        """Stress fields of all bodies, unworn and worn."""
        return tuple(stress.fields for stress in self.stressed.stresses.values())

    def _why(self, peak: PeakStress, accuracy: float) -> Notice:
        """Return the reason why a stress is unreliable, and a remedy."""
        if not peak.bounded:
            return Notice(
                WarningKind.UNBOUNDED_STRESS,
                "has no limit as the mesh is refined, because it is next to a sharp inward "
                "corner, a fillet of fewer than nine elements round the circle or the end of a "
                "clamped or rigid face: round the corner, refine the fillet, or hold the body "
                "farther away",
            )
        return Notice(
            WarningKind.UNCERTAIN_NOTCH_STRESS,
            f"has an estimated error of {percent(peak.error)} due to the mesh, above the accuracy "
            f"of {100 * accuracy:g} %: {self.stage.model.finer}",
        )

    def _errors(self) -> dict[str, dict[str, ResultError]]:
        """Return the error of the largest free-surface stress by body; unknown at sharp corners."""
        bodies = self.stressed.mesh.bodies
        errors = {}
        for body, *fields in zip(bodies, *self._fields, strict=True):
            left = [field.notch for field in fields if field.notch is not None]
            if left:
                errors[body.name] = {"notch_stress": ResultError({"mesh": _known(left)})}
        return errors

    def sentences(self) -> Iterator[str]:
        """Yield the tensions of bolts and the largest stresses of each body, unworn and worn."""
        yield from self.bolts.sentences()
        bodies = self.stressed.mesh.bodies
        for body, unworn, worn in zip(bodies, *self._fields, strict=True):
            parts = []
            if unworn.notch is not None and worn.notch is not None:
                left = _left(unworn.notch, worn.notch)
                if worn.local is not None:
                    left = f"local model at {_place(worn.notch)}, {left}"
                parts.append(f"{_change(unworn.notch, worn.notch)} on the free surface ({left})")
            if worn.peak != worn.notch:
                where = "on a contact face" if worn.peak.at_contact else "elsewhere"
                left = _left(unworn.peak, worn.peak)
                parts.append(f"{_change(unworn.peak, worn.peak)} {where} ({left})")
            yield f"{body.name}: von Mises stress up to {', '.join(parts)}"

    def interface_summary(self, number: int, width: float) -> dict[str, Any]:
        """Return worn volumes in the mesh and resultants; ``width`` [mm] is that of the contact."""
        stage, interface = self.stage, self.stage.mesh.interfaces[number]
        unworn, worn = stage.unworn()[number].loads, self.stressed.history(number).loads
        swept = [
            worn_volume(stage.mesh.bodies[place], self.stressed.mesh.bodies[place], interface, side)
            for side, place in enumerate(interface.bodies, start=1)
        ]
        return {
            **({"mirrored_across": planes} if (planes := _mirrored_across(interface)) else {}),
            "mesh_volume_1": swept[0],
            "mesh_volume_2": swept[1],
            "peak_load": {
                "unworn": resultants_at(unworn, stage.peak),
                "worn": resultants_at(worn, stage.peak),
            },
            "load_range": {"unworn": load_ranges(unworn), "worn": load_ranges(worn)},
            # Where meshes do not match, the coarser one counts.
            "elements_across": round(
                min(elements_across(interface.face(k), width) for k in (1, 2)), 1
            ),
        }


def _mirrored_across(interface: Interface) -> list[str]:
    """Return the axes across which planes of symmetry cut an interface."""
    return ["xy"[axis] for axis in interface.planes]


def _known(peaks: Sequence[PeakStress]) -> float | None:
    """Return the largest error of these stresses, or None if one of them has no bound."""
    return max(peak.error for peak in peaks) if all(p.bounded for p in peaks) else None


def _left(unworn: PeakStress, worn: PeakStress) -> str:
    """Return the larger error of two stresses in words."""
    error = _known([unworn, worn])
    return "no limit" if error is None else f"error due to the mesh {percent(error)}"


def _place(peak: PeakStress) -> str:
    x, y, z = peak.place
    return f"X {x:.4g}, Y {y:.4g}, Z {z:.4g} mm"


def _change(unworn: PeakStress, worn: PeakStress) -> str:
    return f"{unworn.von_mises:.0f} -> {worn.von_mises:.0f} MPa"


def _peak(peak: PeakStress) -> dict[str, Any]:
    """Return the summary of a largest stress."""
    return {
        "von_mises": peak.von_mises,
        "maximum_principal": peak.maximum_principal,
        "at": list(peak.place),
        "error": peak.error,
    }


def _notch(field: StressField) -> dict[str, Any] | None:
    """Return the summary of the largest stress on the free surface, if there is any."""
    if field.notch is None:
        return None
    if field.local is None:
        return _peak(field.notch)
    names = "size_error", "cut_error", "traction_error"
    parts = {name: getattr(field.local, name) for name in names}
    return _peak(field.notch) | {"local_model": parts}


def _body(body: Body, field: StressField | LocalModel) -> Arrays:
    """Return the mesh and stress of a body or of a local model."""
    fields = ("displacement", "stress", "von_mises", "maximum_principal")
    return {
        "points": body.points,
        "elements": oriented_elements(body.mesh),
        **{name: getattr(field, name) for name in fields},
    }


def _mission(body: Body, surface: SurfaceHistory, shown: Sequence[int]) -> Arrays:
    """Return a body's surface over the increments, with fields in single precision."""
    stress = surface.stress.swapaxes(0, 1)
    fields = {
        "displacement": surface.displacement,
        "von_mises": von_mises(stress),
        "maximum_principal": maximum_principal(stress),
    }
    return {
        "increments": np.array(shown) + 1,
        "points": body.points[surface.vertices],
        "triangles": surface.triangles,
        **{name: field.astype(np.float32) for name, field in fields.items()},
    }


def worn_structure(
    stage: StructureLoads,
    faces: WornFaces,
    evolves: bool,
    moves: bool,
    folder: OutputFolder,
    reporter: Reporter,
) -> WornStructure:
    """Solve the structure with worn gaps, build its worn mesh, write it, and compute stresses.

    If friction ``evolves``, each contact has its coefficient at the end. If the structure
    ``moves``, the surfaces of all bodies over the increments are included.
    """
    worn = begin_worn_mesh(stage, faces)
    with reported_stage(reporter, stage, "structural friction", "increments"):
        cycle = end_cycle(stage, faces, evolves)
    with reporter.stage("re-meshing"):
        mesh = worn()
        written, folded = formed_meshes(stage.mesh, mesh)
        if folded:
            reporter.warn(
                WarningKind.WORN_MESH_SIMPLIFIED,
                f"{folded}: worn.msh, points and ParaView files show only the worn shape",
            )
        with replacing(
            folder.reserve("worn.msh", "the mesh with the worn faces, in mm")
        ) as unfinished:
            write_msh(unfinished, written["worn"])
    with reporter.stage("stress", "steps") as reported:
        done = Tally(reported, steps(len(mesh.bodies)))
        shown = shown_increments(len(cycle.fields()["force"]), stage.peak) if moves else []
        stressed = StressedStructure.of(stage, mesh, cycle, shown, done)
    return WornStructure(stressed, written, shown)


def shown_increments(count: int, peak: int) -> list[int]:
    """Return the increments, counted from 0, to show: evenly spaced, with the peak load."""
    evenly = np.linspace(0, count - 1, min(count, MOST_INCREMENTS)).round().astype(int)
    evenly[np.argmin(np.abs(evenly - peak))] = peak
    return [int(increment) for increment in evenly]


def resultants_at(loads: LoadHistory, increment: int) -> dict[str, float]:
    """Return the forces and moments of one increment."""
    return {name: float(getattr(loads, name)[increment]) for name in RESULTANTS}


def load_ranges(loads: LoadHistory) -> dict[str, dict[str, float]]:
    """Return the least and largest forces in a cycle, with increments counted from 1."""
    ranges = {}
    for name in FORCES:
        force = getattr(loads, name)
        least, largest = int(np.argmin(force)), int(np.argmax(force))
        ranges[name] = {
            "least": float(force[least]),
            "least_at": least + 1,
            "largest": float(force[largest]),
            "largest_at": largest + 1,
        }
    return ranges


def _mesh_summary(body: Body) -> dict[str, Any]:
    """Return the number and sizes of elements, and the quality of the worst one."""
    sizes = element_sizes(body.mesh)
    ends = {"smallest": sizes.min(), "median": np.median(sizes), "largest": sizes.max()}
    return {
        "elements": len(sizes),
        "size": {name: float(size) for name, size in ends.items()},
        "worst_quality": float(radius_ratios(body.mesh).min()),
    }


def nonlinearity_sentence(check: NonlinearCheck) -> str:
    """Return a sentence on the effect of geometric nonlinearity at peak load."""
    force, moment = (float(np.abs(part).max()) for part in np.split(check.change, [3], axis=1))
    return (
        f"geometric nonlinearity at peak load changes P and Q by {percent(force)} of P, moments "
        f"by {percent(moment)} of P x half a face, slips by {percent(check.slip_change)} of the "
        "largest"
    )


def nonlinearity_summary(stage: StructureLoads) -> dict[str, Any]:
    """Return the stiffness used and, if requested, the results of the total Lagrangian check."""
    chosen = stage.model.nonlinearity
    if not chosen.check:
        return {"stiffness": chosen.stiffness}
    check = stage.nonlinear_check
    names = [interface.name for interface in stage.mesh.interfaces]
    return {
        "stiffness": chosen.stiffness,
        "change": {
            name: dict(zip(RESULTANTS, row.tolist(), strict=True))
            for name, row in zip(names, check.change, strict=True)
        },
        **{name: float(getattr(check, name)) for name in MEASURES},
        "iterations": check.iterations,
        "residual": check.residual,
    }
