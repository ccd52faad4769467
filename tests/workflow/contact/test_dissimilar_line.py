"""The shipped dissimilar line contact against dense matrices and active sets, each increment.

The run takes its increments in two.

The reference shares nothing with the solver: the influence of a strip comes from Johnson's line
integrals (1985, eqs 2.25), for one elastic half-plane on a rigid body, and the normal and the
tangential problem are solved alternately until neither changes.
"""

from itertools import islice
from pathlib import Path

import h5py
import numpy as np
import pytest
from click.testing import CliRunner

from workflow.cli import cli

CASE = Path(__file__).parents[3] / "cases" / "line_dissimilar.yaml"
YOUNG, POISSON, RADIUS, FRICTION = 115e3, 0.29, 50.0, 0.5
STRIPS, SIZE = 128, 1.2
PARTS = 2
PATH = [(10.0 * k, 0.0) for k in range(1, 41)] + [(400.0, 5.0 * k) for k in range(1, 21)]
PATH += [(400.0, 100.0 - 5.0 * k) for k in range(1, 41)]
# Largest change of an iteration, relative to the largest pressure.
SETTLED = 1e-8

PITCH = SIZE / STRIPS
X = (np.arange(STRIPS) - 0.5 * (STRIPS - 1)) * PITCH


def influence():
    """Return the displacement along and across unit tractions on the strips [mm/MPa]."""
    distance = X[:, None] - X[None, :]
    ends = distance + 0.5 * PITCH, distance - 0.5 * PITCH
    logarithm = np.subtract(*(t * np.log(np.abs(t)) - t for t in ends))
    along = -2.0 * (1.0 - POISSON**2) / (np.pi * YOUNG) * (logarithm - PITCH * np.log(3.0 * SIZE))
    coupling = (1.0 - 2.0 * POISSON) * (1.0 + POISSON) / YOUNG
    return along, 0.5 * coupling * PITCH * np.sign(distance)


ALONG, ACROSS = influence()


def constrained(cells, right, modes, resultants):
    """Return tractions on ``cells`` that give displacements ``right`` up to rigid ``modes``."""
    rows = [mode[cells] for mode in modes]
    count, size = len(rows), int(cells.sum())
    matrix = np.zeros((size + count, size + count))
    matrix[:size, :size] = ALONG[np.ix_(cells, cells)]
    for k, row in enumerate(rows):
        matrix[:size, size + k], matrix[size + k, :size] = -row, PITCH * row
    solution = np.linalg.solve(matrix, np.concatenate([right[cells], resultants]))
    traction = np.zeros(STRIPS)
    traction[cells] = solution[:size]
    return traction, sum(m * c for m, c in zip(modes, solution[size:], strict=True))


def press(load, shear, pressed):
    """Return the pressure under ``load`` without moment, for a given ``shear``."""
    unloaded = X**2 / (2.0 * RADIUS) + ACROSS @ shear
    while True:
        pressure, rigid = constrained(pressed, -unloaded, [np.ones(STRIPS), X], [load, 0.0])
        gap = ALONG @ pressure + unloaded - rigid
        change = np.where(pressed, pressure < 0.0, gap < 0.0)
        if not change.any():
            return pressure, pressed
        pressed = pressed ^ change


def drag(force, pressure, offset, sense):
    """Return shear with the resultant ``force``; it slips in ``sense`` where it cannot stick."""
    stuck = pressure > 0.0
    while True:
        slips = (pressure > 0.0) & ~stuck
        shear = np.where(slips, -FRICTION * pressure * sense, 0.0)
        held, rigid = constrained(
            stuck, -(offset + ALONG @ shear), [np.ones(STRIPS)], [force - PITCH * shear.sum()]
        )
        shear = shear + held
        slip = ALONG @ shear + offset - rigid
        over = stuck & (np.abs(shear) > FRICTION * pressure * (1.0 + 1e-12))
        back = slips & (slip * sense < 0.0)
        if not (over.any() or back.any()):
            return shear, sense
        sense = np.where(over, -np.sign(shear), sense)
        stuck = (stuck & ~over) | back


def march():
    """Return pressure and shear at every increment of ``PATH``."""
    pressure, shear, sense = np.zeros(STRIPS), np.zeros(STRIPS), np.ones(STRIPS)
    pressed = np.abs(X) < 5.0 * PITCH
    for load, force in PATH:
        before = ALONG @ shear - ACROSS @ pressure
        for _ in range(1000):
            new, pressed = press(load, shear, pressed)
            dragged, sense = drag(force, new, -(ACROSS @ new) - before, sense)
            moved = max(np.abs(new - pressure).max(), np.abs(dragged - shear).max())
            pressure, shear = new, 0.5 * (shear + dragged)
            if moved < SETTLED * pressure.max():
                break
        else:
            raise AssertionError(f"not settled at P {load}, Q {force}: {moved}")
        yield pressure, shear


@pytest.mark.slow
def test_line_dissimilar_is_the_active_set_solution(tmp_path):
    quiet = ["output={paraview: false, figures: false}", f"contact.grid={STRIPS}", "expect=[]"]
    settings = [part for entry in quiet for part in ("--set", entry)]
    done = CliRunner().invoke(cli, ["run", str(CASE), "--out", str(tmp_path / "out"), *settings])
    assert done.exit_code == 0, done.stderr
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        assert file["history"].attrs["parts"] == PARTS
        increments = islice(march(), PARTS - 1, None, PARTS)
        for number, (pressure, shear) in enumerate(increments, start=1):
            state = file[f"contact/bodies/{number:05d}"]
            scale = 1e-6 * pressure.max()
            np.testing.assert_allclose(state["pressure"][:, 0], pressure, atol=scale, rtol=0.0)
            np.testing.assert_allclose(state["shear"][0, :, 0], shear, atol=scale, rtol=0.0)
