"""ParaView files: read back, at the right place, with the right values and times."""

import re
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import pyvista as pv

from sa_solver.types import Array, Frame, Grid
from tests.workflow.conftest import CONTENTS
from workflow.analyses.wear import ANALYSIS
from workflow.analyses.wear.layout import Contents
from workflow.pictures.drawing import write_paraview
from workflow.shell.results import frame_of, grid_of

SIZE = (10.0, 60.0)  # of the synthetic flanks [mm]
INTERFACES = ("intrados", "extrados")
SINGLE = 2e-7  # rounding of single precision


@pytest.fixture(scope="module")
def folder(results: Path) -> Path:
    written = results.parent / "paraview"
    paths = write_wear(CONTENTS, results, written)
    assert sorted(paths) == sorted(path for path in written.rglob("*") if path.is_file())
    return written


def grid_and_frame(file: h5py.File, name: str) -> tuple[Grid, Frame]:
    return grid_of(file["grid"][name]), frame_of(file["grid"][name])


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
        field = image.cell_data[key].reshape(grid.shape, order="F")
        np.testing.assert_allclose(field, expected, rtol=SINGLE, err_msg=key)
    for key, (x, y) in vectors.items():
        components = frame.components(np.array(image.cell_data[key], dtype=float))
        components = components.reshape(*grid.shape, 3, order="F")
        scale = np.abs(x).max()
        np.testing.assert_allclose(components[..., 0], x, atol=SINGLE * scale)
        np.testing.assert_allclose(components[..., 1], y, atol=SINGLE * scale)
        np.testing.assert_allclose(components[..., 2], 0.0, atol=SINGLE * scale)
        np.testing.assert_allclose(image.cell_data[f"{key}_x"], x.ravel(order="F"), rtol=SINGLE)


@pytest.mark.parametrize("name", INTERFACES)
def test_series_steps_through_the_cycles(results: Path, folder: Path, name: str) -> None:
    reader = pv.PVDReader(folder / f"{name}.pvd")
    with h5py.File(results) as file:
        assert reader.time_values == list(file["kinetics/cycles"])
    reader.set_active_time_value(reader.time_values[-1])
    last = reader.read()[0]
    assert last.cell_data["wear_depth"].max() > 0.0
    reader.set_active_time_value(0.0)
    assert reader.read()[0].cell_data["wear_depth"].max() == 0.0


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
def test_worn_surfaces_face_each_other(
    results: Path, folder: Path, body: str, outward: float
) -> None:
    with h5py.File(results) as file:
        _, frame = grid_and_frame(file, "intrados")
    surface = pv.read(folder / f"flank_intrados_{body}.stl")
    normals = surface.compute_normals(
        cell_normals=True, consistent_normals=False, auto_orient_normals=False
    )["Normals"]
    assert np.all(outward * normals @ frame.axes[2] > 0.99)


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


def write_wear(contents: Contents, results: Path, folder: Path) -> list[Path]:
    assert ANALYSIS.pictures is not None
    return write_paraview(ANALYSIS.pictures, contents, results, folder)


def test_failed_write_leaves_nothing_behind(results: Path, tmp_path: Path) -> None:
    blocked = tmp_path / "paraview"
    (blocked / "intrados.pvd").mkdir(parents=True)  # a folder where the series should go
    with pytest.raises(OSError, match=r"intrados\.pvd"):
        write_wear(CONTENTS, results, blocked)
    assert not list(blocked.rglob("*.part.*"))


def test_run_without_structure_writes_the_flanks(results: Path, tmp_path: Path) -> None:
    contents = replace(CONTENTS, structure=False)
    written = {path.name for path in write_wear(contents, results, tmp_path)}
    assert "intrados.pvd" in written
    assert "structure.pvd" not in written
