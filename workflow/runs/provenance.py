"""What the numbers of a run come from: its case, the files that this names, what was chosen."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from workflow.case.sections import Case, files_of
from workflow.case.source import Source, read_text
from workflow.errors import CaseError
from workflow.kinds import load_case
from workflow.shell.folder import OutputFolder
from workflow.shell.store import file_digest

# Entries that no number depends on: pictures may be switched off before a run goes on.
FREE = {"title", "output", "assumed", "measured", "expect"}


def provenance_of(folder: OutputFolder, case: Case) -> dict[str, Any]:
    """Of a run of the case in its folder, in what JSON can say."""
    files: dict[str, str] = {}
    _add_files(case, files)
    return {
        "case": case_values(folder),
        "input_files": dict(sorted(files.items())),
        "choice": folder.choice,
    }


def case_values(folder: OutputFolder) -> dict[str, Any]:
    """The entries of the case in a folder that its numbers depend on, as they are written there."""
    written = Source(str(folder.case), read_text(folder.case)).data
    return {name: value for name, value in written.items() if name not in FREE}


def _add_files(case: Case, files: dict[str, str]) -> None:
    """The digests of files that a case names, and of those that cases among them name."""
    for file in files_of(case):
        if file not in files:
            files[file] = file_digest(Path(file))
            if file.endswith(".yaml"):
                try:
                    _add_files(load_case(file), files)
                except CaseError:
                    continue  # whoever needs it says so, and why
