"""Models from cases."""

from __future__ import annotations

from typing import Any

from workflow.analyses.wear.model import wear_model as translated
from workflow.interface.cases import AnyCase, load_case
from workflow.models.wear import WearModel


def wear_model(case: AnyCase, /, **overrides: Any) -> WearModel:
    """Return the model that a wear case describes, to be changed and run in Python.

    Takes the arguments of :func:`fretscale.load_case`. Raises :class:`CaseError` for an invalid
    case, and :class:`UserError` for a case of another kind.

    Examples
    --------
    The same joint with another coefficient of friction on both flanks:

    >>> from dataclasses import replace
    >>> import fretscale
    >>> model = fretscale.wear_model("cases/dovetail_2d.yaml")
    >>> smoother = replace(model, contacts=replace(model.contacts, friction=0.2))
    >>> print(*(of.contact("intrados").coulomb.coefficient for of in (model, smoother)))
    0.4 0.2
    """
    return translated(load_case(case, **overrides))
