"""Outcome of a wear run, before any of it is written."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from wear.coupled_state import CoupledState
from workflow.analyses.wear.case.base import WearCase
from workflow.models.budget.outcome import InterfaceOutcome
from workflow.models.loads import LoadSource
from workflow.models.wear import WearModel


@dataclass(frozen=True)
class Outcome:
    """Outcome of a wear run: its ``state`` at the end, and the contact of every interface."""

    case: WearCase
    model: WearModel
    source: LoadSource
    state: CoupledState[Any]
    interfaces: list[InterfaceOutcome]
