"""Runs where the system differs from ours: names of folders, and modules that only POSIX has."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import fretscale
import h5py
import pytest

from tests.conftest import CASES
from tests.workflow.command_line import invoke, runs_here
from workflow.case.text.writing import dump_case
from workflow.kinds import load_case

ROOT = CASES.parent
FACADE = Path(fretscale.__file__).parents[1]
PACKAGES = ("sa_solver", "wear", "fe_models", "workflow")
# Modules of Python that Windows does not have.
POSIX_MODULES = ("fcntl", "grp", "pwd", "resource", "termios")
# psutil has a part of its own for each system, and is therefore imported before.
HIDE = f"import psutil, sys; sys.modules.update(dict.fromkeys({POSIX_MODULES!r})); "

SMALL = (
    "load_path.increments=[3, 5]",
    "mesh={flank_nodes: [5, 7], size: 12 mm, notch: 16}",
    "contact.grid=[16, 32]",
    "wear.cycles=1e4",
    "error_budget=known",
    "output={figures: false, paraview: false}",
    "stress={section: none, life: {parameter: none}}",
)

# Every module is imported, in the main process and as those of a run need it, and a case is run in
# processes that lack the same modules.
WITHOUT = f"""
{HIDE}
from pkgutil import walk_packages
import fretscale
from fe_models import interpreter
interpreter.COMMAND = {HIDE!r} + interpreter.COMMAND
for name in {PACKAGES!r}:
    package = __import__(name)
    for module in walk_packages(package.__path__, name + "."):
        if module.name not in {{"workflow.pictures.view_script"}}:
            __import__(module.name)
from workflow.cli import main
main()
"""


def run(code: str, *arguments: object, path: tuple[Path, ...], cwd: Path) -> str:
    """Run a program in a fresh Python, and return what it printed."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, path))}
    command = [sys.executable, "-c", code, *map(str, arguments)]
    ended = subprocess.run(
        command, cwd=cwd, env=environment, capture_output=True, encoding="utf-8", check=False
    )
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


def arrays(folder: Path) -> dict[str, bytes]:
    """Return all arrays of the results in a folder."""
    found: dict[str, bytes] = {}

    def collect(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset):
            found[name] = item[()].tobytes()

    with h5py.File(folder / "results.h5") as file:
        file.visititems(collect)
    return found


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the path of a case with two contacts."""
    path = tmp_path_factory.mktemp("case") / "case.yaml"
    path.write_text(dump_case(load_case(CASES / "dovetail_small.yaml", SMALL)), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def reference(case: Path) -> dict[str, bytes]:
    """Return the results of the case in a run that starts no other process."""
    out = case.parent / "out"
    with runs_here():
        ended = invoke("run", case, "--out", out)
    assert ended.exit_code == 0, ended.stderr
    return arrays(out)


@pytest.mark.slow
def test_processes_run_in_folders_of_any_name(case, reference, tmp_path):
    """The program, its case and its results may lie in folders with blanks and any letters."""
    place = tmp_path / "Reibung & Verschleiß, 微动 'magnétique'"
    place.mkdir()
    for package in PACKAGES:
        (place / package).symlink_to(ROOT / package)
    shutil.copy(case, place / "größe 1.yaml")
    sweep = place / "plan à deux.yaml"
    sweep.write_text(
        "case: größe 1.yaml\nvary: {friction.coefficient: {values: [0.4]}}\n", encoding="utf-8"
    )
    # A sweep has a process for each run, and the run one for each of its contacts.
    code = "from workflow.cli import main; main()"
    arguments = ["sweep", sweep.name, "--out", "sortie été"]
    run(code, *arguments, path=(place, FACADE), cwd=place)
    (results,) = place.glob("sortie été/runs/*/results.h5")
    assert arrays(results.parent) == reference


@pytest.mark.slow
def test_nothing_needs_a_module_that_windows_lacks(case, reference, tmp_path):
    run(WITHOUT, "run", case, "--out", tmp_path / "out", path=(ROOT, FACADE), cwd=tmp_path)
    assert arrays(tmp_path / "out") == reference
