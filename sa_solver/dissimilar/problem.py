"""The discrete contact problem of dissimilar bodies, normal and tangential together.

Tractions ``t = (qx, qy, p)`` and relative displacements ``v = (Δsx, Δsy, g)`` of one increment obey

    v = K t + D t + offset - R c
    p >= 0,  g >= 0,  p g = 0,    |q| <= µp,  Δs = -λ q,  λ >= 0,  λ (µp - |q|) = 0

K is the half-space with all nine influence functions, D a local compliance of the pressure alone, R
the six rigid motions and c their sizes, each imposed or such that its resultant is.
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
"""Where the tangential displacement is below this share of the normal one, friction hardly acts:
its residual is measured against that share, since against rounding it would never be small."""


@dataclass(frozen=True)
class CoupledProblem:
    """Data of one increment.

    ``offset`` ``(3, nx, ny)`` [mm] holds, in z, the gap before loading and, in x and y, what the
    slip is counted from, with all ``imposed`` motions ``(6,)`` taken off; ``free`` are the motions
    whose resultants ``target`` ``(len(free),)`` [MPa] are imposed instead; ``compliance`` D
    ``(nx, ny)`` [mm/MPa] or 0.
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
        """P over the cell area [MPa], or None where the approach is imposed instead."""
        return float(self.target[0]) if 0 in self.free else None

    @cached_property
    def normal(self) -> NormalModes:
        """The free modes of pressure."""
        return self.modes.normal(self.free)

    @cached_property
    def planar(self) -> PlanarModes:
        """The free modes of shear."""
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
        """The problem with tractions only on the cells of ``window``, those of ``half_space``."""
        compliance = self.compliance
        return replace(
            self,
            half_space=half_space,
            modes=self.modes.cropped(window),
            offset=np.ascontiguousarray(self.offset[:, *window]),
            compliance=compliance if isinstance(compliance, float) else compliance[window],
        )

    def relative(self, traction: Array, displacement: Array, rigid: Array) -> Array:
        """``v`` ``(3, nx, ny)`` [mm] under tractions t, K t and free motions ``rigid`` ``(6,)``."""
        relative = displacement + self.offset - self.modes.motion(rigid)
        relative[Z] += self.compliance * traction[Z]
        return relative


@dataclass(frozen=True)
class CoupledResiduals:
    """How far a state is from solving the problem, dimensionless, independent of the method.

    ``force``: largest error of an imposed P, Qx or Qy over P; ``moment``: of an imposed Mx, My or
    Mz over P times half the grid's size; ``penetration`` and ``complementarity`` as in
    :class:`~sa_solver.normal.problem.NormalResiduals`; ``coulomb``: largest
    ``κ |q - Π(q - Δs/κ)|`` over the largest ``|u_τ|`` (or, if that is more, 1e-4 of the largest
    u_z), Π the projection on the disk of radius µp
    and κ a cell's own compliance, which vanishes only where Coulomb's law holds. Pressure is never
    negative and shear never above µp.
    """

    force: float
    moment: float
    penetration: float
    complementarity: float
    coulomb: float

    @property
    def largest(self) -> float:
        """The largest of the five."""
        return max(self.force, self.moment, self.penetration, self.complementarity, self.coulomb)


def coupled_residuals(
    problem: CoupledProblem, traction: Array, displacement: Array, relative: Array
) -> CoupledResiduals:
    """All residuals of a state: ``t``, ``K t`` and ``v``, each ``(3, nx, ny)``."""
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
