"""Measured tables for a fit: columns with units, and the file and line of each value.

Units are required here, although other tables may omit the base unit: energies of tests are
written in J, kJ or mJ, and a confused unit gives a rate that looks as plausible as any other.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from sa_solver.types import Array, Indices, Mask
from workflow.analyses.wear.output.loop_table import SLIDES
from workflow.case.fields import Quantity, shown
from workflow.case.files.input_files import InputFileError
from workflow.case.files.table_file import TableFile, read_table_file
from workflow.case.sections import Section
from workflow.fit.measurement import Measurement

ENERGY, PLACE = "energy", "x"
OF_DEVIATIONS = "_deviation"
# Columns that are meaningful only for loops whose branches end in sliding, and the column of
# computed loops that marks these. Computed contacts have no spring in parallel: where they stick,
# their residual stiffness is 0.
OF_SLIDING, RESIDUAL, SLIDING = ("mu", "residual_stiffness"), "residual_stiffness", "sliding"
# Similarity above which a heading is taken for a misspelt column of deviations.
NEARLY = 0.85
# Base units and limits of the columns.
QUANTITIES = {
    ENERGY: Quantity("N*mm", at_least=0.0, at_most=1e15, range_text="0 to 1e12 J"),
    "mu": Quantity("1", at_least=0.0, at_most=10.0),
    "kt": Quantity("N/mm", above=0.0, at_most=1e12, range_text="above 0 to 1e6 kN/um"),
    "residual_stiffness": Quantity(
        "N/mm", at_least=-1e12, at_most=1e12, range_text="-1e6 to 1e6 kN/um"
    ),
    "P": Quantity("N", at_least=0.0, at_most=1e9, range_text="0 to 1e6 kN"),
    "volume": Quantity("mm^3", at_least=-1e9, at_most=1e9),
    "volume_1": Quantity("mm^3", at_least=-1e9, at_most=1e9),
    "volume_2": Quantity("mm^3", at_least=-1e9, at_most=1e9),
    "amplitude": Quantity("mm", above=0.0, at_most=1e3),
    SLIDING: Quantity("1", at_least=0.0, at_most=1.0 + 1e-9),
    PLACE: Quantity("mm", at_least=-1e6, at_most=1e6),
    "depth": Quantity("mm", at_least=-1e3, at_most=1e3),
    "depth_1": Quantity("mm", at_least=-1e3, at_most=1e3),
    "depth_2": Quantity("mm", at_least=-1e3, at_most=1e3),
}


@dataclass(frozen=True)
class MeasuredColumn:
    """Values of one kind from all files that have them, in base units.

    ``against`` ``(n,)`` is the abscissa of the ``values`` ``(n,)``; ``deviations`` ``(n,)`` is None
    if they are not known. ``others`` are further columns by name, ``places`` the ``file:line`` and
    ``files`` the file number of each value. ``left_out`` has the ``file:line`` of loops that do not
    slide as a whole.
    """

    against: Array
    values: Array
    deviations: Array | None
    others: Mapping[str, Array]
    places: tuple[str, ...]
    files: Indices
    left_out: tuple[str, ...] = ()


def read_columns(
    measurements: Sequence[Measurement],
    names: Sequence[str],
    beside: Sequence[str] = (),
    ascending: bool = False,
    along: str = ENERGY,
) -> dict[str, MeasuredColumn]:
    """Return the columns of ``names`` that the files have, with the columns ``beside`` if present.

    Values were measured ``along`` another column, by which the rows of a file must be sorted if
    ``ascending``. Raises InputFileError, with file and line.
    """
    parts: dict[str, list[MeasuredColumn]] = {}
    for number, measurement in enumerate(measurements):
        for name, part in _parts(measurement, names, beside, ascending, along).items():
            numbered = replace(part, files=np.full(len(part.values), number))
            parts.setdefault(name, []).append(numbered)
    return {name: _joined(name, parts[name]) for name in names if name in parts}


def _parts(
    measurement: Measurement,
    names: Sequence[str],
    beside: Sequence[str],
    ascending: bool,
    along: str,
) -> dict[str, MeasuredColumn]:
    """Return the columns of one file, which has the number 0."""
    table = read_table_file(measurement.file)
    headings, deviations = _section(measurement, "columns"), _section(measurement, "deviations")
    called = {name: headings.get(name) or name for name in QUANTITIES}
    table.require([called[along]], f"a column of that name, or one that columns.{along} names")
    for name, heading in headings.items():
        table.require([heading], f"the heading that columns.{name} names")
    _check_slips(table, [called[name] for name in names])
    against = _numbers(table, called, along)
    if ascending:
        _check_order(table, against, called[along], along)
    found = [name for name in names if called[name] in table.names]
    if not found:
        wanted = ", ".join(called[name] for name in names)
        raise InputFileError(f"{table.place}: none of the columns {wanted}; allowed: at least one")
    others = {name: _numbers(table, called, name) for name in beside if called[name] in table.names}
    slides = np.ones(len(table), dtype=bool)
    if SLIDING in table.names:
        slides = _numbers(table, called, SLIDING) >= SLIDES
        others |= {name: np.where(slides, others[name], 0.0) for name in others if name == RESIDUAL}
    places = tuple(f"{Path(table.file).name}:{line}" for line, _ in table.rows)
    files = np.zeros(len(table), dtype=np.int64)
    parts = {}
    for name in found:
        values = _numbers(table, called, name)
        known = _deviations(table, called, name, deviations.get(name))
        part = MeasuredColumn(against, values, known, others, places, files)
        parts[name] = _of_sliding(table, name, part, slides) if name in OF_SLIDING else part
    return parts


def _of_sliding(table: TableFile, name: str, part: MeasuredColumn, slides: Mask) -> MeasuredColumn:
    """Return the rows of loops that slide as a whole; others mobilise only part of the friction."""
    if not slides.any():
        raise InputFileError(
            f"{table.place}: {name}: no loop slides as a whole (column {SLIDING}), so it is less "
            "than the coefficient of friction; allowed: loops of a larger amplitude"
        )
    places = np.array(part.places)
    return MeasuredColumn(
        part.against[slides],
        part.values[slides],
        None if part.deviations is None else part.deviations[slides],
        {other: values[slides] for other, values in part.others.items()},
        tuple(places[slides].tolist()),
        part.files[slides],
        tuple(places[~slides].tolist()),
    )


def _section(measurement: Measurement, name: str) -> dict[str, Any]:
    """Return the given entries of a section, by key."""
    section: Section = getattr(measurement, name)
    return {key: value for key, value in section.model_dump().items() if value is not None}


def _numbers(table: TableFile, called: Mapping[str, str], name: str) -> Array:
    return _with_unit(table, called[name], QUANTITIES[name])


def _with_unit(table: TableFile, heading: str, quantity: Quantity) -> Array:
    """Return a column; raise InputFileError if it has a dimension and no unit."""
    unit = str(quantity.unit)
    if unit != "1":
        table.require_unit(heading, {"N*mm": "J", "N/mm": "N/um"}.get(unit, unit))
    return table.column(heading, quantity)


def _check_slips(table: TableFile, headings: Sequence[str]) -> None:
    """Raise InputFileError for a misspelt column of deviations, which would be ignored."""
    known = [f"{heading}{OF_DEVIATIONS}" for heading in headings]
    for name in table.names:
        near = difflib.get_close_matches(name, known, n=1, cutoff=NEARLY)
        if near and name not in (*known, *headings):
            raise InputFileError(
                f"{table.place}: {shown(name)}: unknown column; did you mean '{near[0]}'?"
            )


def _check_order(table: TableFile, against: Array, heading: str, along: str) -> None:
    """Raise InputFileError where the energy falls, or the place does not rise."""
    steps = np.diff(against)
    wrong = np.flatnonzero(steps < 0.0 if along == ENERGY else steps <= 0.0)
    if wrong.size:
        how, order = (
            ("the energy falls", "rows in order of their energy")
            if along == ENERGY
            else ("does not rise", "rows in order of their place, each once")
        )
        raise table.refusal(int(wrong[0]) + 1, heading, how, order)


def _deviations(
    table: TableFile, called: Mapping[str, str], name: str, given: float | None
) -> Array | None:
    """Return the standard deviations of a column: from their column, one number, or None."""
    heading = f"{called[name]}{OF_DEVIATIONS}"
    if heading not in table.names:
        return None if given is None else np.full(len(table), given)
    if given is not None:
        raise InputFileError(
            f"{table.place}: {shown(heading)}: given with deviations.{name}; allowed: one of them"
        )
    return _with_unit(table, heading, Quantity(QUANTITIES[name].unit, above=0.0))


def _joined(name: str, parts: Sequence[MeasuredColumn]) -> MeasuredColumn:
    """Return the columns of all files as one."""
    known = [part.deviations for part in parts if part.deviations is not None]
    if known and len(known) < len(parts):
        unknown = next(part for part in parts if part.deviations is None)
        raise InputFileError(
            f"{unknown.places[0].rpartition(':')[0]}: {name}: no standard deviations, which other "
            "files have; allowed: deviations of all, or of none"
        )
    others = set.intersection(*(set(part.others) for part in parts))
    return MeasuredColumn(
        against=np.concatenate([part.against for part in parts]),
        values=np.concatenate([part.values for part in parts]),
        deviations=np.concatenate(known) if known else None,
        others={other: np.concatenate([part.others[other] for part in parts]) for other in others},
        places=tuple(place for part in parts for place in part.places),
        files=np.concatenate([part.files for part in parts]),
        left_out=tuple(place for part in parts for place in part.left_out),
    )
