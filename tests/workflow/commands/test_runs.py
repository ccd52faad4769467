"""Many runs in folders are computed once, resumed, and independent of each other's failures."""

import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import h5py
import numpy as np
import pytest

from fe_models import interpreter
from tests.workflow.command_line import jobs_here
from tests.workflow.scenes import BALL, ROLLER_LOADS, ROLLER_WEAR
from workflow.analyses.contact.case import ContactCase
from workflow.errors import MethodFailed, UserError
from workflow.kinds import load_case
from workflow.runs.job import Job
from workflow.runs.jobs import run_jobs
from workflow.runs.provenance import provenance_of
from workflow.runs.run import stored_run
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.folders.lock import LOCK

QUIET = "output: {paraview: false, figures: false}\n"
# Jumps of some hundredths of a second each, so that a moment among them is easily met.
MANY = "wear.step.cycles=1200"
# Seconds within which everything must have ended.
PATIENCE = 120.0

posix_only = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")


@pytest.fixture
def contact(tmp_path):
    path = tmp_path / "contact.yaml"
    path.write_text(f"{BALL}{QUIET}", encoding="utf-8")
    return path


@pytest.fixture
def wear(tmp_path):
    (tmp_path / "loads.csv").write_text(ROLLER_LOADS, encoding="utf-8")
    path = tmp_path / "wear.yaml"
    path.write_text(ROLLER_WEAR, encoding="utf-8")
    return path


@pytest.fixture
def here():
    """Run jobs in the process of the test."""
    with jobs_here():
        yield


def without_times(summary):
    return {key: value for key, value in summary.items() if key != "seconds"}


def wait_until(condition):
    """Return the first true value of the condition, which may not hold later."""
    end = time.monotonic() + PATIENCE
    while not (met := condition()) and time.monotonic() < end:
        time.sleep(0.02)
    assert met
    return met


# --- what run_jobs promises -----------------------------------------------------------------------


def test_failures_are_values_and_stop_nobody(contact, tmp_path):
    jobs = [
        Job("slides", contact, ("load_path.legs.0.P=100 N",)),
        Job("wrong", contact, ("friction.coefficient=-1",)),
        Job("good", contact),
    ]
    reported = []
    slides, wrong, good = run_jobs(jobs, tmp_path / "out", report=reported.append)
    assert {result.job.name for result in reported} == {"slides", "wrong", "good"}
    assert slides.summary is None
    assert "friction cannot carry Qx" in slides.error
    assert "--set friction.coefficient=-1: -1: out of range" in wrong.error
    assert "\n" not in slides.error + wrong.error
    assert good.error == ""
    assert good.folder == tmp_path / "out" / "good"
    # Hertz: p0 = (6 P E*² / π³ R²)^(1/3), a cell of 1/16 mm against a = 0.36 mm leaves 3 %.
    assert good.summary["states"][-1]["peak_pressure"] == pytest.approx(1450.3, rel=0.03)


def test_a_finished_run_stays_and_another_case_takes_its_place(contact, here, tmp_path):
    out = tmp_path / "out"
    (first,) = run_jobs([Job("one", contact)], out)
    written = (out / "one/summary.json").stat().st_mtime_ns
    (again,) = run_jobs([Job("one", contact)], out)
    assert again.summary == first.summary
    assert (out / "one/summary.json").stat().st_mtime_ns == written
    other = Job("one", contact, ("load_path.legs.0.P=500 N",))
    assert stored_run(out / "one", other.load()) == "other"
    (changed,) = run_jobs([other], out)
    assert changed.summary["states"][-1]["P"] == pytest.approx(500.0, rel=1e-6)


def test_what_is_no_run_is_left_alone(contact, here, tmp_path):
    figures = tmp_path / "out/mine/figures"
    figures.mkdir(parents=True)
    (done,) = run_jobs([Job("mine", contact)], tmp_path / "out")
    assert "not empty and no run of fretscale" in done.error
    assert figures.exists()


@pytest.mark.parametrize(
    ("code", "reported"),
    [
        ("import os, signal; os.kill(os.getpid(), signal.SIGKILL)", "signal 9"),
        ("raise SystemError('broken')", "exit code 1: SystemError: broken"),
        ("pass", "exit code 0"),
    ],
)
def test_a_process_that_ends_early_is_a_failure(contact, tmp_path, monkeypatch, code, reported):
    monkeypatch.setattr(interpreter, "COMMAND", code)
    (done,) = run_jobs([Job("one", contact)], tmp_path / "out")
    assert done.summary is None
    assert reported in done.error


def test_jobs_have_one_thread_each(contact, tmp_path, monkeypatch):
    names = list(interpreter.THREAD_SETTINGS)
    for name in names:
        monkeypatch.setenv(name, "7")
    code = f"import os; raise SystemError([os.environ[name] for name in {names}])"
    monkeypatch.setattr(interpreter, "COMMAND", code)
    (done,) = run_jobs([Job("one", contact)], tmp_path / "out")
    assert f"SystemError: {['1'] * len(names)}" in done.error


def test_cores_are_shared_out(contact, tmp_path, monkeypatch):
    """Never are more cores in use than exist, and all are used where jobs allow it."""
    import workflow.runs.jobs as runs

    wants, used, most = {"a": 2, "b": 1, "c": 1, "d": 3, "e": 9}, [], []

    def pretend(job, out, abandoned, one_thread):
        used.append(job.name)
        most.append(sum(min(wants[name], 3) for name in used))
        time.sleep(0.05)
        used.remove(job.name)
        return "pretended"

    cases = {name: Job(name, contact, (f"title={name}",)) for name in wants}
    monkeypatch.setattr(runs, "run_job", pretend)
    monkeypatch.setattr(ContactCase, "cores", property(lambda case: wants[case.title]))
    done = run_jobs(list(cases.values()), tmp_path / "out", processes=3)
    assert [result.error for result in done] == ["pretended"] * 5
    assert max(most) == 3


# --- interruptions --------------------------------------------------------------------------------

RUN = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # also where tests run in the background
from pathlib import Path
from workflow.runs.job import Job
from workflow.runs.jobs import run_jobs
case, out, *overrides = sys.argv[1:]
run_jobs([Job("one", Path(case), tuple(overrides))], Path(out), processes=1)
"""


def start(*arguments):
    # Its job keeps every step as it ends.
    often = "from workflow.shell.folders import steps; steps.SHARE = float('inf')"
    every = f"{often}; {interpreter.COMMAND}"
    code = f"from fe_models import interpreter\ninterpreter.COMMAND = {every!r}\n{RUN}"
    command = [sys.executable, "-c", code, *map(str, arguments)]
    return subprocess.Popen(command, stderr=subprocess.PIPE, start_new_session=True)


def below(pid):
    """Return the processes below one: the job and its contact workers."""
    processes = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            number, parent = path.parent.name, path.read_text().rpartition(")")[2].split()[1]
        except OSError:
            continue
        if int(parent) == pid:
            processes += [int(number), *below(int(number))]
    return processes


def alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def waits(pid):
    """Return whether it is a job that runs ``WAIT``."""
    try:
        return WAIT.encode() in Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return False


WAIT = """
import time
from fe_models import interpreter
interpreter.do_each = lambda messages, answers: time.sleep(600)
interpreter.main()
"""


@posix_only
@pytest.mark.skipif(not Path("/proc").exists(), reason="looks for processes in /proc")
def test_a_job_ends_with_whoever_waits_for_it(contact, tmp_path):
    """The job ends however the waiting process ends."""
    code = f"from fe_models import interpreter\ninterpreter.COMMAND = {WAIT!r}\n{RUN}"
    process = subprocess.Popen([sys.executable, "-c", code, contact, tmp_path / "out"])
    # Libraries start short processes of their own while they are imported.
    (job,) = wait_until(lambda: [pid for pid in below(process.pid) if waits(pid)])
    process.kill()
    process.wait(PATIENCE)
    wait_until(lambda: not alive(job))


@pytest.mark.slow
@posix_only
@pytest.mark.skipif(not Path("/proc").exists(), reason="looks for processes in /proc")
def test_whoever_is_killed_leaves_a_run_to_take_up(wear, tmp_path):
    """After Ctrl-C and a kill, the completed run equals an undisturbed one, without leftovers."""
    out = tmp_path / "out"
    reached = 0
    for stop in (signal.SIGINT, signal.SIGKILL):
        process = start(wear, out, MANY)
        jump = out / f"one/jumps/{reached + 5:05d}.h5"
        wait_until(jump.exists)
        descendants = below(process.pid)
        assert len(descendants) >= 2
        if stop == signal.SIGINT:
            os.killpg(process.pid, stop)
        else:
            process.kill()
        process.wait(PATIENCE)
        wait_until(lambda pids=descendants: not any(map(alive, pids)))
        reached = max(int(path.stem) for path in (out / "one/jumps").glob("[0-9]*.h5"))
    case = load_case(wear, (MANY,))
    assert stored_run(out / "one", case) == "unfinished"
    jobs = [Job("one", wear, (MANY,)), Job("untouched", wear, (MANY,))]
    taken_up, untouched = run_jobs(jobs, out)
    assert (out / "one/run.log").read_text("utf-8").count("resume: ") == 2
    assert without_times(taken_up.summary)["kinetics"] == untouched.summary["kinetics"]


def test_a_damaged_state_is_started_again(wear, here, tmp_path):
    job = Job("one", wear)
    (done,) = run_jobs([job], tmp_path / "out")
    folder = OutputFolder(done.folder)
    folder.summary.unlink()
    folder.checkpoint.write_bytes(folder.checkpoint.read_bytes()[:1000])
    assert stored_run(done.folder, job.load()) == "nothing"
    (again,) = run_jobs([job], tmp_path / "out")
    assert without_times(again.summary) == without_times(done.summary)


def test_a_chosen_case_is_known_by_the_case_that_was_asked_for(wear, here, tmp_path):
    """The folder's case has the settings chosen by fidelity, and its record lists them."""
    job = Job("one", wear)
    (done,) = run_jobs([job], tmp_path / "out")
    folder = OutputFolder(done.folder)
    record = {"choice": {"chosen": {"contact.grid": [32, 8]}}}
    folder.finish(done.summary | record, provenance_of(folder, job.load()))
    asked = load_case(wear, ("contact.grid=[64, 16]",))
    assert stored_run(done.folder, asked) == "finished"
    assert stored_run(done.folder, load_case(wear, ("friction.coefficient=0.6",))) == "other"


# --- a cluster ------------------------------------------------------------------------------------


def test_no_scheduler_is_one_line(contact, tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    from workflow.runs import cluster as runs_dask

    monkeypatch.setattr(runs_dask, "PATIENCE", "1 s")
    with pytest.raises(UserError, match=r"--dask tcp://127.0.0.1:9: "):
        run_jobs([Job("one", contact)], tmp_path / "out", dask="tcp://127.0.0.1:9")


@pytest.fixture
def impatient(monkeypatch):
    """Use seconds instead of minutes and hours."""
    from workflow.runs import cluster

    for name, seconds in {"WORKERS_LOOK": 0.1, "TELL": 0.5, "TELL_AGAIN": 60, "GIVE_UP": 3}.items():
        monkeypatch.setattr(cluster, name, float(seconds))


@pytest.mark.slow
@posix_only
def test_a_run_fails_if_all_workers_have_gone(wear, tmp_path, impatient, caplog):
    """Their stored states remain, so that runs can be resumed."""
    distributed = pytest.importorskip("distributed")
    out = tmp_path / "out"
    options = {"n_workers": 1, "threads_per_worker": 1, "dashboard_address": None}

    def leave():
        wait_until((out / "one/jumps/00005.h5").exists)
        cluster.scale(0)

    job = Job("one", wear, (MANY, "wear.cycles=1e5"))
    with distributed.LocalCluster(**options) as cluster, ThreadPoolExecutor() as beside:
        gone = beside.submit(leave)
        with pytest.raises(MethodFailed, match=r"no worker for .*, 1 of 1 runs"):
            run_jobs([job], out, dask=cluster.scheduler_address)
        gone.result()
    (reported,) = (
        record.getMessage() for record in caplog.records if record.name[:8] == "workflow"
    )
    assert "no worker is left, 1 of 1 runs wait for one; given up after a few seconds" in reported
    assert stored_run(out / "one", job.load()) == "unfinished"


@pytest.mark.slow
def test_a_cluster_finds_what_local_processes_find(contact, tmp_path):
    distributed = pytest.importorskip("distributed")
    jobs = [Job("good", contact), Job("slides", contact, ("load_path.legs.0.P=100 N",))]
    with distributed.LocalCluster(1, processes=False, dashboard_address=None) as cluster:
        there = run_jobs(jobs, tmp_path / "there", dask=cluster.scheduler_address)
    here = run_jobs(jobs, tmp_path / "here")
    assert without_times(there[0].summary) == without_times(here[0].summary)
    assert "friction cannot carry" in there[1].error


@pytest.mark.slow
@pytest.mark.long
@posix_only
@pytest.mark.skipif(not Path("/proc").exists(), reason="looks for processes in /proc")
def test_a_worker_killed_at_work_changes_nothing(contact, wear, tmp_path):
    """One of two workers is killed; all runs end with the bits of local processes."""
    distributed = pytest.importorskip("distributed")
    coefficients = [f"wear.body_1.coefficient={value} um^3/J" for value in (5e3, 1e4, 2e4)]
    jobs = [
        Job(f"run{number}", wear, (MANY, "wear.cycles=4e4", entry))
        for number, entry in enumerate(coefficients)
    ]
    jobs.append(Job("slides", contact, ("load_path.legs.0.P=100 N",)))
    out, reported = tmp_path / "cluster", []
    cluster = distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    )
    with cluster, ThreadPoolExecutor() as beside:
        workers = [nanny.pid for nanny in cluster.workers.values()]
        killed = beside.submit(kill_at_work, workers, out / "run0")
        results = run_jobs(jobs, out, dask=cluster.scheduler_address, report=reported.append)
        assert killed.result() in workers
    # Whether there was a state to go on from, the clock decides; it was taken over once.
    assert (out / "run0/run.log").read_text("utf-8").count("is gone and left its lock") == 1
    assert len(reported) == len(jobs)
    for one, other in zip(results, run_jobs(jobs, tmp_path / "here"), strict=True):
        if one.job.name == "slides":
            assert "friction cannot carry" in one.error
            assert "friction cannot carry" in other.error
            continue
        assert one.summary["kinetics"] == other.summary["kinetics"], one.error or other.error
        np.testing.assert_array_equal(surfaces(one.folder), surfaces(other.folder))


def kill_at_work(workers, folder):
    """Kill the worker that runs the job of the folder, after some jumps."""
    wait_until((folder / "jumps/00005.h5").exists)
    for worker in workers:
        if json.loads((folder / LOCK).read_text())["process"] in below(worker):
            os.kill(worker, signal.SIGKILL)
            return worker
    return None


def surfaces(folder):
    """Return both surfaces of all jumps, ``(jumps, 2, nx)``."""
    with h5py.File(folder / "results.h5") as file:
        jumps = file["surfaces/interface"].values()
        return np.array([[jump[f"body_{body}"][()] for body in (1, 2)] for jump in jumps])
