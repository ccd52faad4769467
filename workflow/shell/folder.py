"""A command's output folder: whose it is, what was written there, and what may be overwritten.

A run asks the folder by name for every entry that it makes, and says what it is. Its manifest has
them before they are made, but for the files in the folders that it fills, which are listed
afterwards. A later run removes what the manifest names and nothing else, through no link; what is
in its way is set aside.
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
from workflow.case.writing import dump_case
from workflow.errors import UserError
from workflow.shell.lock import LOCK, locked
from workflow.shell.store import (
    PARTIAL_NAME,
    file_digest,
    json_digest,
    read_bytes,
    write_json,
    write_text,
)

MANIFEST = "manifest.json"
REPORT = "report.html"
# Key of the manifest below which it lists what is ours: other programs have such files too.
OURS = "fretscale"
# What says how far a run is: left by somebody else, it would be taken for that of a run.
TELLING = ("summary.json", "checkpoint.h5", "jumps")
# Ending of what was there before under a name that a run asks for.
ASIDE = ".aside"
# Record of the settings that were chosen for a case, so that a resumed run knows it.
CHOICE = "choice.json"
# Entry of the summary by which a finished run is known to be as it was left; not of what is written
# to later, or by what a run knows itself.
DIGESTS = "digests"
NOT_DIGESTED = ("case.yaml", "summary.json", "checkpoint.h5", "run.log", REPORT)
# What a run keeps of itself until it ends; too many to be listed one by one.
STATE = "jumps"
STATE_FILE = re.compile(rf"\d+\.h5|{re.escape(CHOICE)}")


class OutputFolder:
    """Paths of a run's files; other commands, of another ``kind``, have entries of their own."""

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
        """File of one jump's fields."""
        return self.jumps / f"{number:05d}.h5"

    # --- what the run writes --------------------------------------------------------------------

    @property
    def manifest(self) -> dict[str, str] | None:
        """What the run wrote, or was about to write, by name; None where nothing tells."""
        listed = self._manifests.get(self._kind)
        return None if listed is None else {n: w for n, w in listed.items() if _is_entry(n)}

    @property
    def _manifests(self) -> dict[str, dict[str, str]]:
        """The same of all kinds."""
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
        """The path of a file or folder that the run is to make here; ``what`` says what it is.

        Something there that is not of the run is set aside under a name of its own.
        """
        listed = self.manifest or {}
        if name not in listed:
            self._set_aside(name)
            self._list(listed | {name: what})
        return self.root / name

    def replace(self, entries: Mapping[str, str], force: bool) -> list[Path]:
        """The paths of several. Raises UserError where one is there, unless ``force``."""
        there = [path for name in entries if os.path.lexists(path := self.root / name)]
        if there and not force:
            raise UserError(f"{there[0]}: exists; give another folder, or --force")
        return [self.reserve(name, what) for name, what in entries.items()]

    @contextmanager
    def filling(self, name: str, what: str) -> Iterator[Path]:
        """A folder of the run; the files that are written there meanwhile are listed.

        One that stays empty is removed.
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
        """Names of the files below a folder, with the moment when each was written."""
        files = [path for path in folder.rglob("*") if path.is_file()]
        return {(f.relative_to(self.root).as_posix(), f.stat().st_mtime_ns) for f in files}

    def discard(self, name: str) -> None:
        """Remove what the run has no more use for."""
        self._remove(name)
        self._list({n: what for n, what in (self.manifest or {}).items() if n != name})

    def reserve_state(self) -> None:
        """Make room for what a run needs to go on where it was cut off."""
        self.reserve("checkpoint.h5", "how far the run has come, for it to go on from")
        self.reserve(STATE, "what the run has found so far, until it ends").mkdir(exist_ok=True)

    def discard_state(self) -> None:
        """Remove what the run has found on the way, and the name of a state that it never kept.

        The name of what it has found goes last: it tells that this was cut off.
        """
        listed = self.manifest or {}
        if self.checkpoint.name in listed and not self.checkpoint.exists():
            self.discard(self.checkpoint.name)
        if self.jumps.name in listed:
            self.discard(self.jumps.name)

    @property
    def has_leftovers(self) -> bool:
        """Whether a finished run was cut off before it had removed all that it removes."""
        lock = os.path.lexists(self.root / LOCK)
        return lock or STATE in (self.manifest or {}) or any(True for _ in self._partial())

    def clear_leftovers(self) -> None:
        """Remove what a finished run had no time to remove, but for its lock."""
        self.clear_partial()
        self.discard_state()

    @property
    def lists_state(self) -> bool:
        """Whether the manifest names what a run needs to go on, which no other run may have."""
        return {self.checkpoint.name, self.jumps.name} <= (self.manifest or {}).keys()

    def reserve_log(self) -> Path:
        """The path of what the run says."""
        return self.reserve("run.log", "what the run said, and when")

    def reserve_report(self) -> Path:
        """The path of the page that tells all of the run."""
        return self.reserve(REPORT, "all of the run on one page, for people")

    def write_summary(self, summary: Mapping[str, Any]) -> None:
        """Write the summary, which marks the run as finished."""
        write_json(self.reserve("summary.json", "what came out, in numbers"), summary)

    def finish(self, summary: Mapping[str, Any], provenance: Mapping[str, Any]) -> None:
        """Write the summary of a run with digests of what belongs to it.

        These are the values of the case, the files that it names, what the run wrote, the summary.
        """
        names = (self.manifest or {}).keys() - set(NOT_DIGESTED)
        paths = [path for path in sorted(self.root.iterdir()) if path.name in names]
        written = {path.name: file_digest(path) for path in paths if path.is_file()}
        case = {"case.yaml": json_digest(provenance["case"])}
        digests = case | provenance["input_files"] | written
        content = {**summary, DIGESTS: digests}
        self.write_summary(content | {DIGESTS: digests | {"summary.json": json_digest(content)}})

    def read_summary(self) -> dict[str, Any]:
        """The summary of a finished run. Raises UserError unless it is as it was written."""
        try:
            summary = json.loads(read_bytes(self.summary))
            kept = summary[DIGESTS].pop("summary.json")
        except (ValueError, LookupError, TypeError, AttributeError):
            kept = None
        if kept is None or kept != json_digest(summary):
            raise UserError(f"{self.summary}: damaged, or of an older version; {self.again}")
        return summary

    def check_run(self) -> None:
        """Raise UserError where there is no run."""
        if not self.case.exists():
            raise UserError(f"{self.root}: no run of fretscale here (case.yaml is missing)")

    def check_ended(self) -> None:
        """Raise UserError where there is no run, or one that is not finished."""
        self.check_run()
        if not self.summary.exists():
            how = f"start it again with `{self.run_command}`"
            if self.lists_state:
                how = f"go on with `{self.resume_command}`"
            raise UserError(f"{self.root}: this run is not finished; {how}")

    def check_finished(self, case: Mapping[str, Any]) -> None:
        """Raise UserError unless a finished run is as it was left, and of the values of a case."""
        for name, kept in self.read_summary()[DIGESTS].items():
            self._check(name, kept, case)

    def check_results(self, case: Mapping[str, Any]) -> None:
        """The same of its case and results; of its input files only their paths may be left."""
        digests = self.read_summary()[DIGESTS]
        for path in (self.case, self.results):
            self._check(path.name, digests.get(path.name), case)

    def _check(self, name: str, kept: str | None, case: Mapping[str, Any]) -> None:
        path = self.root / name
        if kept != (json_digest(case) if path == self.case else file_digest(path)):
            raise UserError(f"{path}: not as the run in {self.root} had it; {self.again}")

    @property
    def run_command(self) -> str:
        """What runs its case anew here, for a shell."""
        return f"fretscale run {quote(str(self.case))} --out {quote(str(self.root))}"

    @property
    def resume_command(self) -> str:
        """What goes on with the run here, for a shell."""
        return f"fretscale resume {quote(str(self.root))}"

    @property
    def again(self) -> str:
        """What to do where a run cannot be believed."""
        return f"start again with `{self.run_command} --force`"

    def keep_choice(self, record: Mapping[str, Any] | None) -> None:
        """Keep what was chosen for the case with the run until it is finished."""
        if record is not None:
            write_json(self.jumps / CHOICE, record)

    @property
    def choice(self) -> dict[str, Any] | None:
        """What was chosen for the case, of a run that is not finished yet; None for nothing."""
        path = self.jumps / CHOICE
        try:
            return json.loads(read_bytes(path)) if path.exists() else None
        except ValueError as error:
            raise UserError(f"{path}: damaged; {self.again}") from error

    # --- whose it is ----------------------------------------------------------------------------

    def claim(self, case: Case, force: bool, resumable: bool) -> list[str]:
        """Make the folder this run's own, removing what an earlier run left.

        Of an unfinished run of this case the runs of their own that it had made first stay. A run
        that is ``resumable`` keeps in ``jumps`` what it needs until it is finished. Returns the
        names of what stays where nothing tells whose it is.
        Raises :class:`UserError` if it holds anything of another case, an unfinished run, or what
        nothing tells whose it is, and ``force`` is not given; nothing of that is removed.
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
        """Remove what a run that was killed had begun to write."""
        for path in list(self._partial()):
            path.unlink()

    def _partial(self) -> Iterator[Path]:
        """The files that it had begun to write."""
        listed = [self.root / name for name in self.manifest or {} if not self._is_run(name)]
        walks = map(os.walk, [path for path in listed if not path.is_symlink()])
        for folder in [self.root, *(Path(place) for place, _, _ in chain.from_iterable(walks))]:
            yield from (p for p in folder.glob(".*") if PARTIAL_NAME.fullmatch(p.name))

    def _clear(self, keep_runs: bool) -> None:
        """Remove what an earlier run wrote, but for runs of their own; list what of it stays."""
        self.clear_partial()
        listed = self.manifest or {}
        kept = {name: what for name, what in listed.items() if keep_runs and self._is_run(name)}
        # Files before their folders.
        for name in sorted(listed.keys() - kept.keys(), reverse=True):
            self._remove(name)
        self._list(kept)

    def _remove(self, name: str) -> None:
        """Remove a file of the run, or a folder that has nothing else; nothing through a link."""
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
        """Whether it is a run of its own."""
        return OutputFolder(self.root / name).manifest is not None

    def refuse_foreign(self, remedy: str = "") -> None:
        """Leave alone what nothing of ours has made. Raises UserError."""
        if self.manifest is None and self._entries():
            what = f"not empty and no {self._kind} of fretscale; give another folder{remedy}"
            raise UserError(f"{self.root}: {what}")

    def _refuse_other(self, case: Case) -> None:
        self.refuse_foreign(", or --force")
        if self.case.exists() and not self._holds(case):
            raise UserError(
                f"{self.root}: holds the results of another case; give another folder, or --force"
            )
        if not self.summary.exists() and self.checkpoint.exists():
            raise UserError(
                f"{self.root}: holds an unfinished run of this case; continue it with "
                f"`{self.resume_command}`, or start again with --force"
            )

    def _entries(self) -> list[str]:
        """Names of what is there, but for what any command of ours leaves, killed early even."""
        if not self.root.exists():
            return []
        ours = {LOCK} if self.manifest is None else {LOCK, MANIFEST}
        names = sorted(path.name for path in self.root.iterdir())
        return [name for name in names if name not in ours and not PARTIAL_NAME.fullmatch(name)]

    def _holds(self, case: Case) -> bool:
        """Whether the folder was claimed for this case."""
        return self.case.exists() and read_bytes(self.case) == dump_case(case).encode("utf-8")


def _is_entry(name: str) -> bool:
    """Whether it names something in a folder, and no more than a run makes there."""
    path = PurePath(name)
    hidden = any(part.startswith(".") for part in path.parts)
    return bool(path.parts) and not hidden and not path.is_absolute() and str(path) == name


def _free(path: Path) -> Path:
    """The path, or the first with a number at its end that nothing has."""
    numbered = (path.with_name(f"{path.name}{number}") for number in count(2))
    return next(free for free in chain([path], numbered) if not os.path.lexists(free))
