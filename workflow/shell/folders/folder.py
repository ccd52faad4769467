"""Output folder of a command: its owner, its contents, and what may be overwritten.

A run requests every entry of the folder by name and describes it. The manifest lists each entry
before it is made; only the files in subfolders that the run fills are listed afterwards. A later
run removes what the manifest names and nothing else, and never follows a link. Other files that
are in the way are renamed.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from itertools import chain, count
from pathlib import Path, PurePath
from shlex import quote
from typing import Any

from workflow.case.sections import Case
from workflow.case.text.writing import dump_case
from workflow.errors import FolderTaken, RunChanged
from workflow.shell.folders.lock import LOCK, locked
from workflow.shell.folders.store import (
    PARTIAL_NAME,
    file_digest,
    json_digest,
    read_bytes,
    write_json,
    write_text,
)

MANIFEST = "manifest.json"
REPORT = "report.html"
# Key of the manifest below which it lists our files: other programs write such manifests too.
OURS = "fretscale"
# Entries that show the progress of a run; foreign files with these names would be mistaken for it.
TELLING = ("summary.json", "checkpoint.h5", "jumps")
# Ending that is added to a foreign file whose name a run needs.
ASIDE = ".aside"
# Record of the settings that were chosen for a case, so that a resumed run knows it.
CHOICE = "choice.json"
# Entry of the summary with digests, by which changes to a finished run are detected. It excludes
# files that are written later and files that the digests are stored in or checked against.
DIGESTS = "digests"
NOT_DIGESTED = ("case.yaml", "summary.json", "checkpoint.h5", "run.log", REPORT)
# Folder of intermediate files that a run removes at its end; too many to be listed one by one.
STATE = "jumps"
STATE_FILE = re.compile(rf"\d+\.h5|{re.escape(CHOICE)}")


class OutputFolder:
    """Paths of the files of a run; commands of another ``kind`` have a separate list of entries."""

    def __init__(self, root: Path, kind: str = "run") -> None:
        self.root = root
        self._kind = kind
        self.case = root / "case.yaml"
        self.summary = root / "summary.json"
        self.results = root / "results.h5"
        self.checkpoint = root / "checkpoint.h5"
        self.log = root / "run.log"
        self.jumps = root / STATE

    def jump(self, number: int) -> Path:
        """Return the path of one file of steps."""
        return self.jumps / f"{number:05d}.h5"

    # --- what the run writes --------------------------------------------------------------------

    @property
    def manifest(self) -> dict[str, str] | None:
        """Descriptions of the entries of the run by name; None if there is no manifest."""
        listed = self._manifests.get(self._kind)
        return None if listed is None else {n: w for n, w in listed.items() if _is_entry(n)}

    @property
    def _manifests(self) -> dict[str, dict[str, str]]:
        """Manifests of all kinds of command in this folder."""
        try:
            ours = json.loads(read_bytes(self.root / MANIFEST))[OURS]
            return {kind: {name: str(ours[kind][name]) for name in ours[kind]} for kind in ours}
        except (OSError, ValueError, TypeError, LookupError):
            return {}

    def _list(self, listed: Mapping[str, str]) -> None:
        manifests = self._manifests
        if not manifests:
            self._set_aside(MANIFEST)
        self.root.mkdir(parents=True, exist_ok=True)
        write_json(self.root / MANIFEST, {OURS: manifests | {self._kind: dict(listed)}})

    def _set_aside(self, name: str) -> None:
        path = self.root / name
        if os.path.lexists(path):
            path.rename(_free(path.with_name(path.name + ASIDE)))

    def reserve(self, name: str, what: str) -> Path:
        """Return the path of a file or folder that the run will make, described by ``what``.

        An entry of that name that does not belong to the run is renamed.
        """
        listed = self.manifest or {}
        if name not in listed:
            self._set_aside(name)
            self._list(listed | {name: what})
        return self.root / name

    def replace(self, entries: Mapping[str, str], force: bool) -> list[Path]:
        """Return the paths of several entries. Raises UserError if one exists, unless ``force``."""
        there = [path for name in entries if os.path.lexists(path := self.root / name)]
        if there and not force:
            raise FolderTaken(f"{there[0]}: exists; give another folder, or --force")
        return [self.reserve(name, what) for name, what in entries.items()]

    @contextmanager
    def filling(self, name: str, what: str) -> Iterator[Path]:
        """Yield a folder of the run, and list the files written there in the manifest.

        The folder is removed if it stays empty.
        """
        folder = self.reserve(name, what)
        folder.mkdir(exist_ok=True)
        before = self._files(folder)
        try:
            yield folder
        finally:
            written = sorted(file for file, _ in self._files(folder) - before)
            self._list((self.manifest or {}) | dict.fromkeys(written, what))
            if not any(folder.iterdir()):
                self.discard(name)

    def _files(self, folder: Path) -> set[tuple[str, int]]:
        """Return the names of the files below a folder, each with its modification time."""
        files = [path for path in folder.rglob("*") if path.is_file()]
        return {(f.relative_to(self.root).as_posix(), f.stat().st_mtime_ns) for f in files}

    def discard(self, name: str) -> None:
        """Remove an entry that the run no longer needs."""
        self._remove(name)
        self._list({n: what for n, what in (self.manifest or {}).items() if n != name})

    def reserve_state(self) -> None:
        """Reserve the entries that the run needs in order to resume."""
        self.reserve("checkpoint.h5", "state of the run, from which it can continue")
        self.reserve(STATE, "results of the run so far").mkdir(exist_ok=True)

    def discard_state(self) -> None:
        """Remove the intermediate files, and the entry of a checkpoint that was never written.

        The manifest entry of the intermediate files is removed last: while it exists, the removal
        is known to be incomplete.
        """
        listed = self.manifest or {}
        if self.checkpoint.name in listed and not self.checkpoint.exists():
            self.discard(self.checkpoint.name)
        if self.jumps.name in listed:
            self.discard(self.jumps.name)

    @property
    def has_leftovers(self) -> bool:
        """True if a finished run was interrupted before it had removed all its temporary files."""
        lock = os.path.lexists(self.root / LOCK)
        return lock or STATE in (self.manifest or {}) or any(True for _ in self._partial())

    def clear_leftovers(self) -> None:
        """Remove the temporary files that a finished run did not remove, except for its lock."""
        self.clear_partial()
        self.discard_state()

    @property
    def lists_state(self) -> bool:
        """True if the manifest names the entries needed to resume; only resumable runs have any."""
        return {self.checkpoint.name, self.jumps.name} <= (self.manifest or {}).keys()

    def reserve_log(self) -> Path:
        """Return the path of the log."""
        return self.reserve("run.log", "messages of the run, with times")

    def reserve_report(self) -> Path:
        """Return the path of the report."""
        return self.reserve(REPORT, "report of the run on one page")

    def write_summary(self, summary: Mapping[str, Any]) -> None:
        """Write the summary, which marks the run as finished."""
        write_json(self.reserve("summary.json", "results, in numbers"), summary)

    def finish(self, summary: Mapping[str, Any], provenance: Mapping[str, Any]) -> None:
        """Write the summary of a run with digests of everything that belongs to it.

        The digests cover the values of the case, the input files, the files that the run wrote and
        the summary.
        """
        names = (self.manifest or {}).keys() - set(NOT_DIGESTED)
        paths = [path for path in sorted(self.root.iterdir()) if path.name in names]
        written = {path.name: file_digest(path) for path in paths if path.is_file()}
        case = {"case.yaml": json_digest(provenance["case"])}
        digests = case | provenance["input_files"] | written
        content = {**summary, DIGESTS: digests}
        self.write_summary(content | {DIGESTS: digests | {"summary.json": json_digest(content)}})

    def read_summary(self) -> dict[str, Any]:
        """Return the summary of a finished run. Raises UserError if it has changed since."""
        try:
            summary = json.loads(read_bytes(self.summary))
            kept = summary[DIGESTS].pop("summary.json")
        except (ValueError, LookupError, TypeError, AttributeError):
            kept = None
        if kept is None or kept != json_digest(summary):
            raise RunChanged(f"{self.summary}: damaged, or of an older version; {self.again}")
        return summary

    def check_run(self) -> None:
        """Raise UserError if the folder contains no run."""
        if not self.case.exists():
            raise RunChanged(f"{self.root}: no run of fretscale here (case.yaml is missing)")

    def check_ended(self) -> None:
        """Raise UserError if the folder contains no run or an unfinished one."""
        self.check_run()
        if not self.summary.exists():
            how = f"start it again with `{self.run_command}`"
            if self.lists_state:
                how = f"continue with `{self.resume_command}`"
            raise RunChanged(f"{self.root}: this run is not finished; {how}")

    def check_finished(self, case: Mapping[str, Any]) -> None:
        """Raise UserError if a file of the finished run or the values of its case have changed."""
        for name, kept in self.read_summary()[DIGESTS].items():
            self._check(name, kept, case)

    def check_results(self, case: Mapping[str, Any]) -> None:
        """Raise UserError if the case or the results have changed; input files may be missing."""
        digests = self.read_summary()[DIGESTS]
        for path in (self.case, self.results):
            self._check(path.name, digests.get(path.name), case)

    def _check(self, name: str, kept: str | None, case: Mapping[str, Any]) -> None:
        path = self.root / name
        if kept != (json_digest(case) if path == self.case else file_digest(path)):
            raise RunChanged(f"{path}: differs from the run in {self.root}; {self.again}")

    @property
    def run_command(self) -> str:
        """Shell command that runs the case of this folder again."""
        return f"fretscale run {quote(str(self.case))} --out {quote(str(self.root))}"

    @property
    def resume_command(self) -> str:
        """Shell command that resumes the run in this folder."""
        return f"fretscale resume {quote(str(self.root))}"

    @property
    def again(self) -> str:
        """Advice for a run whose files cannot be trusted."""
        return f"start again with `{self.run_command} --force`"

    def keep_choice(self, record: Mapping[str, Any] | None) -> None:
        """Store the settings chosen for the case until the run is finished."""
        if record is not None:
            write_json(self.jumps / CHOICE, record)

    @property
    def choice(self) -> dict[str, Any] | None:
        """Settings chosen for the case of an unfinished run; None if none were chosen."""
        path = self.jumps / CHOICE
        try:
            return json.loads(read_bytes(path)) if path.exists() else None
        except ValueError as error:
            raise RunChanged(f"{path}: damaged; {self.again}") from error

    # --- owner ----------------------------------------------------------------------------------

    def claim(self, case: Case, force: bool, resumable: bool) -> list[str]:
        """Take the folder for this run, and remove the files of an earlier run.

        If the earlier run is an unfinished run of the same case, the sub-runs that it made are not
        removed. A ``resumable`` run stores what it needs to resume in ``jumps`` until it is
        finished. Returns the names of the entries that remain although their owner is unknown.
        Raises :class:`UserError`, and removes nothing, if the folder holds anything of another
        case, an unfinished run, or entries of an unknown owner, and ``force`` is not given.
        """
        if not force:
            self._refuse_other(case)
        listed = self.manifest
        broken_off = self._holds(case) and not self.summary.exists()
        self._clear(keep_runs=broken_off)
        stays = [name for name in self._entries() if not name.startswith(".")]
        for name in TELLING:
            self._set_aside(name)
        path = self.reserve("case.yaml", "the case as run, every default written out")
        write_text(path, dump_case(case))
        if resumable:
            self.reserve_state()
        return stays if listed is None else []

    def clear_partial(self) -> None:
        """Remove the partly written files of a run that was killed."""
        for path in list(self._partial()):
            path.unlink()

    def _partial(self) -> Iterator[Path]:
        """Yield the partly written files of the run."""
        listed = [self.root / name for name in self.manifest or {} if not self._is_run(name)]
        walks = map(os.walk, [path for path in listed if not path.is_symlink()])
        for folder in [self.root, *(Path(place) for place, _, _ in chain.from_iterable(walks))]:
            yield from (p for p in folder.glob(".*") if PARTIAL_NAME.fullmatch(p.name))

    def _clear(self, keep_runs: bool) -> None:
        """Remove the files of an earlier run, optionally except its sub-runs; list what remains."""
        self.clear_partial()
        listed = self.manifest or {}
        kept = {name: what for name, what in listed.items() if keep_runs and self._is_run(name)}
        # Files before their folders.
        for name in sorted(listed.keys() - kept.keys(), reverse=True):
            self._remove(name)
        self._list(kept)

    def _remove(self, name: str) -> None:
        """Remove a file of the run, or a folder if it is then empty; never follow a link."""
        path, above = self.root / name, [self.root / part for part in PurePath(name).parents][:-1]
        if any(folder.is_symlink() for folder in above):
            return
        if path.is_symlink() or not path.is_dir():
            path.unlink(missing_ok=True)
        elif self._is_run(name):
            with locked(path):
                OutputFolder(path)._clear(keep_runs=False)
                (path / MANIFEST).unlink()
        elif name == STATE:
            for file in path.iterdir():
                if STATE_FILE.fullmatch(file.name):
                    file.unlink()
        for folder in [path, *above]:
            with suppress(OSError):  # not empty, or no folder
                folder.rmdir()

    def _is_run(self, name: str) -> bool:
        """Return whether the entry is a run with a manifest."""
        return OutputFolder(self.root / name).manifest is not None

    def refuse_foreign(self, remedy: str = "") -> None:
        """Raise UserError if the folder holds entries of an unknown owner."""
        if self.manifest is None and self._entries():
            what = f"not empty and no {self._kind} of fretscale; give another folder{remedy}"
            raise FolderTaken(f"{self.root}: {what}")

    def _refuse_other(self, case: Case) -> None:
        self.refuse_foreign(", or --force")
        if self.case.exists() and not self._holds(case):
            raise FolderTaken(
                f"{self.root}: holds the results of another case; give another folder, or --force"
            )
        if not self.summary.exists() and self.checkpoint.exists():
            raise FolderTaken(
                f"{self.root}: holds an unfinished run of this case; continue it with "
                f"`{self.resume_command}`, or start again with --force"
            )

    def _entries(self) -> list[str]:
        """Return the names of all entries except those that a killed command of ours may leave."""
        if not self.root.exists():
            return []
        ours = {LOCK} if self.manifest is None else {LOCK, MANIFEST}
        names = sorted(path.name for path in self.root.iterdir())
        return [name for name in names if name not in ours and not PARTIAL_NAME.fullmatch(name)]

    def _holds(self, case: Case) -> bool:
        """Return whether the folder was claimed for this case."""
        return self.case.exists() and read_bytes(self.case) == dump_case(case).encode("utf-8")


def _is_entry(name: str) -> bool:
    """Return whether ``name`` is a visible relative path, as the entries of a run are."""
    path = PurePath(name)
    hidden = any(part.startswith(".") for part in path.parts)
    return bool(path.parts) and not hidden and not path.is_absolute() and str(path) == name


def _free(path: Path) -> Path:
    """Return the path, or the first one with a number appended that does not exist."""
    numbered = (path.with_name(f"{path.name}{number}") for number in count(2))
    return next(free for free in chain([path], numbered) if not os.path.lexists(free))
