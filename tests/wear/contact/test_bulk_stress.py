"""Stress that passes under a contact, from the motion of its face: closed forms, both bodies."""

import numpy as np
import pytest

from sa_solver.half_space.operator import HalfSpace
from sa_solver.load_history import LoadHistory
from sa_solver.types import Array, ElasticPair, Grid, Material
from wear.contact.transfer import CellNodes
from wear.cracking.bulk_stress import RIGID, SIDE, BodyFace

METAL = Material(115e3, 0.29)
E, NU = METAL.young, METAL.poisson
AREA, LINE = Grid.covering((2.0, 3.0), (16, 12)), Grid.line_contact(2.0, 32)
DEPTH = 0.02


def loaded(count: int, load: float) -> LoadHistory:
    return LoadHistory(np.full(count, load), *np.zeros((7, count)), sliding=np.ones(count, bool))


def rest(
    grid: Grid, body: int, motion: Array, tractions: Array, expansion: Array | None = None
) -> tuple[Array, Array]:
    """Return the stress below the cells of a body whose nodes move so, without the contact's own.

    Also return the places of the cells. The ``tractions`` ``(3, nx, ny)`` and, if given, the
    ``expansion`` ``(2, nx, ny)`` are known at the nodes.
    """
    pair = (METAL, RIGID) if body == 1 else (RIGID, METAL)
    own = SIDE[body] * HalfSpace(grid, ElasticPair(*pair)).displacement(tractions)
    nodes = CellNodes(grid)
    face = BodyFace(grid, nodes, METAL, body)  # type: ignore[arg-type]
    force, moved = tractions * grid.cell_area, motion + own
    fields = (f.reshape(1, 3, -1) for f in (force, moved))
    heated = None if expansion is None else expansion.reshape(1, 2, -1)
    bulk = face.bulk_stress(loaded(1, 1.0), *fields, heated)
    assert bulk is not None
    return bulk.at(nodes.places, DEPTH)[0], nodes.places


@pytest.mark.parametrize("body", [1, 2])
def test_bent_bar_with_a_contact_on_it(body: int) -> None:
    """For σ_xx = a + b z, u E is a x + b x z, -ν (a + b z) y, ν b (y² - z²)/2 - ν a z - b x²/2."""
    a, b = 200.0, 70.0
    pressed = np.maximum(0.0, 1.0 - AREA.x**2 - AREA.y**2)
    tractions = np.stack([0.3 * pressed, -0.1 * pressed, pressed]) * 500.0
    x, y = np.broadcast_arrays(AREA.x, AREA.y)
    turned = np.stack([-2e-3 * y, 2e-3 * x, 1e-3 * x])  # no stress in a rigid rotation
    motion = np.stack([a * x, -NU * a * y, 0.5 * b * (NU * y**2 - x**2)]) / E + turned
    stress, _ = rest(AREA, body, motion, tractions)
    expected = np.zeros_like(stress)
    expected[0] = a + b * SIDE[body] * DEPTH
    np.testing.assert_allclose(stress, expected, atol=1e-7 * a)


@pytest.mark.parametrize("body", [1, 2])
def test_shear_follows_from_tension_that_grows_along_the_face(body: int) -> None:
    """With σ_xx = c x and σ_zx = -c z in plane strain, u_x = (1 - ν²) c x²/2E and u_z = 0 there."""
    c = 150.0
    pressed = 300.0 * np.maximum(0.0, 1.0 - LINE.x**2)
    tractions = np.stack([0.4 * pressed, 0.0 * pressed, pressed])
    motion = np.zeros_like(tractions)
    motion[0] = 0.5 * c * (1.0 - NU**2) * LINE.x**2 / E
    stress, (x, _) = rest(LINE, body, motion, tractions)
    expected = np.zeros_like(stress)
    expected[0], expected[1] = c * x, NU * c * x
    expected[5] = -c * SIDE[body] * DEPTH
    np.testing.assert_allclose(stress, expected, atol=1e-7 * c)


@pytest.mark.parametrize("body", [1, 2])
def test_free_expansion_stresses_nothing(body: int) -> None:
    """θ = a + b x + c y + d z moves the face z = 0 by ½ ((a + θ) x - b y², ...), -½ d (x² + y²)."""
    a, b, c, d = 1e-3, 4e-4, -3e-4, 5e-4
    pressed = np.stack(
        [0.0 * AREA.x * AREA.y] * 2 + [500.0 * np.maximum(0.0, 1.0 - AREA.x**2 - AREA.y**2)]
    )
    x, y = np.broadcast_arrays(AREA.x, AREA.y)
    motion = np.stack(
        [
            a * x + 0.5 * b * (x**2 - y**2) + c * x * y,
            a * y + 0.5 * c * (y**2 - x**2) + b * x * y,
            -0.5 * d * (x**2 + y**2),
        ]
    )
    expansion = np.stack([a + b * x + c * y, np.full(AREA.shape, d)])
    stress, _ = rest(AREA, body, motion, pressed, expansion)
    assert np.abs(stress).max() < 1e-7 * E * a
    held, _ = rest(AREA, body, 0.0 * motion, pressed, expansion)
    hot = expansion[0] + SIDE[body] * DEPTH * d
    np.testing.assert_allclose(held[:2], -E * np.stack([hot, hot]) / (1.0 - NU), rtol=1e-7)
    np.testing.assert_allclose(held[5], SIDE[body] * DEPTH * E * b / (1.0 - NU), rtol=1e-6)


def test_section_that_expands_presses_across_its_plane() -> None:
    """A section held across its plane moves by (1 + ν) θ x, under -E θ along y alone."""
    motion, nothing = np.zeros((2, 3, *LINE.shape))
    motion[0] = (1.0 + NU) * 1e-3 * LINE.x
    expansion = np.stack([np.full(LINE.shape, 1e-3), np.zeros(LINE.shape)])
    stress, _ = rest(LINE, 2, motion, nothing, expansion)
    expected = np.zeros_like(stress)
    expected[1] = -E * 1e-3
    np.testing.assert_allclose(stress, expected, atol=1e-7 * E * 1e-3)


def test_a_half_space_has_nothing_to_add() -> None:
    tractions = np.zeros((3, *AREA.shape))
    tractions[:, 4:9, 3:8] = np.array([100.0, -50.0, 300.0])[:, None, None]
    for body in (1, 2):
        stress, _ = rest(AREA, body, np.zeros_like(tractions), tractions)
        assert np.abs(stress).max() < 1e-7 * 300.0


def test_few_nodes_determine_no_bulk_stress() -> None:
    grid = Grid.line_contact(1.0, 3)
    nothing = np.zeros((1, 3, 3))
    face = BodyFace(grid, CellNodes(grid), METAL, 2)
    assert face.bulk_stress(loaded(1, 0.0), nothing, nothing) is None
