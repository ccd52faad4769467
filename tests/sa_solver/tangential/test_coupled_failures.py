"""Contact of dissimilar bodies that cannot be, or is not found: it is refused, or says why."""

import numpy as np
import pytest

import sa_solver.dissimilar.contact as coupled
from sa_solver.dissimilar.contact import CoupledContactError
from sa_solver.tangential.contact import FrictionLimitError
from tests.sa_solver.tangential.dissimilar import P, cylinder, loads, sphere


def test_no_load_means_no_tractions():
    contact, height = sphere(24, 0.4, 0.5)
    state = contact.solve(height, None, loads(0.0))
    assert state.converged
    assert not state.traction.any()
    assert state.gap.min() == 0.0
    assert state.rigid[0] == height.min()
    following = contact.solve(height, -state.displacement[:2], loads(), start=state.start)
    assert following.converged


def test_bodies_kept_apart_do_not_touch():
    contact, height = sphere(24, 0.4, 0.5)
    values = np.array([-1e-3, 0.0, 0.0, 0.0, 0.0, 0.0])
    state = contact.solve(height, None, values, (True, False, False, True, True, False))
    assert state.converged
    assert not state.traction.any()
    assert state.gap.min() == pytest.approx(1e-3 + height.min())


@pytest.mark.parametrize(
    "change",
    [
        {"height": np.full((8, 8), np.nan)},
        {"height": np.zeros((8, 9))},
        {"offset": np.full((2, 8, 8), np.inf)},
        {"compliance": np.full((8, 8), -1.0)},
        {"values": loads(-1.0)},
        {"values": loads(My=1e3)},
        {"values": np.zeros(5)},
    ],
)
def test_impossible_data_are_refused(change):
    contact, height = sphere(8, 0.4, 0.5)
    with pytest.raises(CoupledContactError):
        contact.solve(**{"height": height, "offset": None, "values": loads()} | change)


def test_a_line_contact_refuses_what_has_no_meaning_on_it():
    contact, height = cylinder(40, 0.4, 0.5)
    for name in ("Mx", "Mz"):
        with pytest.raises(CoupledContactError, match=name):
            contact.solve(height, None, loads(**{name: 1.0}))


def test_a_shear_force_above_friction_is_refused_at_once():
    contact, height = sphere(24, 0.4, 0.5)
    with pytest.raises(FrictionLimitError, match="largest is µP = 50 N") as refusal:
        contact.solve(height, None, loads(Qx=60.0, Qy=80.0))
    assert refusal.value.share == pytest.approx(0.5)


def test_a_torque_above_friction_is_reported_with_the_largest(monkeypatch):
    """The limit is 3π µPa/16 for similar bodies; the pressure differs a little from Hertz's."""
    monkeypatch.setattr(coupled, "ITERATIONS", 150)
    contact, height = sphere(24, 0.2, 0.5)
    radius = contact.grid.size[0] / 2.6
    largest = 3 * np.pi / 16 * 0.5 * P * radius
    assert contact.solve(height, None, loads(Mz=0.9 * largest)).converged
    state = contact.solve(height, None, loads(Mz=1.2 * largest))
    assert not state.converged
    assert "friction cannot carry" in state.message
    assert float(state.message.split("Mz = ")[2].split(" ")[0]) == pytest.approx(largest, rel=0.1)


def test_a_contact_of_few_cells_asks_for_a_finer_grid(monkeypatch):
    monkeypatch.setattr(coupled, "NEWTON_ITERATIONS", 0)
    monkeypatch.setattr(coupled, "ITERATIONS", 20)
    contact, height = sphere(24, 0.4, 0.5)
    state = contact.solve(30.0 * height, None, loads(1e-5 * P, Mz=1e-8))
    assert not state.converged
    assert "cells carry the load, refine the grid" in state.message


def test_contact_at_the_border_is_reported():
    contact, height = sphere(24, 0.4, 0.5, width=1.6)
    state = contact.solve(height, None, loads())
    assert state.converged
    assert state.touches_border
