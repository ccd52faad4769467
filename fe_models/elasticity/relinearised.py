"""Linear structures with the stiffness at one load: stress-stiffened, spin-softened, re-linearised.

Both approximate the nonlinear structure at the cost of one more condensation. They use the
stiffness at one load, the peak, for all loads, and change every load in proportion. At a share a of
the peak load nonlinearity changes the contact forces by a² of the change at peak; here the change
is a times that at peak.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from fe_models.elasticity.total_lagrangian import TotalLagrangian
from fe_models.joints.friction import FrictionState
from fe_models.joints.joint import Resolvent
from fe_models.loads.rigid_motions import rigid_motions
from fe_models.meshes.structure_mesh import Interface, StructureMesh
from fe_models.structure import Structure
from fe_models.supported_body import SupportedBody, interface_nodes
from sa_solver.types import Array, Frame

# Displacements of each body, and spin softening matrices of each body.
Displacements = tuple[Array, ...]
Softening = tuple[sp.csr_matrix, ...]


@dataclass(frozen=True)
class PrestressedStructure(Structure):
    """Structure of two bodies, the first of them held, with the stiffness it has at one load.

    ``displacements`` are those of both bodies at that load. ``share`` ``(cases,)`` is the share of
    that load that a unit amplitude of each load case is.
    """

    displacements: Displacements
    share: Array

    def condense_path(self, like: Resolvent) -> Resolvent:
        """Return the joint for a whole load path; ``like`` is that of the linear structure.

        A body held by contact alone has a negative stiffness to rigid motions in a centrifugal
        field. On unloading this would throw it out where nothing presses it any more, although by
        then nothing spins. Therefore rigid motions have no stiffness here, as in the linear
        structure; the forces on them at the one load are applied as loads in proportion.
        """
        joint = self.condense(like)
        free = ~self.bodies[1].held
        full = np.asarray(joint.stiffness)
        stiffness = _deflated(full, self._rigid_motions()[free])
        relative = self._relative()[free]
        taken = full @ relative - stiffness @ relative
        loads = joint.loads + np.outer(taken, self.share)
        return replace(joint, stiffness=stiffness, loads=loads).resolvent()

    def equilibrium_errors(self, states: Sequence[FrictionState], amplitudes: Array) -> Array:
        """Return the errors of the balance, with the stiffness forces of rigid motions as loads.

        These forces, -K u at the one load, are applied in proportion, as in :meth:`condense_path`.
        They balance as accurately as ``displacements`` are those of this structure.
        """
        body_1, body_2 = self.bodies
        forces = -body_2.elastic.stiffness @ self.displacements[1]
        loaded = copy(body_2)
        loaded.loads = body_2.loads + np.outer(forces, self.share)
        plain = Structure(self.mesh, (body_1, loaded))
        return plain.equilibrium_errors(states, amplitudes)

    def _relative(self) -> Array:
        """Return relative displacements ``(d n,)`` of body 2 at the load, in the frames."""
        below, above = (
            body.at_interface(moved)
            for body, moved in zip(self.bodies, self.displacements, strict=True)
        )
        return above - self.carried(below)

    def _rigid_motions(self) -> Array:
        """Return orthonormal interface motions ``(d n, k)`` that body 2's supports leave free."""
        faces, body_2 = self.mesh.interfaces, self.mesh.bodies[1]
        axes = body_2.axes
        points = np.concatenate([body_2.points[face.nodes_2] for face in faces])
        middle = points.mean(axis=0)
        size = float(np.linalg.norm(np.ptp(points, axis=0)))
        free = self.bodies[1].free_motions(middle, size)
        moved = (free @ rigid_motions((points - middle) / size).T).reshape(len(free), *points.shape)
        ends = np.cumsum([len(face) for face in faces])[:-1]
        by_face = zip(faces, np.split(moved, ends, axis=1), strict=True)
        local = np.concatenate([face.frame.components(part) for face, part in by_face], axis=1)
        motions = local[:, :, axes].transpose(1, 2, 0).reshape(len(axes) * len(points), len(free))
        return np.asarray(np.linalg.qr(motions)[0])


def stress_stiffened(
    structure: Structure, displacements: Displacements, amplitudes: Array, softening: Softening
) -> PrestressedStructure:
    """Return the structure with the stiffness K + K_σ - Ω² M, stressed and spinning.

    This is the classical linear perturbation. Loads, shape and frames are those of the linear
    structure: it includes the second-order effect of stress on displacements across it, but not the
    change of geometry due to the displacements, which :func:`relinearised` includes.

    Parameters
    ----------
    structure
        The linear structure.
    displacements
        Its displacements of both bodies at the load, which determine the stress.
    amplitudes
        Amplitudes of the load cases at that load ``(cases,)``.
    softening
        Spin softening of both bodies at that load.
    """
    changes = [
        (TotalLagrangian(body.elastic).stress_stiffened(displacement) - soft, body.loads)
        for body, displacement, soft in zip(structure.bodies, displacements, softening, strict=True)
    ]
    return _prestressed(
        structure, structure.mesh, displacements, _share(structure, amplitudes), changes
    )


def relinearised(
    structure: Structure, displacements: Displacements, amplitudes: Array, softening: Softening
) -> PrestressedStructure:
    """Return the linear structure that is tangent to the nonlinear one at given displacements.

    Both bodies have the total Lagrangian tangent stiffness less the spin softening, and loads that
    are exact for the displacements at the load. At other loads they are in proportion, so that the
    unloaded structure stays unloaded. The interface frames are turned with body 1's faces.

    Parameters
    ----------
    structure
        The linear structure.
    displacements
        Displacements of both bodies at the load.
    amplitudes
        Amplitudes of the load cases at that load ``(cases,)``.
    softening
        Spin softening of both bodies at that load.

    Raises
    ------
    ValueError
        If there is no load, or if a temperature changes.
    """
    mesh = structure.mesh
    interfaces = tuple(turned_interface(i, mesh, displacements) for i in mesh.interfaces)
    share = _share(structure, amplitudes)
    changes = []
    for body, displacement, soft in zip(structure.bodies, displacements, softening, strict=True):
        finite = TotalLagrangian(body.elastic)
        tangent = finite.tangent(displacement)
        offset = tangent @ displacement - finite.internal_force(displacement)
        changes.append((tangent - soft, body.loads + np.outer(offset, share)))
    mesh = replace(mesh, interfaces=interfaces)
    return _prestressed(structure, mesh, displacements, share, changes)


def turned_interface(
    interface: Interface, mesh: StructureMesh, displacements: Displacements
) -> Interface:
    """Return the interface with its frame turned by the mean rotation of body 1's face."""
    place = interface.bodies[0]
    body_1, moved = mesh.bodies[place], displacements[place]
    axes = body_1.axes
    points = body_1.points[interface.nodes_1][:, axes]
    nodal = moved.reshape(-1, len(axes))[interface.nodes_1]
    rotation = np.eye(3)
    rotation[np.ix_(axes, axes)] = mean_rotation(
        points, points + nodal, interface.face(1).nodal_areas
    )
    turned = replace(interface, frame=_turned(interface.frame, rotation))
    if interface.face_1 is None:
        return turned
    face_1 = replace(interface.face_1, frame=_turned(interface.face_1.frame, rotation))
    return replace(turned, face_1=face_1)


def mean_rotation(before: Array, after: Array, weights: Array) -> Array:
    """Return the rotation ``(d, d)`` that best maps points ``(n, d)`` to their positions ``after``.

    The fit is by weighted least squares (Kabsch 1976, doi:10.1107/S0567739476001873).
    """
    centred = [points - weights @ points / weights.sum() for points in (before, after)]
    left, _, right = np.linalg.svd((weights[:, None] * centred[1]).T @ centred[0])
    signs = np.ones(before.shape[1])
    signs[-1] = np.sign(np.linalg.det(left @ right))
    return np.asarray((left * signs) @ right)


def _turned(frame: Frame, rotation: Array) -> Frame:
    return Frame(frame.origin, frame.axes @ rotation.T)


def _deflated(stiffness: Array, motions: Array) -> Array:
    """Return P H P, where P removes the part in orthonormal ``motions`` ``(n, k)``."""
    forces = stiffness @ motions
    inner = motions.T @ forces
    half = (forces - 0.5 * motions @ inner) @ motions.T
    return np.asarray(stiffness - half - half.T)


def _share(structure: Structure, amplitudes: Array) -> Array:
    """Return the share of the load at ``amplitudes`` in a unit of each load case ``(cases,)``.

    It is the projection of the cases' nodal forces on those of that load. The product with the
    amplitudes is one at that load and decreases with the load, and does not depend on the order and
    the units of the cases. Raises ValueError if there is no load, or if temperatures change.
    """
    if any(body.expands for body in structure.bodies):
        raise ValueError(
            "a temperature changes, and thermal strains are available in linear structures only; "
            "leave it out or use the linear structure"
        )
    forces = np.concatenate([b.nodal_loads() for b in structure.bodies])
    load = forces @ amplitudes
    if not load.any():
        raise ValueError(
            "a structure is re-linearised at a load, but all amplitudes are zero; give a load"
        )
    return np.asarray((load @ forces) / (load @ load))


def _prestressed(
    structure: Structure,
    mesh: StructureMesh,
    displacements: Displacements,
    share: Array,
    changes: Sequence[tuple[sp.csr_matrix, Array]],
) -> PrestressedStructure:
    """Return the structure with another stiffness, other loads and the frames of ``mesh``."""
    bodies = []
    for number, (body, (stiffness, loads)) in enumerate(
        zip(structure.bodies, changes, strict=True)
    ):
        elastic = copy(body.elastic)
        elastic.stiffness = stiffness
        placed = interface_nodes(mesh.faces_of(number), elastic.body)
        given = body.constraints, *placed, loads, body.imposed, body.loaded, body.trace
        bodies.append(SupportedBody(elastic, *given, cuts=body.cuts))
    return PrestressedStructure(mesh, tuple(bodies), displacements, share)
