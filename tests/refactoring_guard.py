"""Runs quick cases of every kind at two revisions and compares all that they write.

A guard for refactoring, apart from the tests of physics: it says what changed, not what is right.
It uses the command and the files it leaves, nothing of the packages. The runs are listed in
``refactoring_guard.yaml``. pytest does not collect it.

    python tests/refactoring_guard.py record DIR             # run all cases of this checkout
    python tests/refactoring_guard.py compare EARLIER LATER  # two such folders
    python tests/refactoring_guard.py against REVISION       # record both, then compare

Compared are the list of files and, to rounding, every number in summaries, HDF5 files (with shapes
and attributes), tables, cases as run, meshes and ParaView files. Seconds, versions and paths are
left out; of checkpoints, logs and pictures only the names count. Exit code 1: something differs.
"""

from __future__ import annotations

import argparse
import csv
import io
import json
import os
import re
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import gmsh
import h5py
import meshio
import numpy as np
import pyvista as pv
from ruamel.yaml import YAML

HERE = Path(__file__).resolve()
ROOT = HERE.parent.parent
LIST = YAML(typ="safe").load(HERE.with_suffix(".yaml"))
RUNS: dict[str, dict[str, Any]] = LIST["runs"]

# Intended renamings: a pattern found in "run/file > field" of the earlier side, and its replacement
# on the later side (as for re.sub). Texts are compared after the same replacements.
# Since 838e474:
RENAMED: tuple[tuple[str, str], ...] = (
    (r"\bwear\.stint\.share\b", "wear.step.fraction"),
    (r"\bwear\.stint\.length\b", "wear.step.cycles"),
    (r"\bwear\.stint\b", "wear.step"),
    (r"\bstint_limit\b", "stable_cycles"),
    (r"(loads\.\d+)\.stints\b", r"\1.cycle_blocks"),
)
# Intended additions on the later side: the list of the files of a run, and the kind of its case.
ADDED = re.compile(r"manifest\.json|results\.h5 > @kind")

# Relative to the largest value of a field: sums in another order differ by some 1e-12.
ROUNDING = 1e-9
# Fields that differ from run to run, or with what the cache already holds; a chart chooses by time.
# Labels of axes come on top.
UNCOMPARED = re.compile(
    r"seconds|versions|from_cache|> case@|chart/summary.json > .*(chosen|together|sentences)"
    r"|@(coordinates|CLASS|NAME|DIMENSION_\w+|units|long_name)$|h5 > dimensions"
)
# How well an equation holds, a share: compared with 1, not with its own noise.
RESIDUALS = re.compile(r"residual|closure|equilibrium_error")
# Files of which only the name is compared.
OPAQUE = re.compile(r"\.png$|\.log$|checkpoint\.h5$")
# In a record: the folders that texts may name, its own and the checkout's.
PLACES = "places"

# --- recording ------------------------------------------------------------------------------------

# Two boxes, one on the other: corner and size [mm], and the heights of their named faces.
BOXES: dict[str, tuple[tuple[float, ...], dict[str, float]]] = {
    "disk": ((-5, -5, -4, 10, 10, 4), {"disk_base": -4.0, "disk_top": 0.0}),
    "blade": ((-4, -4, 0, 8, 8, 4), {"blade_foot": 0.0, "blade_top": 4.0}),
}


class Recorder:
    """Command of a checkout, and the folder that it writes to."""

    def __init__(self, folder: Path, checkout: Path) -> None:
        self.folder, self.checkout = folder.resolve(), checkout.resolve()
        project = tomllib.loads((checkout / "pyproject.toml").read_text("utf-8"))["project"]
        module, function = project["scripts"]["fretscale"].split(":")
        self.program = [sys.executable, "-c", f"from {module} import {function}; {function}()"]
        threads = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
        self.environment = os.environ | dict.fromkeys(threads, "1")
        paths = {"PYTHONPATH": str(self.checkout), "FRETSCALE_CACHE": str(self.folder / "cache")}
        self.environment |= paths
        self.inputs = self.folder / "inputs"
        if not self.inputs.exists():
            self.write_inputs()
        places = f"{self.folder}\n{self.checkout}\n"
        (self.folder / PLACES).write_text(places, encoding="utf-8")

    def fretscale(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run the command with the checkout as working folder."""
        return subprocess.run(
            [*self.program, *arguments],
            cwd=self.checkout,
            env=self.environment,
            capture_output=True,
            text=True,
        )

    def write_inputs(self) -> None:
        """Write the files that the runs read in addition to the shipped cases."""
        self.inputs.mkdir(parents=True)
        for kind in ("mesh", "resultants"):
            self.fretscale("new", kind, str(self.inputs / f"{kind}.yaml"))
        for name, text in LIST["inputs"].items():
            (self.inputs / name).write_text(text, encoding="utf-8")
        write_boxes(self.inputs)
        angle = np.linspace(0.0, 6.0 * np.pi, 601)
        # The force changes sign only after a reversal, as that of an elastic joint that slides.
        loop = np.column_stack([7.0 * np.sin(angle), 30.0 * np.tanh(4.0 * np.cos(angle - 0.5))])
        header = "displacement [um],force [N]"
        np.savetxt(self.inputs / "measured.csv", loop, delimiter=",", header=header, comments="")

    def run(self, name: str) -> None:
        """Run a case into ``NAME/out``, with its ``NAME/exit_code``, unless that exists."""
        folder = self.folder / name
        if (folder / "exit_code").exists():
            return
        folder.mkdir(exist_ok=True)
        begin = time.monotonic()
        words = [*RUNS[name]["command"].split(), "--out", str(folder / "out")]
        for entry, value in RUNS[name].get("set", {}).items():
            words += ["--set", f"{entry}={json.dumps(value)}"]
        done = self.fretscale(*(word.replace("{inputs}", str(self.inputs)) for word in words))
        (folder / "output.txt").write_text(done.stdout + done.stderr, encoding="utf-8")
        (folder / "exit_code").write_text(str(done.returncode), encoding="utf-8")
        ending = f", exit code {done.returncode}: {done.stderr}" if done.returncode else ""
        print(f"{name}: {time.monotonic() - begin:.1f} s{ending.rstrip()}", flush=True)


def write_boxes(folder: Path) -> None:
    """Write both boxes as ``joint.msh`` and ``joint.brep``."""
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    for body, (box, heights) in BOXES.items():
        solid = gmsh.model.occ.addBox(*box)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(3, [solid], name=body)
        for _, face in gmsh.model.getBoundary([(3, solid)], oriented=False):
            middle = gmsh.model.occ.getCenterOfMass(2, face)[2]
            for name, height in heights.items():
                if abs(middle - height) < 1e-9:
                    gmsh.model.addPhysicalGroup(2, [face], name=name)
    gmsh.write(str(folder / "joint.brep"))
    gmsh.option.setNumber("Mesh.MeshSizeMax", 2.0)
    gmsh.model.mesh.generate(3)
    gmsh.write(str(folder / "joint.msh"))
    gmsh.finalize()


def record(folder: Path, checkout: Path, runs: Sequence[str], jobs: int) -> None:
    """Run the cases of ``checkout``; results of an interrupted record are reused."""
    recorder = Recorder(folder, checkout)
    with ThreadPoolExecutor(jobs) as pool:
        list(pool.map(recorder.run, runs))


# --- files of a run -------------------------------------------------------------------------------

Value = np.ndarray | str


def fields(folder: Path, name: str) -> dict[str, Value]:
    """Return all compared values of the run ``name``, by "run/file > field"."""
    places = (folder / PLACES).read_text("utf-8").split()
    values: dict[str, Value] = {
        f"{name} > exit code": (folder / name / "exit_code").read_text("utf-8")
    }
    out = folder / name / "out"
    for path in sorted(path for path in out.rglob("*") if path.is_file()):
        file = f"{name}/{path.relative_to(out)}"
        values[file] = "a file"
        for key, value in read(path):
            if isinstance(value, str):
                for place in places:
                    value = value.replace(place, "")
            values[f"{file} > {key}"] = value
    return {key: value for key, value in values.items() if not UNCOMPARED.search(key)}


def read(path: Path) -> Iterator[tuple[str, Value]]:
    """Yield names and values of the fields of a file."""
    if OPAQUE.search(path.name):
        return iter(())
    if reader := READERS.get(path.suffix):
        return reader(path)
    return iter([("text", path.read_text("utf-8"))])


def read_json(path: Path) -> Iterator[tuple[str, Value]]:
    return flat(json.loads(path.read_text("utf-8")))


def read_yaml(path: Path) -> Iterator[tuple[str, Value]]:
    return flat(YAML(typ="safe").load(path))


def flat(value: Any, name: str = "") -> Iterator[tuple[str, Value]]:
    """Yield entries of nested dictionaries and lists; a list of numbers is one entry."""
    if isinstance(value, dict) or (isinstance(value, list) and not is_numeric(value)):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        for key, entry in items:
            yield from flat(entry, f"{name}.{key}" if name else str(key))
    else:
        yield name, as_value(value)


def is_numeric(value: object) -> bool:
    """Return whether ``value`` can be converted to an array of numbers."""
    try:
        return np.asarray(value).dtype.kind in "biufc"
    except ValueError:
        return False


def as_value(value: object) -> Value:
    """Return a number or an array of numbers, or a text."""
    if is_numeric(value):
        return np.asarray(value)
    return str(value.tolist() if isinstance(value, np.ndarray) else value)


def read_h5(path: Path) -> Iterator[tuple[str, Value]]:
    """Yield datasets as ``group/name`` and attributes as ``group/name@attribute``."""
    with h5py.File(path) as file:
        items: list[tuple[str, Any]] = [("", file)]
        file.visititems(lambda name, item: items.append((name, item)))
        for name, item in items:
            yield from (
                (f"{name}@{key}", as_value(attribute)) for key, attribute in item.attrs.items()
            )
            if isinstance(item, h5py.Dataset):
                yield name, as_value(item.asstr()[()] if item.dtype.kind == "O" else item[()])


def read_csv(path: Path) -> Iterator[tuple[str, Value]]:
    """Yield columns by their headings; a line that begins with # is a separate text."""
    lines = path.read_text("utf-8").splitlines()
    yield "comments", "\n".join(line for line in lines if line.startswith("#"))
    header, *rows = csv.reader(line for line in lines if not line.startswith("#"))
    for heading, *column in zip(header, *rows, strict=True):
        try:
            yield heading, np.array(column, dtype=float)
        except ValueError:
            yield heading, "\n".join(column)


def read_mesh(path: Path) -> Iterator[tuple[str, Value]]:
    with redirect_stdout(io.StringIO()):  # meshio prints empty lines
        mesh = meshio.read(path)
    yield "points", mesh.points
    for number, block in enumerate(mesh.cells):
        yield f"{number} {block.type}", block.data
    yield from mesh.point_sets.items()


def read_vtk(path: Path) -> Iterator[tuple[str, Value]]:
    mesh = pv.read(path)
    yield "points", np.asarray(mesh.points)
    for kind in ("point_data", "cell_data", "field_data"):
        for name, values in getattr(mesh, kind).items():
            yield f"{kind} {name}", as_value(np.asarray(values))


READERS = {
    ".json": read_json,
    ".yaml": read_yaml,
    ".h5": read_h5,
    ".csv": read_csv,
    ".msh": read_mesh,
    **dict.fromkeys((".vtu", ".vti", ".vts", ".vtp", ".vtk", ".stl"), read_vtk),
}


# --- comparison -----------------------------------------------------------------------------------

Deviation = float | str


def compare(earlier: Path, later: Path, runs: Sequence[str], tolerance: float, every: bool) -> bool:
    """Print a line for each run and each difference; return whether there is none."""
    equal = True
    for name in runs:
        there = [(folder / name / "exit_code").exists() for folder in (earlier, later)]
        if all(there):
            equal &= compare_run(fields(earlier, name), fields(later, name), name, tolerance, every)
        elif any(there):
            print(f"{name}: not recorded on the {'later' if there[0] else 'earlier'} side")
            equal &= not there[0]
    return equal


def compare_run(
    before: dict[str, Value], after: dict[str, Value], name: str, tolerance: float, every: bool
) -> bool:
    """Print how the fields of a run compare; return whether they agree."""
    before = {renamed(key): value for key, value in before.items()}
    lines = [f"missing: {key}" for key in outermost(before.keys() - after.keys())]
    added = {key for key in after.keys() - before.keys() if not ADDED.search(key)}
    lines += [f"additional: {key}" for key in outermost(added)]
    if after[f"{name} > exit code"] != "0":
        lines.append(f"failed on the later side, as its {name}/output.txt says")
    largest, reported = (0.0, ""), []
    for key in before.keys() & after.keys():
        difference = deviation(key, before[key], after[key])
        if isinstance(difference, str):
            lines.append(f"{difference}: {key}")
            continue
        largest = max(largest, (difference, key))
        if difference > tolerance:
            lines.append(f"deviates by {difference:.1e}: {key}")
        elif every and difference:
            reported.append(f"deviates by {difference:.1e}, rounding: {key}")
    ending = f"largest deviation {largest[0]:.1e}" + (f" in {largest[1]}" if largest[0] else "")
    print(f"{name}: {len(after)} fields {'DIFFER' if lines else 'agree'}, {ending}")
    for line in (*sorted(lines), *sorted(reported)):
        print(f"  {line}")
    return not lines


def outermost(keys: set[str]) -> set[str]:
    """Return the keys whose file and dataset are not among the keys themselves."""
    return {
        key for key in keys if keys.isdisjoint({key.split(" > ")[0], key.split("@")[0]} - {key})
    }


def renamed(key: str) -> str:
    """Return the name on the later side."""
    for pattern, replacement in RENAMED:
        key = re.sub(pattern, replacement, key)
    return key


def deviation(key: str, before: Value, after: Value) -> Deviation:
    """Return the largest difference over the largest value, or a description of the difference."""
    if isinstance(before, str) or isinstance(after, str):
        same = isinstance(before, str) and isinstance(after, str) and renamed(before) == after
        return 0.0 if same else f"was {str(before)[:60]!r}, is {str(after)[:60]!r}"
    if before.shape != after.shape:
        return f"shape was {before.shape}, is {after.shape}"
    if before.dtype.kind != after.dtype.kind:
        return f"type was {before.dtype}, is {after.dtype}"
    if before.size == 0 or np.array_equal(before, after, equal_nan=True):
        return 0.0
    if before.dtype.kind == "b":
        return f"{np.count_nonzero(before != after)} of {before.size} are no longer what they were"
    finite = np.isfinite(before)
    if not np.array_equal(before[~finite], after[~finite], equal_nan=True):
        return "not a number in other places"
    scale = 1.0 if RESIDUALS.search(key) else 0.0
    before, after = before[finite].astype(complex), after[finite].astype(complex)
    scale = max(scale, float(np.abs(before).max()), float(np.abs(after).max()))
    return float(np.abs(after - before).max()) / scale


# --- command --------------------------------------------------------------------------------------


def main() -> int:
    """Parse the command line and run the command."""
    common = argparse.ArgumentParser(add_help=False)
    common.add_argument("--quick", action="store_true", help="one small case of each kind")
    common.add_argument("--only", action="append", metavar="NAME", help="this case; repeatable")
    running = argparse.ArgumentParser(add_help=False)
    running.add_argument("--jobs", type=int, default=2, help="cases at a time (default 2)")
    comparing = argparse.ArgumentParser(add_help=False)
    rounding = f"of a field, relative to its largest value (default {ROUNDING:g})"
    comparing.add_argument("--tolerance", type=float, default=ROUNDING, help=rounding)
    comparing.add_argument("--every", action="store_true", help="tell each field off by rounding")
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=raw)
    add = parser.add_subparsers(dest="command", required=True).add_parser
    command = add("record", parents=[common, running], help="run the cases")
    command.add_argument("folder", type=Path, help="to write; a record in it is continued")
    command.add_argument(
        "--checkout", type=Path, default=ROOT, help="another one than the script's"
    )
    command = add("compare", parents=[common, comparing], help="compare two records")
    command.add_argument("earlier", type=Path, help="folder of a record")
    command.add_argument("later", type=Path, help="folder of another")
    command = add("against", parents=[common, running, comparing], help="record both, then compare")
    command.add_argument("revision", help="of git, to compare this checkout with")
    given = parser.parse_args()
    if unknown := set(given.only or ()) - set(RUNS):
        parser.error(f"no case {', '.join(sorted(unknown))}; there are {', '.join(RUNS)}")
    runs = [name for name, run in RUNS.items() if run.get("quick") or not given.quick]
    runs = [name for name in given.only or runs if name in runs]
    if given.command == "record":
        record(given.folder, given.checkout, runs, given.jobs)
        return 0
    if given.command == "compare":
        return not compare(given.earlier, given.later, runs, given.tolerance, given.every)
    with tempfile.TemporaryDirectory() as folder:
        earlier, later = Path(folder) / "earlier", Path(folder) / "later"
        record_revision(earlier, given.revision, runs, given.jobs)
        record(later, ROOT, runs, given.jobs)
        return not compare(earlier, later, runs, given.tolerance, given.every)


def record_revision(folder: Path, revision: str, runs: Sequence[str], jobs: int) -> None:
    """Record a revision in a separate work tree, with its own list of runs if it has one."""
    tree = folder.with_name("checkout")
    worktree = ["git", "-C", str(ROOT), "worktree"]
    subprocess.run([*worktree, "add", "--quiet", "--detach", str(tree), revision], check=True)
    try:
        if (script := tree / HERE.relative_to(ROOT)).exists():
            only = [word for name in runs for word in ("--only", name)]
            command = [sys.executable, str(script), "record", str(folder), "--jobs", str(jobs)]
            subprocess.run([*command, *only], check=True)
        else:
            record(folder, tree, runs, jobs)
    finally:
        subprocess.run([*worktree, "remove", "--force", str(tree)], check=True)


if __name__ == "__main__":
    sys.exit(main())
