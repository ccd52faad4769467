"""The error budget of a finished run, with what short lives of companions tell beside it."""

from __future__ import annotations

from typing import Any

import numpy as np

from workflow.analyses.wear.budget.companions import Companions
from workflow.analyses.wear.budget.lives import LIFE_FAILURES, Worn
from workflow.analyses.wear.budget.parts import Errors, errors_of
from workflow.analyses.wear.outcome import Outcome
from workflow.analyses.wear.structures import structure_of
from workflow.shell.reporter import Reporter

Lives = dict[str, Worn]  # by part


def error_budget(outcome: Outcome, reporter: Reporter) -> dict[str, Errors]:
    """Errors of the main results by interface, each by what leaves them."""
    with reporter.stage("error budget"):
        lives = lives_of_companions(outcome, reporter)
        return {
            contact.stage.name: errors_of(
                outcome.case,
                contact,
                outcome.source.peak,
                {part: by_name[contact.stage.name] for part, by_name in lives.items()},
            )
            for contact in outcome.interfaces
        }


def lives_of_companions(outcome: Outcome, reporter: Reporter) -> Lives:
    """What companions tell; nothing where none are asked for, or of parts that fail."""
    case = outcome.case
    if case.error_budget == "known" or case.contact.method == "nodes":
        return {}
    structure, source = structure_of(case), outcome.source
    companions: Companions[Any] = Companions.of(case, structure.finer(case), source.line)

    def failed(part: str, error: Exception) -> None:
        reporter.log(f"error budget: {part} unknown, a short life failed: {error}")

    try:
        told = companions.errors(source, structure.source, failed)
    except LIFE_FAILURES as error:
        failed("mesh, grid and coupling", error)
        return {}
    if "coupling" in told:
        told["coupling"] = _scaled(told["coupling"], missed(outcome))
    return told


def missed(outcome: Outcome) -> float:
    """Share of what wear does to the loads in a run that its contacts do not feel.

    Loads that drift steadily act too late by half of the cycles to the next solution, if there is
    one: of a run with none all is missed, else the sum of the squares of the parts.
    """
    coupling, state = outcome.case.recoupling, outcome.state
    solved = {
        "constant": np.zeros(len(state.cycles), dtype=bool),
        "every": np.ones(len(state.cycles), dtype=bool),
        "drift": state.drift > coupling.drift,
    }[coupling.resultants]
    end = state.cycles[-1]
    parts = np.diff([0.0, *state.cycles[solved], end]) / end if end > 0.0 else np.zeros(1)
    return float(np.sum(parts**2))


def _scaled(worn: Worn, share: float) -> Worn:
    return {
        name: {key: share * value for key, value in numbers.items()}
        for name, numbers in worn.items()
    }
