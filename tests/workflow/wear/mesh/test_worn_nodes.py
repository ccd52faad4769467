"""Tests of the transfer of worn surfaces to the nodes of the user's mesh."""

import numpy as np
import pytest

from fe_models.meshes.structure_mesh import Face
from fe_models.meshes.transfer import FaceTransfer
from sa_solver.types import Frame, Grid
from tests.workflow.contact_loads import SIZE, flank, write
from workflow.analyses.wear.structures.resultants.faces import FaceError, facets_over
from workflow.analyses.wear.worn.worn_nodes import (
    nodal_depths,
    read_nodes,
    worn_displacement,
    write_worn_nodes,
)
from workflow.case.files.input_files import InputFileError


def bowl(grid: Grid) -> np.ndarray:
    """Return a depth that decreases towards the rim [mm]."""
    x, y = grid.x / (0.5 * grid.size[0]), grid.y / (0.5 * grid.size[1])
    return 0.02 * (1.0 - 0.8 * x**2) * (1.0 - 0.5 * y**2) * (1.0 + 0.3 * x)


def nodes_over(size: tuple[float, float], shape: tuple[int, int], frame: Frame) -> np.ndarray:
    """Return global points of a mesh of nodes over a face, in no order."""
    axes = [np.linspace(-0.5, 0.5, n) * s for n, s in zip(shape, size, strict=True)]
    x, y = (axis.ravel() for axis in np.meshgrid(*axes, indexing="ij"))
    local = np.stack([x, y, 0.0 * x], axis=1)
    return frame.origin + frame.to_global(np.random.default_rng(5).permutation(local))


AREA_GRID = Grid.covering(SIZE, (32, 64))
FACES = {
    "coarse": (SIZE, (8, 13)),
    "beyond the grid": ((14.0, 71.0), (9, 16)),
    "finer than the cells": ((10.2, 60.6), (40, 16)),
}


@pytest.mark.parametrize(("size", "shape"), FACES.values(), ids=FACES)
def test_worn_volume_is_kept_where_nodes_cover_it(size, shape):
    """The volume is conserved to rounding, on coarse and on fine meshes."""
    frame, depth = flank(), bowl(AREA_GRID)
    nodal = nodal_depths(nodes_over(size, shape, frame), frame, AREA_GRID, depth)
    assert nodal.volume_share == pytest.approx(1.0, abs=1e-12)
    assert nodal.depth.min() >= 0.0
    assert nodal.depth.max() <= depth.max()


@pytest.mark.parametrize(("size", "shape"), FACES.values(), ids=FACES)
def test_shared_areas_are_exact(size, shape):
    """Areas and first moments agree for cells and nodes: integrals of linear functions."""
    frame, cell = Frame(np.zeros(3), np.eye(3)), AREA_GRID.cell_area
    points = nodes_over(size, shape, frame)[:, :2]
    # Nodes inside are moved about, so that triangles have any shape.
    inside = np.all(np.abs(points) < 0.49 * np.array(size), axis=1)
    moved = np.random.default_rng(2).uniform(-0.3, 0.3, points.shape)
    points[inside] += (moved * size / np.array(shape))[inside]
    face = Face("f", frame, points, facets_over(points, line=False))
    shared = FaceTransfer.between(face, AREA_GRID).shared
    np.testing.assert_allclose(shared.sum(axis=1), cell, rtol=1e-12)
    x, y = np.broadcast_arrays(AREA_GRID.x, AREA_GRID.y)
    for nodal, centres in zip(points.T, (x, y), strict=True):
        np.testing.assert_allclose(shared @ nodal, cell * centres.ravel(), atol=1e-12)
    areas = np.asarray(shared.sum(axis=0)).ravel()
    if size == SIZE:
        np.testing.assert_allclose(areas, face.nodal_areas, rtol=1e-12)
    assert np.all(areas <= face.nodal_areas * (1.0 + 1e-12))


def test_even_wear_stays_even():
    frame = flank()
    depth = np.full(AREA_GRID.shape, 0.0125)
    nodal = nodal_depths(nodes_over(SIZE, (8, 13), frame), frame, AREA_GRID, depth)
    np.testing.assert_allclose(nodal.depth, 0.0125, rtol=1e-12)


def test_half_a_face_carries_half_the_wear():
    """Nodes that cover half of the worn area are reported as such."""
    frame = flank()
    points = nodes_over((SIZE[0], 0.5 * SIZE[1]), (8, 13), frame)
    moved = points + 0.25 * SIZE[1] * frame.axes[1]
    nodal = nodal_depths(moved, frame, AREA_GRID, np.full(AREA_GRID.shape, 0.01))
    assert nodal.volume_share == pytest.approx(0.5, abs=1e-12)


def test_nodes_far_from_the_contact_stay():
    frame = flank()
    points = nodes_over((40.0, 120.0), (41, 61), frame)
    nodal = nodal_depths(points, frame, AREA_GRID, bowl(AREA_GRID))
    local = np.abs(frame.coordinates(points))
    assert not nodal.depth[(local[:, 0] > 6.01) | (local[:, 1] > 32.01)].any()
    assert nodal.volume_share == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("width", [8.0, 11.0])
def test_worn_area_of_a_line_contact_is_kept_exactly(width):
    frame, grid = flank(), Grid.line_contact(8.0, 200)
    depth = 0.01 * (1.0 - (grid.x / 4.0) ** 2)
    x = np.random.default_rng(1).permutation(np.linspace(-0.5, 0.5, 23) ** 3 * 4.0 * width)
    points = frame.origin + np.outer(x, frame.axes[0])
    nodal = nodal_depths(points, frame, grid, depth)
    assert nodal.volume_share == pytest.approx(1.0, abs=1e-12)


def test_unworn_surfaces_stay():
    frame = flank()
    nodal = nodal_depths(nodes_over(SIZE, (8, 13), frame), frame, AREA_GRID, np.zeros((32, 64)))
    assert not nodal.depth.any()
    assert np.isnan(nodal.volume_share)


def test_both_bodies_move_into_themselves():
    """The gap along z of the frame opens by the sum of the depths."""
    frame, depth = flank(), np.array([0.01, 0.02])
    one, two = (worn_displacement(depth, frame, body) for body in (1, 2))
    np.testing.assert_allclose((two - one) @ frame.axes[2], 2.0 * depth, rtol=1e-14)
    np.testing.assert_allclose(frame.components(one), np.outer(depth, [0, 0, -1]), atol=1e-17)


def test_wrong_frames_are_refused():
    frame = flank()
    points = nodes_over(SIZE, (8, 13), frame)
    with pytest.raises(FaceError, match="off the plane"):
        nodal_depths(points, Frame(np.zeros(3), np.eye(3)), AREA_GRID, bowl(AREA_GRID))
    aside = Frame(frame.origin + 100.0 * frame.axes[0], frame.axes)
    with pytest.raises(FaceError, match="no node is near the contact"):
        nodal_depths(points, aside, AREA_GRID, bowl(AREA_GRID))


def test_node_tables_and_displacements_keep_the_users_numbers(tmp_path):
    path = write(tmp_path, "# blade\nnode, X [m], Y, Z\n10412, 0.012, -30, 248.2\n7, 1, 2, 3\n")
    nodes = read_nodes(path)
    assert nodes.numbers.tolist() == [10412, 7]
    np.testing.assert_allclose(nodes.points, [[12.0, -30.0, 248.2], [1000.0, 2.0, 3.0]])
    moved = np.random.default_rng(0).standard_normal((2, 3))
    write_worn_nodes(tmp_path / "worn.csv", nodes.numbers, moved)
    header, *rows = (tmp_path / "worn.csv").read_text().splitlines()
    assert header == "node,ux [mm],uy [mm],uz [mm]"
    values = np.array([[float(cell) for cell in row.split(",")] for row in rows])
    assert values[:, 0].tolist() == [10412.0, 7.0]
    assert values[:, 1:].tobytes() == moved.tobytes()


NODES = {
    "missing": (
        "node, X\n1, 2\n",
        "1: no column Y; this file has 'node', 'X'; allowed: node, X, Y",
    ),
    "text": ("node, X, Y\n1, 2, a\n", "2: Y: 'a': not a number; allowed: numbers"),
    "fraction": ("node, X, Y\n1.5, 2, 3\n", "2: node: 1.5: not a whole number; allowed: whole"),
    "twice": ("node, X, Y\n1, 2, 3\n# \n1, 4, 5\n", "4: node: 1: node given twice; allowed: once"),
    "unknown": ("node, X, Y, W\n1, 2, 3, 4\n", "1: 'W': unknown column; allowed: node, X, Y, Z"),
}


@pytest.mark.parametrize(("text", "error"), NODES.values(), ids=NODES)
def test_a_wrong_node_table_is_refused_at_its_line(tmp_path, text, error):
    path = write(tmp_path, text)
    with pytest.raises(InputFileError) as refused:
        read_nodes(path)
    assert str(refused.value).startswith(f"{path}:{error}"), refused.value
