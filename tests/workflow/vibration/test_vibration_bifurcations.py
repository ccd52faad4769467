"""Tests of bifurcations of cases from the command, against integration in time."""

import json
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.workflow.conftest import invoke

pytestmark = pytest.mark.slow

# A mass of 1 kg on a hardening spring, and a tuned absorber of a twentieth of it.
ABSORBER = """
title: A hardening mass with a tuned absorber
analysis: vibration
structure:
  kind: rig
  masses: [0.05 kg, 1 kg]
  springs: [0 N/mm, 45.3515 N/mm]
  damping_ratio: 0
  damping:
    dashpots:
      - {points: m2, coefficient: 10 N*s/m}
      - {points: m1, against: m2, coefficient: 4.7619 N*s/m}
joint: {law: polynomial_spring, stiffness: 1000 N/mm, cubic: 1e3 N/mm^3}
mass: 2
forces: [200 N]
frequencies: [120 Hz, 250 Hz]
resolution: {harmonics: 4, samples: 128}
output: {figures: false, paraview: false}
"""
# Driven at three times the frequency; the other force is of no account.
SUBHARMONIC = """
title: Motions of a third of the frequency of the force
analysis: vibration
structure: {kind: rig, masses: [1 kg], springs: [1000 N/mm], damping_ratio: 0.04}
joint: {law: polynomial_spring, stiffness: 0 N/mm, cubic: 1e3 N/mm^3}
excitation:
  levels: [1]
  forces:
    - {points: m1, amplitude: 5000 N, harmonic: 3}
    - {points: m1, amplitude: 1e-3 N}
frequencies: [120 Hz, 900 Hz]
resolution: {harmonics: 4, samples: 64}
further_branches:
  - {force: 1, frequency: 222 Hz, amplitude: 1.2 mm}
output: {figures: false, paraview: false}
"""


def run(tmp_path: Any, text: str) -> tuple[dict[str, Any], str]:
    path = tmp_path / "case.yaml"
    path.write_text(text, encoding="utf-8")
    result = invoke("run", path, "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    return json.loads((tmp_path / "out" / "summary.json").read_text()), result.output


def sizes_each_period(frequency: float) -> Any:
    """Return the motion of the mass with its absorber [mm], from rest, once a period.

    It covers the last 100 of 700 periods.
    """
    omega = 2.0 * np.pi * frequency

    def rates(time: float, y: Any) -> list[float]:
        between = 45.3515 * (y[0] - y[1]) + 4.7619e-3 * (y[2] - y[3])
        held = 1e3 * (y[1] + y[1] ** 3) + 1e-2 * y[3]
        pull = 200.0 * np.sin(omega * time) - held + between
        return [y[2], y[3], -between / 5e-5, pull / 1e-3]

    periods = 1.0 / frequency * np.arange(600, 701)
    ends = solve_ivp(rates, (0.0, periods[-1]), np.zeros(4), t_eval=periods, rtol=1e-7, atol=1e-9).y
    return np.hypot(ends[1], ends[3] / omega)


def test_motions_beyond_neimark_sacker_are_of_two_frequencies(tmp_path: Any) -> None:
    """The absorber and the mass exchange energy between two such points, and nowhere else."""
    (response,) = run(tmp_path, ABSORBER)[0]["responses"]
    found = response["bifurcations"]
    assert [each["kind"] for each in found] == ["neimark_sacker"] * 2
    assert [(each["unstable_before"], each["unstable_after"]) for each in found] == [(0, 2), (2, 0)]
    lower, upper = (each["frequency"] for each in found)
    assert all(each["multiplier"] == pytest.approx(1.0, abs=1e-6) for each in found)
    for frequency, modulated in (
        (0.985 * lower, False),
        (1.015 * lower, True),
        (0.985 * upper, True),
        (1.015 * upper, False),
    ):
        sizes = sizes_each_period(frequency)
        spread = np.ptp(sizes) / sizes.mean()
        assert spread > 0.1 if modulated else spread < 5e-3, (frequency, spread)


def test_closed_branches_are_found_from_a_start(tmp_path: Any) -> None:
    """The motion shifted by one, two or three periods of the force is another motion.

    The curve from the ends of the frequencies has too few harmonics where it folds, and reports
    this.
    """
    summary, reported = run(tmp_path, SUBHARMONIC)
    branches = summary["further_branches"]
    assert [branch["closed"] for branch in branches] == [True] * 3
    for branch in branches:
        kinds = {each["kind"] for each in branch["bifurcations"]}
        assert kinds == {"fold"}
        assert branch["lowest_frequency"] == pytest.approx(184.07, rel=1e-3)
        assert branch["highest_frequency"] == pytest.approx(412.5, rel=1e-3)
    assert "closed" in reported
    assert "the fold at 392.1 Hz is not one of the motion itself" in " ".join(reported.split())
