"""Settings of all tests: one thread per process, and the cases of the repository."""

import gc
import os
from pathlib import Path

import pytest

# Set before numpy is imported, because its threads would compete with the other test processes.
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

CASES = Path(__file__).parent.parent / "cases"


def pytest_collection() -> None:
    """Disable garbage collection while tests are collected, since all collected objects remain."""
    gc.disable()


@pytest.hookimpl(trylast=True)  # of the tests that are selected
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Move long tests to the front of both halves, with which two workers begin.

    Workers take short tests from each other in the end, so no core idles while a long one ends.
    """
    long = [item for item in items if item.get_closest_marker("long")]
    short = [item for item in items if not item.get_closest_marker("long")]
    first, second = long[::2], long[1::2]
    rest = len(items) // 2 - len(first)
    items[:] = [*first, *short[:rest], *second, *short[rest:]]


@pytest.hookimpl(trylast=True)
def pytest_collection_finish() -> None:
    """Exclude the libraries and thousands of tests from further garbage collections."""
    gc.collect()
    gc.freeze()
    gc.enable()


@pytest.fixture(scope="session")
def dovetail_path() -> Path:
    """Return the path of the default case."""
    return CASES / "dovetail.yaml"


@pytest.fixture(scope="session")
def dovetail_text(dovetail_path: Path) -> str:
    """Return the text of the default case."""
    return dovetail_path.read_text(encoding="utf-8")


@pytest.fixture
def reads_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Read mesh and CAD files in the process of the test, which is faster."""
    name = "fe_models.geometry.imported.read_in_subprocess"
    monkeypatch.setattr(name, lambda read, *arguments: read(*arguments))
