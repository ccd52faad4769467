"""Estimated error of the main results due to each approximation of a run.

Errors are relative. Some parts have a known sign, positive where the run's value is too large; the
others may all have the same sign. A part is None if it is unknown, and missing if a run does not
have this approximation.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import hypot

import numpy as np

from sa_solver.types import Array
from workflow.analyses.wear.case.base import FiniteElementCase, WearCase
from workflow.analyses.wear.output.layout import PRESSURES, WORN
from workflow.analyses.wear.output.outcome import InterfaceOutcome

# Powers of energy and pressure in a fretting parameter: Ruiz's is work times tension, that of
# Smith, Watson and Topper stress times strain, that of Findley a stress.
POWERS = {"ruiz": (1, 1), "smith_watson_topper": (0, 2), "findley": (0, 1)}
# Error due to the contact solver's tolerance, relative to the tolerance: at most 0.35 was found in
# depth and volume, for tolerances from 1e-3 to 1e-6 on the flanks of two dovetails.
LEFT_BY_TOLERANCE = 0.5
# Relative uncertainty of parts, which remains where their signs cancel.
UNCERTAIN = 0.5


@dataclass(frozen=True)
class ResultError:
    """Estimated relative error of one result by ``parts``, of which the ``signed`` have a sign."""

    parts: Mapping[str, float | None]
    signed: frozenset[str] = frozenset()

    @property
    def total(self) -> float:
        """Root mean square of the error that all known parts may cause together.

        (Σ s)² + u² Σ s² + (Σ e)² over parts s of known sign, each with a relative uncertainty u,
        and sizes e of the others.
        """
        known = {name: part for name, part in self.parts.items() if part is not None}
        signs = [part for name, part in known.items() if name in self.signed]
        sizes = [part for name, part in known.items() if name not in self.signed]
        return hypot(sum(signs), UNCERTAIN * hypot(*signs), sum(sizes))

    @property
    def unknown(self) -> list[str]:
        """Names of the unknown parts."""
        return [name for name, part in self.parts.items() if part is None]

    @property
    def largest(self) -> list[tuple[str, float]]:
        """Known parts, the largest first."""
        known = [(name, part) for name, part in self.parts.items() if part is not None]
        return sorted(known, key=lambda pair: -abs(pair[1]))


Errors = dict[str, ResultError]  # by result
Probed = Mapping[str, Mapping[str, float]]  # by part and result
ByResult = Mapping[str, float | None]
# Parts with known signs, by result: energies and the errors from probe runs, except for pressures
# at worn edges. Steps and increments make some places of a surface too deep and others too shallow.
SIGNED = {
    "depth": frozenset({"link", "mesh", "grid", "coupling"}),
    "volume": frozenset({"link", "mesh", "increments", "grid", "coupling"}),
    "peak_pressure": frozenset({"mesh", "grid"}),
}


def errors_of(case: WearCase, contact: InterfaceOutcome, peak: int, probed: Probed) -> Errors:
    """Return the errors of one contact; ``probed`` are those of some parts, from probe runs."""
    solver = LEFT_BY_TOLERANCE * case.contact.tolerance
    parts: dict[str, ByResult] = {
        "link": _link(contact, probed),
        "mesh": _told(probed, "mesh", WORN | PRESSURES),
        "increments": _by_result(contact.increments_error, "depth", "energy", "depth"),
        "grid": _grid(case, contact, peak, probed),
        "steps": _by_result(contact.step_error, "depth", "volume", "pressure"),
        "solver": dict.fromkeys(WORN | PRESSURES, solver),
    }
    if isinstance(case, FiniteElementCase) and case.contact.method != "nodes":
        parts["coupling"] = _told(probed, "coupling", WORN)
    if case.half_spaces:
        del parts["link"], parts["mesh"]
    if case.contact.method == "nodes":
        del parts["link"], parts["grid"]
    errors = {result: _error(parts, result) for result in (*WORN, *PRESSURES)}
    if case.stress.life.parameter in POWERS:
        of_work, of_stress = POWERS[case.stress.life.parameter]
        work, stress = errors["depth"].parts, errors["worn_peak_pressure"].parts
        errors["life"] = ResultError(
            {part: _sum(of_work, work[part], of_stress, stress.get(part, 0.0)) for part in work}
        )
    return errors


def _error(parts: Mapping[str, ByResult], result: str) -> ResultError:
    signed = SIGNED.get(result, frozenset())
    told = {part: by[result] for part, by in parts.items() if result in by}
    sizes = {
        part: value if value is None or part in signed else abs(value)
        for part, value in told.items()
    }
    return ResultError(sizes, signed)


def _link(contact: InterfaceOutcome, probed: Probed) -> ByResult:
    """Return the error due to the link: the difference of energies, and the error of the fit."""
    link = contact.first.link
    if not link.corrects:
        return _told(probed, "link", WORN | PRESSURES)
    structural, on_grid = contact.unworn.loads.mean_energy, float(contact.first.energy.sum())
    apart = (on_grid - structural) / structural if structural > 0.0 else 0.0
    if "mesh" in probed:  # which includes the misfit
        return dict.fromkeys(WORN, apart)
    return {**dict.fromkeys(WORN, apart), **dict.fromkeys(PRESSURES, float(link.quality[1]))}


def _grid(case: WearCase, contact: InterfaceOutcome, peak: int, probed: Probed) -> ByResult:
    """Return the error due to the grid, from neighbouring cells if there is no probe run.

    Probe runs slide wherever their loads slide. In partial slip the error due to the border of the
    stick zone is added, and is the only known part without probe runs.
    """
    told = _told(probed, "grid", (*WORN, "peak_pressure"))
    if case.contact.method == "full":
        border = contact.border_error
        told |= {name: None if border is None else _with(told[name], border[name]) for name in WORN}
    if told["peak_pressure"] is None:
        told["peak_pressure"] = -peak_left(contact.first.pressure[peak])
    return told | {"worn_peak_pressure": peak_left(contact.end.pressure[peak])}


def _with(told: float | None, border: float) -> float | None:
    """Return the sum of a probed error and that of a border, which may be 0."""
    return told if border == 0.0 else border + (told or 0.0)


def _told(probed: Probed, part: str, results: Iterable[str]) -> dict[str, float | None]:
    """Return the errors of a part from probe runs, or None where there are none."""
    return {result: probed[part][result] if part in probed else None for result in results}


def _by_result(left: Mapping[str, float] | None, *names: str) -> ByResult:
    """Return estimates by result, given their names for depth, volume and worn peak pressure."""
    results = (*WORN, "worn_peak_pressure")
    return {r: None if left is None else left[name] for r, name in zip(results, names, strict=True)}


def _sum(n: int, first: float | None, m: int, second: float | None) -> float | None:
    """Return ``n`` times one part plus ``m`` times another, or None if one of them is unknown."""
    if (n and first is None) or (m and second is None):
        return None
    return n * abs(first or 0.0) + m * abs(second or 0.0)


def peak_left(pressure: Array) -> float:
    """Return by how much cells of twice the size would lower the peak of ``pressure`` (nx, ny).

    A smooth peak has nearly the same mean over these cells; a peak at an edge, which has no limit,
    is lowered much. The result is 0 where nothing is pressed.
    """
    means = pressure
    for axis in (0, 1):
        if pressure.shape[axis] > 1:
            first, last = np.delete(means, 0, axis), np.delete(means, -1, axis)
            means = 0.5 * (first + last)
    peak = float(pressure.max())
    return 1.0 - float(means.max()) / peak if peak > 0.0 else 0.0
