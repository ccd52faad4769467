"""Checks shared by the tests of interrupted runs."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from workflow.shell.folders.steps import RunSteps
from workflow.shell.folders.store import read_arrays

# Seconds within which everything must have ended.
PATIENCE = 120.0

posix_only = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")


@contextmanager
def ctrl_c_after_jumps(jumps: int) -> Iterator[None]:
    """Send Ctrl-C to a run in this process once this number of jumps is stored."""
    keep = RunSteps._keep

    def interrupting(steps, among, place, name, state, warned):
        state = keep(steps, among, place, name, state, warned)
        if state.jump == jumps:
            raise KeyboardInterrupt
        return state

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(RunSteps, "_keep", interrupting)
        yield


def assert_equal(run, reference):
    """Assert that surfaces and kinetics are bitwise equal."""
    assert run.ending.exit_code == 0, run.ending.stderr
    heights, expected = run.heights(), reference.heights()
    assert heights.keys() == expected.keys()
    for name, height in expected.items():
        np.testing.assert_array_equal(heights[name], height, err_msg=name)
    assert run.summary["kinetics"] == reference.summary["kinetics"]
    structure, other = run.summary["structure"], reference.summary["structure"]
    assert structure["solutions"] == other["solutions"]
    assert structure["drift"] == other["drift"]


def jumps_kept(folder: Path) -> int:
    """Return the number of complete jumps in the checkpoint."""
    path = folder / "checkpoint.h5"
    if not path.exists():
        return -1
    arrays, attributes = read_arrays(path)
    ended = not arrays["places"].size  # the last step is then the end of the march
    return int(attributes["steps"]) - ended
