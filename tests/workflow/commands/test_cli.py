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
from workflow.commands.group import OneLineGroup
from workflow.kinds import kinds
from workflow.shell import memory

CASES = Path(__file__).parents[3] / "cases"
# Only these outside the standard library may be imported to print the help.
LIGHT = {"click", "sa_solver", "workflow"}


def invoke(*arguments):
    return CliRunner().invoke(cli, [str(argument) for argument in arguments])


def imported_by(arguments):
    """Return the top-level modules that a command imports."""
    code = f"""
import sys
before = set(sys.modules)
from workflow.cli import cli
from workflow.commands.group import OneLineGroup
try:
    cli({arguments})
except SystemExit as end:
    assert end.code == 0
print("\\nIMPORTED", *({{name.partition(".")[0] for name in set(sys.modules) - before}}))
"""
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return set(done.stdout.split("IMPORTED")[1].split())


@pytest.mark.parametrize("arguments", [["--help"], ["run", "--help"], ["--version"]])
def test_help_imports_nothing_heavy(arguments):
    assert imported_by(arguments) - sys.stdlib_module_names <= LIGHT


@pytest.mark.parametrize("case", ["dovetail", "sphere_normal"])
def test_check_imports_neither_solvers_nor_screens(case):
    imported = imported_by(["check", str(CASES / f"{case}.yaml")])
    assert not imported & {"scipy", "skfem", "numba", "gmsh", "matplotlib", "rich", "filelock"}


@pytest.mark.parametrize(
    "path",
    sorted([*CASES.glob("*.yaml"), *CASES.glob("validation/*.yaml")]),
    ids=lambda path: path.stem,
)
@pytest.mark.usefixtures("reads_here")
def test_cases_of_the_repository_check(path):
    result = invoke("check", path)
    assert (result.exit_code, result.stderr) == (0, "")
    assert result.stdout.startswith(f"OK {path}: ")


def test_check_prints_the_grid_and_the_increments(dovetail_path):
    result = invoke("check", dovetail_path)
    assert result.exit_code == 0
    assert "96 x 192 cells" in result.stdout
    assert "22 increments" in result.stdout


def test_check_refuses_what_the_memory_cannot_hold_as_run_does(dovetail_path):
    """Both flanks condensed onto 90,000 degrees of freedom need 200 GB of full matrices."""
    result = invoke("check", dovetail_path, "--set", "mesh.flank_nodes=[101, 151]")
    assert result.exit_code == 4
    assert "mesh.flank_nodes" in result.stderr
    assert "OK" not in result.stdout


@pytest.mark.parametrize(
    ("setting", "exit_code"),
    [
        ("contact.method=normal", 0),
        ("contact.method=nodes", 4),
        ("nonlinearity.stiffness=relinearised", 4),
    ],
)
def test_check_knows_which_joints_do_without_full_matrices(
    dovetail_path, monkeypatch, setting, exit_code
):
    """Full matrices of both flanks need 7 GB, and factors of the bodies 4 GB."""
    monkeypatch.setattr(memory, "_available_bytes", lambda: 8e9)
    fine = "mesh={flank_nodes: [41, 69], size: 12 mm, notch: 16, order: 1}"
    settings = fine, setting, "wear.step={kind: second_order}"
    result = invoke("check", dovetail_path, *(f"--set={entry}" for entry in settings))
    assert result.exit_code == exit_code, result.stderr


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
        whole = invoke("new", kind).stdout.splitlines()
        assert 1.5 * len(path.read_text("utf-8").splitlines()) < len(whole)
    # What is there is left as it is.
    path.unlink()
    for file in beside:
        file.write_text("mine", encoding="utf-8")
    assert invoke("new", kind, path, *options).stdout == ""
    assert [file.read_text("utf-8") for file in beside] == ["mine"] * len(beside)


@pytest.mark.parametrize(
    ("kind", "name", "named"), [("sweep", "check", "sweep"), ("fit_joint", "check", "fit")]
)
def test_the_file_of_another_command_names_that_command(kind, name, named, tmp_path):
    path = tmp_path / "mine.yaml"
    invoke("new", kind, path)
    ended = invoke(name, path)
    assert ended.exit_code == 2
    assert f"fretscale {named} {path}" in ended.stderr


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["frobnicate"], "frobnicate"),
        (["run", "case.yaml"], "--out"),
        (["new", "firtree"], "dovetail"),
        (["resume", "/no/such/folder"], "/no/such/folder"),
        (["run", "none.yaml", "--out", "out"], "none.yaml"),
    ],
)
def test_wrong_usage_is_one_line(arguments, named):
    result = invoke(*arguments)
    assert result.exit_code == 2
    (line,) = result.stderr.splitlines()
    assert named in line


@pytest.mark.parametrize(
    ("ending", "code"),
    [
        (None, 0),
        (errors.ExpectationMissed("depth"), 1),
        (errors.UserError("out"), 2),
        (errors.MethodFailed("residual"), 3),
        (InputError("pulls"), 2),
        (ConvergenceError("residual"), 3),
        (FactorMemoryError("condensing", 90e9, 8e9), 4),
        (errors.OutOfMemory("needs"), 4),
        (MemoryError(), 4),
        (KeyboardInterrupt(), 130),
        (PermissionError(13, "Permission denied", "/out"), 2),
        (ImportError("libGLU.so.1: cannot open shared object file"), 3),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, BaseException) else None,
)
def test_endings_have_their_exit_code(monkeypatch, dovetail_path, tmp_path, ending, code):
    def run_case(case, out, force, loudness):
        if ending is not None:
            raise ending

    stand_in = types.ModuleType("workflow.runs.run")
    stand_in.run_case = run_case
    monkeypatch.setitem(sys.modules, "workflow.runs.run", stand_in)
    result = invoke("run", dovetail_path, "--out", tmp_path, "--force")
    assert result.exit_code == code
    assert len([line for line in result.stderr.splitlines() if line]) == (ending is not None)


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


def test_a_file_that_ends_early_is_no_interruption():
    """Click takes the end of any file for that of the input, and would end the command quietly."""
    group = OneLineGroup("fretscale")

    @group.command()
    def read():
        raise EOFError("marshal data too short")

    with pytest.raises(EOFError, match="marshal"):
        group.main(["read"])
