"""A run's output folder: whose it is, and what may be overwritten."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from workflow.case.sections import Case
from workflow.case.writing import dump_case
from workflow.errors import UserError
from workflow.shell.store import PARTIAL, replacing

FILES = ("case.yaml", "summary.json", "results.h5", "worn.msh", "checkpoint.h5", "run.log")
# Worn surfaces at the nodes of another code, and tangential loops, by interface; curves of cases in
# time, by state, and of vibration cases, by force.
TABLES = (
    *("worn_nodes_*.csv", "loops_*.csv", "evolution.csv", "loop_*.csv"),
    *("frequency_response_*.csv", "ring_down_*.csv", "frf_*.csv", "backbone.csv"),
    "force_sweep_*.csv",
)
# Record of the settings that were chosen for a case, so that a resumed run knows it.
CHOICE = "fidelity.json"
FOLDERS = ("jumps", "reduced", "paraview", "figures", "wear")


class OutputFolder:
    """Paths of a run's files."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.case = root / "case.yaml"
        self.summary = root / "summary.json"
        self.results = root / "results.h5"
        self.checkpoint = root / "checkpoint.h5"
        self.log = root / "run.log"
        self.jumps = root / "jumps"
        self.reduced = root / "reduced"
        self.paraview = root / "paraview"
        self.figures = root / "figures"
        self.wear = root / "wear"  # a run of its own

    def jump(self, number: int) -> Path:
        """File of one jump's fields."""
        return self.jumps / f"{number:05d}.h5"

    def claim(self, case: Case, force: bool, resumable: bool) -> None:
        """Make the folder this run's own, removing what an earlier run left.

        Of an unfinished run of this case the wear that it had computed first stays. A run that is
        ``resumable`` keeps in ``jumps`` what it needs until it is finished.
        Raises :class:`UserError` if it holds anything of another case, or an unfinished run, and
        ``force`` is not given.
        """
        if self.root.exists() and not self.root.is_dir():
            raise UserError(f"{self.root}: is a file; give a folder to --out")
        if self.root.is_dir() and any(self.root.iterdir()) and not force:
            self._refuse_foreign(case)
        self.root.mkdir(parents=True, exist_ok=True)
        broken_off = self._holds(case) and not self.summary.exists()
        for name in FILES:
            (self.root / name).unlink(missing_ok=True)
        for pattern in TABLES:
            for path in self.root.glob(pattern):
                path.unlink()
        for name in FOLDERS:
            if not (broken_off and name == self.wear.name):
                shutil.rmtree(self.root / name, ignore_errors=True)
        self.clear_partial()
        if resumable:
            self.jumps.mkdir()
        with replacing(self.case) as partial:
            partial.write_text(dump_case(case), encoding="utf-8")

    def clear_partial(self) -> None:
        """Remove what a run that was killed had begun to write."""
        for path in [*self.root.glob(f".*{PARTIAL}*"), *self.root.glob(f"*/.*{PARTIAL}*")]:
            path.unlink()

    def write_summary(self, summary: Mapping[str, Any]) -> None:
        """Write the summary, which marks the run as finished."""
        with replacing(self.summary) as partial:
            partial.write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")

    def _refuse_foreign(self, case: Case) -> None:
        if not self.case.exists():
            raise UserError(
                f"{self.root}: not empty and no run of fretscale; give another folder, or --force"
            )
        if not self._holds(case):
            raise UserError(
                f"{self.root}: holds the results of another case; give another folder, or --force"
            )
        if not self.summary.exists() and self.checkpoint.exists():
            raise UserError(
                f"{self.root}: holds an unfinished run of this case; continue it with "
                f"`fretscale resume {self.root}`, or start again with --force"
            )

    def _holds(self, case: Case) -> bool:
        """Whether the folder was claimed for this case."""
        return self.case.exists() and self.case.read_text(encoding="utf-8") == dump_case(case)

    def keep_choice(self, record: Mapping[str, Any] | None) -> None:
        """Keep what was chosen for the case with the run until it is finished."""
        if record is not None:
            (self.jumps / CHOICE).write_text(json.dumps(record), encoding="utf-8")

    @property
    def choice(self) -> dict[str, Any] | None:
        """What was chosen for the case, of a run that is not finished yet; None for nothing."""
        path = self.jumps / CHOICE
        record: dict[str, Any] | None = None
        if path.exists():
            record = json.loads(path.read_text(encoding="utf-8"))
        return record

    def read_summary(self) -> dict[str, Any]:
        """The summary of a finished run."""
        summary: dict[str, Any] = json.loads(self.summary.read_text(encoding="utf-8"))
        return summary
