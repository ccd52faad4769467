"""Incremental Coulomb friction between two condensed bodies: stick, slip, separation per node.

Each increment determines the relative displacements w and the contact forces f = H w + f0 on body 2
that obey, node by node, unilateral contact with the gap g + w_z and Coulomb's law for the slip
since the previous increment. The problem is solved by operator splitting without a penalty; the
only parameter ρ of the splitting comes from the extreme eigenvalues of H.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from fe_models.joints.joint import Resolvent
from fe_models.meshes.structure_mesh import AXES, in_space
from fe_models.solvers.blas_threads import one_thread
from sa_solver import checks
from sa_solver.contact_law import coulomb
from sa_solver.errors import InputError
from sa_solver.splitting import SplittingResult, douglas_rachford
from sa_solver.types import Array

# Out-of-balance forces that are tolerated, relative to the forces of the increment's load.
TOLERANCE = 1e-7
# An unloaded increment is measured against this share of the largest load of the path.
LOAD_FLOOR = 1e-3
# An increment needs 5 to 100 iterations; one that takes more than this does not converge.
MAX_ITERATIONS = 1000
# Iterations allowed for a first increment, which may be far from the start. If it needs more, it is
# started from the solution under the heaviest load instead: otherwise rounding decides whether some
# thousand iterations are enough for worn faces to meet.
FIRST_ITERATIONS = 200
# Factor by which the excess over a light first load is reduced from one auxiliary solution to the
# next. Each of them takes about 50 iterations.
UNLOADING_FACTOR = 0.1


@dataclass(frozen=True)
class FrictionState:
    """State at the end of one increment, with components in the interface frames.

    In plane strain forces are per length and have no y component.

    Attributes
    ----------
    force
        Force on body 2 ``(3, n)`` [N].
    displacement
        Displacement of body 2 relative to body 1 ``(3, n)`` [mm].
    slip
        Change of its tangential part since the previous increment ``(2, n)`` [mm].
    state
        State of the splitting ``(d n,)``, from which it can start again.
    residual, iterations, converged
        Final residual of the splitting, its iterations, and whether it converged.
    """

    force: Array
    displacement: Array
    slip: Array
    state: Array
    residual: float
    iterations: int
    converged: bool


class FrictionalJoint:
    """Joint with a friction coefficient µ, one or by node ``(n,)``, for any gaps and loads.

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

    def __init__(self, joint: Resolvent, friction: float | Array) -> None:
        """Store the joint and its friction. Raises InputError for a µ below 0 or not finite."""
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
        """Yield the state of each increment along a load path.

        Parameters
        ----------
        amplitudes
            Amplitudes of the load cases ``(increments, cases)``.
        gap
            Distance of the unloaded faces ``(n,)`` [mm].
        previous
            Displacement ``(3, n)`` [mm] from which the path starts; by default an undeformed joint
            without slip.
        guess
            The ``state`` of every increment of a similar path. They save iterations and do not
            change the solution otherwise.

        Raises
        ------
        InputError
            If the number of loads or gaps is wrong, or a value is not finite.
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
        """Return ``vectors`` ``(m, d n)`` with the resolvent's product of each: ``(m, 2, d n)``.

        The image of a sum is the sum of the images, so no product is needed to assess a start.
        """
        with one_thread(self._joint.widest):
            return np.stack([vectors, self._joint.product(vectors.T).T], axis=1)

    def _first(
        self, increment: _Increment, heaviest: Array, starts: list[Array]
    ) -> tuple[FrictionState, Array]:
        """Solve the first increment.

        It is solved in few iterations, or else from the solution under the heaviest load, or else
        in many iterations.
        """
        solved = self._solve(increment, starts, FIRST_ITERATIONS)
        if not solved[0].converged:
            solved = self._unloaded_from(increment, heaviest, starts)
        if not solved[0].converged:
            solved = self._solve(increment, starts)
        return solved

    def _unloaded_from(
        self, increment: _Increment, heaviest: Array, starts: list[Array]
    ) -> tuple[FrictionState, Array]:
        """Solve an increment from the solution under the heaviest load, by ever lighter loads.

        From rest a light load would need many iterations to move a body until worn faces meet. A
        heavy load closes them at once, and each tenth of the excess leads to a nearby solution.
        """
        load = increment.load
        excess = heaviest - load
        _, ended = self._solve(increment._replace(load=heaviest), starts)
        while np.linalg.norm(excess[0]) > np.linalg.norm(load[0]) > 0.0:
            excess = UNLOADING_FACTOR * excess
            _, ended = self._solve(increment._replace(load=load + excess), [ended])
        return self._solve(increment, [ended])

    def _solve(
        self, increment: _Increment, starts: list[Array], most: int | None = None
    ) -> tuple[FrictionState, Array]:
        """Solve one increment; return its state, and the state of the splitting with its image.

        ``starts`` have their images. The number of iterations is at most ``most``, or by default as
        many as all starts together may take.
        """
        with one_thread(self._joint.widest):
            problem = _Problem(self._joint, self._friction, increment)
            most = most or 2 * len(starts) * MAX_ITERATIONS
            return problem.solve(starts, most)


class _Increment(NamedTuple):
    """One increment: its ``load`` with its image ``(2, d n)``, and the state that it starts from.

    ``gap`` ``(n,)`` and ``previous`` ``(3, n)`` are as in :meth:`FrictionalJoint.march`. Residuals
    are relative to the load, which counts as at least ``floor`` [N].
    """

    load: Array
    gap: Array
    previous: Array
    floor: float

    @property
    def scale(self) -> float:
        """Force that residuals are relative to [N]."""
        return max(float(np.linalg.norm(self.load[0])), self.floor)


class _Problem:
    """Splitting problem of one increment: its two steps under one load.

    Products are computed in single precision for the change of the splitting's state since the last
    product in double precision. This takes half the time, and the final result is exact.
    """

    def __init__(self, joint: Resolvent, friction: float | Array, increment: _Increment) -> None:
        self._joint, self._rho, self._friction = joint, joint.rho, friction
        self._gap, self._previous = increment.gap, increment.previous
        forces, self._offset = increment.load
        self._axes = AXES[len(forces) // len(self._gap)]
        self._scale = increment.scale / self._rho
        self._exact = np.zeros_like(increment.load)

    def solve(self, starts: list[Array], most: int) -> tuple[FrictionState, Array]:
        """Run the splitting from the most promising start, and from the others if it fails.

        The first attempts do not extrapolate, so that no body is thrown off; the later ones do, so
        that a body can quickly reach its contacts. All attempts together take at most ``most``
        iterations. The state is returned with its image.
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
        """Return components x, y, z at each node ``(3, n)``."""
        return in_space(values.reshape(len(self._gap), -1)).T

    def _sticking_force(self, trial: Array) -> Array:
        """Return the unlimited force ``(3, n)`` that would close the gap and undo the slip.

        The contact law limits this force, and it brings a trial displacement ``(3, n)`` back at
        stiffness ρ.
        """
        stick = self._rho * (self._previous - trial)
        stick[2] = -self._rho * (self._gap + trial[2])
        return stick

    def _distance(self, start: Array) -> float:
        """Return the distance of a start from a solution: the length of a splitting step."""
        state, image = start
        elastic = self._rho * image - self._offset
        return float(np.linalg.norm(self._law(2.0 * elastic - state) - elastic))

    def _state(self, split: SplittingResult, iterations: int) -> FrictionState:
        stick = self._sticking_force(self._nodal(2.0 * split.elastic - split.state))
        force = coulomb(stick, self._friction)
        return FrictionState(
            force=force,
            displacement=self._nodal(split.solution),
            # This is the change of displacement, but exactly 0 where a node sticks and never in
            # the direction of the force.
            slip=(force - stick)[:2] / self._rho,
            state=split.state,
            residual=split.residual,
            iterations=iterations,
            converged=split.converged,
        )


def _starts(states: list[Array], guesses: Array, loads: Array) -> list[Array]:
    """Return states from which the next increment, under the last of ``loads``, may start.

    They are the previous state; that state plus the change of the guess; and, while the load
    continues in the same direction, that state plus the last change in proportion to the load. The
    loads are ``(t, d n)``. States have their images.
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
    """Return the state ``(1, d n)`` from which the first increment starts.

    It is rest or, where no node touches, the state with all gaps closed: a floating body would take
    many iterations to reach its contact.
    """
    rest = np.zeros((len(gap), load.shape[-1] // len(gap)))
    if gap.min() > 0.0:
        rest[:, -1] = -gap
    return rest.reshape(1, -1)
