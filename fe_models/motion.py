"""Displacements of all bodies of a structure, from what its contact says.

A body that supports hold answers to its contact forces. One that only follows such bodies, as
body 2 of all its interfaces, has their displacements and the relative ones at its faces. Any other
answers to its forces but for rigid motions, which make it meet its neighbours at the relative
displacements, by least squares over all interfaces.
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
    """How a structure moves over the increments of a cycle.

    ``displacements`` ``(size, k)`` [mm] are those of each body in the increments asked for, and
    ``faces`` ``(t, 3, n)`` [mm] those of body 1 and body 2 in all of them, by interface, in the
    frame and at the nodes of that.
    """

    displacements: tuple[Array, ...]
    faces: tuple[tuple[Array, Array], ...]


def deformation(
    structure: Structure, force: Array, relative: Array, amplitudes: Array
) -> tuple[Array, ...]:
    """All displacements of each body ``(size,)`` [mm].

    ``force`` ``(3, n)`` on body 2 and ``relative`` displacement ``(3, n)`` are over all interfaces,
    in their frames; ``amplitudes`` those of the load cases.
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
    """Displacements in some ``increments``, and of the faces in all.

    ``force`` ``(t, 3, n)``, ``relative`` ``(t, 3, n)`` and ``amplitudes`` ``(t, cases)`` as in
    :func:`deformation`.
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
    """Bodies that are body 2 of all their interfaces, on bodies that supports hold."""
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
    """All displacements ``(size, t)`` of the bodies that do not follow, by number.

    What their faces do is put into ``moved`` ``(places, t)``.
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
    for (number, _, on_faces), own in zip(rigid, columns, strict=True):
        free[structure.places[number], own] = on_faces
    known = _known(structure, followers)
    missing, by_motion = apart - _relative(structure, moved), _relative(structure, free)
    shares = np.linalg.lstsq(by_motion[known], missing[known], rcond=None)[0]
    moved += free @ shares
    for (number, everywhere, _), own in zip(rigid, columns, strict=True):
        found[number] += everywhere @ shares[own]
    return found


def _relative(structure: Structure, moved: Array) -> Array:
    """Relative displacements ``(d n, ...)`` of those of all faces ``(places, ...)``."""
    count = len(structure.held[0])
    return moved[count:] - structure.carried(moved[:count])


def _known(structure: Structure, followers: set[int]) -> np.ndarray:
    """Which relative displacements ``(d n,)`` are of interfaces between two that do not follow."""
    interfaces = structure.mesh.interfaces
    both = [not followers.intersection(interface.bodies) for interface in interfaces]
    return np.repeat(both, [structure.dimension * len(interface) for interface in interfaces])


def _by_interface(
    structure: Structure, under: Array, above: Array
) -> tuple[tuple[Array, Array], ...]:
    """Motions ``(t, 3, n)`` of body 1 and body 2 at the nodes of each interface."""
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
