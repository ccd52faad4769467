"""Long runs of every kind that are killed can be resumed with bitwise identical results."""

import json
import os
import random
import re
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import yaml

from tests.marks import slow
from tests.workflow.conftest import invoke
from tests.workflow.rig.test_friction_rig import RIG as PADS
from tests.workflow.rig.test_friction_rig import SPECIMENS
from tests.workflow.rig.test_friction_rig_wear import WORN
from tests.workflow.rig.test_reduced_wear import BODY, IN_TEXT, as_texts
from tests.workflow.rig.test_specimens_case import SMALL
from tests.workflow.scenes import RIG_OF_THESIS
from tests.workflow.shell import forked
from tests.workflow.vibration.test_vibration_wear import RIG as WEARING_RIG
from tests.workflow.vibration.test_vibration_wear import WEAR as BALL
from tests.workflow.vibration.time_scenes import HAMMER, JOINT
from tests.workflow.vibration.time_scenes import RIG as RIG_IN_TIME
from workflow.shell.folders.lock import LOCK
from workflow.shell.folders.steps import RunSteps
from workflow.shell.folders.store import read_arrays

# Files with times, durations or stored states, which are no results. A run that is killed after all
# results are written leaves its stored states.
NOT_RESULTS = {LOCK, "run.log", "checkpoint.h5", "manifest.json", "summary.json"}
# In the report: how long each stage took.
TIMES = re.compile(rb'<section id="time">.*?</section>', re.DOTALL)
QUIET = "output={figures: false, paraview: false}"

VIBRATION = (
    RIG_OF_THESIS
    + """\
title: Slider that shakes
analysis: vibration
joint: {law: jenkins, normal_load: 60 N, friction: 0.88, stiffness: 45 N/um}
forces: [20 N, 30 N]
frequencies: [100 Hz, 160 Hz]
resolution: {tolerance: 5 %}
backbone: true
force_sweeps: [120 Hz]
loops: {frequency: 120 Hz, harmonics: [3, 7]}
"""
)
PADS_THAT_WEAR = yaml.safe_dump(yaml.safe_load(PADS) | WORN)


@dataclass(frozen=True)
class LongRun:
    """Case in ``text``, with ``files`` that it names and ``overrides``."""

    text: str
    overrides: tuple[str, ...] = ()
    files: tuple[tuple[str, str], ...] = ()

    def command(self, folder: Path, out: Path) -> list[object]:
        """Return the command that runs it, with its files in a folder."""
        for name, text in (("case.yaml", self.text), *self.files):
            (folder / name).write_text(text, encoding="utf-8")
        settings = [part for entry in (QUIET, *self.overrides) for part in ("--set", entry)]
        return ["run", folder / "case.yaml", "--out", out, *settings]


IN_A_ROW = "excitation={kind: harmonic, force: 50 N, frequency: 80 Hz, steady: 1e-7}"
RECORD = "time [s], force [N]\n" + "".join(
    f"{1e-3 * n:.3f}, {60.0 * np.sin(0.5 * n) * np.sin(0.07 * n):.6f}\n" for n in range(600)
)
RUNS = {
    "specimens": LongRun(SMALL, ("wear.energy=1.2 kJ", "load_path.normal_forces=[87 N]")),
    "joint": LongRun(JOINT, ("energies=[0.2 J, 0.5 J]", "ageing.tolerance=1e-9")),
    "steady": LongRun(RIG_IN_TIME, (IN_A_ROW, "ageing.energy=20 J", "integration.step=20 us")),
    "hammer": LongRun(
        RIG_IN_TIME, (HAMMER, "integration={step: 50 us, tolerance: 1e-5}", "energies=[0 J, 5 J]")
    ),
    "recorded": LongRun(
        RIG_IN_TIME,
        ("excitation={kind: recorded, file: record.csv}", "integration.step=20 us"),
        (("record.csv", RECORD),),
    ),
    "vibration": LongRun(VIBRATION),
    "half-space wear": LongRun(
        WEARING_RIG, ("forces=[40 N]", "frequencies=[150 Hz, 200 Hz]"), (("wear.yaml", BALL),)
    ),
    # Probe runs are computed in a worker process, which runs in tests do without.
    "wear": LongRun(
        BALL,
        ("wear.step={kind: implicit, cycles: 400}", "contact.grid=[24, 24]", "error_budget=known"),
    ),
    "body wear": LongRun(
        BODY,
        (
            IN_TEXT,
            "wear.frequency=",
            "wear.at_resonance=true",
            "wear.force=20 N",
            "wear.cycles=[2e5]",
            "frequencies=[400 Hz, 600 Hz]",
        ),
        as_texts(),
    ),
    "pad wear": LongRun(PADS_THAT_WEAR, ("forces=[20 N]",), (("specimens.yaml", SPECIMENS),)),
}


def results_of(out: Path) -> dict[str, object]:
    """Return all results of a run, except those that differ in every run."""
    summary = json.loads((out / "summary.json").read_text("utf-8"))
    del summary["seconds"], summary["digests"]["summary.json"]
    written = {
        path.relative_to(out).as_posix(): TIMES.sub(b"", path.read_bytes())
        for path in out.rglob("*")
        if path.is_file() and path.name not in NOT_RESULTS and path.parent.name != "jumps"
    }
    assert "results.h5" in written
    return written | {"summary.json": summary}


def counted(out: Path) -> tuple[int, int]:
    """Return the steps that the last process of a run has computed, and those it has restored."""
    log = (out / "run.log").read_text("utf-8")
    *_, (computed, taken) = re.findall(r"steps: (\d+) computed, (\d+) resumed", log)
    return int(computed), int(taken)


def kept_in(out: Path) -> int:
    """Return the number of steps that a killed run has stored."""
    path = out / "checkpoint.h5"
    if not path.exists():
        return 0
    _, attributes = read_arrays(path)
    return int(attributes["steps"])


# --- cut off in this process ----------------------------------------------------------------------


class CutOff(BaseException):
    """Exception that ends a run at some step."""


def run_here(command: list[object]) -> None:
    ended = invoke(*command)
    assert ended.exit_code == 0, ended.stderr


def cut(command: list[object], number: int) -> None:
    """Run a case and end it at this number of steps."""
    keep, left = RunSteps._keep, [number]

    def keeping(*arguments):
        left[0] -= 1
        if left[0] == 0:
            raise CutOff
        return keep(*arguments)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(RunSteps, "_keep", keeping)
        with pytest.raises(CutOff):
            invoke(*command)


EVERY_KIND = ["joint", *(slow(kind) for kind in RUNS if kind != "joint")]


@pytest.mark.parametrize("kind", EVERY_KIND)
def test_every_step_can_be_the_last(kind, tmp_path):
    """After an interruption at any step, the next run computes only what is missing."""
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    run_here(RUNS[kind].command(tmp_path, whole))
    reference, (total, _) = results_of(whole), counted(whole)
    dice, reached, command = random.Random(7), 0, RUNS[kind].command(tmp_path, parts)
    for _ in range(3):
        further = dice.randint(1, max((total - reached) // 2, 1))
        cut(command, further)
        assert kept_in(parts) == reached + further - 1
        reached, command = reached + further - 1, ["resume", parts]
    run_here(command)
    assert counted(parts) == (total - reached, reached)
    assert results_of(parts) == reference


# --- killed --------------------------------------------------------------------------------------

posix_only = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
EVERY_STEP = (float("inf"), 0.0)


@posix_only
@pytest.mark.parametrize("kind", EVERY_KIND)
def test_a_run_that_is_killed_at_random_loses_no_stored_step(kind, tmp_path):
    """Resumptions of three kills end with the results of an undisturbed run."""
    dice, whole, out = random.Random(20), tmp_path / "whole", tmp_path / "parts"
    begun = time.monotonic()
    run_here(RUNS[kind].command(tmp_path, whole))
    seconds, command, kept = time.monotonic() - begun, RUNS[kind].command(tmp_path, out), 0
    for _ in range(3):
        process = forked.start([str(word) for word in command], *EVERY_STEP)
        while process.exitcode is None and kept_in(out) == kept:
            process.join(0.02)
        process.join(dice.uniform(0.0, 0.3 * seconds))
        process.kill()
        process.join()
        assert kept_in(out) >= kept
        if process.exitcode == 0:
            break
        kept, command = kept_in(out), ["resume", out]
    else:
        # The last kill may come after the results, when nothing is left to resume.
        ended = (out / "summary.json").exists()
        run_here(command)
        assert ended or counted(out)[1] == kept
    assert results_of(out) == results_of(whole)
    assert not list(out.rglob("*.part.*"))
