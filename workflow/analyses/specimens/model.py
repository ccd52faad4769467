"""Translation of a case of specimens into models of them."""

from __future__ import annotations

from fe_models.joints.reduced_contact import FrettingConditions
from workflow.analyses.specimens.case import SpecimensCase
from workflow.analyses.wear.structures.dovetail.model import added_gap
from workflow.models.specimens.fretted import FrettedSpecimens
from workflow.models.specimens.reduced import ReducedSpecimens, SpecimenPair
from workflow.shell.folders.cache import DiskStore


def specimen_pair(case: SpecimensCase, target_distance: float | None = None) -> SpecimenPair:
    """Return the two specimens; their reduced models may keep a target at a distance [mm]."""
    return SpecimenPair(
        specimen=case.geometry(),
        materials=case.elastic,
        size=case.mesh.size,
        order=case.mesh.order,
        modes=case.reduction.modes,
        added=next(map(added_gap, case.scanned()), None),
        target_distance=target_distance,
    )


def reduced_pair(case: SpecimensCase, target_distance: float | None = None) -> ReducedSpecimens:
    """Return the two specimens; their reduced models are stored in the user's cache."""
    return ReducedSpecimens(specimen_pair(case, target_distance), DiskStore())


def fretted_specimens(case: SpecimensCase, force: float) -> FrettedSpecimens:
    """Return the specimens that wear under one of the normal forces of a case [N]."""
    wear, load = case.wear, case.load_path
    return FrettedSpecimens(
        specimens=specimen_pair(case),
        conditions=FrettingConditions(force, load.stroke, case.friction.coefficient),
        laws=case.laws,
        cycles=wear.cycles,
        energy=wear.energy,
        fraction=wear.step.fraction,
        block=wear.step.cycles,
    )
