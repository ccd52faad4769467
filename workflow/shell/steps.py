"""The steps of a run on the disk, for one that is cut off to go on from.

Finished steps are appended, some seconds of work to a file of ``jumps``; the checkpoint ties them
together and has the states that marches have reached. A resumed run executes its code from the
start, but takes what a step gave from there instead of computing it: warm starts, caches and
tallies come about as they did, and the first step that is computed begins with what the run
that was cut off had. What a step gives is handed on as it would be read, in memory order too.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np

from workflow.case.plain import counted
from workflow.errors import UserError
from workflow.shell import checkpoint
from workflow.shell.analysis import Run
from workflow.shell.checkpoint import StoredState
from workflow.shell.packing import PackingError, packed, unpacked
from workflow.shell.store import read_arrays, write_arrays

T = TypeVar("T")
# Place of a step: its number among those of the step that it belongs to, below that one's place.
Place = tuple[int, ...]

# Of the time before a save, what the last one took at most; packing takes about as much again.
SHARE = 0.005
# Seconds that the first one is taken to need: a run of four seconds keeps nothing.
FIRST_SAVE = 0.02
# Name of the entry that has the places of steps, and of those that have what the steps gave.
PLACES, ENDS, VALUES = "places", "ends", "values"
# Attribute of the checkpoint: how many steps have been taken to get there.
STEPS = "steps"


@contextmanager
def kept_steps(run: Run[Any]) -> Iterator[RunSteps]:
    """The steps of a run, those that an earlier process has kept first.

    Whatever ends the run, its finished steps are kept, unless the disk is what ends it. Raises
    UserError where they are those of another version.
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


class RunSteps:
    """Takes the steps of a run: see :class:`sa_solver.steps.Steps`."""

    def __init__(self, run: Run[Any]) -> None:
        self._folder, self._reporter, self._provenance = run.folder, run.reporter, run.provenance
        self._files = [] if run.kept is None else list(run.kept.jumps)
        self._before = 0 if run.kept is None else int(run.kept.attributes[STEPS])
        self._marches = {} if run.kept is None else _unjoined(run.kept.arrays)
        self._kept = self._of_files()
        # What has not been brought to the disk yet, those last taken last.
        self._new: dict[Place, bytes] = {}
        self._above: Place = ()
        self._count = self._computed = 0
        self._going_on = False
        self._saved, self._cost = time.perf_counter(), FIRST_SAVE
        if run.kept is not None:
            run.reporter.say(f"  goes on after {counted(self._before, 'step')}")

    def __call__(self, name: str, step: Callable[[], T]) -> T:
        place = self._next()
        if place in self._kept:
            value: T = self._read(self._kept.pop(place), name)
            return value
        warned = len(self._reporter.warnings)
        self._compute()
        with self._inside(place):
            value = step()
        return self._keep(self._new, place, name, value, warned)

    def march(self, name: str, state: T, advance: Callable[[T], T | None]) -> T:
        place, number = self._next(), 0
        if place in self._kept:
            last: T = self._read(self._kept.pop(place), name)
            return last
        warned, marches = len(self._reporter.warnings), self._marches
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

    def report(self) -> None:
        """Log how many steps this process has computed."""
        self._reporter.log(f"steps: {self._computed} computed, {self._before} taken as kept")

    def save(self) -> None:
        """Bring to the disk what is not there."""
        if not self._new and not self._marches:
            return
        begun = time.perf_counter()
        if self._new:
            path = self._folder.jump(len(self._files))
            self._files.append(write_arrays(path, _joined(self._new)))
            self._new.clear()
        steps = {STEPS: self._before + self._computed}
        state = StoredState(_joined(self._marches), steps, self._files)
        checkpoint.save(self._folder, state, self._provenance)
        self._saved = time.perf_counter()
        self._cost = self._saved - begun

    def _compute(self) -> None:
        """A step is to be computed: nothing tells the time of those that were kept."""
        if self._before and not self._going_on:
            self._going_on = True
            self._reporter.goes_on()

    # -- places -------------------------------------------------------------------------------
    def _next(self) -> Place:
        """The place of the step that comes next."""
        self._count += 1
        return (*self._above, self._count - 1)

    @contextmanager
    def _inside(self, place: Place) -> Iterator[None]:
        """Steps are those of the step at a place."""
        outside = self._above, self._count
        self._above, self._count = place, 0
        try:
            yield
        finally:
            self._above, self._count = outside

    # -- what steps gave ----------------------------------------------------------------------
    def _keep(self, among: dict[Place, bytes], place: Place, name: str, value: T, warned: int) -> T:
        """Keep what a step gave, with the warnings on the way, in place of its own steps."""
        begun = time.perf_counter()
        data, faithful = packed((name, value, self._reporter.warnings[warned:]))
        inside = place[:-1] if among is self._marches else place
        for steps in (self._new, self._marches):
            while steps and _within(last := next(reversed(steps)), inside):
                del steps[last]
        among[place] = data
        self._computed += 1
        if begun - self._saved > self._cost / SHARE:
            self.save()
        seconds = self._reporter.seconds
        seconds["checkpoints"] = seconds.get("checkpoints", 0.0) + time.perf_counter() - begun
        if faithful:
            return value
        handed_on: T = self._read(data, name)
        return handed_on

    def _read(self, data: bytes, name: str) -> Any:
        """What a step gave; its warnings are said again. Raises UserError for another step."""
        try:
            written, value, warnings = unpacked(data)
        except PackingError as error:
            raise self._of_another_version(error) from error
        if written != name:
            raise self._of_another_version(f"{written} in the place of {name}")
        for line in warnings:
            self._reporter.warn(line)
        return value

    def _of_another_version(self, wrong: object) -> UserError:
        of = f"{self._folder.jumps}: of another version of fretscale"
        return UserError(f"{of} ({wrong}); {self._folder.again}")

    def _of_files(self) -> dict[Place, bytes]:
        """What steps gave, but for those of a step that is known itself, or has gone on since."""
        kept: dict[Place, bytes] = {}
        for number in range(len(self._files)):
            arrays, _ = read_arrays(self._folder.jump(number))
            kept |= _unjoined(arrays)
        reached = {place[:-1]: place for place in self._marches}

        def counts(place: Place) -> bool:
            above = [place[:length] for length in range(1, len(place))]
            known = any(step in kept for step in above)
            return not known and all(reached.get(step) in (None, *above) for step in above)

        return {place: data for place, data in kept.items() if counts(place)}


def _within(place: Place, other: Place) -> bool:
    return place[: len(other)] == other


# --- on the disk --------------------------------------------------------------------------------


def _joined(steps: Mapping[Place, bytes]) -> dict[str, Any]:
    """What steps gave as arrays, one after the other."""
    lengths = [len(data) for data in steps.values()]
    return {
        PLACES: np.array([".".join(map(str, place)) for place in steps], dtype="S"),
        ENDS: np.cumsum(lengths, dtype=np.int64),
        VALUES: np.frombuffer(b"".join(steps.values()), dtype=np.uint8),
    }


def _unjoined(arrays: Mapping[str, Any]) -> dict[Place, bytes]:
    """The inverse of :func:`_joined`."""
    places = [tuple(map(int, place.split(b"."))) for place in arrays[PLACES].tolist()]
    ends, values = arrays[ENDS].tolist(), arrays[VALUES].tobytes()
    spans = pairwise([0, *ends])
    return {place: values[begin:end] for place, (begin, end) in zip(places, spans, strict=True)}
