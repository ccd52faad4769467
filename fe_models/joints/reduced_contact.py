"""Quasi-static friction of two reduced specimens that are pressed together and fret.

The ring of body 1 is held. That of body 2 moves as a rigid translation: along x as prescribed, not
along y, and along z so that the normal force is F. With A the sum of both compliances of the pad's
nodes, rings held, D body 2's translation and f the forces on it, the relative displacement is

    w = D + A f.

The normal and the tangential problem are solved one after the other, uncoupled: A_zz f_z without
shear, then A_xx f_x at these f_z. A_zz⁻¹ is the K_z = K_zz - K_zx K_xx⁻¹ K_xz of the source,
without its misprints. The loop follows from first loading by Masing's rule.

:meth:`ReducedPair.coupled_cycle` makes none of these assumptions. For flat and curved, new and worn
pads under 17 to 250 N the two methods differ by up to 0.4 % of the largest tangential force, 4e-4
of the energy of a cycle of gross slip, 0.2 % of the largest nodal energy, and 4.5 % of the largest
nodal normal force.

Source: the quasi-static method of "Dynamics simulations of fretting wear for aero-engine
applications" (thesis), section 4.1, eqs. 18 to 30, whose distant nodes are the rings.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.linalg as sl

from fe_models.joints.friction import FrictionalJoint, FrictionState
from fe_models.joints.joint import JointStiffness
from fe_models.meshes.structure_mesh import Face
from fe_models.solvers.complementarity import ROUNDING, Flags, complementary
from sa_solver import checks
from sa_solver.reference.masing import superpose
from sa_solver.types import Array

X, Y, Z = range(3)


@dataclass(frozen=True)
class NormalSolution:
    """Solution of frictionless contact under a given force.

    Attributes
    ----------
    force
        Force on each node of body 2 ``(n,)`` [N].
    pressure
        Nodal pressure ``(n,)`` [MPa].
    gap
        Gap under load ``(n,)`` [mm].
    approach
        Approach of the rings [mm], 0 where faces without gap would just touch.
    area
        Area in contact [mm²].
    converged
        Whether the solver converged.
    """

    force: Array
    pressure: Array
    gap: Array
    approach: float
    area: float
    converged: bool

    @property
    def touching(self) -> Flags:
        """Flags of the nodes that carry force, ``(n,)``."""
        return self.force > 0.0


@dataclass(frozen=True)
class TangentialSolution:
    """Solution of first loading, with body 2's ring moved by ``displacement`` along x [mm].

    Attributes
    ----------
    displacement
        Displacement of the ring [mm].
    force
        Force that moves the ring [N].
    shear
        Force along x on each node of body 2 ``(n,)`` [N], against the motion.
    slip
        Slip of body 2 over body 1 ``(n,)`` [mm], never against the motion.
    converged
        Whether the solver converged and no node slides backwards.
    """

    displacement: float
    force: float
    shear: Array
    slip: Array
    converged: bool


@dataclass(frozen=True)
class VirginCurve:
    """Curve of first loading: ``force`` [N] over ``displacement`` [mm] of the ring, both ``(k,)``.

    ``states`` are the solutions at its points. ``stick_stiffness`` is its slope at the origin,
    where all nodes in contact stick [N/mm]; ``friction`` is its last force over the normal force.
    """

    displacement: Array
    force: Array
    states: tuple[TangentialSolution, ...]
    stick_stiffness: float
    friction: float

    @property
    def converged(self) -> bool:
        return all(state.converged for state in self.states)

    def secant_stiffness(self, share: float) -> float:
        """Return the secant slope at the force that is ``share`` of the last one [N/mm]."""
        force = share * self.force[-1]
        return float(force / np.interp(force, self.force, self.displacement))


@dataclass(frozen=True)
class Loop:
    """Closed loop of ``force`` [N] over ``displacement`` [mm], both ``(k,)``.

    The first point is repeated at the end.
    """

    displacement: Array
    force: Array

    @property
    def energy(self) -> float:
        """Energy dissipated in one cycle, the loop's area [N mm]."""
        return abs(float(np.trapezoid(self.force, self.displacement)))


@dataclass(frozen=True)
class FrettingConditions:
    """Load on the pair in every cycle.

    ``force`` is the normal force [N], ``stroke`` the motion of body 2's ring along x, peak to peak
    [mm], and ``friction`` is µ.

    Examples
    --------
    Under 17 N with a stroke of 20 µm and µ = 0.8, a cycle of rigid bodies dissipates 2 µ F times
    the stroke.

    >>> from fe_models import FrettingConditions
    >>> conditions = FrettingConditions(force=17.0, stroke=0.02, friction=0.8)
    >>> print(f"{2.0 * conditions.friction * conditions.force * conditions.stroke:.3f} N mm")
    0.544 N mm
    """

    force: float
    stroke: float
    friction: float

    def __post_init__(self) -> None:
        checks.numbers(self, "force", above=0.0)
        checks.numbers(self, "stroke", "friction", least=0.0)


@dataclass(frozen=True)
class FrettingCycle:
    """One fretting cycle on a given shape.

    Attributes
    ----------
    normal
        Solution of the normal contact.
    tangential
        Solution of first loading to half the stroke.
    stick_stiffness
        Tangential stiffness while all nodes in contact stick [N/mm].
    friction
        Largest tangential force over the normal force.
    cycle_slip
        Distance that each node slides in a cycle ``(n,)`` [mm].
    energy
        Energy dissipated in a cycle [N mm].
    """

    normal: NormalSolution
    tangential: TangentialSolution
    stick_stiffness: float
    friction: float
    cycle_slip: Array
    energy: float

    @property
    def converged(self) -> bool:
        return self.normal.converged and self.tangential.converged


@dataclass(frozen=True)
class CoupledCycle:
    """Closed cycle, marched with pressure and both shears coupled.

    ``loading`` are the states on the way to it, from rest; ``states`` those at each point of the
    ``loop``; ``energy`` ``(n,)`` is the energy that each node dissipates in the cycle [N mm].
    """

    loop: Loop
    loading: tuple[FrictionState, ...]
    states: tuple[FrictionState, ...]
    energy: Array

    @property
    def converged(self) -> bool:
        return all(state.converged for state in self.loading + self.states)


@dataclass(frozen=True)
class ReducedPair:
    """Two specimens on the nodes of their pads.

    ``compliance`` ``(n, 3, n, 3)`` [mm/N] is A, in the axes of ``face``.

    Examples
    --------
    Three nodes are on springs, 500 N/mm each for both bodies together. They are pressed by 30 N and
    fret by ±0.05 mm with µ = 0.5, and so dissipate 4 µF (A - µF/k).

    >>> import numpy as np
    >>> from fe_models import FrettingConditions, ReducedPair
    >>> from fe_models.meshes.structure_mesh import Face
    >>> from sa_solver import Frame
    >>> frame, corners = Frame(np.zeros(3), np.eye(3)), np.array([[0, 0], [1.0, 0], [0, 1.0]])
    >>> face = Face("pad", frame, corners, np.array([[0, 1, 2]]))
    >>> pair = ReducedPair.from_stiffness(face, 1e3 * np.eye(9), 1e3 * np.eye(9))
    >>> cycle = pair.fretting_cycle(np.zeros(3), FrettingConditions(30.0, 0.1, 0.5))
    >>> print(f"{cycle.energy:.3f} N mm of {4.0 * 15.0 * (0.05 - 15.0 / 1500.0):.3f}")
    2.400 N mm of 2.400
    """

    face: Face
    compliance: Array

    @classmethod
    def from_stiffness(cls, face: Face, stiffness_1: Array, stiffness_2: Array) -> ReducedPair:
        """Build the pair from each body's stiffness on its pad nodes with its ring held [N/mm].

        The matrices are ``(3 n, 3 n)``.
        """
        count = len(face)
        total = _inverse(stiffness_1) + _inverse(stiffness_2)
        return cls(face, total.reshape(count, 3, count, 3))

    @cached_property
    def areas(self) -> Array:
        """Area of each node ``(n,)`` [mm²]."""
        return self.face.nodal_areas

    def block(self, axis: int) -> Array:
        """Return A_xx, A_yy or A_zz, ``(n, n)`` [mm/N]."""
        return self.compliance[:, axis, :, axis]

    def normal(self, gap: Array, force: float, guess: Flags | None = None) -> NormalSolution:
        """Press the pads of ``gap`` ``(n,)`` [mm] together with ``force`` > 0 [N].

        ``guess`` ``(n,)`` marks the nodes that are likely to touch.
        """
        force = checks.number("normal force [N]", force, above=0.0)
        gap = checks.array("gaps", gap, (len(self.face),))
        contact = complementary(self.block(Z), gap, force, guess)
        return NormalSolution(
            force=contact.force,
            pressure=contact.force / self.areas,
            gap=contact.gap,
            approach=contact.level,
            area=float(self.areas[contact.force > 0.0].sum()),
            converged=contact.converged,
        )

    def tangential(
        self, normal: NormalSolution, displacement: float, friction: float
    ) -> TangentialSolution:
        """Move body 2's ring from rest by ``displacement`` >= 0 [mm] along x."""
        checks.number("displacement of first loading [mm]", displacement, least=0.0)
        checks.number("friction", friction, least=0.0)
        touching = np.flatnonzero(normal.touching)
        A = self.block(X)
        limit = friction * normal.force[touching]
        # The unknown is how far each node's shear stays below its limit; its complement is slip.
        offset = displacement - A[np.ix_(touching, touching)] @ limit
        stick = complementary(A[np.ix_(touching, touching)], offset)
        shear = np.zeros(len(self.face))
        shear[touching] = stick.force - limit
        # Beyond twice the limit a node would slide against the motion.
        admissible = bool(np.all(stick.force <= (2.0 + ROUNDING) * limit))
        slip = displacement + A @ shear
        slip[touching] = stick.gap
        return TangentialSolution(
            displacement=displacement,
            force=-float(shear.sum()),
            shear=shear,
            slip=np.where(normal.touching, slip, 0.0),
            converged=stick.converged and admissible,
        )

    def stick_stiffness(self, normal: NormalSolution, axis: int = X) -> float:
        """Return the tangential stiffness at the ring while all nodes in contact stick [N/mm]."""
        return -float(self.stuck_shear(normal, axis).sum())

    def stuck_shear(self, normal: NormalSolution, axis: int = X) -> Array:
        """Return the forces on body 2 per mm along ``axis`` while all nodes in contact stick.

        They are ``(n,)`` [N].
        """
        touching = np.flatnonzero(normal.touching)
        shear = np.zeros(len(self.face))
        A = self.block(axis)[np.ix_(touching, touching)]
        shear[touching] = -sl.solve(A, np.ones(len(touching)), assume_a="pos")
        return shear

    def virgin_curve(
        self, normal: NormalSolution, displacements: Array, friction: float
    ) -> VirginCurve:
        """Solve first loading at rising ``displacements`` ``(k,)`` [mm], which include 0."""
        states = tuple(self.tangential(normal, d, friction) for d in displacements)
        force = np.array([state.force for state in states])
        return VirginCurve(
            displacement=np.asarray(displacements, dtype=np.float64),
            force=force,
            states=states,
            stick_stiffness=self.stick_stiffness(normal),
            friction=float(force[-1] / normal.force.sum()),
        )

    def fretting_cycle(
        self, gap: Array, conditions: FrettingConditions, guess: Flags | None = None
    ) -> FrettingCycle:
        """Solve one cycle on the shape ``gap`` ``(n,)``.

        By Masing's rule the slip of a cycle is four times that of first loading to half the stroke,
        at the full Coulomb shear. ``guess`` ``(n,)`` marks the nodes that are likely to touch.
        """
        normal = self.normal(gap, conditions.force, guess)
        tangential = self.tangential(normal, 0.5 * conditions.stroke, conditions.friction)
        cycle_slip = 4.0 * tangential.slip
        energy = np.abs(tangential.shear) * cycle_slip
        return FrettingCycle(
            normal=normal,
            tangential=tangential,
            stick_stiffness=self.stick_stiffness(normal),
            friction=tangential.force / conditions.force,
            cycle_slip=cycle_slip,
            energy=float(energy.sum()),
        )

    def stable_cycles(self, normal: NormalSolution, depth_per_force: Array) -> float:
        """Return the number of cycles of constant shape beyond which errors of the worn shape grow.

        ``depth_per_force`` ``(n,)``, c, is the worn depth of both bodies per cycle and nodal force
        [mm/N]. A change of gap changes the forces by δf = -K' δg: with K the inverse of A_zz on the
        nodes in contact, K' = K - K 1 1ᵀK/(1ᵀK 1), which leaves the imposed force unchanged. A
        cycle block of ΔN cycles turns δg into (I - ΔN C K') δg, C = diag(c). This is stable while
        ΔN < 2/λ, with λ the largest eigenvalue of C^½ K' C^½. The change of slip with the forces is
        neglected. A single node carries all of the force whatever its gap, so its number of cycles
        is infinite.
        """
        touching = np.flatnonzero(normal.touching)
        if len(touching) < 2:
            return np.inf  # K' is 0 up to rounding.
        K = _inverse(self.block(Z)[np.ix_(touching, touching)])
        sums = K.sum(axis=1)
        K -= np.outer(sums, sums) / sums.sum()
        root = np.sqrt(depth_per_force[touching])
        largest = float(sl.eigvalsh(root[:, None] * K * root)[-1])
        return 2.0 / largest if largest > 0.0 else np.inf

    def coupled_cycle(
        self, gap: Array, conditions: FrettingConditions, steps: int, first: float | None = None
    ) -> CoupledCycle:
        """Solve the cycle after first loading, in ``steps`` increments per quarter of the stroke.

        ``first`` [mm] adds an increment of first loading, at a motion smaller than the first step.
        """
        amplitude = 0.5 * conditions.stroke
        rise = amplitude * np.arange(steps + 1) / steps
        if first is not None:
            rise = np.insert(rise, 1, first)
        fall = np.linspace(amplitude, -amplitude, 2 * steps + 1)[1:]
        path = np.concatenate([rise, fall, -fall])
        amplitudes = np.stack([np.full(len(path), conditions.force), path, 0.0 * path], axis=1)
        # The ring is free along z, so the gap may be shifted: this one is closed from the start.
        closed = gap - self.normal(gap, conditions.force).approach
        joint = FrictionalJoint(self.joint().resolvent(), conditions.friction)
        marched = tuple(joint.march(amplitudes, closed))
        begin = len(rise) - 1
        loading, states = marched[:begin], marched[begin:]
        force = np.array([-state.force[0].sum() for state in states])
        energy = -sum(np.sum(state.force[:2] * state.slip, axis=0) for state in states[1:])
        return CoupledCycle(Loop(path[begin:], force), loading, states, np.asarray(energy))

    def joint(self) -> JointStiffness:
        """Return the coupled joint, with load cases for ``(F, D_x, D_y)`` [N, mm, mm].

        Forces are f = H (w - D), H = A⁻¹. D_z follows from 1ᵀf_z = F: with h = H e_z, f = H' (w -
        D_x e_x - D_y e_y) + F h/(e_zᵀh), H' = H - h hᵀ/(e_zᵀh).
        """
        count = len(self.face)
        H = _inverse(self.compliance.reshape(3 * count, 3 * count))
        ex, ey, ez = (np.tile(np.eye(3)[axis], count) for axis in range(3))
        h = H @ ez
        unit_force = h / (ez @ h)
        H -= np.outer(h, unit_force)
        H = 0.5 * (H + H.T)
        loads = np.stack([unit_force, -H @ ex, -H @ ey], axis=1)
        values = sl.eigvalsh(H)
        return JointStiffness(H, loads, 1, float(values[1]), float(values[-1]))


def masing_loop(curve: VirginCurve) -> Loop:
    """Return the loop between ± the curve's last displacement (the source's eq. 30).

    The loop runs down and up again through twice the displacements of the curve, which is
    interpolated linearly and should start at 0.
    """
    amplitude = float(curve.displacement[-1])

    def first_loading(displacement: float) -> float:
        size = float(np.interp(abs(displacement), curve.displacement, curve.force))
        return float(np.copysign(size, displacement))

    down = amplitude - 2.0 * curve.displacement
    unloading = np.array([superpose(first_loading, [amplitude, float(d)]) for d in down])
    return Loop(np.append(down, -down[1:]), np.append(unloading, -unloading[1:]))


def _inverse(matrix: Array) -> Array:
    """Return the inverse of a symmetric positive definite matrix, symmetric to the last bit."""
    inverse = sl.inv(matrix)
    return 0.5 * (inverse + inverse.T)
