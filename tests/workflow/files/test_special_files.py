"""Pipes, sockets and devices in place of files are reported in one line, without waiting."""

import os
import shutil
import signal
import socket

import pytest

from tests.workflow.command_line import command, runs_here
from tests.workflow.scenes import ROLLER_LOADS, ROLLER_WEAR
from workflow.kinds import load_case
from workflow.runs.run import run_case
from workflow.shell.folders.lock import LOCK

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGALRM"), reason="pipes of POSIX")
# Seconds after which whoever waits for a pipe is woken.
PATIENCE = 120
SHORT = ("wear.cycles=1e4", "wear.step.cycles=5e3", "contact.grid=[24, 8]")


def bound(path):
    with socket.socket(socket.AF_UNIX) as one:
        one.bind(str(path))


SPECIAL = {"pipe": os.mkfifo, "device": lambda path: path.symlink_to("/dev/zero"), "socket": bound}


@pytest.fixture(params=SPECIAL)
def put(request, tmp_path, monkeypatch):
    """Return a function that puts it in place of a file, by a path short enough for a socket."""

    def in_place_of(path):
        path.unlink(missing_ok=True)
        monkeypatch.chdir(path.parent)
        SPECIAL[request.param](type(path)(path.name))

    return in_place_of


@pytest.fixture(autouse=True)
def woken():
    def wake(*_):
        raise AssertionError("waits for a pipe, or reads a device without end")

    before = signal.signal(signal.SIGALRM, wake)
    signal.alarm(PATIENCE)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.fixture(scope="module")
def uncleared(tmp_path_factory):
    """Return a wear run with its summary and the files it would have resumed from."""
    folder = tmp_path_factory.mktemp("uncleared")
    (folder / "loads.csv").write_text(ROLLER_LOADS, encoding="utf-8")
    (folder / "wear.yaml").write_text(ROLLER_WEAR, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch, runs_here():
        patch.setattr("workflow.shell.folders.folder.OutputFolder.discard_state", lambda _: None)
        run_case(load_case(folder / "wear.yaml", SHORT), folder / "out", False)
    return folder


@pytest.fixture
def run(uncleared, tmp_path):
    """Return a copy of this run."""
    return shutil.copytree(uncleared / "out", tmp_path / "out")


OF_UNFINISHED = ["checkpoint.h5", "jumps/00001.h5", "manifest.json", LOCK]


@pytest.mark.parametrize("name", OF_UNFINISHED)
def test_in_an_unfinished_run(run, put, name):
    (run / "summary.json").unlink()
    put(run / name)
    ended = command("resume", run)
    assert ended.exit_code == 2
    (line,) = ended.stderr.splitlines()
    assert f"{run / name}: not a file: a pipe or a device" in line
