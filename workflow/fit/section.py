"""Result of a fit as a section of a case, ready to paste, with bounds in comments.

A parameter that the data do not determine appears as a comment without a value, so that a case with
the section is refused until the user fills it in.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from workflow.case.sections import Section
from workflow.case.text.writing import EntryRow, render
from workflow.fit.fitting import JOINT_UNITS, UNITS, Fitted, Parameter
from workflow.fit.profile_schema import ProfileFit
from workflow.fit.schema import FREE, JointFit, LoopFitSection, WearFit
from workflow.kinds import load_case

# Digits of a deviation; the value ends with the same digit. MOST_DIGITS limits other numbers.
DIGITS, MOST_DIGITS = 2, 9
# Digits of a deviation for values in a case: correlated parameters are known together far better
# than each alone, and rounding one of them would change the curve.
IN_SECTION = 4
# Numbers between these limits are written without a power of ten.
SMALL, LARGE = 1e-3, 1e6
LEFT_OUT = "undetermined"
BOUNDS = "95 %: "
# Entries left out of a section without a second exponential.
SECOND = ("share", "second_rate")


def rounded(value: float, deviation: float, of_deviation: int = DIGITS) -> str:
    """Return a value rounded to the given number of digits of its deviation."""
    if value == 0.0 or deviation <= 10.0 ** (DIGITS - MOST_DIGITS) * abs(value):
        return number_text(value, MOST_DIGITS)
    last = math.floor(math.log10(deviation)) - of_deviation + 1
    if SMALL <= abs(value) < LARGE:
        return f"{round(value, -last):.{max(-last, 0)}f}"
    return number_text(value, max(math.floor(math.log10(abs(value))) - last + 1, 1))


def number_text(value: float, digits: int) -> str:
    """Return a number with this many digits, with the power of ten in YAML's notation."""
    if SMALL <= abs(value) < LARGE:
        return f"{float(f'{value:.{digits}g}'):.{MOST_DIGITS}g}"
    if value == 0.0:
        return "0"
    mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
    return f"{float(mantissa):g}e{int(exponent)}"


def quantity(text: str, unit: str) -> float | str:
    """Return an entry of a case: a number, or a text of number and unit."""
    return float(text) if unit == "1" else f"{text} {unit}"


def reported(parameter: Parameter) -> tuple[str, str, str]:
    """Return value, deviation and bounds of a determined parameter, without the unit."""
    estimate = parameter.estimate
    deviation = parameter.shown(estimate.deviation)
    lower, upper = map(parameter.shown, estimate.bounds)
    value = rounded(parameter.shown(estimate.value), deviation)
    return value, number_text(deviation, DIGITS), bounds_text(lower, upper, deviation)


def bounds_text(lower: float, upper: float, deviation: float) -> str:
    """Return bounds, rounded to the digits of the deviation."""
    return f"{rounded(lower, deviation)} to {rounded(upper, deviation)}"


def section_of(fitted: Fitted) -> str:
    """Return the sections of a case, as YAML."""
    file = fitted.given.file
    if isinstance(file, ProfileFit):
        rows = _profiles(fitted, file)
    elif isinstance(file, WearFit):
        rows = _wear(fitted, file)
    else:
        rows = _joint(fitted, file) if isinstance(file, JointFit) else _law(fitted, file)
    return f"# {file.title}\n{render(rows).lstrip()}"


def _row(fitted: Fitted, path: str, key: str) -> EntryRow:
    """Return the entry of a free parameter."""
    parameter = fitted.by_path[path]
    if not parameter.estimate.determined:
        return EntryRow(key, LEFT_OUT, parameter.estimate.caveat, off=True)
    _, _, bounds = reported(parameter)
    deviation = parameter.shown(parameter.estimate.deviation)
    value = rounded(parameter.shown(parameter.estimate.value), deviation, IN_SECTION)
    return EntryRow(key, quantity(value, parameter.unit), f"{BOUNDS}{bounds}")


def _held(value: float | str, unit: str, key: str) -> EntryRow:
    """Return the entry of a parameter that was held at a ``value`` in base units."""
    if isinstance(value, str):
        return EntryRow(key, value)
    number = value if unit == "1" else Parameter("", unit, None).shown(value)  # type: ignore[arg-type]
    return EntryRow(key, quantity(number_text(number, MOST_DIGITS), unit), "held")


def _joint(fitted: Fitted, file: JointFit) -> list[EntryRow]:
    joint = [EntryRow("law", file.law)]
    for name, unit in JOINT_UNITS.items():
        if f"joint.{name}" in fitted.by_path:
            joint.append(_row(fitted, f"joint.{name}", name))
        elif (value := getattr(file.joint, name)) != FREE:
            joint.append(_held(value, unit, name))
        else:
            joint.append(EntryRow(name, LEFT_OUT, "not measured here", off=True))
    evolution = [
        EntryRow(name, _function(fitted, name, section))
        for name, section in file.evolution.given.items()
    ]
    return [EntryRow("joint", joint), EntryRow("evolution", evolution)]


def _law(fitted: Fitted, file: LoopFitSection) -> list[EntryRow]:
    rows = [EntryRow("law", file.joint.law)]
    for name, value in file.joint.model_dump(exclude={"law"}).items():
        unit = JOINT_UNITS.get(name, "1")
        if value == FREE:
            rows.append(_row(fitted, f"joint.{name}", name))
        elif value is not None:
            rows.append(_held(value, unit, name))
        else:
            loads = [float(series.column.others[name].mean()) for series in fitted.series]
            row = _held(sum(loads) / len(loads), unit, name)
            rows.append(EntryRow(name, row.value, "measured, the mean"))
    return [EntryRow("joint", rows)]


def _function(fitted: Fitted, name: str, section: Section) -> list[EntryRow]:
    """Return the entries of a function of the energy."""
    rows = []
    for key, value in section.model_dump().items():
        if key in SECOND and getattr(section, "share", None) == 1.0:
            continue
        if value != FREE:
            rows.append(_held(value, UNITS.get(key, "1"), key))
            continue
        own, common = f"evolution.{name}.{key}", f"evolution.{key}"
        rows.append(_row(fitted, own if own in fitted.by_path else common, key))
    return rows


def entries_of(fitted: Fitted, path: str) -> list[str]:
    """Return the entries of a case that contain the parameter; none if no case has it."""
    file, name = fitted.given.file, path.rpartition(".")[2]
    if isinstance(file, WearFit | ProfileFit):
        if path.startswith("wear.both.") or name not in ("coefficient", "threshold"):
            return []
        return [path.replace(".threshold", ".evolution.threshold")]
    if isinstance(file, LoopFitSection) or path != f"evolution.{name}":
        return [path]
    return [
        f"evolution.{of}.{name}"
        for of, section in file.evolution.given.items()
        if getattr(section, name, None) == FREE
        and not (name in SECOND and getattr(section, "share", None) == 1.0)
    ]


def _wear(fitted: Fitted, file: WearFit) -> list[EntryRow]:
    rows = [EntryRow("law", "energy" if file.wear.law == "energy" else "energy_amplitude")]
    if file.wear.reference_amplitude is not None:
        rows.append(_held(file.wear.reference_amplitude, "um", "reference_amplitude"))
    if "wear.exponent" in fitted.by_path:
        found = _row(fitted, "wear.exponent", "exponent")
        comment = f"{found.comment}; energy_amplitude has 1, energy 0"
        rows.append(EntryRow("exponent", found.value, comment, off=True))
    for body in _bodies(fitted):
        rows += _body(fitted, body)
    return [EntryRow("wear", rows)]


def _bodies(fitted: Fitted) -> list[str]:
    names = ("both", "body_1", "body_2")
    return [name for name in names if f"wear.{name}.coefficient" in fitted.by_path]


def _profiles(fitted: Fitted, file: ProfileFit) -> list[EntryRow]:
    """Return the section of wear, with fixed values from the case of the first test."""
    wear: Any = load_case(Path(file.measurements[0].case)).wear  # type: ignore[attr-defined]
    rows, bodies = [EntryRow("law", wear.law)], _bodies(fitted)
    if wear.reference_amplitude is not None:
        rows.append(_held(wear.reference_amplitude, "um", "reference_amplitude"))
    for body in bodies if bodies == ["both"] else ("body_1", "body_2"):
        if body in bodies:
            rows += _body(fitted, body)
        else:
            held = _held(getattr(wear, body).coefficient, "um^3/J", "coefficient")
            rows.append(EntryRow(body, [held, *_threshold(fitted, body)]))
    return [EntryRow("wear", rows)]


def _threshold(fitted: Fitted, body: str) -> list[EntryRow]:
    """Return the evolution of a body if the fit has a threshold, its own or a common one."""
    own = f"wear.{body}.threshold"
    path = own if own in fitted.by_path else "wear.threshold"
    if path not in fitted.by_path:
        return []
    threshold = _row(fitted, path, "threshold")
    return [EntryRow("evolution", [EntryRow("scope", "global"), threshold], off=threshold.off)]


def _body(fitted: Fitted, body: str) -> list[EntryRow]:
    """Return the entries of a body; the shares of both bodies together are left to the user."""
    entries = [_row(fitted, f"wear.{body}.coefficient", "coefficient")]
    entries += _threshold(fitted, body)
    if (path := f"wear.{body}.intercept") in fitted.by_path:
        found = _row(fitted, path, "intercept")
        comment = f"{found.comment}; a case has none: its volumes are smaller by this"
        entries.append(EntryRow("intercept", found.value, comment, off=True))
    if body != "both":
        return [EntryRow(body, entries)]
    total = entries[0]
    known = f"{total.value}, {total.comment}" if not total.off else total.comment
    share = EntryRow("coefficient", LEFT_OUT, f"its share of the value of both: {known}")
    evolution = [entry for entry in entries if entry.key == "evolution"]
    others = [EntryRow("coefficient", LEFT_OUT, "the rest"), *evolution]
    return [
        EntryRow("body_1", [share, *entries[1:]], "not measured separately", off=True),
        EntryRow("body_2", others, "", off=True),
    ]
