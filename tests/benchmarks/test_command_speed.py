"""Benchmark of complete commands, with figures and files for ParaView.

The cache of condensed structures is empty. Processor seconds are those of the command and all its
processes; wall seconds depend on other work of the machine, and are recorded in addition.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.marks import slow

ROOT = Path(__file__).parents[2]
# Case and overrides of each command, and the processor seconds that it may take.
COMMANDS = {
    "sphere_normal": ("sphere_normal", (), 15.0),
    "dovetail_2d": ("dovetail_2d", (), 60.0),
    "dovetail": ("dovetail", (), 240.0),
    "dovetail, method full": ("dovetail", ("contact.method=full",), 480.0),
}


def used() -> float:
    """Return the processor seconds of all ended child processes."""
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


@pytest.mark.parametrize(
    "name", ["sphere_normal", *(slow(name) for name in COMMANDS if name != "sphere_normal")]
)
def test_command(name: str, record: dict[str, float], tmp_path: Path) -> None:
    case, overrides, allowed = COMMANDS[name]
    command = [sys.executable, "-m", "fretscale", "run", str(ROOT / "cases" / f"{case}.yaml")]
    command += ["--out", str(tmp_path / "out"), *(f"--set={entry}" for entry in overrides)]
    cold = os.environ | {"FRETSCALE_CACHE": str(tmp_path / "cache")}
    before, began = used(), time.perf_counter()
    subprocess.run(command, check=True, env=cold, capture_output=True)
    record[f"command, {name}: wall seconds"] = time.perf_counter() - began
    record[f"command, {name}: processor seconds"] = spent = used() - before
    assert (tmp_path / "out" / "summary.json").exists()
    assert spent <= allowed
