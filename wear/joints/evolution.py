"""Evolution of the parameters of a joint law with the energy that the joint has dissipated.

The functions come from two papers. E is the cumulative energy in N mm (1 J = 1e3 N mm,
1 kJ = 1e6 N mm), and all functions but tables are factors of the initial value:

- Fantetti et al. 2019, Tribology International 138, 111, doi:10.1016/j.triboint.2019.05.023, table
  4.2: :class:`LogarithmicEvolution` of friction, :class:`ArrheniusEvolution` of the contact
  stiffness, :class:`LinearEvolution` of the macroslip slope;
- Li et al. 2020, table 3: :class:`ExponentialEvolution`; a single one for the bolt's preload;
- :class:`TabulatedEvolution`: values of the parameter itself, measured or from a wear computation.

Misprints in the papers, and the values used here:

- Fantetti's E is in J, but the macroslip slope, 0.88 N/µm (1 + 0.24 E), would then exceed the
  contact stiffness after 210 J of a test of 2800 J. Its 0.24 is taken per kJ, 2.4e-7 per N mm.
  Friction (b = 1.3e9 per J) and stiffness (b = 150 J) do give the measured curves in J. Their "log"
  is the natural logarithm.
- Li's curve of first loading is printed with sliding from 2 µN / (kt + kr) on, where it would jump.
  Without a jump it slides from 2 µN / kt on, as in :mod:`wear.joints.iwan`. Their c and d are per
  kJ. The residual stiffness does not evolve.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol, TypeVar

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array
from wear.evolution import EnergyTable

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    Law = TypeVar("Law", bound=DataclassInstance)


class WearFunction(Protocol):
    """Protocol of a factor of a parameter, or its tabulated value, against cumulative energy."""

    def __call__(self, energy: Array | float) -> Array:
        """Return the factor or value at an ``energy`` >= 0 [N mm] of any shape."""
        ...


@dataclass(frozen=True)
class LogarithmicEvolution:
    """The factor 1 + a ln(1 + b E), with ``change`` a and ``rate`` b >= 0 [1/(N mm)].

    Examples
    --------
    Beyond an energy of 1/b the friction grows by 10 % with each factor e of energy:

    >>> import numpy as np
    >>> from wear.joints import LogarithmicEvolution
    >>> friction = LogarithmicEvolution(change=0.1, rate=1.0)
    >>> print(f"{friction(np.e * 1e4) - friction(1e4):.4f}")
    0.1000
    """

    change: float
    rate: float

    def __post_init__(self) -> None:
        checks.numbers(self, "change")
        checks.numbers(self, "rate", least=0.0)

    def __call__(self, energy: Array | float) -> Array:
        return np.asarray(1.0 + self.change * np.log1p(self.rate * _energies(energy)))


@dataclass(frozen=True)
class ArrheniusEvolution:
    """The factor 1 + a exp(-b / E), with final ``change`` a and energy ``scale`` b > 0 [N mm].

    It is 1 for E = 0.

    Examples
    --------
    A stiffness falls by 30 % in the end, and by 1/e of that once ``scale`` is dissipated:

    >>> import numpy as np
    >>> from wear.joints import ArrheniusEvolution
    >>> stiffness = ArrheniusEvolution(change=-0.3, scale=1.5e5)
    >>> print(f"{stiffness(1.5e5):.4f} of {1.0 - 0.3 * np.exp(-1.0):.4f}")
    0.8896 of 0.8896
    """

    change: float
    scale: float

    def __post_init__(self) -> None:
        checks.numbers(self, "change")
        checks.numbers(self, "scale", above=0.0)

    def __call__(self, energy: Array | float) -> Array:
        energy = _energies(energy)
        ratio = np.full_like(energy, np.inf)
        # An overflow to infinity is correct here: nothing has changed yet at such a low energy.
        with np.errstate(over="ignore"):
            np.divide(self.scale, energy, out=ratio, where=energy > 0.0)
        return np.asarray(1.0 + self.change * np.exp(-ratio))


@dataclass(frozen=True)
class LinearEvolution:
    """The factor 1 + a E, with ``slope`` a [1/(N mm)].

    Examples
    --------
    Fantetti's macroslip slope after 1 kJ, which is 1e6 N mm:

    >>> from wear.joints import LinearEvolution
    >>> print(LinearEvolution(slope=2.4e-7)(1e6))
    1.24
    """

    slope: float

    def __post_init__(self) -> None:
        checks.numbers(self, "slope")

    def __call__(self, energy: Array | float) -> Array:
        return np.asarray(1.0 + self.slope * _energies(energy))


@dataclass(frozen=True)
class ExponentialEvolution:
    """The factor a + (1 - a) [b exp(c E) + (1 - b) exp(d E)].

    Parameters
    ----------
    final
        Final factor a.
    rate
        Rate c <= 0 of the first exponential [1/(N mm)].
    share
        Share b of the first exponential; by default it is the only one.
    second_rate
        Rate d <= 0 of the second exponential [1/(N mm)].

    Examples
    --------
    A bolt keeps 40 % of its preload, and 1/e of the rest once 1 kJ is dissipated:

    >>> import numpy as np
    >>> from wear.joints import ExponentialEvolution
    >>> preload = ExponentialEvolution(final=0.4, rate=-1e-6)
    >>> print(f"{preload(1e6):.4f} of {0.4 + 0.6 * np.exp(-1.0):.4f}")
    0.6207 of 0.6207
    """

    final: float
    rate: float
    share: float = 1.0
    second_rate: float = 0.0

    def __post_init__(self) -> None:
        checks.numbers(self, "final", "share")
        checks.numbers(self, "rate", "second_rate", most=0.0)

    def __call__(self, energy: Array | float) -> Array:
        energy = _energies(energy)
        first, second = np.exp(self.rate * energy), np.exp(self.second_rate * energy)
        decay = self.share * first + (1.0 - self.share) * second
        return np.asarray(self.final + (1.0 - self.final) * decay)


@dataclass(frozen=True)
class TabulatedEvolution:
    """Values of a parameter at given energies.

    Values are linear between the energies, hence as monotone as the table, and constant beyond its
    ends.

    Parameters
    ----------
    energies
        Energies, ascending [N mm].
    values
        Values of the parameter at these energies, equally many.

    Raises
    ------
    InputError
        If the table is empty, its columns differ in length, or its energies do not ascend.

    Examples
    --------
    Values were measured three times during a test:

    >>> from wear.joints import TabulatedEvolution
    >>> friction = TabulatedEvolution(energies=(0.0, 1e5, 1e6), values=(0.2, 0.6, 0.7))
    >>> print(friction(5e4), friction(2e6))
    0.4 0.7
    """

    energies: tuple[float, ...]
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        # This raises an error for anything that is not a table.
        table = EnergyTable(self.energies, self.values)
        checks.settle(self, energies=table.energy, values=table.factor)

    def __call__(self, energy: Array | float) -> Array:
        return np.asarray(np.interp(_energies(energy), self.energies, self.values))


@dataclass(frozen=True)
class JointEvolution:
    """Evolution of the parameters of a joint law with the joint's energy.

    Each field is a function of the energy dissipated so far [N mm], or None for a constant
    parameter. A function multiplies the initial value; a table replaces it. No parameter falls
    below 0.

    Parameters
    ----------
    stiffness, residual_stiffness, friction, normal_load
        Function of the parameter of that name.

    Examples
    --------
    The friction of a joint grows as ln E, and its bolt loses preload:

    >>> import numpy as np
    >>> from wear.joints import ExponentialEvolution, Jenkins, JointEvolution, LogarithmicEvolution
    >>> new = Jenkins(stiffness=1e4, friction=0.5, normal_load=100.0)
    >>> evolution = JointEvolution(
    ...     friction=LogarithmicEvolution(change=0.1, rate=1.0),
    ...     normal_load=ExponentialEvolution(final=0.4, rate=-1e-6),
    ... )
    >>> worn = evolution.at(new, 1e6)
    >>> print(f"µ = {worn.friction:.4f} of {0.5 * (1.0 + 0.1 * np.log(1e6 + 1.0)):.4f}")
    µ = 1.1908 of 1.1908
    >>> print(f"N = {worn.normal_load:.3f} N of {100.0 * (0.4 + 0.6 * np.exp(-1.0)):.3f}")
    N = 62.073 N of 62.073
    """

    stiffness: WearFunction | None = None
    residual_stiffness: WearFunction | None = None
    friction: WearFunction | None = None
    normal_load: WearFunction | None = None

    def __post_init__(self) -> None:
        for name, function in self._functions():
            if not callable(function):
                raise InputError(f"{name} is {function!r}: give a function of the energy")

    def at(self, law: Law, energy: Array | float) -> Law:
        """Return the ``law`` after an ``energy`` [N mm]; its parameters given are the initial ones.

        ``energy`` is a number for all joints, or ``(n,)``. Raise InputError for a law that lacks an
        evolving parameter.
        """
        values = self.values(law, energy)
        # Parameters that are plain numbers remain plain numbers.
        return replace(law, **{k: v if v.ndim else float(v) for k, v in values.items()})

    def values(self, law: object, energy: Array | float) -> dict[str, Array]:
        """Return the evolving parameters by name, with ``energy`` broadcast to the initial ones."""
        values = {}
        for name, function in self._functions():
            initial = getattr(law, name, None)
            if initial is None:
                raise InputError(
                    f"{type(law).__name__} has no {name} that could evolve: name one of its "
                    "parameters"
                )
            scale = np.ones_like(initial) if isinstance(function, TabulatedEvolution) else initial
            values[name] = np.asarray(np.maximum(function(energy) * scale, 0.0))
        return values

    @property
    def breaks(self) -> tuple[float, ...]:
        """Energies at which a parameter has a kink, those of the tables, ascending [N mm]."""
        tables = [function for _, function in self._functions()]
        energies = [t.energies for t in tables if isinstance(t, TabulatedEvolution)]
        return tuple(sorted(set().union(*energies)))

    def _functions(self) -> Iterator[tuple[str, WearFunction]]:
        return ((name, function) for name, function in vars(self).items() if function is not None)


def _energies(energy: object) -> Array:
    """Return energies of any shape, unless one is below 0 or missing."""
    found = checks.array("energies", energy, None)
    if (found < 0.0).any():
        raise InputError(f"energies down to {found.min():g} N mm: give 0 or more")
    return found
