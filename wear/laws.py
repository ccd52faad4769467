"""Wear laws: the depth that one body loses in a cycle, from pressure and slip.

Every law here is linear in the pressure once the slips of the cycle are known. A law therefore
returns the depth per pressure w of each increment. Explicit steps use it as a rate (depth = Σ w p),
implicit steps as a local compliance (w ΔN).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

from sa_solver import checks
from sa_solver.types import Array
from wear.evolution import EnergyTable


@dataclass(frozen=True)
class SlidingConditions:
    """The quantities on which the wear of one body during a step may depend.

    Parameters
    ----------
    slip
        Size of the slip in each increment of the cycle ``(t, ...)``, by cell or node [mm].
    friction
        Coulomb's coefficient of friction.
    work
        Energy dissipated per area of this body's surface since it was new, before the step and, as
        predicted, after it; ``(...)`` each [N/mm].
    energy
        Energy dissipated by the whole contact, before the step and, as predicted, after it [N mm].
    """

    slip: Array
    friction: float | Array
    work: tuple[Array, Array]
    energy: tuple[float, float]


class WearLaw(Protocol):
    """Protocol of the wear of one body.

    :class:`ArchardLaw`, :class:`EnergyLaw`, :class:`EnergyAmplitudeLaw` and :class:`EvolvingLaw`
    implement it, and so does any class with this method.
    """

    def depth_per_pressure(self, sliding: SlidingConditions) -> Array:
        """Return the depth per pressure worn in each increment ``(t, ...)`` [mm/MPa per cycle]."""
        ...


@dataclass(frozen=True)
class ArchardLaw:
    """Archard's law V = K s P / H (Archard 1953).

    Parameters
    ----------
    coefficient
        Wear coefficient K [1].
    hardness
        Hardness H [MPa].

    Examples
    --------
    The worn depth of a point under 200 MPa that slides 0.1 mm per cycle is K s p / H:

    >>> import numpy as np
    >>> from wear import ArchardLaw
    >>> from wear.laws import SlidingConditions
    >>> law = ArchardLaw(coefficient=1e-4, hardness=3000.0)
    >>> still = np.zeros(1)
    >>> sliding = SlidingConditions(np.array([[0.05], [0.05]]), 0.5, (still, still), (0.0, 0.0))
    >>> depth = 200.0 * law.depth_per_pressure(sliding).sum()
    >>> print(f"{1e6 * depth:.3f} nm a cycle of {1e6 * 1e-4 * 0.1 * 200.0 / 3000.0:.3f}")
    0.667 nm a cycle of 0.667
    """

    coefficient: float
    hardness: float

    def __post_init__(self) -> None:
        checks.numbers(self, "coefficient", least=0.0)
        checks.numbers(self, "hardness", above=0.0)

    def depth_per_pressure(self, sliding: SlidingConditions) -> Array:
        return self.coefficient / self.hardness * sliding.slip


@dataclass(frozen=True)
class EnergyLaw:
    """Energy law V = α Σ Ed with ``coefficient`` α [1/MPa] (Fouvry; Gallego 2007, eq. 1).

    Examples
    --------
    The worn depth of a point under 200 MPa that slides 0.1 mm per cycle with µ = 0.5 is α µ p s:

    >>> import numpy as np
    >>> from wear import EnergyLaw
    >>> from wear.laws import SlidingConditions
    >>> law = EnergyLaw(coefficient=1e-8)
    >>> still = np.zeros(1)
    >>> sliding = SlidingConditions(np.array([[0.05], [0.05]]), 0.5, (still, still), (0.0, 0.0))
    >>> depth = 200.0 * law.depth_per_pressure(sliding).sum()
    >>> print(f"{1e6 * depth:.3f} nm a cycle of {1e6 * 1e-8 * 0.5 * 200.0 * 0.1:.3f}")
    0.100 nm a cycle of 0.100
    """

    coefficient: float

    def __post_init__(self) -> None:
        checks.numbers(self, "coefficient", least=0.0)

    def depth_per_pressure(self, sliding: SlidingConditions) -> Array:
        return self.coefficient * sliding.friction * sliding.slip


@dataclass(frozen=True)
class EnergyAmplitudeLaw:
    """Energy law whose coefficient grows with the local slip amplitude (Gallego 2007, eq. 3).

    The depth per cycle is α / (4 δ_ref) (Σ|Δs|) (Σ|q·Δs|), where one cycle slides four amplitudes.

    Parameters
    ----------
    coefficient
        Wear coefficient α at the reference amplitude [1/MPa].
    reference_amplitude
        Reference amplitude δ_ref [mm].

    Examples
    --------
    At the reference amplitude the depth is that of the energy law; at twice that
    amplitude it is four times as much:

    >>> import numpy as np
    >>> from wear import EnergyAmplitudeLaw
    >>> from wear.laws import SlidingConditions
    >>> law, still = EnergyAmplitudeLaw(coefficient=1e-8, reference_amplitude=0.025), np.zeros(1)
    >>> for amplitude in (0.025, 0.05):
    ...     slip = np.full((2, 1), 2.0 * amplitude)
    ...     sliding = SlidingConditions(slip, 0.5, (still, still), (0.0, 0.0))
    ...     depth = 200.0 * law.depth_per_pressure(sliding).sum()
    ...     print(f"±{amplitude} mm: {1e6 * depth:.3f} nm a cycle")
    ±0.025 mm: 0.100 nm a cycle
    ±0.05 mm: 0.400 nm a cycle
    """

    coefficient: float
    reference_amplitude: float

    def __post_init__(self) -> None:
        checks.numbers(self, "coefficient", least=0.0)
        checks.numbers(self, "reference_amplitude", above=0.0)

    def depth_per_pressure(self, sliding: SlidingConditions) -> Array:
        amplitude = sliding.slip.sum(axis=0) / 4.0 / self.reference_amplitude
        depth: Array = self.coefficient * sliding.friction * sliding.slip * amplitude
        return depth


@dataclass(frozen=True)
class EvolvingLaw:
    """Any wear law, times a factor that changes with cumulative energy.

    During a step the factor is its exact mean between the energies at both ends of the step.

    Parameters
    ----------
    law
        The wear law that is scaled.
    factor
        The factor against energy.
    scope
        Energy on which the factor depends. "local": energy per area of this body's own surface
        [N/mm]; "global": energy of the whole contact [N mm].

    Examples
    --------
    The coefficient falls to one half while 100 N/mm are dissipated; a step over
    all of it uses the mean:

    >>> import numpy as np
    >>> from wear import EnergyLaw, EnergyTable, EvolvingLaw
    >>> from wear.laws import SlidingConditions
    >>> law = EvolvingLaw(EnergyLaw(1e-8), EnergyTable((0.0, 100.0), (1.0, 0.5)), scope="local")
    >>> slip, new, old = np.full((1, 1), 0.1), np.zeros(1), np.full(1, 100.0)
    >>> sliding = SlidingConditions(slip, 0.5, (new, old), (0.0, 0.0))
    >>> share = law.depth_per_pressure(sliding) / law.law.depth_per_pressure(sliding)
    >>> print(share)
    [[0.75]]
    """

    law: WearLaw
    factor: EnergyTable
    scope: Literal["local", "global"]

    def __post_init__(self) -> None:
        checks.choice("scope", self.scope, ("local", "global"))

    def depth_per_pressure(self, sliding: SlidingConditions) -> Array:
        before, after = sliding.work if self.scope == "local" else sliding.energy
        return self.factor.mean(before, after) * self.law.depth_per_pressure(sliding)
