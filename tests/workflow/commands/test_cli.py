"""Tests of the command: its output, its response time, and its endings."""

import shutil
import subprocess
import sys
import types
from pathlib import Path

import pytest
from click.testing import CliRunner

from fe_models.solvers.linear_solver import FactorMemoryError
from sa_solver.errors import ConvergenceError, InputError
from workflow import errors
from workflow.cli import cli
from workflow.fit.template import FITS
from workflow.kinds import kinds, load_case
from workflow.shell import system_check

CASES = Path(__file__).parents[3] / "cases"
# Only these outside the standard library may be imported to print the help.
LIGHT = {"click", "sa_solver", "workflow"}


def invoke(*arguments):
    return CliRunner().invoke(cli, [str(argument) for argument in arguments])


@pytest.mark.parametrize("arguments", [["--help"], ["run", "--help"], ["--version"]])
def test_help_imports_nothing_heavy(arguments):
    code = f"""
import sys
before = set(sys.modules)
from workflow.cli import cli
try:
    cli({arguments})
except SystemExit as end:
    assert end.code == 0
print("\\nIMPORTED", *({{name.partition(".")[0] for name in set(sys.modules) - before}}))
"""
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    imported = set(done.stdout.split("IMPORTED")[1].split())
    assert imported - sys.stdlib_module_names <= LIGHT


def test_case_without_units_needs_no_pint(dovetail_path, tmp_path):
    """Importing pint would take longer than the rest of reading a case."""
    from workflow.case.text.writing import dump_case

    path = tmp_path / "bare.yaml"
    path.write_text(dump_case(load_case(dovetail_path)), encoding="utf-8")
    code = f"""
import sys
from workflow.kinds import load_case
load_case({str(path)!r})
assert "pint" not in sys.modules
"""
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize(
    "path",
    sorted([*CASES.glob("*.yaml"), *CASES.glob("validation/*.yaml")]),
    ids=lambda path: path.stem,
)
def test_cases_of_the_repository_check(path):
    result = invoke("check", path)
    assert (result.exit_code, result.stderr) == (0, "")
    assert result.stdout.startswith(f"OK {path}: ")


def test_check_says_what_would_run(dovetail_path):
    result = invoke("check", dovetail_path)
    assert result.exit_code == 0
    first, *rows = result.stdout.splitlines()
    assert first == f"OK {dovetail_path}: Ti-6Al-4V dovetail, one mission per cycle"
    assert "128 x 256 cells" in result.stdout
    assert "22 increments" in result.stdout
    assert "implicit steps, for an error of 1 % of the depth" in result.stdout
    assert len(rows) < 13


def test_check_refuses_what_the_memory_cannot_hold_as_run_does(dovetail_path):
    """Both flanks condensed onto 90,000 degrees of freedom need 400 GB of dense matrices."""
    result = invoke("check", dovetail_path, "--set", "mesh.flank_nodes=[100, 150]")
    assert result.exit_code == 4
    assert "mesh.flank_nodes" in result.stderr
    assert "OK" not in result.stdout


@pytest.mark.parametrize("kind", kinds())
def test_new_writes_a_case_that_checks(tmp_path, template_files, kind):
    shutil.copytree(template_files, tmp_path, dirs_exist_ok=True)
    path = tmp_path / "mine.yaml"
    assert invoke("new", kind, path).exit_code == 0
    checked = invoke("check", path)
    assert checked.exit_code == 0
    assert invoke("new", kind).stdout == path.read_text(encoding="utf-8")
    again = invoke("new", kind, path)
    assert (again.exit_code, again.stderr.count("\n")) == (2, 1)
    assert "exists" in again.stderr


@pytest.mark.parametrize("options", [[], ["--short"]])
@pytest.mark.parametrize("kind", [*kinds(), "sweep"])
def test_new_brings_what_the_case_names(kind, options, tmp_path):
    """All files except the mesh of a user's structure are written; examples are valid cases."""
    path = tmp_path / "mine.yaml"
    if kind == "sweep":
        options = []
    written = invoke("new", kind, path, *options)
    assert written.exit_code == 0, written.stderr
    if kind == "mesh":
        return
    beside = [file for file in tmp_path.iterdir() if file != path]
    assert sorted(line.split(": ")[0] for line in written.stdout.splitlines()) == sorted(
        map(str, beside)
    )
    cases = [file for file in (path, *beside) if file.suffix == ".yaml" and kind != "sweep"]
    for case in cases:
        checked = invoke("check", case)
        assert checked.exit_code == 0, checked.stderr
    if options:
        assert len(path.read_text("utf-8").splitlines()) < 50
    # What is there is left as it is.
    path.unlink()
    for file in beside:
        file.write_text("mine", encoding="utf-8")
    assert invoke("new", kind, path, *options).stdout == ""
    assert [file.read_text("utf-8") for file in beside] == ["mine"] * len(beside)


@pytest.mark.slow
def test_an_example_runs_to_its_end(tmp_path):
    path = tmp_path / "mine.yaml"
    invoke("new", "resultants", path, "--short")
    quick = ["--set", "output.figures=false", "--set", "output.paraview=false"]
    ended = invoke("run", path, "--out", tmp_path / "out", *quick)
    assert ended.exit_code == 0, ended.stderr


@pytest.mark.parametrize(
    ("kind", "arguments", "named"),
    [
        ("sweep", ["check"], "sweep"),
        ("fit_joint", ["check"], "fit"),
        ("sweep", ["fit", "--out", "out"], "sweep"),
        ("bodies", ["sweep", "--out", "out"], "run"),
        ("bodies", ["fit", "--out", "out"], "run"),
    ],
)
def test_the_file_of_another_command_names_that_command(kind, arguments, named, tmp_path):
    path = tmp_path / "mine.yaml"
    invoke("new", kind, path)
    name, *options = arguments
    ended = invoke(name, path, *options)
    assert ended.exit_code == 2
    assert f"`fretscale {named} {path}" in ended.stderr


def test_new_alone_lists_the_kinds_in_plain_words():
    lines = invoke("new").stdout.splitlines()
    assert [line.split()[0] for line in lines] == [*kinds(), "sweep", *FITS]
    assert all(len(line) < 100 for line in lines)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["frobnicate"], "frobnicate"),
        (["run"], "CASE"),
        (["run", "case.yaml"], "--out"),
        (["check", "a", "--fast"], "--fast"),
        (["new", "firtree"], "dovetail"),
        (["new", "dovetail", "/no/such/folder/case.yaml"], "/no/such/folder/case.yaml"),
        (["resume", "/no/such/folder"], "/no/such/folder"),
        (["run", "none.yaml", "--out", "out"], "none.yaml"),
    ],
)
def test_wrong_usage_is_one_line(arguments, words):
    result = invoke(*arguments)
    assert result.exit_code == 2
    (line,) = result.stderr.splitlines()
    assert line.startswith("fretscale: ")
    assert words in line


LIBRARY_MISSING = "libGLU.so.1: cannot open shared object file: No such file or directory"


@pytest.mark.parametrize(
    ("ending", "code", "words"),
    [
        (None, 0, ""),
        (errors.ExpectationMissed("depth 3 instead of 2"), 1, "depth 3 instead of 2"),
        (errors.UserError("out: exists"), 2, "out: exists"),
        (errors.MethodFailed("residual 1e-2 after 500; try more"), 3, "residual 1e-2"),
        (InputError("a load of -3 N pulls: give P >= 0"), 2, "pulls"),
        (ConvergenceError("stopped at a residual of 1e-2"), 3, "residual of 1e-2"),
        (FactorMemoryError("condensing", 90e9, 8e9), 4, "90 GB"),
        (errors.OutOfMemory("needs 90 GB, there are 8"), 4, "90 GB"),
        (MemoryError(), 4, "out of memory"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (KeyboardInterrupt("go on with `it`"), 130, "interrupted: go on with `it`"),
        (PermissionError(13, "Permission denied", "/out"), 2, "/out: Permission denied"),
        (OSError(LIBRARY_MISSING), 3, "libGLU"),
        (ImportError(LIBRARY_MISSING), 3, "libGLU"),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, BaseException) else None,
)
def test_endings_have_their_exit_code(monkeypatch, dovetail_path, tmp_path, ending, code, words):
    def run_case(case, out, force, loudness):
        assert case == load_case(dovetail_path, ["friction.coefficient=0.3"])
        assert (out, force, loudness.name) == (tmp_path, True, "NORMAL")
        if ending is not None:
            raise ending

    stand_in = types.ModuleType("workflow.runs.run")
    stand_in.run_case = run_case
    monkeypatch.setitem(sys.modules, "workflow.runs.run", stand_in)
    monkeypatch.setattr(system_check, "missing_packages", list)
    result = invoke(
        *("run", dovetail_path, "--out", tmp_path, "--force"), "--set", "friction.coefficient=0.3"
    )
    assert result.exit_code == code
    lines = result.stderr.split("\n")
    assert len([line for line in lines if line]) == (ending is not None)
    assert words in result.stderr
    assert "Traceback" not in result.stderr


def test_verify_reports_by_exit_code(monkeypatch, dovetail_path, tmp_path):
    for passed in (True, False):

        def verify_cases(paths, out, loudness, passed=passed):
            assert (paths, out) == ((dovetail_path,), tmp_path)
            return passed

        stand_in = types.ModuleType("workflow.runs.verify")
        stand_in.verify_cases = verify_cases
        monkeypatch.setitem(sys.modules, "workflow.runs.verify", stand_in)
        done = invoke("verify", dovetail_path, "--out", tmp_path)
        assert done.exit_code == (0 if passed else 1)
