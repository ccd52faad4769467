"""Cheap probe runs of a dovetail: depth and volume that its plane section wears.

A probe run solves the structure of the section once, then wears the line contact of each flank over
all cycles of the run. All rungs of a ladder use the same few steps, so that the error of the steps,
a few per cent of the depth, is nearly the same in all of them and cancels in differences.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from sa_solver.half_space.operator import HalfSpace
from sa_solver.load_history import LoadHistory
from sa_solver.normal.contact import NormalContact
from sa_solver.types import ElasticPair, Grid, resultant_change
from wear.contact.tractions import acting_slip
from wear.steps.implicit import ImplicitStepper
from wear.steps.marching import advance_cycles
from wear.steps.stepping import SlidingCycle, WearingContact, WearState
from workflow.analyses.wear.case.sections import ContactSection, ContactStress, Life, Step
from workflow.analyses.wear.structures.dovetail.case import SIDES, DovetailCase
from workflow.analyses.wear.structures.dovetail.model import dovetail_joint
from workflow.analyses.wear.translation import model_with, structure_loads
from workflow.case.changing import changed
from workflow.errors import MethodFailed
from workflow.models.budget.probe_models import Resultants, along_slot
from workflow.models.budget.probe_runs import (
    STEPS,
    TOLERANCE,
    Numbers,
    probe_run,
)
from workflow.models.dovetail import FEW_INCREMENTS
from workflow.models.structure import StructureLoads
from workflow.models.wear import WearModel
from workflow.shell.folders.cache import DiskStore

# Settings of a probe run along the axes that it does not vary: cells across a flank, and nodes
# across it. Differences along one axis hardly depend on them.
CELLS, NODES = 64, 11
# Elements round a fillet, whose stress no probe run needs.
NOTCH = 16


def _shortened(case: DovetailCase, settings: Mapping[str, Any]) -> DovetailCase:
    """Return the case of a probe run, with other ``settings`` by their dotted paths."""
    step = Step.model_construct(kind="implicit", cycles=case.wear.cycles / STEPS)
    return changed(
        case,
        {
            "contact.tolerance": TOLERANCE,
            "wear.step": step,
            "stress": ContactStress(section="none", life=Life(parameter="none")),
            **settings,
        },
    )


def plane_section(case: DovetailCase) -> DovetailCase:
    """Return the plane-strain section of a case for probe runs; the structure gives the slips."""
    return _shortened(
        case,
        {
            **case.to_plane,
            "mesh.flank_nodes": (NODES, NODES),
            "mesh.notch": NOTCH,
            "mesh.size": case.structure.face_width / 2.0,
            "contact.grid": (CELLS, CELLS),
            "contact.method": "normal",
            "wear.motion": "neglect",
            **case.divided(FEW_INCREMENTS),
        },
    )


def _structure(case: DovetailCase) -> StructureLoads:
    """Return the structure of a case, cached because all rungs of a contact's ladder share it."""
    return _last_structure(changed(case, {"contact": ContactSection()}))


@lru_cache(1)
def _last_structure(case: DovetailCase) -> StructureLoads:
    return structure_loads(case, dovetail_joint)


def _model(case: DovetailCase) -> WearModel:
    return model_with(case, dovetail_joint(case))


def section_wear(case: DovetailCase, resultants: Resultants = "constant") -> Numbers:
    """Return the depth [mm] and the volume per length [mm²] worn from both bodies, by flank.

    The loads are those of the unworn structure, or follow wear in ``every`` step. Raises the errors
    of structure and contact, and MethodFailed where nothing wears.
    """
    return _wearing(probe_run(_model(case), _structure(case), resultants).worn)


def coupled_wear(case: DovetailCase) -> tuple[Numbers, float]:
    """Return the wear with the structure solved after every step, and the drift of the loads.

    The drift is that of the resultants at the end, as a run measures it.
    """
    structure = _structure(case)
    probed = probe_run(_model(case), structure, "every")
    sizes = np.array([contact.grid.size for contact in probed.contacts])
    drifted = structure.probe(probed.nodal_depths)
    drift = resultant_change(drifted, probed.states[0].solved_resultants, sizes)
    return probed.worn, float(np.abs(drift).max())


def _wearing(numbers: Numbers) -> Numbers:
    """Return the numbers if anything wears. Raises MethodFailed otherwise."""
    if not any(flank["volume"] > 0.0 for flank in numbers.values()):
        raise MethodFailed("nothing wears in a section of the case")
    return numbers


def resultants_of(case: DovetailCase) -> Resultants:
    """Return whether the loads of a case are those of the unworn structure or follow wear."""
    return "constant" if case.coupling.resultants == "constant" else "every"


def wear_along_slot(case: DovetailCase) -> tuple[Numbers, Numbers, float]:
    """Return the wear in space on two meshes that differ along the slot.

    The first has as many nodes along it as the case. The last number is the share of the difference
    that is its error.
    """
    meshes = along_slot(_model(case))
    assert meshes is not None
    own, other = (
        probe_run(model, model.loads(DiskStore()), resultants_of(case))
        for model in (meshes.own, meshes.model)
    )
    return _wearing(own.worn), other.worn, meshes.share


# --- the profile along the slot -------------------------------------------------------------------


def slot_wear(case: DovetailCase, cells: int) -> Numbers:
    """Return depth and volume of the profile along the slot, as a line contact of ``cells``.

    Per length across the flank, it carries the section's load over the whole slot, without moments,
    and it slides everywhere by the section's mean slip.
    """
    structure = _structure(case)
    length, width = case.structure.slot_length, case.structure.face_width
    grid = Grid.line_contact(length, cells)
    contact = NormalContact(HalfSpace(grid, ElasticPair(case.material(1), case.material(2))))
    laws = case.wear_of(1).described(), case.wear_of(2).described()
    geometry, cycles = case.structure.geometry(), case.wear.cycles
    numbers = {}
    for face, history in zip(structure.faces, structure.unworn(), strict=True):
        carried, none = history.loads, np.zeros(len(history.loads))
        P = length / width * carried.P
        mix = carried.sliding, carried.share, carried.block
        loads = LoadHistory(P, *(none,) * 7, *mix)
        slip = acting_slip(history.slip, carried).mean(axis=1)
        sliding = SlidingCycle(loads, np.multiply.outer(slip, np.ones(grid.shape)))
        gap = geometry.flank_gap(np.zeros_like(grid.x), grid.x, SIDES[face.face.name])
        wearing = WearingContact(contact, laws, case.friction.at(0.0), sliding, TOLERANCE)
        state, contact_at = WearState.unworn(np.ascontiguousarray(gap)), lambda _, c=wearing: c
        for _ in range(STEPS):
            stepper = ImplicitStepper(alone=True)
            state = advance_cycles(stepper, state, cycles / STEPS, cycles, contact_at).state
        depth = state.surfaces.depth
        volume = float(depth.sum()) * grid.cell_area
        numbers[face.face.name] = {"depth": float(depth.max()), "volume": volume}
    return _wearing(numbers)
