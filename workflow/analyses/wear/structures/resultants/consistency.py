"""Consistency checks of the loads of an interface, whatever code they come from."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sa_solver.load_history import LoadHistory
from sa_solver.tangential.gross_slip import GROSS_SHARE
from sa_solver.types import Array, Mask
from workflow.analyses.wear.case.sections import SHARES_DIFFERENCE
from workflow.analyses.wear.structures.resultants.imported import COLUMNS
from workflow.case.files.input_files import InputFileError

# Numbers below this share of a column's largest value are remainders of an iterative solver.
REMAINDER = 1e-6
# Relative excess of forces over what the face can carry that is accepted: penalty friction and
# results with four digits cause it.
EXCESS = 1e-3

Refusal = Callable[[int, str, str, str], InputFileError]
"""Return the error for a column of an increment, from what is wrong and what is allowed."""


@dataclass(frozen=True)
class Bounds:
    """Known bounds of an interface: Coulomb's coefficient and the ``size`` of its face [mm]."""

    friction: float | None = None
    size: tuple[float, float] | None = None
    line: bool = False


def checked_loads(
    columns: dict[str, Any],
    sliding: Mask | None,
    mix: Mapping[str, Array],
    bounds: Bounds,
    refusal: Refusal,
) -> LoadHistory:
    """Return the loads of ``columns``, with marks of ``sliding`` increments and a mix if given.

    Raises the error of ``refusal`` for the first column ``(n,)`` that contradicts another.
    """
    _check_columns(columns, bounds, refusal)
    if sliding is None:
        sliding = _slides_by_limit(columns, bounds.friction)
    return LoadHistory(**columns, sliding=sliding, **_mix_columns(mix, refusal))


def _check_columns(columns: dict[str, Array], bounds: Bounds, refusal: Refusal) -> None:
    remainder = {name: REMAINDER * float(np.abs(columns[name]).max()) for name in COLUMNS}
    for name in ("P", "Edx", "Edy"):
        meaning = "body 1 presses on body 2" if name == "P" else "energy is lost, not gained"
        low = 0.0 if name == "P" else -remainder[name]
        _refuse_where(columns[name] < low, name, "negative", f"0 or more, {meaning}", refusal)
    _check_separated(columns, remainder, refusal)
    if bounds.line:
        _check_line(columns, refusal)
    if bounds.friction is not None:
        _check_friction(columns, bounds.friction, refusal)
    if bounds.size is not None:
        _check_moments(columns, bounds, refusal)


def _slides_by_limit(columns: dict[str, Array], friction: float | None) -> Mask:
    """Return the mask ``(n,)`` of increments that slide as a whole and lose energy.

    These are near Coulomb's limit, by the share that the contact solver uses as well. Without a
    known friction there are none.
    """
    P = columns["P"]
    if friction is None:
        return np.zeros(len(P), dtype=bool)
    shear = np.hypot(columns["Qx"], columns["Qy"])
    energy = columns["Edx"] + columns["Edy"]
    return (P > 0.0) & (energy > 0.0) & (shear >= GROSS_SHARE * friction * P)


MIX = ("block", "share")
"""Columns of files that hold several closed cycles, which take turns."""


def _mix_columns(columns: Mapping[str, Array], refusal: Refusal) -> dict[str, Any]:
    """Return ``block`` counted from 0 and ``share`` ``(n,)`` of a mix, from the file's columns.

    The result is empty if the file has neither. Raises the error of ``refusal`` unless the rows of
    a block are consecutive and have one share, and the shares add up to 1.
    """
    present = [name for name in MIX if name in columns]
    if not present:
        return {}
    if len(present) == 1:
        raise refusal(0, present[0], "given without the other", f"{' and '.join(MIX)}, or neither")
    names, share = (columns[name] for name in MIX)
    begins = np.flatnonzero(np.diff(names, prepend=np.nan) != 0.0)
    for number, row in enumerate(begins.tolist()):
        if names[row] in names[begins[:number]]:
            raise refusal(row, "block", "a block that had ended", "the rows of a block together")
    block = np.searchsorted(begins, np.arange(len(names)), side="right") - 1
    _refuse_where((share < 0.0) | (share > 1.0), "share", "out of range", "0 to 1", refusal)
    _refuse_where(share != share[begins][block], "share", "not as above", "one in a block", refusal)
    total = float(share[begins].sum())
    if abs(total - 1.0) > SHARES_DIFFERENCE:
        wrong = f"the shares of all blocks add up to {total:g}"
        raise refusal(len(share) - 1, "share", wrong, "to 1")
    return {"block": block, "share": share}


def _refuse_where(wrong: Mask, column: str, what: str, allowed: str, refusal: Refusal) -> None:
    for increment in np.flatnonzero(wrong).tolist():
        raise refusal(increment, column, what, allowed)


def _check_separated(
    columns: dict[str, Array], remainder: dict[str, float], refusal: Refusal
) -> None:
    """Refuse forces, moments and energies where the bodies are apart."""
    apart = columns["P"] == 0.0
    for name in COLUMNS[1:]:
        allowed = "0 where the bodies are apart"
        if name in ("Edx", "Edy"):
            allowed += "; let an increment end just before they separate"
        wrong = apart & (np.abs(columns[name]) > remainder[name])
        _refuse_where(wrong, name, "not zero though P is", allowed, refusal)


def _check_line(columns: dict[str, Array], refusal: Refusal) -> None:
    """Refuse moments of a line contact about other axes than its length: they have no lever arm."""
    for name in ("Mx", "Mz"):
        wrong = np.abs(columns[name]) > REMAINDER * columns["P"].max()
        _refuse_where(wrong, name, "moment of a line contact", "0 but for My", refusal)


def _check_friction(columns: dict[str, Array], friction: float, refusal: Refusal) -> None:
    P = columns["P"]
    shear = np.hypot(columns["Qx"], columns["Qy"])
    limit = friction * P
    wrong = shear > limit * (1.0 + EXCESS) + REMAINDER * friction * P.max()
    for increment in np.flatnonzero(wrong).tolist():
        name = max(("Qx", "Qy"), key=lambda column: abs(float(columns[column][increment])))
        raise refusal(
            increment,
            name,
            f"shear force {shear[increment]:.6g} above µP = {limit[increment]:.6g}",
            f"up to µP with µ = {friction:g}",
        )


def _check_moments(columns: dict[str, Array], bounds: Bounds, refusal: Refusal) -> None:
    """Refuse moments that put the centre of pressure or the shear outside the face."""
    assert bounds.size is not None
    half_x, half_y = 0.5 * bounds.size[0], 0.5 * bounds.size[1]
    arms = {"My": half_x} if bounds.line else {"Mx": half_y, "My": half_x}
    for name, arm in arms.items():
        _check_arm(columns, name, columns["P"], arm, "the resultant pressure", refusal)
    if bounds.friction is not None and not bounds.line:
        limit, corner = bounds.friction * columns["P"], float(np.hypot(half_x, half_y))
        _check_arm(columns, "Mz", limit, corner, "the shear", refusal)


def _check_arm(
    columns: dict[str, Array], name: str, force: Array, arm: float, whose: str, refusal: Refusal
) -> None:
    limit = force * arm * (1.0 + EXCESS) + REMAINDER * arm * force.max()
    wrong = np.abs(columns[name]) > limit
    for increment in np.flatnonzero(wrong).tolist():
        raise refusal(
            increment,
            name,
            f"puts {whose} outside the face",
            f"up to {force[increment] * arm:.6g}, a force of {force[increment]:.6g} at "
            f"{arm:.6g} mm from the centre of the face",
        )
