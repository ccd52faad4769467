"""The error budget of a finished run, with what short lives of companions tell beside it."""

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
from workflow.analyses.wear.outcome import Outcome
from workflow.analyses.wear.structures import structure_of
from workflow.models.loads import LoadSource
from workflow.models.structure import StructureLoads
from workflow.shell.processes import Beside
from workflow.shell.reporter import Reporter

Lives = dict[str, Worn]  # by part
Told = tuple[Lives, float, list[tuple[str, str]]]  # how fast loads rest, parts that failed and why
Begun = Callable[[Array, Progress], Lives]


def error_budget(outcome: Outcome, reporter: Reporter, begun: Begun) -> dict[str, Errors]:
    """Errors of the main results by interface, each by what leaves them.

    ``begun`` are the lives of companions.
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
    case: WearCase, source: LoadSource, reporter: Reporter, beside: Beside
) -> Begun:
    """What companions tell, once it is known when loads followed wear (see :func:`followed`).

    Nothing where none are asked for, or of parts that fail. They begin to live at once, in a
    process beside this one, unless that would need a copy of a large structure: then when they are
    asked.
    """
    if case.error_budget == "known" or case.contact.method == "nodes":
        return lambda *_: {}
    companions: Companions[Any] = Companions.of(case, structure_of(case).finer(case), source.line)

    def heard(told: Told, shares: Array) -> Lives:
        lives, rest, failures = told
        for part, error in failures:
            reporter.log(f"error budget: {part} unknown, a short life failed: {error}")
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
    """What companions tell of a case, whose own ``source`` those have that live on it."""
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
    """Shares of the cycles of a run from one solution of its structure to the next, or the end."""
    coupling, state = outcome.case.recoupling, outcome.state
    solved = {
        "constant": np.zeros(len(state.cycles), dtype=bool),
        "every": np.ones(len(state.cycles), dtype=bool),
        "drift": state.drift > coupling.drift,
    }[coupling.resultants]
    end = float(state.cycles[-1])
    shares = np.diff([0.0, *state.cycles[solved], end]) / end if end > 0.0 else np.ones(1)
    return np.asarray(shares[shares > 0.0])
