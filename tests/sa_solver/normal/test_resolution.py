"""Cells across a contact, and the error of its pressure."""

import numpy as np
import pytest

from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.contact import NormalContact
from sa_solver.reference.hertz import HertzSphere
from sa_solver.surfaces.resolution import FEWEST_CELLS, cells_across, is_point, peak_error
from sa_solver.types import ElasticPair, Grid, Material

TITANIUM = Material(115e3, 0.29)
PAIR = ElasticPair(TITANIUM, TITANIUM)


def test_cells_across_are_unbroken_rows():
    pressed = np.zeros((12, 10), dtype=bool)
    assert cells_across(pressed) == (0, 0)
    assert not is_point(pressed)
    pressed[1:3, 4:9] = True  # Two contacts with a gap between them.
    pressed[5:9, 4:9] = True
    assert cells_across(pressed) == (4, 5)
    assert not is_point(pressed)
    pressed[:] = False
    pressed[5:7, 3:5] = True
    assert cells_across(pressed) == (2, 2)
    assert is_point(pressed)
    pressed[11, 9] = True  # A second spot: there is a field.
    assert not is_point(pressed)


@pytest.mark.parametrize("share", [2.9, 4.0, 5.9, 8.1, 12.0, 15.8, 16.2])
def test_the_peak_of_hertz_has_the_predicted_error(share):
    """There are ``share`` cells in the true diameter, on a grid of any position."""
    hertz = HertzSphere(100.0, 10.0, PAIR.contact_modulus)
    pitch = 2.0 * hertz.contact_radius / share
    grid = Grid((24, 24), (pitch, pitch))
    found = NormalContact(HalfSpace(grid, PAIR)).solve((grid.x**2 + grid.y**2) / 20.0, 100.0)
    across = cells_across(found.pressure > 0.0)
    missing = 1.0 - found.pressure.max() / hertz.peak_pressure
    assert across[0] == across[1]
    assert abs(across[0] - share) <= 2.0
    assert 0.0 < missing < 1.3 * peak_error(across[0])
    if across[0] >= FEWEST_CELLS:
        assert missing < 0.01
