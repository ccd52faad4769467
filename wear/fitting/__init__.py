"""Parameters from measurements, by least squares with bounds.

Fits
    - ``fit``: solve a problem by least squares.
    - ``FitProblem``: free parameters, measured data, and the model between them.
    - ``FreeParameter``: a free parameter and its bounds.
    - ``Series``: data of one kind.
    - ``Fit``: the best values, with residuals, correlation and confidence bands.
    - ``Estimate``: value, deviation and bounds of one parameter, or why it is not determined.
    - ``diagnose``: plausibility warnings from the residuals: trends, outliers, groups.
    - ``common_over``: which test determines a common parameter, and whether the tests agree.
    - ``Common``: contributions of several tests to one parameter.
    - ``FitError``: data or parameters that cannot be fitted.

Problems
    - ``evolution_problem``: joint parameters as functions of the dissipated energy.
    - ``EvolutionData``: measured values of one of them.
    - ``loop_problem``: a joint law from measured loops.
    - ``loop_data``, ``LoopData``: similar loops of a record, as data.
    - ``volume_problem``: wear coefficients from worn volumes.
    - ``VolumeData``, ``VolumeLaw``: the volumes, and the free parameters of the law.
    - ``scar_problem``: wear coefficients from depths and profiles, by runs of a model.
    - ``ScarData``, ``ComputedScars``: a measured profile, and profiles from runs of the model.

The slope of measured points, with its confidence bounds:

>>> import numpy as np
>>> from wear.fitting import VolumeData, VolumeLaw, fit, volume_problem
>>> energy, volume = 1e6 * np.array([1.0, 2.0, 4.0, 8.0]), np.array([1.1, 1.9, 4.1, 7.9]) * 1e-3
>>> found = fit(volume_problem([VolumeData("both", energy, volume)], VolumeLaw()).problem)
>>> alpha = found.estimates[0]
>>> print(f"{1e9 * alpha.bounds[0]:.3f} to {1e9 * alpha.bounds[1]:.3f} 1e-9/MPa")
0.956 to 1.032 1e-9/MPa
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from sa_solver.lazy import lazy_names

if TYPE_CHECKING:
    from wear.fitting.common import Common, common_over
    from wear.fitting.diagnosis import diagnose
    from wear.fitting.estimates import Estimate
    from wear.fitting.evolutions import EvolutionData, evolution_problem
    from wear.fitting.least_squares import Fit, fit
    from wear.fitting.loop_samples import LoopData, loop_data
    from wear.fitting.loops import loop_problem
    from wear.fitting.problem import FitError, FitProblem, FreeParameter, Series
    from wear.fitting.scars import ComputedScars, ScarData, scar_problem
    from wear.fitting.volumes import VolumeData, VolumeLaw, volume_problem

__all__ = [
    "Common",
    "ComputedScars",
    "Estimate",
    "EvolutionData",
    "Fit",
    "FitError",
    "FitProblem",
    "FreeParameter",
    "LoopData",
    "ScarData",
    "Series",
    "VolumeData",
    "VolumeLaw",
    "common_over",
    "diagnose",
    "evolution_problem",
    "fit",
    "loop_data",
    "loop_problem",
    "scar_problem",
    "volume_problem",
]

__getattr__, __dir__ = lazy_names(__name__)
