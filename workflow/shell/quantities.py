"""Main results of a run as people are told them: names, units, estimated errors, and curves.

An analysis names them once, by dotted paths into the summary, for all that show or compare runs.
"""

from __future__ import annotations

from dataclasses import dataclass

# Parts of a path in the results: any group, each a curve of its own, and the last numbered one.
ANY, LAST = "*", "-1"


@dataclass(frozen=True)
class Quantity:
    """A number at ``path`` in the summary, in the base ``unit`` ("1" for none).

    ``group`` is what it is of, such as an interface, empty for the whole run. ``error`` is the
    estimated relative error, None where nobody knows, of which ``error_of`` says what it covers.
    ``everyday`` is the unit that people want to read, where there is only one. A ``budget`` is
    what the error is of, in words, and where the summary has its parts, None for unknown ones, and
    their ``total``. ``where`` in a run such a number is, as in increment 7, is told beside it.
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


@dataclass(frozen=True)
class CurvesOf:
    """The datasets ``y`` against ``x``; ``*`` stands for any group, ``-1`` for the last numbered.

    What stands for them in ``y`` does in ``x`` too. Of a dataset of several columns the last is
    meant. Where ``x`` is a grid, ``y`` is a field over it, of a vector its first component, and the
    curve goes along x through its middle. ``units`` are the base units of x and y ("1" for none, ""
    where the case decides), of a contact over an area. ``logarithmic`` is the axis of y.
    """

    title: str
    x: str
    y: str
    units: tuple[str, str]
    logarithmic: bool = False
