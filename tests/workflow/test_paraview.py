"""ParaView files: read back, at the right place, with the right values and times."""

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import pyvista as pv

from sa_solver.types import Array, Frame, Grid
from workflow.paraview import write_paraview

SIZE, EDGE, END = (10.0, 60.0), 1.0, 3.0
EDGE_RADIUS, END_RADIUS = 30.0, 150.0
INTERFACES = {"intrados": 1.0, "extrados": 0.8}  # name and its share of the load
INCREMENTS, PEAK, FRICTION = 22, 7, 0.4
JUMPS = np.array([0.0, 5e3, 1e4, 2e4, 4e4, 7e4, 1e5])
SINGLE = 2e-7  # rounding of single precision


def flank_frame(side: float) -> Frame:
    """Frame of a flank at 45 degrees, right (+1) or left (-1) of the middle."""
    x = np.array([-side, 0.0, 1.0]) / np.sqrt(2.0)
    z = np.array([-side, 0.0, -1.0]) / np.sqrt(2.0)
    return Frame(np.array([15.0 * side, 0.0, 245.0]), np.array([x, np.cross(z, x), z]))


def rounding(x: Array, y: Array) -> Array:
    """Gap of the rounded edges and ends [mm]."""
    beyond_x = np.maximum(np.abs(x) - (0.5 * SIZE[0] - EDGE), 0.0)
    beyond_y = np.maximum(np.abs(y) - (0.5 * SIZE[1] - END), 0.0)
    return beyond_x**2 / (2.0 * EDGE_RADIUS) + beyond_y**2 / (2.0 * END_RADIUS)


def peak_pressure(x: Array, y: Array, cycles: float, load: float) -> Array:
    """A flat punch's pressure: edge peaks that wear takes off [MPa]."""
    closed = np.clip(1.0 - rounding(x, y) / 4e-3, 0.0, None) ** 0.5
    peaks = 1.6 * np.exp(-cycles / 2e4)
    edge_x = np.exp(-np.abs(np.abs(x) - (0.5 * SIZE[0] - EDGE)) / 0.3)
    edge_y = np.exp(-np.abs(np.abs(y) - (0.5 * SIZE[1] - END)) / 0.5)
    return load * 100.0 * closed * (1.0 + peaks * (edge_x + 0.5 * edge_y)) * (1.0 + 0.02 * x)


def depth(x: Array, y: Array, cycles: float, load: float) -> Array:
    """Wear depth of one body [mm]."""
    return 1e-4 * cycles / 1e5 * peak_pressure(x, y, cycles, load)


def put(group: h5py.Group, **values: Any) -> None:
    """Store datasets the way a run does."""
    for name, value in values.items():
        dataset = group.create_dataset(name, data=value)
        dataset.attrs["unit"], dataset.attrs["description"] = "1", name


def put_structure(file: h5py.File, name: str, load: float, cycles: float) -> None:
    """FE face, its fields over the cycle, and the resultants."""
    group = file.create_group(f"{'structure_worn' if cycles else 'structure'}/{name}")
    nodes = np.meshgrid(np.linspace(-5, 5, 20), np.linspace(-30, 30, 34), indexing="ij")
    x, y = (axis.ravel() for axis in nodes)
    index = np.arange(x.size).reshape(20, 34)
    facets = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:]], -1).reshape(-1, 3)
    t = np.arange(INCREMENTS)
    level = np.where(t <= PEAK, (t + 1) / (PEAK + 1), 1 - (t - PEAK) / (INCREMENTS - PEAK)) ** 2
    pressure = 0.7 * np.outer(level, peak_pressure(x, y, cycles, load))
    shear = np.stack([-FRICTION * pressure, 0.0 * pressure], axis=1)
    fields = {"pressure": pressure, "shear": shear, "slip": 1e-4 * shear, "gap": rounding(x, y)}
    put(group, coordinates=np.stack([x, y], 1), facets=facets, **fields)
    normal, ratio = 5e4 * load * level, np.clip(np.where(t <= PEAK, -1, (t - 14.5) / 4), -1, 1)
    zero, energy = np.zeros(INCREMENTS), 200.0 * load * level * (np.abs(ratio) >= 1)
    history = {"P": normal, "Qx": ratio * FRICTION * normal, "Qy": 0.01 * normal}
    history |= {"Mx": zero, "My": 0.3 * normal, "Mz": zero, "Edx": energy, "Edy": 0.02 * energy}
    put(group.create_group("load_history"), **history, sliding=np.abs(ratio) >= 1)


def put_contact(file: h5py.File, name: str, load: float, grid: Grid) -> None:
    """Surfaces and tractions at every jump, the coarse grid and the half-space's energy."""
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


def put_kinetics(file: h5py.File, name: str, grid: Grid) -> None:
    """Depths and volumes over the cycles, from the surfaces."""
    group, jumps = file.create_group(f"kinetics/{name}"), file[f"surfaces/{name}"]
    for body in (1, 2):
        heights = np.array([jumps[jump][f"body_{body}"] for jump in sorted(jumps)])
        worn = np.abs(heights - heights[0])
        volume = worn.sum(axis=(1, 2)) * grid.cell_area
        put(group, **{f"depth_{body}": worn.max(axis=(1, 2)), f"volume_{body}": volume})
    put(group, energy=1e3 * JUMPS)
    for quantity in ("depth", "volume"):
        both = group[f"{quantity}_1"][()] + group[f"{quantity}_2"][()]
        group.attrs[f"{quantity}_rate"] = (both[-1] - both[-2]) / (JUMPS[-1] - JUMPS[-2])
    group.attrs["linear_from"] = 4e4
    if name == "extrados":  # its depth has not become linear
        group.attrs["depth_rate"] = group.attrs["linear_from"] = np.nan


def put_bodies(file: h5py.File) -> None:
    """Two boxes of tetrahedra, stretched along Z."""
    for body, height in {"disk": 200.0, "blade": 240.0}.items():
        box = pv.ImageData(dimensions=(6, 6, 6), spacing=(10, 14, 12), origin=(-25, -35, height))
        mesh = box.to_tetrahedra(5)
        points = np.array(mesh.points, dtype=float)
        for state, scale in {"unworn": 1.0, "worn": 0.9}.items():
            stress = scale * 10.0 * np.linalg.norm(points - [15.0, 0.0, 245.0], axis=1)
            shift = 1e-3 * scale * points * [0.0, 0.0, 1.0]
            group = file.create_group(f"bodies/{body}/{state}")
            put(group, points=points, tets=mesh.cells.reshape(-1, 5)[:, 1:], displacement=shift)
            put(group, von_mises=stress, maximum_principal=0.8 * stress)


def fabricate(path: Path, shape: tuple[int, int] = (24, 40)) -> Path:
    """A plausible ``results.h5`` on a grid a little larger than the flank."""
    grid = Grid.covering((10.8, 63.0), shape)
    with h5py.File(path, "w") as file:
        file.attrs.update(title="Synthetic dovetail", friction=FRICTION, peak_increment=PEAK)
        for (name, load), side in zip(INTERFACES.items(), (1.0, -1.0), strict=True):
            frame, group = flank_frame(side), file.create_group(f"grid/{name}")
            group.attrs.update(shape=grid.shape, pitch=grid.pitch)
            group.attrs.update(origin=frame.origin, axes=frame.axes)
            put_structure(file, name, load, 0.0)
            put_structure(file, name, load, JUMPS[-1])
            put_contact(file, name, load, grid)
            put_kinetics(file, name, grid)
        put(file["kinetics"], cycles=JUMPS)
        put_bodies(file)
    return path


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fabricate(tmp_path_factory.mktemp("run") / "results.h5")


@pytest.fixture(scope="module")
def folder(results: Path) -> Path:
    written = results.parent / "paraview"
    paths = write_paraview(results, written)
    assert sorted(paths) == sorted(path for path in written.rglob("*") if path.is_file())
    return written


def grid_and_frame(file: h5py.File, name: str) -> tuple[Grid, Frame]:
    attrs = file["grid"][name].attrs
    grid = Grid(tuple(attrs["shape"]), tuple(attrs["pitch"]))
    return grid, Frame(attrs["origin"], attrs["axes"])


def local_centres(grid: Grid) -> Array:
    """Cell centres in the interface frame, ``(nx, ny, 3)``."""
    x, y = np.broadcast_arrays(grid.x, grid.y)
    return np.stack([x, y, np.zeros(grid.shape)], axis=-1)


@pytest.mark.parametrize("name", INTERFACES)
def test_flank_sits_at_its_place(results: Path, folder: Path, name: str) -> None:
    image = pv.read(folder / name / "00000.vti")
    with h5py.File(results) as file:
        grid, frame = grid_and_frame(file, name)
    expected = frame.origin + local_centres(grid) @ frame.axes
    centres = image.cell_centers().points.reshape(*grid.shape[::-1], 3).swapaxes(0, 1)
    np.testing.assert_allclose(centres, expected, atol=1e-4)


@pytest.mark.parametrize("name", INTERFACES)
@pytest.mark.parametrize("jump", ["00000", "00004"])
def test_flank_fields_are_those_of_the_run(
    results: Path, folder: Path, name: str, jump: str
) -> None:
    image = pv.read(folder / name / f"{jump}.vti")
    with h5py.File(results) as file:
        grid, frame = grid_and_frame(file, name)
        contact, surface = file["contact"][name][jump], file["surfaces"][name][jump]
        unworn = file["surfaces"][name]["00000"]
        scalars = {"pressure": contact["pressure"][()]}
        for body in (1, 2):
            height = scalars[f"height_{body}"] = surface[f"body_{body}"][()]
            scalars[f"wear_depth_{body}"] = np.abs(height - unworn[f"body_{body}"][()])
        scalars["wear_depth"] = scalars["wear_depth_1"] + scalars["wear_depth_2"]
        vectors = {quantity: contact[quantity][()] for quantity in ("shear", "slip")}
    for key, expected in scalars.items():
        found = image.cell_data[key].reshape(grid.shape, order="F")
        np.testing.assert_allclose(found, expected, rtol=SINGLE, err_msg=key)
    for key, (x, y) in vectors.items():
        found = frame.components(np.array(image.cell_data[key], dtype=float))
        found = found.reshape(*grid.shape, 3, order="F")
        scale = np.abs(x).max()
        np.testing.assert_allclose(found[..., 0], x, atol=SINGLE * scale)
        np.testing.assert_allclose(found[..., 1], y, atol=SINGLE * scale)
        np.testing.assert_allclose(found[..., 2], 0.0, atol=SINGLE * scale)
        np.testing.assert_allclose(image.cell_data[f"{key}_x"], x.ravel(order="F"), rtol=SINGLE)


@pytest.mark.parametrize("name", INTERFACES)
def test_series_steps_through_the_cycles(folder: Path, name: str) -> None:
    reader = pv.PVDReader(folder / f"{name}.pvd")
    assert reader.time_values == list(JUMPS)
    reader.set_active_time_value(JUMPS[-1])
    last = reader.read()[0]
    assert last.cell_data["wear_depth"].max() > 0.0
    reader.set_active_time_value(0.0)
    assert reader.read()[0].cell_data["wear_depth"].max() == 0.0


def test_structure_is_unworn_then_worn(results: Path, folder: Path) -> None:
    reader = pv.PVDReader(folder / "structure.pvd")
    assert reader.time_values == [0.0, JUMPS[-1]]
    with h5py.File(results) as file:
        for time, state in zip(reader.time_values, ("unworn", "worn"), strict=True):
            reader.set_active_time_value(time)
            parts = reader.read()
            assert len(parts) == len(file["bodies"])
            for part, body in zip(parts, file["bodies"], strict=True):
                stored = file["bodies"][body][state]
                np.testing.assert_array_equal(part.points, stored["points"])
                np.testing.assert_array_equal(part.cells_dict[pv.CellType.TETRA], stored["tets"])
                for key in ("displacement", "von_mises", "maximum_principal"):
                    np.testing.assert_allclose(part.point_data[key], stored[key], rtol=SINGLE)


def worn_volume(surface: pv.PolyData, frame: Frame) -> float:
    """Volume between a surface and the nominal plane, counted along the frame's z [mm³]."""
    corners = frame.coordinates(np.array(surface.points, dtype=float))
    a, b, c = np.moveaxis(corners[surface.regular_faces], 1, 0)
    areas = 0.5 * np.cross(b - a, c - a)[:, 2]
    return float(np.sum(areas * (a + b + c)[:, 2] / 3.0))


@pytest.mark.parametrize("name", INTERFACES)
def test_worn_surface_covers_the_flank_and_holds_the_worn_volume(
    results: Path, folder: Path, name: str
) -> None:
    with h5py.File(results) as file:
        grid, frame = grid_and_frame(file, name)
        heights = file["surfaces"][name]["00006"]["body_1"][()]
    surface = pv.read(folder / f"flank_{name}_disk.stl")
    local = frame.coordinates(np.array(surface.points, dtype=float))
    # The outermost cell centres on the flank are less than a pitch inside its border.
    reach = np.abs(local[:, :2]).max(axis=0)
    assert np.all(reach <= np.array(SIZE) / 2 + 1e-4)
    assert np.all(reach > np.array(SIZE) / 2 - grid.pitch)
    # Bilinear patches over the same heights: all that differs is how a square is halved.
    on_x, on_y = (
        np.abs(axis) <= size / 2 for axis, size in zip((grid.x, grid.y), SIZE, strict=True)
    )
    inside = heights[on_x.ravel()][:, on_y.ravel()]
    corners = inside[1:, 1:] + inside[1:, :-1] + inside[:-1, 1:] + inside[:-1, :-1]
    assert worn_volume(surface, frame) == pytest.approx(
        corners.sum() / 4 * grid.cell_area, rel=5e-3
    )


@pytest.mark.parametrize(("body", "outward"), [("disk", 1.0), ("blade", -1.0)])
def test_worn_surfaces_face_each_other(folder: Path, body: str, outward: float) -> None:
    surface = pv.read(folder / f"flank_intrados_{body}.stl")
    normals = surface.compute_normals(
        cell_normals=True, consistent_normals=False, auto_orient_normals=False
    )["Normals"]
    assert np.all(outward * normals @ flank_frame(1.0).axes[2] > 0.99)


def header(path: Path) -> ElementTree.Element:
    """The XML of a file before its raw appended data."""
    text = path.read_bytes().split(b"<AppendedData")[0]
    return ElementTree.fromstring(text + b"</VTKFile>")


def test_files_are_compressed_and_no_newer_than_paraview_can_read(folder: Path) -> None:
    for path in (folder / "intrados" / "00001.vti", folder / "structure" / "disk_worn.vtu"):
        root = header(path)
        # Readers since VTK 8 take every version 1 and 2.
        assert re.fullmatch(r"[12]\.\d", root.attrib["version"])
        assert root.attrib["header_type"] == "UInt64"
        assert root.attrib["compressor"] == "vtkZLibDataCompressor"
        assert {array.attrib["format"] for array in root.iter("DataArray")} == {"appended"}


def test_arrays_carry_their_units(folder: Path) -> None:
    arrays = header(folder / "intrados" / "00001.vti").iter("DataArray")
    units = {
        a.attrib["Name"]: [key.text.strip() for key in a.iter("InformationKey")] for a in arrays
    }
    assert "MPa" in units["pressure"]
    assert "mm" in units["wear_depth"]


def test_failed_write_leaves_nothing_behind(results: Path, tmp_path: Path) -> None:
    blocked = tmp_path / "paraview"
    (blocked / "intrados.pvd").mkdir(parents=True)  # a folder where the series should go
    with pytest.raises(OSError, match=r"intrados\.pvd"):
        write_paraview(results, blocked)
    assert not list(blocked.rglob("*.part"))


def test_run_without_structure_writes_the_flanks(results: Path, tmp_path: Path) -> None:
    bare = tmp_path / "results.h5"
    bare.write_bytes(results.read_bytes())
    with h5py.File(bare, "a") as file:
        for group in ("structure", "structure_worn", "bodies"):
            del file[group]
        nodes = int(np.prod(file["grid/intrados"].attrs["shape"]))
    written = {path.name for path in write_paraview(bare, tmp_path / "paraview")}
    assert "intrados.pvd" in written
    assert "structure.pvd" not in written
    assert pv.read(tmp_path / "paraview" / "flank_intrados_disk.stl").n_points == nodes
