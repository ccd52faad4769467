"""Long tests by jumps in energy: how many cycles a joint takes to dissipate a given energy.

The parameters of a joint change at the end of a cycle only, so its cumulative energy obeys

    E(N + 1) = E(N) + e(E(N))

with e(E) the energy of a cycle at the parameters that belong to E. A jump takes many cycles as one
panel of energy, in which the smooth curve through these points has

    dN/dE = 1/e + e'/(2 e) - (e'' + e'²/e)/12 + ...

(put it into N(E + e) = N(E) + 1 and compare powers of e). The second term is the half cycle by
which counting differs from integrating; the third is left out and counts as an error. The first
two are integrated over the panel by Chebyshev polynomials, whose last coefficients estimate the
quadrature's error. Because e depends on E alone, an error of N made once is carried on unchanged:
those of the panels add up, and their sum is stated. Where a panel as good as the tolerance asks for
would hold a few cycles only, these are counted instead, without error: so begin tests whose
friction rises within tens of cycles, and so are kinks passed.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.polynomial import Chebyshev, chebyshev
from scipy.optimize import brentq

from sa_solver import checks
from sa_solver.errors import ConvergenceError, InputError
from sa_solver.types import Array
from wear.joints.evolution import JointEvolution
from wear.joints.parameters import UniaxialLaw

DEGREE = 16
"""Of the polynomials of a panel: friction that rises as ln E is then met to 1e-8 in panels whose
ends are as 1 to 4."""

TAIL = 3
"""Last coefficients that estimate the error: of a kink, every second may vanish."""

GROWTH, SHRINKAGE = 4.0, 0.5
"""Of a panel after one that was good enough, or was not."""

FEWEST = 8
"""Cycles of the smallest panel, and those counted instead of a smaller one, twice as many each time
that no panel is good enough: trying one takes 17 energies of a cycle, counting one for each."""

REACH = 1.5
"""Most energy of a panel, over that which is left, if need be at the present energy per cycle."""

MOST_EVALUATIONS = 2_000_000
"""Energies of a cycle evaluated before giving up: what is not smooth can only be counted."""

SMALLEST_TOLERANCE = 1e-12
"""Rounding of a panel's polynomials is a hundredth of it."""

ROUNDING = 1e-12
"""Relative, of an energy: to this accuracy the end of a test has the energy computed there."""

SMALLEST = 1e-300
"""Absolute tolerance of an energy: it is solved for to its last digit, however small it is."""

EnergyPerCycle = Callable[[float], float]
"""Energy of a cycle [N mm] as a function of the energy dissipated before it [N mm]."""


class AgeingError(ConvergenceError):
    """The energy per cycle makes no sense, or is not smooth enough to be jumped."""


class NeverReachedError(AgeingError):
    """The joint dissipates nothing any more before it has come to the energy asked for."""


@dataclass(frozen=True)
class Jump:
    """A stretch of a long test.

    It goes from ``start`` to ``end`` [N mm] and begins after ``cycles``; ``count`` are the cycles
    since, a polynomial of the energy, and ``error`` how many they may be wrong anywhere in it. With
    no polynomial it is a single cycle, counted.
    """

    start: float
    end: float
    cycles: float
    count: Chebyshev | None
    error: float

    @property
    def length(self) -> float:
        """Its cycles."""
        return self.since(self.end)

    def since(self, energy: float) -> float:
        """Cycles from its start to an ``energy`` in it [N mm]."""
        if self.count is None:
            return (energy - self.start) / (self.end - self.start)
        return float(self.count(energy))

    def energy_at(self, cycles: float) -> float:
        """Energy after ``cycles`` of the test, which lie in this jump [N mm]."""
        since = cycles - self.cycles
        if since <= 0.0:
            return self.start
        if since >= self.length:
            return self.end
        if self.count is None:
            return self.start + since * (self.end - self.start)
        root = brentq(
            lambda energy: self.since(energy) - since, self.start, self.end, xtol=SMALLEST
        )
        return float(root)


@dataclass(frozen=True)
class LongTest:
    """Energy against cycles of a long test, from ``energy_before`` [N mm] on, as its ``jumps``.

    It lasted ``total_cycles``. ``evaluations`` are the energies of a cycle that it took.
    """

    energy_before: float
    total_cycles: float
    jumps: tuple[Jump, ...]
    evaluations: int

    @property
    def cycles(self) -> Array:
        """At the ends of all jumps, from 0 to the end of the test ``(k,)``."""
        inner = [jump.cycles for jump in self.jumps if 0.0 < jump.cycles < self.total_cycles]
        return np.array([0.0, *inner, self.total_cycles])

    @property
    def energy(self) -> Array:
        """Dissipated by then ``(k,)`` [N mm]."""
        return self.energy_at(self.cycles)

    @property
    def error(self) -> float:
        """Cycles by which :meth:`cycles_at` may be wrong at the end: the sum over all jumps."""
        return sum(jump.error for jump in self.jumps)

    @property
    def final_energy(self) -> float:
        """At the end of the test [N mm]."""
        return float(self.energy_at(self.total_cycles))

    def energy_at(self, cycles: Array | float) -> Array:
        """Energy after ``cycles``, of their shape [N mm].

        Raises InputError for cycles that the test does not have.
        """
        cycles = checks.array("cycles", cycles, None)
        if np.any((cycles < 0.0) | (cycles > self.total_cycles)):
            raise InputError(f"cycles outside a test of {self.total_cycles:g}; allowed: within it")
        return np.asarray(np.vectorize(self._energy, otypes=[float])(cycles))

    def cycles_at(self, energy: Array | float) -> Array:
        """Cycles after which the joint has dissipated ``energy`` [N mm], of its shape.

        NaN where it has not by the end of the test. Raises InputError below the energy before it.
        """
        energy = checks.array("energies", energy, None)
        if np.any(energy < self.energy_before):
            raise InputError(
                f"energies below {self.energy_before:g} N mm, which were there before the test"
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


# --- jumping ------------------------------------------------------------------------------------


def long_test(
    energy_per_cycle: EnergyPerCycle,
    cycles: float = np.inf,
    *,
    until: float = np.inf,
    start: float = 0.0,
    tolerance: float = 1e-6,
    breaks: Sequence[float] = (),
) -> LongTest:
    """Run ``cycles`` of a joint that has dissipated ``start`` [N mm] before.

    With ``until`` it ends where the joint has dissipated that energy [N mm], if that comes earlier.
    ``tolerance`` is the error allowed in the number of cycles after which any energy is reached,
    relative to it. ``breaks`` [N mm] are energies at which ``energy_per_cycle`` has a kink
    (:attr:`~wear.joints.evolution.JointEvolution.breaks`): cycles across it are counted. Where a
    cycle dissipates nothing the energy stays for good. Raises InputError for cycles, energies or a
    tolerance that make no sense, AgeingError for an energy per cycle that is negative, not finite
    or too rough to be jumped, NeverReachedError for an energy never reached, cycles not limited.

    Examples
    --------
    Where a cycle dissipates c (1 + E/E0), the energy comes to E0 ((1 + c/E0)^N - 1) in N cycles:

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
    return _Jumper(energy_per_cycle, cycles, until, tolerance, kinks).run(start)


@dataclass
class _Jumper:
    """A long test under way, to a ``total`` of cycles or ``until`` an energy."""

    energy_per_cycle: EnergyPerCycle
    total: float
    until: float
    tolerance: float
    breaks: list[float]
    jumps: list[Jump] = field(default_factory=list)
    cycles: float = 0.0
    evaluations: int = 0

    def run(self, start: float) -> LongTest:
        """From ``start`` to the last cycle."""
        energy, width, block = start, 0.0, FEWEST
        while self.cycles < self.total and energy < self.until:
            rate = self._rate(energy)
            # Too little for the sum to change is nothing.
            if energy + rate == energy:
                break
            to_break = self._to_break(energy)
            width = min(max(width, 2 * FEWEST * rate), self._left(energy, rate), to_break)
            jump = self._panel(energy, width, FEWEST * rate)
            if jump is None:
                energy = self._count(self._last_whole(energy), block)
                width, block = 0.0, 2 * block
                continue
            self._add(jump)
            energy, width, block = jump.end, GROWTH * (jump.end - jump.start), FEWEST
            if jump.end - jump.start == to_break:
                energy = self._count(self._last_whole(energy), FEWEST)
        return LongTest(start, self._end(energy), tuple(self.jumps), self.evaluations)

    def _left(self, energy: float, rate: float) -> float:
        """Energy that a panel may have at most."""
        return REACH * min((self.total - self.cycles) * rate, self.until - energy)

    def _end(self, energy: float) -> float:
        """Cycles of the whole test, which has come to ``energy``."""
        if energy >= self.until:
            jump = next(jump for jump in reversed(self.jumps) if jump.start < self.until)
            return min(self.total, jump.cycles + jump.since(self.until))
        if self.total == np.inf:
            raise NeverReachedError(
                f"{self.until:g} N mm are never reached: after {self.cycles:.6g} cycles and "
                f"{energy:g} N mm a cycle dissipates nothing any more"
            )
        return self.total

    def _add(self, jump: Jump) -> None:
        self.jumps.append(jump)
        self.cycles += jump.length

    def _last_whole(self, energy: float) -> float:
        """Go back from ``energy`` to the end of a cycle; the energy there.

        Which energies are ends of cycles matters at a kink, and counting is exact from them only.
        """
        whole = float(np.floor(self.cycles))
        if whole == self.cycles:
            return energy
        last = self.jumps[-1]
        self.jumps[-1] = replace(last, end=last.energy_at(whole))
        self.cycles = whole
        return self.jumps[-1].end

    def _panel(self, energy: float, width: float, least: float) -> Jump | None:
        """The longest good panel from ``energy`` on, none if shorter than ``least`` [N mm]."""
        while width >= least:
            jump = self._attempt(energy, energy + width)
            if jump is not None and jump.error <= self.tolerance * jump.length:
                return jump
            width *= SHRINKAGE
        return None

    def _attempt(self, start: float, end: float) -> Jump | None:
        """The panel from ``start`` to ``end``; none if a cycle dissipates nothing in it."""
        nodes = chebyshev.chebpts1(DEGREE + 1)
        energies = start + 0.5 * (end - start) * (nodes + 1.0)
        rates = np.array([self._rate(float(energy)) for energy in energies])
        if np.any(rates <= 0.0):
            return None
        fitted = _through(rates, (start, end))
        slopes, curvatures = fitted.deriv(1)(energies), fitted.deriv(2)(energies)
        density = _through((1.0 + 0.5 * slopes) / rates, (start, end))
        quadrature = float(np.abs(density.coef[-TAIL:]).max())
        counting = float(np.mean(np.abs(curvatures + slopes**2 / rates))) / 12.0
        error = (quadrature + counting) * (end - start)
        return Jump(start, end, self.cycles, density.integ(lbnd=start), error)

    def _count(self, energy: float, cycles: int) -> float:
        """Count ``cycles``, no more than are left; the energy after them."""
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
                f"{self.cycles:.6g} of {self.total:.6g} cycles after {MOST_EVALUATIONS} energies "
                "of a cycle: they are not smooth to the tolerance; allow a larger one, or name "
                "the energies at which they have kinks"
            )
        rate = float(self.energy_per_cycle(energy))
        if not 0.0 <= rate < np.inf:
            raise AgeingError(
                f"a cycle dissipates {rate:g} N mm where {energy:g} were before; allowed: 0 or more"
            )
        return rate

    def _to_break(self, energy: float) -> float:
        return min((place - energy for place in self.breaks if place > energy), default=np.inf)


def _through(values: Array, domain: tuple[float, float]) -> Chebyshev:
    """The polynomial through ``values`` at the Chebyshev points of the ``domain``."""
    count = len(values)
    matrix = chebyshev.chebvander(chebyshev.chebpts1(count), count - 1)
    coefficients = matrix.T @ values * (2.0 / count)
    coefficients[0] *= 0.5
    return Chebyshev(coefficients, domain=domain)


# --- a joint at a prescribed stroke -------------------------------------------------------------


def steady_stroke(law: UniaxialLaw, evolution: JointEvolution, amplitude: float) -> EnergyPerCycle:
    """Energy per cycle of one joint to and fro by ``amplitude`` [mm], in closed form.

    Examples
    --------
    A Jenkins element whose friction stays dissipates 4 µN (A - µN/kt) in every cycle:

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
    """The same, marched: cycle after cycle with the memory of the ones before.

    One joint goes from +``amplitude`` [mm] to -``amplitude`` and back, with the parameters that
    belong to the energy at the cycle's begin: laws are exact along a straight path. It is brought
    to +``amplitude`` without counting what that takes, with the parameters of ``start`` [N mm].
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


# --- checking -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class IntegratedCycles:
    """Cycles of a long test integrated one after the other.

    ``energy`` ``(k + 1,)`` [N mm] is that of ``k`` cycles and ``jumped`` that of the test after the
    same cycles; ``difference`` is that of their last, in cycles, and ``stated`` the one that the
    test allows for.
    """

    energy: Array
    jumped: Array
    difference: float
    stated: float


def integrate_cycles(
    test: LongTest, energy_per_cycle: EnergyPerCycle, first: float, cycles: int
) -> IntegratedCycles:
    """Integrate ``cycles`` of a long test directly, from cycle ``first`` on, and compare.

    ``energy_per_cycle`` is called once for every cycle, in order: it may be that of the test or an
    independent one with a memory of its own. Raises InputError for cycles the test does not have.
    """
    if cycles < 1:
        raise InputError(f"{cycles} cycles; allowed: one or more")
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
    # A jump errs by this at either end of these cycles.
    stated = 2.0 * sum(jump.error for jump in touched)
    return IntegratedCycles(energy, jumped, difference, stated)
