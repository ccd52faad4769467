"""Benchmark of harmonic balance: a response point, a contact node, and a whole response.

The rig, with its 121 contacts, is also solved by pyHarm, a Python package for the same task, in a
separate environment that `make bench` installs: the same equations, so the same motions, with about
as many points. Times are processor time in one thread, the best of several tries on a shared
machine.
"""

from __future__ import annotations

import json
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fe_models.dynamics.curves.curve_steps import ContinuationControl
from fe_models.dynamics.curves.forced_response import ResponseBranch, along_frequency
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.periodic.load import PeriodicLoad
from fe_models.dynamics.rig import unit_force
from sa_solver.types import Array
from tests.oracles.two_mass_rig import two_mass_rig
from wear.joints.friction_contact import FrictionContact
from wear.joints.jenkins import Jenkins
from wear.joints.periodic.march import PeriodicMarch
from workflow.analyses.vibration.case.vibration_case import VibrationCase
from workflow.analyses.vibration.model import vibration_model
from workflow.kinds import load_case
from workflow.shell.terminal.reporter import Reporter

HERE = Path(__file__).parent
PYHARM = HERE.parents[1] / ".venv" / "pyharm"
INSTALLED = PYHARM / ".installed"  # what the Makefile leaves when it is
TRIES = 5
# Allowed: ms per point, µs per node, and seconds of a response of 121 contacts by the number of its
# odd harmonics.
POINT, NODE = 1.0, 500.0
RESPONSE = {5: 300.0, 15: 1800.0}
# Of that response [N, Hz].
CONTACTS_FORCE, CONTACTS_SPAN = 10.0, (50.0, 500.0)
SLIDING_FORCE, SLIDING_SPAN = 90.0, (20.0, 500.0)
# The rig of the thesis, [t, N/mm], and its joint.
MODEL = two_mass_rig((21.152e-3, 1.189e-3), (1.3469e3, 273e3), 0.001)
KT, MU, LOAD = 45e3, 0.88, 60.0
FORCE, SPAN = 30.0, (20.0, 400.0)
ODD, SAMPLES = tuple(range(1, 16, 2)), 256
STEPS = ContinuationControl(most=0.1)
# pyHarm's longest step that makes about as many points, in its own units.
PYHARM_STEP = 0.07
# Both solve the same equations: pyHarm to 1.5e-8 of its unknowns, of the largest motion.
AGREEMENT = 1e-7


def least_seconds(action: Callable[[], object]) -> float:
    times = []
    for _ in range(TRIES):
        begin = time.process_time()
        action()
        times.append(time.process_time() - begin)
    return min(times)


@pytest.fixture(scope="module")
def problem() -> HarmonicBalance:
    return HarmonicBalance(
        MODEL,
        PeriodicMarch(Jenkins(KT, MU, LOAD)),
        PeriodicLoad({1: -1j * unit_force(MODEL, "m1")}),
        Resolution(ODD, SAMPLES),
    )


def response(problem: HarmonicBalance) -> ResponseBranch:
    return along_frequency(problem, FORCE, SPAN, control=STEPS)


def milliseconds_per_point(problem: HarmonicBalance) -> float:
    return 1e3 * least_seconds(lambda: response(problem)) / len(response(problem).solutions)


def test_point_of_the_rig(problem: HarmonicBalance, record: dict[str, float]) -> None:
    """Two masses, a slider, 8 odd harmonics, 256 samples, from 20 to 400 Hz under 30 N."""
    branch = response(problem)
    assert branch.message == ""
    each = milliseconds_per_point(problem)
    record["rig, 8 harmonics: ms per point"] = each
    record["rig, 8 harmonics: iterations per point"] = float(
        np.mean([solution.iterations for solution in branch.solutions])
    )
    assert each <= POINT


@pytest.mark.parametrize(
    ("name", "load", "gap"), [("stuck", 500.0, 0.0), ("slipping", 0.5, 0.0), ("gap", 0.0, 1e-3)]
)
def test_node_of_a_contact(name: str, load: float, gap: float, record: dict[str, float]) -> None:
    """Force and Jacobian of 121 contacts, harmonic 0 and 15 odd ones, 256 samples."""
    resolution = Resolution((0, *range(1, 30, 2)), 256)
    motion = np.random.default_rng(1).standard_normal((121, resolution.size, 3))
    motion *= 2e-3 / (1.0 + np.arange(resolution.size)[None, :, None]) ** 2
    motion[:, 0, 2] += 1e-3
    march = PeriodicMarch(FrictionContact(372.0, 483.0, 0.88, load, gap))

    def settle() -> object:
        return march.settle(motion, resolution.basis, resolution.weights, resolution.lead)

    settle()
    each = 1e6 * least_seconds(settle) / len(motion)
    record[f"contact, {name}, 15 harmonics: us per node"] = each
    assert each <= NODE


@pytest.fixture(scope="module")
def contacts(tmp_path_factory: pytest.TempPathFactory) -> HarmonicBalance:
    case = load_case(HERE.parents[1] / "cases" / "rig_harmonic_balance.yaml")
    assert isinstance(case, VibrationCase)
    reporter = Reporter(tmp_path_factory.mktemp("bench") / "run.log")
    return vibration_model(case, reporter).structure.problem


@pytest.mark.slow
@pytest.mark.parametrize("odd", [5, 15])
def test_response_of_the_contacts(
    odd: int, contacts: HarmonicBalance, record: dict[str, float]
) -> None:
    """Two reduced specimens have 121 contacts with gaps, preload, harmonic 0 and odd ones."""
    problem = contacts.with_resolution(Resolution((0, *range(1, 2 * odd, 2)), SAMPLES))
    begin = time.perf_counter()
    branch = along_frequency(problem, CONTACTS_FORCE, CONTACTS_SPAN, control=STEPS)
    seconds = time.perf_counter() - begin
    assert branch.message == ""
    record[f"121 contacts, {odd} odd harmonics: seconds of a response"] = seconds
    record[f"121 contacts, {odd} odd harmonics: points"] = len(branch.solutions)
    assert seconds <= RESPONSE[odd]


@pytest.mark.slow
def test_response_of_sliding_contacts(contacts: HarmonicBalance, record: dict[str, float]) -> None:
    """The same response is solved under a force that slides all contacts, past 39 Hz."""
    problem = contacts.with_resolution(Resolution((0, *range(1, 10, 2)), SAMPLES))
    begin = time.process_time()
    branch = along_frequency(problem, SLIDING_FORCE, SLIDING_SPAN, control=STEPS)
    seconds = time.process_time() - begin
    assert branch.message == ""
    record["121 contacts, sliding: processor seconds of a response"] = seconds
    record["121 contacts, sliding: points"] = len(branch.solutions)
    assert seconds <= RESPONSE[5]


def by_pyharm(folder: Path) -> dict[str, Any]:
    """Solve by pyHarm, which writes its settings into its working folder ``folder``."""
    if not INSTALLED.exists():
        pytest.skip("no pyHarm in .venv/pyharm: `make bench` installs it")
    asked = {
        "M": MODEL.mass.tolist(),
        "C": MODEL.damping.tolist(),
        "K": MODEL.stiffness.tolist(),
        "force": FORCE,
        "frequencies": SPAN,
        "harmonics": ODD,
        "samples": SAMPLES,
        "step": PYHARM_STEP,
        "friction": MU,
        "normal_load": LOAD,
        "stiffness": KT,
        "tries": TRIES,
    }
    done = subprocess.run(
        [PYHARM / "bin" / "python", HERE / "pyharm_rig.py"],
        input=json.dumps(asked),
        capture_output=True,
        text=True,
        check=True,
        cwd=folder,
    )
    answer: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return answer


def amplitudes_at(problem: HarmonicBalance, frequencies: Array) -> Array:
    """Return harmonic 1 of both masses at these frequencies ``(s, 2)``, from the closest motion."""
    branch, amplitudes = response(problem), []
    for frequency in frequencies:
        closest = int(np.argmin(abs(branch.frequencies - frequency)))
        motion = problem.solve(frequency, FORCE, branch.solutions[closest])
        assert motion.converged
        amplitudes.append(motion.motion[0])
    return np.array(amplitudes)


def test_rig_by_pyharm(problem: HarmonicBalance, record: dict[str, float], tmp_path: Path) -> None:
    """The same problem gives the same motions; the ratio of the times is recorded."""
    theirs = by_pyharm(tmp_path)
    frequencies = np.array(theirs["frequency"])
    inside = (frequencies >= SPAN[0]) & (frequencies <= SPAN[1])
    wanted = (np.array(theirs["real"]) + 1j * np.array(theirs["imag"]))[inside]
    amplitudes = amplitudes_at(problem, frequencies[inside])
    points = len(response(problem).solutions)
    assert abs(amplitudes - wanted).max() <= AGREEMENT * abs(amplitudes).max()
    assert 0.7 <= len(frequencies) / points <= 1.4
    each = 1e3 * theirs["seconds"] / len(frequencies)
    record["rig, 8 harmonics, pyHarm: ms per point"] = each
    record["rig, 8 harmonics: pyHarm's time over ours"] = each / milliseconds_per_point(problem)
    record["rig, 8 harmonics: pyHarm's points over ours"] = len(frequencies) / points
