"""Translation of a wear case into a model that runs without the case."""

from __future__ import annotations

from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.structures import structure_of
from workflow.analyses.wear.translation import model_with
from workflow.case.sections import Case
from workflow.errors import UserError
from workflow.models.loads import LoadSource
from workflow.models.wear import WearModel
from workflow.shell.folders.cache import DiskStore


def wear_model(case: Case) -> WearModel:
    """Return the model that a case describes: structure, contacts, wear and stress.

    Raises UserError for a case of another kind.
    """
    if not isinstance(case, WearCase):
        raise UserError(
            "only the wear of contacts has such a model; allowed: cases of analysis wear of a "
            "dovetail, a mesh, resultants or bodies"
        )
    return model_with(case, structure_of(case).model(case))


def loads_of(case: WearCase) -> LoadSource:
    """Return the loads of the contacts of a case; condensed parts are in the user's cache."""
    return wear_model(case).loads(DiskStore())
