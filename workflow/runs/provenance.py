"""Provenance of the results of a run: its case, the files that this names, and chosen settings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from workflow.case.sections import Case, files_of
from workflow.case.source import Source, read_text
from workflow.errors import CaseError
from workflow.kinds import load_case
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.folders.store import file_digest

# Entries that do not affect the results: pictures may be switched off before a run is resumed.
FREE = {"title", "output", "assumed", "measured", "expect"}


def provenance_of(folder: OutputFolder, case: Case) -> dict[str, Any]:
    """Return the provenance of a run of the case in its folder, as JSON values."""
    files: dict[str, str] = {}
    _add_files(case, files)
    return {
        "case": case_values(folder),
        "input_files": dict(sorted(files.items())),
        "choice": folder.choice,
    }


def case_values(folder: OutputFolder) -> dict[str, Any]:
    """Return the entries of the case in a folder that affect the results, as they are written."""
    written = Source(str(folder.case), read_text(folder.case)).data
    return {name: value for name, value in written.items() if name not in FREE}


def _add_files(case: Case, files: dict[str, str]) -> None:
    """Add the digests of the files that a case names, including those that its sub-cases name."""
    for file in files_of(case):
        if file not in files:
            files[file] = file_digest(Path(file))
            if file.endswith(".yaml"):
                try:
                    _add_files(load_case(file), files)
                except CaseError:
                    continue  # the code that needs the file reports it
