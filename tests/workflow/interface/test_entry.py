"""Tests of ``import fretscale`` in scripts, on stdin, in notebooks, and near equal file names."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import fretscale
import pytest

from tests.conftest import CASES
from tests.workflow.shell.interruptions import PATIENCE, posix_only

ROOT = CASES.parent
# Where `fretscale` is found, whatever is installed.
FACADE = Path(fretscale.__file__).parents[1]


def python(*arguments, cwd, path=(FACADE, ROOT), stdin=None):
    """Run a fresh Python in a folder, as a user would, with ``path`` added to its module path."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, path))}
    command = [sys.executable, *map(str, arguments)]
    return subprocess.run(
        command, cwd=cwd, env=environment, input=stdin, capture_output=True, text=True, check=False
    )


# Our packages as an editable install maps them: looked for after all that lies in a folder.
MAPPED = f"""
import sys
from importlib.machinery import PathFinder

class Mapping:
    @staticmethod
    def find_spec(name, path=None, target=None):
        return None if path else PathFinder.find_spec(name, [{str(FACADE)!r}, {str(ROOT)!r}])

sys.meta_path.append(Mapping)
import fretscale
"""


@pytest.mark.parametrize(
    ("file", "package"),
    [
        ("wear.py", "wear"),
        ("workflow.py", "workflow"),
        ("sa_solver.py", "sa_solver"),
        ("fe_models/__init__.py", "fe_models"),
        ("wear/notes.txt", "wear"),  # beats what is mapped by an editable install
    ],
)
def test_a_file_with_the_name_of_ours_is_told(file, package, tmp_path):
    path = tmp_path / file
    path.parent.mkdir(exist_ok=True)
    path.write_text("", encoding="utf-8")
    ended = python("-c", MAPPED, cwd=tmp_path, path=())
    place = tmp_path / file.partition("/")[0] if file.endswith(".txt") else path
    assert ended.returncode == 1
    assert ended.stderr.splitlines()[-1] == (
        f"ImportError: fretscale: {place} is in the way: it has the name of fretscale's own "
        f"package `{package}`; rename it, or start Python elsewhere"
    )


def test_a_module_that_was_imported_before_is_told(tmp_path):
    code = "import sys, types; sys.modules['wear'] = types.ModuleType('wear'); import fretscale"
    assert "a module `wear` without a file is in the way" in python("-c", code, cwd=tmp_path).stderr


def test_the_packages_may_be_those_of_another_checkout(tmp_path):
    """Packages of another checkout are accepted."""
    other = tmp_path / "other"
    other.mkdir()
    for package in ("sa_solver", "wear", "fe_models", "workflow"):
        (other / package).symlink_to(ROOT / package)
    code = "import fretscale, wear; print(wear.__file__)"
    ended = python("-c", code, cwd=tmp_path, path=(other, FACADE))
    assert ended.stdout.strip() == str(other / "wear" / "__init__.py"), ended.stderr


def test_the_module_is_the_command(tmp_path):
    ended = python("-m", "fretscale", "rum", cwd=tmp_path)
    assert ended.returncode == 2
    assert ended.stderr.startswith("fretscale: No such command 'rum'")


# --- processes of a run ---------------------------------------------------------------------------

IN_A_PROCESS = """
print("once")
from contextlib import closing
from workflow.shell.processes import WorkerProcess
with closing(WorkerProcess()) as beside:
    beside.begin(print, "in a process")()
"""
# Contacts have a process each, and so have figures.
RUN = f"""
import fretscale
results = fretscale.run(
    {str(CASES / "dovetail_small.yaml")!r}, "out", quiet=True, error_budget="known",
    load_path__increments=[3, 5], output__paraview=False,
    stress__section="none", stress__life__parameter="none",
)
"""


@pytest.mark.parametrize("how", ["script", "stdin", "-c"])
def test_a_program_needs_no_guard(how, tmp_path):
    """Unlike multiprocessing, our processes need no guard and do not run the program again."""
    (tmp_path / "script.py").write_text(IN_A_PROCESS, encoding="utf-8")
    arguments = {"script": ["script.py"], "stdin": ["-"], "-c": ["-c", IN_A_PROCESS]}[how]
    ended = python(*arguments, cwd=tmp_path, stdin=IN_A_PROCESS if how == "stdin" else None)
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout == "once\n"
    assert ended.stderr == "in a process\n"


@posix_only
@pytest.mark.parametrize(
    ("encoding", "shown"),
    [
        ("ascii", "stroke 36 um, -3 m^2 +- 1 %, 10^-7 -> \\u4e2d"),
        ("latin-1", "stroke 36 µm, -3 m² ± 1 %, 10^-7 -> \\u4e2d"),
        ("utf-8", "stroke 36 µm, −3 m² ± 1 %, 10⁻⁷ → 中"),
    ],
)
def test_terminals_without_some_letters_have_them_spelled(encoding, shown):
    code = (
        "from workflow.shell.terminal.streams import replace_missing_characters;"
        "replace_missing_characters();"
        "print('stroke 36 µm, −3 m² ± 1 %, 10⁻⁷ → 中')"
    )
    environment = {**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, env=environment, check=True
    )
    assert done.stdout.decode(encoding).strip() == shown


def test_a_program_may_have_no_standard_streams(tmp_path):
    """The processes of the run then have none either."""
    code = (
        "from workflow.shell.terminal.streams import hold_standard_streams; hold_standard_streams()"
    )
    code += IN_A_PROCESS.replace('print("once")', "") + "open('done', 'w')"
    python("-c", f"import os; [os.close(i) for i in range(3)]; {code}", cwd=tmp_path)
    assert (tmp_path / "done").exists()


def answer(client, asked):
    """Return the messages of a kernel about a cell, once it is done."""
    while True:
        reply = client.get_shell_msg(timeout=PATIENCE)
        if reply["parent_header"]["msg_id"] == asked:
            return reply["content"]


@pytest.mark.slow
@posix_only
def test_a_notebook_runs_is_stopped_and_goes_on(tmp_path, monkeypatch):
    pytest.importorskip("ipykernel")
    manager = pytest.importorskip("jupyter_client.manager")
    monkeypatch.setenv("PYTHONPATH", f"{FACADE}{os.pathsep}{ROOT}")
    kernel, client = manager.start_new_kernel(kernel_name="python3", cwd=str(tmp_path))
    try:
        # Otherwise a kernel drops what reaches it soon after an error.
        asked = client.execute(RUN, stop_on_error=False)
        log, end = tmp_path / "out" / "run.log", time.monotonic() + PATIENCE
        while not (log.exists() and "jump 1" in log.read_text("utf-8")):
            assert time.monotonic() < end
            time.sleep(0.05)
        kernel.interrupt_kernel()
        stopped = answer(client, asked)
        assert stopped["ename"] == "KeyboardInterrupt", "\n".join(stopped["traceback"])
        again = answer(client, client.execute(RUN))
        assert again["status"] == "ok", again
    finally:
        client.stop_channels()
        kernel.shutdown_kernel(now=True)
    assert (tmp_path / "out" / "summary.json").exists()
    assert "resume" in log.read_text("utf-8")


@pytest.mark.slow
@posix_only
def test_ctrl_c_ends_a_script_by_its_exception(tmp_path):
    (tmp_path / "script.py").write_text(RUN, encoding="utf-8")
    environment = os.environ | {"PYTHONPATH": f"{FACADE}{os.pathsep}{ROOT}"}
    # What is started in the background of a shell is born deaf to Ctrl-C.
    code = "import runpy, signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
    command = [sys.executable, "-c", code + "runpy.run_path('script.py')"]
    log = tmp_path / "out" / "run.log"
    with subprocess.Popen(command, cwd=tmp_path, env=environment, stderr=subprocess.PIPE) as script:
        assert script.stderr is not None
        end = time.monotonic() + PATIENCE
        while not (log.exists() and "jump 1" in log.read_text("utf-8")):
            assert time.monotonic() < end
            time.sleep(0.05)
        script.send_signal(signal.SIGINT)
        reported = script.stderr.read().decode()
    assert reported.splitlines()[-1].startswith("KeyboardInterrupt")
    with pytest.raises(fretscale.UserError, match="not finished; continue with `fretscale res"):
        fretscale.open(tmp_path / "out")
