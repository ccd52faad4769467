"""Estimate of the duration of a run before anything is meshed, to an order of magnitude.

The work is counted (unknowns, factors, contact problems, points of curves) and multiplied by the
time of one unit of it, measured on one core of a 2024 server at about 2.5 GHz. Structures in the
cache would take no time; the estimate does not look there.
"""

from __future__ import annotations

from dataclasses import dataclass

from workflow.shell.forecast import about

# Time to load Python, libraries and compiled laws, and to draw the figures of an analysis [s].
START, FIGURES = 3.0, 3.0
# Fixed time of a convolution on the half-space, and time for each of its cells [s].
CONVOLUTION, CELL = 3e-4, 1.2e-7
# Convolutions of a contact problem started from the previous one: area, line, with friction.
NORMAL, NORMAL_LINE, FRICTIONAL = 15, 6, 60
# Time for the sparse factors and all right-hand sides of a body with FACTOR_NODES nodes [s], and
# its growth exponent.
FACTOR, FACTOR_NODES, FACTOR_POWER = 5.0, 3e4, 1.6


@dataclass(frozen=True)
class RunTime:
    """Estimated seconds ``before`` the long part of a run, in its ``course``, and ``after`` it.

    If some work cannot be counted before the run, ``unknown`` says which, and the seconds are for
    the work that ``assumed`` names in its place. Both are empty otherwise.
    """

    before: float = 0.0
    course: float = 0.0
    after: float = FIGURES
    assumed: str = ""
    unknown: str = ""

    @property
    def begun(self) -> float:
        """Time until the long part begins [s]."""
        return START + self.before

    @property
    def seconds(self) -> float:
        """Total time [s]."""
        return self.begun + self.course + self.after

    @property
    def short(self) -> str:
        """The time in a few words, with the assumed work if some is unknown."""
        return f"{about(self.seconds)} for {self.assumed}" if self.unknown else about(self.seconds)

    @property
    def text(self) -> str:
        """The time as a check reports it."""
        return "; ".join(filter(None, (f"{self.short}, within a factor of five", self.unknown)))


def solves(count: float, cells: int, convolutions: float) -> float:
    """Return the time of ``count`` contact problems on a grid of ``cells`` cells [s]."""
    return count * convolutions * (CONVOLUTION + CELL * cells)


def factors(nodes: float) -> float:
    """Return the time of the sparse factors of a body with this number of nodes [s]."""
    return float(FACTOR * (nodes / FACTOR_NODES) ** FACTOR_POWER)
