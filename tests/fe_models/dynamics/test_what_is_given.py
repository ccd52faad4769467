"""What public functions of vibrating structures are given: arrays of any kind, and what is none."""

import numpy as np
import pytest

from fe_models.dynamics import (
    Accuracy,
    CombinedForces,
    ConstantForce,
    ContinuationControl,
    DynamicModel,
    Floquet,
    HammerBlow,
    HarmonicBalance,
    HarmonicForce,
    LinearMode,
    Link,
    PeriodicLoad,
    RecordedForce,
    Resolution,
    TimeStepControl,
    along_force,
    along_frequency,
    along_nonlinear_mode,
    along_phase_resonance,
    damped,
    frequency_response,
    integrate,
    lumped_rig,
    motions_at,
    natural_frequencies,
    reduced_rig,
    ring_down,
    unit_force,
)
from fe_models.dynamics.damping import rayleigh_factors
from fe_models.dynamics.motion import Start
from sa_solver import InputError
from tests.given import NO_NUMBERS, assert_refused, held_otherwise, spoilt
from wear.joints import Jenkins, PeriodicMarch

MASSES = {"a": 0.5, "b": 1.0}
SPRINGS = {Link("a"): 1024.0, Link("b", "a"): 512.0}
RIG = lumped_rig(MASSES, SPRINGS, [[Link("b")]], damping_ratio=0.0625)
JOINT = PeriodicMarch(Jenkins(stiffness=64.0, friction=0.5, normal_load=2.0))
FORCE = np.array([0.5, 1.0])
STEP = 2.0**-9
TIMES = STEP * np.arange(1024)
BLOW = HammerBlow(unit_force(RIG, "a"), peak=1.0, duration=8 * STEP)
STRUCK = integrate(RIG, None, BLOW, TIMES[-1], TimeStepControl(STEP))
STRIKE = np.asarray(BLOW.value(STRUCK.times), dtype=np.float32).astype(float)
RECORD = STRUCK.displacement[:, 0]
DECAY = np.exp(-0.5 * TIMES) * np.cos(2.0 * np.pi * 32.0 * TIMES)


def problem(load=None, resolution=None, model=RIG):
    load = load or PeriodicLoad({1: -1j * FORCE})
    return HarmonicBalance(model, JOINT, load, resolution or Resolution((0, 1, 3), 64))


def vibration(load):
    return np.abs(problem(load).solve(3.0, 1.0).motion)


def vibration_of(given):
    return np.abs(problem(model=given).solve(3.0, 1.0).motion)


def model(**more):
    return DynamicModel(
        **({n: getattr(RIG, n) for n in ("mass", "damping", "stiffness", "connection")} | more),
        names=("a", "b"),
    )


def moved(excitation=None, start=None):
    return integrate(RIG, None, excitation, 32 * STEP, TimeStepControl(STEP), start).displacement


# Of each entry a good field, and the numbers that it makes of it.
ENTRIES = {
    "mass": (RIG.mass, lambda m: natural_frequencies(model(mass=m))),
    "stiffness": (RIG.stiffness, lambda k: natural_frequencies(model(stiffness=k))),
    "damping": (RIG.damping, lambda c: vibration_of(model(damping=c))),
    "structural": (0.125 * RIG.stiffness, lambda d: vibration_of(model(structural=d))),
    "connection": (RIG.connection, lambda b: natural_frequencies(model(connection=b), 64.0)),
    "ratios": (
        np.array([0.0625, 0.125]),
        lambda r: lumped_rig(MASSES, SPRINGS, [[Link("b")]], damping_ratio=r).damping,
    ),
    "joint stiffness": (np.array([64.0]), lambda k: natural_frequencies(RIG, k)),
    "constant": (FORCE, lambda f: moved(ConstantForce(f))),
    "harmonic": (FORCE, lambda f: moved(HarmonicForce(f, 1.0, 8.0))),
    "blow": (FORCE, lambda f: moved(HammerBlow(f, 1.0, 16 * STEP))),
    "recorded": (
        np.array([0.5, 1.0, 0.25]),
        lambda f: moved(RecordedForce(FORCE, [0.0, 8 * STEP, 16 * STEP], f)),
    ),
    "times of a record": (
        STEP * np.array([0.0, 8.0, 16.0]),
        lambda t: moved(RecordedForce(FORCE, t, [0.5, 1.0, 0.25])),
    ),
    "times": (TIMES, lambda t: HarmonicForce(FORCE, 1.0, 8.0)(t)),
    "sum": (TIMES, lambda t: CombinedForces([ConstantForce(FORCE), BLOW])(t)),
    "displacement": (FORCE, lambda u: moved(start=Start(displacement=u))),
    "velocity": (FORCE, lambda v: moved(start=Start(velocity=v))),
    "wave": (FORCE, lambda w: vibration(PeriodicLoad({1: w}))),
    "static": (FORCE, lambda s: vibration(PeriodicLoad({1: FORCE}, static=s))),
    "inertial": (FORCE, lambda w: vibration(PeriodicLoad({}, inertial={1: w}))),
    "strike": (STRIKE, lambda f: frequency_response(f, RECORD, STEP).frequency),
    "response": (RECORD, lambda r: np.abs(frequency_response(STRIKE, r, STEP).value)),
    "decay": (DECAY, lambda r: ring_down(r, STEP, (24.0, 40.0)).frequency),
    "frequencies": (
        np.array([8.0, 16.0]),
        lambda f: np.array(rayleigh_factors(f, [0.0625, 0.125])),
    ),
    "span": (np.array([2.0, 2.5]), lambda span: along_frequency(problem(), 1.0, span).frequencies),
    "output": (
        FORCE,
        lambda out: (
            along_phase_resonance(problem(), problem().solve(6.0, 1.0), (0.9, 1.1), out).forces
        ),
    ),
}
EVERY = pytest.mark.parametrize("entry", ENTRIES)
ANY_SHAPE = {"joint stiffness", "times", "sum", "strike", "response"}


@EVERY
def test_numbers_count_and_not_how_they_are_held(entry):
    """Lists, single precision, columns first, every second of an array twice as long."""
    field, made = ENTRIES[entry]
    field = field.astype(np.float32).astype(np.float64)
    expected = made(field)
    for given in held_otherwise(field):
        found = made(given)
        assert type(found) is np.ndarray
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-12)


def test_whole_numbers_are_numbers():
    found, expected = (
        natural_frequencies(lumped_rig({"m": kind(2)}, {Link("m"): kind(8)}, []))
        for kind in (int, float)
    )
    np.testing.assert_array_equal(found, expected)
    for shape in (np.array([1, 2]), np.array([1.0, 2.0])):
        np.testing.assert_array_equal(moved(ConstantForce(shape)), moved(ConstantForce([1, 2])))


@EVERY
@pytest.mark.parametrize("kind", ["text", "flags", "masked", "missing", "deep", "turned"])
def test_what_is_no_field_of_numbers_is_refused(entry, kind):
    field, made = ENTRIES[entry]
    if (kind == "deep" and entry in ANY_SHAPE) or (kind == "turned" and entry != "connection"):
        return
    given = spoilt(field, kind)
    with pytest.raises(InputError):
        made(given)


@pytest.mark.parametrize("value", NO_NUMBERS)
def test_what_is_no_number_is_refused(value):
    attempts = (
        lambda: lumped_rig({"m": value}, {}, []),
        lambda: lumped_rig({"m": 1.0}, {Link("m"): value}, []),
        lambda: damped(RIG, mass_factor=value),
        lambda: damped(RIG, dashpots={Link("a"): value}),
        lambda: HarmonicForce(FORCE, value, 8.0),
        lambda: HarmonicForce(FORCE, 1.0, value),
        lambda: HammerBlow(FORCE, value, 1.0),
        lambda: HammerBlow(FORCE, 1.0, value),
        lambda: TimeStepControl(value),
        lambda: TimeStepControl(STEP, tolerance=value),
        lambda: TimeStepControl(STEP, every=value),
        lambda: integrate(RIG, None, None, value, TimeStepControl(STEP)),
        lambda: Resolution((1,), value),
        lambda: Resolution((value,), 64),
        lambda: problem().solve(value, 1.0),
        lambda: problem().solve(3.0, value),
        lambda: along_frequency(problem(), value, (2.0, 3.0)),
        lambda: along_force(problem(), value, (1.0, 2.0)),
        lambda: ContinuationControl(first=value),
        lambda: ContinuationControl(max_points=value),
        lambda: Accuracy(value),
        lambda: Accuracy(1e-3, highest=value),
        lambda: LinearMode.of(problem(), value),
        lambda: Floquet(problem(), most_modes=value),
        lambda: frequency_response(STRIKE, RECORD, value),
        lambda: ring_down(DECAY, value, (24.0, 40.0)),
        lambda: motions_at(along_frequency(problem(), 1.0, (2.0, 2.1)), value),
    )
    assert_refused(InputError, attempts)


@pytest.mark.parametrize(
    "attempt",
    [
        lambda: model(mass=np.eye(3)),
        lambda: model(connection=np.eye(3)),
        lambda: natural_frequencies(RIG, [64.0, 64.0]),
        lambda: natural_frequencies(RIG, np.eye(2)),
        lambda: unit_force(RIG, "c"),
        lambda: problem(PeriodicLoad({1: np.ones(3)})).solve(3.0, 1.0),
        lambda: PeriodicLoad({1.5: FORCE}),
        lambda: problem(resolution=Resolution((3, 1), 64)),
        lambda: moved(ConstantForce(np.ones(3))),
        lambda: moved(lambda times: 0.0 * times),
        lambda: moved(start=Start(displacement=np.ones(3))),
        lambda: RecordedForce(FORCE, [0.0, 2.0, 1.0], [1.0, 2.0, 3.0]),
        lambda: CombinedForces(()),
        lambda: CombinedForces((ConstantForce(FORCE), ConstantForce(np.ones(3))))(TIMES),
        lambda: ContinuationControl(least=-1.0),
        lambda: along_frequency(problem(), 1.0, (3.0, 2.0)),
        lambda: along_frequency(problem(), 1.0, 3.0),
        lambda: along_nonlinear_mode(problem(), LinearMode.of(problem(), 1), (0.2, 0.1)),
        lambda: along_nonlinear_mode(problem(), LinearMode.of(problem(), 1), 0.1),
        lambda: rayleigh_factors([8.0, 8.0], [0.1, 0.2]),
        lambda: frequency_response(STRIKE, RECORD, STEP, "mobilty"),
        lambda: frequency_response(STRIKE[1:], RECORD, STEP),
        lambda: ring_down(DECAY, STEP, (40.0, 24.0)),
        lambda: ring_down(DECAY, STEP, 32.0),
        lambda: reduced_rig(RIG, ("a", "b"), []),
    ],
)
def test_what_has_no_meaning_is_refused(attempt):
    with pytest.raises(InputError):
        attempt()
