"""The projection between faces whose meshes do not match."""

import numpy as np
import pytest
from scipy.spatial import Delaunay
from skfem import MeshTri

from fe_models.joints.mortar import mortar_projection
from fe_models.meshes.structure_mesh import MeshError

LINE, SURFACE = 2, 3
DIMENSIONS = [LINE, SURFACE]


def flat_face(dimension, count, seed, low=(0.0, 0.0), high=(2.0, 3.0)):
    """Return random points on a rectangle or segment, with its corners, and their facets."""
    rng = np.random.default_rng(seed)
    low, high = (np.array(end)[: dimension - 1] for end in (low, high))
    if dimension == LINE:
        place = np.sort(np.append(rng.random(count), [0.0, 1.0]))[:, None]
        facets = np.stack([np.arange(count + 1), np.arange(1, count + 2)], axis=1)
    else:
        side = np.linspace(0.0, 1.0, int(np.sqrt(count)) + 1)[:-1]
        rim = [np.stack(pair, axis=1) for pair in ((side, 0 * side), (0 * side + 1, side))]
        rim += [1.0 - points for points in rim]
        # Away from the rim, so that no triangle on it is flat.
        place = np.concatenate([*rim, rng.uniform(0.05, 0.95, (count, 2))])
        facets = Delaunay(place).simplices.astype(np.int64)
    points = np.zeros((len(place), 3))
    points[:, : dimension - 1] = low + place * (high - low)
    # Facets have either orientation.
    facets[::2] = facets[::2, ::-1]
    return points, facets


def measure(dimension, low=(0.0, 0.0), high=(2.0, 3.0)):
    return np.prod(np.subtract(high, low)[: dimension - 1])


def linear(points):
    """Return 1 and the coordinates along the face, ``(n, 3)``."""
    return np.column_stack([np.ones(len(points)), points[:, :2]])


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("seed", range(3))
def test_linear_fields_and_integrals_pass(dimension, seed):
    slave, master = flat_face(dimension, 40, seed), flat_face(dimension, 30, 100 + seed)
    mortar = mortar_projection(*slave, *master)
    assert mortar.kept.all()
    np.testing.assert_allclose(mortar.covered, 1.0, atol=1e-12)
    np.testing.assert_allclose(mortar.projection @ linear(master[0]), linear(slave[0]), atol=1e-12)
    # The master's nodes receive the same forces of a unit pressure as from their own face.
    matching = mortar_projection(*master, *master)
    np.testing.assert_allclose(mortar.projection.T @ mortar.areas, matching.areas, atol=1e-12)
    assert mortar.areas.sum() == pytest.approx(measure(dimension), rel=1e-12)


def test_one_segment_on_two_in_closed_form():
    """Check ψ = 2 - 3x and 3x - 1 on the unit segment, with a master node in its middle."""
    slave = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    master = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [1.0, 0.0, 0.0]])
    mortar = mortar_projection(slave, np.array([[0, 1]]), master, np.array([[0, 1], [1, 2]]))
    expected = [[0.75, 0.5, -0.25], [-0.25, 0.5, 0.75]]
    np.testing.assert_allclose(mortar.projection.toarray(), expected, atol=1e-14)
    np.testing.assert_allclose(mortar.areas, 0.5)


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_faces_that_match_give_the_identity(dimension):
    points, facets = flat_face(dimension, 40, 0)
    order = np.random.default_rng(1).permutation(len(points))
    mortar = mortar_projection(points, facets, points[order], np.argsort(order)[facets])
    identity = np.eye(len(points))[:, order]
    np.testing.assert_allclose(mortar.projection.toarray(), identity, atol=1e-12)


@pytest.mark.parametrize("angle", [0.3, np.pi / 2, 2.5])
def test_turning_both_faces_changes_nothing(angle):
    (slave, facets), (master, others) = flat_face(SURFACE, 40, 0), flat_face(SURFACE, 30, 1)
    turn = np.eye(3)
    turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    straight = mortar_projection(slave, facets, master, others)
    turned = mortar_projection(slave @ turn.T, facets, master @ turn.T, others)
    difference = (straight.projection - turned.projection).toarray()
    np.testing.assert_allclose(difference, 0.0, atol=1e-11)
    np.testing.assert_allclose(turned.areas, straight.areas, atol=1e-12)


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("seed", range(3))
def test_master_that_covers_a_part(dimension, seed):
    """Check exact integrals over the part, and linear fields at its nodes."""
    low, high = (0.7, 0.9), (1.9, 3.5)
    slave = flat_face(dimension, 60, seed)
    master = flat_face(dimension, 30, 100 + seed, low, high)
    mortar = mortar_projection(*slave, *master)
    end = np.minimum(high, (2.0, 3.0))
    size = measure(dimension, low, end)
    centre = 0.5 * np.add(low, end)[: dimension - 1]
    integrals = mortar.areas @ linear(slave[0])[:, :dimension]
    np.testing.assert_allclose(integrals, size * np.append(1.0, centre), rtol=1e-12)

    kept = mortar.kept
    projected = (mortar.projection @ linear(master[0]))[kept]
    np.testing.assert_allclose(projected, linear(slave[0])[kept], atol=1e-10)
    inside = np.all((slave[0] > [*low, -1.0]) & (slave[0] < [*end, 1.0]), axis=1)
    if dimension == LINE:
        inside = (slave[0][:, 0] > low[0]) & (slave[0][:, 0] < end[0])
    assert kept[inside].all()
    assert 0 < kept.sum() < len(kept)
    assert np.all(np.isinf(mortar.gap[~kept]))
    assert mortar.projection[~kept].nnz == 0


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("shift", [1e-2, 1e-4, 1e-6, 1e-9, 1e-13, 1e-16])
def test_slivers_of_any_width(dimension, shift):
    """Check nearly equal faces: N stays near the identity and exact on linear fields."""
    points, facets = flat_face(dimension, 40, 0)
    moved = points + shift * np.array([1.0, 0.3, 0.0]) * (np.arange(3) < dimension - 1)
    mortar = mortar_projection(points, facets, moved, facets)
    assert mortar.covered[mortar.kept].min() > 0.5
    projected = mortar.projection @ linear(moved)
    np.testing.assert_allclose(projected[mortar.kept], linear(points)[mortar.kept], atol=1e-10)
    identity = np.eye(len(points))[mortar.kept]
    change = np.abs(mortar.projection.toarray()[mortar.kept] - identity)
    corners = points[facets]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    sizes = edges[:, 0] if dimension == LINE else np.cross(*np.diff(corners, axis=1).swapaxes(0, 1))
    smallest = sizes.min() if dimension == LINE else np.min(np.abs(sizes[:, 2]) / edges.max(axis=1))
    assert change.sum(axis=1).max() < 1e-11 + 10.0 * shift / smallest


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("width", [0.05, 1e-2, 1e-4, 1e-6, 1e-8, 1e-12])
def test_master_that_ends_just_inside_a_facet(dimension, width):
    """Check strips of any width on a row of facets: rows of N stay bounded and exact."""
    slave = tensor_face(dimension, 8)
    points, facets = tensor_face(dimension, 5)
    points[:, :2] *= 0.5 + width
    mortar = mortar_projection(*slave, points, facets)
    projected = (mortar.projection @ linear(points))[mortar.kept]
    np.testing.assert_allclose(projected, linear(slave[0])[mortar.kept], atol=1e-9)
    assert np.abs(mortar.projection).sum(axis=1).max() < 10.0
    area = (0.5 + width) ** (dimension - 1)
    # Slivers are left out.
    assert mortar.areas.sum() == pytest.approx(area, abs=1e-6)


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_smooth_fields_pass_to_second_order(dimension):
    errors = []
    for count in (8, 16, 32):
        slave, master = tensor_face(dimension, count), tensor_face(dimension, count + 3)
        mortar = mortar_projection(*slave, *master)
        fields = [
            np.sin(2.0 * points[:, 0]) * np.cos(points[:, 1]) for points, _ in (slave, master)
        ]
        error = mortar.projection @ fields[1] - fields[0]
        errors.append(np.sqrt(mortar.areas @ error**2))
    rates = np.log2(np.divide(errors[:-1], errors[1:]))
    assert rates.min() > 1.8


def tensor_face(dimension, count):
    mesh = MeshTri.init_tensor(*(np.linspace(0.0, 1.0, count + 1),) * 2)
    points = np.zeros((mesh.nvertices if dimension == SURFACE else count + 1, 3))
    if dimension == SURFACE:
        points[:, :2] = mesh.p.T
        return points, mesh.t.T.astype(np.int64)
    points[:, 0] = np.linspace(0.0, 1.0, count + 1)
    return points, np.stack([np.arange(count), np.arange(1, count + 1)], axis=1)


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_gap_is_the_distance_along_the_normal(dimension):
    """Check the offset of parallel tilted faces, and a parabola by its mean over ψ."""
    (slave, facets), (master, others) = flat_face(dimension, 80, 0), flat_face(dimension, 60, 1)
    slope = np.array([0.2, -0.1, 0.0])
    slave[:, 2], master[:, 2] = 0.05 + slave @ slope, master @ slope
    mortar = mortar_projection(slave, facets, master, others)
    np.testing.assert_allclose(mortar.gap, 0.05, atol=1e-12)
    parabola = slave[:, 0] ** 2
    slave[:, 2] += parabola
    curved = mortar_projection(slave, facets, master, others)
    np.testing.assert_allclose(curved.gap, 0.05 + parabola, atol=1e-12)
    np.testing.assert_allclose(curved.areas, mortar.areas, rtol=1e-12)


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_faces_that_cannot_be_tied_are_refused(dimension):
    points, facets = flat_face(dimension, 20, 0)
    right, up = 5.0 * np.eye(3)[[0, 2]]
    with pytest.raises(MeshError, match="do not lie on each other"):
        mortar_projection(points, facets, points + right, facets)
    twice = np.concatenate([facets, facets + len(points)])
    with pytest.raises(MeshError, match="must not fold over itself"):
        mortar_projection(points, facets, np.concatenate([points, points + up]), twice)
    upright = points[:, [2, 1, 0]]
    with pytest.raises(MeshError, match="edge-on"):
        mortar_projection(points, facets, upright, facets)
