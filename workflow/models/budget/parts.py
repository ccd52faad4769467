"""Estimated error of the main results due to each approximation of a run.

Errors are relative. Some parts have a known sign, positive where the run's value is too large; the
others may all have the same sign. A part is None if it is unknown, and missing if a run does not
have this approximation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from math import hypot

import numpy as np

from sa_solver.types import Array
from workflow.models.budget import names
from workflow.models.budget.names import PRESSURES, WORN
from workflow.models.budget.outcome import InterfaceOutcome
from workflow.models.budget.probe_models import structure_of
from workflow.models.contact import Contact
from workflow.models.loads import LoadSource, UncoupledSource
from workflow.models.uncoupled.body_pair import BodyPairSource
from workflow.models.wear import WearModel

# Errors due to the contact solver's tolerance, relative to the tolerance. In depth and volume at
# most 0.35 was found for tolerances from 1e-3 to 1e-6 on the flanks of two dovetails, and 6 in a
# cylinder in partial slip that is worn to its limit; in pressures, for 5e-5, 1.1 on unworn and 32
# on worn contacts (dovetails, a ball and a cylinder).
ERROR_PER_TOLERANCE, ON_PRESSURES = 10.0, {"peak_pressure": 2.0, "worn_peak_pressure": 50.0}
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

    @property
    def numbers(self) -> dict[str, float | None]:
        """All parts and their ``total``; None for unknown ones."""
        return {**self.parts, "total": self.total}


ErrorByResult = Mapping[str, float | None]


@dataclass(frozen=True)
class ContactErrors:
    """Errors of one contact of a run due to each approximation.

    ``source`` are the loads of the run, and ``probed`` are errors from probe runs. Each method
    returns the errors by result, or None if the run does not have this approximation.
    """

    model: WearModel
    source: LoadSource
    contact: InterfaceOutcome
    probed: Mapping[str, Mapping[str, float]]  # by part and result

    @property
    def settings(self) -> Contact:
        """Settings of the contact."""
        return self.model.contact(self.contact.stage.name)

    @property
    def half_spaces(self) -> bool:
        """True if both bodies are true half-spaces; for other loads half-spaces are a model."""
        return isinstance(self.source, BodyPairSource)

    def link(self) -> ErrorByResult | None:
        """Return the mean difference of energies, unworn and worn, and the error of the fit."""
        if self.half_spaces or self.settings.method == "nodes":
            return None
        link = self.contact.first.link
        if not link.corrects:
            return self._from_probes("link", WORN | PRESSURES)
        unworn, end = self.contact.unworn.loads, self.contact.end
        worn = float(end.rubbed.sum()) * self.contact.stage.grid.cell_area
        # The difference changes as edges wear, so its mean over the run is that of both ends.
        apart = 0.5 * (
            _apart(float(self.contact.first.energy.sum()), unworn.mean_energy)
            + _apart(worn, end.loads.mean_energy)
        )
        if "mesh" in self.probed:  # which includes the misfit
            return dict.fromkeys(WORN, apart)
        misfit = float(link.quality[1])
        return {**dict.fromkeys(WORN, apart), **dict.fromkeys(PRESSURES, misfit)}

    def mesh(self) -> ErrorByResult | None:
        return None if self.half_spaces else self._from_probes("mesh", WORN | PRESSURES)

    def slot(self) -> ErrorByResult | None:
        structure = structure_of(self.model)
        if structure is None or structure.along_slot() is None:
            return None
        return self._from_probes("slot", WORN | PRESSURES)

    def increments(self) -> ErrorByResult:
        return _by_result(self.contact.increments_error, "depth", "energy", "depth")

    def grid(self) -> ErrorByResult | None:
        """Return the errors from probe runs, or from neighbouring cells without any.

        Probe runs slide wherever their loads slide. In partial slip the error due to the border of
        the stick zone is added, and is the only known part without probe runs.
        """
        contact, method = self.contact, self.settings.method
        if method == "nodes":
            return None
        errors = self._from_probes("grid", (*WORN, "peak_pressure"))
        if method == "full":
            for name in WORN:
                errors[name] = _with_border(errors[name], contact.border_error, name)
        if errors["peak_pressure"] is None:
            errors["peak_pressure"] = -peak_lowered(contact.first.pressure[self.source.peak])
        return errors | {"worn_peak_pressure": peak_lowered(contact.end.pressure[self.source.peak])}

    def steps(self) -> ErrorByResult:
        return _by_result(self.contact.step_error, "depth", "volume", "pressure")

    def coupling(self) -> ErrorByResult | None:
        if isinstance(self.source, UncoupledSource) or self.settings.method == "nodes":
            return None
        return self._from_probes("coupling", WORN)

    def solver(self) -> ErrorByResult:
        per_tolerance = dict.fromkeys(WORN, ERROR_PER_TOLERANCE) | ON_PRESSURES
        return {name: ratio * self.settings.tolerance for name, ratio in per_tolerance.items()}

    def _from_probes(self, part: str, results: Iterable[str]) -> dict[str, float | None]:
        """Return the errors of a part from probe runs, or None where there are none."""
        errors = self.probed.get(part)
        return {result: None if errors is None else errors[result] for result in results}


def _apart(on_grid: float, structural: float) -> float:
    """Return how much larger the energy on the grid is than the structure's, relative to that."""
    return (on_grid - structural) / structural if structural > 0.0 else 0.0


def _with_border(
    probed: float | None, border: Mapping[str, float] | None, name: str
) -> float | None:
    """Return the sum of a probed error and that of a border, which may be unknown or 0."""
    if border is None:
        return None
    return probed if border[name] == 0.0 else border[name] + (probed or 0.0)


def _by_result(estimate: Mapping[str, float] | None, *names: str) -> ErrorByResult:
    """Return estimates by result, given their names for depth, volume and worn peak pressure."""
    results = (*WORN, "worn_peak_pressure")
    return {
        result: None if estimate is None else estimate[name]
        for result, name in zip(results, names, strict=True)
    }


def peak_lowered(pressure: Array) -> float:
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


@dataclass(frozen=True)
class BudgetPart:
    """Part of the budget: its ``errors`` of a contact, of which ``signed`` ones have a known sign.

    ``errors`` returns None where a run does not have the approximation.
    """

    errors: Callable[[ContactErrors], ErrorByResult | None]
    signed: tuple[str, ...] = ()


# Results whose error has a known sign. Steps and increments make some places of a surface too deep
# and others too shallow. Nothing is known of the sign at worn edges, nor of that due to the mesh
# along the slot, which is compared on few nodes across it.
VOLUME = ("volume",)
WEAR = "depth", *VOLUME
WEAR_AND_PEAK = *WEAR, "peak_pressure"

PARTS = {
    "link": BudgetPart(ContactErrors.link, WEAR),
    "mesh": BudgetPart(ContactErrors.mesh, WEAR_AND_PEAK),
    "slot": BudgetPart(ContactErrors.slot),
    "increments": BudgetPart(ContactErrors.increments, VOLUME),
    "grid": BudgetPart(ContactErrors.grid, WEAR_AND_PEAK),
    "steps": BudgetPart(ContactErrors.steps),
    "coupling": BudgetPart(ContactErrors.coupling, WEAR),
    "solver": BudgetPart(ContactErrors.solver),
}
"""Parts of the budget by name."""

assert tuple(PARTS) == names.PARTS
