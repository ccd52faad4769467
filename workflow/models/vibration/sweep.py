"""Curves of periodic motions over a span of frequencies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from math import log

from fe_models.dynamics.curves.curve_steps import ContinuationControl
from fe_models.dynamics.curves.forced_response import ResponseBranch, along_frequency
from fe_models.dynamics.curves.motion_recorder import Accuracy
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from sa_solver import checks
from sa_solver.steps import COMPUTED, Steps
from sa_solver.types import Array
from workflow.errors import MethodFailed
from workflow.models.vibration.motions import accurate, largest_motion
from workflow.models.vibration.structure import VibratingStructure


def _unwatched(frequency: float) -> None:
    """Ignore a new point of a curve."""


@dataclass(frozen=True)
class FrequencySweep:
    """A span of frequencies, and how curves of motions are followed over it.

    Parameters
    ----------
    lower, upper : float
        Ends of the span [Hz].
    upward : bool
        Whether curves begin at the lower end, or at the upper one.
    accuracy : Accuracy, optional
        Accuracy to which harmonics and samples are added; without it the resolution stays.
    control : ContinuationControl
        Steps along a curve.

    Examples
    --------
    Curves that begin at 400 Hz:

    >>> import fretscale
    >>> fretscale.FrequencySweep(20.0, 400.0, upward=False).span
    (20.0, 400.0)
    """

    lower: float
    upper: float
    upward: bool = True
    accuracy: Accuracy | None = None
    control: ContinuationControl = field(default_factory=lambda: ContinuationControl(most=0.1))

    def __post_init__(self) -> None:
        checks.numbers(self, "lower", above=0.0)
        checks.numbers(self, "upper", above=self.lower)
        checks.instances(self, upward=bool, accuracy=Accuracy | None, control=ContinuationControl)

    @property
    def span(self) -> tuple[float, float]:
        """Both ends [Hz]."""
        return self.lower, self.upper

    def share(self, frequency: float) -> float:
        """Return the share of the span behind a frequency, on a logarithmic scale."""
        begin, end = self.span if self.upward else self.span[::-1]
        return log(frequency / begin) / log(end / begin)

    def curve(
        self,
        structure: VibratingStructure,
        force: float,
        steps: Steps = COMPUTED,
        watch: Callable[[float], None] = _unwatched,
    ) -> ResponseBranch:
        """Return the motions of a structure under a force, in the order of the curve.

        ``watch`` is called with the frequency of each new point. Raises MethodFailed where there
        is no motion at all.
        """
        branch = along_frequency(
            structure.problem,
            force,
            self.span,
            upward=self.upward,
            control=replace(self.control, watch=watch),
            accuracy=self.accuracy,
            steps=steps,
        )
        if not branch.solutions:
            where = structure.driving.amount.under(force)
            raise MethodFailed(f"no motion {where}: {branch.message}; change frequencies")
        return branch

    def resonance(
        self,
        structure: VibratingStructure,
        branch: ResponseBranch,
        amplitudes: Array,
        steps: Steps = COMPUTED,
    ) -> HarmonicSolution:
        """Return the motion with the largest of the ``amplitudes`` ``(n,)`` [mm] of a curve.

        It has its error, and the resolution that the accuracy needs.
        """
        peak = steps("resonance", partial(largest_motion, structure, branch, amplitudes))
        # The peak may have been found before the resolution was refined.
        problem = branch.problem.with_resolution(peak.resolution)
        return steps("accurate resonance", partial(accurate, problem, peak, self.accuracy))
