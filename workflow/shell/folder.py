"""A run's output folder: whose it is, what the run wrote there, and what may be overwritten.

A run asks the folder by name for every entry that it makes, and says what it is. Its manifest has
them all before they are made: a later run removes what that names, and nothing else.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from itertools import chain, count
from pathlib import Path
from typing import Any

from workflow.case.sections import Case
from workflow.case.writing import dump_case
from workflow.errors import UserError
from workflow.shell.store import PARTIAL, file_digest, json_digest, write_json, write_text

MANIFEST = "manifest.json"
# What every run makes. Without a manifest no more than these can be told to be of a run.
CERTAIN = ("case.yaml", "summary.json", "results.h5", "checkpoint.h5", "run.log")
# Ending of what was there before under a name that a run asks for.
ASIDE = ".aside"
# Record of the settings that were chosen for a case, so that a resumed run knows it.
CHOICE = "fidelity.json"
# Entry of the summary by which a finished run is known to be as it was left; not of what is written
# to later, or by what a run knows itself.
DIGESTS = "digests"
NOT_DIGESTED = ("case.yaml", "summary.json", "checkpoint.h5", "run.log")


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

    def jump(self, number: int) -> Path:
        """File of one jump's fields."""
        return self.jumps / f"{number:05d}.h5"

    # --- what the run writes --------------------------------------------------------------------

    @property
    def manifest(self) -> dict[str, str] | None:
        """What the run wrote, or was about to write, by name; None where nothing tells."""
        try:
            listed = json.loads((self.root / MANIFEST).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        if not isinstance(listed, dict):
            return None
        return {name: str(what) for name, what in listed.items() if _is_entry(name)}

    def reserve(self, name: str, what: str) -> Path:
        """The path of a file or folder that the run is to make here; ``what`` says what it is.

        Something there that is not of the run is set aside under a name of its own.
        """
        path, listed = self.root / name, self.manifest or {}
        if name not in listed:
            if path.exists():
                path.rename(_free(path.with_name(name + ASIDE)))
            write_json(self.root / MANIFEST, listed | {name: what})
        return path

    def discard(self, name: str) -> None:
        """Remove what the run has no more use for."""
        _remove(self.root / name)
        listed = self.manifest or {}
        write_json(self.root / MANIFEST, {n: what for n, what in listed.items() if n != name})

    def reserve_state(self) -> None:
        """Make room for what a run needs to go on where it was cut off."""
        self.reserve("checkpoint.h5", "state after the last jump, for the run to go on from")
        self.reserve("jumps", "fields after each jump, until the run ends").mkdir(exist_ok=True)

    @property
    def lists_state(self) -> bool:
        """Whether the manifest names what a run needs to go on, which no other run may have."""
        return {self.checkpoint.name, self.jumps.name} <= (self.manifest or {}).keys()

    def reserve_log(self) -> Path:
        """The path of what the run says."""
        return self.reserve("run.log", "what the run said, and when")

    def write_summary(self, summary: Mapping[str, Any], provenance: Mapping[str, Any]) -> None:
        """Write the summary, which marks the run as finished, with digests of what belongs to it.

        These are the values of the case, the files that it names, what the run wrote, the summary.
        """
        path, names = self.reserve("summary.json", "numbers of the run"), self.manifest or {}
        written = {
            own.name: file_digest(own)
            for own in sorted(self.root.iterdir())
            if own.name in names.keys() - set(NOT_DIGESTED) and own.is_file()
        }
        case = {"case.yaml": json_digest(provenance["case"])}
        digests = case | provenance["input_files"] | written
        content = {**summary, DIGESTS: digests}
        write_json(path, content | {DIGESTS: digests | {"summary.json": json_digest(content)}})

    def read_summary(self) -> dict[str, Any]:
        """The summary of a finished run. Raises UserError unless it is as it was written."""
        try:
            summary = json.loads(self.summary.read_bytes())
            kept = summary[DIGESTS].pop("summary.json")
        except (ValueError, LookupError, TypeError, AttributeError):
            kept = None
        if kept is None or kept != json_digest(summary):
            raise UserError(f"{self.summary}: damaged, or of an older version; {self.again}")
        return summary

    def check_finished(self, case: Mapping[str, Any]) -> None:
        """Raise UserError unless a finished run is as it was left, and of the values of a case."""
        for name, kept in self.read_summary()[DIGESTS].items():
            path = self.root / name
            if kept != (json_digest(case) if path == self.case else file_digest(path)):
                raise UserError(f"{path}: not as the run in {self.root} had it; {self.again}")

    @property
    def again(self) -> str:
        """What to do where a run cannot be believed."""
        return f"start again with `fretscale run {self.case} --out {self.root} --force`"

    def keep_choice(self, record: Mapping[str, Any] | None) -> None:
        """Keep what was chosen for the case with the run until it is finished."""
        if record is not None:
            write_json(self.jumps / CHOICE, record)

    @property
    def choice(self) -> dict[str, Any] | None:
        """What was chosen for the case, of a run that is not finished yet; None for nothing."""
        path = self.jumps / CHOICE
        try:
            return json.loads(path.read_bytes()) if path.exists() else None
        except ValueError as error:
            raise UserError(f"{path}: damaged; {self.again}") from error

    # --- whose it is ----------------------------------------------------------------------------

    def claim(self, case: Case, force: bool, resumable: bool) -> list[str]:
        """Make the folder this run's own, removing what an earlier run left.

        Of an unfinished run of this case the runs of their own that it had made first stay. A run
        that is ``resumable`` keeps in ``jumps`` what it needs until it is finished. Returns the
        names of what stays where nothing tells whose it is.
        Raises :class:`UserError` if it holds anything of another case, an unfinished run, or what
        nothing tells whose it is, and ``force`` is not given.
        """
        if self.root.exists() and not self.root.is_dir():
            raise UserError(f"{self.root}: is a file; give a folder to --out")
        if not force:
            self._refuse_foreign(case)
        self.root.mkdir(parents=True, exist_ok=True)
        listed = self.manifest
        self._clear(dict.fromkeys(CERTAIN, "") if listed is None else listed, case)
        stays = [name for name in self._entries() if not name.startswith(".")]
        path = self.reserve("case.yaml", "the case as run, every default written out")
        write_text(path, dump_case(case))
        if resumable:
            self.reserve_state()
        return stays if listed is None else []

    def clear_partial(self) -> None:
        """Remove what a run that was killed had begun to write."""
        for path in [*self.root.glob(f".*{PARTIAL}*"), *self.root.glob(f"*/.*{PARTIAL}*")]:
            path.unlink()

    def _clear(self, listed: Mapping[str, str], case: Case) -> None:
        """Remove what an earlier run wrote, and list what of it stays."""
        broken_off = self._holds(case) and not self.summary.exists()
        kept = {
            name: what
            for name, what in listed.items()
            if broken_off and (self.root / name / MANIFEST).exists()
        }
        for name in listed.keys() - kept.keys():
            _remove(self.root / name)
        self.clear_partial()
        write_json(self.root / MANIFEST, kept)

    def _refuse_foreign(self, case: Case) -> None:
        if self.manifest is None and set(self._entries()) - {self.case.name}:
            what = "not empty and no run of fretscale"
            if self.case.exists():
                what = f"holds a run of an older version, which left no {MANIFEST} of its files"
            raise UserError(f"{self.root}: {what}; give another folder, or --force")
        if self.case.exists() and not self._holds(case):
            raise UserError(
                f"{self.root}: holds the results of another case; give another folder, or --force"
            )
        if not self.summary.exists() and self.checkpoint.exists():
            raise UserError(
                f"{self.root}: holds an unfinished run of this case; continue it with "
                f"`fretscale resume {self.root}`, or start again with --force"
            )

    def _entries(self) -> list[str]:
        """Names of what is there, but for the manifest."""
        if not self.root.exists():
            return []
        return sorted(path.name for path in self.root.iterdir() if path.name != MANIFEST)

    def _holds(self, case: Case) -> bool:
        """Whether the folder was claimed for this case."""
        return self.case.exists() and self.case.read_bytes() == dump_case(case).encode("utf-8")


def _is_entry(name: str) -> bool:
    """Whether it names something in a folder, and no more than a run makes there."""
    return bool(name) and not name.startswith(".") and Path(name).name == name


def _free(path: Path) -> Path:
    """The path, or the first with a number at its end that nothing has."""
    numbered = (path.with_name(f"{path.name}{number}") for number in count(2))
    return next(free for free in chain([path], numbered) if not free.exists())


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)
