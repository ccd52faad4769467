"""Approximations of the motion of a rig: its step in time, its harmonics and their samples."""

from __future__ import annotations

from collections.abc import Iterator

from workflow.analyses.wear.approximations.approximation import Approximation, Rung, entry_at
from workflow.case.sections import Case

# Multiples of the time step.
TIME_STEPS = 4.0, 2.0, 1.0, 0.5, 0.25
# Numbers of odd harmonics of a forced response, and samples of a period for each of them.
ODD_HARMONICS, SAMPLES_PER_HARMONIC = (1, 2, 3, 5, 8, 15, 30), 32
SAMPLES = (32, 64, 128, 256, 512, 1024, 2048)


def _time_steps(case: Case) -> Iterator[Rung]:
    """Yield longer and shorter steps; the case refuses those that do not resolve the excitation."""
    for factor in TIME_STEPS:
        step = factor * entry_at(case, "integration.step")
        yield Rung(f"{1e6 * step:.3g} us", {"integration.step": step}, factor)


def _harmonics(case: Case) -> Iterator[Rung]:
    """Yield fewer and more odd harmonics, with enough samples for the highest."""
    for count in ODD_HARMONICS:
        fine = max(entry_at(case, "resolution.samples"), SAMPLES_PER_HARMONIC * count)
        name = "1 harmonic" if count == 1 else f"{count} odd harmonics"
        yield Rung(name, {"resolution": {"harmonics": count, "samples": fine}}, 1.0 / count)


def _samples(case: Case) -> Iterator[Rung]:
    """Yield fewer and more samples of the case's harmonics; the case refuses too few."""
    harmonics = list(entry_at(case, "resolution.harmonics"))
    for samples in SAMPLES:
        resolution = {"harmonics": harmonics, "samples": samples}
        yield Rung(f"{samples} samples", {"resolution": resolution}, 1.0 / samples)


OF_MOTION = (
    Approximation("step", "step of the motion in time", _time_steps, ("integration.step",), 2.0),
    Approximation(
        "harmonics", "odd harmonics of the motion", _harmonics, ("resolution.samples",), 2.0
    ),
    Approximation("samples", "samples of a period", _samples, ("resolution.harmonics",), 2.0),
)
