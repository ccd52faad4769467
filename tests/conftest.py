"""Shared by all tests: one thread per process, and the cases of the repository."""

import gc
import os
from pathlib import Path

import pytest

# Before numpy is imported: its threads would fight with the other test processes.
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

CASES = Path(__file__).parent.parent / "cases"


def pytest_collection() -> None:
    """What is collected stays: there is nothing to search for garbage before its end."""
    gc.disable()


@pytest.hookimpl(trylast=True)  # of the tests that are selected
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Bring long tests to the front of both halves, with which two workers begin.

    They take short ones from each other in the end: no core is left idle while a long one ends.
    """
    long = [item for item in items if item.get_closest_marker("long")]
    short = [item for item in items if not item.get_closest_marker("long")]
    first, second = long[::2], long[1::2]
    rest = len(items) // 2 - len(first)
    items[:] = [*first, *short[:rest], *second, *short[rest:]]


@pytest.hookimpl(trylast=True)
def pytest_collection_finish() -> None:
    """Keep the libraries and thousands of tests out of what is searched for garbage again."""
    gc.collect()
    gc.freeze()
    gc.enable()


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
