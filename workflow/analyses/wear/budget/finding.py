"""Computation of the error budget of a finished run, including the results of probe runs."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from sa_solver.transforms.threads import run_parallel
from sa_solver.types import Array, Progress, unseen
from workflow.analyses.wear.approximations.registry import PARTS
from workflow.analyses.wear.budget.parts import ContactErrors, ErrorByResult, ResultError
from workflow.analyses.wear.budget.probe_cases import ProbeCases, Probed, late, scaled
from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.model import loads_of
from workflow.analyses.wear.output import layout
from workflow.analyses.wear.output.outcome import Outcome
from workflow.analyses.wear.structures import structure_of
from workflow.models.loads import LoadSource
from workflow.models.structure import StructureLoads
from workflow.shell.processes import WorkerProcess
from workflow.shell.terminal.reporter import Reporter

# Powers of energy and pressure in a fretting parameter: Ruiz's is work times tension, that of
# Smith, Watson and Topper stress times strain, that of Findley a stress.
POWERS = {"ruiz": (1, 1), "smith_watson_topper": (0, 2), "findley": (0, 1)}

ProbeResults = Callable[[Progress], Probed]


def error_budget(
    outcome: Outcome, reporter: Reporter, probe_results: ProbeResults
) -> dict[str, dict[str, ResultError]]:
    """Return the errors of the main results by interface, each by its sources."""
    with reporter.stage("error budget", "probe runs") as progress:
        probed = probe_results(progress)
        for part, failure in probed.failures.items():
            reporter.log(f"error budget: {part} unknown, because a probe run failed: {failure}")
        by_part = dict(probed.errors)
        if "coupling" in by_part:
            lag = late(probed.rate, followed(outcome))
            by_part["coupling"] = {
                name: scaled(numbers, lag) for name, numbers in by_part["coupling"].items()
            }
        contacts = {
            contact.stage.name: ContactErrors(
                outcome.case,
                contact,
                outcome.source.peak,
                {part: by_name[contact.stage.name] for part, by_name in by_part.items()},
            )
            for contact in outcome.interfaces
        }
        errors = run_parallel([partial(errors_of, contact) for contact in contacts.values()])
        return dict(zip(contacts, errors, strict=True))


def errors_of(contact: ContactErrors) -> dict[str, ResultError]:
    """Return the errors of the results of one contact."""
    parts: dict[str, ErrorByResult] = {}
    for part in layout.PARTS:
        if (by_result := PARTS[part].errors(contact)) is not None:
            parts[part] = by_result
    results = (*layout.WORN, *layout.PRESSURES)
    errors = {result: _error(parts, result) for result in results}
    parameter = contact.case.stress.life.parameter
    if parameter in POWERS:
        of_work, of_stress = POWERS[parameter]
        work, stress = errors["depth"].parts, errors["worn_peak_pressure"].parts
        errors["life"] = ResultError(
            {part: _sum(of_work, work[part], of_stress, stress.get(part, 0.0)) for part in work}
        )
    return errors


def _error(parts: dict[str, ErrorByResult], result: str) -> ResultError:
    """Return the error of a result, without the sign of parts whose sign is unknown."""
    known = {part: by_result[result] for part, by_result in parts.items() if result in by_result}
    signed = frozenset(part for part in PARTS if result in PARTS[part].signed)
    return ResultError(
        {
            part: value if value is None or part in signed else abs(value)
            for part, value in known.items()
        },
        signed,
    )


def _sum(n: int, first: float | None, m: int, second: float | None) -> float | None:
    """Return ``n`` times one part plus ``m`` times another, or None if one of them is unknown."""
    if (n and first is None) or (m and second is None):
        return None
    return n * abs(first or 0.0) + m * abs(second or 0.0)


def begin_probe_runs(case: WearCase, source: LoadSource, worker: WorkerProcess) -> ProbeResults:
    """Return a function for the errors from probe runs; none if the case requests no probe runs.

    Probe runs start at once in a worker process, unless this needs a copy of a large structure:
    then they start when the function is called.
    """
    if case.error_budget == "known" or case.contact.method == "nodes":
        return lambda _: Probed()
    cases: ProbeCases[Any] = ProbeCases.of(case, structure_of(case), source.line)
    arguments = case, cases, source if cases.same else None
    if cases.same and not (source.line and isinstance(source, StructureLoads)):
        return partial(_probed, *arguments)
    answer = worker.begin(_probed, *arguments)
    return lambda _: answer()


def _probed(
    case: WearCase, cases: ProbeCases[Any], source: LoadSource | None, progress: Progress = unseen
) -> Probed:
    """Return the errors from the probe runs of a case; ``source`` is that of its own structure."""
    return cases.probed(source, loads_of, progress)


def followed(outcome: Outcome) -> Array:
    """Return shares of the run's cycles from one structural solution to the next, or the end."""
    coupling, state = outcome.case.recoupling, outcome.state
    solved = {
        "constant": np.zeros(len(state.cycles), dtype=bool),
        "every": np.ones(len(state.cycles), dtype=bool),
        "drift": state.drift > coupling.drift,
    }[coupling.resultants]
    end = float(state.cycles[-1])
    shares = np.diff([0.0, *state.cycles[solved], end]) / end if end > 0.0 else np.ones(1)
    return np.asarray(shares[shares > 0.0])
