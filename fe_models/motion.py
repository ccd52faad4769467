"""Displacements of all bodies of a structure, from the solution of its contacts.

A body that supports hold is loaded by its contact forces. A body that is body 2 of all its
interfaces, all on held bodies, follows them: its faces move with theirs plus the relative
displacements. Any other body is loaded by its contact forces up to a rigid motion, which is found
by least squares so that its faces meet their neighbours at the relative displacements.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fe_models.meshes.structure_mesh import in_space
from fe_models.structure import Structure
from sa_solver.types import Array


@dataclass(frozen=True)
class StructureMotion:
    """Motion of a structure over the increments of a cycle.

    Attributes
    ----------
    displacements
        Displacements of each body ``(size, k)`` [mm] in the requested increments.
    faces
        Displacements of body 1 and of body 2 ``(t, 3, n)`` [mm] at the nodes of each interface, in
        its frame and in all increments.
    """

    displacements: tuple[Array, ...]
    faces: tuple[tuple[Array, Array], ...]


def deformation(
    structure: Structure, force: Array, relative: Array, amplitudes: Array
) -> tuple[Array, ...]:
    """Return the displacements of each body ``(size,)`` [mm].

    Parameters
    ----------
    structure
        Structure whose contact has been solved.
    force
        Contact forces on body 2 ``(3, n)`` [N] over all interfaces, in their frames.
    relative
        Relative displacements ``(3, n)`` [mm] over all interfaces, in their frames.
    amplitudes
        Amplitudes of the load cases ``(cases,)``.
    """
    motion = structure_motion(structure, force[None], relative[None], amplitudes[None], [0])
    return tuple(displacement[:, 0] for displacement in motion.displacements)


def structure_motion(
    structure: Structure,
    force: Array,
    relative: Array,
    amplitudes: Array,
    increments: Sequence[int],
) -> StructureMotion:
    """Return the displacements in some ``increments``, and those of the faces in all increments.

    Parameters
    ----------
    structure
        Structure whose contact has been solved.
    force, relative
        Contact forces and relative displacements ``(t, 3, n)``, as in :func:`deformation`.
    amplitudes
        Amplitudes of the load cases ``(t, cases)``.
    increments
        Numbers of the increments in which all displacements are returned.
    """
    forces, count = structure.on_faces(force), len(structure.held[0])
    axes = structure.mesh.bodies[0].axes
    apart = relative[:, axes, :].transpose(2, 1, 0).reshape(-1, len(force))
    moved = np.zeros_like(forces)
    followers = _followers(structure)
    found = _leaders(structure, followers, forces, apart, amplitudes, moved)
    under = structure.carried(moved[:count])
    moved[count:] = under + apart
    shown, loads = list(increments), amplitudes[increments].T
    displacements = []
    for number, (body, place) in enumerate(zip(structure.bodies, structure.places, strict=True)):
        if number in found:
            displacements.append(found[number][:, shown])
        else:
            at_faces = moved[place][:, shown], forces[place][:, shown]
            displacements.append(body.recover(*at_faces, loads))
    return StructureMotion(tuple(displacements), _by_interface(structure, under, moved[count:]))


def _followers(structure: Structure) -> set[int]:
    """Return the bodies that are body 2 of all their interfaces, and all of them on held bodies."""
    pairs = [interface.bodies for interface in structure.mesh.interfaces]
    held = {number for number, body in enumerate(structure.bodies) if body.is_held}
    leaders = {one for one, _ in pairs} | {two for one, two in pairs if one not in held}
    return set(range(len(structure.bodies))) - leaders


def _leaders(
    structure: Structure,
    followers: set[int],
    forces: Array,
    apart: Array,
    amplitudes: Array,
    moved: Array,
) -> dict[int, Array]:
    """Return the displacements ``(size, t)`` of the bodies that do not follow, by number.

    The displacements of their faces are written into ``moved`` ``(places, t)``.
    """
    found, rigid = {}, []
    for number, (body, place) in enumerate(zip(structure.bodies, structure.places, strict=True)):
        if number in followers:
            continue
        found[number], moved[place] = body.respond(forces[place], amplitudes.T)
        if not body.is_held:
            rigid.append((number, *body.rigid_displacements()))
    if not rigid:
        return found
    free = np.zeros((len(moved), sum(on_faces.shape[1] for *_, on_faces in rigid)))
    ends = np.cumsum([on_faces.shape[1] for *_, on_faces in rigid])
    columns = [slice(end - on.shape[1], end) for (*_, on), end in zip(rigid, ends, strict=True)]
    for (number, _, on_faces), mine in zip(rigid, columns, strict=True):
        free[structure.places[number], mine] = on_faces
    known = _known(structure, followers)
    missing, by_motion = apart - _relative(structure, moved), _relative(structure, free)
    shares = np.linalg.lstsq(by_motion[known], missing[known], rcond=None)[0]
    moved += free @ shares
    for (number, everywhere, _), mine in zip(rigid, columns, strict=True):
        found[number] += everywhere @ shares[mine]
    return found


def _relative(structure: Structure, moved: Array) -> Array:
    """Return relative displacements ``(d n, ...)`` from those of all faces ``(places, ...)``."""
    count = len(structure.held[0])
    return moved[count:] - structure.carried(moved[:count])


def _known(structure: Structure, followers: set[int]) -> np.ndarray:
    """Mark relative displacements ``(d n,)`` of interfaces whose two bodies both do not follow."""
    interfaces = structure.mesh.interfaces
    both = [not followers.intersection(interface.bodies) for interface in interfaces]
    return np.repeat(both, [structure.dimension * len(interface) for interface in interfaces])


def _by_interface(
    structure: Structure, under: Array, above: Array
) -> tuple[tuple[Array, Array], ...]:
    """Return the motions ``(t, 3, n)`` of body 1 and body 2 at the nodes of each interface."""
    ends = np.cumsum([len(interface) for interface in structure.mesh.interfaces])[:-1]
    one, two = (
        np.split(
            in_space(moved.T.reshape(moved.shape[1], -1, structure.dimension)).swapaxes(1, 2),
            ends,
            axis=2,
        )
        for moved in (under, above)
    )
    return tuple(zip(one, two, strict=True))
