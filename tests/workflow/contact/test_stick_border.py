"""Tests of the error of whole cells in partial slip, against limiting shapes in closed form.

With similar bodies, ν = 0 and loads or motions that are held, the zone that always sticks remains
that of Cattaneo and Mindlin, |r| < c, and nothing presses outside in the end (Popov 2014,
doi:10.1038/srep03749).
"""

from __future__ import annotations

import json

import h5py
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import solve_toeplitz
from scipy.optimize import brentq

from tests.marks import slow
from tests.workflow.command_line import invoke
from wear.steps.stick_border import EDGE
from workflow.models.budget.parts import ERROR_PER_TOLERANCE

MODULUS, RADIUS, FRICTION = 1e5, 10.0, 0.3  # E* [MPa], R [mm]; G* = E*
CASE = """title: wear in partial slip to its limiting shape
analysis: wear
structure: {{kind: bodies, shape: {shape}, radius: 10 mm}}
materials:
  body_1: {{young: 200 GPa, poisson: 0}}
  body_2: {{young: 200 GPa, poisson: 0}}
friction: {{coefficient: 0.3}}
load_path:
  legs:
    - {{{pressing}, {along}: {value}, increments: 2}}
    - {{{pressing}, {along}: -{value}, increments: 2}}
contact: {{grid: {grid}, size: {size}, method: full{solver}}}
wear:
  law: archard
  cycles: {life}
  step: {{kind: implicit{step}}}
  tolerance: 5 %
  body_1: {{specific_wear_rate: "1e-6 mm^3/(N*m)"}}
  body_2: {{specific_wear_rate: "1e-6 mm^3/(N*m)"}}
stress: {{section: none, life: {{parameter: none}}}}
output: {{paraview: false, figures: false, report: false}}
"""
FIXED = ", cycles: 1.5e7"


def errors(
    folder, legs: tuple[str, str, str], cells: int, step: str = FIXED, life: str = "3e7", solver=""
):
    """Return the interface of a run under ``legs`` that press, and shear in both directions."""
    pressing, along, value = legs
    line = "/mm" in pressing
    shape = {
        "shape": "cylinder" if line else "sphere",
        "step": step,
        "life": life,
        "solver": solver,
    }
    shape |= {"grid": cells if line else [cells] * 2, "size": "0.84 mm" if line else [0.84, 0.84]}
    path = folder / "case.yaml"
    text = CASE.format(**shape, pressing=pressing, along=along, value=value)
    path.write_text(text, encoding="utf-8")
    ending = invoke("run", path, "--out", folder / "out")
    assert ending.exit_code == 0, ending.stderr
    return json.loads((folder / "out" / "summary.json").read_text("utf-8"))["interface"]


def limit(w, c: float, line: bool) -> dict[str, float]:
    """Return largest depth and volume of the worn depth ``w(r)`` outside c, summed over bodies."""
    a = brentq(w, 1.1 * c, 3.0 * c)
    volume, _ = quad(lambda r: w(r) * (2.0 if line else 2.0 * np.pi * r), c, a)
    return {"depth": max(map(w, np.linspace(c, a, 2001))), "volume": volume}


def limit_of_cylinder(P: float, Q: float) -> dict[str, float]:
    """Integrate w' = (2 P1/π E* - (x² - c²)/R)/√(x² - c²), with P1 = Q/µ.

    It is the superposition of a flat punch and Hertz.
    """
    c = np.sqrt(4.0 * RADIUS * P / (np.pi * MODULUS) * (1.0 - Q / (FRICTION * P)))
    flat = 2.0 * Q / (FRICTION * np.pi * MODULUS)

    def w(x: float) -> float:
        angle, root = np.arccosh(x / c), np.sqrt(x * x - c * c)
        return flat * angle - (x * root - c * c * angle) / (2.0 * RADIUS)

    return limit(w, c, True)


def limit_of_sphere(d: float, c: float) -> dict[str, float]:
    """Evaluate w = r²/2R - d + (2/π) ∫_0^c (d - x²/R)/√(r² - x²) dx, of the other sign."""

    def w(r: float) -> float:
        half = np.arccos(c / r) if r > c else 0.0
        root = np.sqrt(max(r * r - c * c, 0.0))
        return 2.0 / np.pi * ((d - r * r / 2 / RADIUS) * half - c * root / 2 / RADIUS)

    return limit(w, c, False)


def assert_told(found: dict, exact: dict[str, float], most: float = 3.0) -> None:
    for name, true in exact.items():
        error = sum(found[f"{name}_{body}"] for body in (1, 2)) / true - 1.0
        reported = found["error"][name]["grid"]
        assert 1.0 / most < reported / error < most, (name, error, reported)


def test_a_punch_of_cells_is_narrower_than_these() -> None:
    """Cells with mean pressures, held in their middles: capacity of a segment, u = ln 2/c.

    Per unit force over π E*/2, the displacement is -ln of the distance.
    """
    count = 800
    i = np.arange(count) + 0.5
    integral = [x * np.log(np.abs(x)) - x for x in (i, i - 1.0)]
    datum = np.log(4.0 * count)
    force = solve_toeplitz(datum - (integral[0] - integral[1]), np.ones(count)).sum()
    half_width = 2.0 * np.exp(datum - 1.0 / force)
    assert count / 2 - half_width == pytest.approx(EDGE, abs=1e-4)


@pytest.mark.parametrize("strips", [40, slow(48)])
def test_the_grid_error_of_a_cylinder_in_partial_slip_is_estimated(tmp_path, strips) -> None:
    """Wear is 14 % too small on 40 cells, 17 % too large on 48, in two fixed steps."""
    found = errors(tmp_path, ("P: 700 N/mm", "Qx", "134.4 N/mm"), strips)
    assert_told(found, limit_of_cylinder(700.0, 134.4), most=1.6)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6])
def test_depth_and_volume_follow_the_tolerance_of_the_contact_solver(tmp_path, tolerance) -> None:
    """Nothing presses on worn cells in the end: small errors of their pressure must not wear."""
    legs, runs = ("P: 700 N/mm", "Qx", "134.4 N/mm"), []
    for number, solved in enumerate((tolerance, 1e-10)):
        folder = tmp_path / str(number)
        folder.mkdir()
        runs.append(errors(folder, legs, 40, solver=f", tolerance: {solved}"))
    for name in ("depth_1", "volume_1"):
        found, exact = (run[name] for run in runs)
        assert abs(found / exact - 1.0) < ERROR_PER_TOLERANCE * tolerance


def test_a_contact_that_grows_within_a_step_wears_there(tmp_path) -> None:
    """In one step the slip zone is worn off as far as the contact reaches, so that it is free."""
    errors(tmp_path, ("P: 700 N/mm", "Qx", "134.4 N/mm"), 40, ", cycles: 3e7")
    with h5py.File(tmp_path / "out" / "results.h5") as results:
        last = max(results["surfaces/interface"])
        depth = np.subtract(
            *(results[f"surfaces/interface/{n}/body_2"][:] for n in (last, "00000"))
        )
        pressure = results[f"contact/interface/{last}/pressure"][:]
        unworn = results["contact/interface/00000/pressure"][:]
    worn, grown = depth > 1e-3 * depth.max(), (pressure > 0.0) & (unworn == 0.0)
    assert np.count_nonzero(grown) >= 2
    assert worn[grown].all()
    assert pressure[worn].max() < 1e-3 * pressure.max()


def test_a_cylinder_that_slides_has_no_such_border(tmp_path) -> None:
    found = errors(tmp_path, ("P: 700 N/mm", "shift_x", "8 um"), 32, ", cycles: 5e3", "1e4")
    assert found["depth_1"] > 0.0
    assert found["error"]["volume"]["grid"] is None  # no probe runs in tests


SPHERES = {
    "held": (("approach: 9 um", "shift_x", "1.728 um"), limit_of_sphere(9e-3, 0.18)),
    "forces": (
        ("P: 360 N", "Qx", "84.672 N"),
        limit_of_sphere(360.0 / (2.0 * MODULUS * 0.18) + 0.18**2 / (3.0 * RADIUS), 0.18),
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("load", SPHERES)
def test_the_grid_error_of_a_sphere_in_partial_slip_is_estimated(tmp_path, load) -> None:
    """Wear is 4 and 7 % too large on 48 cells; c = 0.18 mm, µE*(d - c²/R) = G* shift."""
    legs, exact = SPHERES[load]
    assert_told(errors(tmp_path, legs, 48, ", cycles: 5e6"), exact)
