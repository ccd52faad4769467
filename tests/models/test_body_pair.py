"""Tests of two bodies without finite elements that are built and worn in Python."""

import warnings
from dataclasses import replace
from math import inf

import fretscale
import numpy as np
import pytest

from sa_solver import InputError, Material
from tests.conftest import CASES
from wear import EnergyLaw
from workflow.analyses.wear.model import wear_model
from workflow.messages.error_kinds import ErrorKind, error_kind
from workflow.messages.warning_kinds import WarningKind

TITANIUM, LAW = Material(115e3, 0.29), EnergyLaw(1e-8)
STROKE = fretscale.LoadTable.stroke(P=50.0, stroke=0.02)


def contact(grid=(24, 24), **settings):
    return fretscale.Contact(grid, (TITANIUM, TITANIUM), (LAW, LAW), friction=0.6, **settings)


def bodies(loads, **settings):
    """Return a ball of 10 mm, or a cylinder, under a cycle of loads."""

    def gap(x, y):
        return (x**2 + (0.0 if settings.get("line") else y**2)) / 20.0

    return fretscale.BodyPair(gap, (0.6, 0.6), loads, **settings)


def run(structure, of=None, cycles=1000.0):
    wear = fretscale.Wear(cycles=cycles, jump=fretscale.JumpSize(cycles=0.5 * cycles))
    return fretscale.WearModel(structure, of or contact(), wear).run()["interface"]


QUICK = {
    "wear__cycles": 2e3,
    "wear__step__cycles": 1e3,
    "error_budget": "known",
    "output__paraview": False,
    "output__figures": False,
    "stress__section": "none",
    "stress__life__parameter": "none",
}
LEGS = {"legs": [{"P": "50 N", "Qx": "10 N"}, {"Qx": "-10 N", "increments": 2}]}


@pytest.mark.parametrize(
    ("name", "changed"),
    [
        ("cylinder_wear", {"contact__grid": 64}),
        ("sphere_wear", {"contact__grid": [16, 16]}),
        (
            "sphere_wear",
            {
                "contact__grid": [12, 12],
                "contact__method": "full",
                "contact__accuracy": 1,
                "load_path": LEGS,
            },
        ),
    ],
    ids=["line", "area", "forces"],
)
def test_a_model_wears_as_its_case(tmp_path, name, changed):
    case = fretscale.load_case(CASES / f"{name}.yaml", **QUICK, **changed)
    written = fretscale.run(case, tmp_path / "out", quiet=True)
    results = wear_model(case).run()["interface"]
    kinetics = written.summary["kinetics"]["interface"]
    for body in (1, 2):
        for quantity, stored in (("largest_depth", "depth"), ("volume", "volume")):
            assert results[f"{quantity}_{body}"].values.tolist() == kinetics[f"{stored}_{body}"]
    surfaces = written["surfaces/interface"].xarray()["body_1"]
    np.testing.assert_array_equal(results["depth_1"].values, -surfaces.values)


def test_a_model_built_in_python_wears_as_the_one_of_a_case():
    case = fretscale.load_case(CASES / "cylinder_wear.yaml", **QUICK, contact__grid=64)
    from_case, path = wear_model(case), case.load_path
    loads = fretscale.LoadTable.stroke(path.P, path.stroke, path.increments)
    radius = case.structure.radius
    cylinder = fretscale.BodyPair(
        gap=lambda x, y: x**2 / (2.0 * radius),
        size=(case.contact.size, inf),
        loads=loads,
        tilt=path.tilt,
        line=True,
    )
    built = fretscale.WearModel(cylinder, from_case.contacts, from_case.wear)
    one, other = (model.run()["interface"]["depth_2"] for model in (from_case, built))
    np.testing.assert_array_equal(one.values, other.values)


def test_a_stroke_wears_by_the_energy_of_friction():
    """Each body loses V = α µ P 2 s N, whatever the shape and direction of the stroke."""
    for line, grid, direction in ((False, (24, 24), 0.5), (True, (48, 1), 0.0)):
        loads = fretscale.LoadTable.stroke(20.0, 0.02, increments=2, direction=direction)
        worn = run(bodies(loads, line=line), contact(grid))
        volume = 1e-8 * 0.6 * 20.0 * 0.04 * 1000.0
        assert worn["volume_1"].values[-1] == pytest.approx(volume, rel=1e-9)


def test_friction_at_the_start_is_that_of_no_energy():
    """A table of friction that begins at a factor of 2 doubles the energy of the first cycle."""
    from wear import EnergyTable

    loads = fretscale.LoadTable.stroke(20.0, 0.02, increments=2)
    doubled = fretscale.CoulombFriction(0.3, EnergyTable((0.0, 1e9), (2.0, 2.0)))
    other = fretscale.Contact((48, 1), (TITANIUM, TITANIUM), (LAW, LAW), friction=doubled)
    model = bodies(loads, line=True)
    (one,), (two,) = (model.source(of).unworn() for of in (contact((48, 1)), other))
    np.testing.assert_array_equal(one.loads.Edx, two.loads.Edx)


def test_legs_begin_where_the_last_one_ends_or_at_nothing():
    targets, increments = {"P": (50.0, None), "Qx": (10.0, -10.0), "Qy": (None, None)}, (1, 2)
    closed = fretscale.LoadTable.legs(targets, increments)
    assert closed.columns.keys() == {"P", "Qx"}
    np.testing.assert_allclose(closed["Qx"], [10.0, 0.0, -10.0])
    np.testing.assert_allclose(closed["P"], 50.0)
    first = fretscale.LoadTable.legs(targets, (2, 2), closed=False)
    np.testing.assert_allclose(first["P"], [25.0, 50.0, 50.0, 50.0])


def test_split_increments_pass_through_the_same_loads():
    loads = fretscale.LoadTable.legs({"P": (50.0,), "Qx": (10.0,)}, (2,))
    split = loads.in_parts(3)
    for name in ("P", "Qx"):
        np.testing.assert_allclose(split[name][2::3], loads[name])


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"P": [1.0], "Q": [1.0]}, "loads Q are unknown"),
        ({"P": [1.0], "Qx": [1.0, 2.0]}, "differ in length"),
        ({"P": [1.0], "approach": [1.0]}, "given together with P"),
        ({"shift_x": [1.0]}, "neither P nor approach"),
    ],
)
def test_loads_that_make_no_sense_are_refused(columns, words):
    with pytest.raises(InputError, match=words):
        bodies(fretscale.LoadTable(columns))


def test_legs_of_another_number_are_refused():
    with pytest.raises(InputError, match="2 legs"):
        fretscale.LoadTable.legs({"P": (1.0,)}, (1, 1))


def test_forces_without_a_motion_take_the_full_method():
    loads = fretscale.LoadTable({"P": [20.0, 20.0], "Qx": [5.0, -5.0]})
    with pytest.raises(InputError, match="has Qx: give method full"):
        run(bodies(loads))


@pytest.mark.parametrize("gap", [lambda x, y: x.ravel() ** 2 / 20.0, lambda x, y: y.ravel()])
def test_gaps_in_a_row_are_refused(gap):
    """On a square grid those along x would be spread along y."""
    with pytest.raises(InputError, match="the gap has shape"):
        fretscale.WearModel(
            replace(bodies(STROKE), gap=gap), contact(), fretscale.Wear(cycles=10.0)
        ).run()


@pytest.mark.parametrize(
    "loads", [{"P": [0.0, 0.0], "shift_x": [0.01, -0.01]}, {"approach": [-0.01] * 2}]
)
def test_bodies_that_never_touch_are_warned_of(loads):
    table = fretscale.LoadTable({"shift_x": [0.01, -0.01]} | loads)
    model = fretscale.WearModel(bodies(table), contact(), fretscale.Wear(cycles=10.0))
    with pytest.warns(fretscale.ModelWarning, match="never closed"):
        assert model.run()["interface"]["volume_1"].values[-1] == 0.0


def creeping(increments):
    """Return a cylinder under a cycle whose slip creeps while normal and shear force grow."""
    loads = fretscale.LoadTable.legs({"P": (80.0, 40.0), "Qx": (20.0, 0.0)}, (increments,) * 2)
    of = replace(contact((24, 1), method="full"), friction=0.4)
    return replace(bodies(loads, line=True), size=(0.4, 0.4)), of


def test_increments_that_are_too_long_for_friction_are_warned_of():
    with pytest.warns(fretscale.ModelWarning, match=WarningKind.LONG_INCREMENTS.code):
        run(*creeping(1))


def test_turning_points_suffice_for_similar_bodies_under_constant_pressure():
    """They are exact in plane strain, so that nothing is warned of."""
    swing = fretscale.LoadTable.legs({"P": (50.0, 50.0), "Qx": (20.0, -20.0)}, (1, 1))
    with warnings.catch_warnings():
        warnings.simplefilter("error", fretscale.ModelWarning)
        run(bodies(swing, line=True), contact((96, 1), method="full"))


@pytest.mark.parametrize("line", [False, True], ids=["area", "line"])
def test_a_tangential_force_above_friction_is_refused_by_its_code(line):
    beyond = 1.001 * 0.6 * 50.0
    loads = fretscale.LoadTable.legs({"P": (50.0, 50.0), "Qx": (beyond, -beyond)}, (1, 1))
    with pytest.raises(fretscale.FretscaleError) as refused:
        run(bodies(loads, line=line), contact((24, 1 if line else 24), method="full"))
    assert error_kind(refused.value) is ErrorKind.NO_SOLUTION


def test_a_contact_on_a_single_point_is_refused_by_its_code():
    with pytest.raises(InputError) as refused:
        run(bodies(STROKE), contact((4, 4)))
    assert error_kind(refused.value) is ErrorKind.TOO_COARSE
