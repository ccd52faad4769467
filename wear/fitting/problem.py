"""Problem of a fit: free parameters, series of data, and the model between them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array, Indices, Mask


class FitError(InputError):
    """Data or parameters that cannot be fitted."""


def settle_columns(
    data: object, whose: str, given: Sequence[str], optional: Sequence[str] = ()
) -> None:
    """Make columns of ``data`` arrays ``(n,)`` of one length, while it is made.

    Those that are ``optional`` may be None. Whether those ``given`` are finite, and of one length,
    is looked at where a problem is made of them. Raises :class:`FitError`.
    """
    found = {name: column(whose, name, getattr(data, name)) for name in given}
    length = len(found[given[-1]])
    for name in optional:
        if (values := getattr(data, name)) is not None:
            found[name] = column(whose, name, values, length, finite=True)
    checks.settle(data, **found)


def column(
    whose: str, name: str, values: object, length: int | None = None, *, finite: bool = False
) -> Array:
    """Return a column ``(n,)`` of data, of any length unless one is given.

    Raises :class:`FitError`.
    """
    what = f"{whose}: values of {name}"
    return checks.array(what, values, (length,), error=FitError, finite=finite)


def require_distinct_names(names: Sequence[str]) -> None:
    """Raise :class:`FitError` for no data, or for two that have one name."""
    if not names or len(set(names)) < len(names):
        raise FitError(f"data named {', '.join(names) or 'nothing'}; allowed: a name for each")


@dataclass(frozen=True)
class FreeParameter:
    """Free parameter of a fit.

    Parameters
    ----------
    name
        Name of the parameter.
    lower, upper
        Bounds of its value.
    size
        Uncertainty at which the parameter counts as undetermined, if this is more than its value.
    logarithmic
        Whether the logarithm is fitted. The parameter is then above 0 and its uncertainty is a
        factor.
    nuisance
        Whether the parameter is fitted but not reported. Nuisances come after all other parameters.

    Examples
    --------
    A rate that is known within powers of ten:

    >>> from wear.fitting import FreeParameter
    >>> rate = FreeParameter("rate", lower=1e-9, upper=1e-3, logarithmic=True)
    """

    name: str
    lower: float = -np.inf
    upper: float = np.inf
    size: float = 0.0
    logarithmic: bool = False
    nuisance: bool = False

    def __post_init__(self) -> None:
        lower, upper = (
            float(checks.array(f"bounds of {self.name}", end, (), error=FitError, finite=False))
            for end in (self.lower, self.upper)
        )
        if not lower <= upper or (self.logarithmic and lower < 0.0):
            raise FitError(
                f"{self.name} from {lower:g} to {upper:g}; allowed: a lower bound below the upper "
                "one, and above 0 where the logarithm is fitted"
            )
        checks.settle(self, lower=lower, upper=upper)
        checks.number(f"size of {self.name}", self.size, least=0.0, infinite=True, error=FitError)


@dataclass(frozen=True)
class Series:
    """Data of one kind.

    Parameters
    ----------
    name
        Name of the data.
    values
        Measured values ``(n,)``.
    deviations
        Standard deviations of the values ``(n,)``, if they are known. Otherwise a common standard
        deviation is estimated from the residuals.
    shares
        Ratios ``(n,)`` of the deviations of the values to the estimated one; 1 by default.

    Examples
    --------
    >>> import numpy as np
    >>> from wear.fitting import Series
    >>> friction = Series("friction", np.array([0.61, 0.64]), deviations=np.array([0.01, 0.01]))
    """

    name: str
    values: Array
    deviations: Array | None = None
    shares: Array | None = None

    def __post_init__(self) -> None:
        settle_columns(self, self.name, ("values",), ("deviations", "shares"))

    def scattered(self, deviation: float) -> Array:
        """Return the deviations ``(n,)`` that are the ``shares`` of this ``deviation``."""
        ones = np.ones(len(self.values))
        return deviation * (ones if self.shares is None else self.shares)


@dataclass(frozen=True)
class FitProblem:
    """Problem of a fit.

    Parameters
    ----------
    unknowns
        Free parameters.
    series
        Measured data.
    predict
        Model that returns all data ``(n,)``, in the order of the series, for the values ``(p,)`` of
        the unknowns.
    starts
        Initial values ``(p,)``, which are tried in this order.

    Examples
    --------
    The mean of three values as a problem:

    >>> import numpy as np
    >>> from wear.fitting import FitProblem, Series, FreeParameter, fit
    >>> mean = FitProblem(
    ...     unknowns=(FreeParameter("mean"),),
    ...     series=(Series("y", np.array([1.0, 2.0, 3.0])),),
    ...     predict=lambda values: np.full(3, values[0]),
    ...     starts=[np.zeros(1)],
    ... )
    >>> print(f"{fit(mean).estimates[0].value:.6f}")
    2.000000
    """

    unknowns: tuple[FreeParameter, ...]
    series: tuple[Series, ...]
    predict: Callable[[Array], Array]
    starts: Sequence[Array]

    def __post_init__(self) -> None:
        count = len(self.unknowns)
        starts = [checks.array("starts", one, (count,), error=FitError) for one in self.starts]
        checks.settle(self, starts=starts)

    @cached_property
    def data(self) -> Array:
        """Data of all series ``(n,)``."""
        return np.concatenate([series.values for series in self.series])

    @cached_property
    def places(self) -> Indices:
        """Number of the series of each datum ``(n,)``."""
        return np.repeat(np.arange(len(self.series)), [len(one.values) for one in self.series])

    @cached_property
    def logarithmic(self) -> Mask:
        """Mask of the unknowns that are fitted as logarithms ``(p,)``."""
        return np.array([unknown.logarithmic for unknown in self.unknowns], dtype=np.bool_)

    def inner(self, values: Array) -> Array:
        """Return ``values`` as they are fitted: logarithms where these are fitted."""
        return np.where(self.logarithmic, np.log(np.where(self.logarithmic, values, 1.0)), values)

    def outer(self, inner: Array) -> Array:
        """Return the values of the parameters from fitted ones."""
        return np.where(self.logarithmic, np.exp(np.where(self.logarithmic, inner, 0.0)), inner)

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the fitted values, each ``(p,)``."""
        with np.errstate(divide="ignore"):
            lower = self.inner(np.array([unknown.lower for unknown in self.unknowns]))
            upper = self.inner(np.array([unknown.upper for unknown in self.unknowns]))
        return lower, upper
