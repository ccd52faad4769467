"""Computation of the error budget of a finished run, including the results of probe runs."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from sa_solver.transforms.threads import at_once
from sa_solver.types import Array, Progress, unseen
from workflow.analyses.wear.budget.companions import Companions, late, scaled
from workflow.analyses.wear.budget.lives import LIFE_FAILURES, Worn
from workflow.analyses.wear.budget.parts import Errors, errors_of
from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.output.outcome import Outcome
from workflow.analyses.wear.structures import structure_of
from workflow.models.loads import LoadSource
from workflow.models.structure import StructureLoads
from workflow.shell.processes import WorkerProcess
from workflow.shell.terminal.reporter import Reporter

Lives = dict[str, Worn]  # by part
Told = tuple[Lives, float, list[tuple[str, str]]]  # how fast loads rest, parts that failed and why
Begun = Callable[[Array, Progress], Lives]


def error_budget(outcome: Outcome, reporter: Reporter, begun: Begun) -> dict[str, Errors]:
    """Return the errors of the main results by interface, each by its sources.

    ``begun`` returns the results of the probe runs.
    """
    with reporter.stage("error budget", "short lives") as progress:
        lives = begun(followed(outcome), progress)
        names = [contact.stage.name for contact in outcome.interfaces]
        probed = [{part: by_name[name] for part, by_name in lives.items()} for name in names]
        errors = at_once(
            [
                partial(errors_of, outcome.case, contact, outcome.source.peak, told)
                for contact, told in zip(outcome.interfaces, probed, strict=True)
            ]
        )
        return dict(zip(names, errors, strict=True))


def lives_of_companions(
    case: WearCase, source: LoadSource, reporter: Reporter, beside: WorkerProcess
) -> Begun:
    """Return a function for the errors from probe runs, given when the loads followed wear.

    Errors are left out if the case requests no probe runs, and for parts whose probe run fails.
    Probe runs start at once in a worker process, unless this needs a copy of a large structure:
    then they start when the function is called (see :func:`followed`).
    """
    if case.error_budget == "known" or case.contact.method == "nodes":
        return lambda *_: {}
    companions: Companions[Any] = Companions.of(case, structure_of(case).finer(case), source.line)

    def heard(told: Told, shares: Array) -> Lives:
        lives, rest, failures = told
        for part, error in failures:
            reporter.log(f"error budget: {part} unknown, because a probe run failed: {error}")
        if "coupling" in lives:
            lives["coupling"] = scaled(lives["coupling"], late(rest, shares))
        return lives

    of = case, companions, source if companions.same else None
    if companions.same and not (source.line and isinstance(source, StructureLoads)):
        return lambda shares, progress: heard(_lived(*of, progress), shares)
    answer = beside.begin(_lived, *of)
    return lambda shares, _: heard(answer(), shares)


def _lived(
    case: WearCase,
    companions: Companions[Any],
    source: LoadSource | None,
    progress: Progress = unseen,
) -> Told:
    """Return the errors from the probe runs of a case; ``source`` is that of its own structure."""
    failures: list[tuple[str, str]] = []

    def failed(part: str, error: Exception) -> None:
        failures.append((part, str(error)))

    try:
        source_of = structure_of(case).source
        return *companions.errors(source, source_of, failed, progress), failures
    except LIFE_FAILURES as error:
        failed("mesh, grid and coupling", error)
        return {}, 0.0, failures


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
