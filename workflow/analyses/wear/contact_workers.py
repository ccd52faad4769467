"""Contact stages in processes of their own, one for each interface."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import Any

from wear.stepping import ContactFailure
from workflow.analyses.wear.contact_stage import ContactStage, StageSettings
from workflow.shell.processes import Workers, workers


def contact_workers(settings: Sequence[StageSettings]) -> AbstractContextManager[Workers]:
    """Start a worker for every interface and end them all at the end."""
    return workers(_NamedStage, settings)


class _NamedStage:
    """A contact stage whose failures name it."""

    def __init__(self, settings: StageSettings) -> None:
        self._stage = ContactStage(settings)

    def __call__(self, method: str, *arguments: Any) -> Any:
        try:
            return getattr(self._stage, method)(*arguments)
        except ContactFailure as error:
            raise ContactFailure(f"{self._stage.name}: {error}") from error
