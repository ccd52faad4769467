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
from workflow.shell.folders import steps
from workflow.shell.folders.lock import LOCK
from workflow.shell.folders.steps import RunSteps
from workflow.shell.folders.store import read_arrays

# Files with times, durations or stored states, which are no results. A run that is killed after all
# results are written leaves its stored states.
NOT_RESULTS = {LOCK, "run.log", "checkpoint.h5", "manifest.json", "summary.json"}
QUIET = "output={figures: false, paraview: false}"
# In the report: how long each stage took.
TIMES = re.compile(rb'<section id="time">.*?</section>', re.DOTALL)
# Seconds within which a run must have ended.
PATIENCE = 300.0
# Kills of every kind, more than 50 in all, the most that one run takes, and runs at most.
KILLS, IN_ONE_RUN, MOST_RUNS = 6, 4, 20

VIBRATION = (
    RIG_OF_THESIS
    + """\
title: Slider that shakes
analysis: vibration
joint: {law: jenkins, normal_load: 60 N, friction: 0.88, stiffness: 45 N/um}
forces: [5 N, 30 N]
frequencies: [60 Hz, 300 Hz]
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
    "specimens": LongRun(SMALL, ("wear.energy=3 kJ",)),
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
        WEARING_RIG, ("forces=[40 N]", "frequencies=[100 Hz, 250 Hz]"), (("wear.yaml", BALL),)
    ),
    # Probe runs are computed in a worker process, which runs in tests do without.
    "wear": LongRun(
        BALL,
        ("wear.step={kind: implicit, cycles: 100}", "contact.grid=[48, 48]", "error_budget=known"),
    ),
    "body wear": LongRun(
        BODY, (IN_TEXT, "wear.frequency=", "wear.at_resonance=true", "wear.force=20 N"), as_texts()
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
# How often steps are brought to the disk, by what that may take: as shipped, or each of them.
AS_SHIPPED = (steps.SHARE, steps.FIRST_SAVE)
EVERY_STEP = (float("inf"), 0.0)


@dataclass(frozen=True)
class Kill:
    """State of a run when it was killed: steps ``kept`` then, and ``before`` by earlier processes.

    ``lost`` are the seconds since the last of them was stored.
    """

    before: int
    kept: int
    lost: float


def killed(
    command: list[object], out: Path, seconds: float, saves: tuple[float, float]
) -> Kill | float:
    """Run as a process and kill it after some seconds; return the run time if it ended before.

    Time counts from the first stored step, or from the first line of its log if few are stored.
    """
    log, path, before = out / "run.log", out / "checkpoint.h5", kept_in(out)
    mark = path if saves == EVERY_STEP else log
    written = mark.stat().st_mtime_ns if mark.exists() else 0
    process = forked.start([str(word) for word in command], *saves)
    end = time.monotonic() + PATIENCE
    while process.exitcode is None and not (mark.exists() and mark.stat().st_mtime_ns > written):
        assert time.monotonic() < end
        time.sleep(0.01)
    begun = time.time()
    process.join(seconds)
    if process.exitcode is not None:
        assert process.exitcode == 0
        return time.time() - begun
    process.kill()
    process.join()
    moment, kept = time.time(), kept_in(out)
    last = max(begun, path.stat().st_mtime) if path.exists() else begun
    return Kill(before, kept, moment - last)


def kill_at_random(
    command: list[object],
    out: Path,
    dice: random.Random,
    whole: float,
    saves: tuple[float, float],
    most: int,
) -> tuple[list[Kill], float]:
    """Kill a run and its resumptions at random moments of the ``whole`` seconds; then let it end.

    Returns the kills, and the total seconds if the run ended before the first of them.
    """
    kills: list[Kill] = []
    for _ in range(most):
        kill = killed(command, out, dice.uniform(0.0, whole), saves)
        if isinstance(kill, float):
            whole = whole if kills else kill
            break
        # Nothing that was kept is lost again.
        assert kill.kept >= kill.before
        kills.append(kill)
        command = ["resume", out] if (out / "case.yaml").exists() else command
    if not (out / "summary.json").exists():
        run_here(command)
        assert not list(out.rglob("*.part.*"))
        assert not (out / "jumps").exists()
    return kills, whole


def kills_of(kind: str, folder: Path, most: int) -> list[Kill]:
    """Kill runs of a kind ``most`` times, with each step stored or as rarely as in real use.

    More than half of the kills must hit a process that had advanced beyond earlier ones. The final
    results must equal those of an undisturbed run.
    """
    dice, kills, whole = random.Random(20), [], folder / "whole"
    begun = time.monotonic()
    run_here(RUNS[kind].command(folder, whole))
    seconds = time.monotonic() - begun
    reference, (total, _) = results_of(whole), counted(whole)
    for number in range(MOST_RUNS):
        if len(kills) >= most and 2 * sum(kill.kept > kill.before for kill in kills) > most:
            break
        # The first step that is kept has the start behind it.
        saves, share = (AS_SHIPPED, 1.0) if number % 3 == 2 else (EVERY_STEP, 0.5)
        out = folder / str(number)
        most_now = min(IN_ONE_RUN, max(most - len(kills), 1))
        command = RUNS[kind].command(folder, out)
        # The first run of all may have been long, with functions to compile.
        new, within = kill_at_random(command, out, dice, share * seconds, saves, most_now)
        seconds = within / share
        assert results_of(out) == reference
        computed, kept = counted(out)
        # Nothing that was kept has been computed again.
        assert computed + kept == total
        # By the process after the last kill, or that one if it was all but at its end.
        assert not new or kept in (new[-1].kept, new[-1].before)
        kills += new
    return kills


@posix_only
def test_a_killed_run_goes_on(tmp_path):
    assert len(kills_of("joint", tmp_path, 1)) >= 1


@posix_only
@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("kind", list(RUNS))
def test_random_kills_lose_nothing_but_the_last_step(kind, tmp_path):
    kills = kills_of(kind, tmp_path, KILLS)
    assert len(kills) >= KILLS
    assert 2 * sum(kill.kept > kill.before for kill in kills) > KILLS
