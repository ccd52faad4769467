"""Settings of tests of models, some of which compare a model with the run of a case."""

from collections.abc import Iterator

import pytest

from tests.workflow.command_line import runs_here


@pytest.fixture(scope="session", autouse=True)
def _all_here() -> Iterator[None]:
    """Compute contacts in the process of the test, as in the tests of runs."""
    with runs_here():
        yield
