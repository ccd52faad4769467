"""Error of each rung of a probe's ladder, relative to the limit of refinement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from workflow.shell.convergence import richardson

Numbers = dict[str, dict[str, float]]  # by interface and quantity

# A flank that carries, dissipates or wears less than this share of the other is measured relative
# to that share.
LESSER_FLANK = 0.1
# Order that is assumed beyond the probed rungs if these show none.
LEAST_ORDER = 0.5


@dataclass(frozen=True)
class Deviation:
    """Relative ``errors`` of one quantity on every rung, and their ``order`` of convergence."""

    name: str
    errors: tuple[float, ...]
    order: float

    def beyond(self, refinement: float) -> float:
        """Return the error at a step shorter than the last by the factor ``refinement``."""
        return self.errors[-1] / refinement**self.order

    def refinement(self, allowed: float) -> float:
        """Return the factor by which the last step must be shortened for an ``allowed`` error."""
        if self.errors[-1] <= 0.0:
            return 0.0
        return float((self.errors[-1] / allowed) ** (1.0 / self.order))


@dataclass(frozen=True)
class FidelityEstimate:
    """Deviations of all quantities of all interfaces."""

    deviations: tuple[Deviation, ...]

    @property
    def errors(self) -> list[float]:
        """Largest error of every rung."""
        return [max(errors) for errors in zip(*(d.errors for d in self.deviations), strict=True)]

    def worst(self, rung: int) -> str:
        """Return the name of the quantity with the largest error on a rung."""
        return max(self.deviations, key=lambda deviation: deviation.errors[rung]).name

    def beyond(self, refinement: float) -> float:
        """Return the largest error at a step shorter than the last by the factor ``refinement``."""
        return max(deviation.beyond(refinement) for deviation in self.deviations)

    def refinement(self, allowed: float) -> float:
        """Return the factor by which the last step must be shortened for ``allowed`` errors."""
        return max(deviation.refinement(allowed) for deviation in self.deviations)


def scales(values: Numbers) -> Numbers:
    """Return the values that errors are relative to."""
    names = next(iter(values.values()))
    largest = {name: max(abs(quantities[name]) for quantities in values.values()) for name in names}
    return {
        flank: {
            name: max(abs(value), LESSER_FLANK * largest[name])
            for name, value in quantities.items()
        }
        for flank, quantities in values.items()
    }


def estimate(values: Sequence[Numbers], steps: Sequence[float], order: float) -> FidelityEstimate:
    """Return the errors of the rungs, coarse to fine, of methods of at most this ``order``.

    Errors are relative to the last rung. The last error is Richardson's; each other one adds the
    distance to the last rung, so that an early rung that is close by chance has no smaller error
    than the last.
    """
    deviations = []
    for flank, quantities in scales(values[-1]).items():
        for name, scale in quantities.items():
            series = [rung[flank][name] for rung in values]
            deviations.append(_deviation(f"{name} on the {flank}", series, scale, steps, order))
    return FidelityEstimate(tuple(deviations))


def _deviation(
    name: str, values: Sequence[float], scale: float, steps: Sequence[float], order: float
) -> Deviation:
    if scale <= 0.0:
        return Deviation(name, (0.0,) * len(values), order)
    convergence = richardson(values, steps, order)
    errors = [(abs(value - values[-1]) + convergence.error) / scale for value in values]
    observed = LEAST_ORDER if convergence.order is None else convergence.order
    return Deviation(name, tuple(errors), min(max(observed, LEAST_ORDER), order))
