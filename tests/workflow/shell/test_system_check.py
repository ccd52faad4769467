"""Missing system packages are named in one line, or installed if no password is needed."""

import os
import shutil
import subprocess
import sys
from types import SimpleNamespace

import pytest

from workflow.shell import system_check

APT = ["env", "DEBIAN_FRONTEND=noninteractive", "apt-get"]


@pytest.fixture
def bare(monkeypatch):
    """Replace the machine by one that lacks a library until apt-get runs; return its commands."""
    commands = []

    def run(command, **options):
        commands.append(command)
        if "install" in command:
            monkeypatch.setattr(system_check, "DEBIAN_PACKAGES", {"libc.so.6": "libc6"})
        return SimpleNamespace(returncode=1 if machine.password and "true" in command else 0)

    machine = SimpleNamespace(user=1000, programs=["apt-get"], password=True, commands=commands)
    lacking = {"libno.so.7": "libno7", "libc.so.6": "libc6"}
    monkeypatch.setattr(system_check, "DEBIAN_PACKAGES", lacking)
    monkeypatch.setattr(os, "geteuid", lambda: machine.user)
    monkeypatch.setattr(shutil, "which", lambda name: name if name in machine.programs else None)
    monkeypatch.setattr(subprocess, "run", run)
    return machine


def test_a_user_gets_the_one_line_to_run(bare, capsys):
    for programs in (["apt-get"], ["apt-get", "sudo"]):
        bare.programs = programs
        assert system_check.main([]) == system_check.FAILED
        (line,) = capsys.readouterr().err.splitlines()
        assert "sudo apt-get update && sudo apt-get install -y" in line
        assert line.endswith(" libno7")
    assert bare.commands == [["sudo", "-n", "true"]]


def test_root_gets_what_is_missing(bare, capsys):
    bare.user = 0
    assert system_check.main([]) == 0
    assert [command[:4] for command in bare.commands] == [[*APT, "update"], [*APT, "install"]]
    assert "libno7" in bare.commands[-1]
    assert "installing libno7" in capsys.readouterr().out
    assert system_check.main([]) == 0
    assert len(bare.commands) == 2


def test_needs_the_standard_library_only():
    """It is run by its path, with nothing else to import."""
    command = [sys.executable, "-I", "-S", system_check.__file__, "--imports"]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == system_check.FAILED
    assert ended.stderr == "fretscale: No module named 'gmsh'\n"
