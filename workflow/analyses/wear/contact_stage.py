"""The contact of one face as a case describes it: the library's, and what is written of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from fe_models.meshes.structure_mesh import Face
from fe_models.meshes.transfer import FaceTransfer
from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.contact import NormalContact
from sa_solver.types import Array, ElasticPair, Grid, LoadHistory
from wear.contact.interface import InterfaceContact, InterfaceState
from wear.contact.link import Link
from wear.contact.settings import InterfaceSettings
from wear.contact.tractions import CycleTractions
from wear.steps.implicit import ImplicitStepper, SecondOrderStepper
from wear.steps.steppers import ErrorControl, ExplicitStepper, Stepper, step_errors
from wear.steps.stepping import WearingContact, WearState
from workflow.analyses.wear.case.base import ContactTerms, WearCase
from workflow.analyses.wear.case.sections import ContactStress, Duration
from workflow.analyses.wear.contact_loops import WornLoop, worn_loop
from workflow.analyses.wear.load_source import ContactFace
from workflow.errors import UserError

WearStepper = Stepper[WearState, WearingContact]


@dataclass(frozen=True)
class ContactEnd:
    """A cycle on the surfaces that a run ends with.

    Its ``tractions``, and the ``pressure_of_companion`` ``(t, nx, ny)`` [MPa] on the surfaces that
    steps of twice the length leave; None where nothing is told by that.
    """

    tractions: CycleTractions
    pressure_of_companion: Array | None


class ContactStage(InterfaceContact):
    """One face of a case on its grid.

    ``remedy`` is what to do where the contact reaches the border of that, ``coarse_grid`` another
    with as many cells as the face has nodes. It wears by the ``stepper`` of the case unless another
    is given.
    """

    transfer: FaceTransfer

    def __init__(
        self, case: WearCase, contact: ContactFace, stepper: WearStepper | None = None
    ) -> None:
        grid = contact.grid(case.terms(contact.face.name).grid)
        _check_section(case.stress, grid)
        self._case, self._contact_face, self.face = case, contact, contact.face
        self.remedy, self.coarse_grid = contact.remedy, contact.grid(contact.coarse)
        transfer = FaceTransfer.between(contact.face, grid)
        super().__init__(_interface(case, contact, transfer, stepper or stepper_of(case.wear)))

    def coarse_pressure(self, loads: LoadHistory, link: Link, peak: int) -> Array:
        """Unworn peak pressure on a grid as coarse as the mesh of the structure."""
        contact = NormalContact(HalfSpace(self.coarse_grid, self.pair))
        grid = self.coarse_grid
        gap = gap_on(self._contact_face, grid) + link.lift(peak, grid.centres)
        load = self.settings.drive.pressing(loads, peak)
        return contact.solve(gap, **load, start=None, compliance=None).pressure

    def face_of(self, body: Literal[1, 2]) -> Face:
        """The face of one body, with its own nodes."""
        return self.face.face(body)

    def transfer_of(self, body: Literal[1, 2]) -> FaceTransfer:
        """Transfer between the face of one body and the grid."""
        face = self.face_of(body)
        return self.transfer if face is self.face else FaceTransfer.between(face, self.grid)

    def depths_of_bodies(self, state: InterfaceState) -> tuple[Array, Array]:
        """Worn depths of body 1 and body 2 at the nodes of their own faces, volumes kept."""
        surfaces = state.surfaces
        to_1 = self.transfer_of(1)
        return to_1.to_nodes(surfaces.depth_1), self.transfer.to_nodes(surfaces.depth_2)

    def seen(self, state: InterfaceState, increment: int) -> InterfaceState:
        """What :meth:`fields` of an increment need of a state: a tenth where slips are given."""
        if self.settings.method == "full":
            return state
        starts = {t: start for t, start in state.starts.items() if t == increment}
        return replace(state, starts=starts, coarse=None)

    def end(self, state: InterfaceState) -> ContactEnd:
        """A cycle on the surfaces of a state that a run ends with."""
        companion, pressure = state.coarse, None
        if step_errors(state, self.areas) is not None and isinstance(companion, InterfaceState):
            pressure = self.tractions(companion).pressure
        return ContactEnd(self.tractions(state), pressure)

    def loop(self, state: InterfaceState, peak: int) -> WornLoop:
        """The tangential loop that the case asks for, on the present surfaces."""
        contact, lift = self.frictional(state.energy), state.link.lift(peak, self.transfer.places)
        tilt = self.settings.drive.tilt
        return worn_loop(contact, self._case.loops, self.name, state, peak, tilt, lift)


def _interface(
    case: WearCase, contact: ContactFace, transfer: FaceTransfer, stepper: WearStepper
) -> InterfaceSettings:
    """A face and how it wears, as the library takes it."""
    grid, settings, terms = transfer.grid, case.contact, case.terms(contact.face.name)
    return InterfaceSettings(
        name=contact.face.name,
        grid=grid,
        gap=gap_on(contact, grid),
        transfer=transfer,
        pair=ElasticPair(*terms.materials),
        laws=(terms.laws[0].described(), terms.laws[1].described()),
        friction=terms.friction.at,
        stepper=stepper,
        method="full" if settings.method == "full" else "normal",
        gross_slip=settings.gross_slip,
        drive=contact.drive,
        follow=_follow(case, terms),
        link=settings.link,
        tolerance=settings.tolerance,
    )


def gap_on(contact: ContactFace, grid: Grid) -> Array:
    """Unworn gap of a face on a grid over it ``(nx, ny)`` [mm]."""
    gap = contact.gap(grid.x, grid.y)
    return np.ascontiguousarray(np.broadcast_to(gap, grid.shape))


def _follow(case: WearCase, terms: ContactTerms) -> bool | None:
    """Whether to follow surfaces that move over each other; None: where that counts."""
    follow = {"auto": None, "follow": True, "neglect": False}[case.wear.motion]
    if follow is None and getattr(terms.laws[0], "coefficient", None) == 0.0:
        return False  # what does not wear looks the same everywhere
    return follow


def stepper_of(wear: Duration) -> WearStepper:
    """What advances the surfaces of a contact, as the case asks for."""
    step = wear.step
    if step.kind == "explicit":
        return ExplicitStepper(step.fraction)
    control = error_control(wear)
    return ImplicitStepper(control) if step.kind == "implicit" else SecondOrderStepper(control)


def error_control(wear: Duration) -> ErrorControl | None:
    """What chooses the length of steps, None where the case does."""
    if not wear.step.automatic:
        return None
    relative = wear.tolerance if wear.depth_tolerance is None else None
    return ErrorControl(relative, wear.depth_tolerance)


def _check_section(stress: ContactStress, grid: Grid) -> None:
    """Refuse at once a section that could not be drawn at the end."""
    if stress.section == "none":
        return
    if stress.section == "y" and grid.line:
        raise UserError("stress.section: y: a line contact has no length along y; allowed: x, none")
    reach = 0.5 * grid.size[1 if stress.section == "x" else 0]
    if abs(stress.at) > reach:
        raise UserError(
            f"stress.at: {stress.at:g} mm is off the contact's grid; "
            f"allowed: {-reach:.4g} to {reach:.4g} mm"
        )
