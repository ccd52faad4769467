"""The error budget of a finished run, with what short lives of companions tell beside it."""

from __future__ import annotations

from typing import Any

from wear.interface import MotionError
from workflow.analyses.wear.budget.companions import Companions
from workflow.analyses.wear.budget.lives import FAILURES, Worn
from workflow.analyses.wear.budget.parts import Errors, errors_of
from workflow.analyses.wear.outcome import Outcome
from workflow.analyses.wear.structures import structure_of
from workflow.errors import UserError
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
    """What companions tell; nothing where none are asked for, or they fail."""
    case = outcome.case
    if case.error_budget == "known" or case.contact.method == "nodes":
        return {}
    structure, source = structure_of(case), outcome.source
    companions: Companions[Any] = Companions.of(case, structure.finer(case), source.line)
    try:
        return companions.errors(source, structure.source)
    except (*FAILURES, MotionError, UserError) as error:
        reporter.log(f"error budget: mesh and grid stay unknown, a short life failed: {error}")
        return {}
