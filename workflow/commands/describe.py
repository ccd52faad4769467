"""``fretscale describe``: what a case may name of a mesh or CAD file."""

from __future__ import annotations

from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from fe_models.geometry.imported import describe_bodies, read_bodies
from fe_models.mesh import MeshError
from workflow.case.sections import Length
from workflow.errors import UserError


def described_file(file: Path, size: str | None) -> list[str]:
    """Lines that list what a mesh or CAD file has; ``size`` with its unit. Raises UserError."""
    try:
        return describe_bodies(read_bodies(file, None if size is None else _length(size)))
    except MeshError as error:
        raise UserError(str(error)) from error


def _length(text: str) -> float:
    """A length in mm. Raises UserError."""
    value = float(text) if text.replace(".", "", 1).isdecimal() else text
    try:
        return TypeAdapter(Length).validate_python(value)
    except ValidationError as error:
        raise UserError(f"--size: {error.errors()[0]['msg']}") from error
