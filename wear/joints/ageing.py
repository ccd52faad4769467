"""Long tests by jumps in energy: how many cycles a joint takes to dissipate a given energy.

The parameters of a joint change only at the end of a cycle, so that its cumulative energy obeys

    E(N + 1) = E(N) + e(E(N))

with e(E) the energy of a cycle at the parameters that belong to E. A jump takes many cycles as one
panel of energy, in which the smooth curve through these points has

    dN/dE = 1/e + e'/(2 e) - (e'' + e'²/e)/12 + ...

(insert it into N(E + e) = N(E) + 1 and compare powers of e). The second term is the half cycle by
which counting differs from integrating. The third is omitted and counts as an error. The first two
are integrated over the panel by Chebyshev polynomials, whose last coefficients estimate the error
of the quadrature. Because e depends on E alone, an error in N is carried on unchanged: the errors
of the panels add up, and their sum is reported. Where a panel within the tolerance would hold only
a few cycles, these are counted instead, without error. Tests whose friction rises within tens of
cycles begin in this way, and kinks are passed in this way.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.polynomial import Chebyshev, chebyshev

from sa_solver import checks
from sa_solver.errors import ConvergenceError, InputError
from sa_solver.types import Array
from wear.joints.evolution import JointEvolution
from wear.joints.jumps import Jump
from wear.joints.parameters import UniaxialLaw

DEGREE = 16
"""Degree of the polynomials of a panel. Friction that rises as ln E is then accurate to 1e-8 in
panels whose ends have a ratio of 1 to 4.
"""

LAST_COEFFICIENTS = 3
"""Number of last coefficients that estimate the error: for a kink every second one may vanish."""

GROWTH, SHRINKAGE = 4.0, 0.5
"""Factors of the length of the next panel after one that was accepted, or rejected."""

FEWEST_CYCLES = 8
"""Cycles of the smallest panel, and number of cycles counted instead of a smaller one. The number
doubles each time that no panel is accepted: trying a panel takes 17 energies of a cycle, counting
takes one per cycle.
"""

OVERSHOOT = 1.5
"""Largest energy of a panel, over the energy or the energy of the cycles that are left."""

MOST_EVALUATIONS = 2_000_000
"""Limit of evaluated energies of a cycle: a function that is not smooth can only be counted."""

SMALLEST_TOLERANCE = 1e-12
"""Smallest tolerance; the rounding of a panel's polynomials is a hundredth of it."""

ROUNDING = 1e-12
"""Relative accuracy with which the energy at the end of a test is that computed there."""

EnergyPerCycle = Callable[[float], float]
"""Function from the energy dissipated so far to the energy of a cycle [N mm]."""


class AgeingError(ConvergenceError):
    """The energy per cycle is invalid, or not smooth enough for jumps."""


class NeverReachedError(AgeingError):
    """The joint stops dissipating before it reaches the energy asked for."""


@dataclass(frozen=True)
class LongTest:
    """Energy against cycles of a long test.

    Parameters
    ----------
    energy_before
        Energy dissipated before the test [N mm].
    total_cycles
        Cycles of the test.
    jumps
        Jumps of which it consists.
    evaluations
        Number of evaluated energies of a cycle.
    """

    energy_before: float
    total_cycles: float
    jumps: tuple[Jump, ...]
    evaluations: int

    @property
    def cycles(self) -> Array:
        """Cycles at the ends of all jumps, from 0 to the end of the test ``(k,)``."""
        inner = [jump.cycles for jump in self.jumps if 0.0 < jump.cycles < self.total_cycles]
        return np.array([0.0, *inner, self.total_cycles])

    @property
    def energy(self) -> Array:
        """Energy dissipated at the ends of all jumps ``(k,)`` [N mm]."""
        return self.energy_at(self.cycles)

    @property
    def error(self) -> float:
        """Largest error of :meth:`cycles_at` at the end, in cycles: the sum over all jumps."""
        return sum(jump.error for jump in self.jumps)

    @property
    def final_energy(self) -> float:
        """Energy at the end of the test [N mm]."""
        return float(self.energy_at(self.total_cycles))

    def energy_at(self, cycles: Array | float) -> Array:
        """Return the energy after ``cycles``, in their shape [N mm].

        Raise InputError for cycles outside the test.
        """
        cycles = checks.array("cycles", cycles, None)
        if np.any((cycles < 0.0) | (cycles > self.total_cycles)):
            raise InputError(
                f"the test has {self.total_cycles:g} cycles, not all of those given; allowed: from "
                "0 to its end"
            )
        return np.asarray(np.vectorize(self._energy, otypes=[float])(cycles))

    def cycles_at(self, energy: Array | float) -> Array:
        """Return the cycles after which the joint has dissipated ``energy`` [N mm], in its shape.

        They are NaN for energies not reached in the test. Raise InputError for energies below that
        before the test.
        """
        energy = checks.array("energies", energy, None)
        if np.any(energy < self.energy_before):
            raise InputError(
                f"an energy is below the {self.energy_before:g} N mm dissipated before the test; "
                "allowed: that energy or more"
            )
        return np.asarray(np.vectorize(self._cycles, otypes=[float])(energy))

    def _energy(self, cycles: float) -> float:
        if not self.jumps:
            return self.energy_before
        place = bisect_right(self.jumps, cycles, key=lambda jump: jump.cycles) - 1
        return self.jumps[place].energy_at(cycles)

    def _cycles(self, energy: float) -> float:
        if not self.jumps:
            return 0.0 if energy == self.energy_before else np.nan
        if energy > self.final_energy * (1.0 + ROUNDING):
            return np.nan
        jump = self.jumps[bisect_right(self.jumps, energy, key=lambda jump: jump.start) - 1]
        return min(jump.cycles + jump.since(energy), self.total_cycles)


# --- long tests ---------------------------------------------------------------------------------


def long_test(
    energy_per_cycle: EnergyPerCycle,
    cycles: float = np.inf,
    *,
    until: float = np.inf,
    start: float = 0.0,
    tolerance: float = 1e-6,
    breaks: Sequence[float] = (),
) -> LongTest:
    """Compute the energy of a joint against cycles, by jumps.

    Where a cycle dissipates nothing the energy stays constant for good.

    Parameters
    ----------
    energy_per_cycle
        Energy of a cycle as a function of the energy dissipated before it [N mm].
    cycles
        Number of cycles.
    until
        Energy at which the test ends if it comes earlier [N mm].
    start
        Energy dissipated before the test [N mm].
    tolerance
        Allowed relative error of the number of cycles after which any energy is reached.
    breaks
        Energies at which ``energy_per_cycle`` has a kink
        (:attr:`~wear.joints.evolution.JointEvolution.breaks`) [N mm]: the cycles across it are
        counted.

    Returns
    -------
    LongTest
        Energy against cycles, with its error.

    Raises
    ------
    InputError
        If cycles, energies or the tolerance are invalid.
    wear.joints.ageing.AgeingError
        If an energy per cycle is negative, not finite or too rough for jumps.
    wear.joints.ageing.NeverReachedError
        If the energy is never reached and the cycles are not limited.

    Examples
    --------
    Where a cycle dissipates c (1 + E/E0), the energy is E0 ((1 + c/E0)^N - 1) after N cycles:

    >>> from wear.joints import long_test
    >>> test = long_test(lambda energy: 0.01 * (1.0 + energy / 1e3), cycles=1e5)
    >>> print(f"{test.final_energy:.2f} N mm of {1e3 * ((1.0 + 1e-5) ** 1e5 - 1.0):.2f}")
    1718.27 N mm of 1718.27
    >>> print(f"{test.evaluations} cycles were computed")
    144 cycles were computed
    """
    cycles = checks.number("cycles", cycles, above=0.0, infinite=True)
    start = checks.number("start", start, least=0.0)
    until = checks.number("until", until, above=start, infinite=True)
    if cycles == until == np.inf:
        raise InputError("a test without end; allowed: a number of cycles or an energy that end it")
    if not SMALLEST_TOLERANCE <= checks.number("tolerance", tolerance) < 1.0:
        raise InputError(f"tolerance {tolerance:g}; allowed: {SMALLEST_TOLERANCE:g} to 1")
    kinks = sorted(checks.array("breaks", breaks, (None,)).tolist())
    return _TestInProgress(energy_per_cycle, cycles, until, tolerance, kinks).run(start)


@dataclass
class _TestInProgress:
    """A long test in progress, to ``total`` cycles or ``until`` an energy."""

    energy_per_cycle: EnergyPerCycle
    total: float
    until: float
    tolerance: float
    breaks: list[float]
    jumps: list[Jump] = field(default_factory=list)
    cycles: float = 0.0
    evaluations: int = 0

    def run(self, start: float) -> LongTest:
        """Run the test from the energy ``start`` to its end."""
        energy, width, block = start, 0.0, FEWEST_CYCLES
        while self.cycles < self.total and energy < self.until:
            rate = self._rate(energy)
            # An energy too small to change the sum counts as none.
            if energy + rate == energy:
                break
            to_break = self._to_break(energy)
            width = min(max(width, 2 * FEWEST_CYCLES * rate), self._left(energy, rate), to_break)
            jump = self._panel(energy, width, FEWEST_CYCLES * rate)
            if jump is None:
                energy = self._count(self._end_of_cycle(energy), block)
                width, block = 0.0, 2 * block
                continue
            self._add(jump)
            energy, width, block = jump.end, GROWTH * (jump.end - jump.start), FEWEST_CYCLES
            if jump.end - jump.start == to_break:
                energy = self._count(self._end_of_cycle(energy), FEWEST_CYCLES)
        return LongTest(start, self._end(energy), tuple(self.jumps), self.evaluations)

    def _left(self, energy: float, rate: float) -> float:
        """Return the largest energy that a panel may have."""
        return OVERSHOOT * min((self.total - self.cycles) * rate, self.until - energy)

    def _end(self, energy: float) -> float:
        """Return the cycles of the whole test, which has reached ``energy``."""
        if energy >= self.until:
            jump = next(jump for jump in reversed(self.jumps) if jump.start < self.until)
            return min(self.total, jump.cycles + jump.since(self.until))
        if self.total == np.inf:
            raise NeverReachedError(
                f"{self.until:g} N mm are never reached: after {self.cycles:.6g} cycles and "
                f"{energy:g} N mm a cycle dissipates nothing; give a smaller energy or a number of "
                "cycles"
            )
        return self.total

    def _add(self, jump: Jump) -> None:
        self.jumps.append(jump)
        self.cycles += jump.length

    def _end_of_cycle(self, energy: float) -> float:
        """Go back from ``energy`` to the end of a cycle, and return the energy there.

        Which energies are ends of cycles matters at a kink, and counting is only exact from such an
        energy.
        """
        whole = float(np.floor(self.cycles))
        if whole == self.cycles:
            return energy
        last = self.jumps[-1]
        self.jumps[-1] = replace(last, end=last.energy_at(whole))
        self.cycles = whole
        return self.jumps[-1].end

    def _panel(self, energy: float, width: float, least: float) -> Jump | None:
        """Return the longest accepted panel from ``energy`` on, or None if below ``least``."""
        while width >= least:
            jump = self._attempt(energy, energy + width)
            if jump is not None and jump.error <= self.tolerance * jump.length:
                return jump
            width *= SHRINKAGE
        return None

    def _attempt(self, start: float, end: float) -> Jump | None:
        """Return the panel from ``start`` to ``end``, or None if one of its cycles has no loss."""
        nodes = chebyshev.chebpts1(DEGREE + 1)
        energies = start + 0.5 * (end - start) * (nodes + 1.0)
        rates = np.array([self._rate(float(energy)) for energy in energies])
        if np.any(rates <= 0.0):
            return None
        fitted = _through(rates, (start, end))
        slopes, curvatures = fitted.deriv(1)(energies), fitted.deriv(2)(energies)
        density = _through((1.0 + 0.5 * slopes) / rates, (start, end))
        quadrature = float(np.abs(density.coef[-LAST_COEFFICIENTS:]).max())
        counting = float(np.mean(np.abs(curvatures + slopes**2 / rates))) / 12.0
        error = (quadrature + counting) * (end - start)
        return Jump(start, end, self.cycles, density.integ(lbnd=start), error)

    def _count(self, energy: float, cycles: int) -> float:
        """Count ``cycles``, no more than are left, and return the energy after them."""
        for _ in range(cycles):
            after = energy + self._rate(energy)
            if after == energy or self.cycles >= self.total:
                break
            self._add(Jump(energy, after, self.cycles, None, 0.0))
            energy = after
        return energy

    def _rate(self, energy: float) -> float:
        self.evaluations += 1
        if self.evaluations > MOST_EVALUATIONS:
            raise AgeingError(
                f"only {self.cycles:.6g} of {self.total:.6g} cycles are done after "
                f"{MOST_EVALUATIONS} evaluated energies of a cycle, which are not smooth within "
                "the tolerance; allow a larger one, or give the energies at which they have kinks"
            )
        rate = float(self.energy_per_cycle(energy))
        if not 0.0 <= rate < np.inf:
            raise AgeingError(
                f"a cycle dissipates {rate:g} N mm after {energy:g} N mm; allowed: 0 or more, and "
                "finite"
            )
        return rate

    def _to_break(self, energy: float) -> float:
        return min((place - energy for place in self.breaks if place > energy), default=np.inf)


def _through(values: Array, domain: tuple[float, float]) -> Chebyshev:
    """Return the polynomial through ``values`` at the Chebyshev points of the ``domain``."""
    count = len(values)
    matrix = chebyshev.chebvander(chebyshev.chebpts1(count), count - 1)
    coefficients = matrix.T @ values * (2.0 / count)
    coefficients[0] *= 0.5
    return Chebyshev(coefficients, domain=domain)


# --- a joint at a prescribed stroke -------------------------------------------------------------


def steady_stroke(law: UniaxialLaw, evolution: JointEvolution, amplitude: float) -> EnergyPerCycle:
    """Return the energy per cycle of one joint at a stroke of ± ``amplitude``, in closed form.

    Parameters
    ----------
    law
        Law of the joint with its initial parameters.
    evolution
        Evolution of the parameters with the energy.
    amplitude
        Half of the stroke [mm].

    Examples
    --------
    A Jenkins element with constant friction dissipates 4 µN (A - µN/kt) in every cycle:

    >>> from wear.joints import Jenkins, JointEvolution, long_test, steady_stroke
    >>> law = Jenkins(stiffness=1e4, friction=0.5, normal_load=100.0)
    >>> steady = steady_stroke(law, JointEvolution(), amplitude=0.01)
    >>> print(steady(0.0), "N mm of", 4.0 * 50.0 * (0.01 - 50.0 / 1e4))
    1.0 N mm of 1.0
    >>> print(f"{long_test(steady, cycles=1e6).final_energy:.0f} N mm")
    1000000 N mm
    """
    amplitude = checks.number("amplitude", amplitude, least=0.0)

    def energy_per_cycle(energy: float) -> float:
        return float(evolution.at(law, energy).loop_energy(amplitude))

    return energy_per_cycle


def marched_stroke(
    law: UniaxialLaw, evolution: JointEvolution, amplitude: float, start: float = 0.0
) -> EnergyPerCycle:
    """Return the energy per cycle of :func:`steady_stroke`, marched with the memory of the joint.

    One joint goes from +``amplitude`` [mm] to -``amplitude`` and back, with the parameters that
    belong to the energy at the beginning of the cycle: laws are exact along a straight path. The
    way to the first +``amplitude`` has the parameters of ``start`` [N mm], and its energy does not
    count.
    """
    begun = evolution.at(law, start)
    state = begun.respond(begun.rest(1), np.array([[amplitude]])).state

    def energy_per_cycle(energy: float) -> float:
        nonlocal state
        worn, total = evolution.at(law, energy), 0.0
        for step in (-2.0 * amplitude, 2.0 * amplitude):
            response = worn.respond(state, np.array([[step]]))
            state, total = response.state, total + float(response.dissipated[0])
        return total

    return energy_per_cycle


# --- verification -------------------------------------------------------------------------------


@dataclass(frozen=True)
class IntegratedCycles:
    """Cycles of a long test that were integrated one after the other.

    Parameters
    ----------
    energy
        Energy before the first and after each of ``k`` cycles ``(k + 1,)`` [N mm].
    jumped
        Energy of the test after the same cycles ``(k + 1,)`` [N mm].
    difference
        Difference of the last energies, in cycles.
    stated
        Largest difference according to the error of the test, in cycles.
    """

    energy: Array
    jumped: Array
    difference: float
    stated: float


def integrate_cycles(
    test: LongTest, energy_per_cycle: EnergyPerCycle, first: float, cycles: int
) -> IntegratedCycles:
    """Integrate some cycles of a long test directly, and compare.

    Parameters
    ----------
    test
        The long test.
    energy_per_cycle
        Energy of a cycle, called once for every cycle, in order. It may be that of the test, or an
        independent one with a memory of its own.
    first
        Number of the first cycle.
    cycles
        Number of cycles.

    Raises
    ------
    InputError
        If the test does not have these cycles.
    """
    if cycles < 1:
        raise InputError(f"{cycles} cycles are to be integrated; allowed: one or more")
    numbers = np.arange(cycles + 1, dtype=np.float64) + first
    jumped = test.energy_at(numbers)
    energy = np.empty(cycles + 1)
    energy[0] = jumped[0]
    for cycle in range(cycles):
        energy[cycle + 1] = energy[cycle] + energy_per_cycle(float(energy[cycle]))
    last = energy[-1] - energy[-2]
    difference = float((energy[-1] - jumped[-1]) / last) if last > 0.0 else 0.0
    touched = [
        jump
        for jump in test.jumps
        if jump.cycles <= numbers[-1] and jump.cycles + jump.length >= numbers[0]
    ]
    # A jump may have its error at either end of these cycles.
    stated = 2.0 * sum(jump.error for jump in touched)
    return IntegratedCycles(energy, jumped, difference, stated)
