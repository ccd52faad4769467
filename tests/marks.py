"""Variants of a check that ``make test-full`` runs and ``make test`` does not."""

from typing import Any

import pytest


def slow(*values: Any) -> Any:
    """Mark parameters of a test as slow if other parameters show the same quickly."""
    return pytest.param(*values, marks=pytest.mark.slow)
