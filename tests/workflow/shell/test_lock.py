"""Tests of two processes in one folder: the holder is named, and an abandoned lock is taken."""

import json
import os
import signal
import socket
import subprocess
import sys
import threading

import pytest

from tests.workflow.command_line import invoke
from tests.workflow.scenes import BALL
from workflow.errors import UserError
from workflow.kinds import load_case
from workflow.runs import run as running
from workflow.runs.run import bring_to_end
from workflow.shell.folders.lock import LOCK, locked

# Seconds within which another process has begun or ended.
PATIENCE = 120.0
HOLD = """
import sys, time
from pathlib import Path
from workflow.shell.folders.lock import locked
with locked(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(600)
"""

posix_only = pytest.mark.skipif(os.name != "posix", reason="locks of POSIX")


@pytest.fixture
def out(tmp_path):
    return tmp_path / "out"


@pytest.fixture
def holder(out):
    """Start another process that holds the folder."""
    command = [sys.executable, "-c", HOLD, str(out)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "held\n"
        yield process
        process.kill()


@pytest.fixture
def ball(tmp_path):
    path = tmp_path / "ball.yaml"
    path.write_text(f"{BALL}output: {{paraview: false, figures: false}}\n", encoding="utf-8")
    return path


def left_by(out, host, process=1):
    """Write the lock of a process that has ended, with the number of a running one."""
    out.mkdir(exist_ok=True)
    reported = {"process": process, "host": host, "since": "2026-01-02 03:04:05"}
    (out / LOCK).write_text(" " + json.dumps(reported))


def killed(process):
    process.send_signal(signal.SIGKILL)
    process.wait(PATIENCE)


@posix_only
@pytest.mark.parametrize("command", ["run", "chart"])
def test_a_second_command_in_a_folder_names_the_process_of_the_first(out, holder, ball, command):
    before = sorted(out.iterdir())
    ending = invoke(command, ball, "--out", out, *(["--force"] if command == "run" else []))
    assert ending.exit_code == 2
    (line,) = ending.stderr.splitlines()
    assert f"process {holder.pid} on {socket.gethostname()}" in line
    assert sorted(out.iterdir()) == before


@posix_only
def test_the_lock_of_a_killed_process_is_reported_and_taken(out, holder, ball):
    killed(holder)
    assert (out / LOCK).exists()
    ending = invoke("run", ball, "--out", out)
    assert ending.exit_code == 0, ending.stderr
    reported = f"process {holder.pid} on {socket.gethostname()} since "
    assert ending.stderr.startswith(reported)
    assert "is gone and left its lock" in ending.stderr
    assert reported in (out / "run.log").read_text()
    assert json.loads((out / "summary.json").read_text())["warnings"] == []
    assert not (out / LOCK).exists()


@posix_only
def test_a_lock_of_another_machine_is_for_whoever_knows_it(out):
    left_by(out, "elsewhere")
    with (
        pytest.raises(UserError, match=f"process 1 on elsewhere since .* remove .*{LOCK}"),
        locked(out),
    ):
        pass
    assert (out / LOCK).exists()
    with locked(out, take_over=True) as gone:
        assert "elsewhere" in gone
    left_by(out, "elsewhere")
    (out / LOCK).unlink()
    with locked(out) as gone:
        assert gone == ""


@posix_only
def test_many_who_want_a_folder_have_it_one_after_the_other(tmp_path):
    """Locks come and go with their file, and nobody holds one that is already removed."""
    code = """
import sys
from pathlib import Path
from workflow.shell.folders import lock
lock.LOOK = 1e-3
root = Path(sys.argv[1])
for _ in range(100):
    with lock.locked(root / "out", patience=60.0):
        (root / "alone").mkdir()
        (root / "alone").rmdir()
"""
    command = [sys.executable, "-c", code, str(tmp_path)]
    processes = [subprocess.Popen(command, stderr=subprocess.PIPE) for _ in range(4)]
    for process in processes:
        _, printed = process.communicate(timeout=PATIENCE)
        assert process.returncode == 0, printed.decode()


@posix_only
def test_runs_of_many_wait_for_one_that_is_about_to_end(out, holder, ball, monkeypatch):
    case = load_case(ball)
    monkeypatch.setattr(running, "PATIENCE", 0.3)
    with pytest.raises(UserError, match=f"in use by process {holder.pid} "):
        bring_to_end(case, out)
    # It ends while it is waited for.
    monkeypatch.setattr(running, "PATIENCE", PATIENCE)
    ending = threading.Timer(0.2, killed, [holder])
    ending.start()
    assert bring_to_end(case, out)
    ending.join()


def test_nothing_is_left_of_a_command_that_wrote_nothing(tmp_path):
    with locked(tmp_path / "out"):
        assert (tmp_path / "out" / LOCK).exists()
    assert list(tmp_path.iterdir()) == []


def test_a_lock_is_no_way_out_of_the_folder(out, tmp_path):
    out.mkdir()
    (tmp_path / "mine").write_text("mine")
    (out / LOCK).symlink_to(tmp_path / "mine")
    with pytest.raises(OSError, match="symbolic links"), locked(out):
        pass
    assert (tmp_path / "mine").read_text() == "mine"
