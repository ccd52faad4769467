"""ParaView files are read back with the right places, values and times."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import h5py
import numpy as np
import pytest
import pyvista as pv

from sa_solver.types import Array, Frame, Grid
from tests.workflow.conftest import CONTENTS, PEAK
from tests.workflow.output.shown_files import check_arrays, check_scene
from workflow.analyses.wear import ANALYSIS
from workflow.analyses.wear.output.layout import WearContents
from workflow.analyses.wear.worn.worn_structure import MOST_INCREMENTS, shown_increments
from workflow.pictures.drawing import write_paraview
from workflow.shell.output.results import frame_of, grid_of

SIZE = (10.0, 60.0)  # of the synthetic flanks [mm]
INTERFACES = ("intrados", "extrados")
SINGLE = 2e-7  # rounding of single precision
TANGENTIAL = {"shear": "MPa", "slip": "mm"}
NODAL = {"displacement": "mm", "von_mises": "MPa", "maximum_principal": "MPa"}


@pytest.fixture(scope="module")
def folder(results: Path) -> Path:
    written = results.parent / "paraview"
    paths = write_wear(CONTENTS, results, written)
    assert sorted(paths) == sorted(path for path in written.rglob("*") if path.is_file())
    return written


def grid_and_frame(file: h5py.File, name: str) -> tuple[Grid, Frame]:
    return grid_of(file["grid"][name]), frame_of(file["grid"][name])


def local_centres(grid: Grid) -> Array:
    """Return cell centres in the interface frame, ``(nx, ny, 3)``."""
    x, y = np.broadcast_arrays(grid.x, grid.y)
    return np.stack([x, y, np.zeros(grid.shape)], axis=-1)


def on_flank(grid: Grid) -> tuple[Array, Array]:
    """Return which rows and columns of the grid lie on the flank."""
    on_x, on_y = (
        np.abs(axis.ravel()) <= size / 2 for axis, size in zip((grid.x, grid.y), SIZE, strict=True)
    )
    return on_x, on_y


def flank(folder: Path, name: str, jump: str) -> tuple[pv.PolyData, tuple[int, int]]:
    """Return a flank, and how many points it has along x and y."""
    mesh = pv.read(folder / name / f"{jump}.vtp")
    (columns,) = np.unique(mesh.points @ np.array([0.0, 1.0, 0.0])).shape
    return mesh, (mesh.n_points // columns, columns)


def test_arrays_have_units_and_no_nan(folder: Path) -> None:
    check_arrays(folder)


@pytest.mark.parametrize("name", INTERFACES)
def test_flank_sits_at_its_place(results: Path, folder: Path, name: str) -> None:
    mesh, shape = flank(folder, name, "00000")
    with h5py.File(results) as file:
        grid, frame = grid_and_frame(file, name)
    on_x, on_y = on_flank(grid)
    expected = frame.origin + local_centres(grid)[on_x][:, on_y] @ frame.axes
    points = mesh.points.reshape(*shape[::-1], 3).swapaxes(0, 1)
    np.testing.assert_allclose(points, expected, atol=1e-10)
    assert shape < grid.shape  # what the grid has beyond the flank is none of it


@pytest.mark.parametrize("name", INTERFACES)
@pytest.mark.parametrize("jump", ["00000", "00004"])
def test_flank_fields_are_those_of_the_run(results, folder, name, jump):
    mesh, shape = flank(folder, name, jump)
    with h5py.File(results) as file:
        grid, frame = grid_and_frame(file, name)
        contact, surface = file["contact"][name][jump], file["surfaces"][name][jump]
        unworn = file["surfaces"][name]["00000"]
        scalars, normals = {"pressure [MPa]": contact["pressure"][()]}, {}
        for body in (1, 2):
            height = normals[f"surface_{body} [mm]"] = surface[f"body_{body}"][()]
            worn = normals[f"worn_{body} [mm]"] = height - unworn[f"body_{body}"][()]
            scalars[f"depth_{body} [mm]"] = np.abs(worn)
        scalars["depth [mm]"] = scalars["depth_1 [mm]"] + scalars["depth_2 [mm]"]
        tangential = {f"{key} [{unit}]": contact[key][()] for key, unit in TANGENTIAL.items()}
    on_x, on_y = on_flank(grid)
    for key, expected in scalars.items():
        field = mesh.point_data[key].reshape(shape, order="F")
        np.testing.assert_allclose(field, expected[on_x][:, on_y], rtol=SINGLE, err_msg=key)
    vectors = {key: (*field, 0.0 * field[0]) for key, field in tangential.items()}
    vectors |= {key: (0.0 * field, 0.0 * field, field) for key, field in normals.items()}
    for key, expected in vectors.items():
        components = frame.components(np.array(mesh.point_data[key], dtype=float))
        scale = max(np.abs(part).max() for part in expected)
        for found, part in zip(components.T, expected, strict=True):
            field = found.reshape(shape, order="F")
            np.testing.assert_allclose(field, part[on_x][:, on_y], atol=SINGLE * scale)
    for key, (x, _) in tangential.items():
        along = mesh.point_data[f"face_{key.replace(' ', '_x ')}"]
        np.testing.assert_allclose(along, x[on_x][:, on_y].ravel(order="F"), rtol=SINGLE)


@pytest.mark.parametrize("name", INTERFACES)
@pytest.mark.parametrize(("number", "body"), [(1, "disk"), (2, "blade")])
def test_warped_flank_is_the_worn_surface(folder: Path, name: str, number: int, body: str) -> None:
    mesh, _ = flank(folder, name, "00006")
    warped = mesh.warp_by_vector(f"surface_{number} [mm]")
    surface = pv.read(folder / f"flank_{name}_{body}.stl")
    there = surface.points[surface.find_closest_point(warped.points[0])]
    np.testing.assert_allclose(there, warped.points[0], atol=5e-5)
    for axis in range(3):
        found, expected = (np.sort(points[:, axis]) for points in (warped.points, surface.points))
        np.testing.assert_allclose(found, expected, atol=5e-5)


@pytest.mark.parametrize("name", INTERFACES)
def test_series_steps_through_the_cycles(results: Path, folder: Path, name: str) -> None:
    reader = pv.PVDReader(folder / f"{name}.pvd")
    with h5py.File(results) as file:
        assert reader.time_values == list(file["kinetics/cycles"])
    reader.set_active_time_value(reader.time_values[-1])
    last = reader.read()[0]
    assert last.point_data["depth [mm]"].max() > 0.0
    assert last.field_data["cycles [1]"] == reader.time_values[-1]
    reader.set_active_time_value(0.0)
    assert reader.read()[0].point_data["depth [mm]"].max() == 0.0


@pytest.mark.parametrize("state", ["unworn", "worn"])
def test_structure_moves_over_the_increments(results: Path, folder: Path, state: str) -> None:
    reader = pv.PVDReader(folder / f"mission_{state}.pvd")
    assert reader.time_values == [1.0, PEAK + 1.0, 22.0]
    with h5py.File(results) as file:
        for number, time in enumerate(reader.time_values):
            reader.set_active_time_value(time)
            for part, body in zip(reader.read(), file["bodies"].values(), strict=True):
                assert part.field_data["increment [1]"] == time
                stored = body[state]["mission"]
                np.testing.assert_allclose(part.points, stored["points"], rtol=SINGLE)
                np.testing.assert_array_equal(part.regular_faces, stored["triangles"])
                for key, unit in {"displacement": "mm", "von_mises": "MPa"}.items():
                    shown = part.point_data[f"{key} [{unit}]"]
                    np.testing.assert_array_equal(shown, stored[key][number])


def test_structure_is_unworn_then_worn(results: Path, folder: Path) -> None:
    reader = pv.PVDReader(folder / "structure.pvd")
    with h5py.File(results) as file:
        assert reader.time_values == [0.0, file["kinetics/cycles"][-1]]
        for time, state in zip(reader.time_values, ("unworn", "worn"), strict=True):
            reader.set_active_time_value(time)
            parts = reader.read()
            assert len(parts) == len(file["bodies"])
            for part, body in zip(parts, file["bodies"], strict=True):
                stored = file["bodies"][body][state]
                np.testing.assert_array_equal(part.points, stored["points"])
                np.testing.assert_array_equal(
                    part.cells_dict[pv.CellType.TETRA], stored["elements"]
                )
                for key, unit in NODAL.items():
                    shown = part.point_data[f"{key} [{unit}]"]
                    np.testing.assert_allclose(shown, stored[key], rtol=SINGLE)
                tensor = part.point_data["stress [MPa]"]
                np.testing.assert_allclose(tensor.T, stored["stress"], rtol=SINGLE)


def worn_volume(surface: pv.PolyData, frame: Frame) -> float:
    """Return the volume between a surface and the nominal plane, along the frame's z [mm³]."""
    corners = frame.coordinates(np.array(surface.points, dtype=float))
    a, b, c = np.moveaxis(corners[surface.regular_faces], 1, 0)
    areas = 0.5 * np.cross(b - a, c - a)[:, 2]
    return float(np.sum(areas * (a + b + c)[:, 2] / 3.0))


@pytest.mark.parametrize("name", INTERFACES)
def test_worn_surface_covers_the_flank_and_holds_the_worn_volume(results, folder, name):
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
def test_worn_surfaces_face_each_other(results, folder, body, outward):
    with h5py.File(results) as file:
        _, frame = grid_and_frame(file, "intrados")
    surface = pv.read(folder / f"flank_intrados_{body}.stl")
    normals = surface.compute_normals(
        cell_normals=True, consistent_normals=False, auto_orient_normals=False
    )["Normals"]
    assert np.all(outward * normals @ frame.axes[2] > 0.99)


def header(path: Path) -> ElementTree.Element:
    """Return the XML of a file before its raw appended data."""
    text = path.read_bytes().split(b"<AppendedData")[0]
    return ElementTree.fromstring(text + b"</VTKFile>")


def test_tensors_name_their_components(folder: Path) -> None:
    arrays = header(folder / "structure" / "disk_worn.vtu").iter("DataArray")
    (tensor,) = (a.attrib for a in arrays if a.attrib.get("Name") == "stress [MPa]")
    names = [tensor[f"ComponentName{number}"] for number in range(6)]
    assert names == ["XX", "YY", "ZZ", "XY", "YZ", "XZ"]


@pytest.mark.parametrize("script", ["view.py", "view_mission.py"])
def test_scripts_show_what_is_there(folder: Path, script: str) -> None:
    check_scene(folder / script)


@pytest.mark.parametrize(("count", "peak"), [(1, 0), (22, 8), (48, 47), (49, 1), (1000, 613)])
def test_increments_that_are_shown(count: int, peak: int) -> None:
    """All are shown, or at most some from first to last, including the peak load."""
    shown = shown_increments(count, peak)
    assert len(set(shown)) == len(shown) == min(count, MOST_INCREMENTS)
    assert peak in shown
    assert (shown[0], shown[-1]) == (0, count - 1)
    assert np.diff(shown).max(initial=1) <= 2 * max(1.0, count / MOST_INCREMENTS) + 1


def write_wear(contents: WearContents, results: Path, folder: Path) -> list[Path]:
    assert ANALYSIS.pictures is not None
    return write_paraview(ANALYSIS.pictures, contents, results, folder)
