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
from workflow.messages.error_kinds import ErrorKind
from workflow.runs.run import resume_run, run_case
from workflow.shell.folders.store import replacing_hdf5, write_arrays, write_text

# Seconds within which a command has ended.
PATIENCE = 120.0
ROOT = Path(__file__).resolve().parents[3]
COMMAND = "from workflow.cli import main; main()"
FULL = Path("/dev/full")
# Files may grow to so many bytes; what is written beyond fails, as on a full disk. Python must not
# write compiled modules then: it would leave cut off ones, which break later imports.
LIMITED = (
    "import os, resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, ({0}, {0})); "
    "sys.dont_write_bytecode = True; os.environ['PYTHONDONTWRITEBYTECODE'] = '1'; " + COMMAND
)
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


@pytest.fixture
def synced(monkeypatch):
    """Record the order in which files are flushed to disk and renamed."""
    reported = []
    fsync, rename = os.fsync, Path.replace

    def syncing(file):
        reported.append(("synced", Path(f"/proc/self/fd/{file}").readlink().name))
        fsync(file)

    def renaming(path, target):
        reported.append(("renamed", path.name))
        return rename(path, target)

    monkeypatch.setattr(os, "fsync", syncing)
    monkeypatch.setattr(Path, "replace", renaming)
    return reported


# --- what writes files ----------------------------------------------------------------------------


@pytest.mark.skipif(not Path("/proc").exists(), reason="looks for names in /proc")
def test_files_are_on_the_disk_before_they_have_their_name(synced, tmp_path):
    write_text(tmp_path / "a.txt", "text")
    write_arrays(tmp_path / "b.h5", ARRAYS)
    assert [what for what, _ in synced] == ["synced", "renamed"] * 2
    assert all(
        first[1] == second[1] for first, second in zip(synced[::2], synced[1::2], strict=True)
    )


def test_two_files_of_one_name_are_written_at_the_same_time(tmp_path):
    """Two runs in the threads of a program have one ``results.h5`` each."""
    one, other = tmp_path / "one.h5", tmp_path / "other"
    other.mkdir()
    with replacing_hdf5(one) as first, replacing_hdf5(other / "one.h5") as second:
        first["value"], second["value"] = 1, 2
    for path, value in ((one, 1), (other / "one.h5", 2)):
        with h5py.File(path) as file:
            assert file["value"][()] == value


FILLING = """
import resource, sys, numpy as np
sys.dont_write_bytecode = True
from pathlib import Path
from workflow.shell.folders.store import write_arrays
resource.setrlimit(resource.RLIMIT_FSIZE, ({0}, {0}))
try:
    write_arrays(Path("a.h5"), {{"field": np.zeros(40_000)}})
except OSError as error:
    print(error.filename)
"""


@posix_only
@pytest.mark.parametrize("room", [0, 100, 5000, 300_000])
def test_hdf5_on_a_full_disk_is_an_error_and_no_crash(room, tmp_path):
    """HDF5 itself would abort the process."""
    (tmp_path / "a.h5").write_text("old")
    code = f"import sys; sys.path.insert(0, {str(ROOT)!r})" + FILLING.format(room)
    ended = command(code=code, cwd=tmp_path)
    assert (ended.returncode, ended.stdout) == (0, "a.h5\n"), ended.stderr
    assert names(tmp_path) == ["a.h5"]
    assert (tmp_path / "a.h5").read_text() == "old"


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
    (line,) = ending.stderr.splitlines()
    assert line.startswith("fretscale: output: No space left on device")
    assert ErrorKind.OUTPUT_FAILED.code in line
