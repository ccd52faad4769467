"""How the parameters of a joint law follow the energy that the joint has dissipated so far.

The forms are those of two papers; E is the cumulative energy in N mm (1 J = 1e3, 1 kJ = 1e6 N mm),
and all but tables are factors of the initial value:

- Fantetti et al. 2019, Tribology International 138, 111, doi:10.1016/j.triboint.2019.05.023, table
  4.2: :class:`LogarithmicEvolution` of friction, :class:`ArrheniusEvolution` of the contact
  stiffness, :class:`LinearEvolution` of the macroslip slope;
- Li et al. 2020, table 3: :class:`ExponentialEvolution`, a single one for the bolt's preload;
- :class:`TabulatedEvolution`: values themselves, measured or of a wear computation.

Misprints, and what holds here:

- Fantetti's E is in J, but the macroslip slope, 0.88 N/µm (1 + 0.24 E), would then pass the contact
  stiffness at 210 J of a test of 2800 J. Its 0.24 is taken per kJ, 2.4e-7 per N mm; friction
  (b = 1.3e9 per J) and stiffness (b = 150 J) do give the measured curves in J. Their "log" is the
  natural one.
- Li's curve of first loading is printed with sliding from 2 µN / (kt + kr) on, where it would jump;
  without a jump it slides from 2 µN / kt on, and so does :mod:`wear.joints.iwan`. Their c and d are
  per kJ. The residual stiffness does not evolve.
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
    """A factor, or for a :class:`TabulatedEvolution` a value, against cumulative energy."""

    def __call__(self, energy: Array | float) -> Array:
        """At an ``energy`` >= 0 [N mm] of any shape."""
        ...


@dataclass(frozen=True)
class LogarithmicEvolution:
    """1 + a ln(1 + b E): ``change`` a, ``rate`` b [1/(N mm)], not negative.

    Examples
    --------
    Friction that rises by 10 % for each factor e of energy, once beyond 1/b:

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
    """1 + a exp(-b / E): ``change`` a, reached late; ``scale`` b [N mm], above 0. 1 for E = 0.

    Examples
    --------
    A stiffness that falls by 30 % in the end, and by 1/e of that while ``scale`` is dissipated:

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
        # A quotient too large for a float says the same as infinity: nothing has changed yet.
        with np.errstate(over="ignore"):
            np.divide(self.scale, energy, out=ratio, where=energy > 0.0)
        return np.asarray(1.0 + self.change * np.exp(-ratio))


@dataclass(frozen=True)
class LinearEvolution:
    """1 + a E: ``slope`` a [1/(N mm)].

    Examples
    --------
    Fantetti's macroslip slope after a kilojoule, 1e6 N mm:

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
    """a + (1 - a) [b exp(c E) + (1 - b) exp(d E)], from 1 to ``final`` a.

    ``share`` b is that of the ``rate`` c [1/(N mm)], the rest that of ``second_rate`` d; with all
    of it, as by default, it is a single exponential. Rates are not above 0.

    Examples
    --------
    A bolt that keeps 40 % of its preload, and of the rest 1/e once a kilojoule is dissipated:

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
    """``values`` of a parameter at ``energies`` [N mm], which ascend.

    Linear between them, hence as monotone as they are, and constant beyond both ends. Raises
    InputError for no or unequal columns or energies that do not ascend.

    Examples
    --------
    Values measured three times during a test, linear between them:

    >>> from wear.joints import TabulatedEvolution
    >>> friction = TabulatedEvolution(energies=(0.0, 1e5, 1e6), values=(0.2, 0.6, 0.7))
    >>> print(friction(5e4), friction(2e6))
    0.4 0.7
    """

    energies: tuple[float, ...]
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        table = EnergyTable(self.energies, self.values)  # refuses what is no table
        checks.settle(self, energies=table.energy, values=table.factor)

    def __call__(self, energy: Array | float) -> Array:
        return np.asarray(np.interp(_energies(energy), self.energies, self.values))


@dataclass(frozen=True)
class JointEvolution:
    """Which parameters of a joint law follow which function of the joint's energy.

    Functions of ``stiffness``, ``residual_stiffness``, ``friction`` and ``normal_load`` take the
    energy dissipated so far [N mm]. A function multiplies the initial value; a table replaces it.
    Those of None stay. No parameter
    falls below 0: what is worn to nothing stays so.

    Examples
    --------
    A joint whose friction rises as ln E, and whose bolt loses preload:

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
        """The ``law``, whose parameters are the initial ones, after an ``energy`` [N mm].

        ``energy`` is one of all joints, or ``(n,)``, one of each. Raises InputError for a law
        without a parameter that is to evolve.
        """
        values = self.values(law, energy)
        # A law of plain numbers keeps plain numbers.
        return replace(law, **{k: v if v.ndim else float(v) for k, v in values.items()})

    def values(self, law: object, energy: Array | float) -> dict[str, Array]:
        """Evolving parameters by name, of ``energy`` broadcast with the initial ones."""
        values = {}
        for name, function in self._functions():
            initial = getattr(law, name, None)
            if initial is None:
                raise InputError(f"{type(law).__name__} has no {name} that could evolve")
            scale = np.ones_like(initial) if isinstance(function, TabulatedEvolution) else initial
            values[name] = np.asarray(np.maximum(function(energy) * scale, 0.0))
        return values

    @property
    def breaks(self) -> tuple[float, ...]:
        """Energies at which a parameter has a kink: those of the tables, ascending [N mm]."""
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
