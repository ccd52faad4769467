"""Incremental Coulomb friction between two condensed bodies: stick, slip, separation per node.

At each increment find the relative displacements w and the contact forces f = H w + f0 on body 2
that obey, node by node, unilateral contact with the gap g + w_z and Coulomb's law for the slip
since the previous increment. Solved by splitting: its only parameter ρ comes from the extreme
eigenvalues of H, and there is no penalty.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from fe_models.joints.joint import JointResolvent
from fe_models.meshes.structure_mesh import AXES, in_space
from fe_models.solvers.blas_threads import one_thread
from sa_solver import checks
from sa_solver.contact_law import coulomb
from sa_solver.errors import InputError
from sa_solver.splitting import SplittingResult, douglas_rachford
from sa_solver.types import Array

# Out-of-balance forces left, relative to the forces of the load at hand.
TOLERANCE = 1e-7
# An unloaded increment is measured against this share of the largest load of the path.
LOAD_FLOOR = 1e-3
# An increment needs 5 to 100 iterations; one that takes more than this walks in circles.
MAX_ITERATIONS = 1000
# A first increment, which may be a leap, that takes more than this gets on better from the heaviest
# load: rounding decides whether some thousand iterations are enough for worn faces to meet.
LEAP = 200
# On the way to a light load what is left of the heaviest falls by this factor from one solution to
# the next, which takes 50 iterations each.
LIGHTENED = 0.1


@dataclass(frozen=True)
class FrictionState:
    """State at the end of one increment, components in the interface frames.

    ``force`` ``(3, n)`` on body 2 [N]; ``displacement`` ``(3, n)`` of body 2 relative to body 1 and
    ``slip`` ``(2, n)`` its tangential part since the previous increment [mm]; ``state``
    ``(d n,)`` is the splitting's, to start from again. In plane strain forces are per length and
    have no y component.
    """

    force: Array
    displacement: Array
    slip: Array
    state: Array
    residual: float
    iterations: int
    converged: bool


class FrictionalJoint:
    """A joint with friction coefficient µ, one or by node ``(n,)``, for any gaps and loads.

    Examples
    --------
    One node on springs of 100 N/mm is pressed by 10 N, and then pulled off by as much:

    >>> import numpy as np
    >>> from fe_models import FrictionalJoint, JointStiffness
    >>> springs = JointStiffness(100.0 * np.eye(3), np.eye(3)[:, 2:], 0, 100.0, 100.0)
    >>> joint = FrictionalJoint(springs.resolvent(), friction=0.4)
    >>> for state in joint.march(np.array([[10.0], [-10.0]]), gap=np.zeros(1)):
    ...     print(f"{state.force[2, 0]:.3f} N, {state.displacement[2, 0]:.3f} mm apart")
    10.000 N, 0.000 mm apart
    0.000 N, 0.100 mm apart
    """

    def __init__(self, joint: JointResolvent, friction: float | Array) -> None:
        """Take the joint and its friction. Raises InputError for a µ below 0 or not finite."""
        if np.ndim(friction) == 0:
            friction = checks.number("friction", friction, least=0.0)
        else:
            friction = checks.array("friction coefficients", friction, (None,))
            checks.number("the smallest friction coefficient", friction.min(), least=0.0)
        self._joint, self._friction = joint, friction

    def march(
        self,
        amplitudes: Array,
        gap: Array,
        previous: Array | None = None,
        guess: Sequence[Array] = (),
    ) -> Iterator[FrictionState]:
        """States along a load path ``(increments, cases)``.

        ``gap`` ``(n,)`` is the distance of the unloaded faces [mm]; ``previous`` the displacement
        ``(3, n)`` that the path starts from, unslipped unless it is given. ``guess`` are the
        ``state`` of every increment of a similar path: they save iterations and change nothing
        else. Raises InputError for loads and gaps of another number, or not finite.
        """
        size, cases = self._joint.loads.shape
        amplitudes = checks.array("amplitudes", amplitudes, (None, cases))
        gap = checks.array("gaps", gap, (None,))
        if size not in (2 * len(gap), 3 * len(gap)):
            raise InputError(
                f"{len(gap)} gaps: give one at each node of a joint of {size} displacements"
            )
        loads = np.tensordot(amplitudes, self._with_images(self._joint.loads.T), 1)
        guesses = self._with_images(np.array(guess).reshape(-1, loads.shape[-1]))
        sizes = np.linalg.norm(loads[:, 0], axis=1)
        floor, heaviest = LOAD_FLOOR * sizes.max(), loads[np.argmax(sizes)]
        displacement = np.zeros((3, len(gap))) if previous is None else previous
        states: list[Array] = []
        for number, load in enumerate(loads):
            increment = _Increment(load, gap, displacement, floor)
            if states:
                starts = _starts(states, guesses, loads[: number + 1, 0])
                state, ended = self._solve(increment, starts)
            else:
                starts = [*guesses[:1], *guesses[-1:], *self._with_images(_at_rest(gap, load))]
                state, ended = self._first(increment, heaviest, starts)
            states.append(ended)
            displacement = state.displacement
            yield state

    def _with_images(self, vectors: Array) -> Array:
        """``vectors`` ``(m, d n)``, and what the resolvent makes of each: ``(m, 2, d n)``.

        Of sums of them it makes the sums: no product is needed to look at a start.
        """
        with one_thread(self._joint.widest):
            return np.stack([vectors, self._joint.product(vectors.T).T], axis=1)

    def _first(
        self, increment: _Increment, heaviest: Array, starts: list[Array]
    ) -> tuple[FrictionState, Array]:
        """The first increment: in a short leap, from the heaviest load, or in a long leap."""
        solved = self._solve(increment, starts, LEAP)
        if not solved[0].converged:
            solved = self._lightened(increment, heaviest, starts)
        if not solved[0].converged:
            solved = self._solve(increment, starts)
        return solved

    def _lightened(
        self, increment: _Increment, heaviest: Array, starts: list[Array]
    ) -> tuple[FrictionState, Array]:
        """An increment from where the heaviest load takes the bodies, by ever lighter ones.

        A light load would take a body long to where worn faces meet: pressed hard it is there at
        once, and what a tenth of the load does is always near.
        """
        load = increment.load
        more = heaviest - load
        _, ended = self._solve(increment._replace(load=heaviest), starts)
        while np.linalg.norm(more[0]) > np.linalg.norm(load[0]) > 0.0:
            more = LIGHTENED * more
            _, ended = self._solve(increment._replace(load=load + more), [ended])
        return self._solve(increment, [ended])

    def _solve(
        self, increment: _Increment, starts: list[Array], most: int | None = None
    ) -> tuple[FrictionState, Array]:
        """One increment, and the splitting's state with its image; ``starts`` have theirs.

        It takes as many iterations as all starts may, unless told how many at ``most``.
        """
        with one_thread(self._joint.widest):
            problem = _Problem(self._joint, self._friction, increment)
            most = most or 2 * len(starts) * MAX_ITERATIONS
            return problem.solve(starts, most)


class _Increment(NamedTuple):
    """One increment: its ``load`` with the image ``(2, d n)``, and whence it leads.

    ``gap`` ``(n,)`` and ``previous`` ``(3, n)`` as of :meth:`FrictionalJoint.march`. Residuals are
    relative to the load, which counts as ``floor`` at least [N].
    """

    load: Array
    gap: Array
    previous: Array
    floor: float

    @property
    def scale(self) -> float:
        """The force that residuals are relative to [N]."""
        return max(float(np.linalg.norm(self.load[0])), self.floor)


class _Problem:
    """One increment: the two steps of the splitting under one load.

    Products are of single precision with how far the splitting has moved since the last one of
    double precision: in half the time, and exact where it ends.
    """

    def __init__(
        self, joint: JointResolvent, friction: float | Array, increment: _Increment
    ) -> None:
        self._joint, self._rho, self._friction = joint, joint.rho, friction
        self._gap, self._previous = increment.gap, increment.previous
        forces, self._offset = increment.load
        self._axes = AXES[len(forces) // len(self._gap)]
        self._scale = increment.scale / self._rho
        self._exact = np.zeros_like(increment.load)

    def solve(self, starts: list[Array], most: int) -> tuple[FrictionState, Array]:
        """Split from the most promising start, and from the others should it fail.

        First so that no extrapolation throws a body off, then so that one may fly to its contacts,
        in ``most`` iterations together. The state is given with its image.
        """
        iterations = 0
        promising = sorted(starts, key=self._distance)
        for returning, start in product((True, False), promising):
            self._exact = start
            split = douglas_rachford(
                self._elastic,
                self._law,
                start[0],
                scale=self._scale,
                tolerance=TOLERANCE,
                max_iterations=min(MAX_ITERATIONS, most - iterations),
                returning=returning,
                refresh=self._refresh,
            )
            iterations += split.iterations
            if split.converged or iterations >= most:
                break
        if not split.converged:
            self._refresh(split.state)
        return self._state(split, iterations), self._exact

    def _elastic(self, state: Array) -> Array:
        known, image = self._exact
        moved = state - known
        if moved.any():
            image = image + self._joint.rounded_product(moved)
        return self._rho * image - self._offset

    def _refresh(self, state: Array) -> None:
        self._exact = np.stack([state, self._joint.product(state)])

    def _law(self, trial: Array) -> Array:
        nodal = self._nodal(trial)
        admissible = nodal + coulomb(self._sticking_force(nodal), self._friction) / self._rho
        return admissible[self._axes, :].T.ravel()

    def _nodal(self, values: Array) -> Array:
        """Components x, y, z at each node ``(3, n)``."""
        return in_space(values.reshape(len(self._gap), -1)).T

    def _sticking_force(self, trial: Array) -> Array:
        """Force ``(3, n)`` that would close the gap and undo the slip, whatever its size.

        Within the law it brings a trial displacement ``(3, n)`` back to it, at stiffness ρ.
        """
        stick = self._rho * (self._previous - trial)
        stick[2] = -self._rho * (self._gap + trial[2])
        return stick

    def _distance(self, start: Array) -> float:
        """How far a start is from a solution: the splitting's first step."""
        state, image = start
        elastic = self._rho * image - self._offset
        return float(np.linalg.norm(self._law(2.0 * elastic - state) - elastic))

    def _state(self, split: SplittingResult, iterations: int) -> FrictionState:
        stick = self._sticking_force(self._nodal(2.0 * split.elastic - split.state))
        force = coulomb(stick, self._friction)
        return FrictionState(
            force=force,
            displacement=self._nodal(split.solution),
            # The difference of displacements, but 0 where a node sticks and never along the force.
            slip=(force - stick)[:2] / self._rho,
            state=split.state,
            residual=split.residual,
            iterations=iterations,
            converged=split.converged,
        )


def _starts(states: list[Array], guesses: Array, loads: Array) -> list[Array]:
    """Where the next increment, whose load is the last of ``loads`` ``(t, d n)``, may start from.

    The previous state; the change that the guess makes there; and the change in proportion to the
    load, as long as that goes on in the same sense. States have their images.
    """
    increment = len(states)
    starts = [states[-1]]
    if increment < len(guesses):
        starts.append(guesses[increment] + states[-1] - guesses[increment - 1])
    if increment > 1:
        step, before = np.diff(loads[-3:], axis=0)[::-1]
        if step @ before > 0.0:
            ratio = (step @ before) / (before @ before)
            starts.append(states[-1] + ratio * (states[-1] - states[-2]))
    return starts


def _at_rest(gap: Array, load: Array) -> Array:
    """Where the first increment may start from ``(1, d n)``: rest or, where no node touches, all.

    A body that floats would be long on its way there.
    """
    rest = np.zeros((len(gap), load.shape[-1] // len(gap)))
    if gap.min() > 0.0:
        rest[:, -1] = -gap
    return rest.reshape(1, -1)
