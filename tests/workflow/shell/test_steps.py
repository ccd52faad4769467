"""Tests of stored steps: they are restored after any interruption, and only if they are ours."""

import pickle
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from fe_models.dynamics.motion import Start
from fe_models.dynamics.transient.record import StepState
from wear.joints.law import JointResponse
from workflow.messages.warning_kinds import WarningKind
from workflow.shell.folders import checkpoint, packing, steps
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.folders.packing import PackingError, packed, unpacked
from workflow.shell.folders.steps import resumable_steps
from workflow.shell.terminal.reporter import Reporter

PROVENANCE = {"case": {"title": "steps"}, "input_files": {}, "choice": None}


class CutOff(BaseException):
    pass


def run_in(folder):
    """Return a run in a folder, which resumes if something was stored there."""
    output = OutputFolder(folder)
    kept = checkpoint.load(output, PROVENANCE) if output.checkpoint.exists() else None
    output.reserve_state()
    reporter = Reporter(folder / "run.log", append=True)
    return SimpleNamespace(folder=output, reporter=reporter, provenance=PROVENANCE, kept=kept)


class Work:
    """Steps with nested steps, marches and warnings; ``done`` counts the work.

    It is interrupted after ``most`` steps, or never if that is negative.
    """

    def __init__(self, taken_by, reporter, most=-1):
        self.steps, self.reporter, self.left, self.done = taken_by, reporter, most, 0

    def leaf(self, number):
        if self.left == self.done:
            raise CutOff
        self.done += 1
        if number % 3 == 0:
            self.reporter.warn(WarningKind.MANY_STEPS, f"{number} divides by 3")
        return np.array([[number, number + 1.0], [0.5, 0.25]]).T

    def outer(self, number):
        parts = [self.steps("leaf", lambda n=n: self.leaf(n)) for n in range(number, number + 3)]
        return sum(part.sum() for part in parts) + parts[0]

    def advance(self, state):
        """Do a march of two within a march."""
        if state[0, 0] > 400.0:
            return None
        inner = self.steps.march("inner", state, self.further)
        return inner + self.steps("leaf", lambda: self.leaf(int(inner[0, 0])))

    def further(self, state):
        if int(state[0, 0]) % 5 == 4:
            return None
        return np.asfortranarray(state + 0.0 * self.leaf(7) + [[1.0, 0.0], [0.0, 0.0]])

    def all(self):
        first = [self.steps("outer", lambda n=n: self.outer(n)) for n in (0, 5)]
        last = self.steps.march("outer march", first[-1], self.advance)
        return [*first, last, self.steps("end", lambda: self.outer(11))]


def worked(folder, most=-1):
    """Return result, warnings, and amount of work; the result is None if interrupted."""
    run = run_in(folder)
    try:
        with resumable_steps(run) as taken_by:
            work = Work(taken_by, run.reporter, most)
            return work.all(), run.reporter.warnings, work.done
    except CutOff:
        return None
    finally:
        run.reporter.close()


def new(folder):
    folder.mkdir()
    return folder


def assert_same(end, whole):
    np.testing.assert_equal(end[0], whole[0])
    assert end[1] == whole[1]


@pytest.mark.parametrize(("share", "every"), [(np.inf, 6), (steps.SHARE, 1)])
def test_a_run_can_be_cut_off_anywhere(share, every, monkeypatch, tmp_path):
    """Steps are saved one by one or on interruption, and none is computed again."""
    monkeypatch.setattr(steps, "SHARE", share)
    whole = worked(new(tmp_path / "whole"))
    total, warnings = whole[2], whole[1]
    assert (total, len(warnings)) == (19, 5)
    for cut in range(0, total, every):
        folder = new(tmp_path / str(cut))
        assert worked(folder, cut) is None
        end = worked(folder)
        assert_same(end, whole)
        assert end[2] == total - cut


def test_states_are_saved_as_time_allows(monkeypatch, tmp_path):
    """Some short steps are saved, every long one, and the last; the clock is simulated."""
    now, cost = [0.0], 0.05
    written: list[int] = []

    def save(folder, state, provenance):
        now[0] += cost
        written.append(state.attributes["steps"])

    monkeypatch.setattr(steps.time, "perf_counter", lambda: now[0])
    monkeypatch.setattr(steps.checkpoint, "save", save)
    for seconds, count in ((0.1, 1000), (100.0, 10)):
        written.clear()
        run, begun = run_in(new(tmp_path / str(count))), now[0]

        def advance(jump, seconds=seconds, count=count):
            if jump == count:
                raise CutOff
            now[0] += seconds
            return jump + 1

        with pytest.raises(CutOff), resumable_steps(run) as taken_by:
            taken_by.march("jump", 0, advance)
        run.reporter.close()
        assert written[-1] == count
        assert cost * len(written) <= steps.SHARE * (now[0] - begun) + 2.0 * cost
        assert seconds * (max(np.diff([0, *written])) - 1) <= cost / steps.SHARE + seconds
    assert written == [*range(1, 11), 10]


# --- packing --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Foreign:
    value: float


RESPONSE = JointResponse(*(np.arange(n, dtype=float) for n in (1, 2, 0, 3)))


@pytest.mark.parametrize(
    "value",
    [
        (1, -0.0, 1e-310, np.inf, True, None, "text", b"bytes"),
        [np.float64(0.1), np.bool_(True), np.int8(-3)],
        {"a": (np.zeros((0, 3)), np.array(3.0)), 0.1: []},
        StepState(0.1, np.ones(2), np.array([1, 2]), RESPONSE, np.array(["ab"]), 1e-3, np.nan),
        Start(np.ones(3, complex), None, np.ones((2, 2), bool), 0.5),
    ],
)
def test_what_is_read_is_what_was_packed(value):
    again = unpacked(packed(value)[0])
    assert repr(again) == repr(value)
    assert packed(again) == packed(value)


def test_arrays_keep_their_order_in_memory():
    rows = np.arange(6.0).reshape(2, 3)
    for array, faithful in ((rows, True), (rows.T, True), (rows[:, ::2], False)):
        data, same = packed(array)
        again = unpacked(data)
        np.testing.assert_array_equal(again, array)
        assert same == faithful
        assert again.flags.writeable
        assert not same or again.strides == array.strides


@pytest.mark.parametrize("value", [Foreign(1.0), {1.0}, np.array([None]), print, object()])
def test_what_is_not_ours_is_not_packed(value):
    with pytest.raises(TypeError):
        packed(value)


@pytest.mark.parametrize(
    "plain",
    [
        (packing.OBJECT, "os:system:command", ["true"]),
        (packing.NAMED, "workflow.shell.folders.store:write_text:path", ["a", "b"]),
        (packing.OBJECT, "fe_models.dynamics.motion:Start:displacement", [None]),
        (packing.OBJECT, "fe_models.dynamics.motion:Gone:displacement", [None]),
        (99, 1),
        (packing.ARRAY, "<f8", (3,), "C", b"short"),
        Foreign(1.0),
    ],
)
def test_what_a_file_names_is_not_called(plain):
    with pytest.raises(PackingError):
        unpacked(pickle.dumps(plain))
