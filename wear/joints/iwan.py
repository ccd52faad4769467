"""Iwan's joints: sliders in parallel, their limits spread continuously, that obey Masing's rule."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wear.joints.masing import MasingLaw
from wear.joints.parameters import Parameter, require, require_not_negative


@dataclass(frozen=True)
class UniformIwan(MasingLaw):
    """Limits spread evenly from nothing (Iwan 1966; Li 2020).

    First loaded, T = (K + kr) d - (K d)² / (4 µN) up to d = 2 µN/K, where the last slider slips,
    and µN + kr d beyond. (Li prints 2 µN/(K + kr), at which the curve would jump.)
    """

    @property
    def spread(self) -> tuple[Parameter, Parameter]:
        return 1.0, 2.0


@dataclass(frozen=True)
class FourParameterIwan(MasingLaw):
    """Limits spread by a power law, and a rest that slips at once (Segalman 2005).

    ``chi`` χ > -1: the loop of a small amplitude A loses energy as A^(χ+3). ``beta`` β >= 0:
    stiffness of the sliders that slip together, last of all, over that of the others. Segalman's
    F_S is µN and his K_T is ``stiffness``; the last slip at φ = µN (1 + β) / (K (β + (χ+1)/(χ+2))).
    DOI 10.1115/1.1989354.
    """

    chi: Parameter = -0.5
    beta: Parameter = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        require_not_negative(beta=self.beta)
        chi = np.asarray(self.chi)
        require("chi", chi, (chi > -1.0) & (chi < np.inf), "finite and above -1")

    @property
    def spread(self) -> tuple[Parameter, Parameter]:
        return 1.0 / np.add(1.0, self.beta), np.add(self.chi, 2.0)
