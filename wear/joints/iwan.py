"""Iwan joints: parallel sliders with continuously distributed limits, by Masing's rule."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wear.joints.masing import MasingLaw
from wear.joints.parameters import Parameter, require, require_not_negative


@dataclass(frozen=True)
class UniformIwan(MasingLaw):
    """Iwan joint whose slider limits are uniformly distributed from 0 (Iwan 1966; Li 2020).

    On first loading T = (K + kr) d - (K d)² / (4 µN) up to d = 2 µN/K, where the last slider slips,
    and µN + kr d beyond. (Li prints 2 µN/(K + kr), at which the curve would jump.)

    Parameters
    ----------
    stiffness
        Stiffness K of the sliders [N/mm].
    friction
        Coefficient of friction µ.
    normal_load
        Normal load N [N].
    residual_stiffness
        Residual stiffness kr [N/mm].

    Examples
    --------
    On first loading the force is K d - (K d)² / (4 µN):

    >>> import numpy as np
    >>> from wear.joints import UniformIwan, march_joints
    >>> law = UniformIwan(stiffness=1e4, friction=0.5, normal_load=100.0)
    >>> history = march_joints(law, law.rest(1), np.zeros((1, 1)), np.full((1, 1, 1), 0.005))
    >>> print(f"{history.force[0, 0, 0]:.3f} N of {50.0 - 50.0**2 / 200.0:.3f}")
    37.500 N of 37.500
    """

    @property
    def spread(self) -> tuple[Parameter, Parameter]:
        return 1.0, 2.0


@dataclass(frozen=True)
class FourParameterIwan(MasingLaw):
    """Iwan joint with a power-law distribution of limits (Segalman 2005).

    The last sliders slip at once. Segalman's F_S is µN and his K_T is ``stiffness``; the last
    sliders slip at φ = µN (1 + β) / (K (β + (χ+1)/(χ+2))). DOI 10.1115/1.1989354.

    Parameters
    ----------
    stiffness
        Stiffness K of the sliders [N/mm].
    friction
        Coefficient of friction µ.
    normal_load
        Normal load N [N].
    residual_stiffness
        Residual stiffness kr [N/mm].
    chi
        Exponent χ > -1: the loop of a small amplitude A dissipates energy as A^(χ+3).
    beta
        Ratio β >= 0 of the stiffness of the sliders that slip together, last of all, to that of the
        others.

    Examples
    --------
    A small loop dissipates energy as its amplitude to the power χ + 3:

    >>> from wear.joints import FourParameterIwan
    >>> law = FourParameterIwan(stiffness=1e4, friction=0.5, normal_load=100.0, chi=-0.5)
    >>> print(f"{law.loop_energy(2e-3) / law.loop_energy(1e-3):.4f} of {2.0**2.5:.4f}")
    5.6569 of 5.6569
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
