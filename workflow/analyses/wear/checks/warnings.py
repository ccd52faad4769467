"""Plausibility warnings about a run that completes without errors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fe_models.meshes.structure_mesh import Face, Interface
from fe_models.structure import CLOSED, InterfaceHistory
from sa_solver.load_history import LoadHistory
from sa_solver.types import ElasticPair, Mask
from wear.contact.interface import FirstContact
from wear.coupled_state import CoupledState
from workflow.analyses.wear.case.base import FiniteElementCase, WearCase
from workflow.analyses.wear.case.sections import SIZES, Duration
from workflow.analyses.wear.output.link_report import report_link
from workflow.analyses.wear.structures import structure_of
from workflow.analyses.wear.structures.resultants.case import ResultantsCase
from workflow.case.text.plain import counted
from workflow.case.text.readable import percent
from workflow.messages.warning_kinds import WarningKind
from workflow.models.checks.warnings import (
    dissimilar_warnings,
    open_warnings,
    unpressed_warnings,
    yield_warnings,
)
from workflow.models.contact import FaceContact, WornFaces, border_warnings
from workflow.models.loads import LoadSource
from workflow.models.structure import StructureLoads
from workflow.models.uncoupled.given_loads import GivenLoads
from workflow.shell.few_cells import check_cells
from workflow.shell.terminal.reporter import Reporter

# Relative imbalance of forces and moments on a body; the friction solver reaches 1e-7.
OUT_OF_BALANCE = 1e-3
# Least number of loaded nodes across a contact for slips that the mesh resolves.
FEWEST_NODES = 5
# Pressure due to the uncertain form of a contact face, relative to its peak. On a cylinder with
# randomly moved vertices, this estimate was 3 to 8 times the actual change.
FORM_SHARE = 0.1
# Relative difference of the energies of structure and half-space that indicates different slips.
ENERGY_DIFFERENCE = 0.25
# Share by which the half-space with its own friction may dissipate less than the nodes, which slip
# element by element: 0.3 to 0.5 on 12 x 16 nodes that never slide as a whole, 0.01 on 40 nodes
# across. It may dissipate more, which is why it is used.
FULL_DIFFERENCE = 0.6
# Share of the work of sliding below which a difference of energies is rounding of a table.
NO_ENERGY = 1e-3


def warn_of_structure(case: FiniteElementCase, stage: StructureLoads, reporter: Reporter) -> None:
    """Report remarks on the model, cycles that do not close, and faces that lose contact."""
    for text in case.remarks_on_nodes():
        reporter.say(text)
    for text, kind in stage.remarks():
        if kind is None:
            reporter.say(text)
        else:
            reporter.warn(kind, text)
    unworn = stage.unworn_cycle
    if unworn.closure > CLOSED:
        reporter.warn(
            WarningKind.CYCLE_NOT_CLOSED,
            "the cycle that feeds the wear is not closed: the contact forces of the last two of "
            f"{unworn.cycles} cycles differ by {percent(unworn.closure)} of the largest",
        )
    imbalance = float(unworn.equilibrium.max())
    if imbalance > OUT_OF_BALANCE:
        reporter.warn(
            WarningKind.OUT_OF_BALANCE,
            f"forces and moments on a body are out of balance by {imbalance:.1e} (relative): the "
            "stiffness at peak load does not suit the other increments; change "
            "nonlinearity.stiffness",
        )
    for history in unworn.histories:
        P = history.loads.P
        reporter.warn_each(open_warnings(history.interface.name, P, stage.peak))
        if P[stage.peak] > 0.0:
            _warn_of_few_nodes(history, stage, reporter)
            _warn_of_form(history, stage, reporter)


def _warn_of_few_nodes(
    history: InterfaceHistory, stage: StructureLoads, reporter: Reporter
) -> None:
    """Warn of a contact on so few nodes that the structure hardly resolves its size."""
    face = history.interface
    pressed = int(np.count_nonzero(history.force[stage.peak, 2] > 0.0))
    least = FEWEST_NODES if face.line else FEWEST_NODES**2
    if pressed < min(least, len(face)):
        reporter.warn(
            WarningKind.FEW_NODES,
            f"{face.name}: only {counted(pressed, 'node')} of a mesh of {_mesh_size(face):.2g} mm "
            f"carry the peak load, and {least} are needed to resolve a contact: its slip and tilt "
            f"depend on the mesh; {stage.model.finer}",
        )


def _warn_of_form(history: InterfaceHistory, stage: StructureLoads, reporter: Reporter) -> None:
    """Warn of faces whose form is less certain in the mesh than the pressure requires."""
    face = history.interface
    assert isinstance(face, Interface)
    pressed = history.force[stage.peak, 2] > 0.0
    unsure = form_error(face, pressed)
    bodies = (stage.structure.bodies[place].elastic.material for place in face.bodies)
    # Waves of twice an element on a half-space: p = π E* height / wavelength (Johnson, 13.2).
    waves = np.pi * ElasticPair(*bodies).contact_modulus * unsure / (2.0 * _mesh_size(face))
    share = float(waves / history.pressure[stage.peak].max())
    if share > FORM_SHARE:
        reporter.warn(
            WarningKind.UNCERTAIN_FORM,
            f"{face.name}: the form of its faces is uncertain by {1e3 * unsure:.2g} µm, as the "
            f"mesh has only corner nodes; the peak pressure may be wrong by {percent(share)}: "
            "give the bodies as CAD, or with midside nodes",
        )


def form_error(face: Interface, pressed: Mask) -> float:
    """Return the error of form of both bodies under the nodes ``pressed`` ``(n,)`` [mm]."""
    below = pressed if face.projection is None else face.projection.T @ pressed > 0.0
    left = 0.0
    for number, nodes in ((1, below), (2, pressed)):
        surface = face.face(number).surface
        if surface is not None and surface.form_error is not None:
            left += float(surface.form_error[nodes].max(initial=0.0))
    return left


def _mesh_size(face: Face) -> float:
    """Return the size of the facets of a face, along their sides [mm]."""
    return float(np.median(face.facet_sizes if face.line else np.sqrt(2.0 * face.facet_sizes)))


def warn_of_file(case: ResultantsCase, reporter: Reporter) -> None:
    """Warn if the cycle of a loads file does not close, as far as the file says."""
    closures = [imported.closure or 0.0 for imported in case.loads().values()]
    if max(closures) > CLOSED:
        reporter.warn(
            WarningKind.CYCLE_NOT_CLOSED,
            f"structure.file: {case.structure.file}: the cycle that feeds the wear is not closed: "
            f"its contact forces differ from the cycle before by {percent(max(closures))} of the "
            "largest; compute more cycles there, and take the last",
        )


def warn_of_contact(
    case: WearCase,
    source: LoadSource,
    faces: WornFaces,
    first: Sequence[FirstContact],
    reporter: Reporter,
) -> None:
    """Warn of dissimilar bodies, yielding, contacts at the border or on few cells, and edge peaks.

    Raises UserError if a contact has too few cells.
    """
    stages = [stage for stage, _ in faces]
    if not isinstance(source, StructureLoads):
        reporter.warn_each(unpressed_warnings(stages, first, source.peak))
    reporter.warn_each(dissimilar_warnings(stages, first))
    reporter.warn_each(border_warnings(stages, first))
    for (stage, state), result in zip(faces, first, strict=True):
        if case.contact.method != "nodes":
            report_link(stage.name, result.link, stage.grid.line, reporter)
        highest = float(result.pressure.max())
        reporter.warn_each(yield_warnings(highest, stage.pair.bodies, f"{stage.name}: "))
        if case.contact.method == "nodes":
            continue  # the grid only shows them
        if reason := _energies_differ(source, stage, state.loads, result):
            reporter.warn(WarningKind.ENERGIES_DIFFER, f"{stage.name}: {reason}")
        settings, pressure = case.contact_of(stage.name), result.pressure[source.peak]
        check_cells(stage.name, settings, stage.grid, pressure, reporter)
        load = float(state.loads.P[source.peak])
        reporter.warn_each(structure_of(case).warnings(case, stage, load))


def _energies_differ(
    source: LoadSource, stage: FaceContact, loads: LoadHistory, first: FirstContact
) -> str:
    """Return the reason why source and half-space differ in energy, or an empty string."""
    from_file, stated = isinstance(source, GivenLoads), loads.mean_energy
    found, unit = float(first.energy.sum()), "N" if stage.grid.line else "N mm"
    if abs(found - stated) <= ENERGY_DIFFERENCE * max(found, stated):
        return ""
    if not first.cycle:
        whose = "structure.file" if from_file else "the structure"
        return (
            f"pressure on the grid and slip of {whose} dissipate {found:.3g} {unit} per cycle, "
            f"{whose} itself {stated:.3g}: its mesh is too coarse for the slip zone, or little "
            "slips; refine it or use contact.method: full"
        )
    if from_file and abs(found - stated) > NO_ENERGY * _work_of_sliding(stage, loads):
        return (
            f"structure.file gives {stated:.3g} {unit} of dissipated energy per cycle, but the "
            f"half-space finds {found:.3g} under the same forces, and wears by it: check Edx and "
            "Edy (of each increment alone), friction.coefficient, size and gap of the face, and "
            "whether the mesh behind the file resolves the slip zone"
        )
    if isinstance(source, StructureLoads) and stated > found / (1.0 - FULL_DIFFERENCE):
        return (
            f"the structure's nodes dissipate {stated:.3g} {unit} per cycle, but the half-space, "
            f"by which the contact wears, {found:.3g}: the mesh is too coarse for the slip zone; "
            "refine it"
        )
    return ""


def _work_of_sliding(stage: FaceContact, loads: LoadHistory) -> float:
    """Return the approximate work of friction at the onset of sliding: (µP)² over the stiffness."""
    friction = stage.settings.friction(0.0)
    shear, modulus = friction * float(loads.P.max()), stage.pair.contact_modulus
    width = 1.0 if stage.grid.line else np.sqrt(np.prod(stage.grid.size))
    return float(shear**2 / (modulus * width))


def warn_of_many_jumps(
    wear: Duration, state: CoupledState[Any], left: int, reporter: Reporter
) -> None:
    """Warn of a run with very many jumps, and name the setting that reduces them."""
    key = next((key for key in SIZES if getattr(wear.step, key) is not None), None)
    longer = "wear.tolerance" if key is None else f"wear.step.{key}"
    reporter.warn(
        WarningKind.MANY_STEPS,
        f"{state.jump} wear jumps have worn {state.cycles[-1]:.3g} of {wear.cycles:g} cycles, and "
        f"about {left} more are needed, each of which takes time and space in the results: a "
        f"larger {longer} needs fewer",
    )


def warn_of_worn_cells(case: WearCase, peak: int, faces: WornFaces, reporter: Reporter) -> None:
    """Warn of worn contacts that carry the peak load on few cells."""
    for stage, state in faces:
        if peak in state.starts:
            pressure = state.starts[peak].pressure
            settings = case.contact_of(stage.name)
            check_cells(stage.name, settings, stage.grid, pressure, reporter, worn=True)
