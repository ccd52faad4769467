"""Effect of geometric nonlinearity on the contact forces and slips of a loaded structure.

The linear model balances forces on the undeformed shape. Here both bodies are St. Venant-Kirchhoff
in total Lagrangian form, the centrifugal force acts at the deformed position of the mass, and the
contact faces are those of the deformed body 1: their frames turn by its mean rotation. Loads other
than the centrifugal force keep their direction. Sliding is assumed to be small: nodes keep their
partners and gaps. Every iteration of Newton's method solves a linear structure with the same
contact:

    (K_T(u_k) - Ω² M) u = f + K_T(u_k) u_k - F(u_k) + contact forces.

The frames are also those of u_k, one iteration behind.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe_models.elasticity.relinearised import (
    Displacements,
    Softening,
    relinearised,
    turned_interface,
)
from fe_models.elasticity.total_lagrangian import TotalLagrangian, rotation_angle
from fe_models.joints.friction import FrictionalJoint, FrictionState
from fe_models.joints.joint import Resolvent
from fe_models.motion import deformation
from fe_models.structure import Structure
from sa_solver.types import Array, resultant_change

# Tolerated unbalanced nodal forces relative to all, and tolerated turn of the frames [rad]: ten
# times the errors due to friction.TOLERANCE, and a thousandth of the changes that are reported.
TOLERANCE = 1e-6
# Two or three iterations usually suffice from the linear solution; one that takes more diverges.
MAX_ITERATIONS = 12


@dataclass(frozen=True)
class NonlinearCheck:
    """Comparison of the linear and the total Lagrangian model at one load, reached from rest.

    Attributes
    ----------
    linear, nonlinear
        Resultants ``(P, Qx, Qy, Mx, My, Mz)`` ``(interfaces, 6)`` in the frames of the undeformed
        and of the deformed faces [N, N mm].
    change
        Change of the resultants by :func:`~sa_solver.types.resultant_change`.
    slip
        Slip of the nonlinear model ``(2, n)`` over all interfaces [mm].
    slip_change
        Largest change of a slip relative to the largest slip.
    slide
        Largest slip relative to half the width of its face: the order of the error that the
        assumption of small sliding makes in lever arms.
    displacements
        Displacements of both bodies in the nonlinear model.
    largest_strain
        Largest absolute principal value of Green's strain.
    largest_rotation, face_rotation
        Largest rotation of the bodies and of the faces [rad].
    iterations
        Iterations of Newton's method.
    residual
        Unbalanced nodal forces relative to all, or remaining turn of the frames [rad].
    converged
        Whether both models converged.
    """

    linear: Array
    nonlinear: Array
    change: Array
    slip: Array
    slip_change: float
    slide: float
    displacements: Displacements
    largest_strain: float
    largest_rotation: float
    face_rotation: float
    iterations: int
    residual: float
    converged: bool


def check_nonlinearity(
    structure: Structure,
    like: Resolvent,
    friction: float | Array,
    amplitudes: Array,
    gap: Array,
    softening: Softening,
) -> NonlinearCheck:
    """Compare the linear structure with the total Lagrangian one at the loads ``amplitudes``.

    Parameters
    ----------
    structure
        The linear structure.
    like
        Its condensed joint.
    friction
        Friction coefficient, one or by node ``(n,)``.
    amplitudes
        Amplitudes of the load cases ``(cases,)``.
    gap
        Gaps of all interfaces ``(n,)`` [mm].
    softening
        Spin softening of the bodies at that load (:mod:`fe_models.elasticity.spin_softening`).

    Raises
    ------
    ValueError
        If there is no load.
    """
    (linear,) = FrictionalJoint(like, friction).march(amplitudes[None], gap)
    state, displacements, iterations, residual = _newton(
        structure, linear, like, friction, amplitudes, gap, softening
    )
    first, last = (structure.interface_resultants(s) for s in (linear, state))
    finite = [TotalLagrangian(body.elastic) for body in structure.bodies]
    pairs = list(zip(finite, displacements, strict=True))
    return NonlinearCheck(
        linear=first,
        nonlinear=last,
        change=resultant_change(last, first, face_sizes(structure)),
        slip=state.slip,
        slip_change=slip_change(state.slip, linear.slip),
        slide=_slide(structure, state.slip),
        displacements=displacements,
        largest_strain=max(body.largest_strain(u) for body, u in pairs),
        largest_rotation=max(body.largest_rotation(u) for body, u in pairs),
        face_rotation=_turn(structure, structure, displacements),
        iterations=iterations,
        residual=residual,
        converged=linear.converged and state.converged and residual < TOLERANCE,
    )


def slip_change(now: Array, then: Array) -> float:
    """Return the largest change of a slip ``(2, n)`` relative to the largest slip."""
    largest = float(np.linalg.norm(then, axis=0).max())
    change = float(np.linalg.norm(now - then, axis=0).max())
    return change / largest if largest > 0.0 else change


def face_sizes(structure: Structure) -> Array:
    """Return the extent of every interface along x and y, ``(interfaces, 2)`` [mm]."""
    return np.array([np.ptp(i.coordinates, axis=0) for i in structure.mesh.interfaces])


def _slide(structure: Structure, slip: Array) -> float:
    """Return the largest slip relative to half the narrower extent of its face."""
    interfaces = structure.mesh.interfaces
    parts = np.split(np.linalg.norm(slip, axis=0), np.cumsum([len(i) for i in interfaces])[:-1])
    widths = [0.5 * size[size > 0.0].min() for size in face_sizes(structure)]
    return max(float(part.max() / width) for part, width in zip(parts, widths, strict=True))


def _newton(
    structure: Structure,
    linear: FrictionState,
    like: Resolvent,
    friction: float | Array,
    amplitudes: Array,
    gap: Array,
    softening: Softening,
) -> tuple[FrictionState, Displacements, int, float]:
    """Re-linearise and solve the contact until the next linear structure would be the same.

    The result is the state, the displacements of both bodies, the number of iterations and the
    final residual.
    """
    state = linear
    displacements = deformation(structure, linear.force, linear.displacement, amplitudes)
    iterations, residual = 0, np.inf
    while not (state.converged and residual < TOLERANCE) and iterations < MAX_ITERATIONS:
        iterations += 1
        tangent = relinearised(structure, displacements, amplitudes, softening)
        joint = FrictionalJoint(tangent.condense(like).resolvent(), friction)
        (state,) = joint.march(amplitudes[None], gap, guess=[state.state])
        before = displacements
        displacements = deformation(tangent, state.force, state.displacement, amplitudes)
        residual = max(
            _remainder(tangent, before, displacements, softening),
            _turn(structure, tangent, displacements),
        )
    return state, displacements, iterations, residual


def _remainder(
    tangent: Structure, before: Displacements, after: Displacements, softening: Softening
) -> float:
    """Return the largest relative error of nodal forces after a linear step from ``before``.

    It is the error of the linear prediction for ``after``, relative to the nodal forces there.
    """
    shares = []
    for body, u, v, soft in zip(tangent.bodies, before, after, softening, strict=True):
        finite = TotalLagrangian(body.elastic)
        force = finite.internal_force(v)
        step = (body.elastic.stiffness + soft) @ (v - u)
        left = force - finite.internal_force(u) - step
        shares.append(float(np.linalg.norm(left) / np.linalg.norm(force)))
    return max(shares)


def _turn(undeformed: Structure, framed: Structure, displacements: Displacements) -> float:
    """Return the largest angle from the frames of ``framed`` to body 1's displaced faces [rad]."""
    pairs = zip(undeformed.mesh.interfaces, framed.mesh.interfaces, strict=True)
    turns = [
        turned_interface(face, undeformed.mesh, displacements).frame.axes @ other.frame.axes.T
        for face, other in pairs
    ]
    return float(rotation_angle(np.array(turns)).max())
