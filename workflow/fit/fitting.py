"""Fits of joints and of wear volumes: data, problem, solution, and warnings about the result."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from sa_solver.types import Array, Indices
from wear.fitting import (
    Common,
    Estimate,
    EvolutionData,
    Fit,
    FitError,
    VolumeData,
    VolumeLaw,
    common_over,
    diagnose,
    evolution_problem,
    fit,
    volume_problem,
)
from wear.fitting.diagnosis import ALARM
from workflow.case.sections import Section
from workflow.case.units import to_base
from workflow.errors import CaseError, UserError
from workflow.fit.measured import MeasuredColumn, read_columns
from workflow.fit.schema import FREE, FitInput, JointFit, WearFit
from workflow.messages.warning_kinds import Notice, WarningKind
from workflow.pictures.scales import TO_JOULES, TO_MICRONS

# Columns that hold the parameters of a joint.
MEASURED = {
    "friction": "mu",
    "stiffness": "kt",
    "residual_stiffness": "residual_stiffness",
    "normal_load": "P",
}
INITIAL = "initial"
# Units in which parameters are reported: first those of a joint, then all others.
JOINT_UNITS = {
    "friction": "1",
    "stiffness": "N/um",
    "residual_stiffness": "N/um",
    "normal_load": "N",
}
UNITS = {
    "rate": "1/J",
    "second_rate": "1/J",
    "scale": "J",
    "slope": "1/J",
    "coefficient": "um^3/J",
    "threshold": "J",
    "intercept": "um^3",
}
VOLUMES = {"volume": "both", "volume_1": "body_1", "volume_2": "body_2"}
# Share of one value in a parameter above which a warning says that the parameter rests on it.
ALONE = 0.9
# Largest number of places in a message.
MOST_NAMED = 5
# Law of the worn volume: power of the amplitude.
POWERS = {"energy": 0.0, "energy_amplitude": 1.0, "amplitude_power": None}


@dataclass(frozen=True)
class Parameter:
    """Free parameter: its ``path`` in a case, the ``unit`` of its report, and its estimate."""

    path: str
    unit: str
    estimate: Estimate

    def shown(self, number: float) -> float:
        """Return a number given in the base unit in the unit of the report."""
        return number / (1.0 if self.unit == "1" else to_base(f"1 {self.unit}", None))


class FitAxis(NamedTuple):
    """Quantity along which values were measured: name, base unit, display factor and unit."""

    name: str
    base: str
    factor: float
    unit: str


ENERGY = FitAxis("dissipated energy", "N*mm", TO_JOULES, "J")
DISPLACEMENT = FitAxis("displacement", "mm", TO_MICRONS, "µm")


@dataclass(frozen=True)
class FittedSeries:
    """One kind of data: its name, the measured values, and where they were measured.

    ``curve`` takes places ``(m,)`` on the axis ``along`` to a function from parameter values to
    the fitted curve; None where the curve depends on more than the place.
    """

    name: str
    unit: str
    column: MeasuredColumn
    along: FitAxis
    curve: Callable[[Array], Callable[[Array], Array]] | None

    @property
    def order(self) -> Array:
        """Order of neighbouring values ``(n,)``: by energy, or by the path along a loop."""
        against = self.column.against
        return against if self.along == ENERGY else np.arange(len(against), dtype=np.float64)


@dataclass(frozen=True)
class Fitted:
    """Result of a fit: solution, parameters by path in a case, data, ``plausibility_warnings``.

    ``tests`` has the estimates of each file for a parameter, by path, where there are several
    tables. For a fit through runs, ``reported`` and ``runs`` report their number and errors.
    """

    given: FitInput
    fit: Fit
    parameters: tuple[Parameter, ...]
    series: tuple[FittedSeries, ...]
    plausibility_warnings: tuple[Notice, ...]
    tests: Mapping[str, Common]
    reported: tuple[str, ...] = ()
    runs: Mapping[str, Any] = field(default_factory=dict)

    def shown_tests(self, path: str) -> list[tuple[str, float, float, float]]:
        """Return name, share, own value and deviation per file for a parameter's ``tests``."""
        common, shown = self.tests[path], self.by_path[path].shown
        return [
            (
                Path(self.given.file.measurements[test].file).name,
                share,
                shown(own),
                shown(deviation),
            )
            for test, share, own, deviation in zip(
                *(common.tests.tolist(), common.shares.tolist()),
                *(common.own.tolist(), common.deviations.tolist()),
                strict=True,
            )
        ]

    @property
    def places(self) -> tuple[str, ...]:
        """Source ``file:line`` of each value ``(n,)``."""
        return tuple(place for series in self.series for place in series.column.places)

    @property
    def by_path(self) -> dict[str, Parameter]:
        """Parameters by their paths."""
        return {parameter.path: parameter for parameter in self.parameters}


def solved(
    given: FitInput,
    fitted: Fit,
    paths: Sequence[tuple[str, str]],
    series: Sequence[FittedSeries],
    notes: Sequence[Notice],
    reported: Sequence[str] = (),
) -> Fitted:
    """Return the result of a fit whose parameters have these ``paths`` and units."""
    called = {one.name: path for one, (path, _) in zip(fitted.estimates, paths, strict=True)}
    parameters = tuple(
        Parameter(path, unit, replace(estimate, caveat=_in_paths(estimate.caveat, called)))
        for (path, unit), estimate in zip(paths, fitted.estimates, strict=True)
    )
    order = np.concatenate([one.order for one in series])
    files = np.concatenate([one.column.files for one in series])
    places = [place for one in series for place in one.column.places]
    plausibility_warnings = list(notes)
    for caveat in diagnose(fitted, order, files):
        named = _named([places[k] for k in caveat.data])
        where = f" ({named})" if named else ""
        text = ": ".join(part for part in (caveat.series, caveat.text + where) if part)
        plausibility_warnings.append(Notice(WarningKind.CONSPICUOUS_RESIDUALS, text))
    plausibility_warnings += [
        Notice(
            WarningKind.RESTS_ON_ONE_VALUE,
            f"{parameter.path}: rests on one value, {places[e.heaviest]}; more there would help",
        )
        for parameter in parameters
        if (e := parameter.estimate).determined and e.heaviest_share > ALONE
    ]
    plausibility_warnings += _products(fitted, parameters)
    if fitted.reached < fitted.tried:
        plausibility_warnings.append(
            Notice(
                WarningKind.WORSE_STARTS,
                f"{fitted.tried - fitted.reached} of {fitted.tried} starts ended at a worse fit; "
                "the best one is reported",
            )
        )
    tests = _tests(fitted, parameters, series, files)
    found = Fitted(
        given,
        fitted,
        parameters,
        tuple(series),
        tuple(plausibility_warnings),
        tests,
        tuple(reported),
    )
    return replace(found, plausibility_warnings=(*plausibility_warnings, *_contradictions(found)))


def _tests(
    fitted: Fit, parameters: Sequence[Parameter], series: Sequence[FittedSeries], files: Indices
) -> dict[str, Common]:
    """Return what each table says about the parameters, by path; empty for records of loops.

    Records of loops differ only as their strokes do. Parameters that place a single profile are
    left out, since no other table contains them.
    """
    if series[0].along == DISPLACEMENT or len(np.unique(files)) < 2:
        return {}
    paths = {parameter.estimate.name: parameter.path for parameter in parameters}
    own = tuple(f"{one.name}." for one in series)
    found = {paths[one.name]: one for one in common_over(fitted, files)}
    return {path: one for path, one in found.items() if not path.startswith(own)}


def _contradictions(fitted: Fitted) -> list[Notice]:
    """Return warnings about parameters on which the files do not agree."""
    reported = []
    for path, common in fitted.tests.items():
        # One false alarm in a thousand fits, whatever the number of parameters.
        if common.chance < ALARM / len(fitted.tests):
            unit = fitted.by_path[path].unit
            values = ", ".join(
                f"{name} {own:.4g} +- {deviation:.2g}"
                for name, _, own, deviation in fitted.shown_tests(path)
                if np.isfinite(own)
            )
            reported.append(
                Notice(
                    WarningKind.CONTRADICTING_FILES,
                    f"{path}: the files contradict each other beyond their scatter "
                    f"({values}{'' if unit == '1' else f' {unit}'}), so bounds of a common value "
                    "are too small: fit them separately, or ask what the tests differ in",
                )
            )
    return reported


def _named(places: Sequence[str]) -> str:
    """Return the first few of the places, as text."""
    more = " ..." if len(places) > MOST_NAMED else ""
    return ", ".join(places[:MOST_NAMED]) + more


def _products(fitted: Fit, parameters: Sequence[Parameter]) -> list[Notice]:
    """Return the products of pairs of parameters that only matter as a product."""
    names = [parameter.estimate.name for parameter in parameters]
    reported = []
    for place, parameter in enumerate(parameters):
        partner = parameter.estimate.partner
        if partner and names.index(partner) > place and not parameter.estimate.logarithmic:
            other = parameters[names.index(partner)]
            value, deviation = map(other.shown, fitted.product(place, names.index(partner)))
            unit = "" if other.unit == "1" else f" {other.unit}"
            number = f"{parameter.shown(value):.5g}{unit} +- {parameter.shown(deviation):.2g}"
            text = f"{parameter.path} times {other.path} is {number}; hold one of them"
            reported.append(Notice(WarningKind.ONLY_A_PRODUCT, text))
    return reported


def _in_paths(text: str, called: Mapping[str, str]) -> str:
    """Return a text with the paths of parameters in place of their names."""
    return re.sub(r"[\w.]+", lambda word: called.get(word[0], word[0]), text)


# --- joints -------------------------------------------------------------------------------------


def fit_joint(given: FitInput, file: JointFit) -> Fitted:
    """Fit the evolution of a joint's parameters; raise as :func:`workflow.fit.running.run_fit`."""
    names = [MEASURED[name] for name in file.evolution.given]
    columns = read_columns(file.measurements, names, beside=("residual_stiffness",), ascending=True)
    for name in file.evolution.given:
        if MEASURED[name] not in columns:
            place = given.source.where(("evolution", name))[1]
            raise CaseError(
                f"{place}: evolution.{name}: no file has its column {MEASURED[name]}; allowed: "
                "one that has it, or columns that names it"
            )
    columns, notes = _without_residual(file, columns)
    notes += [
        Notice(
            WarningKind.DATA_LEFT_OUT,
            f"{name}: not used where loops do not slide as a whole ({_named(column.left_out)})",
        )
        for name, column in columns.items()
        if column.left_out
    ]
    data = [
        _evolution_data(file, name, section, columns[MEASURED[name]])
        for name, section in file.evolution.given.items()
    ]
    try:
        problem = evolution_problem(data, file.shared)
        fitted = fit(problem.problem)
    except FitError as error:
        raise UserError(f"{given.name}: {error}") from error
    series = [
        FittedSeries(
            one.name,
            JOINT_UNITS[one.name],
            columns[MEASURED[one.name]],
            ENERGY,
            lambda energy, one=one: problem.curve(one, energy),  # type: ignore[misc]
        )
        for one in problem.data
    ]
    paths = [_joint_path(unknown.name) for unknown in problem.problem.unknowns]
    return solved(given, fitted, paths, series, notes)


def _evolution_data(
    file: JointFit, name: str, section: Section, column: MeasuredColumn
) -> EvolutionData:
    """Return the data of a parameter of the joint, and the fixed entries of its function."""
    entries = {INITIAL: getattr(file.joint, name), **section.model_dump(exclude={"kind"})}
    held = {key: float(value) for key, value in entries.items() if value != FREE}
    return EvolutionData(
        name,
        column.against,
        column.values,
        str(section.kind),  # type: ignore[attr-defined]
        held,
        column.deviations,
    )


def _joint_path(name: str) -> tuple[str, str]:
    """Return path in a case and unit of a parameter of :func:`evolution_problem`."""
    of, _, parameter = name.rpartition(".")
    if parameter == INITIAL:
        return f"joint.{of}", JOINT_UNITS[of]
    where = f"evolution.{of}.{parameter}" if of else f"evolution.{parameter}"
    return where, UNITS.get(parameter, "1")


def _without_residual(
    file: JointFit, columns: dict[str, MeasuredColumn]
) -> tuple[dict[str, MeasuredColumn], list[Notice]]:
    """Return the columns with the stiffness as the law defines it, and notes about it."""
    if file.law == "bouc_wen" or "kt" not in columns:
        return columns, []
    kt = columns["kt"]
    residual = kt.others.get("residual_stiffness")
    if residual is None:
        note = (
            f"kt has no residual_stiffness and is taken as the whole stiffness of {file.law}: "
            "right if nothing of it is left when all slides"
        )
        return columns, [Notice(WarningKind.WHOLE_STIFFNESS, note)]
    alone = MeasuredColumn(
        kt.against, kt.values - residual, kt.deviations, kt.others, kt.places, kt.files
    )
    return {**columns, "kt": alone}, []


# --- wear ---------------------------------------------------------------------------------------


def fit_wear(given: FitInput, file: WearFit) -> Fitted:
    """Fit wear coefficients to volumes; raise as :func:`workflow.fit.running.run_fit`."""
    columns = read_columns(file.measurements, list(VOLUMES), beside=("amplitude",))
    if "volume" in columns and len(columns) > 1:
        raise UserError(
            f"{given.name}: volume and volume_1 or volume_2; allowed: that of both bodies, or "
            "those of each"
        )
    reference = file.wear.reference_amplitude
    law = VolumeLaw(file.wear.offset, POWERS[file.wear.law], reference or 1.0)
    data = []
    for name, column in columns.items():
        amplitude = column.others.get("amplitude")
        if law.uses_amplitude and amplitude is None:
            raise UserError(
                f"{column.places[0].rpartition(':')[0]}: no column amplitude, which law: "
                f"{file.wear.law} needs; allowed: half the stroke of every test"
            )
        body = VolumeData(
            VOLUMES[name], column.against, column.values, amplitude, column.deviations
        )
        data.append(body)
    try:
        problem = volume_problem(data, law)
        fitted = fit(problem.problem)
    except FitError as error:
        raise UserError(f"{given.name}: {error}") from error
    series = [
        FittedSeries(
            f"worn volume of {one.name.replace('_', ' ')}",
            "mm^3",
            column,
            ENERGY,
            None
            if law.uses_amplitude
            else lambda energy, one=one: problem.curve(one, energy, None),  # type: ignore[misc]
        )
        for one, column in zip(problem.data, columns.values(), strict=True)
    ]
    paths = [_wear_path(unknown.name) for unknown in problem.problem.unknowns]
    return solved(given, fitted, paths, series, [])


def _wear_path(name: str) -> tuple[str, str]:
    """Return path and unit of a parameter of :func:`volume_problem`."""
    of, _, parameter = name.rpartition(".")
    where = ".".join(part for part in ("wear", of, parameter) if part)
    return where, UNITS.get(parameter, "1")
