"""How far each rung of a probe's ladder is from the limit that the ladder goes to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from workflow.shell.convergence import richardson

Numbers = dict[str, dict[str, float]]  # by interface and quantity

# A flank that carries, dissipates or wears less than this share of the other's is measured by that
# share.
LESSER_FLANK = 0.1
# An order that is taken for granted beyond the probed rungs where these show none.
LEAST_ORDER = 0.5


@dataclass(frozen=True)
class Deviation:
    """Relative ``errors`` of one quantity on every rung, and the ``order`` they fall with."""

    name: str
    errors: tuple[float, ...]
    order: float

    def beyond(self, refinement: float) -> float:
        """Error at a step shorter than the last one by a factor (longer: below 1)."""
        return self.errors[-1] / refinement**self.order

    def refinement(self, allowed: float) -> float:
        """How much shorter than the last one a step must be for this error."""
        if self.errors[-1] <= 0.0:
            return 0.0
        return float((self.errors[-1] / allowed) ** (1.0 / self.order))


@dataclass(frozen=True)
class Estimate:
    """Deviations of all quantities of all interfaces."""

    deviations: tuple[Deviation, ...]

    @property
    def errors(self) -> list[float]:
        """The largest error of every rung."""
        return [max(errors) for errors in zip(*(d.errors for d in self.deviations), strict=True)]

    def worst(self, rung: int) -> str:
        """The quantity that is worst on a rung."""
        return max(self.deviations, key=lambda deviation: deviation.errors[rung]).name

    def beyond(self, refinement: float) -> float:
        """The largest error at a step shorter than the last one by a factor."""
        return max(deviation.beyond(refinement) for deviation in self.deviations)

    def refinement(self, allowed: float) -> float:
        """How much shorter than the last one a step must be for this error."""
        return max(deviation.refinement(allowed) for deviation in self.deviations)


def scales(values: Numbers) -> Numbers:
    """What errors of the values are relative to."""
    names = next(iter(values.values()))
    largest = {name: max(abs(quantities[name]) for quantities in values.values()) for name in names}
    return {
        flank: {
            name: max(abs(value), LESSER_FLANK * largest[name])
            for name, value in quantities.items()
        }
        for flank, quantities in values.items()
    }


def estimate(values: Sequence[Numbers], steps: Sequence[float], order: float) -> Estimate:
    """Errors of the rungs, coarse to fine, of methods of at most this ``order`` in their ``steps``.

    Relative to the last rung. The last one's error is Richardson's, those of the others are their
    distances from it on top, so that an early one that is near by chance counts for no more than
    the last.
    """
    deviations = []
    for flank, quantities in scales(values[-1]).items():
        for name, scale in quantities.items():
            series = [rung[flank][name] for rung in values]
            deviations.append(_deviation(f"{name} on the {flank}", series, scale, steps, order))
    return Estimate(tuple(deviations))


def _deviation(
    name: str, values: Sequence[float], scale: float, steps: Sequence[float], order: float
) -> Deviation:
    if scale <= 0.0:
        return Deviation(name, (0.0,) * len(values), order)
    convergence = richardson(values, steps, order)
    errors = [(abs(value - values[-1]) + convergence.error) / scale for value in values]
    observed = LEAST_ORDER if convergence.order is None else convergence.order
    return Deviation(name, tuple(errors), min(max(observed, LEAST_ORDER), order))
