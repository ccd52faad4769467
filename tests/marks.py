"""Variants of a check that ``make test-full`` runs and ``make test`` does not."""

from typing import Any

import pytest


def slow(*values: Any) -> Any:
    """Parameters of a test that take long, where others of it show the same quickly."""
    return pytest.param(*values, marks=pytest.mark.slow)
