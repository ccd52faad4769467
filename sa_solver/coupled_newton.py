"""Newton's method with truncated GMRES for pressure and shear of dissimilar bodies together.

Cells are off the contact, or stick, with all three components of traction free, or slip, where the
shear follows the pressure on the circle |q| = µp and only its direction is free. A phase of the
search keeps these sets and takes the directions to be straight tangents. The problem is then
linear: the half-space with its coupling, plus the curvature |Δs|/µp along the tangents. It is not
symmetric where shear follows pressure, so that GMRES lowers its residual, preconditioned by the
inverse 3 x 3 symbol of the half-space on the free components. Then the tractions are projected
back: cells that pull leave, cells that interpenetrate join, cells beyond their circle begin to
slip, cells whose slip would run along with the shear begin to stick, and the resultants are
restored.

No energy falls from phase to phase, because the friction limit follows the pressure: a search whose
residual no longer falls gives up and says so, and leaves the rest to :mod:`sa_solver.splitting`.

Sources: Alart & Curnier 1991, Comput. Methods Appl. Mech. Eng. 92, 353,
doi:10.1016/0045-7825(91)90022-X (the linearisation); Saad & Schultz 1986, SIAM J. Sci. Stat.
Comput. 7, 856, doi:10.1137/0907058 (GMRES); Vollebregt 2014, J. Comput. Phys. 257, 333,
doi:10.1016/j.jcp.2013.10.005 (preconditioner). Phases and projection are those of
:mod:`sa_solver.disk_newton`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sa_solver.coupled_problem import CoupledProblem, coupled_residuals
from sa_solver.half_space import ALL, HalfSpace, fast_lengths, inverse_symbols, spectral_filter
from sa_solver.influence import X, Z
from sa_solver.rigid_modes import RANK_CUTOFF
from sa_solver.tangential_problem import BoxOperator, TangentialProblem
from sa_solver.transform import SpectralFilter
from sa_solver.types import Array, Indices, Mask

SETTLED = 0.1
STEADY = 1e-3
"""A phase ends once its preconditioned residual has fallen by this factor, by the second where no
cell has changed since the last: there what is left falls with its square."""

ENOUGH = 0.3
"""Or once it is this far within the tolerance, as far as the phase can know."""

PHASE_STEPS = 16
"""Most directions of a phase, all of which are remembered."""

STALE = 0.01
"""Punches are computed again once this share of the cells has changed; until then those at hand,
cut to the free components, do as well."""

PATIENCE = 8
"""Phases without a lower residual after which the search gives up."""

ROUNDING = 1e-12
"""How far below its limit shear on the limit may be."""

TINY = 1e-200
"""Keeps divisions by a vanishing size finite."""


@dataclass(frozen=True)
class CoupledIterate:
    """Traction ``(3, nx, ny)`` [MPa] that obeys both bounds and has the resultants.

    ``slipping`` ``(nx, ny)`` marks cells on their circle, ``rigid`` ``(6,)`` [mm] are the free
    motions. ``left`` says that the search ended because the contact left its bounds.
    """

    traction: Array
    slipping: Mask
    rigid: Array
    residual: float
    iterations: int
    converged: bool
    left: bool


class CoupledOperator:
    """K on a box of cells, for all three components, and its approximate inverse."""

    def __init__(self, half_space: HalfSpace) -> None:
        """Plan for the box that ``half_space`` covers."""
        self.half_space = half_space
        self.shear = BoxOperator(half_space)
        self.compliances = np.array([[half_space.self_compliance(k)] for k in ALL])
        """A cell's own ``(3, 1)`` [mm/MPa]."""

    def precondition(self, displacement: Array) -> Array:
        """About K⁻¹ u ``(3, nx, ny)`` [MPa] of ``displacement`` u ``(3, nx, ny)`` [mm]."""
        return self._inverse.apply(displacement)

    @cached_property
    def _inverse(self) -> SpectralFilter:
        """The inverse symbol of the box made periodic, with next to no padding."""
        half_space, shape = self.half_space, self.half_space.grid.shape
        period = fast_lengths(*shape)
        symbols = [[half_space.symbol(i, j, period) for j in ALL] for i in ALL]
        transform = half_space.transform(shape, period, len(ALL))
        return spectral_filter(transform, inverse_symbols(symbols), ALL, ALL)


def newton_on_cones(
    problem: CoupledProblem,
    operator: CoupledOperator,
    traction: Array,
    slipping: Mask,
    tolerance: float,
    max_iterations: int,
    leaves: Callable[[Mask], bool],
) -> CoupledIterate:
    """Solve ``problem`` from a ``traction`` ``(3, nx, ny)`` with the right resultants.

    ``slipping`` ``(nx, ny)`` are the cells to begin on their circle. Stops when the largest of the
    residuals is within ``tolerance``, when ``leaves`` is true of the contact, when residuals no
    longer fall, or after ``max_iterations`` directions.
    """
    search = _Search(problem, operator, traction, slipping)
    best, waited = np.inf, 0
    while True:
        residual = search.residual()
        best, waited = (residual, 0) if residual < best else (best, waited + 1)
        left = leaves(search.contact)
        stopped = (
            residual <= tolerance
            or left
            or waited > PATIENCE
            or search.iterations >= max_iterations
            or not np.isfinite(residual)
        )
        if stopped or not search.phase(tolerance / residual):
            return CoupledIterate(
                search.traction,
                search.slipping,
                search.rigid,
                residual,
                search.iterations,
                residual <= tolerance,
                left,
            )


class _FreeParts:
    """The components of traction that are free, on the ``m`` cells of a contact.

    Where a cell slips along ``normal`` ``(2, m)``, 0 where it sticks, what is free is its pressure,
    which the shear follows, and the direction of its shear.
    """

    def __init__(
        self,
        operator: CoupledOperator,
        friction: float,
        normal: Array,
        slips: Mask,
        bend: Array,
        yielding: Array,
    ) -> None:
        """``bend`` ``(m,)`` is |Δs|/µp where a cell slips, ``yielding`` D ``(m,)`` [mm/MPa]."""
        self._follows = friction * normal
        x, y = normal
        across = np.where(slips, [y * y, -x * y, x * x], [[1.0], [0.0], [1.0]])
        own = operator.compliances
        own_x, own_z = float(own[X, 0]), float(own[Z, 0])
        taken, taken_z = own_x / (own_x + bend), own_z / (own_z + yielding)
        ones = np.ones_like(bend)
        self._free = (*across, ones)
        self._bend = (*(bend * across), yielding)
        # (K + D)⁻¹ is about χ K⁻¹ χ and a rest that hardly feels other cells: as in shear alone.
        self._window = (*(np.sqrt(taken) * across), np.sqrt(taken_z))
        rest, rest_z = (1.0 - taken) / (own_x + bend), (1.0 - taken_z) / (own_z + yielding)
        self._rest = (*(rest * across), rest_z)

    def cut(self, fields: Array) -> Array:
        """The free components of ``(3, m)``."""
        return _times(self._free, fields)

    def bent(self, parts: Array) -> Array:
        """Displacement ``(3, m)`` by curvature and local compliance."""
        return _times(self._bend, parts)

    def inverted(self, displacement: Array, precondition: Callable[[Array], Array]) -> Array:
        """Free components ``(3, m)`` that cause about this ``displacement`` ``(3, m)`` on them."""
        inner = precondition(_times(self._window, displacement))
        parts = _times(self._window, inner)
        parts += _times(self._rest, displacement)
        return parts

    def traction(self, parts: Array) -> Array:
        """Traction ``(3, m)`` of free components: with the shear that follows the pressure."""
        traction = parts.copy()
        traction[:Z] += self._follows * parts[Z]
        return traction


def _times(tensor: tuple[Array, ...], fields: Array) -> Array:
    """Product ``(3, m)`` with the tensor of components xx, xy, yy, zz ``(m,)``."""
    xx, xy, yy, zz = tensor
    x, y, z = fields
    return np.stack([xx * x + xy * y, xy * x + yy * y, zz * z])


class _Search:
    """State of the search: admissible tractions, their displacement, the sets and the motion."""

    def __init__(
        self, problem: CoupledProblem, operator: CoupledOperator, traction: Array, slipping: Mask
    ) -> None:
        self._problem, self._operator = problem, operator
        shapes = [problem.modes.motion(np.eye(6)[k]) for k in problem.free]
        self._shapes = np.reshape(shapes, (len(shapes), 3, traction[Z].size))
        self._punches = np.zeros_like(self._shapes)
        self._punched: Mask | None = None
        self.iterations = 0
        self.contact, self.slipping = traction[Z] > 0.0, slipping & (traction[Z] > 0.0)
        self._turned = int(np.count_nonzero(self.contact))
        self._take(traction)
        self._free_motions = self._supported()

    @property
    def rigid(self) -> Array:
        """Free motions last found ``(6,)``."""
        rigid = np.zeros(6)
        rigid[list(self._problem.free)] = self._free_motions
        return rigid

    def residual(self) -> float:
        """The largest of the traction last projected, at the motion last found."""
        problem = self._problem
        relative = self._relative()
        return coupled_residuals(problem, self.traction, self._displacement, relative).largest

    def phase(self, goal: float) -> bool:
        """Directions on the present sets, then a projection; False where none can be balanced.

        ``goal`` is the tolerance over the residual.
        """
        self._linearise()
        share = max(STEADY if self._turned == 0 else SETTLED, ENOUGH * goal)
        step, image = self._solve(share)
        return self._project(step, image)

    # -- the linear problem of a phase ----------------------------------------------------------
    def _take(self, traction: Array) -> None:
        self.traction = traction
        self._displacement = self._problem.half_space.displacement(traction)
        moved = self._problem.relative(traction, self._displacement, np.zeros(6))
        self._moved = moved.reshape(3, -1)

    def _relative(self) -> Array:
        """``v`` ``(3, nx, ny)`` at the motion last found."""
        relative = self._moved - np.tensordot(self._free_motions, self._shapes, 1)
        return np.asarray(relative.reshape(self.traction.shape))

    def _supported(self) -> Array:
        """Free motions that leave no work to the pressure, for want of better ones."""
        weight = self.traction[Z].ravel()
        weighted = self._shapes * weight
        products = np.tensordot(weighted, self._shapes, ([1, 2], [1, 2]))
        work = np.tensordot(weighted, self._moved, ([1, 2], [0, 1]))
        return np.asarray(np.linalg.pinv(products, RANK_CUTOFF, hermitian=True) @ work)

    def _linearise(self) -> None:
        """Free components, curvature and punches at the present traction."""
        problem, cells = self._problem, np.flatnonzero(self.contact)
        self._cells = cells
        slips = self.slipping.ravel()[cells]
        pressure = self.traction[Z].ravel()[cells]
        shear = self.traction[:Z].reshape(2, -1)[:, cells]
        slip = self._relative()[:Z].reshape(2, -1)[:, cells]
        # Where nothing presses yet, shear will oppose the slip.
        along = np.where(pressure > 0.0, shear, -slip)
        normal = np.where(slips, along / np.maximum(np.hypot(*along), TINY), 0.0)
        limit = np.maximum(problem.friction * pressure, TINY)
        bend = np.where(slips, np.maximum(-np.sum(slip * normal, axis=0), 0.0) / limit, 0.0)
        yielding = np.broadcast_to(problem.compliance, self.contact.shape).ravel()[cells]
        self._slip_normal = normal
        self._parts = _FreeParts(self._operator, problem.friction, normal, slips, bend, yielding)
        self._on_cells = self._shapes[:, :, cells]
        self._set_punches(cells)

    def _set_punches(self, cells: Indices) -> None:
        """Free components that carry the resultants, close to those of rigid punches."""
        sets = np.stack([self.contact, self.slipping])
        before, count = self._punched, len(cells)
        turned = count if before is None else int(np.count_nonzero((sets ^ before).any(axis=0)))
        renewed = turned > STALE * count
        punches = self._on_cells if renewed else self._punches[:, :, cells]
        apply = self._inverted if renewed else self._parts.cut
        self._punch = np.array([apply(punch) for punch in punches]).reshape(punches.shape)
        if renewed:
            self._punched = sets
            self._punches = np.zeros_like(self._shapes)
            self._punches[:, :, cells] = self._punch
        on_cells = self._parts.cut
        shapes = np.array([on_cells(shape) for shape in self._on_cells]).reshape(punches.shape)
        answers = [self._parts.traction(punch) for punch in self._punch]
        resultants = np.array([self._sums(answer) for answer in answers])
        size = len(punches)
        self._gain = np.linalg.pinv(resultants.reshape(size, size).T, RANK_CUTOFF)
        work = np.tensordot(self._punch, shapes, ([1, 2], [1, 2]))
        self._motion = np.linalg.pinv(work, RANK_CUTOFF)

    def _sums(self, traction: Array) -> Array:
        """Resultants ``(k,)`` [MPa] of traction ``(3, m)`` on the cells."""
        return np.asarray(np.tensordot(self._on_cells, traction, ([1, 2], [0, 1])))

    def _inverted(self, displacement: Array) -> Array:
        return self._parts.inverted(displacement, self._preconditioned)

    def _preconditioned(self, displacement: Array) -> Array:
        """About K⁻¹ u on the cells, of u there and 0 elsewhere, both ``(3, m)``."""
        field = self._operator.precondition(self._field(displacement))
        return field.reshape(3, -1)[:, self._cells]

    def _field(self, values: Array) -> Array:
        """``(3, nx, ny)`` of values on the cells, 0 off them."""
        field = np.zeros(self.traction.shape)
        field.reshape(3, -1)[:, self._cells] = values
        return field

    def _descent(self, displacement: Array) -> tuple[Array, Array]:
        """What ``displacement`` ``(3, m)`` asks of the free components, without resultants.

        And the free motions taken off it first: those that do no work on punches.
        """
        motions = self._motion @ np.tensordot(self._punch, displacement, ([1, 2], [0, 1]))
        left = displacement - np.tensordot(motions, self._on_cells, 1)
        parts = self._inverted(left)
        carried = self._gain @ self._sums(self._parts.traction(parts))
        parts -= np.tensordot(carried, self._punch, 1)
        return parts, motions

    def _solve(self, share: float) -> tuple[Array, Array]:
        """GMRES until the residual has fallen to ``share`` of itself.

        The change of traction ``(3, m)`` and of ``v`` but for the motion ``(3, nx ny)``.
        """
        begin, motions = self._descent(self._moved[:, self._cells])
        size = float(np.linalg.norm(begin))
        basis, images, moved = [-begin / max(size, TINY)], [], [motions]
        hessenberg = np.zeros((PHASE_STEPS + 1, PHASE_STEPS))
        weights = np.zeros(0)
        for k in range(PHASE_STEPS):
            self.iterations += 1
            traction = self._field(self._parts.traction(basis[k]))
            image = self._problem.half_space.displacement(traction).reshape(3, -1)
            answer, motions = self._descent(image[:, self._cells] + self._parts.bent(basis[k]))
            images.append(image)
            moved.append(motions)
            for i, vector in enumerate(basis):
                hessenberg[i, k] = np.vdot(vector, answer)
                answer -= hessenberg[i, k] * vector
            hessenberg[k + 1, k] = np.linalg.norm(answer)
            wanted = size * np.eye(k + 2)[0]
            matrix = hessenberg[: k + 2, : k + 1]
            weights = np.linalg.lstsq(matrix, wanted)[0]
            left = float(np.linalg.norm(wanted - matrix @ weights))
            if left <= share * size or hessenberg[k + 1, k] <= TINY:
                break
            basis.append(answer / hessenberg[k + 1, k])
        step = np.tensordot(weights, np.array(basis[: len(weights)]), 1)
        self._free_motions = moved[0] + np.tensordot(weights, np.array(moved[1:]), 1)
        return self._parts.traction(step), np.tensordot(weights, np.array(images), 1)

    # -- back to the cones ----------------------------------------------------------------------
    def _project(self, step: Array, image: Array) -> bool:
        """Back to admissible and balanced tractions on new sets; False where there are none."""
        problem, cells = self._problem, self._cells
        reached = self.traction.reshape(3, -1)[:, cells] + step
        relative = (self._moved + image).reshape(self.traction.shape)
        relative -= np.tensordot(self._free_motions, self._shapes, 1).reshape(relative.shape)
        slip = relative[:Z].reshape(2, -1)[:, cells]
        pressed = reached[Z] > 0.0
        slipped = self.slipping.ravel()[cells]
        opposed = np.sum(slip * self._slip_normal, axis=0) < 0.0
        beyond = np.hypot(*reached[:Z]) > problem.friction * np.maximum(reached[Z], 0.0)
        slips = (np.where(slipped, opposed, beyond) | (problem.friction == 0.0)) & pressed
        trial = self._field(reached * pressed)
        traction = balanced(problem, self._operator, trial, self._mask(slips))
        if traction is None:
            return False
        contact = self._mask(pressed) | ((relative[Z] < 0.0) & ~self.contact)
        joining = contact & ~self.contact
        # Cells released are still on their circle; others the balance may have brought there.
        pushed = np.hypot(*traction[:Z]) >= problem.friction * traction[Z] * (1.0 - ROUNDING)
        stuck = self._mask(pressed & ~slipped)
        slipping = self._mask(slips) | joining | (stuck & pushed)
        changed = (contact ^ self.contact) | (contact & (slipping ^ self.slipping))
        self._turned = int(np.count_nonzero(changed))
        self.contact, self.slipping = contact, slipping
        self._take(traction)
        return True

    def _mask(self, values: Mask) -> Mask:
        """``(nx, ny)`` of what is true on the cells."""
        mask = np.zeros(self.contact.shape, dtype=bool)
        mask.ravel()[self._cells] = values
        return mask


def balanced(
    problem: CoupledProblem, operator: CoupledOperator, traction: Array, slipping: Mask
) -> Array | None:
    """Admissible ``traction`` ``(3, nx, ny)`` near one of p >= 0, with the resultants; or None.

    Pressure first, then shear within its µp, on the circle where ``slipping`` ``(nx, ny)``.
    """
    pressure = problem.normal.balance(traction[Z], problem.normal_target)
    if pressure is None:
        return None
    limit = problem.friction * pressure
    if not limit.any():
        shear: Array | None = np.zeros_like(traction[:Z])
    else:
        within = TangentialProblem(
            limit, problem.offset[:Z], problem.planar, problem.planar_target, operator.shear
        )
        shear = within.balanced(traction[:Z] * within.pressed, slipping & within.pressed)
    return None if shear is None else np.stack([*shear, pressure])
