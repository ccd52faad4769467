"""How far geometric nonlinearity moves the contact forces and slips of a loaded structure.

The linear model balances forces on the undeformed shape. Here both bodies are St. Venant-Kirchhoff
in total Lagrangian form, the centrifugal force acts where the deformed mass is, and the contact
faces are those of the deformed body 1: their frames turn by its mean rotation. Loads other than the
centrifugal keep their direction. Sliding stays small: nodes keep their partners and gaps. Newton's
method makes every iteration a linear structure with the same contact:

    (K_T(u_k) - Ω² M) u = f + K_T(u_k) u_k - F(u_k) + contact forces.

The frames are those of u_k too: they follow one iteration behind.
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
from fe_models.joints.joint import JointResolvent
from fe_models.motion import deformation
from fe_models.structure import Structure
from sa_solver.types import Array, resultant_change

# Nodal forces left out of balance relative to all, and turn of the frames left [rad]: ten times
# what friction.TOLERANCE leaves, a thousandth of the changes that are reported.
TOLERANCE = 1e-6
# Two or three iterations lead from the linear solution; one that takes more has lost its way.
MAX_ITERATIONS = 12


@dataclass(frozen=True)
class NonlinearCheck:
    """A load reached in one increment from rest, by the linear and the total Lagrangian model.

    ``linear`` and ``nonlinear`` ``(interfaces, 6)`` are the resultants ``(P, Qx, Qy, Mx, My, Mz)``
    in the frames of the undeformed and of the deformed faces [N, N mm], and ``change`` that of
    :func:`~sa_solver.types.resultant_change`. ``slip`` ``(2, n)`` over all interfaces [mm] is
    nonlinear, ``slip_change`` the largest change of a slip relative to the largest slip. ``slide``
    is the largest slip relative to half the width of its face: the order of what small sliding
    leaves out of the lever arms. ``displacements`` of both bodies are nonlinear; ``largest_strain``
    (principal of Green's tensor, in size), ``largest_rotation`` and ``face_rotation`` [rad] tell
    how large they are. ``residual`` is what Newton's method leaves out of balance relative to the
    nodal forces, or to turn [rad].
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
    like: JointResolvent,
    friction: float | Array,
    amplitudes: Array,
    gap: Array,
    softening: Softening,
) -> NonlinearCheck:
    """Compare the linear structure with the total Lagrangian one at the loads ``amplitudes``.

    ``like`` is the linear structure's condensed joint, ``softening`` the bodies' spin softening at
    that load (:mod:`fe_models.elasticity.spin_softening`). Raises ValueError if there is no load.
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
    """Largest change of a slip ``(2, n)`` relative to the largest slip."""
    largest = float(np.linalg.norm(then, axis=0).max())
    change = float(np.linalg.norm(now - then, axis=0).max())
    return change / largest if largest > 0.0 else change


def face_sizes(structure: Structure) -> Array:
    """Extent of every interface along x and y, ``(interfaces, 2)`` [mm]."""
    return np.array([np.ptp(i.coordinates, axis=0) for i in structure.mesh.interfaces])


def _slide(structure: Structure, slip: Array) -> float:
    """Largest slip relative to half the narrower extent of its face."""
    interfaces = structure.mesh.interfaces
    parts = np.split(np.linalg.norm(slip, axis=0), np.cumsum([len(i) for i in interfaces])[:-1])
    widths = [0.5 * size[size > 0.0].min() for size in face_sizes(structure)]
    return max(float(part.max() / width) for part, width in zip(parts, widths, strict=True))


def _newton(
    structure: Structure,
    linear: FrictionState,
    like: JointResolvent,
    friction: float | Array,
    amplitudes: Array,
    gap: Array,
    softening: Softening,
) -> tuple[FrictionState, Displacements, int, float]:
    """Re-linearise and solve the contact until the next linear structure would be the same.

    Its state, the displacements of both bodies, the iterations and the residual at the end.
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
    """Nodal forces that a linear step from ``before`` to ``after`` leaves out, by all of them."""
    shares = []
    for body, u, v, soft in zip(tangent.bodies, before, after, softening, strict=True):
        finite = TotalLagrangian(body.elastic)
        force = finite.internal_force(v)
        step = (body.elastic.stiffness + soft) @ (v - u)
        left = force - finite.internal_force(u) - step
        shares.append(float(np.linalg.norm(left) / np.linalg.norm(force)))
    return max(shares)


def _turn(undeformed: Structure, framed: Structure, displacements: Displacements) -> float:
    """Largest angle from the frames of ``framed`` to body 1's displaced faces [rad]."""
    pairs = zip(undeformed.mesh.interfaces, framed.mesh.interfaces, strict=True)
    turns = [
        turned_interface(face, undeformed.mesh, displacements).frame.axes @ other.frame.axes.T
        for face, other in pairs
    ]
    return float(rotation_angle(np.array(turns)).max())
