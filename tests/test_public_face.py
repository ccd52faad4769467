"""Tests of the public names of the libraries and of their dependencies."""

import ast
import dataclasses
import doctest
import importlib
import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
FACES = ["sa_solver", "wear", "wear.fitting", "wear.joints"]
FACES += ["fe_models", "fe_models.dynamics", "fe_models.geometry", "fe_models.matrices"]
FACES += ["fretscale"]
LARGEST = 28
# More than a reader takes in at once, where names come from several packages.
MOST_NAMES = {"sa_solver": 24, "fretscale": 55}
# A protocol and a base, which name what implements them, ...
WITHOUT_EXAMPLE = {"LoadSource", "Observer", "WearLaw"}
# ... and what the examples of CoupledWear and of the other steppers show at work.
WITHOUT_EXAMPLE |= {"Contacts", "CoupledState", "ImplicitStepper", "SecondOrderStepper"}
INSTALLED = {"numpy", "scipy", "numba", "llvmlite", "pyfftw"}

REFUSING = """
import importlib, pkgutil, sys

ALLOWED = {allowed} | set(sys.stdlib_module_names)

class Refuse:
    def find_spec(self, name, path=None, target=None):
        package = name.partition(".")[0]
        if package not in ALLOWED and not package.startswith("_sysconfigdata"):
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Refuse())
for package in map(importlib.import_module, {packages}):
    for module in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        importlib.import_module(module.name)
    for name in package.__all__:
        getattr(package, name)
"""


@pytest.mark.parametrize("package", [["sa_solver"], ["sa_solver", "wear"]], ids=lambda p: p[-1])
def test_all_modules_import_with_the_numerical_libraries_alone(package):
    """Importing anything beyond ``pip install numpy scipy numba pyfftw`` is refused."""
    code = REFUSING.format(allowed=INSTALLED | set(package), packages=package)
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert done.returncode == 0, done.stderr


def test_the_library_itself_imports_nothing_heavy():
    code = f"import sys, {', '.join(FACES)}; assert 'numpy' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


@pytest.mark.parametrize("name", FACES)
def test_every_public_name_is_there_with_a_sentence(name):
    package = importlib.import_module(name)
    assert list(package.__all__) == sorted(package.__all__)
    assert len(package.__all__) <= MOST_NAMES.get(name, LARGEST)
    for public in package.__all__:
        assert getattr(package, public).__doc__
        assert f"``{public}``" in package.__doc__
        assert public in dir(package)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = package.nothing


@pytest.mark.parametrize("name", FACES)
def test_type_checkers_see_the_same_names(name):
    package = importlib.import_module(name)
    tree = ast.parse(Path(package.__file__).read_text(encoding="utf-8"))
    (checked,) = [node for node in tree.body if isinstance(node, ast.If)]
    seen = [alias.name for node in checked.body for alias in node.names]
    assert sorted(seen) == package.__all__


@pytest.mark.parametrize("name", FACES)
def test_the_example_of_a_package_runs(name, monkeypatch):
    monkeypatch.chdir(ROOT)  # cases are named from there
    failed, tried = doctest.testmod(importlib.import_module(name))
    assert tried > 0
    assert failed == 0


def _public_objects(name: str) -> dict[str, object]:
    """Return functions and classes of a package, except exceptions."""
    package = importlib.import_module(name)
    objects = {public: getattr(package, public) for public in package.__all__}
    return {
        public: value
        for public, value in objects.items()
        if not (isinstance(value, type) and issubclass(value, BaseException))
    }


@pytest.mark.parametrize("name", FACES)
def test_examples_of_functions_and_classes_run(name, monkeypatch):
    monkeypatch.chdir(ROOT)  # cases are named from there
    for public, value in _public_objects(name).items():
        if public in WITHOUT_EXAMPLE:
            assert ">>>" not in value.__doc__, f"{public} has an example: take it off the list"
            continue
        example = doctest.DocTestParser().get_doctest(value.__doc__, {}, public, None, None)
        assert example.examples, f"{name}.{public} has no example"
        assert doctest.DocTestRunner().run(example).failed == 0


@pytest.mark.parametrize("name", FACES)
def test_texts_of_public_classes_speak_of_every_field(name):
    """The pages show only a signature and this text, so shapes and units must be here."""
    for public, value in _public_objects(name).items():
        fields = dataclasses.fields(value) if dataclasses.is_dataclass(value) else ()
        texts = [base.__doc__ or "" for base in value.__mro__] if fields else []
        silent = {field.name for field in fields}.difference(*map(_documented, texts))
        assert not silent, f"{name}.{public} says nothing of {', '.join(sorted(silent))}"


def _documented(text):
    """Return the names in double backquotes, and those that numpydoc sections list."""
    section = re.search(
        r"^(?:Attributes|Parameters)\n-+\n((?:.*\n)*?)(?=\S.*\n-+\n|\Z)",
        inspect.cleandoc(text) + "\n",
        re.MULTILINE,
    )
    listed = re.findall(r"^\S.*$", section[1], re.MULTILINE) if section else []
    return set(re.findall(r"\w+", " ".join([*listed, *text.split("``")[1::2]])))


@pytest.mark.parametrize("package", ["sa_solver", "wear", "fe_models", "workflow"])
def test_packages_say_that_they_are_typed(package):
    assert (ROOT / package / "py.typed").is_file()
