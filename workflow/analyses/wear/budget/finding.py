"""The error budget of a finished run, with what short lives of companions tell beside it."""

from __future__ import annotations

from typing import Any

import numpy as np

from sa_solver.types import Array, Progress, unseen
from workflow.analyses.wear.budget.companions import Companions
from workflow.analyses.wear.budget.lives import LIFE_FAILURES, Worn
from workflow.analyses.wear.budget.parts import Errors, errors_of
from workflow.analyses.wear.outcome import Outcome
from workflow.analyses.wear.structures import structure_of
from workflow.shell.reporter import Reporter

Lives = dict[str, Worn]  # by part


def error_budget(outcome: Outcome, reporter: Reporter) -> dict[str, Errors]:
    """Errors of the main results by interface, each by what leaves them."""
    with reporter.stage("error budget", "short lives") as told:
        lives = lives_of_companions(outcome, reporter, told)
        return {
            contact.stage.name: errors_of(
                outcome.case,
                contact,
                outcome.source.peak,
                {part: by_name[contact.stage.name] for part, by_name in lives.items()},
            )
            for contact in outcome.interfaces
        }


def lives_of_companions(outcome: Outcome, reporter: Reporter, progress: Progress = unseen) -> Lives:
    """What companions tell; nothing where none are asked for, or of parts that fail."""
    case = outcome.case
    if case.error_budget == "known" or case.contact.method == "nodes":
        return {}
    structure, source = structure_of(case), outcome.source
    companions: Companions[Any] = Companions.of(case, structure.finer(case), source.line)

    def failed(part: str, error: Exception) -> None:
        reporter.log(f"error budget: {part} unknown, a short life failed: {error}")

    try:
        return companions.errors(source, structure.source, followed(outcome), failed, progress)
    except LIFE_FAILURES as error:
        failed("mesh, grid and coupling", error)
        return {}


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
