"""Shear where a contact sticks, from nodal tractions: by hand, and its balance."""

import numpy as np

from sa_solver.load_history import LoadHistory
from sa_solver.types import Array
from wear.contact.sticking import with_sticking_shear
from wear.contact.tractions import CycleTractions

AREA, FRICTION = 0.25, 0.5


def cycle(pressure: list[float], shear: list[float], loads: tuple[float, float]) -> CycleTractions:
    """Return one increment on a row of cells, sheared along x, in which half of the load sticks."""
    p = np.array(pressure)[None, :, None]
    q = np.zeros((1, 2, len(pressure), 1))
    q[0, 0, :, 0] = shear
    zero = np.zeros(1)
    P, Qx = np.array([[p.sum() * AREA], [loads[0]]])
    history = LoadHistory(
        P, Qx, np.array([loads[1]]), *(zero for _ in range(5)), sliding=zero == 1.0
    )
    return CycleTractions(history, FRICTION, p, q, np.zeros_like(q), np.array([0.5]))


def nodal(shear: list[float], pressure: list[float]) -> Array:
    fields = np.zeros((1, 3, len(pressure), 1))
    fields[0, 0, :, 0], fields[0, 2, :, 0] = shear, pressure
    return fields


def test_shear_is_to_pressure_as_at_the_nodes() -> None:
    """Shear is at the limit, half of it the other way, or that of slip at unloaded nodes."""
    coarse = nodal([50.0, -20.0, 0.0], [100.0, 80.0, 0.0])
    given = cycle([120.0, 60.0, 10.0], [0.0, 0.0, 5.0], (AREA * (60.0 - 15.0 + 5.0), 0.0))
    known = with_sticking_shear(given, coarse, AREA)
    np.testing.assert_allclose(known.shear[0, 0, :, 0], [60.0, -15.0, 5.0])
    assert not known.unknown.any()


def test_what_is_lacking_goes_where_shear_is_below_the_limit() -> None:
    """30 MPa are lacking along y, where the cells can take 0, 15 and 15 MPa more."""
    coarse = nodal([50.0, -20.0, 0.0], [100.0, 80.0, 80.0])
    given = cycle([120.0, 60.0, 30.0], [0.0] * 3, (AREA * (60.0 - 15.0), AREA * 30.0))
    given.shear[0, 0, 1] = 7.0  # from slip, but the nodes are more accurate
    known = with_sticking_shear(given, coarse, AREA).shear[0, :, :, 0]
    room = np.array([0.0, 60.0 * FRICTION - 15.0, 30.0 * FRICTION])
    np.testing.assert_allclose(known[1], room)
    np.testing.assert_allclose(known[0], [60.0, -15.0, 0.0])


def test_never_more_than_the_limit() -> None:
    coarse = nodal([60.0, 40.0], [100.0, 100.0])
    given = cycle([100.0, 100.0], [0.0, 0.0], (1e3, 1e3))
    known = with_sticking_shear(given, coarse, AREA).shear[0]
    assert np.hypot(*known).max() <= FRICTION * 100.0 * (1.0 + 1e-12)
