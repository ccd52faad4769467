"""Bodies of several shapes of elements, as programs write them: read whole, and patch-tested."""

import meshio
import numpy as np
import pytest
import pyvista as pv

from fe_models.elasticity.body import ElasticBody
from fe_models.geometry.imported import read_bodies
from fe_models.meshes.curved_face import edges_of
from fe_models.meshes.remesh import element_volumes
from sa_solver.types import Material
from tests.fe_models.readers import cae_files

STEEL = Material(200e3, 0.3)
STRAIN = np.array([[1.0, 0.4, -0.2], [0.4, -0.5, 0.3], [-0.2, 0.3, 0.7]]) * 1e-3


def moved(points, free):
    """Return points of which the free ones are moved, so that no element is a box."""
    shift = 0.15 * np.sin(np.arange(points.size) * 1.7).reshape(points.shape)
    return points + np.where(free[:, None], shift, 0.0)


def check_patch(body, expected_volume):
    """Check that linear displacements cause no inner force and store the strain energy."""
    elastic = ElasticBody(body, STEEL)
    axes = list(body.axes)
    displacement = (elastic.nodes @ STRAIN)[:, axes].ravel()
    forces = (elastic.stiffness @ displacement).reshape(-1, len(axes))
    surface = np.unique(body.mesh.facets[:, body.mesh.boundary_facets()])
    inner = np.setdiff1d(np.arange(len(forces)), surface)
    assert len(inner)
    np.testing.assert_allclose(forces[inner], 0.0, atol=1e-12 * np.abs(forces).max())
    assert np.abs(element_volumes(body.mesh)).sum() == pytest.approx(expected_volume, rel=1e-12)
    strain = STRAIN[np.ix_(axes, axes)]
    stress = STEEL.lame * np.trace(strain) * np.eye(len(axes)) + 2 * STEEL.shear_modulus * strain
    energy = np.sum(stress * strain) * expected_volume
    assert displacement @ forces.ravel() == pytest.approx(energy, rel=1e-11)


def check_midsides(imported, up_to=np.inf):
    """Check that every surface edge below a height has a midside node in its middle."""
    (name, body), *_ = imported.bodies.items()
    facets = body.mesh.facets[:, body.mesh.boundary_facets()].T
    edges = edges_of(facets).reshape(-1, 2)
    edges = edges[body.points[edges][..., 2].max(axis=1) <= up_to]
    found = imported.midsides[name].at(edges)
    np.testing.assert_allclose(found, body.points[edges].mean(axis=1), atol=1e-9)


def column(order):
    points, cells = cae_files.mixed_column()
    points = moved(points, np.arange(len(points)) % 9 == 4)  # middle of each layer
    points[[4, 31]] = (1.0, 1.0, 0.0), (1.0, 1.0, 3.0)  # The ends stay plane.
    return (points, cells) if order == 1 else cae_files.second_order(points, cells)


WRITERS = {
    "abaqus.inp": cae_files.abaqus,
    "small.bdf": cae_files.nastran,
    "large.nas": lambda *mesh: cae_files.nastran(*mesh, form="large"),
    "free.bdf": lambda *mesh: cae_files.nastran(*mesh, form="free"),
}


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("order", [1, 2])
def test_four_shapes_in_one_body(tmp_path, name, order):
    points, cells = column(order)
    if name == "abaqus.inp" and order == 2:  # Abaqus has no pyramid of second order
        cells["pyramid"] = cells["pyramid"][:, :5]
    if name == "small.bdf":
        points = points.round(4)
    (tmp_path / name).write_text(WRITERS[name](points, cells))
    imported = read_bodies(tmp_path / name)
    ((body_name, body),) = imported.bodies.items()
    assert body_name == ("Column" if name == "abaqus.inp" else "7")
    check_patch(body, 12.0)
    assert imported.node_numbers[body_name].tolist() == list(range(1, 41))
    if order == 2:
        check_midsides(imported, 2.0 if name == "abaqus.inp" else np.inf)
    else:
        assert not imported.midsides


@pytest.mark.parametrize("order", [1, 2])
def test_hexahedra_and_wedges_of_a_universal_file(tmp_path, order):
    """Check a format without pyramids; the wedges' cells are 8 mm³ of the column."""
    points, cells = cae_files.mixed_column()
    used = {shape: cells[shape] for shape in ("hexahedron", "wedge")}
    points = moved(points[:27], np.arange(27) == 13)
    mesh = (points, used) if order == 1 else cae_files.second_order(points, used)
    path = tmp_path / "column.unv"
    path.write_text(cae_files.universal(*mesh))
    imported = read_bodies(path)
    check_patch(imported.bodies["body_1"], 8.0)
    if order == 2:
        check_midsides(imported)


@pytest.mark.parametrize("name", ["plate.inp", "plate.unv"])
@pytest.mark.parametrize("order", [1, 2])
def test_triangles_and_quadrilaterals_in_the_plane(tmp_path, name, order):
    points, cells = cae_files.mixed_plate()
    points[4, :2] += (0.2, -0.1)
    mesh = (points, cells) if order == 1 else cae_files.second_order(points, cells)
    write = cae_files.abaqus if name == "plate.inp" else cae_files.universal
    (tmp_path / name).write_text(write(*mesh))
    imported = read_bodies(tmp_path / name)
    assert not imported.unused
    ((_, body),) = imported.bodies.items()
    check_patch(body, 4.0)


def test_four_shapes_of_first_order_through_meshio(tmp_path):
    points, cells = column(1)
    path = tmp_path / "column.med"
    meshio.Mesh(points, list(cells.items())).write(path)
    check_patch(read_bodies(path).bodies["body_1"], 12.0)


def test_four_shapes_of_second_order_of_vtk(tmp_path):
    points, cells = column(2)
    kinds = {"hexahedron": 25, "wedge": 26, "pyramid": 27, "tetra": 24}  # of vtkCellType.h
    path = tmp_path / "column.vtu"
    grid = {kinds[shape]: block for shape, block in cells.items()}
    pv.UnstructuredGrid(grid, points).save(path, binary=False)
    imported = read_bodies(path)
    check_patch(imported.bodies["body_1"], 12.0)
    check_midsides(imported)


def test_midsides_that_are_missing_in_part_are_refused(tmp_path):
    text = cae_files.nastran(*column(2), form="free")
    (line,) = (k for k, row in enumerate(text.splitlines()) if row.startswith("CHEXA,1,"))
    lines = text.splitlines()
    lines[line + 2] = lines[line + 2].rpartition(",")[0]
    path = tmp_path / "column.bdf"
    path.write_text("\n".join(lines))
    with pytest.raises(
        Exception, match=rf"column\.bdf:{line + 1}: CHEXA: 19 nodes; allowed: 8, or 20"
    ):
        read_bodies(path)
