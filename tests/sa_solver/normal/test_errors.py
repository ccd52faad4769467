"""The exceptions of the library have a common base class."""

import ast
import pickle
from pathlib import Path

import pytest

from sa_solver.errors import ContactProblemError, ConvergenceError, FretscaleError, InputError
from sa_solver.tangential.contact import FrictionLimitError

ROOT = Path(__file__).parents[3]
BUILT_IN = {"Exception", "ValueError", "RuntimeError", "ArithmeticError", "TypeError", "KeyError"}


def modules(*packages):
    return [path for package in packages for path in sorted((ROOT / package).rglob("*.py"))]


def test_both_kinds_have_the_common_base_and_the_built_in_one():
    assert issubclass(InputError, FretscaleError)
    assert issubclass(InputError, ValueError)
    assert issubclass(ConvergenceError, FretscaleError)
    assert issubclass(ConvergenceError, RuntimeError)
    assert issubclass(ContactProblemError, InputError)


@pytest.mark.parametrize("package", ["sa_solver", "wear", "fe_models"])
def test_no_exception_class_starts_a_hierarchy_of_its_own(package):
    for path in modules(package):
        if path == ROOT / "sa_solver" / "errors.py":
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef) and node.bases:
                bases = {base.id for base in node.bases if isinstance(base, ast.Name)}
                assert not bases or bases - BUILT_IN, f"{path}: {node.name}"


@pytest.mark.parametrize("package", ["sa_solver", "wear"])
def test_no_built_in_exception_is_raised(package):
    for path in modules(package):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
                assert ast.unparse(node.exc.func) not in BUILT_IN, f"{path}:{node.lineno}"


def test_an_error_with_data_travels_between_processes():
    error = pickle.loads(pickle.dumps(FrictionLimitError(0.25, "too much")))
    assert (error.share, str(error)) == (0.25, "too much")
