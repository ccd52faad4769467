"""What each approximation of a run is estimated to leave of its main results.

Errors are relative. Of some parts the sign is known, positive where the run tells too much; the
others may all be of one. A part that nobody knows is None, one that a run does not have is missing.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import hypot

import numpy as np

from sa_solver.types import Array
from workflow.analyses.wear.case.base import FiniteElementCase, WearCase
from workflow.analyses.wear.layout import PRESSURES, WORN
from workflow.analyses.wear.outcome import InterfaceOutcome

# How often the energy and the pressure count in a fretting parameter: Ruiz's is work times tension,
# that of Smith, Watson and Topper stress times strain, that of Findley a stress.
POWERS = {"ruiz": (1, 1), "smith_watson_topper": (0, 2), "findley": (0, 1)}
# The contact solver's tolerance leaves so much of itself: at most 0.35 of depth and volume was
# found, for tolerances from 1e-3 to 1e-6 on two dovetails' flanks.
LEFT_BY_TOLERANCE = 0.5
# Parts are known to about a half of themselves: so much is left where their signs cancel.
UNCERTAIN = 0.5


@dataclass(frozen=True)
class ResultError:
    """Estimated error of one result by its ``parts``, relative, those ``signed`` with a sign."""

    parts: Mapping[str, float | None]
    signed: frozenset[str] = frozenset()

    @property
    def total(self) -> float:
        """Root mean square of what all known parts may leave together.

        (Σ s)² + u² Σ s² + (Σ e)² over parts s of known sign, each of them off by a share u of
        itself, and sizes e of the others.
        """
        known = {name: part for name, part in self.parts.items() if part is not None}
        signs = [part for name, part in known.items() if name in self.signed]
        sizes = [part for name, part in known.items() if name not in self.signed]
        return hypot(sum(signs), UNCERTAIN * hypot(*signs), sum(sizes))

    @property
    def unknown(self) -> list[str]:
        """Parts of which nothing is known."""
        return [name for name, part in self.parts.items() if part is None]

    @property
    def largest(self) -> list[tuple[str, float]]:
        """Known parts, the largest first."""
        known = [(name, part) for name, part in self.parts.items() if part is not None]
        return sorted(known, key=lambda pair: -abs(pair[1]))


Errors = dict[str, ResultError]  # by result
Probed = Mapping[str, Mapping[str, float]]  # by part and result
ByResult = Mapping[str, float | None]
# Parts whose signs are known, by result: energies, and what lives tell, but for pressures at worn
# edges. Steps and increments make some places of a surface too deep and others too shallow.
SIGNED = {
    "depth": frozenset({"link", "mesh", "grid", "coupling"}),
    "volume": frozenset({"link", "mesh", "increments", "grid", "coupling"}),
    "peak_pressure": frozenset({"mesh", "grid"}),
}


def errors_of(case: WearCase, contact: InterfaceOutcome, peak: int, probed: Probed) -> Errors:
    """Errors of one contact; ``probed`` are those that lives of companions told of some parts."""
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
    """What the half-space makes else of the structure's loads: energies, and what a fit leaves."""
    link = contact.first.link
    if not link.corrects:
        return _told(probed, "link", WORN | PRESSURES)
    structural, on_grid = contact.unworn.loads.mean_energy, float(contact.first.energy.sum())
    apart = (on_grid - structural) / structural if structural > 0.0 else 0.0
    if "mesh" in probed:  # which has the misfit in it
        return dict.fromkeys(WORN, apart)
    return {**dict.fromkeys(WORN, apart), **dict.fromkeys(PRESSURES, float(link.quality[1]))}


def _grid(case: WearCase, contact: InterfaceOutcome, peak: int, probed: Probed) -> ByResult:
    """Return the error due to the grid: of a peak from its neighbours where no probe run tells.

    Lives slide wherever their loads have them slide. In partial slip the border of the zone that
    sticks comes to what they tell, and is what is known where they tell nothing.
    """
    told = _told(probed, "grid", (*WORN, "peak_pressure"))
    if case.contact.method == "full":
        border = contact.border_error
        told |= {name: None if border is None else _with(told[name], border[name]) for name in WORN}
    if told["peak_pressure"] is None:
        told["peak_pressure"] = -peak_left(contact.first.pressure[peak])
    return told | {"worn_peak_pressure": peak_left(contact.end.pressure[peak])}


def _with(told: float | None, border: float) -> float | None:
    """The error that lives have told and that of a border, 0 where there is none."""
    return told if border == 0.0 else border + (told or 0.0)


def _told(probed: Probed, part: str, results: Iterable[str]) -> dict[str, float | None]:
    """What lives have told of a part."""
    return {result: probed[part][result] if part in probed else None for result in results}


def _by_result(left: Mapping[str, float] | None, *names: str) -> ByResult:
    """Estimates by the names that they have for depth, volume and worn peak pressure."""
    results = (*WORN, "worn_peak_pressure")
    return {r: None if left is None else left[name] for r, name in zip(results, names, strict=True)}


def _sum(n: int, first: float | None, m: int, second: float | None) -> float | None:
    """So many times one and so many times the other; None where one of them is not known."""
    if (n and first is None) or (m and second is None):
        return None
    return n * abs(first or 0.0) + m * abs(second or 0.0)


def peak_left(pressure: Array) -> float:
    """By how much cells of twice the size would show less of the peak of a ``pressure`` (nx, ny).

    A smooth peak has nearly the same mean over them; one at an edge, which has no limit, is told by
    it. 0 where nothing is pressed.
    """
    means = pressure
    for axis in (0, 1):
        if pressure.shape[axis] > 1:
            first, last = np.delete(means, 0, axis), np.delete(means, -1, axis)
            means = 0.5 * (first + last)
    peak = float(pressure.max())
    return 1.0 - float(means.max()) / peak if peak > 0.0 else 0.0
