"""Common part of the files of all fits: a measured table, and the names of its columns."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from workflow.case.fields import File
from workflow.case.sections import Section, entry

Heading = Annotated[str, Field(min_length=1)]
Csv = Annotated[str, File((".csv",))]
KIND = "joint_evolution, joint_law, wear_coefficient or wear_profiles"


class Measurement(Section):
    """Measured table."""

    file: Csv = entry("CSV, headings with units, path from this folder", "measured.csv")
