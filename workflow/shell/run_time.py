"""About how long a run takes, known before anything is meshed: an order of magnitude.

Work is counted (unknowns, factors, contact problems, points of curves) and multiplied by what a
unit of it took on one core of a server of 2024, at some 2.5 GHz. Structures that are in the cache
take nothing; that is not looked into.
"""

from __future__ import annotations

from dataclasses import dataclass

from workflow.shell.forecast import about

# Python, libraries and compiled laws to load [s]; figures of an analysis.
START, FIGURES = 3.0, 3.0
# A convolution on the half-space, and each of its cells in it [s].
CONVOLUTION, CELL = 3e-4, 1.2e-7
# Convolutions of a contact problem begun from the one before: on an area, on a line, with friction.
NORMAL, NORMAL_LINE, FRICTIONAL = 15, 6, 60
# Sparse factors of a body, all of its right-hand sides included, of so many nodes [s].
FACTOR, FACTOR_NODES, FACTOR_POWER = 5.0, 3e4, 1.6


@dataclass(frozen=True)
class RunTime:
    """Seconds ``before`` the long part of a run, in its ``course``, and ``after`` that.

    Where ``unknown`` says what of the work cannot be counted before the run, the seconds are those
    of the work that ``assumed`` names in its place. Both are empty otherwise.
    """

    before: float = 0.0
    course: float = 0.0
    after: float = FIGURES
    assumed: str = ""
    unknown: str = ""

    @property
    def begun(self) -> float:
        """Until the long part begins."""
        return START + self.before

    @property
    def seconds(self) -> float:
        """Of all."""
        return self.begun + self.course + self.after

    @property
    def short(self) -> str:
        """The time in a few words, with the work that it is for where that is assumed."""
        return f"{about(self.seconds)} for {self.assumed}" if self.unknown else about(self.seconds)

    @property
    def text(self) -> str:
        """The time as a check reports it."""
        return "; ".join(filter(None, (f"{self.short}, within a factor of five", self.unknown)))


def solves(count: float, cells: int, convolutions: float) -> float:
    """Contact problems on a grid of so many cells [s]."""
    return count * convolutions * (CONVOLUTION + CELL * cells)


def factors(nodes: float) -> float:
    """Sparse factors of a body of so many nodes [s]."""
    return float(FACTOR * (nodes / FACTOR_NODES) ** FACTOR_POWER)
