"""What public functions of joints are given: arrays of any kind, and what is no number."""

import numpy as np
import pytest

from sa_solver import InputError
from tests.given import NO_NUMBERS, assert_refused, held_otherwise, spoilt
from wear.joints import (
    ArrheniusEvolution,
    BoucWen,
    ElasticStop,
    ExponentialEvolution,
    FourParameterIwan,
    FrictionContact,
    Jenkins,
    JointEvolution,
    JointGroup,
    LinearEvolution,
    LogarithmicEvolution,
    MixedLaw,
    ParallelSliders,
    PeriodicMarch,
    PolynomialSpring,
    TabulatedEvolution,
    UniformIwan,
    long_test,
    march_joints,
    measure_loops,
    steady_stroke,
)

LOADS = np.array([40.0, 100.0])
PATH = 0.03 * np.sin(2.0 * np.pi * np.arange(401) / 160)
SLIDER = Jenkins(stiffness=1e4, friction=0.5, normal_load=100.0)
FORCE = march_joints(SLIDER, SLIDER.rest(1), np.zeros((1, 1)), PATH[:, None, None]).force.ravel()
TIMES = 2.0 * np.pi * np.arange(64) / 64
BASIS = np.stack([np.cos(TIMES), np.sin(TIMES)], axis=1)
COEFFICIENTS = np.array([[[0.02], [0.01]], [[0.01], [0.03]]])
STEPS = 0.01 * np.array([[[1.0], [2.0]], [[-1.0], [-3.0]]])
ENERGIES = np.array([1.0, 2e3, 3e6])
RISING = LogarithmicEvolution(0.1, 1.0)
TEST = long_test(lambda energy: 1.0 + energy / 1e7, cycles=3e6)


def marched(law, joints=2):
    path = np.repeat(STEPS, law.directions, axis=2)
    return march_joints(law, law.rest(joints), np.zeros((joints, law.directions)), path).force


def settled(law, coefficients=COEFFICIENTS, basis=BASIS, weights=BASIS.T / 32.0):
    return PeriodicMarch(law).settle(coefficients, basis, weights).force


# Of each entry a good field, and the numbers that it makes of it.
ENTRIES = {
    "slider": (LOADS, lambda load: marched(Jenkins(1e4, 0.5, load))),
    "curve": (LOADS, lambda load: marched(BoucWen(1e4, 0.5, load))),
    "spread": (LOADS, lambda load: marched(UniformIwan(1e4, 0.5, load))),
    "power": (LOADS, lambda load: marched(FourParameterIwan(1e4, 0.5, load))),
    "contact": (LOADS, lambda load: marched(FrictionContact(1e4, 2e4, 0.5, load))),
    "spring": (LOADS, lambda k: marched(PolynomialSpring(k))),
    "stop": (1e-4 * LOADS, lambda gap: marched(ElasticStop(1e4, gap))),
    "worn": (1e-5 * LOADS, lambda d: marched(FrictionContact(1e4, 2e4, 0.5, 100.0).worn(d))),
    "several": (LOADS, lambda load: marched(MixedLaw([JointGroup(Jenkins(1e4, 0.5, load), 2)]))),
    "path": (STEPS, lambda u: march_joints(SLIDER, SLIDER.rest(2), np.zeros((2, 1)), u).dissipated),
    "begin": (STEPS[0], lambda u: march_joints(SLIDER, SLIDER.rest(2), u, STEPS).force),
    "increment": (STEPS[0], lambda u: SLIDER.respond(SLIDER.rest(2), u).force),
    "state": (
        np.array([[0.01, 0.002], [0.02, 0.001]]),
        lambda s: BoucWen(1e4, 0.5, 100.0).respond(s, STEPS[0]).force,
    ),
    "group": (
        STEPS[0],
        lambda u: MixedLaw((JointGroup(SLIDER, 2),)).respond(SLIDER.rest(2), u).force,
    ),
    "coefficients": (COEFFICIENTS, lambda c: settled(SLIDER, c)),
    "basis": (BASIS, lambda basis: settled(SLIDER, basis=basis)),
    "weights": (BASIS.T / 32.0, lambda weights: settled(SLIDER, weights=weights)),
    "contacts": (
        np.repeat(COEFFICIENTS, 3, axis=2),
        lambda c: settled(FrictionContact(1e4, 2e4, 0.5, 100.0), c),
    ),
    "parallel": (
        COEFFICIENTS[:1],
        lambda c: (
            ParallelSliders(Jenkins(1e4, 0.5, LOADS)).settle(c, BASIS, BASIS.T / 32.0).by_slider
        ),
    ),
    "mixed": (
        COEFFICIENTS,
        lambda c: MixedLaw((JointGroup(SLIDER, 2),)).march().settle(c, BASIS, BASIS.T / 32.0).force,
    ),
    "loops": (PATH, lambda u: measure_loops(u, FORCE, 100.0).energy),
    "forces": (FORCE, lambda f: measure_loops(PATH, f, 100.0).energy),
    "loads": (100.0 + 0.0 * PATH, lambda load: measure_loops(PATH, FORCE, load).friction),
    "amplitude": (1e-3 * LOADS, lambda a: SLIDER.loop_energy(a)),
    "smooth amplitude": (1e-3 * LOADS, lambda a: BoucWen(1e4, 0.5, 100.0).loop_energy(a)),
    "spread amplitude": (1e-3 * LOADS, lambda a: UniformIwan(1e4, 0.5, 100.0).loop_energy(a)),
    "harmonic": (1e-3 * LOADS, lambda a: SLIDER.first_harmonic(a)[1]),
    "logarithm": (ENERGIES, RISING),
    "late": (ENERGIES, ArrheniusEvolution(0.1, 1e3)),
    "line": (ENERGIES, LinearEvolution(1e-7)),
    "exponential": (ENERGIES, ExponentialEvolution(0.5, -1e-6)),
    "table": (ENERGIES, TabulatedEvolution((0.0, 1e6), (0.5, 0.7))),
    "places of a table": (ENERGIES, lambda e: TabulatedEvolution(e, (1.0, 2.0, 3.0))(2e6)),
    "evolution": (ENERGIES, lambda e: JointEvolution(friction=RISING).at(SLIDER, e).friction),
    "cycles": (ENERGIES, TEST.energy_at),
    "energies": (ENERGIES, TEST.cycles_at),
    "breaks": (ENERGIES, lambda b: long_test(lambda e: 1.0, 100.0, breaks=b).energy),
}
# Whose shape is anybody's choice, or both of whose directions may be exchanged.
ANY_SHAPE = {
    *("amplitude", "smooth amplitude", "spread amplitude", "harmonic", "logarithm", "late"),
    *("line", "exponential", "table", "evolution", "cycles", "energies", "breaks"),
}
EVERY = pytest.mark.parametrize("entry", ENTRIES)


@EVERY
def test_numbers_count_and_not_how_they_are_held(entry):
    """Lists, single precision, columns first, every second of an array twice as long."""
    field, made = ENTRIES[entry]
    field = field.astype(np.float32).astype(np.float64)
    expected = made(field)
    for given in held_otherwise(field):
        found = made(given)
        assert type(found) is np.ndarray
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("entry", ["slider", "spread", "contact", "logarithm", "energies"])
def test_whole_numbers_are_numbers(entry):
    field, made = ENTRIES[entry]
    np.testing.assert_array_equal(made(field.astype(int)), made(field))
    assert marched(Jenkins(10000, 1, 50)).tolist() == marched(Jenkins(1e4, 1.0, 50.0)).tolist()


@EVERY
@pytest.mark.parametrize("kind", ["complex", "text", "flags", "none", "masked", "missing", "deep"])
def test_what_is_no_field_of_numbers_is_refused(entry, kind):
    field, made = ENTRIES[entry]
    if (kind == "none" and entry == "loads") or (kind == "deep" and entry in ANY_SHAPE):
        return
    if kind == "missing" and entry in ("increment", "state", "group", "coefficients", "contacts"):
        return  # those of an iteration, which looks at them itself
    if kind == "missing" and entry in ("parallel", "mixed", "basis", "weights"):
        return
    given = spoilt(field, kind)
    with pytest.raises(InputError):
        made(given)


@pytest.mark.parametrize("value", [*NO_NUMBERS, None])
def test_what_is_no_number_is_refused(value):
    attempts = (
        lambda: Jenkins(value, 0.5, 100.0),
        lambda: BoucWen(1e4, 0.5, 100.0, sigma=value),
        lambda: FourParameterIwan(1e4, 0.5, 100.0, chi=value),
        lambda: FrictionContact(1e4, 2e4, value),
        lambda: PolynomialSpring(1e4, cubic=value),
        lambda: ElasticStop(value),
        lambda: steady_stroke(SLIDER, JointEvolution(), value),
        lambda: long_test(lambda energy: 1.0, value),
        lambda: long_test(lambda energy: 1.0, 10.0, tolerance=value),
        lambda: long_test(lambda energy: 1.0, 10.0, start=value),
        lambda: JointGroup(SLIDER, value),
        lambda: PeriodicMarch(SLIDER, threads=value),
    )
    assert_refused(InputError, attempts)


@pytest.mark.parametrize(
    "attempt",
    [
        lambda: FrictionContact(LOADS, 2e4, 0.5, np.ones(3)),  # of two joints and of three
        lambda: Jenkins(1e4, 0.5, [[100.0]]),
        lambda: SLIDER.loop_energy(-0.01),
        lambda: UniformIwan(1e4, 0.5, 100.0).loop_energy(-0.01),
        lambda: steady_stroke(SLIDER, JointEvolution(), -0.01),
        lambda: SLIDER.respond(np.zeros((1, 1)), np.zeros((1, 1))),
        lambda: SLIDER.respond(np.zeros((2, 2)), np.zeros((1, 2))),  # exchanged
        lambda: march_joints(SLIDER, SLIDER.rest(2), STEPS, np.zeros((2, 1))),
        lambda: RISING(-1.0),
        lambda: LinearEvolution(1e-7)(-1.0),
        lambda: TabulatedEvolution((1e6, 0.0), (0.7, 0.5)),
        lambda: ExponentialEvolution(np.nan, -1e-6),
        lambda: JointEvolution(friction=0.5),
        lambda: MixedLaw(()),
        lambda: MixedLaw((SLIDER,)),
        lambda: JointGroup(SLIDER, 0),
        lambda: long_test(lambda energy: 1.0, "10"),
        lambda: TEST.energy_at(np.nan),
        lambda: measure_loops(PATH, FORCE, 100.0, time=PATH),
    ],
)
def test_what_has_no_meaning_is_refused(attempt):
    with pytest.raises(InputError):
        attempt()


@pytest.mark.parametrize("law", [SLIDER, BoucWen(1e4, 0.5, 100.0), UniformIwan(1e4, 0.5, 100.0)])
def test_a_period_of_no_joints_is_refused(law):
    """The compiled marches read the first joint, of which there is none."""
    with pytest.raises(InputError, match="no joints"):
        PeriodicMarch(law).settle(np.zeros((0, 2, 1)), BASIS, BASIS.T / 32)
