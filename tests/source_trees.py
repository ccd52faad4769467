"""Syntax trees of the packages, parsed once per test process without importing anything."""

import ast
import gc
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = "workflow", "fe_models", "wear", "sa_solver"


@cache
def modules(package: str) -> dict[str, ast.Module]:
    """Return the modules of a package by their dotted names.

    Garbage collections skip the trees, whose hundreds of thousands of nodes remain.
    """
    collected = gc.isenabled()
    gc.disable()
    parsed = {}
    for path in sorted((ROOT / package).rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        parsed[name] = ast.parse(path.read_text(encoding="utf-8"))
    gc.freeze()
    if collected:
        gc.enable()
    return parsed
