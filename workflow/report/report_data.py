"""Data of a finished run that its report is made from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from workflow.case.sections import Case


@dataclass(frozen=True)
class ReportData:
    """Finished run with the data for its report.

    ``case_text`` is the case as run and ``kind`` the name of its kind. ``input_files`` are digests
    of the files that it names, ``figures`` SVG texts by their names.
    """

    case: Case
    case_text: str
    kind: str
    summary: Mapping[str, Any]
    input_files: Mapping[str, str]
    figures: Mapping[str, str]
