"""Stress under the contacts, and where fretting cracks would start, on unworn and worn surfaces.

Both follow from the tractions of the half-space, with each body as a separate half-space: the
stress that the structure carries past the contact is not in them. The surface itself is left out,
since stress there hangs on the grid where shear starts at a slipping edge: sections begin, and maps
lie, at the case's critical distance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fe_models.elasticity import von_mises
from sa_solver.subsurface import COMPONENTS, SubsurfaceStress
from sa_solver.ties import first_largest
from sa_solver.types import Array, Grid, Material
from wear.interface import CycleTractions
from wear.life import Ruiz, findley, ruiz, smith_watson_topper
from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.case.sections import ContactStress, Life
from workflow.analyses.wear.contact_stage import ContactStage
from workflow.analyses.wear.layout import MOMENTS
from workflow.analyses.wear.load_source import BODIES
from workflow.shell.dataset import Dataset
from workflow.shell.reporter import Reporter
from workflow.shell.results import ResultsWriter

# Share of the load whose shear may be unknown. A hole in the shear makes stress of the order of µp
# at its rim, whatever its size; the cells at the edge of a sliding contact that find no slipping
# node of the structure stay below this.
STUCK_SHARE = 0.01

LEFT_OUT = "increments without full knowledge of the shear, not in the life map"

# What the summary has of Ruiz's maps; of others the parameter's own.
RUIZ = ("cracking_parameter", "friction_parameter", "tension")


@dataclass(frozen=True)
class BodyStress:
    """Stress of one body under one contact.

    ``section`` ``(6, n, k)`` [MPa] at peak load, None without a section; ``maps`` of the fretting
    parameter over the face by their names in ``results.h5``, each ``(..., nx, ny)``.
    """

    section: Array | None
    maps: dict[str, Dataset]


@dataclass(frozen=True)
class ContactMoment:
    """Both bodies under one contact, unworn or worn.

    ``left_out`` are the increments, counted from 0, whose shear is not known (see
    :class:`wear.interface.CycleTractions`) and that the maps do without.
    """

    bodies: tuple[BodyStress, BodyStress]
    left_out: np.ndarray


class Planes:
    """Where the stress of a contact is looked at: the section's points and the depth of maps."""

    def __init__(self, settings: ContactStress, grid: Grid) -> None:
        self.settings = settings
        self.grid = grid
        centres = grid.x.ravel(), grid.y.ravel()
        along = 1 if settings.section == "y" else 0
        across = centres[1 - along]
        self.along = centres[along]
        self.at = float(across[np.argmin(np.abs(across - settings.at))])
        first, share = settings.life.depth, np.linspace(0.0, 1.0, settings.points)
        self.depths: Array = first + (settings.depth - first) * share**2

    def section(self, stress: SubsurfaceStress, traction: Array) -> Array | None:
        """Stress ``(6, n, k)`` in the section under ``traction`` ``(3, nx, ny)``."""
        axis = self.settings.section
        if axis == "none":
            return None
        return stress.section(traction, axis, self.at, self.depths)


@dataclass(frozen=True)
class InterfaceStress:
    """Stress under one contact; ``moments`` by the names in ``MOMENTS``."""

    name: str
    case: WearCase
    planes: Planes
    moments: dict[str, ContactMoment]
    convolutions: int

    @property
    def mapped(self) -> bool:
        """Whether there are maps of the fretting parameter."""
        return all(body.maps for moment in self.moments.values() for body in moment.bodies)

    def write(self, writer: ResultsWriter) -> None:
        """Sections into ``stress/section``, maps into ``stress/life``, by interface."""
        if self.planes.settings.section != "none":
            self._write_section(writer, f"stress/section/{self.name}")
        if self.mapped:
            self._write_life(writer, f"stress/life/{self.name}")

    def _write_section(self, writer: ResultsWriter, group: str) -> None:
        planes = self.planes
        axes = {
            "along": Dataset(planes.along, "mm", "centres of the section's cells, along its axis"),
            "depths": Dataset(planes.depths, "mm", "of the section's points below the surface"),
        }
        attributes = {"axis": planes.settings.section, "at": planes.at, "components": COMPONENTS}
        limits = {n: self.case.material(n).yield_stress for n in BODIES}
        attributes |= {f"yield_stress_{n}": y for n, y in limits.items() if np.isfinite(y)}
        writer.put(group, axes, **attributes)
        for moment, contact in self.moments.items():
            for number, body in enumerate(contact.bodies, start=1):
                assert body.section is not None
                writer.put(f"{group}/{moment}/body_{number}", _section(body.section))

    def _write_life(self, writer: ResultsWriter, group: str) -> None:
        for moment, contact in self.moments.items():
            writer.put(f"{group}/{moment}", {"left_out": Dataset(contact.left_out, "1", LEFT_OUT)})
            for number, body in enumerate(contact.bodies, start=1):
                writer.put(f"{group}/{moment}/body_{number}", body.maps)
        life = self.planes.settings.life
        writer.put(group, {}, parameter=life.parameter, depth=life.depth)

    def summary(self) -> dict[str, Any]:
        """Largest values, where they are, and worn over unworn, by body."""
        numbers: dict[str, Any] = {"convolutions": self.convolutions}
        if self.planes.settings.section != "none":
            numbers["von_mises"] = self._of_bodies(self._largest_von_mises)
        if not self.mapped:
            return numbers
        numbers["left_out"] = {m: len(contact.left_out) for m, contact in self.moments.items()}
        parameter = self.planes.settings.life.parameter
        for name in RUIZ if parameter == "ruiz" else (parameter,):
            numbers[name] = self._of_bodies(
                lambda body, name=name: self._largest(body.maps[name].values)
            )
        return numbers

    def _of_bodies(self, largest: Any) -> dict[str, Any]:
        numbers = {}
        for number, name in enumerate(self.case.bodies):
            values = {m: largest(moment.bodies[number]) for m, moment in self.moments.items()}
            before, after = (values[moment]["value"] for moment in MOMENTS)
            numbers[name] = values | {"ratio": after / before if before else None}
        return numbers

    def _largest_von_mises(self, body: BodyStress) -> dict[str, float]:
        assert body.section is not None
        values, planes = von_mises(body.section), self.planes
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
    contacts: Sequence[tuple[ContactStage, tuple[CycleTractions, CycleTractions]]],
    reporter: Reporter,
) -> list[InterfaceStress]:
    """Stress under all ``contacts`` as the case asks for it.

    Each has its tractions in an unworn and a worn cycle; ``peak`` is the increment of peak load.
    """
    unknown = [cycle.unknown for _, cycles in contacts for cycle in cycles]
    _report_stick(np.array(unknown), peak, reporter)
    return [_interface_stress(case, peak, *contact) for contact in contacts]


def _interface_stress(
    case: WearCase,
    peak: int,
    stage: ContactStage,
    cycles: tuple[CycleTractions, CycleTractions],
) -> InterfaceStress:
    planes = Planes(case.stress, stage.grid)
    materials = case.material(1), case.material(2)
    # Each keeps the symbols of a depth: one per body serves both moments.
    solvers = [SubsurfaceStress(stage.grid, materials[n - 1], n) for n in BODIES]
    moments = {}
    for moment, cycle in zip(MOMENTS, cycles, strict=True):
        known = cycle.unknown <= STUCK_SHARE
        body_1, body_2 = (
            BodyStress(
                planes.section(solver, _traction(cycle, peak)),
                life_maps(case.stress.life, solver, material, cycle, known),
            )
            for solver, material in zip(solvers, materials, strict=True)
        )
        moments[moment] = ContactMoment((body_1, body_2), np.flatnonzero(~known))
    convolutions = sum(solver.count for solver in solvers)
    return InterfaceStress(stage.name, case, planes, moments, convolutions)


def _section(stress: Array) -> dict[str, Dataset]:
    """Stress ``(6, n, k)`` in a section, and its equivalent."""
    what = "xx, yy, zz, xy, yz, zx in the section at peak load under the contact's tractions alone"
    return {
        "stress": Dataset(stress, "MPa", what),
        "von_mises": Dataset(von_mises(stress), "MPa", "von Mises stress at peak load"),
    }


def _traction(cycle: CycleTractions, t: int) -> Array:
    """Tractions qx, qy, p of an increment ``(3, nx, ny)``."""
    return np.concatenate([cycle.shear[t], cycle.pressure[t, None]])


def life_maps(
    life: Life,
    solver: SubsurfaceStress,
    material: Material,
    cycle: CycleTractions,
    known: np.ndarray,
) -> dict[str, Dataset]:
    """Maps of the parameter and of what it is made of, at the critical distance, by name.

    Stress is that of the ``known`` ``(t,)`` increments, of all cycles of a mix together; friction
    work that of all in a mean cycle. Where no increment is known there is no map.
    """
    if life.parameter == "none" or not known.any():
        return {}
    history = np.zeros((len(known), 6, *solver.grid.shape))
    for t in np.flatnonzero(known & cycle.pressure.any(axis=(1, 2))):
        history[t] = solver.at_depth(_traction(cycle, int(t)), life.depth)
    if life.parameter == "ruiz":
        # Without stress, an increment adds its work and leaves the largest tension as it is.
        return _ruiz_maps(ruiz(history, np.tensordot(cycle.loads.share, cycle.work, 1)))
    if life.parameter == "findley":
        plane = findley(history[known], life.sensitivity)
        what = "shear stress amplitude plus k largest normal stress, worst plane"
        amplitude = "shear_amplitude", "MPa", "amplitude of the shear stress on the worst plane"
    else:
        plane = smith_watson_topper(history[known], material)
        what = "largest normal stress times strain amplitude, worst plane"
        amplitude = "strain_amplitude", "1", "amplitude of the normal strain on the worst plane"
    name, unit, of_amplitude = amplitude
    largest = "largest normal stress over a cycle on the worst plane"
    normal = "unit normal of the worst plane, in the interface frame"
    return {
        life.parameter: Dataset(plane.value, "MPa", what),
        name: Dataset(plane.amplitude, unit, of_amplitude),
        "normal_stress": Dataset(plane.normal_stress, "MPa", largest),
        "normal": Dataset(plane.normal, "1", normal),
    }


def _ruiz_maps(parameters: Ruiz) -> dict[str, Dataset]:
    work = "Ruiz's F1: a quarter of the friction work of a cycle per area"
    tension = "largest tension along the surface over a cycle, under the contact's tractions alone"
    cracking = "Ruiz's F2: F1 times tension"
    return {
        "friction_parameter": Dataset(parameters.friction_parameter, "N/mm", work),
        "tension": Dataset(parameters.tension, "MPa", tension),
        "cracking_parameter": Dataset(parameters.cracking_parameter, "N^2/mm^3", cracking),
    }


def _report_stick(unknown: Array, peak: int, reporter: Reporter) -> None:
    """Say where the shear is not known, ``unknown`` ``(cycles, t)``; warn if so at peak load."""
    why = "contact.method: normal does not know the shear where a contact sticks; full does"
    worst = unknown.max(axis=0)
    if worst[peak] > STUCK_SHARE:
        reporter.warn(
            f"up to {worst[peak]:.0%} of the peak load sticks: stress.section lacks its shear, and "
            f"stress.life that increment's stress: {why}"
        )
    if count := int((worst > STUCK_SHARE).sum()):
        reporter.log(
            f"stress.life leaves out the stress of {count} of {len(worst)} increments, in which up "
            f"to {worst.max():.0%} of the load sticks: {why}"
        )
