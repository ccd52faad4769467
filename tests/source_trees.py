"""Syntax trees of the packages, parsed once per test process without importing anything."""

import ast
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = "workflow", "fe_models", "wear", "sa_solver"


@cache
def modules(package: str) -> dict[str, ast.Module]:
    """Return the modules of a package by their dotted names."""
    parsed = {}
    for path in sorted((ROOT / package).rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        parsed[name] = ast.parse(path.read_text(encoding="utf-8"))
    return parsed
