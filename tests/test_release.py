"""The release: what is built is complete, and works where nothing else is installed.

The package is built and installed as by a user, not used from this checkout. It runs with each
Python that its classifiers name, and each extra of pyproject.toml suffices for its purpose when it
is installed alone.
"""

import os
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
EXTRAS, VERSION = PROJECT["optional-dependencies"], PROJECT["version"]
PYTHON = "Programming Language :: Python :: 3."
PYTHONS = [name.split()[-1] for name in PROJECT["classifiers"] if name.startswith(PYTHON)]
THIS_PYTHON = "{}.{}".format(*sys.version_info)
PACKAGES = ("workflow", "fe_models", "sa_solver", "wear")
SOURCES = (*PACKAGES, "pyproject.toml", "README.md", "LICENSE")
FACADE = "workflow/facade/"
# What pip may be told by its environment; everything else of it stays out.
OF_PIP = ("PIP_", "SSL_", "REQUESTS_", "HTTP_", "HTTPS_", "NO_PROXY")

# Programs, each run where only its extra is installed, and the last line that they print.
RUN = """\
import fretscale
run = fretscale.run(
    "ball.yaml", "out", quiet=True, contact__grid=[16, 16], output__paraview=False,
    output__figures=False,
)
"""
SWEEP = """
import subprocess, sys
from pathlib import Path
from distributed import LocalCluster
options = {"processes": False, "protocol": "tcp://", "dashboard_address": None}
with LocalCluster(n_workers=1, host="127.0.0.1", **options) as cluster:
    command = [sys.executable, "-m", "fretscale", "sweep", "sweep.yaml", "--out", "swept"]
    subprocess.run([*command, "--dask", cluster.scheduler_address], check=True)
print(len(list(Path("swept/runs").glob("*/summary.json"))))
"""
SCAN = """
from pathlib import Path
import numpy as np
from sa_solver.surfaces.scans import Scan
from workflow.case.files.scan_files import read_scan, write_scan
heights = 1e-3 * np.random.default_rng(1).normal(size=(12, 9))
write_scan(Path("scan.x3p"), Scan(heights, (2e-3, 2e-3)))
print(np.allclose(read_scan("scan.x3p", None, None).heights, heights, atol=1e-8))
"""
MATRICES = """
from pathlib import Path
import numpy as np
from pyyeti.nastran import op4
from fe_models.matrices.nastran import read_op4
op4.write("a.op4", {"KAA": np.diag([1.0, 2.0, 3.0])})
(stiffness,) = read_op4(Path("a.op4")).matrices.values()
print(np.trace(stiffness()))
"""
JOBS = {
    None: (RUN + 'print(len(run["history"].pandas()))', "1"),
    "cluster": (SWEEP, "1"),
    "nastran": (MATRICES, "6.0"),
    "profilometer": (SCAN, "True"),
    "bench": ("import tamaas; print(hasattr(tamaas, 'PolonskyKeerRey'))", "True"),
}


def python(folder: Path, *arguments: str, cwd: Path | None = None) -> str:
    """Run the Python of an environment in a shell without settings, and return its output."""
    kept = {name: value for name, value in os.environ.items() if name.startswith(OF_PIP)}
    kept |= {"PATH": os.environ["PATH"], "HOME": os.environ["HOME"], "LANG": "C.UTF-8"}
    command = [str(folder / "bin" / "python"), *arguments]
    ended = subprocess.run(command, cwd=cwd, env=kept, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return ended.stdout


def install(folder: Path, *what: str) -> None:
    """Install packages in the versions that everything is tested with."""
    # Most of what is installed is never imported here.
    quietly = ("-q", "--disable-pip-version-check", "--no-compile")
    versions = ("-c", str(ROOT / "constraints.txt"))
    python(folder, "-m", "pip", "install", *quietly, *versions, *what)


def found(version: str) -> str | None:
    """Return a Python of this version that can make environments, or None.

    It is the one that runs the tests, one of the PATH, or one that is installed next to the former.
    """
    name = f"python{version}"
    beside = Path(sys.base_prefix).parent.glob(f"{version}.*/bin/{name}")
    code = "import ensurepip, sys; print('{}.{}'.format(*sys.version_info))"
    for candidate in filter(None, (sys.executable, shutil.which(name), *sorted(beside))):
        command = [candidate, "-I", "-c", code]
        ended = subprocess.run(command, capture_output=True, text=True, check=False)
        if ended.stdout.strip() == version:
            return str(candidate)
    return None


def environment(folder: Path, version: str, wheel: Path) -> None:
    """Install the package in an empty environment; skip the test where this Python is absent."""
    interpreter = found(version)
    if interpreter is None:
        pytest.skip(f"needs Python {version}")
    subprocess.run([interpreter, "-m", "venv", folder], check=True)
    install(folder, str(wheel))


@pytest.fixture(scope="module")
def release(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the sdist, and the wheel from it, in a copy, because a build leaves files behind."""
    place = tmp_path_factory.mktemp("release")
    for name in SOURCES:
        copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        copy(ROOT / name, place / name)
    subprocess.run([sys.executable, "-m", "build", "-q", place], check=True)
    return place / "dist"


@pytest.fixture(scope="module")
def wheel(release: Path) -> Path:
    """Return the built wheel."""
    (built,) = release.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def bare(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Return an environment with only the packages needed to run."""
    folder = tmp_path_factory.mktemp("bare") / "env"
    environment(folder, THIS_PYTHON, wheel)
    yield folder
    shutil.rmtree(folder)


def test_the_version_is_the_same_everywhere():
    assert yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))["version"] == VERSION


@pytest.mark.slow
def test_what_is_built_is_complete(release, wheel):
    """Wheel and sdist hold every file of the packages, and the licence."""
    sources = {
        path.relative_to(ROOT).as_posix()
        for package in PACKAGES
        for path in (ROOT / package).rglob("*")
        if path.is_file() and not {"__pycache__", "fretscale.egg-info"} & {*path.parts}
    }
    about = f"fretscale-{VERSION}.dist-info/"
    with zipfile.ZipFile(wheel) as built:
        installed = {name for name in built.namelist() if not name.startswith(about)}
        assert f"{about}licenses/LICENSE" in built.namelist()
        assert b"fretscale = fretscale.__main__:main" in built.read(f"{about}entry_points.txt")
    assert installed == {name.removeprefix(FACADE) for name in sources}
    with tarfile.open(release / f"fretscale-{VERSION}.tar.gz") as packed:
        names = {name.partition("/")[2] for name in packed.getnames()}
    assert names >= sources | {"LICENSE", "README.md", "pyproject.toml"}


def check_command(folder: Path, place: Path) -> None:
    """Check that the command of an environment offers, checks and runs a case."""

    def fretscale(*arguments: str) -> str:
        return python(folder, str(folder / "bin" / "fretscale"), *arguments, cwd=place)

    assert fretscale("--help").startswith("Usage: fretscale")
    fretscale("new", "bodies", "ball.yaml")
    assert "memory" in fretscale("check", "ball.yaml")
    smaller = ("contact.grid=[16, 16]", "output={figures: false, paraview: false}")
    options = [part for entry in smaller for part in ("--set", entry)]
    fretscale("run", "ball.yaml", "--out", "out", *options)
    assert (place / "out" / "summary.json").exists()


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("version", [name for name in PYTHONS if name != THIS_PYTHON])
def test_other_pythons_run_the_command(version, wheel, tmp_path):
    environment(tmp_path / "env", version, wheel)
    check_command(tmp_path / "env", tmp_path)
    shutil.rmtree(tmp_path / "env")


@pytest.mark.slow
@pytest.mark.long
def test_each_extra_alone_does_its_job(bare, wheel, tmp_path):
    # `make test` and `make docs` begin in a fresh clone with nothing but these two.
    assert JOBS.keys() == {None, *EXTRAS} - {"test", "docs"}
    check_command(bare, tmp_path)
    for extra, (code, printed) in JOBS.items():
        folder, place = tmp_path / "env", tmp_path / str(extra)
        place.mkdir()
        shutil.copytree(bare, folder, symlinks=True, copy_function=os.link)
        if extra:
            install(folder, f"{wheel}[{extra}]")
        python(folder, "-m", "fretscale", "new", "bodies", "ball.yaml", cwd=place)
        (place / "sweep.yaml").write_text(
            "case: ball.yaml\nvary: {friction.coefficient: {values: [0.5]}}\n"
        )
        (place / "job.py").write_text(code, encoding="utf-8")
        assert python(folder, "job.py", cwd=place).splitlines()[-1] == printed, extra
        shutil.rmtree(folder)
