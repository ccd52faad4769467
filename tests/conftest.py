"""Shared by all tests: one thread per process, and the cases of the repository."""

import os
from pathlib import Path

import pytest

# Before numpy is imported: its threads would fight with the other test processes.
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

CASES = Path(__file__).parent.parent / "cases"


@pytest.fixture(scope="session")
def dovetail_path() -> Path:
    """The default case."""
    return CASES / "dovetail.yaml"


@pytest.fixture(scope="session")
def dovetail_text(dovetail_path: Path) -> str:
    """Its text."""
    return dovetail_path.read_text(encoding="utf-8")


@pytest.fixture
def reads_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Mesh and CAD files are read by the process of the test, which is quicker."""
    name = "fe_models.geometry.imported.read_apart"
    monkeypatch.setattr(name, lambda read, *arguments: read(*arguments))
