"""Stress under the contacts, and where fretting cracks would start, on unworn and worn surfaces.

The stress has two parts: that of separate half-spaces under the contact's tractions, and that which
a structure of finite elements carries past the contact. Without such a structure the second part is
missing, and the output says so. Stress on the surface itself is left out, because it depends on the
grid where shear starts at a slipping edge: sections begin, and maps lie, at the critical distance
of the case.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

import numpy as np

from sa_solver.half_space.stress import von_mises
from sa_solver.half_space.subsurface import COMPONENTS
from sa_solver.ties import first_largest
from sa_solver.transforms.threads import run_parallel
from sa_solver.types import Array, Mask, Material, Progress, Tally
from wear.contact.tractions import CycleTractions
from wear.cracking.bulk_stress import BulkStress
from wear.cracking.life import Ruiz, findley, smith_watson_topper
from workflow.analyses.wear.case.base import ContactTerms, WearCase
from workflow.analyses.wear.case.sections import ContactStress, Life
from workflow.analyses.wear.output.layout import MOMENTS
from workflow.analyses.wear.stress.body_stress import (
    Planes,
    Stressed,
    StressedBody,
    StressedCycle,
    sections,
)
from workflow.case.text.readable import percent
from workflow.models.contact import FaceContact
from workflow.shell.output.results import ResultsWriter
from workflow.shell.terminal.reporter import Reporter

# Share of the load whose shear may be unknown. A gap in the shear causes stress of the order of µp
# at its rim, whatever its size. The cells at the edge of a sliding contact that have no slipping
# node of the structure nearby stay below this share.
STUCK_SHARE = 0.01

# Ruiz's maps that the summary reports; of other parameters it reports the parameter alone.
RUIZ = ("cracking_parameter", "friction_parameter", "tension")


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

    bodies: Mapping[Literal[1, 2], BodyStress]
    carried: tuple[BulkStress, ...]
    left_out: np.ndarray

    @property
    def bulk(self) -> bool:
        """True if all bodies include the stress that a structure carries past the contact."""
        return len(self.carried) == len(self.bodies)


@dataclass(frozen=True)
class InterfaceStress:
    """Stress under one contact; ``moments`` by the names in ``MOMENTS``."""

    name: str
    case: WearCase
    terms: ContactTerms
    planes: Planes
    moments: dict[str, ContactMoment]
    convolutions: int

    @property
    def bulk(self) -> bool:
        """True if all moments include the stress that a structure carries past the contact."""
        return all(moment.bulk for moment in self.moments.values())

    @property
    def mapped(self) -> bool:
        """True if there are maps of the fretting parameter."""
        return all(body.maps for body in self._bodies)

    @property
    def cracking(self) -> bool:
        """True if the fretting parameter is above 0 anywhere."""
        parameter = self.planes.settings.life.parameter
        name = RUIZ[0] if parameter == "ruiz" else parameter
        return self.mapped and any(body.maps[name].any() for body in self._bodies)

    @property
    def _bodies(self) -> list[BodyStress]:
        """Stresses of all bodies, unworn and worn."""
        return [body for moment in self.moments.values() for body in moment.bodies.values()]

    def write(self, writer: ResultsWriter) -> None:
        """Write sections to ``stress/section`` and maps to ``stress/life``, by interface."""
        if self.planes.settings.section != "none":
            self._write_section(writer, f"stress/section/{self.name}")
        if self.mapped:
            self._write_life(writer, f"stress/life/{self.name}")

    def _write_section(self, writer: ResultsWriter, group: str) -> None:
        planes = self.planes
        attributes = {"axis": planes.settings.section, "at": planes.at, "components": COMPONENTS}
        attributes["bulk_stress"] = self.bulk
        limits = {n: self.terms.materials[n - 1].yield_stress for n in self.terms.strained}
        attributes |= {f"yield_stress_{n}": y for n, y in limits.items() if np.isfinite(y)}
        writer.put(group, {"along": planes.along, "depths": planes.depths}, **attributes)
        for moment, contact in self.moments.items():
            for number, body in contact.bodies.items():
                assert body.section is not None
                section = {"stress": body.section, "von_mises": von_mises(body.section)}
                writer.put(f"{group}/{moment}/body_{number}", section)

    def _write_life(self, writer: ResultsWriter, group: str) -> None:
        for moment, contact in self.moments.items():
            writer.put(f"{group}/{moment}", {"left_out": contact.left_out})
            for number, body in contact.bodies.items():
                writer.put(f"{group}/{moment}/body_{number}", body.maps)
        life = self.planes.settings.life
        attributes = {"parameter": life.parameter, "depth": life.depth, "bulk_stress": self.bulk}
        writer.put(group, {}, **attributes)

    def summary(self) -> dict[str, Any]:
        """Return the largest values, their places and their ratios worn to unworn, by body."""
        numbers: dict[str, Any] = {"convolutions": self.convolutions, "bulk": self.bulk}
        if self.planes.settings.section != "none":
            numbers["von_mises"] = self._of_bodies(self._largest_von_mises)
        if not self.mapped:
            return numbers
        numbers["left_out"] = {m: len(contact.left_out) for m, contact in self.moments.items()}
        parameter = self.planes.settings.life.parameter
        for name in RUIZ if parameter == "ruiz" else (parameter,):
            numbers[name] = self._of_bodies(lambda body, name=name: self._largest(body.maps[name]))
        return numbers

    def _of_bodies(self, largest: Any) -> dict[str, Any]:
        numbers = {}
        for number in self.terms.strained:
            values = {m: largest(moment.bodies[number]) for m, moment in self.moments.items()}
            before, after = (values[moment]["value"] for moment in MOMENTS)
            name = self.case.bodies[number - 1]
            numbers[name] = values | {"ratio": after / before if before else None}
        return numbers

    def _largest_von_mises(self, body: BodyStress) -> dict[str, float]:
        assert body.section is not None
        # Stress outside the body is nan.
        values, planes = np.nan_to_num(von_mises(body.section)), self.planes
        i, k = np.unravel_index(first_largest(values), values.shape)
        along, across = ("y", "x") if planes.settings.section == "y" else ("x", "y")
        place = {along: float(planes.along[i]), across: planes.at, "depth": float(planes.depths[k])}
        return {"value": float(values.max()), **place}

    def _largest(self, values: Array) -> dict[str, float]:
        grid = self.planes.grid
        i, j = np.unravel_index(first_largest(values), values.shape)
        place = {"x": float(grid.x[i, 0]), "y": float(grid.y[0, j])}
        return {"value": float(values.max()), **place, "depth": self.planes.settings.life.depth}


def contact_stresses(
    case: WearCase,
    peak: int,
    contacts: Sequence[tuple[FaceContact, tuple[StressedCycle, StressedCycle]]],
    reporter: Reporter,
    progress: Progress,
) -> list[InterfaceStress]:
    """Return the stresses under all ``contacts`` that the case requests.

    Each contact comes with an unworn and a worn cycle; ``peak`` is the increment of peak load.
    ``progress`` is called with the number of bodies done, unworn and worn.
    """
    unknown = [cycle.tractions.unknown for _, cycles in contacts for cycle in cycles]
    _report_stick(np.array(unknown), peak, reporter)
    strained = sum(len(case.terms(stage.name).strained) for stage, _ in contacts)
    done = Tally(progress, len(MOMENTS) * strained)
    stresses = run_parallel(
        [partial(_interface_stress, case, peak, *contact, done) for contact in contacts]
    )
    for stress, (_, cycles) in zip(stresses, contacts, strict=True):
        if cycles[0].faces is None:
            reporter.log(
                f"{stress.name}: the stress under the contact is that of its tractions alone"
            )
        else:
            _report_carried(stress, reporter)
    return stresses


def _interface_stress(
    case: WearCase,
    peak: int,
    stage: FaceContact,
    cycles: tuple[StressedCycle, StressedCycle],
    done: Callable[[], None],
) -> InterfaceStress:
    planes = Planes(case.stress, stage.grid)
    terms = case.terms(stage.name)
    bodies = [StressedBody(stage, terms.materials[n - 1], n) for n in terms.strained]
    stressed = [[(body, cycle, body.bulk(cycle)) for body in bodies] for cycle in cycles]
    drawn = _drawn(case.stress, stressed, planes, peak)
    moments = {
        moment: _moment(case.stress.life, bodies_then, sections_then, done)
        for moment, bodies_then, sections_then in zip(MOMENTS, stressed, drawn, strict=True)
    }
    convolutions = sum(body.convolutions for body in bodies)
    return InterfaceStress(stage.name, case, terms, planes, moments, convolutions)


def _drawn(
    settings: ContactStress, stressed: Sequence[Sequence[Stressed]], planes: Planes, peak: int
) -> list[list[Array | None]]:
    """Return the sections of all bodies by moment, None where no section is requested."""
    if settings.section == "none":
        return [[None for _ in bodies] for bodies in stressed]
    found = iter(sections([one for bodies in stressed for one in bodies], planes, peak))
    return [[next(found) for _ in bodies] for bodies in stressed]


def _moment(
    life: Life,
    stressed: Sequence[Stressed],
    drawn: Sequence[Array | None],
    done: Callable[[], None],
) -> ContactMoment:
    cycle = stressed[0][1].tractions
    known = cycle.unknown <= STUCK_SHARE
    stresses: dict[Literal[1, 2], BodyStress] = {}
    for one, section in zip(stressed, drawn, strict=True):
        mapped = life.parameter != "none" and known.any()
        stresses[one[0].number] = BodyStress(section, life_maps(life, one, known) if mapped else {})
        done()
    carried = tuple(bulk for *_, bulk in stressed if bulk is not None)
    return ContactMoment(stresses, carried, np.flatnonzero(~known))


def life_maps(life: Life, stressed: Stressed, known: Mask) -> dict[str, Array]:
    """Return maps of the parameter and its factors at the critical distance, by name.

    Stress is that of the ``known`` ``(t,)`` increments in all cycles of a mix; friction work is
    that of all increments in a mean cycle.
    """
    body, cycle, bulk = stressed
    if life.parameter == "ruiz":
        ruiz = Ruiz(mean_work(cycle.tractions), body.tension(cycle, bulk, life.depth, known))
        return {
            name: getattr(ruiz, name)
            for name in ("friction_parameter", "tension", "cracking_parameter")
        }
    history = body.history(cycle, bulk, life.depth, known)[known]
    return plane_maps(life, history, body.material)


def mean_work(cycle: CycleTractions) -> Array:
    """Return the friction work per area in a mean cycle, all increments ``(nx, ny)`` [N/mm]."""
    return np.tensordot(cycle.loads.share, cycle.work, 1)


def plane_maps(life: Life, history: Array, material: Material) -> dict[str, Array]:
    """Return maps of a critical-plane parameter for a stress ``history`` ``(t, 6, nx, ny)``."""
    if life.parameter == "findley":
        plane, amplitude = findley(history, life.sensitivity), "shear_amplitude"
    else:
        plane, amplitude = smith_watson_topper(history, material), "strain_amplitude"
    return {
        life.parameter: plane.value,
        amplitude: plane.amplitude,
        "normal_stress": plane.normal_stress,
        "normal": plane.normal,
    }


def _report_stick(unknown: Array, peak: int, reporter: Reporter) -> None:
    """Warn of increments with unknown shear, given its load share ``unknown`` ``(cycles, t)``."""
    why = "contact.method: normal does not know the shear where a contact sticks; full does"
    worst = unknown.max(axis=0)
    if worst[peak] > STUCK_SHARE:
        reporter.warn(
            f"up to {percent(worst[peak])} of the peak load sticks, so stress.section lacks its "
            f"shear, and stress.life the stress of that increment: {why}"
        )
    if count := int((worst > STUCK_SHARE).sum()):
        reporter.warn(
            f"stress.life leaves out {count} of {len(worst)} increments, in which up to "
            f"{percent(worst.max())} of the load sticks: {why}"
        )


def _report_carried(stress: InterfaceStress, reporter: Reporter) -> None:
    """Warn if the stress carried past a contact is unknown or inaccurate."""
    if not stress.bulk:
        reporter.warn(
            f"{stress.name}: too few nodes near the contact to know what the structure carries "
            "beyond the contact: the stress under it is that of its tractions alone; refine the "
            "mesh there"
        )
        return
    fits = [carried.rest for moment in stress.moments.values() for carried in moment.carried]
    if any(fit.coarse for fit in fits):
        left = max(fit.residual for fit in fits)
        reporter.warn(
            f"{stress.name}: what the structure carries beyond the contact is uncertain by "
            f"{percent(left)} of the deformation of half-spaces, and the stress under it may be "
            "wrong by as much, and twice as much near the ends of the face: refine the mesh of "
            "the contact face"
        )
