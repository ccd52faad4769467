"""Contact faces that are no rectangles have their true shape in ParaView's files."""

import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
import pyvista as pv

from fe_models.meshes.structure_mesh import Face
from fe_models.meshes.transfer import FaceTransfer
from sa_solver.types import Array, Frame, Grid
from tests.workflow.conftest import CONTENTS
from workflow.analyses.wear import ANALYSIS
from workflow.pictures.drawing import write_paraview
from workflow.pictures.vtk import FacePoints
from workflow.shell.output.results import frame_of, grid_of

FLAT = Frame(np.zeros(3), np.eye(3))
RADIUS, CENTRE, END = 4.0, np.array([0.5, -7.0]), 2.0


def disc(radius: float, centre: Array, edges: int = 200) -> tuple[Array, Array]:
    """Return nodes and facets of a round face, with the first node in the middle."""
    angle = np.linspace(0.0, 2.0 * np.pi, edges, endpoint=False)
    rim = centre + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    around = 1 + np.arange(edges)
    return np.vstack([centre, rim]), np.stack([0 * around, around, np.roll(around, -1)], axis=1)


@pytest.fixture(scope="module")
def round_face(results: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return results with a round intrados of body 2 that overhangs body 1's end at x = 2."""
    folder = tmp_path_factory.mktemp("round")
    shutil.copy(results, folder / "results.h5")
    corners = [[-9.0, -40.0], [END, -40.0], [END, 40.0], [-9.0, 40.0]]
    with h5py.File(folder / "results.h5", "r+") as file:
        group = file["structure/intrados"]
        for at, (nodes, facets) in {
            group: disc(RADIUS, CENTRE),
            group.create_group("face_1"): (corners, [[0, 1, 2], [0, 2, 3]]),
        }.items():
            for name, values in (("coordinates", nodes), ("facets", facets)):
                if name in at:
                    del at[name]
                at[name] = values
    assert ANALYSIS.pictures is not None
    write_paraview(ANALYSIS.pictures, CONTENTS, folder / "results.h5", folder / "paraview")
    return folder


def cut_disc() -> float:
    """Return the area of the disc up to x = END [mm²]."""
    angle = np.arccos((END - CENTRE[0]) / RADIUS)
    return float(RADIUS**2 * (np.pi - angle + 0.5 * np.sin(2.0 * angle)))


@pytest.mark.parametrize("file", ["intrados/00006.vtp", "flank_intrados_disk.stl"])
def test_a_round_face_is_shown_as_far_as_both_bodies_go(round_face: Path, file: str) -> None:
    mesh = pv.read(round_face / "paraview" / file)
    with h5py.File(round_face / "results.h5") as results:
        grid, frame = (of(results["grid/intrados"]) for of in (grid_of, frame_of))
    local = frame.coordinates(np.array(mesh.points, dtype=float))
    assert np.hypot(*(local[:, :2] - CENTRE).T).max() < RADIUS + 1e-4
    assert local[:, 0].max() < END + 1e-4
    # Triangles have the cells' middles as corners: half a cell is missing along the border.
    border, pitch = 2.0 * np.pi * RADIUS, max(grid.pitch)
    assert cut_disc() - 0.8 * border * pitch < mesh.area < cut_disc()


def test_its_points_carry_what_the_run_has_on_it(round_face: Path) -> None:
    mesh = pv.read(round_face / "paraview" / "intrados" / "00006.vtp")
    with h5py.File(round_face / "results.h5") as results:
        grid = grid_of(results["grid/intrados"])
        pressure = results["contact/intrados/00006/pressure"][()]
    x, y = grid.centres - CENTRE[:, None, None]
    on = (np.hypot(x, y) < RADIUS) & (grid.x < END)
    assert mesh.n_points == np.count_nonzero(on)
    shown = np.sort(mesh["pressure [MPa]"])
    np.testing.assert_allclose(shown, np.sort(pressure[on]), rtol=2e-7)


def test_an_angle_keeps_its_corner() -> None:
    """For two legs of cells no triangle reaches across, and none is missing."""
    grid = Grid((6, 5), (1.0, 2.0))
    on = np.zeros(grid.shape, dtype=bool)
    on[:2], on[:, :2] = True, True
    mesh = FacePoints(grid, FLAT, on).mesh({})
    # Squares of 2 mm²: four and four along the legs, with their common one, and half of the corner.
    assert mesh.area == pytest.approx(2.0 * (4 + 5 - 1 + 0.5))
    assert mesh.n_points == np.count_nonzero(on)
    normals = mesh.compute_normals(consistent_normals=False, auto_orient_normals=False)
    np.testing.assert_allclose(normals.cell_data["Normals"] @ FLAT.axes[2], 1.0)


@pytest.mark.parametrize("missing", [(0, 0), (1, 0), (1, 1), (0, 1)])
def test_three_points_of_a_square_are_a_triangle(missing: tuple[int, int]) -> None:
    on = np.ones((2, 2), dtype=bool)
    on[missing] = False
    mesh = FacePoints(Grid((2, 2), (1.0, 1.0)), FLAT, on).mesh({})
    assert (mesh.n_cells, mesh.area) == (1, pytest.approx(0.5))
    normals = mesh.compute_normals(consistent_normals=False, auto_orient_normals=False)
    assert normals.cell_data["Normals"][0, 2] == pytest.approx(1.0)


def test_a_line_is_interrupted_where_the_face_is() -> None:
    grid = Grid.line_contact(10.0, 10)
    segments = np.array([[0, 1], [2, 3]])
    ends = np.array([[-5.0, 0.0], [-2.0, 0.0], [1.0, 0.0], [5.0, 0.0]])
    inside = FaceTransfer.between(Face("", FLAT, ends, segments), grid).inside
    mesh = FacePoints(grid, FLAT, inside).mesh({})
    assert mesh.n_cells == 2
    assert mesh.compute_cell_sizes()["Length"] == pytest.approx([2.0, 3.0])
    np.testing.assert_allclose(mesh.points[:, 0], [-4.5, -3.5, -2.5, 1.5, 2.5, 3.5, 4.5])
