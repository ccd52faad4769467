"""How far off centre a load may act, and where a contact ends: at an edge or at its grid.

A flat strip of half width a, pressed at e from its middle it stays in full contact
up to e = a/2, where the pressure

    p = P (1 + 2 e x / a²) / π sqrt(a² - x²)

vanishes at one edge. Beyond, it tilts and keeps contact over a length 2b = 4 (a - e) at the other:

    p = P / π b  sqrt((b + ξ) / (b - ξ)),  ξ from the middle of that length

whose resultant acts at ξ = b/2 (both: a linear displacement, singular at two ends or at one;
Johnson 1985, *Contact Mechanics*, section 2.7). It carries a load up to e = a, where nothing is
left to press; cells do so up to the middle of the outermost.
"""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from sa_solver.contact import FrictionalContact
from sa_solver.contact_state import ContactLoad
from sa_solver.dissimilar.contact import CoupledContactError
from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.contact import NormalContact, NormalContactError
from sa_solver.reference.hertz import HertzSphere
from sa_solver.types import ElasticPair, Grid, Material
from tests.limits.conditions import normal_error
from workflow.cli import cli

TITANIUM = Material(115e3, 0.29)
PAIR = ElasticPair(TITANIUM, TITANIUM)
UNLIKE = ElasticPair(Material(np.inf, 0.3), TITANIUM)
SOLVED = 1e-8
P, HALF = 100.0, 1.0
STEP = 1.0
"""How much lower the surface is beside a flat [mm]: no elastic displacement reaches it."""


def strip(cells=256, margin=0.25):
    """Return a flat of half width 1 mm, a whole number of cells, with a step at its ends."""
    grid = Grid.line_contact(2.0 * (HALF + margin), cells)
    return grid, np.where(np.abs(grid.x) < HALF, 0.0, STEP)


def solve(grid, height, off_centre, pair=PAIR):
    return NormalContact(HalfSpace(grid, pair)).solve(height, P, My=-P * off_centre)


# --- the edge of a flat --------------------------------------------------------------------------


@pytest.mark.parametrize("off_centre", [0.0, 0.25, 0.48])
def test_up_to_a_quarter_of_its_width_all_of_a_flat_presses(off_centre):
    """Pressure is within 1 % ten cells from the singular ends; k cells away, 1/16 k is missing."""
    grid, height = strip(320)
    state = solve(grid, height, off_centre)
    flat = height == 0.0
    assert state.converged
    assert np.array_equal(state.pressure > 0.0, flat)
    x = grid.x[:, 0]
    inner = np.abs(x) < HALF - 10.0 * grid.pitch[0]
    exact = 1.0 + 2.0 * off_centre * x[inner] / HALF**2
    exact *= P / (np.pi * np.sqrt(HALF**2 - x[inner] ** 2))
    np.testing.assert_allclose(state.pressure[inner, 0], exact, rtol=0.01, atol=0.003 * P)


@pytest.mark.parametrize("off_centre", [0.52, 0.75, 0.9])
def test_beyond_it_lifts_at_one_end(off_centre):
    """Contact length is 4 (a - e) to a cell; pressure to 2 % three cells from either end."""
    grid, height = strip(640)
    state = solve(grid, height, off_centre)
    assert state.converged
    length = np.count_nonzero(state.pressure) * grid.pitch[0]
    assert length == pytest.approx(4.0 * (HALF - off_centre), abs=1.5 * grid.pitch[0])
    half = 2.0 * (HALF - off_centre)
    place = grid.x[:, 0] - (HALF - half)
    inner = np.abs(place) < half - 3.0 * grid.pitch[0]
    exact = P / (np.pi * half) * np.sqrt((half + place[inner]) / (half - place[inner]))
    np.testing.assert_allclose(state.pressure[inner, 0], exact, rtol=0.02, atol=0.01 * exact.max())
    assert not state.touches_border


def test_at_the_edge_of_a_flat_one_cell_carries_it_and_beyond_the_body_falls_over():
    """Past the last cell of the flat it comes to rest on the next surface: the grid's end."""
    grid, height = strip(100)
    last = float(grid.x[height == 0.0].max())
    inside = solve(grid, height, last * (1.0 - 1e-6))
    assert inside.converged
    assert np.count_nonzero(inside.pressure) <= 2
    assert not inside.touches_border
    outside = solve(grid, height, last + 0.4 * grid.pitch[0])
    assert outside.converged
    assert outside.touches_border
    assert abs(outside.tilt_y) > 1.0  # a step of 1 mm over 0.25 mm
    force = outside.pressure * grid.cell_area
    assert -np.sum(force * grid.x) == pytest.approx(outside.My, rel=SOLVED)


# --- the edge of the grid ------------------------------------------------------------------------


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("pair", [PAIR, UNLIKE], ids=["alike", "unlike"])
def test_a_load_acts_within_the_cell_centres_or_is_refused(pair, side, axis):
    grid = Grid.covering((2.0, 3.0), (20, 24))
    height = np.zeros(grid.shape)
    contact = FrictionalContact(HalfSpace(grid, pair), 0.1)
    reach = float((grid.x, grid.y)[axis].max())

    def state(share):
        values = np.array([P, 0.0, 0.0, 0.0, 0.0, 0.0])
        values[[4, 3][axis]] = side * P * reach * share
        return contact.advance(contact.unloaded_state(height), height, ContactLoad(values))

    inside = state(0.999)
    assert inside.converged, inside.message
    assert inside.border_load > 0.99
    with pytest.raises((NormalContactError, CoupledContactError), match="outside the cells"):
        state(1.001)


@pytest.mark.parametrize("pair", [PAIR, UNLIKE], ids=["alike", "unlike"])
def test_a_contact_reaches_the_border_of_its_grid_or_not(pair):
    """Half the grid is 1.1 and 0.9 contact radii: only the second is reported as cut off."""
    sphere = HertzSphere(P, 10.0, pair.contact_modulus)
    for share, cut in ((1.1, False), (0.9, True)):
        size = 2.0 * share * sphere.contact_radius
        grid = Grid.covering((size, size), (40, 40))
        height = sphere.gap(grid.x, grid.y)
        contact = FrictionalContact(HalfSpace(grid, pair), 0.1)
        state = contact.advance(
            contact.unloaded_state(height), height, ContactLoad(np.array([P, 0, 0, 0, 0, 0.0]))
        )
        assert state.converged
        assert (state.border_load > 0.0) == cut
        if pair is PAIR and not cut:
            peak = sphere.peak_pressure
            np.testing.assert_allclose(
                state.pressure, sphere.pressure(grid.x, grid.y), atol=0.06 * peak
            )


def test_what_is_cut_off_is_solved_as_if_the_body_ended_there():
    """The same cells on a larger grid without a surface around carry the same pressure."""
    sphere = HertzSphere(P, 10.0, PAIR.contact_modulus)
    pitch = 0.045 * sphere.contact_radius
    small, large = Grid((40, 40), (pitch, pitch)), Grid((60, 60), (pitch, pitch))
    height = sphere.gap(large.x, large.y) + STEP
    height[10:-10, 10:-10] -= STEP
    cut = NormalContact(HalfSpace(small, PAIR)).solve(sphere.gap(small.x, small.y), P)
    whole = NormalContact(HalfSpace(large, PAIR)).solve(height, P)
    assert cut.touches_border
    assert not whole.touches_border
    peak = whole.pressure.max()
    np.testing.assert_allclose(cut.pressure, whole.pressure[10:-10, 10:-10], atol=1e-5 * peak)
    assert normal_error(small, PAIR.contact_modulus, sphere.gap(small.x, small.y), cut) < 2 * SOLVED


CASE = """\
title: Ball
analysis: contact
structure: {kind: bodies, shape: sphere, radius: 10 mm}
materials: {body_1: {young: 115 GPa, poisson: 0.29}, body_2: {young: 115 GPa, poisson: 0.29}}
friction: {coefficient: 0.3}
load_path: {legs: [{P: 100 N}]}
contact: {grid: [24, 24], size: [1 mm, 1 mm]}
output: {paraview: false, figures: false}
"""


@pytest.mark.parametrize(("share", "cut"), [(1.15, False), (0.9, True)])
def test_a_run_warns_of_a_contact_that_is_cut_off(tmp_path, share, cut):
    (tmp_path / "case.yaml").write_text(CASE, encoding="utf-8")
    size = 2.0 * share * HertzSphere(100.0, 10.0, PAIR.contact_modulus).contact_radius
    arguments = ["run", str(tmp_path / "case.yaml"), "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(cli, [*arguments, "--set", f"contact.size=[{size}, {size}]"])
    assert done.exit_code == 0, done.stderr
    warnings = json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))["warnings"]
    assert any("touches the border" in reported for reported in warnings) == cut
