"""Every public name is there and has its sentence; none is imported before it is asked for."""

import importlib
import subprocess
import sys

import pytest

PACKAGES = ("fe_models", "fe_models.dynamics", "fe_models.geometry")


@pytest.mark.parametrize("name", PACKAGES)
def test_public_names_are_there_and_described(name):
    package = importlib.import_module(name)
    for public in package.__all__:
        assert callable(getattr(package, public))
        assert f"``{public}``" in package.__doc__
    with pytest.raises(AttributeError, match=f"module '{name}' has no attribute 'nothing'"):
        _ = package.nothing


def test_packages_are_imported_without_what_they_need():
    lines = f"import sys, {', '.join(PACKAGES)}; print('numpy' in sys.modules)"
    said = subprocess.run(
        [sys.executable, "-c", lines], capture_output=True, text=True, check=True, timeout=60
    )
    assert said.stdout.split() == ["False"]
