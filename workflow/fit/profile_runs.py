"""Runs of the tests of a fit, each in its folder, which an interrupted fit resumes."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sa_solver.types import Array
from workflow.analyses.wear.case.worn_bodies import WornByEnergy, WornByEnergyAmplitude
from workflow.analyses.wear.output.measures import PLAIN, interfaces, middle_profiles
from workflow.case.text.writing import scalar
from workflow.case.units import to_base
from workflow.errors import CaseError, MethodFailed, UserError
from workflow.fit.profile_schema import ProfileFit, ProfileMeasurement
from workflow.fit.schema import FitInput
from workflow.kinds import analysis_of
from workflow.runs.job import Finished, Job
from workflow.runs.jobs import run_jobs
from workflow.shell.terminal.reporter import Reporter, telling

Pair = tuple[float, float]
"""Wear coefficients of body 1 and body 2 [1/MPa]."""

WEAR, UNIT = "wear", "um^3/J"
# Digits of a coefficient in a run: far finer than any fit, and short enough for a folder name.
SIGNIFICANT = 5
# Overrides that switch off output of a run that no fit reads.
QUIET = ("output.paraview=false", "output.figures=false", "output.report=false")
# Largest difference, relative to the largest depth, of depths divided by coefficients for which
# both bodies still follow one law of the dissipated energy.
ALIKE = 1e-6
# Share of the cycles of a case that may be missing in its run.
WHOLE = 1e-6
# Digits of the hash that distinguishes runs with changed entries.
DIGITS = 8


@dataclass(frozen=True)
class RunScar:
    """Wear of a run along x ``(m,)`` [mm]: ``depth`` ``(m,)`` [mm] of both bodies together.

    ``coefficient`` [1/MPa] is the sum of the coefficients of both bodies, ``energy`` [N mm] the
    dissipated energy of the run, and ``warnings`` are those of the run.
    """

    coefficient: float
    x: Array
    depth: Array
    energy: float
    warnings: tuple[str, ...] = ()


class TestRuns:
    """Runs of the cases of the ``tests`` of a fit below a folder ``root``, each run only once.

    Raises CaseError for cases that cannot be used in a fit.
    """

    __test__ = False  # tells pytest that this is not a test

    def __init__(self, given: FitInput, file: ProfileFit, root: Path, reporter: Reporter) -> None:
        self._given, self._file, self._root, self._reporter = given, file, root, reporter
        self.tests = file.measurements
        self.cases = [self._case(k, test) for k, test in enumerate(self.tests)]
        self._numbers = {
            path: k for k, path in enumerate(dict.fromkeys(t.case for t in self.tests), 1)
        }
        self.made: set[str] = set()

    @property
    def count(self) -> int:
        """Number of different cases."""
        return len(self._numbers)

    def place(self, number: int, key: str) -> str:
        """Return file and line of an entry of a test, and its path."""
        where = self._given.source.where(("measurements", number, key))[1]
        return f"{where}: measurements.{number}.{key}"

    def own(self, number: int) -> Pair:
        """Return the coefficients in the case of a test."""
        wear = self.cases[number].wear
        return wear.body_1.coefficient, wear.body_2.coefficient

    def scars(
        self, wanted: Sequence[Pair], finer: Mapping[str, Any] | None = None, alike: bool = True
    ) -> list[RunScar]:
        """Return the scar of each test with coefficients ``wanted`` and entries ``finer``.

        If ``alike``, the depths of both bodies must be in proportion to their coefficients. Raises
        MethodFailed for a run that fails.
        """
        jobs = [self._job(k, pair, finer or {}) for k, pair in enumerate(wanted)]
        by_name = {job.name: job for job in jobs}
        with self._reporter.course("runs"), telling(self._reporter):
            ended = run_jobs(list(by_name.values()), self._root, report=self._report)
        self.made |= by_name.keys()
        finished = {one.job.name: one for one in ended}
        return [
            self._scar(k, finished[job.name], pair, alike)
            for k, (job, pair) in enumerate(zip(jobs, wanted, strict=True))
        ]

    def _report(self, finished: Finished) -> None:
        how = f"failed: {finished.error}" if finished.error else "done"
        self._reporter.say(f"  run {finished.job.name}: {how}", always=bool(finished.error))

    def _job(self, number: int, pair: Pair, finer: Mapping[str, Any]) -> Job:
        test, case = self.tests[number], self.cases[number]
        texts = [f"{value / to_base(f'1 {UNIT}', None):.{SIGNIFICANT}g}" for value in pair]
        overrides = [
            *QUIET,
            *(one for of_entry in PLAIN.values() for one in of_entry),
            *(["fidelity=fixed"] if hasattr(case, "fidelity") else []),
            *(f"wear.body_{k}.coefficient={text} {UNIT}" for k, text in enumerate(texts, 1)),
            *(f"{path}={scalar(value)}" for path, value in finer.items()),
        ]
        name = f"case_{self._numbers[test.case]}_{'_'.join(texts)}"
        if finer:
            printed = hashlib.sha256(repr(sorted(finer.items())).encode()).hexdigest()[:DIGITS]
            name = f"{name}_finer_{printed}"
        return Job(name, Path(test.case), tuple(overrides))

    def _case(self, number: int, test: ProfileMeasurement) -> Any:
        """Return the case of a test; raise CaseError if it cannot be used."""
        case, place = Job("", Path(test.case)).load(), self.place(number, "case")
        bodies = [getattr(getattr(case, "wear", None), name, None) for name in ("body_1", "body_2")]
        if analysis_of(case).name != WEAR or None in bodies:
            raise CaseError(
                f"{place}: no wear of body_1 and body_2; allowed: a wear case with these"
            )
        for name, body in zip(("body_1", "body_2"), bodies, strict=True):
            if not isinstance(body, WornByEnergy | WornByEnergyAmplitude):
                raise CaseError(f"{place}: law of {name}; allowed: energy or energy_amplitude")
            if self._file.offset == "threshold" and body.evolution is not None:
                raise CaseError(
                    f"{place}: evolution of {name} with offset: threshold; allowed: one of them"
                )
        return case

    def _scar(self, number: int, finished: Finished, pair: Pair, alike: bool) -> RunScar:
        summary = finished.summary
        if summary is None:
            raise MethodFailed(f"{finished.folder}: {finished.error}")
        cycles = self.cases[number].wear.cycles
        if summary["cycles"] < (1.0 - WHOLE) * cycles:
            raise UserError(
                f"{self.place(number, 'case')}: a run ended at {summary['cycles']:g} of its "
                f"{cycles:g} cycles; allowed: a case without wear.stop"
            )
        name = self._interface(number, interfaces(summary))
        x, *depths = middle_profiles(finished.folder, [name])[name]
        if alike and not _wear_in_proportion(depths, pair):
            raise UserError(
                f"{self.place(number, 'case')}: the bodies do not wear in proportion to their "
                "coefficients; allowed: a case of one law for both, in which they hardly move "
                "over each other (wear.motion: neglect), or depth of both together"
            )
        energy = float(summary[name]["energy"])
        return RunScar(sum(pair), x, np.asarray(sum(depths)), energy, tuple(summary["warnings"]))

    def _interface(self, number: int, names: Sequence[str]) -> str:
        asked = self.tests[number].interface
        if asked is None and len(names) == 1:
            return names[0]
        if asked is None or asked not in names:
            wrong = "missing" if asked is None else f"{asked}: no such contact"
            raise UserError(
                f"{self.place(number, 'interface')}: {wrong}; allowed: {', '.join(names)}"
            )
        return asked


def _wear_in_proportion(depths: Sequence[Array], pair: Pair) -> bool:
    """Return whether the depths of the bodies are in proportion to their coefficients."""
    crossed = [depth * other for depth, other in zip(depths, reversed(pair), strict=True)]
    return bool(np.abs(crossed[0] - crossed[1]).max() <= ALIKE * np.abs(crossed[0]).max())


def rounded(pair: Sequence[float]) -> Pair:
    """Return the coefficients as they are rounded for a run."""
    size = to_base(f"1 {UNIT}", None)
    first, second = (float(f"{value / size:.{SIGNIFICANT}g}") * size for value in pair)
    return first, second
