"""Checks of every file for ParaView, and of the script that shows a run."""

import ast
import re
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv

SUFFIXES = {".vts", ".vtp", ".vtu", ".vti"}
UNITS = {"1", "mm", "mm^2", "MPa", "N", "s", "N/mm", "N^2/mm^3", "MPa^2", "N mm"}


def check_arrays(folder: Path) -> None:
    """Assert that every array of every file has a unit in its name and contains only numbers."""
    files = sorted(path for path in folder.rglob("*") if path.suffix in SUFFIXES)
    assert files
    for path in files:
        mesh = pv.read(path)
        assert mesh.n_points, path
        assert not mesh.cell_data.keys(), path
        arrays = {**mesh.point_data, **mesh.field_data}
        assert len(mesh.field_data) == 1, path  # what its time is
        for name, values in arrays.items():
            found = re.fullmatch(r"\w+ \[(.+)\]", name)
            assert found, f"{path}: {name}"
            assert found[1] in UNITS, f"{path}: {name}"
            assert np.isfinite(values).all(), f"{path}: {name}"


def total(mesh: Any, name: str) -> float:
    """Return the integral of a field over a face: the sum over the points times their shares."""
    shares = mesh["length [mm]" if "length [mm]" in mesh.point_data else "area [mm^2]"]
    return float(mesh[name].astype(float) @ shares.astype(float))


def scene_of(script: Path) -> dict[str, Any]:
    """Return the scene of a script."""
    for node in ast.parse(script.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.AnnAssign) and ast.unparse(node.target) == "SCENE":
            scene: dict[str, Any] = ast.literal_eval(node.value)
            return scene
    raise AssertionError("no SCENE")


def check_scene(script: Path) -> dict[str, Any]:
    """Assert that every file and array of a script exists, at its first time; return the scene."""
    scene = scene_of(script)
    assert 1 <= len(scene["views"]) <= 4
    for view in scene["views"]:
        assert view["title"]
        for shown in view["shown"]:
            reader = pv.PVDReader(script.parent / shown["file"])
            assert scene["begin"] in reader.time_values, shown["file"]
            reader.set_active_time_value(scene["begin"])
            for part in reader.read():
                assert scene["time"] in part.field_data
                for name in filter(None, (shown["colour"], shown["warp"])):
                    assert name in part.point_data, f"{shown['file']}: {name}"
                if shown["warp"]:
                    assert part.point_data[shown["warp"]].shape[1] == 3
    return scene
