"""Wear coefficients from depths and profiles, with runs of the tests until they are enough.

The first runs have the coefficients of the cases. Each further run has the coefficients of the fit
through all earlier runs. The runs are enough when leaving out the nearest run changes the
coefficients little compared with their standard deviations. The last runs are repeated with finer
steps or grid.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from sa_solver.types import Array
from wear.fitting import ComputedScars, Fit, FitError, ScarData, fit, scar_problem
from wear.fitting.scars import HEIGHT, SHIFT, THRESHOLD, ScarFit
from workflow.case.text.plain import counted
from workflow.case.text.writing import scalar
from workflow.errors import CaseError, UserError
from workflow.fit.fitting import UNITS, FitAxis, Fitted, FittedSeries, solved
from workflow.fit.measured import PLACE, MeasuredColumn, read_columns
from workflow.fit.profile_runs import Pair, RunScar, TestRuns, rounded
from workflow.fit.profile_schema import ProfileFit
from workflow.fit.schema import FitInput
from workflow.messages.warning_kinds import Notice, WarningKind
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.folders.lock import locked
from workflow.shell.terminal.reporter import Reporter
from workflow.shell.terminal.screen import Loudness

BOTH = "both"
BODIES = {"depth": BOTH, "depth_1": "body_1", "depth_2": "body_2"}
ALONG = FitAxis("position", "mm", 1.0, "mm")
RUNS, LOG = "runs", "fit.log"
# Largest acceptable error due to too few runs, relative to the standard deviation or to the value,
# and the largest number of rounds.
ENOUGH, LEAST, MOST_ROUNDS = 0.1, 3e-4, 8
# Change by finer runs, relative to the standard deviation, above which bounds are too small.
TOO_COARSE = 0.5


@dataclass(frozen=True)
class _Profile:
    """Measured profile: the number of its test, its body, and its data."""

    name: str
    test: int
    body: str
    column: MeasuredColumn


def fit_profiles(given: FitInput, file: ProfileFit, out: Path | None, loudness: Loudness) -> Fitted:
    """Fit the profiles that the file names, with runs below ``out``.

    Raises CaseError and InputFileError with file and line, UserError for data or cases that allow
    no fit, MethodFailed for a run that fails.
    """
    if out is None:
        raise UserError(f"{given.name}: a fit through runs stores them in a folder; allowed: --out")
    profiles = list(_profiles(file))
    _check_bodies(given, profiles)
    with locked(out):
        folder = OutputFolder(out, "fit")
        folder.refuse_foreign()
        log = folder.reserve(LOG, "messages of the runs, with times")
        root = folder.reserve(RUNS, "runs of the cases, each with other coefficients")
        root.mkdir(exist_ok=True)
        with closing(Reporter(log, True, loudness=loudness)) as reporter:
            search = _Search(given, file, profiles, TestRuns(given, file, root, reporter))
            try:
                return search.through()
            except FitError as error:
                raise UserError(f"{given.name}: {error}") from error


def _profiles(file: ProfileFit) -> list[_Profile]:
    found = []
    for number, measurement in enumerate(file.measurements):
        columns = read_columns([measurement], list(BODIES), ascending=True, along=PLACE)
        files = np.full(1, number)
        for name, column in columns.items():
            of = f"profile_{number + 1}" if len(file.measurements) > 1 else "profile"
            called = of if len(columns) == 1 else f"{of}_{BODIES[name]}"
            here = replace(column, files=np.repeat(files, len(column.values)))
            found.append(_Profile(called, number, BODIES[name], here))
    return found


def _check_bodies(given: FitInput, profiles: Sequence[_Profile]) -> None:
    bodies = {profile.body for profile in profiles}
    if BOTH in bodies and len(bodies) > 1:
        raise UserError(
            f"{given.name}: depth and depth_1 or depth_2; allowed: that of both bodies, or those "
            "of each"
        )


# --- runs until they are enough -----------------------------------------------------------------


class _Search:
    """Fit of profiles through the runs that it needs."""

    def __init__(
        self, given: FitInput, file: ProfileFit, profiles: Sequence[_Profile], runs: TestRuns
    ) -> None:
        self._given, self._file, self._profiles, self._runs = given, file, profiles, runs
        self._bodies = {profile.body for profile in profiles}
        self._scars: list[list[RunScar]] = [[] for _ in runs.tests]

    def through(self) -> Fitted:
        """Return the result, after alternating runs and fits until the runs are enough."""
        wanted, settled = [self._begin(number) for number in range(len(self._scars))], False
        for _ in range(MOST_ROUNDS):
            made, last = wanted, self._run(wanted)
            for known, scar in zip(self._scars, last, strict=True):
                known.append(scar)
            scars = scar_problem(self._data(self._scars), self._file.offset == THRESHOLD)
            found = fit(scars.problem)
            missing = scars.error_of_runs(found)
            settled = _are_enough(scars, found, missing)
            wanted = [self._next(number, scars, found) for number in range(len(self._scars))]
            if settled or any(map(self._is_known, range(len(wanted)), wanted)):
                break
        fine = self._run(made, self._file.finer)
        coarse = [
            replace(scars, data=self._data([[one] for one in of_all])).predict(found.values)
            for of_all in (last, fine)
        ]
        by_finer = scars.moved_by(found, coarse[1] - coarse[0])
        warned = dict.fromkeys(warning for one in last for warning in one.warnings)
        fitted = self._fitted(scars, found)
        plausibility_warnings = (
            *fitted.plausibility_warnings,
            *(Notice(WarningKind.RUNS_WARNED, f"the runs: {warning}") for warning in warned),
        )
        return self._with_runs(
            replace(fitted, plausibility_warnings=plausibility_warnings),
            scars,
            missing,
            by_finer,
            settled,
        )

    def _run(self, wanted: Sequence[Pair], finer: Mapping[str, Any] | None = None) -> list[RunScar]:
        return self._runs.scars(wanted, finer, alike=BOTH not in self._bodies)

    def _is_known(self, number: int, pair: Pair) -> bool:
        """Return whether a run of these coefficients exists: another would add no information."""
        return sum(pair) in [scar.coefficient for scar in self._scars[number]]

    def _begin(self, number: int) -> Pair:
        """Return the coefficients of the case, which must be above 0 where they are fitted."""
        first, second = pair = rounded(self._runs.own(number))
        own = {BOTH: first + second, "body_1": first, "body_2": second}
        for body in self._bodies:
            if own[body] <= 0.0:
                raise CaseError(
                    f"{self._runs.place(number, 'case')}: wear of {body} is 0; allowed: an "
                    "initial coefficient above 0"
                )
        return pair

    def _next(self, number: int, scars: ScarFit, found: Fit) -> Pair:
        """Return the coefficients of the next run: the fitted ones, reduced by a threshold."""
        first, second = self._runs.own(number)
        fitted = dict(zip(scars.bodies, found.values.tolist(), strict=False))
        pair = fitted.get("body_1", first), fitted.get("body_2", second)
        if BOTH in fitted:
            factor = fitted[BOTH] / (first + second)
            pair = factor * first, factor * second
        of_test = next(k for k, one in enumerate(self._profiles) if one.test == number)
        begun = scars.effective(scars.data[of_test], found.values) / sum(pair)
        return rounded([begun * value for value in pair])

    def _data(self, scars: Sequence[Sequence[RunScar]]) -> tuple[ScarData, ...]:
        """Return the profiles with the scars of the runs of their tests."""
        return tuple(self._with_scars(one, scars[one.test]) for one in self._profiles)

    def _with_scars(self, one: _Profile, scars: Sequence[RunScar]) -> ScarData:
        first, second = self._runs.own(one.test)
        return ScarData(
            name=one.name,
            x=one.column.against,
            depth=one.column.values,
            runs=_computed(scars),
            aligned=self._file.measurements[one.test].aligned,
            deviations=one.column.deviations,
            body=one.body,
            held={BOTH: 0.0, "body_1": second, "body_2": first}[one.body],
            energy=scars[0].energy,
        )

    # -- report --------------------------------------------------------------------------------

    def _fitted(self, scars: ScarFit, found: Fit) -> Fitted:
        series = [
            FittedSeries(one.name, "um", one.column, ALONG, self._curve(scars, place))
            for place, one in enumerate(self._profiles)
        ]
        paths = [_path(unknown.name) for unknown in scars.problem.unknowns]
        return solved(self._given, found, paths, series, [])

    def _curve(self, scars: ScarFit, place: int) -> Callable[[Array], Callable[[Array], Array]]:
        here = scars.problem.places == place
        return lambda _: lambda values: scars.predict(values)[here]

    def _with_runs(
        self, fitted: Fitted, scars: ScarFit, missing: Array, by_finer: Array, settled: bool
    ) -> Fitted:
        """Return the result with the number of runs and the errors due to them."""
        how = ", ".join(f"{path}: {scalar(value)}" for path, value in self._file.finer.items())
        reported, plausibility_warnings, numbers = [], list(fitted.plausibility_warnings), {}
        for place in range(_count(scars)):
            parameter, off, finer = fitted.parameters[place], missing[place], by_finer[place]
            deviation = float(np.sqrt(fitted.fit.covariance[place, place]))
            # A coefficient is fitted as its logarithm, so its error is relative already.
            size = (
                1.0 if fitted.fit.problem.unknowns[place].logarithmic else fitted.fit.values[place]
            )
            errors = {"for_want_of_runs": off / size, "by_finer": finer / size}
            numbers[parameter.path] = {name: float(error) for name, error in errors.items()}
            reported.append(
                f"{parameter.path}: has an error of about {off / size:.2g} because runs are few, "
                f"and changes by {finer / size:+.2g} with finer runs ({how}), relative; its "
                f"standard deviation is {deviation / size:.2g}"
            )
            if abs(finer) > TOO_COARSE * deviation:
                plausibility_warnings.append(
                    Notice(
                        WarningKind.TOO_FEW_RUNS,
                        f"{parameter.path}: finer runs change it by {abs(finer) / deviation:.2g} "
                        "standard deviations, which its bounds do not include; make the cases "
                        "finer",
                    )
                )
        if not settled:
            plausibility_warnings.append(
                Notice(
                    WarningKind.TOO_FEW_RUNS,
                    "runs are too few: leaving one out still changes the fit",
                )
            )
        count = counted(len(self._runs.made), "run")
        return replace(
            fitted,
            plausibility_warnings=tuple(plausibility_warnings),
            reported=(f"{count} of {counted(self._runs.count, 'case')}", *reported),
            runs={"made": len(self._runs.made), "relative_errors": numbers},
        )


def _computed(scars: Sequence[RunScar]) -> ComputedScars:
    """Return the scars of runs, interpolated to the places of the first."""
    x = scars[0].x
    depth = np.stack([np.interp(x, scar.x, scar.depth) for scar in scars])
    return ComputedScars(np.array([scar.coefficient for scar in scars]), x, depth)


def _count(scars: ScarFit) -> int:
    """Return the number of unknowns of the wear, which come before those of single scans."""
    return len(scars.bodies) + scars.threshold


def _are_enough(scars: ScarFit, found: Fit, missing: Array) -> bool:
    """Return whether the runs are near enough to the solution; NaN, for a single run, is not."""
    count = _count(scars)
    deviations = np.sqrt(np.diag(found.covariance))[:count]
    sizes = np.where(scars.problem.logarithmic, 1.0, np.abs(found.values))[:count]
    return bool(np.all(np.abs(missing[:count]) <= np.maximum(ENOUGH * deviations, LEAST * sizes)))


def _path(name: str) -> tuple[str, str]:
    """Return path and unit of an unknown of :func:`scar_problem`."""
    _, _, parameter = name.rpartition(".")
    if parameter in UNITS:
        return f"wear.{name}", UNITS[parameter]
    return name, {SHIFT: "um", HEIGHT: "um"}.get(parameter, "1")
