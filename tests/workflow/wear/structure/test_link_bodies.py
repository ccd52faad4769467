"""Tests of the link for bodies that are half-spaces, layers, strips or end near the contact.

Results of a coarse mesh with the link are compared with closed forms and fine meshes, and so is the
half-space alone. Errors are those of :func:`tests.workflow.wear.mesh.plane_blocks.error`.
"""

import numpy as np
import pytest

from sa_solver.types import Array
from tests.marks import slow
from tests.oracles.elastic_layer import layer_compliance, press
from tests.workflow.wear.mesh.plane_blocks import CERAMIC, RADIUS, RUBBER, Blocks, error, solved

pytestmark = pytest.mark.usefixtures("reads_here")

PLAIN = "contact.link=half_space"
# E* of the block of 0.2 GPa under the foot of 2000 GPa [MPa].
MODULUS = 200.0 / (1.0 - 0.3**2)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "bodies", "wrong"), [(0.4, 0.035, 0.015), (0.1, 0.01, 0.006), (0.05, 0.004, 2e-3)]
)
def test_of_bodies_much_larger_than_the_contact_nothing_is_left(tmp_path, size, bodies, wrong):
    """For blocks 40 times as thick as the contact, d is the mesh's error, and Hertz is met.

    The error is ten times smaller with eight times as many nodes. Half-spaces alone are exact.
    """
    blocks = Blocks(
        (-80, 80), 80, (-80, 80), 80, (-2.5, 2.5), materials=({}, {}), line_contact=4096
    )
    modulus = 200e3 / (2.0 * (1.0 - 0.3**2))
    load, peak = np.pi * modulus / (4.0 * RADIUS), 0.5 * modulus / RADIUS  # 1 mm to either side
    case = blocks.press(tmp_path, size, load)
    for settings, most in (((), wrong), ((PLAIN,), 3e-4)):
        _, stage, first = solved(case, "contact.tolerance=1e-8", *settings)
        hertz = peak * np.sqrt(np.maximum(1.0 - stage.grid.x**2, 0.0))
        assert error(first.pressure[0], hertz) < most
        assert first.link.quality[0] < bodies


@pytest.mark.parametrize(
    ("depth", "hold", "load", "plain", "wrong"),
    [
        (2.0, "z", 0.6, 0.06, 0.013),
        (1.0, "all", 0.6, 0.20, 0.012),
        slow(4.0, "z", 0.6, 0.02, 0.013),
        slow(2.0, "all", 0.6, 0.08, 0.014),
        slow(1.0, "z", 6.0, 0.40, 0.006),
    ],
)
def test_layers_and_strips(tmp_path, depth, hold, load, plain, wrong):
    """A cylinder presses a layer that sticks to a rigid base, or slides on it as a half strip.

    The contact is 2.0 to 4.8 mm wide and has 9 to 19 nodes; half-spaces are off by more than
    ``plain``.
    """
    blocks = Blocks((-25, 25), depth, (-5, 5), 5, (-5, 5), hold, line_contact=320)
    case = blocks.press(tmp_path, 0.25, load)
    stuck = 0.3 if hold == "all" else None
    _, stage, linked = solved(case)
    x, pitch = stage.grid.x.ravel(), stage.grid.pitch[0]
    compliance = layer_compliance(x, pitch, MODULUS, depth, hats=False, stuck=stuck)
    exact = press(compliance, 0.5 * x**2 / RADIUS, np.full(len(x), pitch), load)
    assert error(linked.pressure[0, :, 0], exact) < wrong
    assert not linked.link.coarse
    assert error(solved(case, PLAIN)[2].pressure[0, :, 0], exact) > plain


def on_cells(stage, history, nodal: Array) -> Array:
    """Return nodal values along a face at its cells."""
    x = history.interface.coordinates[:, 0]
    order = np.argsort(x)
    return np.interp(stage.grid.x.ravel(), x[order], nodal[order])


def beside_an_edge(edge: float, height: float, **changes) -> Blocks:
    """Return a foot over the end of a block, flush with it."""
    return Blocks((-25, edge), 20, (-edge, edge), height, (-edge, edge), **changes)


@pytest.mark.parametrize(
    ("edge", "materials", "load", "plain"),
    [
        (1.4, (RUBBER, CERAMIC), 0.6, 0.075),
        slow(1.4, ({}, {}), 300.0, 0.085),
        slow(2.0, (RUBBER, CERAMIC), 0.6, 0.035),
        slow(2.0, ({}, {}), 300.0, 0.04),
    ],
)
def test_a_cylinder_near_the_edge_of_a_block(tmp_path, edge, materials, load, plain):
    """The contact is 2.2 mm wide, 1.4 or 2 mm from the edge: 15 nodes replace 71 or more.

    The foot is rigid, or as soft as the block, and ends with it. Half-spaces are off by more than
    ``plain``, the link by less than 2 %.
    """
    blocks = beside_an_edge(edge, 6, materials=materials)
    fine, _, _ = solved(blocks.press(tmp_path, 0.02 * edge, load))
    case = blocks.press(tmp_path, 0.2, load)
    for settings in ((), (PLAIN,)):
        _, stage, first = solved(case, *settings)
        exact = on_cells(stage, fine, fine.pressure[0])
        wrong = error(first.pressure[0, :, 0], exact)
        assert wrong > plain if settings else wrong < 0.02


@pytest.mark.slow
def test_a_rough_foot_near_the_edge_of_a_block(tmp_path):
    """The foot is pressed, pushed back and forth with friction, lifted; against 4 x the nodes.

    Compared are pressure and shear at peak load and the energy of the cycle, with and without the
    link: the block is softer towards its end, so half-spaces lose a third too much in partial slip.
    """
    blocks = beside_an_edge(2.0, 4, materials=({}, {}))
    down = {"kind": "displacement", "group": "foot_z1", "displacement": [0, 0, -0.006]}
    push = {"kind": "displacement", "group": "foot_z1", "displacement": [0.002, 0, 0]}
    loads = [down | {"path": [1, 1, 1, 0]}, push | {"path": [0, 1, -1, 0]}]
    legs = {"increments": [8, 8, 16, 8], "peak_leg": 2}
    fine, _, _ = solved(blocks.write(tmp_path, 0.025, loads, legs, friction=0.3))
    case, peak = blocks.write(tmp_path, 0.1, loads, legs, friction=0.3), 15
    for settings, wrong in (((), (0.01, 0.035, 0.03)), ((PLAIN,), (0.035, 0.09, 0.3))):
        _, stage, first = solved(case, "contact.method=full", *settings)
        shear, pressure = (
            on_cells(stage, fine, fine.force[peak, k] / fine.interface.nodal_areas) for k in (0, 2)
        )
        found = first.cycle[peak]
        limit = 0.3 * np.linalg.norm(pressure)
        errors = (
            error(found.pressure[:, 0], pressure),
            np.linalg.norm((found.shear[0, :, 0] - shear)[pressure > 0.0]) / limit,
            abs(first.energy.sum() / fine.loads.Edx.sum() - 1.0),
        )
        reported = np.less(errors, wrong)
        assert not reported.any() if settings else reported.all()
