"""Main results of a run as shown to users: names, units, estimated errors, and curves.

An analysis declares them once, by dotted paths into the summary, for all code that shows or
compares runs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

# Parts of a path in the results: any group, one curve for each, and the last numbered group.
ANY, LAST = "*", "-1"


@dataclass(frozen=True)
class SummaryQuantity:
    """Number at ``path`` in the summary, in the base ``unit`` ("1" for none).

    ``group`` names the object it belongs to, such as an interface; it is empty for the whole run.
    ``error`` is the estimated relative error, None if unknown, and ``error_of`` says what it
    covers. ``everyday`` is the unit preferred by readers, if there is only one. ``budget``
    describes the error in words, with the path in the summary of its parts (None for unknown ones)
    and their ``total``. ``where`` is the place in the run to which the number belongs, such as
    increment 7. A ``leading`` quantity is in the summary at the top of a report.
    """

    group: str
    name: str
    path: str
    unit: str
    error: float | None = None
    error_of: str = ""
    everyday: str = ""
    budget: tuple[str, str] | None = None
    where: str = ""
    leading: bool = False


class NumberOf(NamedTuple):
    """Declaration of a number that several groups of a summary have: see the fields above."""

    unit: str
    text: str
    everyday: str = ""
    leading: bool = False

    def at(self, group: str, path: str, leads: bool = True, **known: Any) -> SummaryQuantity:
        """Return the quantity of a ``group`` at a ``path``, leading only if its group ``leads``.

        ``known`` are further fields of the quantity, such as its error.
        """
        leading = self.leading and leads
        return SummaryQuantity(
            group, self.text, path, self.unit, everyday=self.everyday, leading=leading, **known
        )


@dataclass(frozen=True)
class CurvesOf:
    """Description of curves: datasets ``y`` against ``x``.

    In the path of ``y``, ``*`` stands for any group and ``-1`` for the last numbered one. ``x`` is
    a dataset of the same group, or empty for the coordinate of the first axis. The last column of a
    dataset with several columns is used. Of a field over the cells of a grid (or the first
    component of a vector), the curve runs along x through the middle. ``logarithmic`` refers to the
    y axis.
    """

    title: str
    y: str
    x: str = ""
    logarithmic: bool = False
