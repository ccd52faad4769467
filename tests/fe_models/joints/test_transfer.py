"""Transfer between face and grid: constants, integrals, adjointness, linear fields."""

from dataclasses import replace

import numpy as np
import pytest

from fe_models.meshes.transfer import FaceTransfer
from sa_solver.types import Grid, resultants


def on_grid(face, size, shape=(40, 96)):
    grid = Grid.covering(size, shape)
    return face, grid, FaceTransfer.between(face, grid)


@pytest.fixture(scope="module", params=[0, 1], ids=["intrados", "extrados"])
def covered(request, dovetail, coarse_mesh):
    """Return a face that covers its grid."""
    return on_grid(coarse_mesh.interfaces[request.param], dovetail.flank_size())


@pytest.fixture(scope="module")
def skewed(dovetail):
    """Return a parallelogram in a rectangular grid."""
    turned = replace(dovetail, skew=np.deg2rad(15.0))
    return on_grid(turned.mesh((8, 10), 8.0).interfaces[0], turned.flank_size())


@pytest.fixture(params=["straight", "skewed"])
def case(request, dovetail, coarse_mesh):
    if request.param == "skewed":
        return request.getfixturevalue("skewed")
    return on_grid(coarse_mesh.interfaces[0], dovetail.flank_size())


def test_constants_are_kept(case):
    face, grid, transfer = case
    cells = transfer.to_cells(np.full(len(face), 7.5))
    assert cells.shape == grid.shape
    np.testing.assert_allclose(cells, 7.5, rtol=1e-13)
    np.testing.assert_allclose(transfer.to_nodes(np.full(grid.shape, 7.5)), 7.5, rtol=1e-13)


def test_shared_areas_are_those_of_nodes_and_cells(case):
    face, grid, transfer = case
    np.testing.assert_allclose(
        np.asarray(transfer.shared.sum(axis=0)).ravel(), face.nodal_areas, rtol=1e-12
    )
    rows = np.asarray(transfer.shared.sum(axis=1)).ravel()
    assert rows.sum() == pytest.approx(face.nodal_areas.sum(), rel=1e-12)
    assert rows.max() <= grid.cell_area * (1.0 + 1e-9)


def test_integrals_are_kept(covered):
    """Check the force of a pressure, and the volume of a depth."""
    face, grid, transfer = covered
    rng = np.random.default_rng(0)
    pressure, depth = rng.random(len(face)), rng.random(grid.shape)
    force = transfer.to_cells(pressure).sum() * grid.cell_area
    assert force == pytest.approx(pressure @ face.nodal_areas, rel=1e-12)
    volume = transfer.to_nodes(depth) @ face.nodal_areas
    assert volume == pytest.approx(depth.sum() * grid.cell_area, rel=1e-12)


def test_transfers_are_adjoint(case):
    """Check that ∫ (nodes → cells) of one field times the other is that of the way back."""
    face, grid, transfer = case
    rng = np.random.default_rng(1)
    nodal, cells = rng.random(len(face)), rng.random(grid.shape)
    covered = np.asarray(transfer.shared.sum(axis=1)).reshape(grid.shape)
    areas = np.asarray(transfer.shared.sum(axis=0)).ravel()
    there = np.sum(covered * transfer.to_cells(nodal) * cells)
    back = np.sum(areas * nodal * transfer.to_nodes(cells))
    assert there == pytest.approx(back, rel=1e-12)


def test_linear_field_on_cells(covered):
    """Check that a linear field is linear between nodes, and so are its means over cells."""
    face, grid, transfer = covered
    x, y = face.coordinates.T
    np.testing.assert_allclose(
        transfer.to_cells(x), grid.x + 0.0 * grid.y, atol=1e-9 * grid.pitch[0]
    )
    np.testing.assert_allclose(
        transfer.to_cells(y), grid.y + 0.0 * grid.x, atol=1e-9 * grid.pitch[1]
    )


def test_linear_field_on_nodes(covered):
    """Check the mean over each node's surroundings, weighted by its linear function.

    A linear field has the mean (2 x_i + x_j + x_k) / 4 over a triangle with that weight.
    """
    face, grid, transfer = covered
    x = face.coordinates[:, 0]
    nodes = transfer.to_nodes(grid.x + 0.0 * grid.y)
    corners = x[face.facets]
    weights = np.repeat(face.facet_sizes[:, None], 3, axis=1)
    means = 0.25 * (corners + corners.sum(axis=1, keepdims=True))
    total, weight = np.zeros(len(face)), np.zeros(len(face))
    np.add.at(total, face.facets, weights * means)
    np.add.at(weight, face.facets, weights)
    off, half = np.abs(nodes - total / weight), np.abs(face.coordinates).max(axis=0)
    inside = (np.abs(face.coordinates) < 0.99 * half).all(axis=1)
    assert off[inside].max() < 5e-3 * grid.pitch[0]
    # At the rim cells are cut.
    assert off.max() < 0.05 * grid.pitch[0]


def test_resultants_survive(covered, solved, mission):
    """Check forces to rounding, and moments up to the error of lumping at the nodes."""
    face, grid, transfer = covered
    history = next(h for h in solved(0.4, mission).histories if h.interface.name == face.name)
    tractions = history.force[7] / face.nodal_areas
    cells = transfer.to_cells(tractions) * grid.cell_area
    on_cells = resultants(cells, grid.x, grid.y)
    loads = history.loads
    expected = [getattr(loads, name)[7] for name in ("P", "Qx", "Qy", "Mx", "My", "Mz")]
    np.testing.assert_allclose(on_cells[:3], expected[:3], atol=1e-10 * loads.P[7])
    # Nodal forces act at the nodes, the linear field between them: an arm of 1 % of an element.
    element = 60.0 / 9.0
    np.testing.assert_allclose(on_cells[3:], expected[3:], atol=1e-2 * loads.P[7] * element)


def test_many_fields_at_once(covered):
    face, grid, transfer = covered
    fields = np.random.default_rng(2).random((2, 3, len(face)))
    cells = transfer.to_cells(fields)
    assert cells.shape == (2, 3, *grid.shape)
    np.testing.assert_allclose(cells[1, 2], transfer.to_cells(fields[1, 2]), rtol=1e-14)


def test_uncovered_cells_take_the_nearest_node(skewed):
    face, grid, transfer = skewed
    covered = np.asarray(transfer.shared.sum(axis=1)).reshape(grid.shape) > 0.0
    assert 0.01 < np.mean(~covered) < 0.1
    nodal = np.random.default_rng(3).random(len(face))
    cells = transfer.to_cells(nodal)
    assert np.all(np.isin(cells[~covered], nodal))
