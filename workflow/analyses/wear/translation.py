"""Translation of a wear case into a model: one function for each section."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from sa_solver.errors import InputError
from wear.contact.interface import InterfaceContact
from wear.schedule import JumpSize, Stop
from workflow.analyses.wear.case.base import WearCase
from workflow.errors import UserError
from workflow.models.contact import Contact, FaceContact, Wear, WearStepper
from workflow.models.loads import ContactFace
from workflow.models.structure import StructureLoads
from workflow.models.structure_model import StructureModel
from workflow.models.wear import Structure, WearModel
from workflow.shell.folders.cache import DiskStore

AnyWearCase = TypeVar("AnyWearCase", bound=WearCase)


def model_with(case: WearCase, structure: Structure) -> WearModel:
    """Return the model of a case with this structure: contacts, wear and stress."""
    names = case.contact_names
    contacts: Contact | dict[str, Contact] = contact_of(case, names[0])
    if len(names) > 1:
        contacts = {name: contact_of(case, name) for name in names}
    return WearModel(structure, contacts, wear_of(case), case.stress.described())


def contact_of(case: WearCase, name: str) -> Contact:
    """Return the contact with this name."""
    terms, settings = case.terms(name), case.contact
    return Contact(
        grid=terms.grid,
        bodies=terms.materials,
        laws=(terms.laws[0].described(), terms.laws[1].described()),
        friction=terms.friction.described(),
        method=settings.method,
        link=settings.link,
        gross_slip=settings.gross_slip,
        tolerance=case.contact_tolerance,
    )


def wear_of(case: WearCase) -> Wear:
    """Return the wear settings of a case, including when loads are updated."""
    wear, step, coupling = case.wear, case.wear.step, case.recoupling
    return Wear(
        cycles=wear.cycles,
        steps=step.kind,
        tolerance=wear.tolerance,
        depth_tolerance=wear.depth_tolerance,
        jump=JumpSize(step.cycles, step.depth, step.volume),
        fraction=step.fraction,
        stop=Stop(wear.stop.depth, wear.stop.volume),
        resultants=coupling.resultants,
        drift=coupling.drift,
        motion=wear.motion,
    )


def face_contact(
    case: WearCase, face: ContactFace, stepper: WearStepper | None = None
) -> FaceContact:
    """Return the half-space contact of a face.

    It wears by the steps of the case unless others are given.
    """
    check_section(case, face)
    contact = contact_of(case, face.face.name)
    return FaceContact(face, contact, wear_of(case), InterfaceContact, stepper)


def structure_loads(
    case: AnyWearCase, model: Callable[[AnyWearCase], StructureModel]
) -> StructureLoads:
    """Return the loads of the structure that ``model`` returns for a case.

    Its condensed parts are stored in the user's cache.
    """
    return StructureLoads(model(case), lambda name: case.terms(name).friction.at(0.0), DiskStore())


def check_section(case: WearCase, face: ContactFace) -> None:
    """Raise UserError for a section of the stress that could not be drawn at the end."""
    try:
        case.stress.described().check(face.grid(case.terms(face.face.name).grid))
    except InputError as error:
        raise UserError(f"stress.{error}") from error
