"""Fixtures of the tests of ``workflow``: synthetic results, and runs of the small case."""

import json
import os
import pickle
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io
from click.testing import Result

from fe_models.joints.reduction import save_reduced
from fe_models.meshes.gmsh_session import gmsh_model
from fe_models.meshes.structure_mesh import Body, StructureMesh, write_msh
from sa_solver.types import Array, Frame, Grid
from tests.conftest import CASES
from tests.wheels import sector, shoe
from tests.workflow.case_leaves import BODY, CELLS, row_in_space
from tests.workflow.command_line import command, invoke, runs_here
from tests.workflow.mesh_scenes import pressed_blocks
from workflow.analyses.wear import contact_workers
from workflow.analyses.wear import run as wear_run
from workflow.analyses.wear.output.layout import WearContents
from workflow.kinds import kinds
from workflow.models.budget.probe_models import Probed
from workflow.models.stress import structure_stress
from workflow.pictures import drawing
from workflow.runs import run as running
from workflow.shell import processes
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.folders.lock import locked
from workflow.shell.output.results import read_contents

SIZE, EDGE, END = (10.0, 60.0), 1.0, 3.0
EDGE_RADIUS, END_RADIUS = 30.0, 150.0
INTERFACES = {"intrados": 1.0, "extrados": 0.8}  # name and its share of the load
INCREMENTS, PEAK, FRICTION = 22, 7, 0.4
JUMPS = np.array([0.0, 5e3, 1e4, 2e4, 4e4, 7e4, 1e5])
NAMES = tuple(sorted(INTERFACES))
# Settings of the synthetic results.
CONTENTS = WearContents(
    names=NAMES,
    bodies=("disk", "blade"),
    jumps=len(JUMPS) - 1,
    structure=True,
    coarse=NAMES,
    comparison=True,
    mission=True,
)


def flank_frame(side: float) -> Frame:
    """Return the frame of a flank at 45 degrees, right (+1) or left (-1) of the middle."""
    x = np.array([-side, 0.0, 1.0]) / np.sqrt(2.0)
    z = np.array([-side, 0.0, -1.0]) / np.sqrt(2.0)
    return Frame(np.array([15.0 * side, 0.0, 245.0]), np.array([x, np.cross(z, x), z]))


def rounding(x: Array, y: Array) -> Array:
    """Return the gap of the rounded edges and ends [mm]."""
    beyond_x = np.maximum(np.abs(x) - (0.5 * SIZE[0] - EDGE), 0.0)
    beyond_y = np.maximum(np.abs(y) - (0.5 * SIZE[1] - END), 0.0)
    return beyond_x**2 / (2.0 * EDGE_RADIUS) + beyond_y**2 / (2.0 * END_RADIUS)


def peak_pressure(x: Array, y: Array, cycles: float, load: float) -> Array:
    """Return a flat punch's pressure with edge peaks that wear reduces [MPa]."""
    closed = np.clip(1.0 - rounding(x, y) / 4e-3, 0.0, None) ** 0.5
    peaks = 1.6 * np.exp(-cycles / 2e4)
    edge_x = np.exp(-np.abs(np.abs(x) - (0.5 * SIZE[0] - EDGE)) / 0.3)
    edge_y = np.exp(-np.abs(np.abs(y) - (0.5 * SIZE[1] - END)) / 0.5)
    return load * 100.0 * closed * (1.0 + peaks * (edge_x + 0.5 * edge_y)) * (1.0 + 0.02 * x)


def depth(x: Array, y: Array, cycles: float, load: float) -> Array:
    """Return the wear depth of one body [mm]."""
    return 1e-4 * cycles / 1e5 * peak_pressure(x, y, cycles, load)


def put(group: h5py.Group, **values: Any) -> None:
    """Store datasets in the way a run does."""
    for name, value in values.items():
        dataset = group.create_dataset(name, data=value)
        dataset.attrs["unit"], dataset.attrs["description"] = "1", name


def put_structure(file: h5py.File, name: str, load: float, cycles: float) -> None:
    """Write the FE face, its fields over the cycle, and the resultants."""
    group = file.create_group(f"{'structure_worn' if cycles else 'structure'}/{name}")
    nodes = np.meshgrid(
        *(0.5 * size * np.linspace(-1, 1, n) for size, n in zip(SIZE, (20, 34), strict=True)),
        indexing="ij",
    )
    x, y = (axis.ravel() for axis in nodes)
    index = np.arange(x.size).reshape(20, 34)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    facets = np.array([[a, b, c], [a, c, d]]).swapaxes(1, 3).reshape(-1, 3)
    t = np.arange(INCREMENTS)
    level = np.where(t <= PEAK, (t + 1) / (PEAK + 1), 1 - (t - PEAK) / (INCREMENTS - PEAK)) ** 2
    pressure = 0.7 * np.outer(level, peak_pressure(x, y, cycles, load))
    shear = np.stack([-FRICTION * pressure, 0.0 * pressure], axis=1)
    fields = {"pressure": pressure, "shear": shear, "slip": 1e-4 * shear, "gap": rounding(x, y)}
    put(group, coordinates=np.stack([x, y], 1), facets=facets, **fields)
    group.attrs["friction"] = FRICTION
    normal, ratio = 5e4 * load * level, np.clip(np.where(t <= PEAK, -1, (t - 14.5) / 4), -1, 1)
    zero, energy = np.zeros(INCREMENTS), 200.0 * load * level * (np.abs(ratio) >= 1)
    history = {"P": normal, "Qx": ratio * FRICTION * normal, "Qy": 0.01 * normal}
    history |= {"Mx": zero, "My": 0.3 * normal, "Mz": zero, "Edx": energy, "Edy": 0.02 * energy}
    put(group.create_group("load_history"), **history, sliding=np.abs(ratio) >= 1)


def put_contact(file: h5py.File, name: str, load: float, grid: Grid) -> None:
    """Write surfaces and tractions at every jump, the coarse grid and the half-space's energy."""
    for number, cycles in enumerate(JUMPS):
        worn = depth(grid.x, grid.y, cycles, load)
        surface = file.create_group(f"surfaces/{name}/{number:05d}")
        put(surface, body_1=-worn, body_2=rounding(grid.x, grid.y) + 0.5 * worn)
        pressure = peak_pressure(grid.x, grid.y, cycles, load)
        shear = np.stack([-FRICTION * pressure, 0.1 * pressure])
        contact = file.create_group(f"contact/{name}/{number:05d}")
        contact.attrs["cycles"] = cycles
        put(contact, pressure=pressure, shear=shear, slip=-1e-5 * shear)
    coarse = Grid.covering(SIZE, (20, 34))
    group = file.create_group(f"contact/{name}/coarse")
    group.attrs["shape"], group.attrs["pitch"] = coarse.shape, coarse.pitch
    put(group, pressure=peak_pressure(coarse.x, coarse.y, 0.0, load))
    history = file[f"structure/{name}/load_history"]
    put(file[f"contact/{name}"], energy_half_space=0.97 * history["Edx"][()])


def put_comparison(file: h5py.File, name: str, load: float, grid: Grid) -> None:
    """Write the half-space's separate cycle: its loads, and its fields at three increments."""
    structure = file[f"structure/{name}/load_history"]
    history = {key: column[()] for key, column in structure.items()}
    history["Qx"] = 0.998 * history["Qx"]
    put(file.create_group(f"comparison/{name}/load_history"), **history)
    for increment in (PEAK, PEAK + 4, PEAK + 7):
        pressure = peak_pressure(grid.x, grid.y, 0.0, load) / (1 + increment - PEAK)
        shear = np.stack([-FRICTION * pressure, 0.1 * pressure])
        group = file.create_group(f"comparison/{name}/{increment:05d}")
        put(group, pressure=pressure, shear=shear, slip=-1e-5 * shear)


def put_kinetics(file: h5py.File, name: str, grid: Grid) -> None:
    """Write depths and volumes over the cycles, computed from the surfaces."""
    group, jumps = file.create_group(f"kinetics/{name}"), file[f"surfaces/{name}"]
    for body in (1, 2):
        heights = np.array([jumps[jump][f"body_{body}"] for jump in sorted(jumps)])
        worn = np.abs(heights - heights[0])
        volume = worn.sum(axis=(1, 2)) * grid.cell_area
        put(group, **{f"depth_{body}": worn.max(axis=(1, 2)), f"volume_{body}": volume})
    put(group, energy=1e3 * JUMPS, area=np.linspace(500.0, 600.0, len(JUMPS)))
    for quantity in ("depth", "volume"):
        both = group[f"{quantity}_1"][()] + group[f"{quantity}_2"][()]
        group.attrs[f"{quantity}_rate"] = (both[-1] - both[-2]) / (JUMPS[-1] - JUMPS[-2])
        group.attrs[f"{quantity}_linear_from"] = 4e4
        group.attrs[f"{quantity}_trend"] = group.attrs[f"{quantity}_scatter"] = 0.0
    if name == "extrados":  # its depth has not become linear
        group.attrs["depth_rate"] = group.attrs["depth_linear_from"] = np.nan


def put_errors(file: h5py.File, name: str) -> None:
    """Write parts of the error of two results, one of them unknown."""
    parts = np.array([0.004, np.nan, 0.002, 0.006, 0.001, -0.003, 0.002, 0.0, 0.009])
    put(file.create_group(f"error/{name}"), depth=parts, volume=0.5 * parts)
    file[f"error/{name}"].attrs["accuracy"] = 0.05


def put_bodies(file: h5py.File) -> None:
    """Write two boxes of tetrahedra, stretched along Z."""
    import pyvista as pv

    for body, height in {"disk": 200.0, "blade": 240.0}.items():
        box = pv.ImageData(dimensions=(6, 6, 6), spacing=(10, 14, 12), origin=(-25, -35, height))
        mesh = box.to_tetrahedra(5)
        points = np.array(mesh.points, dtype=float)
        for state, scale in {"unworn": 1.0, "worn": 0.9}.items():
            stress = scale * 10.0 * np.linalg.norm(points - [15.0, 0.0, 245.0], axis=1)
            shift = 1e-3 * scale * points * [0.0, 0.0, 1.0]
            group = file.create_group(f"bodies/{body}/{state}")
            put(group, points=points, elements=mesh.cells.reshape(-1, 5)[:, 1:], displacement=shift)
            tensor = np.multiply.outer(0.1 * np.arange(6.0), stress)
            put(group, von_mises=stress, maximum_principal=0.8 * stress, stress=tensor)
            put_mission(group, mesh, shift, stress)


def put_mission(body: h5py.Group, mesh: Any, shift: Array, stress: Array) -> None:
    """Write the surface in some increments of a cycle; it is unloaded at the last."""
    surface = mesh.extract_surface(algorithm="dataset_surface")
    vertices, share = surface["vtkOriginalPointIds"], np.array([0.5, 1.0, 0.0])
    group = body.create_group("mission")
    moved, equivalent = (np.multiply.outer(share, field[vertices]) for field in (shift, stress))
    put(group, increments=np.array([1, PEAK + 1, 22]), triangles=surface.regular_faces)
    put(group, points=np.array(mesh.points)[vertices], displacement=moved.astype(np.float32))
    put(group, von_mises=equivalent.astype(np.float32))
    put(group, maximum_principal=(0.8 * equivalent).astype(np.float32))


def fabricate(path: Path, shape: tuple[int, int] = (24, 40)) -> Path:
    """Write a plausible ``results.h5`` on a grid a little larger than the flank."""
    grid = Grid.covering((1.08 * SIZE[0], 1.05 * SIZE[1]), shape)
    with h5py.File(path, "w") as file:
        file.attrs.update(title="Synthetic dovetail", friction=FRICTION, peak_increment=PEAK)
        file.attrs["bodies"] = ["disk", "blade"]
        for (name, load), side in zip(INTERFACES.items(), (1.0, -1.0), strict=True):
            frame, group = flank_frame(side), file.create_group(f"grid/{name}")
            group.attrs.update(shape=grid.shape, pitch=grid.pitch)
            group.attrs.update(origin=frame.origin, axes=frame.axes)
            put_structure(file, name, load, 0.0)
            put_structure(file, name, load, JUMPS[-1])
            put_contact(file, name, load, grid)
            put_comparison(file, name, load, grid)
            put_kinetics(file, name, grid)
            put_errors(file, name)
        put(file["kinetics"], cycles=JUMPS)
        put_bodies(file)
    return path


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return synthetic results, which tests must not change."""
    return fabricate(tmp_path_factory.mktemp("run") / "results.h5")


# --- files of the templates ----------------------------------------------------------------------

# Nodes of the pad of specimens_coarse.yaml.
PADS = 81
LOADS = "P,Qx,Qy,Mx,My,Mz,Edx,Edy\n1,0,0,0,0,0,0,0\n"
NODES = "node,X,Y,Z\n1,15,0,245\n2,14,0,246\n3,15,1,245\n"
# Corner and size of the boxes of the joint [mm], and the heights of their named faces.
BOXES: dict[str, tuple[tuple[float, ...], dict[str, float]]] = {
    "disk": ((-5, -5, -4, 10, 10, 4), {"disk_base": -4.0, "disk_top": 0.0}),
    "blade": ((-4, -4, 0, 8, 8, 4), {"blade_foot": 0.0, "blade_top": 4.0}),
    "bolt": ((-2, -2, 4, 4, 4, 4), {"bolt_foot": 4.0, "bolt_top": 8.0}),
}


def write_joint(folder: Path) -> None:
    """Write successively smaller boxes on each other, as ``joint.msh`` and as ``joint.step``."""
    with gmsh_model("joint") as gmsh:
        occ = gmsh.model.occ
        for body, (box, heights) in BOXES.items():
            solid = occ.addBox(*box)
            occ.synchronize()
            gmsh.model.addPhysicalGroup(3, [solid], name=body)
            faces = [face for _, face in gmsh.model.getBoundary([(3, solid)], oriented=False)]
            middle = {face: occ.getCenterOfMass(2, face)[2] for face in faces}
            for name, height in heights.items():
                (face,) = (face for face in faces if abs(middle[face] - height) < 1e-9)
                gmsh.model.addPhysicalGroup(2, [face], name=name)
        gmsh.write(str(folder / "joint.step"))
        gmsh.option.setNumber("Mesh.MeshSizeMin", 4.0)
        gmsh.model.mesh.generate(3)
        gmsh.write(str(folder / "joint.msh"))


def write_sector(folder: Path) -> None:
    """Write a 1/24 sector of a disk with a block on it, ``sector.msh``, named as the joint."""
    names = {"pad": "top", "bore": "base", "low": "low", "high": "high"}
    disk = renamed(sector(24, dimension=3), "disk", names)
    blade = renamed(shoe(24, dimension=3), "blade", {"pad": "foot", "top": "top"})
    write_msh(folder / "sector.msh", StructureMesh((disk, blade), ()))


def renamed(body: Body, name: str, names: dict[str, str]) -> Body:
    """Return the body with some of its boundaries, under other names."""
    mesh = replace(body.mesh, _boundaries=None)
    return Body(
        name, mesh.with_boundaries({new: body.mesh.boundaries[old] for old, new in names.items()})
    )


def write_matrices_of_templates(folder: Path) -> None:
    """Write a row of masses from pads and rings to a tip, in files of several kinds."""
    inner = [f"inner {number}" for number in range(1, 36)]
    points = ["pad 1", "pad 2", "ring 1", "ring 2", *inner, "tip"]
    names = [f"{point} {axis}" for axis in "yzx" for point in points]
    size = len(names)
    stiffness = row_in_space(len(points))
    matrices = {"k": 1e3 * stiffness, "m": 1e-3 * np.eye(size), "c": 1e-3 * stiffness}
    matrices |= {"f": np.eye(size, 1, k=1 - size)}
    np.savez(folder / "matrices.npz", **matrices, names=names)
    with h5py.File(folder / "matrices.h5", "w") as file:
        file.update(matrices | {"names": [name.encode() for name in names]})
    for name, matrix in matrices.items():
        symmetry = "general" if name == "f" else "symmetric"
        scipy.io.mmwrite(folder / f"{name}.mtx", matrix, symmetry=symmetry)
    rows = [",".join(name.rsplit(" ", 1)) for name in names]
    (folder / "unknowns.csv").write_text("\n".join(["point,direction", *rows, ""]), "utf-8")


@pytest.fixture(scope="session")
def template_files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the files that the templates name, which tests must not change."""
    folder = tmp_path_factory.mktemp("template")
    write_joint(folder)
    write_sector(folder)
    (folder / "loads.csv").write_text(LOADS, encoding="utf-8")
    # More nodes than the mesh has.
    (folder / "temperatures.csv").write_text(
        "node,temperature\n" + "".join(f"{n},{20 + n / 10}\n" for n in range(1, 3000)), "utf-8"
    )
    for body in (1, 2):
        (folder / f"nodes_{body}.csv").write_text(NODES, encoding="utf-8")
    for name in ("specimens_wear.yaml", "specimens_rig.yaml"):
        shutil.copy(CASES / name, folder)
    shutil.copy(CASES / "specimens_coarse.yaml", folder / "specimens.yaml")
    save_reduced(folder / "body_2.h5", BODY)
    return folder


@pytest.fixture(scope="session")
def folders(tmp_path_factory: pytest.TempPathFactory, template_files: Path) -> dict[str, Path]:
    """Return a folder for the template of each kind, with the files that its examples name."""
    made = {}
    for kind in kinds():
        made[kind] = tmp_path_factory.mktemp(kind)
        shutil.copytree(template_files, made[kind], dirs_exist_ok=True)
        np.save(made[kind] / "gap.npy", np.zeros(CELLS.get(kind, (0, 0))))
        np.save(made[kind] / "factors.npy", np.ones(CELLS.get(kind, (0, 0))))
        # A scan of more than the size of the template's grid, or a profile.
        np.save(made[kind] / "disk.npy", np.zeros((600, 1 if "line" in kind else 600)))
        (made[kind] / "history.csv").write_text("P,Qx\n1,0\n1,0.1\n", encoding="utf-8")
        (made[kind] / "force.csv").write_text("time,force\n0,0\n1,5\n", encoding="utf-8")
        period = "phase [deg],force\n0,0\n90,5\n270,-5\n360,0\n"
        (made[kind] / "period.csv").write_text(period, encoding="utf-8")
        write_matrices_of_templates(made[kind])
        rows = "".join(f"pad {number},1\n" for number in range(1, PADS + 1))
        (made[kind] / "nodes.csv").write_text(f"point,area\n{rows}", encoding="utf-8")
        (made[kind] / "loops.csv").write_text("energy,P,kt,mu\n0,1,1,1\n", encoding="utf-8")
        (made[kind] / "measured.csv").write_text("at,values\n0,1\n", encoding="utf-8")
    return made


# --- runs of the small case ---------------------------------------------------------------------


@dataclass(frozen=True)
class Run:
    """Finished run: how it ended, and its files."""

    ending: Result
    folder: Path

    @property
    def summary(self) -> dict[str, Any]:
        summary: dict[str, Any] = json.loads((self.folder / "summary.json").read_text("utf-8"))
        return summary

    def heights(self) -> dict[str, Array]:
        """Return all surfaces of ``results.h5`` by interface, jump and body."""
        heights = {}
        with h5py.File(self.folder / "results.h5") as file:
            file["surfaces"].visititems(
                lambda name, item: heights.update(
                    {name: item[()]} if hasattr(item, "shape") else {}
                )
            )
        return heights


Runner = Callable[..., Run]


def contents_of(folder: Path) -> WearContents:
    """Return the description of the contents of a finished wear run."""
    return read_contents(folder / "results.h5", WearContents)


def manifest_has_all(folder: Path) -> bool:
    """Return whether the manifest lists exactly the files of a run, and no lock is left."""
    listed = OutputFolder(folder).manifest
    assert listed is not None
    runs = [path.parent for path in folder.glob("*/manifest.json")]
    there = {path.name for path in folder.iterdir() if path.is_dir()}
    there |= {
        path.relative_to(folder).as_posix()
        for path in folder.rglob("*")
        if path.is_file() and not any(run in path.parents for run in runs)
    }
    return there == listed.keys() | {"manifest.json"} and all(listed.values())


@pytest.fixture(scope="session")
def small_path(dovetail_path: Path) -> Path:
    """Return the path of the case that takes a few seconds."""
    return dovetail_path.with_name("dovetail_small.yaml")


@pytest.fixture(scope="session", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Use a separate cache for the tests, shared by all runs of a session."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("FRETSCALE_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="session", autouse=True)
def _all_here() -> Iterator[None]:
    """Compute contacts and pictures in the process of the test, since starting processes is slow.

    Separate processes find the same contacts except for rounding (test_run.py).
    """
    with runs_here():
        yield


@pytest.fixture(scope="session", autouse=True)
def _without_probe_runs() -> Iterator[None]:
    """Switch off the probe runs of the error budget, which take seconds.

    test_error_budget.py tests them.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(wear_run, "begin_probe_runs", lambda *_: lambda _: Probed())
        yield


@pytest.fixture
def separate_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Use separate processes for contacts and pictures, as outside of tests."""
    monkeypatch.setattr(contact_workers, "workers", processes.workers)
    monkeypatch.setattr(running, "WorkerProcess", processes.WorkerProcess)
    monkeypatch.setattr(drawing, "share_out", processes.share_out)


@pytest.fixture(scope="session")
def start(small_path: Path) -> Runner:
    """Return a function that runs a reduced small case with overrides, without pictures."""
    fewer = ("load_path.increments=[3, 5]",)
    quiet = "output.paraview=false", "output.figures=false"
    quiet += "stress.section=none", "stress.life.parameter=none"

    def run(folder: Path, *overrides: str, force: bool = False) -> Run:
        forced = ["--force"] if force else []
        return Run(
            command(
                "run", small_path, "--out", folder, *forced, overrides=[*fewer, *quiet, *overrides]
            ),
            folder,
        )

    return run


@contextmanager
def without_notches() -> Iterator[None]:
    """Leave out the local models of notches, which take half of the time of a run."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(structure_stress, "with_local_models", lambda *given: given[-1])
        yield


@pytest.fixture(scope="session")
def start_without_notches(start: Runner) -> Runner:
    """Return ``start`` without local models of notches."""

    def run(*arguments: Any) -> Run:
        with without_notches():
            return start(*arguments)

    return run


@pytest.fixture(scope="session")
def resume() -> Callable[[Path], Run]:
    """Return a function that resumes a run in this process."""
    return lambda folder: Run(invoke("resume", folder), folder)


def made_once(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], Run]) -> Run:
    """Return the run that ``make`` writes to a folder, in one test process for all of them."""
    root = factory.getbasetemp()
    root = (root.parent if "PYTEST_XDIST_WORKER" in os.environ else root) / name
    kept = root / "run.pickle"
    with locked(root, patience=600.0):
        if not kept.exists():
            run = make(root / "out")
            run.ending.exc_info = None  # holds a traceback, which cannot be pickled
            kept.write_bytes(pickle.dumps(run))
        made: Run = pickle.loads(kept.read_bytes())
    return made


@pytest.fixture(scope="session")
def whole(start: Runner, tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Return a complete run of the small case, which tests must not change."""
    run = made_once(tmp_path_factory, "whole", start)
    assert run.ending.exit_code == 0, run.ending.stderr
    return run


@pytest.fixture
def blocks(tmp_path: Path) -> Path:
    """Return the case of a cube of 1 mm on one of 2 mm."""
    return pressed_blocks(tmp_path)
