"""The exceptions of the library have a common base class."""

import ast
import pickle

import pytest

from sa_solver.errors import ContactProblemError, ConvergenceError, FretscaleError, InputError
from sa_solver.tangential.contact import FrictionLimitError
from tests.source_trees import modules

BUILT_IN = {"Exception", "ValueError", "RuntimeError", "ArithmeticError", "TypeError", "KeyError"}


def test_both_kinds_have_the_common_base_and_the_built_in_one():
    assert issubclass(InputError, FretscaleError)
    assert issubclass(InputError, ValueError)
    assert issubclass(ConvergenceError, FretscaleError)
    assert issubclass(ConvergenceError, RuntimeError)
    assert issubclass(ContactProblemError, InputError)


@pytest.mark.parametrize("package", ["sa_solver", "wear", "fe_models"])
def test_no_exception_class_starts_a_hierarchy_of_its_own(package):
    for name, module in modules(package).items():
        if name == "sa_solver.errors":
            continue
        for node in ast.walk(module):
            if isinstance(node, ast.ClassDef) and node.bases:
                bases = {base.id for base in node.bases if isinstance(base, ast.Name)}
                assert not bases or bases - BUILT_IN, f"{name}: {node.name}"


@pytest.mark.parametrize("package", ["sa_solver", "wear"])
def test_no_built_in_exception_is_raised(package):
    for name, module in modules(package).items():
        for node in ast.walk(module):
            if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
                assert ast.unparse(node.exc.func) not in BUILT_IN, f"{name}:{node.lineno}"


def test_an_error_with_data_travels_between_processes():
    error = pickle.loads(pickle.dumps(FrictionLimitError(0.25, "too much")))
    assert (error.share, str(error)) == (0.25, "too much")
