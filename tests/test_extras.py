"""Each extra of pyproject.toml suffices for its purpose when it is installed alone.

The package is built and installed as by a user, not used from this checkout. Every environment
starts as a copy (by links) of one with only the packages needed to run.
"""

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"][
    "optional-dependencies"
]
SOURCES = ("workflow", "fe_models", "sa_solver", "wear", "pyproject.toml", "README.md", "LICENSE")
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
    quietly = ("-q", "--disable-pip-version-check", "-c", str(ROOT / "constraints.txt"))
    python(folder, "-m", "pip", "install", *quietly, *what)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the package from a copy, because a build leaves files in its folder."""
    place = tmp_path_factory.mktemp("wheel")
    for name in SOURCES:
        copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        copy(ROOT / name, place / name)
    subprocess.run(
        [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", place, place], check=True
    )
    (built,) = place.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def bare(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return an environment with only the packages needed to run."""
    folder = tmp_path_factory.mktemp("bare") / "env"
    subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    install(folder, str(wheel))
    return folder


@pytest.mark.slow
@pytest.mark.long
def test_each_extra_alone_does_its_job(bare, wheel, tmp_path):
    # `make test` and `make docs` begin in a fresh clone with nothing but these two.
    assert JOBS.keys() == {None, *EXTRAS} - {"test", "docs"}
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
