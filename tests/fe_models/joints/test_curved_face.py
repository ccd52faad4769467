"""Surfaces between the nodes of a mesh, compared with circles and spheres in closed form."""

from dataclasses import replace

import meshio
import numpy as np
import pytest
from skfem import MeshTri

from fe_models.geometry.imported import read_bodies
from fe_models.joints.mortar import mortar_projection
from fe_models.meshes.curved_face import Midsides, Surface
from fe_models.meshes.gmsh_session import gmsh_model
from fe_models.meshes.structure_mesh import MeshError
from fe_models.readers.grouped import CORNERS, midsides_of

RADIUS = 5.0
ROW = np.zeros((1, 1))


def sunk(x, y=0.0):
    """Return the height of a sphere, or a circle, of ``RADIUS`` that touches the plane."""
    return RADIUS - np.sqrt(RADIUS**2 - x**2 - y**2)


def circle(count=9, ends=(-1.3, 1.7)):
    """Return unevenly spaced nodes on a circle, and the segments between them."""
    x = np.linspace(*ends, count)
    x[1:-1] += 0.1 * np.diff(x).min() * np.random.default_rng(2).uniform(-1.0, 1.0, count - 2)
    points = np.stack([x, np.zeros(count), sunk(x)], axis=1)
    return points, np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)


def sphere(count=3):
    """Return a disk of irregular triangles on a sphere."""
    mesh = MeshTri.init_circle(count)
    x, y = mesh.p
    return np.stack([x, y, sunk(x, y)], axis=1), mesh.t.T.copy()


def on_sphere(points, facets):
    """Return midside points of the facets on the sphere, not above the middles of their chords."""
    corners = points[facets]
    middles = np.stack([corners[:, [a, b]].mean(axis=1) for a, b in ((0, 1), (1, 2), (2, 0))], 1)
    middles[..., :2] *= 1.01
    middles[..., 2] = sunk(*np.moveaxis(middles[..., :2], -1, 0))
    return middles


def straight(points, facets):
    """Return the surface with straight facets."""
    return replace(Surface.flat(len(points), facets), heights=points[:, 2])


def test_a_circle_through_its_nodes_alone():
    points, facets = circle()
    surface, x = Surface.of(points, facets, None), np.linspace(-1.3, 1.7, 301)[:, None]
    height = surface.over(points[:, :2], facets, x, ROW)[:, 0]
    facetted = straight(points, facets).over(points[:, :2], facets, x, ROW)[:, 0]
    error, before = (abs(h - sunk(x[:, 0])).max() for h in (height, facetted))
    assert error < 0.05 * before
    assert surface.straight == 0
    assert 0.1 * error < surface.error < 3.0 * error


@pytest.mark.parametrize(("known", "left"), [(False, 0.1), (True, 0.02)])
def test_a_sphere_through_its_nodes_or_midsides(known: bool, left: float):
    points, facets = sphere()
    middles = on_sphere(points, facets) if known else None
    surface = Surface.of(points, facets, middles)
    x = np.linspace(-0.6, 0.6, 61)
    places = x[:, None], x[None, :]
    exact = sunk(*places)
    error, before = (
        np.abs(s.over(points[:, :2], facets, *places) - exact).max()
        for s in (surface, straight(points, facets))
    )
    assert error < left * before
    assert (surface.form_error is None) is known


def test_outside_the_face_the_surface_is_unknown():
    points, facets = circle()
    x = np.array([-2.0, 0.0, 2.0])[:, None]
    height = Surface.of(points, facets, None).over(points[:, :2], facets, x, ROW)
    np.testing.assert_array_equal(np.isnan(height[:, 0]), [True, False, True])


def test_corners_stay_corners():
    """Check a wedge: its ridge does not fit a quadratic, and its flanks are flat."""
    x = np.linspace(-1.0, 1.0, 21)
    points = np.stack([x, 0.0 * x, 0.2 * abs(x)], axis=1)
    facets = np.stack([np.arange(20), np.arange(1, 21)], axis=1)
    surface = Surface.of(points, facets, None)
    np.testing.assert_allclose(surface.bulges, 0.0, atol=1e-15)
    assert 2 <= surface.straight <= 4
    assert surface.error == pytest.approx(0.2 * 0.1 * 18.0 / 35.0, rel=1e-9)  # |x| off a parabola


def test_rounded_coordinates_are_no_corners():
    """Check a flat face whose heights were rounded in a file."""
    x = np.linspace(-1.0, 1.0, 21)
    points = np.stack([x, 0.0 * x, 1e-8 * np.sin(40.0 * x)], axis=1)
    facets = np.stack([np.arange(20), np.arange(1, 21)], axis=1)
    assert Surface.of(points, facets, None).straight == 0


def test_images_are_images():
    points, facets = sphere(2)
    surface = Surface.of(points, facets, on_sphere(points, facets))
    nodes, image = np.tile(np.arange(len(points)), 2), facets[:, ::-1] + len(points)
    both = surface.mirrored(nodes, 2 * len(facets))
    places = np.concatenate([points[:, :2], points[:, :2] * (-1.0, 1.0) + (9.0, 0.0)])
    x = np.array([-0.2, 0.13, 0.31])
    every = np.concatenate([facets, image])
    one = both.over(places, every, x[:, None], x[None, :])
    other = both.over(places, every, 9.0 - x[::-1, None], x[None, :])
    np.testing.assert_allclose(one, other[::-1], rtol=1e-12)


@pytest.mark.parametrize("turned", [False, True])
def test_the_gap_knows_what_facets_leave(turned: bool):
    """Check the volume between a disk and a spherical cap, up to the error of quadratics."""
    points, facets = sphere()
    surface = Surface.of(points, facets, on_sphere(points, facets))
    if turned:
        facets, surface = facets[:, ::-1].copy(), surface.mirrored(np.arange(len(points)), 0)
        surface = Surface(surface.heights, surface.bulges[:, [1, 0, 2]])
    flat = points * (1.0, 1.0, 0.0)
    bare = mortar_projection(points, facets, flat, facets)
    known = mortar_projection(points, facets, flat, facets, (surface, straight(flat, facets)))
    swapped = mortar_projection(flat, facets, points, facets, (straight(flat, facets), surface))
    np.testing.assert_allclose(known.gap, -swapped.gap, atol=1e-12)
    corners = points[facets]
    middle = corners.mean(axis=1)
    area = 0.5 * abs(np.linalg.det(corners[:, 1:, :2] - corners[:, :1, :2]))
    sides = 0.5 * (corners + np.roll(corners, 1, axis=1))[..., :2]
    exact = area @ (
        9.0 / 20.0 * sunk(*middle[:, :2].T)
        + sunk(*np.moveaxis(sides, -1, 0)).sum(axis=1) * 2.0 / 15.0
        + sunk(*np.moveaxis(corners[..., :2], -1, 0)).sum(axis=1) / 20.0
    )
    assert known.areas @ known.gap == pytest.approx(exact, rel=3e-4)
    assert abs(bare.areas @ bare.gap / exact - 1.0) > 0.01


def test_the_bulge_of_an_edge_at_each_corner_in_closed_form():
    """Check ∫ψ_i 4 b λ_1 λ_2 with ψ_i = 4 λ_i - 1 over a third of the area.

    The values are 0.6 b, 0.6 b and -0.2 b.
    """
    corners, facet = np.array([[0.0, 0.0, 0.0], [1.0, 0.2, 0.0], [0.3, 0.9, 0.0]]), np.arange(3)
    around = np.array([[-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [0.0, 9.0, 0.0]])
    bulging = Surface(np.zeros(3), np.array([[0.01, 0.0, 0.0]]))
    surfaces = bulging, straight(around, facet[None])
    gap = mortar_projection(corners, facet[None], around, facet[None], surfaces).gap
    np.testing.assert_allclose(gap, [0.006, 0.006, -0.002], rtol=1e-10)


# --- midside nodes of files -----------------------------------------------------------------------


def test_edges_are_found_in_any_order():
    midsides = Midsides(np.array([[7, 3], [1, 2]]), np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]))
    found = midsides.at(np.array([[2, 1], [1, 7], [3, 7], [9, 9]]))
    np.testing.assert_array_equal(found[[0, 2]], midsides.points[::-1])
    assert np.isnan(found[[1, 3]]).all()


@pytest.mark.parametrize("order", [(0, 1, 2, 3, 4, 5), (0, 1, 2, 3, 5, 4), (5, 4, 3, 2, 1, 0)])
def test_midsides_of_any_program(order: tuple[int, ...]):
    """Check that different numberings of a tetrahedron's edges are recognised."""
    corners = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2]])
    pairs = np.array([(0, 1), (1, 2), (2, 0), (3, 0), (3, 1), (3, 2)])[list(order)]
    middles = corners[pairs].mean(axis=1) + 0.1
    cells = np.arange(10)[None]
    midsides = midsides_of(np.concatenate([corners, middles]), [("tetra", cells)])
    assert midsides is not None
    np.testing.assert_allclose(midsides.at(pairs), middles)


def test_midsides_that_are_elsewhere_are_refused():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    points = np.concatenate([corners, [corners[:2].mean(axis=0)] * 3])
    with pytest.raises(MeshError, match="midside nodes of triangle"):
        midsides_of(points, [("triangle", np.arange(6)[None])])


def test_quadrilaterals_are_split_along_their_surface():
    """Check a face with eight nodes on a paraboloid: its functions include the middle."""
    corners = np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
    plane = np.concatenate([corners, 0.5 * (corners + np.roll(corners, -1, axis=0))])
    points = np.column_stack([plane, 1.0 + 0.1 * plane[:, 0] ** 2 + 0.3 * plane[:, 1] ** 2])
    midsides = midsides_of(points, [("quad", np.arange(8)[None])])
    assert midsides is not None
    for diagonal in ([0, 2], [1, 3]):
        np.testing.assert_allclose(midsides.at(np.array([diagonal])), [[0.0, 0.0, 1.0]], atol=1e-15)


def test_elements_of_first_order_have_none():
    blocks = [(shape, np.arange(count)[None]) for shape, count in CORNERS.items()]
    assert midsides_of(np.random.default_rng(0).random((8, 3)), blocks) is None


@pytest.mark.usefixtures("reads_here")
@pytest.mark.parametrize("ending", ["msh", "step", "inp", "vtu"])
def test_a_ball_of_any_file_is_round(ending: str, tmp_path):
    """Check that midside nodes make a ball round whose facets are 3 % of the radius off."""
    path, size = tmp_path / f"ball.{ending}", 0.5 * RADIUS
    with gmsh_model("ball") as gmsh:
        tag = gmsh.model.occ.addSphere(0.0, 0.0, 0.0, RADIUS)
        gmsh.model.occ.synchronize()
        surface = gmsh.model.getBoundary([(3, tag)])[0][1]
        gmsh.model.addPhysicalGroup(3, [tag], name="ball")
        gmsh.model.addPhysicalGroup(2, [surface], name="skin")
        if ending != "step":
            gmsh.option.setNumber("Mesh.MeshSizeMin", size)
            gmsh.option.setNumber("Mesh.MeshSizeMax", size)
            gmsh.model.mesh.generate(3)
            gmsh.model.mesh.setOrder(2)
        gmsh.write(str(path if ending in ("msh", "step") else tmp_path / "ball.msh"))
    if ending in ("inp", "vtu"):
        mesh = meshio.read(tmp_path / "ball.msh")
        cells = {block.type: block.data for block in mesh.cells}
        meshio.Mesh(mesh.points, [("tetra10", cells["tetra10"])]).write(path)
    imported = read_bodies(path, size if ending == "step" else None)
    (name,) = imported.bodies
    midsides = imported.midsides[name]
    mesh = imported.bodies[name].mesh
    skin = mesh.facets[:, mesh.boundary_facets()].T
    found = midsides.at(np.concatenate([skin[:, [0, 1]], skin[:, [1, 2]], skin[:, [2, 0]]]))
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), RADIUS, rtol=1e-6)
