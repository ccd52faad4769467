"""``check`` answers every mutant of the cases and templates, in time and with a place.

The numbers of the mutants are their seeds: ``Mutants(sources())[number]`` makes one again.
"""

from __future__ import annotations

import re
import shutil
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import CASES
from tests.marks import slow
from tests.workflow.case.mutants import Mutant, Mutants, sources
from tests.workflow.command_line import command
from workflow.case.text.writing import dump_case
from workflow.kinds import load_case, parse_case

# Seconds of a processor after which a check is taken for endless.
ENDLESS = 60.0
# Numbers of mutants in a test; tests of the quick part, and of all.
BLOCK, QUICK, ALL = 50, 2, 20
# What a line may be long, of any text that somebody may write.
LONGEST = 600

posix_only = pytest.mark.skipif(sys.platform == "win32", reason="has no alarm")


@pytest.fixture(scope="module")
def folder(template_files: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the files that cases and templates name."""
    place = tmp_path_factory.mktemp("mutants")
    for path in [*template_files.iterdir(), *CASES.glob("*.yaml")]:
        shutil.copy(path, place)
    return place


@pytest.fixture(scope="module")
def mutants() -> Mutants:
    return Mutants(sources())


def checked(mutant: Mutant, path: Path) -> Any:
    """Return how ``check`` ends; any exception except an exit is raised."""
    path.write_bytes(mutant.text)
    return command("check", path)


def faults(mutant: Mutant, path: Path) -> Iterator[str]:
    """Yield what is wrong with the answer to a mutant."""
    ended = checked(mutant, path)
    if ended.exit_code == 0:
        yield from _of_an_accepted_one(mutant, path, ended.stdout)
    elif ended.exit_code == 4:
        if not re.search(r"needs about .* GB of memory, .*: .*\b[a-z_]+\.[a-z_]+", ended.stderr):
            yield f"no remedy: {ended.stderr}"
    elif ended.exit_code == 2:
        yield from _of_a_refusal(path, ended.stderr)
    else:
        yield f"exit code {ended.exit_code}"


def _of_a_refusal(path: Path, printed: str) -> Iterator[str]:
    """Yield faults of a refusal; every line must name a line, a file or an override."""
    lines = printed.removesuffix("\n").split("\n")
    place = re.compile(rf"fretscale: ({re.escape(str(path))}(:\d+)?|--set .*?): \S")
    yield from (f"no place: {line}" for line in lines if not place.match(line))
    yield from (f"unprintable: {line!r}" for line in lines if not line.isprintable())
    yield from (f"too long: {line}" for line in lines if len(line) > LONGEST)
    if len(lines) > 25:
        yield f"{len(lines)} lines"


def _of_an_accepted_one(mutant: Mutant, path: Path, printed: str) -> Iterator[str]:
    """Yield faults of an accepted case; it must have only numbers and be read back unchanged."""
    outline = printed.partition("\n")[2]
    if re.search(r"\b(nan|inf|None)\b", outline):
        yield f"no numbers: {outline}"
    case = load_case(path)
    if parse_case(dump_case(case), str(path)) != case:
        yield "another case once it is written"


@posix_only
@pytest.mark.parametrize("block", [block if block < QUICK else slow(block) for block in range(ALL)])
def test_wrong_cases_are_refused_with_their_place(
    block: int, folder: Path, mutants: Mutants
) -> None:
    for number in range(block * BLOCK, (block + 1) * BLOCK):
        mutant = mutants[number]
        try:
            with alarm(ENDLESS):
                found = list(faults(mutant, folder / "mutant.yaml"))
        except (Exception, TooLong) as error:
            raise AssertionError(f"mutant {number}: {mutant.reported}") from error
        assert not found, f"mutant {number}: {mutant.reported}"


class TooLong(BaseException):
    """Exception that ends slow work and is no error that a command would report in a line."""


@contextmanager
def alarm(seconds: float) -> Iterator[None]:
    """Raise TooLong in work that exceeds a processor time, however busy the machine is."""

    def late(*_: object) -> None:
        raise TooLong

    before = signal.signal(signal.SIGPROF, late)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


# --- runs -----------------------------------------------------------------------------------------
