"""Discrete contact problem of dissimilar bodies, normal and tangential together.

Tractions ``t = (qx, qy, p)`` and relative displacements ``v = (Δsx, Δsy, g)`` of one increment obey

    v = K t + D t + offset - R c
    p >= 0,  g >= 0,  p g = 0,    |q| <= µp,  Δs = -λ q,  λ >= 0,  λ (µp - |q|) = 0

where K is the half-space with all nine influence functions, D a local compliance that acts on
pressure alone, R the six rigid motions and c their coefficients. Each coefficient is imposed, or
follows from an imposed resultant.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sa_solver.contact_law import project_on_disk
from sa_solver.half_space.influence import X, Z
from sa_solver.half_space.operator import HalfSpace
from sa_solver.rigid_modes import NORMAL, PLANAR, NormalModes, PlanarModes, RigidModes, Window
from sa_solver.types import Array

SMALLEST_SHARE = 1e-4
"""Least displacement to which the residual of friction is relative, as a share of the normal
displacement. Where the tangential displacement is smaller, friction hardly acts, and a residual
relative to rounding would never be small."""


@dataclass(frozen=True)
class CoupledProblem:
    """Data of one increment.

    Attributes
    ----------
    half_space
        Half-space K.
    modes
        Rigid motions R.
    friction
        Coefficient of friction µ.
    offset
        Relative displacement ``(3, nx, ny)`` [mm] without tractions and free motions: the slip in x
        and y, and the gap in z, minus all imposed motions.
    imposed
        Imposed motions ``(6,)`` [mm].
    free
        Motions whose resultants are imposed instead.
    target
        Sums ``(len(free),)`` [MPa] that follow from these resultants.
    compliance
        Local compliance D ``(nx, ny)`` [mm/MPa], or 0.
    """

    half_space: HalfSpace
    modes: RigidModes
    friction: float
    offset: Array
    imposed: Array
    free: tuple[int, ...]
    target: Array
    compliance: Array | float

    @property
    def load(self) -> float | None:
        """Normal load P over the cell area [MPa], or None where the approach is imposed."""
        return float(self.target[0]) if 0 in self.free else None

    @cached_property
    def normal(self) -> NormalModes:
        """Free modes of pressure."""
        return self.modes.normal(self.free)

    @cached_property
    def planar(self) -> PlanarModes:
        """Free modes of shear."""
        return self.modes.planar(self.free)

    @cached_property
    def normal_target(self) -> Array:
        """Sums [MPa] imposed on the free modes of pressure."""
        return self.target[[k in NORMAL for k in self.free]]

    @cached_property
    def planar_target(self) -> Array:
        """Sums [MPa] imposed on the free modes of shear."""
        return self.target[[k in PLANAR for k in self.free]]

    def cropped(self, window: Window, half_space: HalfSpace) -> CoupledProblem:
        """Return the problem with tractions only on the cells of ``window``.

        ``half_space`` covers these cells.
        """
        compliance = self.compliance
        return replace(
            self,
            half_space=half_space,
            modes=self.modes.cropped(window),
            offset=np.ascontiguousarray(self.offset[:, *window]),
            compliance=compliance if isinstance(compliance, float) else compliance[window],
        )

    def relative(self, traction: Array, displacement: Array, rigid: Array) -> Array:
        """Return the relative displacement v ``(3, nx, ny)`` [mm].

        ``displacement`` is K t for the tractions t, and ``rigid`` ``(6,)`` are the free motions.
        """
        relative = displacement + self.offset - self.modes.motion(rigid)
        relative[Z] += self.compliance * traction[Z]
        return relative


@dataclass(frozen=True)
class CoupledResiduals:
    """Dimensionless residuals of a state, which do not depend on the method of solution.

    The pressure itself is never negative and the shear never above µp.

    Attributes
    ----------
    force
        Largest error of an imposed P, Qx or Qy over P.
    moment
        Largest error of an imposed Mx, My or Mz over P times half the size of the grid.
    penetration, complementarity
        As in :class:`~sa_solver.normal.problem.NormalResiduals`.
    coulomb
        Largest ``κ |q - Π(q - Δs/κ)|`` over the largest ``|u_τ|``, or over 1e-4 of the largest u_z
        if that is more. Π is the projection on the disk of radius µp and κ the compliance of a
        cell. The residual vanishes only where Coulomb's law holds.
    """

    force: float
    moment: float
    penetration: float
    complementarity: float
    coulomb: float

    @property
    def largest(self) -> float:
        """Largest of the five residuals."""
        return max(self.force, self.moment, self.penetration, self.complementarity, self.coulomb)


def coupled_residuals(
    problem: CoupledProblem, traction: Array, displacement: Array, relative: Array
) -> CoupledResiduals:
    """Return all residuals of a state.

    The state is given by its tractions t, their displacement K t and the relative displacement v,
    each ``(3, nx, ny)``.
    """
    pressure, gap = traction[Z], relative[Z]
    load = float(pressure.sum())
    depth = float((displacement[Z] + problem.compliance * pressure).max())
    if not (load > 0.0 and depth > 0.0):
        return CoupledResiduals(*[np.inf] * 5)
    errors = np.zeros(6)
    errors[list(problem.free)] = np.abs(
        problem.modes.sums(traction)[list(problem.free)] - problem.target
    )
    errors /= problem.load or load
    return CoupledResiduals(
        force=float(errors[:3].max()),
        moment=float(errors[3:].max()),
        penetration=max(0.0, -float(gap.min())) / depth,
        complementarity=float(np.abs(pressure * gap).max() / (pressure.max() * depth)),
        coulomb=_coulomb_residual(problem, traction, displacement, relative[:Z]),
    )


def _coulomb_residual(
    problem: CoupledProblem, traction: Array, displacement: Array, slip: Array
) -> float:
    compliance = problem.half_space.self_compliance(X)
    shear, limit = traction[:Z], problem.friction * traction[Z]
    step = compliance * np.hypot(*(shear - project_on_disk(shear - slip / compliance, limit)))
    tangential, normal = float(np.hypot(*displacement[:Z]).max()), float(displacement[Z].max())
    return float(step.max()) / max(tangential, SMALLEST_SHARE * normal)
