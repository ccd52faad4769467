"""What all curves of a run share: its case, structure, reporter and steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fe_models.dynamics.curves.curve_steps import ContinuationControl
from fe_models.dynamics.curves.motion_recorder import Accuracy
from sa_solver.steps import Steps
from workflow.analyses.vibration.case.vibration_case import VibrationCase
from workflow.analyses.vibration.model import accuracy_of, step_control
from workflow.models.vibration.structure import VibratingStructure
from workflow.shell.terminal.reporter import FORECAST, Reporter

# Usual number of points of a curve while the frequency or the force grows by a factor of e. It
# weighs as much as this known share of the curve in predictions.
POINTS, BEGUN = 50, 0.2


@dataclass(frozen=True)
class VibrationRun:
    """Run of a ``case`` whose curves are followed on its ``structure``."""

    case: VibrationCase
    structure: VibratingStructure
    reporter: Reporter
    steps: Steps

    @property
    def accuracy(self) -> Accuracy | None:
        """Accuracy of motions that the case asks for, None if the resolution is given."""
        return accuracy_of(self.case)

    @property
    def amounts(self) -> tuple[float, float]:
        """Smallest and largest force [N], or level."""
        return self.case.amounts[0], self.case.amounts[-1]

    def control(self, span: tuple[float, float], unit: str) -> ContinuationControl:
        """Return the step control of a curve that ascends along a ``span`` and shows progress."""
        return step_control(self.case, self.progress(span, unit))

    def progress(
        self, span: tuple[float, float], unit: str, upward: bool = True
    ) -> Callable[[float], None]:
        """Return a callback that reports the progress of a curve along a ``span``, by its points.

        The rest is assumed to have as many points per logarithm as the part behind. At the
        beginning, the usual number counts. Points that turn back do not reduce the progress.
        """
        begin, end = span if upward else span[::-1]
        length = abs(float(np.log(end / begin)))
        points, farthest = 0, 0.0

        @self.reporter.isolated(FORECAST)
        def watch(parameter: float) -> None:
            nonlocal points, farthest
            points += 1
            farthest = max(farthest, float(np.log(parameter / begin) / np.log(end / begin)))
            density = (points + BEGUN * POINTS * length) / (farthest + BEGUN)
            left = (1.0 - farthest) * density
            self.reporter.reached(points / (points + left), f"{parameter:.4g} {unit}")

        return watch
