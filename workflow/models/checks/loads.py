"""Check of the loads of any source, which may be a user's own, before contacts wear by them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.load_history import LoadHistory
from sa_solver.types import Array
from wear.contact.face_loads import FaceLoads

if TYPE_CHECKING:
    from workflow.models.loads import LoadSource

# Share of the largest normal force up to which a negative one is rounding.
ROUNDING = 1e-9


def check_loads(loads: LoadSource, unworn: Sequence[FaceLoads]) -> None:
    """Raise InputError unless ``unworn`` are closed cycles of the faces of ``loads``."""
    names = [face.face.name for face in loads.faces]
    if not names or len(set(names)) < len(names):
        raise InputError(f"faces are called {names}: give one or more, each by its own name")
    if not isinstance(unworn, Sequence) or len(unworn) != len(names):
        raise InputError(
            f"the unworn loads are {checks.shown(unworn)}: give one cycle for each of the "
            f"{len(names)} faces"
        )
    for name, face, cycle in zip(names, loads.faces, unworn, strict=True):
        if face.face.line != loads.line:
            kinds = {True: "a line contact", False: "not a line contact"}
            raise InputError(
                f"{name} is {kinds[face.face.line]}, but its source of loads is "
                f"{kinds[bool(loads.line)]}: give both the same `line`"
            )
        check_history(name, cycle.loads, ROUNDING)
        check_slip(name, cycle.slip, cycle.loads, len(face.face))
        checks.whole("the increment of peak load", loads.peak, least=0, most=len(cycle.loads.P) - 1)


def check_history(name: str, history: LoadHistory, rounding: float = 0.0) -> None:
    """Raise InputError unless the loads of a face are finite numbers that press its bodies.

    Negative forces up to a ``rounding`` share of the largest one are accepted.
    """
    forces = checks.array(f"resultants of {name}", history.resultants, (None, 6))
    checks.array(f"energies of {name}", [history.Edx, history.Edy], (2, None))
    if (least := forces[:, 0].min()) < -rounding * np.abs(forces[:, 0]).max():
        raise InputError(f"{name}: P = {least:g} N pulls the bodies apart: give 0 or more")


def check_slip(name: str, slip: Array, history: LoadHistory, nodes: int) -> None:
    """Raise InputError unless the slips of a face are those of all increments and nodes."""
    checks.array(f"slips of {name}", slip, (len(history), 2, nodes))
