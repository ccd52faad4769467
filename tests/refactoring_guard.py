"""Runs quick cases of every kind at two revisions and compares all that they write.

A guard for refactoring, apart from the tests of physics: it says what changed, not what is right.
It uses the command and the files it leaves, nothing of the packages. pytest does not collect it.

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
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gmsh
import h5py
import meshio
import numpy as np
import pyvista as pv
from ruamel.yaml import YAML

# What was renamed on purpose: a pattern found in "run/file > field" of the earlier side, and what
# the later side has in its place (as re.sub takes them).
RENAMED: tuple[tuple[str, str], ...] = ()

# Relative to the largest value of a field: sums in another order differ by some 1e-12.
ROUNDING = 1e-9
# Fields that differ from run to run, or with what the cache already holds.
UNCOMPARED = re.compile(r"seconds|versions|from_cache|> case@")
# How well an equation holds, a share: compared with 1, not with its own noise.
RESIDUALS = re.compile(r"residual|closure|equilibrium_error")
# Files of which only the name is compared.
OPAQUE = re.compile(r"\.png$|\.log$|checkpoint\.h5$")


# --- runs -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Run:
    """A command and its overrides; ``quick`` ones are those of ``--quick``."""

    name: str
    command: str
    overrides: tuple[str, ...] = ()
    quick: bool = False


BARE = "output.paraview=false", "output.figures=false"
NO_STRESS = "stress.section=none", "stress.life.parameter=none"
# Dovetails.
SMALL, PLANE = "run cases/dovetail_small.yaml", "run cases/dovetail_2d.yaml"
TWO_STEPS = "wear.cycles=2e4", "wear.step={kind: implicit, cycles: 1e4}"
SHORT = "load_path.increments=8", "load_path.peak_at=3", *TWO_STEPS
MESH = "mesh={flank_nodes: [10, 10], size: 8 mm}", "contact.grid=[48, 64]"
QUICK_PLANE = (*MESH, *SHORT, *BARE)
LOOP = "loops.amplitude=2 um"
LOW = "rotation_speed: 4500 rpm, aerodynamic_moment: 20 N*m"
MIX = f"load_path.mix=[{{share: 0.7}}, {{share: 0.3, {LOW}}}]"
SECOND_ORDER = "wear.step={kind: second_order}", "wear.tolerance=5 %"
CHANGING_FRICTION = "friction.evolution={energy: [0 J, 10 J], factor: [1.0, 1.5]}"
EXPLICIT = "wear.step={kind: explicit, fraction: 0.9}", "wear.cycles=5e3", CHANGING_FRICTION
# Bodies and loads in files that the guard writes, see `write_inputs`.
PADS, LOADS = "run {inputs}/mesh.yaml", "run {inputs}/resultants.yaml"
CAD = (
    "structure={kind: mesh, file: joint.brep, size: 3 mm, body_1: solid_1, body_2: solid_2, "
    "contacts: [{name: pad, face_1: solid_1.face_6, face_2: solid_2.face_5, x: [1, 0, 0], "
    "gap: {shape: paraboloid, radius_x: 200 mm, radius_y: 300 mm}}], "
    "supports: [{group: solid_1.face_5, hold: all}], "
    "loads: [{kind: pressure, path: [1, 0], group: solid_2.face_6, pressure: 10 MPa}]}",
    "output.paraview=false",
)
ROLLER = (
    *("structure.file=roller.csv", "structure.dimension=2", "structure.size=[1.6 mm]"),
    *("structure.gap={shape: paraboloid, radius_x: 10 mm}", "contact.grid=[32, 8]"),
)
CYLINDER_WEAR = "contact.grid=[128, 1]", "wear.cycles=4e5"
SPECIMENS = (
    *("mesh={pad_elements: 8, size: 2 mm}", "structure.ring_nodes=8", "reduction.modes=6"),
    *("contact.grid=[16, 16]", "wear.energy=100 J", "load_path.normal_forces=[17 N, 87 N]"),
)
COMPUTED_WEAR = "evolution.file={inputs}/specimens_wear.yaml", "energies=[0 J, 20 J]"
# Vibration.
TWO_MASSES = (
    *("forces=[1 N, 30 N]", "resolution={harmonics: 5, samples: 128}", "backbone=true"),
    "force_sweeps=[100 Hz]",
)
SHAKEN_PADS = "run cases/rig_harmonic_balance.yaml"
RIG = (
    *("structure.specimens=specimens_coarse.yaml", "frequencies=[80 Hz, 240 Hz]"),
    *("resolution={harmonics: 2, samples: 48}", "continuation.longest_step=0.4"),
    "backbone=false",
)
PAD_LOOP = "loops={frequency: 100 Hz, harmonics: [1, 2]}"
WORN_PADS = (*RIG[:-1], "wear.cycles=[1e5]", "forces=[2 N]")
WORN_BALL = (
    *("contact.file={inputs}/specimens_wear.yaml", "wear.cycles=[1e3, 1e4]", "forces=[5 N]"),
    "resolution={harmonics: 5, samples: 128}",
)

RUNS = (
    # Structures: with all that is drawn first; then what couples, loads, steps and laws may be.
    Run("dovetail", SMALL, ("output.paraview=true", *SHORT), quick=True),
    Run("dovetail_every", SMALL, ("coupling.resultants=every", *SHORT, *BARE)),
    Run("dovetail_moment", SMALL, ("load_path.aerodynamic_moment=30 N*m", *SHORT, *BARE)),
    Run("nonlinearity", SMALL, ("nonlinearity.check=true", *SHORT, *BARE)),
    Run("second_order_mesh", PLANE, (*QUICK_PLANE, "mesh.order=2")),
    Run("dovetail_2d", PLANE, MESH, quick=True),
    Run("full_method", PLANE, ("contact.method=full", LOOP, *QUICK_PLANE), quick=True),
    Run("full_method_3d", SMALL, ("contact={grid: [16, 24], method: full}", *SHORT, *BARE)),
    Run("drift", PLANE, (*QUICK_PLANE, "coupling.drift=0.01 %")),
    Run("mission_mix", PLANE, (*QUICK_PLANE, MIX), quick=True),
    Run("fidelity_auto", PLANE, ("fidelity=auto", "accuracy=20 %", *BARE)),
    Run("second_order", PLANE, (*QUICK_PLANE, *SECOND_ORDER)),
    Run("explicit", PLANE, (*QUICK_PLANE, *EXPLICIT)),
    Run("life", PLANE, (*QUICK_PLANE, "stress.life.parameter=smith_watson_topper")),
    Run("mesh", PADS, ("contact.grid=[24, 24]", *TWO_STEPS, "output.figures=false"), quick=True),
    Run("mesh_cad", PADS, (*CAD, "contact.grid=[24, 24]", *TWO_STEPS)),
    Run("resultants", LOADS, ("contact.grid=[12, 24]", *TWO_STEPS, *BARE), quick=True),
    Run("resultants_2d", LOADS, (*ROLLER, *TWO_STEPS, *NO_STRESS), quick=True),
    Run("export", "resultants cases/dovetail_small.yaml", SHORT, quick=True),
    # Contacts of two bodies, and their wear.
    Run("sphere_normal", "run cases/sphere_normal.yaml"),
    Run("sphere_fretting", "run cases/sphere_fretting.yaml", ("contact.grid=[48, 48]",), True),
    Run("sphere_torsion", "run cases/sphere_torsion.yaml", ("contact.grid=[48, 48]",)),
    Run("line_bulk_stress", "run cases/line_bulk_stress.yaml", ("contact.grid=256",), quick=True),
    Run("line_dissimilar", "run cases/line_dissimilar.yaml", ("contact.grid=128",)),
    Run("cylinder_wear", "run cases/cylinder_wear.yaml", CYLINDER_WEAR, quick=True),
    Run("sphere_wear", "run cases/sphere_wear.yaml", ("wear.cycles=600", "output.paraview=true")),
    Run("specimens_wear", "run {inputs}/specimens_wear.yaml", quick=True),
    # Specimens, and joints in time.
    Run("specimens", "run cases/specimens_coarse.yaml", quick=True),
    Run("specimens_curved", "run cases/specimens_curved.yaml", SPECIMENS),
    Run("joint", "run cases/bolted_joint_test4.yaml", quick=True),
    Run("joint_bouc_wen", "run cases/rig_bouc_wen.yaml"),
    Run("rig_force", "run cases/rig_force_75N.yaml", ("energies=[0 J, 2800 J]",), quick=True),
    Run("rig_hammer", "run cases/rig_hammer_7N.yaml", quick=True),
    Run("rig_reduced", "run cases/rig_reduced.yaml", ("excitation.record=0.05 s",), quick=True),
    Run("rig_computed_wear", "run cases/rig_computed_wear.yaml", COMPUTED_WEAR),
    # Joints that shake, and wear by it.
    Run("vibration", "run cases/rig_two_dof.yaml", TWO_MASSES, quick=True),
    Run("vibration_tolerance", "run cases/rig_two_dof.yaml", ("forces=[10 N]",)),
    Run("vibration_pads", SHAKEN_PADS, (*RIG, "forces=[20 N]", PAD_LOOP), quick=True),
    Run("vibration_backbone", SHAKEN_PADS, (*RIG, "forces=[2 N, 20 N]", "backbone=true", *BARE)),
    Run("vibration_wear", "run cases/rig_wear_vibration.yaml", WORN_BALL, quick=True),
    Run("friction_rig_wear", "run cases/rig_wear_specimens.yaml", WORN_PADS, quick=True),
    # Many runs, and the other commands that write.
    Run("sweep", "sweep {inputs}/sweep.yaml"),
    Run("chart", "chart cases/sphere_normal.yaml --axis tolerance", ("contact.grid=[24, 24]",)),
    Run("loops", "loops {inputs}/measured.csv --normal-load 60N", quick=True),
)


# --- what the runs read ---------------------------------------------------------------------------

# Loads of a face of 11 x 60 mm, and of a cylinder.
FACE = """P [kN], Qx [kN], Qy, Mx, My [N*m], Mz, Edx [mJ], Edy
20, -6, 0, 0, 10, 0, 0, 0
50, -20, 0, 0, 20, 0, 60, 0
30, 2, 0, 0, 10, 0, 20, 0
"""
CYLINDER = """P [N/mm], Qx [N/mm], My [N], Edx [mJ/mm]
400, 150, 0, 0.3
400, -150, 0, 3
400, 150, 0, 3
"""
SWEEP = """title: Sweep
case: {cases}/cylinder_wear.yaml
set: {{"contact.grid": [64, 1], wear.cycles: 2e5, output.figures: false}}
vary:
  friction.coefficient: {{values: [0.4, 0.5]}}
  structure.radius: {{values: [9 mm, 10 mm]}}
design: zip
"""
# Two boxes, one on the other: corner and size [mm], and the heights of their named faces.
BOXES: dict[str, tuple[tuple[float, ...], dict[str, float]]] = {
    "disk": ((-5, -5, -4, 10, 10, 4), {"disk_base": -4.0, "disk_top": 0.0}),
    "blade": ((-4, -4, 0, 8, 8, 4), {"blade_foot": 0.0, "blade_top": 4.0}),
}


def write_inputs(folder: Path, checkout: Path, fretscale: Callable[..., object]) -> None:
    """Write what the runs read beside the shipped cases."""
    folder.mkdir(parents=True)
    for kind in ("mesh", "resultants"):
        fretscale("new", kind, str(folder / f"{kind}.yaml"))
    write_boxes(folder)
    cases = checkout / "cases"
    texts = {"loads.csv": FACE, "roller.csv": CYLINDER, "sweep.yaml": SWEEP.format(cases=cases)}
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    yaml = YAML()
    case = yaml.load(cases / "specimens_wear.yaml")
    case["contact"]["grid"], case["wear"]["tolerance"] = [24, 24], "10 %"
    yaml.dump(case, folder / "specimens_wear.yaml")
    angle = np.linspace(0.0, 6.0 * np.pi, 601)
    loop = np.column_stack([7.0 * np.sin(angle), 30.0 * np.tanh(4.0 * np.cos(angle))])
    header = "displacement [um],force [N]"
    np.savetxt(folder / "measured.csv", loop, delimiter=",", header=header, comments="")


def write_boxes(folder: Path) -> None:
    """Both boxes as ``joint.msh`` and ``joint.brep``."""
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


# --- recording ------------------------------------------------------------------------------------


def record(folder: Path, checkout: Path, runs: Sequence[Run], jobs: int) -> None:
    """Run the cases of ``checkout``; each leaves ``NAME/out`` and ``NAME/exit_code`` in ``folder``.

    What is there already is kept, so that an interrupted record goes on.
    """
    folder, checkout = folder.resolve(), checkout.resolve()
    script = tomllib.loads((checkout / "pyproject.toml").read_text("utf-8"))["project"]["scripts"]
    module, function = script["fretscale"].split(":")
    program = [sys.executable, "-c", f"from {module} import {function}; {function}()"]
    threads = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    environment = os.environ | dict.fromkeys(threads, "1")
    environment |= {"PYTHONPATH": str(checkout), "FRETSCALE_CACHE": str(folder / "cache")}
    settings: dict[str, Any] = {"cwd": checkout, "env": environment, "text": True}

    def fretscale(*arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([*program, *arguments], capture_output=True, **settings)

    inputs = folder / "inputs"
    if not inputs.exists():
        write_inputs(inputs, checkout, fretscale)
    (folder / "checkout").write_text(str(checkout), encoding="utf-8")

    def go(run: Run) -> None:
        own = folder / run.name
        if (own / "exit_code").exists():
            return
        own.mkdir(exist_ok=True)
        begin = time.monotonic()
        overrides = [part for entry in run.overrides for part in ("--set", entry)]
        words = [*run.command.split(), *overrides, "--out", str(own / "out")]
        done = fretscale(*(word.replace("{inputs}", str(inputs)) for word in words))
        (own / "exit_code").write_text(str(done.returncode), encoding="utf-8")
        (own / "output.txt").write_text(done.stdout + done.stderr, encoding="utf-8")
        ending = "" if done.returncode == 0 else f", exit code {done.returncode}: {done.stderr}"
        print(f"{run.name}: {time.monotonic() - begin:.1f} s{ending.rstrip()}", flush=True)

    with ThreadPoolExecutor(jobs) as pool:
        list(pool.map(go, runs))


# --- what a run left ------------------------------------------------------------------------------

Value = np.ndarray | str


def fields(folder: Path, name: str) -> dict[str, Value]:
    """All that the run ``name`` left that is compared, by "run/file > field"."""
    paths = [folder.resolve(), Path((folder / "checkout").read_text("utf-8"))]
    found: dict[str, Value] = {f"{name} > exit code": (folder / name / "exit_code").read_text()}
    out = folder / name / "out"
    for path in sorted(own for own in out.rglob("*") if own.is_file()):
        file = f"{name}/{path.relative_to(out)}"
        found[f"{file} > exists"] = "yes"
        for key, value in read(path):
            if isinstance(value, str):
                for place in paths:
                    value = value.replace(str(place), "")
            found[f"{file} > {key}"] = value
    return {key: value for key, value in found.items() if not UNCOMPARED.search(key)}


def read(path: Path) -> Iterator[tuple[str, Value]]:
    """Names and values of the fields of a file."""
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
    """Entries of nested dictionaries and lists; lists of numbers are one entry."""
    if isinstance(value, dict) or (isinstance(value, list) and not is_numeric(value)):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        for key, own in items:
            yield from flat(own, f"{name}.{key}" if name else str(key))
    else:
        yield name, as_value(value)


def is_numeric(value: object) -> bool:
    """Whether an array of numbers can be made of ``value``."""
    try:
        return np.asarray(value).dtype.kind in "biufc"
    except ValueError:
        return False


def as_value(value: object) -> Value:
    """A number or an array of them, or a text."""
    return np.asarray(value) if is_numeric(value) else str(value)


def read_h5(path: Path) -> Iterator[tuple[str, Value]]:
    """Datasets as ``group/name`` and attributes as ``group/name@attribute``."""
    with h5py.File(path) as file:
        items: list[tuple[str, Any]] = [("", file)]
        file.visititems(lambda name, item: items.append((name, item)))
        for name, item in items:
            yield from ((f"{name}@{key}", as_value(own)) for key, own in item.attrs.items())
            if isinstance(item, h5py.Dataset):
                yield name, as_value(item.asstr()[()] if item.dtype.kind == "O" else item[()])


def read_csv(path: Path) -> Iterator[tuple[str, Value]]:
    """Columns by their headings; what begins with # is a text of its own."""
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
        for name, own in getattr(mesh, kind).items():
            yield f"{kind} {name}", as_value(np.asarray(own))


READERS = {
    ".json": read_json,
    ".yaml": read_yaml,
    ".h5": read_h5,
    ".csv": read_csv,
    ".msh": read_mesh,
    **dict.fromkeys((".vtu", ".vti", ".vts", ".vtp", ".vtk", ".stl"), read_vtk),
}


# --- comparison -----------------------------------------------------------------------------------


def compare(earlier: Path, later: Path, runs: Sequence[Run], tolerance: float, every: bool) -> bool:
    """Print one line for each run and for each thing that differs; whether nothing does."""
    equal = True
    for run in runs:
        recorded = [(folder / run.name / "exit_code").exists() for folder in (earlier, later)]
        if not all(recorded):
            if any(recorded):
                print(
                    f"{run.name}: recorded on the {'earlier' if recorded[0] else 'later'} side only"
                )
                equal = False
            continue
        before = {renamed(key): own for key, own in fields(earlier, run.name).items()}
        after = fields(later, run.name)
        deviations = {
            key: deviation(key, own, after[key]) for key, own in before.items() if key in after
        }
        lines = [f"missing: {key}" for key in before if key not in after]
        lines += [f"additional: {key}" for key in after if key not in before]
        for key, own in deviations.items():
            if isinstance(own, str) or own > tolerance or (every and own > 0.0):
                lines.append(f"{own if isinstance(own, str) else f'deviates by {own:.1e}'}: {key}")
        wrong = [own for own in deviations.values() if isinstance(own, str) or own > tolerance]
        good = not wrong and before.keys() == after.keys()
        numbers = {key: own for key, own in deviations.items() if not isinstance(own, str)}
        worst = max(numbers, key=lambda key: numbers[key])
        ending = f"largest deviation {numbers[worst]:.1e}" + (
            f" in {worst}" if numbers[worst] else ""
        )
        print(f"{run.name}: {len(after)} fields {'agree' if good else 'DIFFER'}, {ending}")
        for line in lines:
            print(f"  {line}")
        equal &= good
    return equal


def renamed(key: str) -> str:
    """The name on the later side."""
    for pattern, replacement in RENAMED:
        key = re.sub(pattern, replacement, key)
    return key


def deviation(key: str, before: Value, after: Value) -> float | str:
    """Largest difference over the largest value, or in words what is different."""
    if isinstance(before, str) or isinstance(after, str):
        same = isinstance(before, str) and isinstance(after, str) and before == after
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
    here = Path(__file__).resolve().parent.parent
    common = argparse.ArgumentParser(add_help=False)
    common.add_argument("--quick", action="store_true", help="one small case of each kind")
    common.add_argument("--only", action="append", metavar="NAME", help="of the cases; repeatable")
    running = argparse.ArgumentParser(add_help=False)
    running.add_argument("--jobs", type=int, default=2, help="cases at a time (default 2)")
    comparing = argparse.ArgumentParser(add_help=False)
    comparing.add_argument(
        "--tolerance", type=float, default=ROUNDING, help=f"relative (default {ROUNDING:g})"
    )
    comparing.add_argument("--every", action="store_true", help="name each field that deviates")
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("record", parents=[common, running], help="run the cases")
    one.add_argument("folder", type=Path, help="to write; a record in it is continued")
    one.add_argument("--checkout", type=Path, default=here, help="other than that of the script")
    two = commands.add_parser("compare", parents=[common, comparing], help="two records")
    two.add_argument("earlier", type=Path)
    two.add_argument("later", type=Path)
    three = commands.add_parser(
        "against", parents=[common, running, comparing], help="a revision with this checkout"
    )
    three.add_argument("revision", help="of git, that is recorded in a work tree of its own")
    arguments = parser.parse_args()
    if unknown := set(arguments.only or ()) - {run.name for run in RUNS}:
        parser.error(f"no case {', '.join(unknown)}; there are {', '.join(r.name for r in RUNS)}")
    runs = [
        run
        for run in RUNS
        if (run.quick or not arguments.quick) and run.name in (arguments.only or {run.name})
    ]
    if arguments.command == "record":
        record(arguments.folder, arguments.checkout, runs, arguments.jobs)
        return 0
    if arguments.command == "compare":
        sides = arguments.earlier, arguments.later
        return not compare(*sides, runs, arguments.tolerance, arguments.every)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        git = ["git", "-C", str(here), "worktree"]
        tree = folder / "checkout"
        subprocess.run([*git, "add", "-q", "--detach", str(tree), arguments.revision], check=True)
        try:
            record(folder / "earlier", tree, runs, arguments.jobs)
            record(folder / "later", here, runs, arguments.jobs)
        finally:
            subprocess.run([*git, "remove", "--force", str(tree)], check=True)
        sides = folder / "earlier", folder / "later"
        return not compare(*sides, runs, arguments.tolerance, arguments.every)


if __name__ == "__main__":
    sys.exit(main())
