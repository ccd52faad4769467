"""On a full disk or a closed output, a run ends with one line and exit code 3, and can resume."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from tests.marks import slow
from tests.workflow.command_line import runs_here
from tests.workflow.scenes import BALL, ROLLER_LOADS, ROLLER_WEAR
from workflow.errors import NotWritten
from workflow.kinds import load_case
from workflow.runs.run import resume_run, run_case
from workflow.shell.folders import store
from workflow.shell.folders.store import write_arrays

# Seconds within which a command has ended.
PATIENCE = 120.0
COMMAND = "from workflow.cli import main; main()"
FULL = Path("/dev/full")
# Files may grow to so many bytes; what is written beyond fails, as on a full disk.
LIMITED = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({0}, {0}));" + COMMAND
ARRAYS = {f"field_{number}": np.full((40, 50), 1.0 * number) for number in range(20)}

posix_only = pytest.mark.skipif(os.name != "posix", reason="limits and streams of POSIX")
linux_only = pytest.mark.skipif(not FULL.exists(), reason="a device of Linux")


def command(*arguments, code=COMMAND, **streams):
    """Start ``fretscale`` as a process."""
    settings = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True} | streams
    full = [sys.executable, "-c", code, *map(str, arguments)]
    return subprocess.run(full, check=False, timeout=PATIENCE, **settings)


def names(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.fixture
def ball(tmp_path):
    path = tmp_path / "ball.yaml"
    path.write_text(f"{BALL}output: {{paraview: false, figures: false}}\n", encoding="utf-8")
    return path


# --- what writes files ----------------------------------------------------------------------------


class Full:
    """File on a disk with limited room; ``short`` writes come before the error."""

    def __init__(self, file, room):
        self._file, self._room = file, room

    def write(self, data):
        left = self._room - self._file.tell()
        if left <= 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return self._file.write(data[:left])

    def __getattr__(self, name):
        return getattr(self._file, name)


@pytest.mark.parametrize("room", [0, 1, 95, 96, 800, 2048, 5000, 50_000, 100_000, 320_000, 327_000])
def test_hdf5_on_a_full_disk_is_an_error_and_no_crash(room, monkeypatch, tmp_path):
    outlet = store._Outlet
    monkeypatch.setattr(store, "_Outlet", lambda file: outlet(Full(file, room)))
    path = tmp_path / "a.h5"
    path.write_text("old")
    with pytest.raises(OSError, match="No space left") as raised:
        write_arrays(path, ARRAYS)
    assert raised.value.filename == str(path)
    assert names(tmp_path) == ["a.h5"]
    assert path.read_text() == "old"


# --- runs -----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return a complete run, and the number of files it flushed to disk."""
    folder, written, fsync = tmp_path_factory.mktemp("whole"), [], os.fsync
    (folder / "loads.csv").write_text(ROLLER_LOADS, encoding="utf-8")
    twice = ROLLER_WEAR.replace("  cycles: 4e4", "  cycles: 2e4")
    (folder / "wear.yaml").write_text(twice, encoding="utf-8")
    with runs_here(), pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda file: (written.append(file), fsync(file)))
        run_case(load_case(folder / "wear.yaml"), folder / "out", force=False)
    return folder, len(written)


def same(folder, other):
    with h5py.File(folder / "results.h5") as ours, h5py.File(other / "results.h5") as theirs:
        found = [file["kinetics/interface/depth_1"][()] for file in (ours, theirs)]
    np.testing.assert_array_equal(*found)
    return names(folder) == names(other)


@pytest.mark.parametrize(
    "share", [*np.linspace(0.0, 0.75, 4), *map(slow, np.linspace(0.125, 0.875, 4))]
)
def test_a_run_goes_on_from_any_file_that_was_not_written(share, whole, monkeypatch, tmp_path):
    """From some file on nothing can be written; files completed before remain complete."""
    (folder, count), out, fsync = whole, tmp_path / "out", os.fsync
    case, left = load_case(folder / "wear.yaml"), [None] * int(share * count)

    def full(file):
        if not left:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        left.pop()
        fsync(file)

    with runs_here():
        with monkeypatch.context() as patch:
            patch.setattr(os, "fsync", full)
            with pytest.raises(NotWritten, match="No space left") as raised:
                run_case(case, out, force=False)
        assert str(out) in str(raised.value)
        if (out / "checkpoint.h5").exists():
            assert resume_run(out)
        else:
            run_case(case, out, force=False)
    assert same(out, folder / "out")


@posix_only
@pytest.mark.parametrize("size", [slow(0), 4_000])
def test_a_limit_of_the_system_ends_a_run_in_one_line(size, ball, tmp_path):
    """First the lock, then the results cannot grow beyond the limit."""
    out = tmp_path / "out"
    ending = command("run", ball, "--out", out, code=LIMITED.format(size))
    assert ending.returncode == 3, ending.stderr
    *printed, line = [line for line in ending.stderr.splitlines() if line]
    assert line.startswith(f"fretscale: {out}/")
    assert "File too large" in line
    assert "continue with the same command" in line
    assert printed == (["run: Ball"] if size else [])
    assert not list(tmp_path.rglob(".*"))


# --- output ---------------------------------------------------------------------------------------


@linux_only
@pytest.mark.parametrize("arguments", [["schema"], ["--help"], slow(["new", "bodies"])])
def test_output_that_cannot_be_written_is_one_line(arguments):
    with FULL.open("w") as full:
        ending = command(*arguments, stdout=full)
    assert ending.returncode == 3
    assert ending.stderr == "fretscale: output: No space left on device\n"
