"""The friction rig solved by pyHarm (``pyharm-os`` on PyPI), in an interpreter that has it.

A problem is read as JSON and the result is written as JSON; see ``test_vibration_speed.py``. All
settings are pyHarm's defaults except the longest step, and units in which its unknowns are of the
order of 1: a micrometre and 100 Hz. Its other solver, Newton-Raphson, takes longer.
"""

from __future__ import annotations

import json
import logging
import sys
import time
import warnings

import numpy as np

logging.disable(logging.CRITICAL)
warnings.simplefilter("ignore")

from pyHarm.Maestro import Maestro  # noqa: E402

LENGTH, FREQUENCY = 1e-3, 100.0  # mm, Hz


def described(problem: dict) -> dict:
    """Return pyHarm's input."""
    low, high = (2.0 * np.pi * frequency for frequency in problem["frequencies"])
    matrices = {name: np.array(problem[name]) for name in "MCK"}
    return {
        "analysis": {
            "response": {
                "study": "frf",
                "puls_inf": low,
                "puls_sup": high,
                "ds0": problem["step"],
                "ds_max": problem["step"],
                "verbose": False,
            }
        },
        "system": {
            "type": "Base",
            "nh": problem["harmonics"],
            "nti": problem["samples"],
            "adim": {"status": True, "lc": LENGTH, "wc": 2.0 * np.pi * FREQUENCY},
        },
        "substructures": {
            "rig": {"matrix": {**matrices, "G": np.zeros_like(matrices["M"])}, "ndofs": 1}
        },
        "connectors": {
            "force": {
                "type": "SinusForcing",
                "connect": {"rig": [0]},
                "dirs": [0],
                "amp": problem["force"],
            },
            "joint": {
                "type": "Jenkins",
                "connect": {"rig": [1], "GROUND": [0]},
                "dirs": [0],
                "mu": problem["friction"],
                "N0": problem["normal_load"],
                "k": problem["stiffness"],
            },
        },
    }


def followed(problem: dict) -> tuple[np.ndarray, float]:
    """Return unknowns of the accepted points ``(s, n + 1)``, and the processor seconds."""
    work = Maestro(described(problem))
    begin = time.process_time()
    work.operate()
    seconds = time.process_time() - begin
    (analysis,) = work.nls.values()
    return np.array([point.x for point in analysis.SolList if point.flag_accepted]), seconds


def main() -> None:
    problem = json.load(sys.stdin)
    followed(problem)  # Compiles.
    runs = [followed(problem) for _ in range(problem["tries"])]
    points = runs[0][0]
    # Unknowns are cosines of both masses, then their sines, harmonic by harmonic.
    amplitudes = LENGTH * (points[:, [0, 1]] - 1j * points[:, [2, 3]])
    answer = {
        "seconds": min(seconds for _, seconds in runs),
        "frequency": (FREQUENCY * points[:, -1]).tolist(),
        "real": amplitudes.real.tolist(),
        "imag": amplitudes.imag.tolist(),
    }
    print(json.dumps(answer))


main()
