"""Models from cases."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from workflow.analyses.vibration.model import vibration_model as vibration
from workflow.analyses.wear.model import wear_model as wear
from workflow.interface.cases import AnyCase, load_case
from workflow.models.vibration.model import VibrationModel
from workflow.models.wear import WearModel
from workflow.shell.terminal.reporter import Reporter
from workflow.shell.terminal.screen import Loudness


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
    return wear(load_case(case, **overrides))


def vibration_model(case: AnyCase, /, **overrides: Any) -> VibrationModel:
    """Return the model that a vibration case describes, to be changed and run in Python.

    Loops, backbones, modes, stability and further branches of the case are not part of the model.
    Takes the arguments of :func:`fretscale.load_case`. Raises :class:`CaseError` for an invalid
    case, and :class:`UserError` for a case of another kind.

    Examples
    --------
    Two masses with a friction joint that is half as stiff:

    >>> from dataclasses import replace
    >>> import fretscale
    >>> model = fretscale.vibration_model("cases/rig_two_dof.yaml")
    >>> print(model.sweep.span, model.law.friction)
    (20.0, 400.0) 0.88
    >>> softer = replace(model, law=replace(model.law, stiffness=0.5 * model.law.stiffness))
    """
    loaded = load_case(case, **overrides)
    with TemporaryDirectory() as folder:
        log = Path(folder, "run.log")
        with closing(Reporter(log, loudness=Loudness.QUIET)) as reporter:
            return vibration(loaded, reporter)
