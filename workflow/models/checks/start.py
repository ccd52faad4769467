"""Check that a state to start from belongs to the model that is run from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

from sa_solver.errors import InputError
from wear.contact.face_loads import FaceLoads
from workflow.models.checks.digest import content_digest
from workflow.models.contact import Contact, Wear
from workflow.models.uncoupled.body_pair import BodyPair

# Wear settings that a resumed run may change: only its end depends on them.
FREE = ("cycles", "stop")


def origin_of(
    contacts: Mapping[str, Contact], wear: Wear, structure: Any, unworn: Sequence[FaceLoads]
) -> dict[str, str]:
    """Return digests of the parts of a model that its states depend on, by their names.

    ``contacts`` are those of the faces by name, ``unworn`` their loads. A structure counts by its
    description: its solution may differ by rounding.
    """
    settings = {f.name: getattr(wear, f.name) for f in fields(wear) if f.name not in FREE}
    loads: object = [(face.loads, face.slip) for face in unworn]
    if hasattr(structure, "meshed"):
        loads = structure.key, structure.load_cycles, structure.nonlinearity
    elif isinstance(structure, BodyPair):
        loads = structure.loads, structure.size, structure.tilt, structure.line, structure.peak
    parts = {"contacts": contacts, "wear settings": settings, "loads": loads}
    return {name: content_digest(part) for name, part in parts.items()}


def check_origin(found: Mapping[str, str], expected: Mapping[str, str]) -> None:
    """Raise InputError unless a state has the digests that those of the model have."""
    different = [name for name, digest in expected.items() if found.get(name) != digest]
    if different:
        raise InputError(
            f"the state to start from is of another model: its {' and '.join(different)} differ; "
            f"only {' and '.join(FREE)} of its wear may change"
        )
