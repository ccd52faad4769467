"""Rules of the code structure: no import cycles, no checks for kinds of case, few flat files.

Layers are contracts of import-linter (pyproject.toml). The source is parsed without importing it;
imports inside functions and for types count like all others.
"""

import ast
from collections.abc import Iterator
from graphlib import TopologicalSorter

import pytest

from tests.source_trees import PACKAGES, ROOT, modules

WORKFLOW = ROOT / "workflow"
# What lies flat in workflow/: the door, the kinds there are, and what they fail with.
MOST_FLAT_FILES = 6


def imported(module: ast.Module, known: dict[str, ast.Module]) -> Iterator[str]:
    """Yield the ``known`` modules that a module imports anywhere."""
    for node in ast.walk(module):
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative imports are not looked for here"
            for alias in node.names:
                names = f"{node.module}.{alias.name}", str(node.module)
                yield from [name for name in names if name in known][:1]
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)


@pytest.mark.parametrize("package", PACKAGES)
def test_no_circle_of_imports(package: str) -> None:
    known = modules(package)
    graph = {name: set(imported(module, known)) - {name} for name, module in known.items()}
    # Raises CycleError, which names the modules of the circle.
    TopologicalSorter(graph).prepare()


def test_no_public_class_has_the_name_of_another() -> None:
    places: dict[str, list[str]] = {}
    for package in PACKAGES:
        for module, tree in modules(package).items():
            for node in ast.walk(tree):
                if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                    places.setdefault(node.name, []).append(module)
    assert not {name: where for name, where in places.items() if len(where) > 1}


def owner(module: str) -> str:
    """Return the folder that a module belongs to: an analysis, or another part of workflow."""
    parts = module.split(".")
    return ".".join(parts[:3] if parts[1:2] == ["analyses"] else parts[:2])


def kinds_of_case(known: dict[str, ast.Module]) -> dict[str, str]:
    """Return the direct and indirect subclasses of Case, with the folder of each."""
    classes = {
        node.name: (owner(name), {ast.unparse(base).partition("[")[0] for base in node.bases})
        for name, module in known.items()
        for node in ast.walk(module)
        if isinstance(node, ast.ClassDef)
    }
    kinds = {"Case": owner("workflow.case")}
    while True:
        more = {name: folder for name, (folder, bases) in classes.items() if bases & kinds.keys()}
        if more.keys() <= kinds.keys():
            return kinds
        kinds |= more


def names_asked_for(module: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield line and name of every class in an isinstance check or a comparison of types."""
    for node in ast.walk(module):
        asked: ast.AST | None = None
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            asked = node.args[1] if node.func.id in ("isinstance", "issubclass") else None
        elif isinstance(node, ast.MatchClass):
            asked = node.cls
        elif isinstance(node, ast.Compare) and ast.unparse(node.left).startswith("type("):
            asked = node.comparators[0]
        for part in ast.walk(asked) if asked is not None else ():
            if isinstance(part, ast.Name | ast.Attribute):
                yield part.lineno, ast.unparse(part)


def test_nobody_asks_what_kind_a_case_is_but_its_own_analysis() -> None:
    known = modules("workflow")
    kinds = kinds_of_case(known)
    assert len(kinds) > 10
    asked = [
        f"{name}:{line}: {kind}"
        for name, module in known.items()
        for line, kind in names_asked_for(module)
        if kind.rpartition(".")[2] in kinds and owner(name) != kinds[kind.rpartition(".")[2]]
    ]
    assert not asked, "\n".join(asked)


def test_few_files_lie_flat() -> None:
    flat = sorted(path.name for path in WORKFLOW.iterdir() if path.is_file())
    assert len(flat) <= MOST_FLAT_FILES, flat
