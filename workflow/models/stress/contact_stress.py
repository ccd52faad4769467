"""Stress under the contacts, and where fretting cracks would start, on unworn and worn surfaces.

The stress has two parts: that of separate half-spaces under the contact's tractions, and that which
a structure of finite elements carries past the contact. Without such a structure the second part is
missing, and the output says so. Stress on the surface itself is left out, because it depends on the
grid where shear starts at a slipping edge: sections begin, and maps lie, at the critical distance
of the settings.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import isfinite
from typing import Literal

import numpy as np

from sa_solver.transforms.threads import run_parallel
from sa_solver.types import Array, Mask, Material, Progress, Tally, unseen
from wear.contact.face_loads import FaceLoads
from wear.contact.tractions import CycleTractions
from wear.cracking.bulk_stress import BulkStress
from wear.cracking.life import Ruiz, findley, smith_watson_topper
from workflow.messages.warning_kinds import Notice, WarningKind
from workflow.models.contact import FaceContact
from workflow.models.stress.body_stress import (
    Planes,
    Stressed,
    StressedBody,
    StressedCycle,
    sections,
    with_known_shear,
)
from workflow.models.stress.layout import MOMENTS
from workflow.models.stress.settings import Stress
from workflow.models.stress.structure_stress import StressedStructure

# Share of the load whose shear may be unknown. A gap in the shear causes stress of the order of µp
# at its rim, whatever its size. The cells at the edge of a sliding contact that have no slipping
# node of the structure nearby stay below this share.
STUCK_SHARE = 0.01

BodyNumber = Literal[1, 2]
Cycles = tuple[FaceContact, tuple[StressedCycle, StressedCycle]]
"""A contact with its unworn and its worn cycle."""


@dataclass(frozen=True)
class BodyStress:
    """Stress of one body under one contact.

    ``section`` ``(6, n, k)`` [MPa] is the stress at peak load, or None if no section is requested.
    ``maps`` are those of the fretting parameter over the face, each ``(..., nx, ny)``, by their
    names in ``results.h5``.
    """

    section: Array | None
    maps: dict[str, Array]


@dataclass(frozen=True)
class ContactMoment:
    """Stresses of the deformable bodies under one contact, by body number, unworn or worn.

    ``carried`` is the stress that a structure carries past the contact, where it is known.
    ``left_out`` are the increments, counted from 0, whose shear is unknown (see
    :class:`wear.contact.tractions.CycleTractions`) and which the maps leave out.
    """

    bodies: Mapping[BodyNumber, BodyStress]
    carried: tuple[BulkStress, ...]
    left_out: np.ndarray

    @property
    def bulk(self) -> bool:
        """True if all bodies include the stress that a structure carries past the contact."""
        return len(self.carried) == len(self.bodies)


@dataclass(frozen=True)
class InterfaceStress:
    """Stress under one contact; ``moments`` by the names in ``MOMENTS``.

    ``stuck`` ``(t,)`` is the largest share of the load of any moment whose shear is unknown.
    """

    name: str
    planes: Planes
    moments: dict[str, ContactMoment]
    stuck: Array
    convolutions: int

    @property
    def bulk(self) -> bool:
        """True if all moments include the stress that a structure carries past the contact."""
        return all(moment.bulk for moment in self.moments.values())

    @property
    def uncertain(self) -> float:
        """Uncertainty of what the structure carries past the contact; 0 if it is small.

        It is relative to the deformation of half-spaces.
        """
        fits = [carried.rest for moment in self.moments.values() for carried in moment.carried]
        return (
            max((fit.residual for fit in fits), default=0.0) if any(f.coarse for f in fits) else 0.0
        )

    @property
    def carried_warning(self) -> Notice | None:
        """Warning about the stress that a structure carries past the contact, if there is one."""
        if not self.bulk:
            return Notice(
                WarningKind.UNCERTAIN_CARRIED_STRESS,
                f"{self.name}: too few nodes near the contact to know what the structure carries "
                "beyond the contact: the stress under it is that of its tractions alone; refine "
                "the mesh there",
            )
        if not self.uncertain:
            return None
        return Notice(
            WarningKind.UNCERTAIN_CARRIED_STRESS,
            f"{self.name}: what the structure carries beyond the contact is uncertain by "
            f"{100.0 * self.uncertain:.1f} % of the deformation of half-spaces, and the stress "
            "under it may be wrong by as much, and twice as much near the ends of the face: "
            "refine the mesh of the contact face",
        )

    @property
    def mapped(self) -> bool:
        """True if there are maps of the fretting parameter."""
        return all(body.maps for body in self._bodies)

    @property
    def cracking(self) -> bool:
        """True if the fretting parameter is above 0 anywhere."""
        parameter = self.planes.settings.parameter
        name = "cracking_parameter" if parameter == "ruiz" else parameter
        return self.mapped and any(body.maps[name].any() for body in self._bodies)

    @property
    def _bodies(self) -> list[BodyStress]:
        """Stresses of all bodies, unworn and worn."""
        return [body for moment in self.moments.values() for body in moment.bodies.values()]


def strained(stage: FaceContact) -> tuple[BodyNumber, ...]:
    """Return the numbers of the bodies of a contact that have stresses: all but a rigid one."""
    bodies: tuple[tuple[BodyNumber, Material], ...] = (1, stage.pair.body_1), (2, stage.pair.body_2)
    return tuple(number for number, material in bodies if isfinite(material.young))


def cycles_of(
    stage: FaceContact,
    number: int,
    tractions: tuple[CycleTractions, CycleTractions],
    unworn: FaceLoads,
    structure: StressedStructure | None,
) -> Cycles:
    """Return the contact ``number`` with its unworn and worn cycle, from the tractions of both.

    Loads that no ``structure`` changes stay the ``unworn`` ones.
    """
    worn = unworn if structure is None else structure.history(number)
    begin, end = (
        StressedCycle(
            with_known_shear(stage, found, loads),
            loads,
            *(structure.under(moment, number) if structure else ()),
        )
        for moment, found, loads in zip(MOMENTS, tractions, (unworn, worn), strict=True)
    )
    return stage, (begin, end)


def contact_stresses(
    stress: Stress, peak: int, contacts: Sequence[Cycles], progress: Progress = unseen
) -> list[InterfaceStress]:
    """Return the stresses under all ``contacts``; ``peak`` is the increment of peak load.

    ``progress`` is called with the number of bodies done, unworn and worn.
    """
    done = Tally(progress, len(MOMENTS) * sum(len(strained(stage)) for stage, _ in contacts))
    return run_parallel(
        [partial(_interface_stress, stress, peak, *contact, done) for contact in contacts]
    )


def _interface_stress(
    settings: Stress,
    peak: int,
    stage: FaceContact,
    cycles: tuple[StressedCycle, StressedCycle],
    done: Callable[[], None],
) -> InterfaceStress:
    planes = Planes(settings, stage.grid)
    materials = stage.pair.bodies
    bodies = [StressedBody(stage, materials[n - 1], n) for n in strained(stage)]
    stressed = [[(body, cycle, body.bulk(cycle)) for body in bodies] for cycle in cycles]
    drawn = _drawn(settings, stressed, planes, peak)
    moments = {
        moment: _moment(settings, bodies_then, sections_then, done)
        for moment, bodies_then, sections_then in zip(MOMENTS, stressed, drawn, strict=True)
    }
    stuck = np.maximum(*(cycle.tractions.unknown for cycle in cycles))
    convolutions = sum(body.convolutions for body in bodies)
    return InterfaceStress(stage.name, planes, moments, stuck, convolutions)


def _drawn(
    settings: Stress, stressed: Sequence[Sequence[Stressed]], planes: Planes, peak: int
) -> list[list[Array | None]]:
    """Return the sections of all bodies by moment, None where no section is requested."""
    if settings.section == "none":
        return [[None for _ in bodies] for bodies in stressed]
    found = iter(sections([one for bodies in stressed for one in bodies], planes, peak))
    return [[next(found) for _ in bodies] for bodies in stressed]


def _moment(
    settings: Stress,
    stressed: Sequence[Stressed],
    drawn: Sequence[Array | None],
    done: Callable[[], None],
) -> ContactMoment:
    cycle = stressed[0][1].tractions
    known = cycle.unknown <= STUCK_SHARE
    stresses: dict[BodyNumber, BodyStress] = {}
    for one, section in zip(stressed, drawn, strict=True):
        mapped = settings.parameter != "none" and known.any()
        stresses[one[0].number] = BodyStress(
            section, life_maps(settings, one, known) if mapped else {}
        )
        done()
    carried = tuple(bulk for *_, bulk in stressed if bulk is not None)
    return ContactMoment(stresses, carried, np.flatnonzero(~known))


def life_maps(settings: Stress, stressed: Stressed, known: Mask) -> dict[str, Array]:
    """Return maps of the parameter and its factors at the critical distance, by name.

    Stress is that of the ``known`` ``(t,)`` increments in all cycles of a mix; friction work is
    that of all increments in a mean cycle.
    """
    (body, cycle, bulk), depth = stressed, settings.critical_distance
    if settings.parameter == "ruiz":
        ruiz = Ruiz(mean_work(cycle.tractions), body.tension(cycle, bulk, depth, known))
        return {
            name: getattr(ruiz, name)
            for name in ("friction_parameter", "tension", "cracking_parameter")
        }
    history = body.history(cycle, bulk, depth, known)[known]
    return plane_maps(settings, history, body.material)


def mean_work(cycle: CycleTractions) -> Array:
    """Return the friction work per area in a mean cycle, all increments ``(nx, ny)`` [N/mm]."""
    return np.tensordot(cycle.loads.share, cycle.work, 1)


def plane_maps(settings: Stress, history: Array, material: Material) -> dict[str, Array]:
    """Return maps of a critical-plane parameter for a stress ``history`` ``(t, 6, nx, ny)``."""
    if settings.parameter == "findley":
        plane, amplitude = findley(history, settings.sensitivity), "shear_amplitude"
    else:
        plane, amplitude = smith_watson_topper(history, material), "strain_amplitude"
    return {
        settings.parameter: plane.value,
        amplitude: plane.amplitude,
        "normal_stress": plane.normal_stress,
        "normal": plane.normal,
    }
