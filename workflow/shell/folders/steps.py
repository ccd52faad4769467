"""Storage of the steps of a run on disk, from which an interrupted run resumes.

Finished steps are appended to files of ``jumps``, each with some seconds of work. A run may record
files of its own there, such as the fields after a jump. The checkpoint ties these files together
and holds the states that marches have reached. A resumed run executes its
code from the start, but reads the results of finished steps instead of computing them. Warm starts,
caches and counters therefore develop as before, and the first computed step starts from the same
state as in the interrupted run. The result of a new step is returned as it would be read from disk,
including its memory order.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np

from workflow.case.text.plain import counted
from workflow.errors import RunChanged, UserError
from workflow.shell.analysis import Run
from workflow.shell.folders import checkpoint
from workflow.shell.folders.checkpoint import StoredState
from workflow.shell.folders.packing import PackingError, packed, unpacked
from workflow.shell.folders.store import read_arrays, write_arrays

T = TypeVar("T")
# Place of a step: the place of the enclosing step, followed by its number within that step.
Place = tuple[int, ...]

# Largest share of the time that saving may take; packing takes about as much again.
SHARE = 0.005
# Assumed seconds of the first save, so that a run of four seconds stores nothing.
FIRST_SAVE = 0.02
# Names of the arrays with the places of steps, the ends of their results, and the results.
PLACES, ENDS, VALUES = "places", "ends", "values"
# Attribute of the checkpoint: the number of steps computed so far.
STEPS = "steps"


@contextmanager
def resumable_steps(run: Run[Any]) -> Iterator[RunSteps]:
    """Yield the steps of a run, which return the stored results of an earlier process first.

    Finished steps are saved however the run ends, unless an error of the disk ends it. Raises
    UserError if the stored steps are of another version.
    """
    steps = RunSteps(run)
    try:
        yield steps
    except OSError:
        raise
    except BaseException:
        steps.save()
        raise
    steps.report()


class StoredSteps(ABC):
    """Steps whose results are stored: see :class:`sa_solver.steps.Steps`.

    A subclass saves them. ``kept`` are the results of earlier steps, and ``marches`` the states
    that marches have reached.
    """

    def __init__(self, kept: dict[Place, bytes], marches: dict[Place, bytes]) -> None:
        self._kept, self._marches = kept, marches
        # Results that are not saved yet, in the order of their steps.
        self._new: dict[Place, bytes] = {}
        self._above: Place = ()
        self._count = self._computed = 0
        self._saved, self._cost = time.perf_counter(), FIRST_SAVE

    def __call__(self, name: str, step: Callable[[], T]) -> T:
        place = self._next()
        if place in self._kept:
            value: T = self._read(self._kept.pop(place), name)
            return value
        warned = len(self._warnings())
        self._compute()
        with self._inside(place):
            value = step()
        return self._keep(self._new, place, name, value, warned)

    def march(self, name: str, state: T, advance: Callable[[T], T | None]) -> T:
        place, number = self._next(), 0
        if place in self._kept:
            last: T = self._read(self._kept.pop(place), name)
            return last
        warned, marches = len(self._warnings()), self._marches
        for begun in [begun for begun in marches if begun[:-1] == place]:
            number, state = begun[-1], self._read(marches[begun], name)
        while True:
            self._compute()
            with self._inside((*place, number)):
                following = advance(state)
            if following is None:
                return self._keep(self._new, place, name, state, warned)
            number += 1
            state = self._keep(marches, (*place, number), name, following, warned)

    def save(self) -> None:
        """Save the results that are not saved yet."""
        begun = time.perf_counter()
        self._write()
        self._saved = time.perf_counter()
        self._cost = self._saved - begun

    # -- of a subclass ------------------------------------------------------------------------
    @abstractmethod
    def _write(self) -> None:
        """Write the results that are not saved yet."""

    @abstractmethod
    def _of_another_version(self, wrong: object) -> UserError:
        """Return the error about stored steps that are not those of this run."""

    def _compute(self) -> None:  # noqa: B027 - a run need not know
        """Handle that the next step is computed and not restored."""

    def _warnings(self) -> list[str]:
        """Return the warnings so far; those of a step are stored with it."""
        return []

    def _repeat(self, line: str) -> None:  # noqa: B027 - without warnings
        """Repeat a warning of a restored step."""

    def _spend(self, seconds: float) -> None:  # noqa: B027 - a run need not know
        """Count the seconds that storing a step has taken."""

    # -- places -------------------------------------------------------------------------------
    def _next(self) -> Place:
        """Return the place of the next step."""
        self._count += 1
        return (*self._above, self._count - 1)

    @contextmanager
    def _inside(self, place: Place) -> Iterator[None]:
        """Nest the given steps under ``place``."""
        outside = self._above, self._count
        self._above, self._count = place, 0
        try:
            yield
        finally:
            self._above, self._count = outside

    # -- results of steps ---------------------------------------------------------------------
    def _keep(self, among: dict[Place, bytes], place: Place, name: str, value: T, warned: int) -> T:
        """Store the result of a step and its warnings, in place of the steps within it."""
        begun = time.perf_counter()
        data, faithful = packed((name, value, self._warnings()[warned:]))
        inside = place[:-1] if among is self._marches else place
        for steps in (self._new, self._marches):
            while steps and _within(last := next(reversed(steps)), inside):
                del steps[last]
        among[place] = data
        self._computed += 1
        if begun - self._saved > self._cost / SHARE:
            self.save()
        self._spend(time.perf_counter() - begun)
        if faithful:
            return value
        handed_on: T = self._read(data, name)
        return handed_on

    def _read(self, data: bytes, name: str) -> Any:
        """Return the result of a step and repeat its warnings. Raises UserError for other steps."""
        try:
            written, value, warnings = unpacked(data)
        except PackingError as error:
            raise self._of_another_version(error) from error
        if written != name:
            raise self._of_another_version(f"{written} in the place of {name}")
        for line in warnings:
            self._repeat(line)
        return value


class RunSteps(StoredSteps):
    """Steps of a run that are stored in its folder."""

    def __init__(self, run: Run[Any]) -> None:
        self._folder, self._reporter, self._provenance = run.folder, run.reporter, run.provenance
        self._files = [] if run.kept is None else list(run.kept.jumps)
        try:
            self._before = 0 if run.kept is None else int(run.kept.attributes[STEPS])
            marches = {} if run.kept is None else unjoined(run.kept.arrays)
        except KeyError as error:
            raise self._of_another_version(error) from error
        super().__init__(self._of_files(marches), marches)
        self._going_on = False
        if run.kept is not None:
            run.reporter.say(f"  continues after {counted(self._before, 'step')}")

    def record(self, number: int, arrays: Mapping[str, Any], attributes: Mapping[str, Any]) -> None:
        """Write the file of this ``number``, in place of later ones that an interruption left."""
        digest = write_arrays(self._folder.jump(number), arrays, attributes)
        self._files[number:] = [digest]

    def report(self) -> None:
        """Log how many steps this process has computed."""
        self._reporter.log(f"steps: {self._computed} computed, {self._before} resumed")

    def save(self) -> None:
        if self._new or self._marches:
            super().save()

    def _write(self) -> None:
        if self._new:
            path = self._folder.jump(len(self._files))
            self._files.append(write_arrays(path, joined(self._new)))
            self._new.clear()
        steps = {STEPS: self._before + self._computed}
        state = StoredState(joined(self._marches), steps, self._files)
        checkpoint.save(self._folder, state, self._provenance)

    def _compute(self) -> None:
        """Tell the reporter, before the first computed step, that earlier ones were restored."""
        if self._before and not self._going_on:
            self._going_on = True
            self._reporter.goes_on()

    def _warnings(self) -> list[str]:
        return self._reporter.warnings

    def _repeat(self, line: str) -> None:
        self._reporter.repeat(line)

    def _spend(self, seconds: float) -> None:
        spent = self._reporter.seconds
        spent["checkpoints"] = spent.get("checkpoints", 0.0) + seconds

    def _of_another_version(self, wrong: object) -> UserError:
        of = f"{self._folder.jumps}: of another version of fretscale"
        return RunChanged(f"{of} ({wrong}); {self._folder.again}")

    def _of_files(self, marches: Mapping[Place, bytes]) -> dict[Place, bytes]:
        """Return the stored results of steps."""
        kept: dict[Place, bytes] = {}
        for number in range(len(self._files)):
            arrays, _ = read_arrays(self._folder.jump(number))
            if PLACES in arrays:
                kept |= unjoined(arrays)
        return outermost(kept, marches)


def outermost(kept: Mapping[Place, bytes], marches: Mapping[Place, bytes]) -> dict[Place, bytes]:
    """Return the results of steps that are not within a step whose result is stored.

    Steps of a march before the state that it has reached are left out as well.
    """
    reached = {place[:-1]: place for place in marches}

    def counts(place: Place) -> bool:
        above = [place[:length] for length in range(1, len(place))]
        known = any(step in kept for step in above)
        return not known and all(reached.get(step) in (None, *above) for step in above)

    return {place: data for place, data in kept.items() if counts(place)}


def _within(place: Place, other: Place) -> bool:
    return place[: len(other)] == other


# --- on disk ------------------------------------------------------------------------------------


def joined(steps: Mapping[Place, bytes]) -> dict[str, Any]:
    """Return the results of steps as arrays, one after the other."""
    lengths = [len(data) for data in steps.values()]
    return {
        PLACES: np.array([".".join(map(str, place)) for place in steps], dtype="S"),
        ENDS: np.cumsum(lengths, dtype=np.int64),
        VALUES: np.frombuffer(b"".join(steps.values()), dtype=np.uint8),
    }


def unjoined(arrays: Mapping[str, Any]) -> dict[Place, bytes]:
    """Return the results of steps from the arrays of :func:`joined`."""
    places = [tuple(map(int, place.split(b"."))) for place in arrays[PLACES].tolist()]
    ends, values = arrays[ENDS].tolist(), arrays[VALUES].tobytes()
    spans = pairwise([0, *ends])
    return {place: values[begin:end] for place, (begin, end) in zip(places, spans, strict=True)}
