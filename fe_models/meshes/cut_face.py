"""Contact faces that are cut by planes of symmetry, and the whole faces that they are a part of.

A half-space has no boundary beside the contact, so its contact must be that of the whole face. A
plane on which the normal displacements of both bodies are held, and on which nothing else acts, is
a mirror. With S the reflection across it, displacements, slips and forces on the other side are
u(Sx) = S u(x), and tensors are σ(Sx) = S σ S. Components along the plane's normal are odd, the
others even. Of the resultants about a point of the plane, the shear along the normal and the
moments of odd components therefore vanish, and the others are twice those of the part. A node on
the plane has the forces of both sides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from fe_models.elasticity.stress import StressField
from fe_models.interface_frames import ALONG_AXIS
from fe_models.meshes.structure_mesh import Body, Face, Interface
from fe_models.structure import InterfaceHistory
from sa_solver.load_history import LoadHistory
from sa_solver.types import Array, Frame, Indices, Mask

# Distance, as a share of the largest coordinate, up to which a vertex counts as on a plane: mesh
# files store six digits.
ON_PLANE = 2e-6
# Signs of P, Qx, Qy, Mx, My and Mz under a reflection across an axis x or y.
PARITY = {0: (1.0, -1.0, 1.0, 1.0, -1.0, -1.0), 1: (1.0, 1.0, -1.0, -1.0, 1.0, -1.0)}


def cut_interface(
    interface: Interface, bodies: Sequence[Body], supports: Sequence[sp.csr_matrix]
) -> Interface:
    """Return the interface with its planes of symmetry, or unchanged if it has none.

    The origin of its frame is moved onto the planes. A plane normal to an axis of the frame is one
    of symmetry if neither body extends beyond it, if all their vertices on it are held along its
    normal, and if no other vertices of body 2's face are. If supports hold that face in any other
    way, there is no plane of symmetry.

    Parameters
    ----------
    interface
        The interface.
    bodies
        The two bodies that meet in it.
    supports
        For each body, the matrix from its free displacements to those of its vertices ``(d n,
        ...)``.
    """
    planes, origin = [], interface.frame.origin
    for axis in (0,) if interface.line else (0, 1):
        normal = interface.frame.axes[axis]
        held = [
            _held_along(normal[list(body.axes)], displacements)
            for body, displacements in zip(bodies, supports, strict=True)
        ]
        on_face = held[1][interface.nodes_2]
        if not on_face.any():
            continue
        levels = [body.points @ normal for body in bodies]
        plane = float(levels[1][interface.nodes_2][on_face].mean())
        if not _is_mirror(plane, levels, held, _rounding(bodies), interface.nodes_2):
            return interface
        planes.append(axis)
        origin = origin + (plane - origin @ normal) * normal
    if not planes:
        return interface
    rounding, face_1 = _rounding(bodies), interface.face_1
    frame, coordinates = _about(interface, origin, planes, rounding)
    if face_1 is not None:
        face_1 = replace(
            face_1, frame=frame, coordinates=_about(face_1, origin, planes, rounding)[1]
        )
    return replace(
        interface, planes=tuple(planes), frame=frame, coordinates=coordinates, face_1=face_1
    )


@dataclass(frozen=True)
class WholeFace(Face):
    """Whole face, of which planes of symmetry leave a ``part``, whose nodes come first.

    ``nodes`` ``(N,)`` are the nodes of the part of which the nodes of the whole are images,
    ``signs`` ``(3, N)`` the signs of the components there, and ``sides`` ``(N,)`` the number of
    images that meet in a node.
    """

    part: Interface
    nodes: Indices
    signs: Array
    sides: Array

    @property
    def nodal_areas(self) -> Array:
        if self.part.areas is None:
            return self.facet_shares
        areas: Array = self.sides * self.part.areas[self.nodes]
        return areas

    def face(self, number: int) -> Face:
        other = self.part.face(number)
        if other is self.part:
            return self
        coordinates, facets, nodes, *_ = _mirrored(other, self.part.planes)
        surface = other.surface and other.surface.mirrored(nodes, len(facets))
        return replace(other, coordinates=coordinates, facets=facets, surface=surface)

    def components(self, part: Array) -> Array:
        """Return components ``(..., c, N)`` of the whole from those ``part`` of its part.

        They are along x, y and maybe z.
        """
        return np.ascontiguousarray(part[..., self.nodes] * self.signs[: part.shape[-2]])


def whole_face(interface: Interface) -> Face:
    """Return the whole face of an interface, or the interface itself if no plane cuts it."""
    if not interface.planes:
        return interface
    coordinates, facets, nodes, signs, sides = _mirrored(interface, interface.planes)
    name, frame, weighted = interface.name, interface.frame, interface.weighted
    surface = interface.surface and interface.surface.mirrored(nodes, len(facets))
    return WholeFace(
        *(name, frame, coordinates, facets, interface, nodes, signs, sides),
        weighted=weighted,
        surface=surface,
    )


def whole_values(interface: Interface, part: Array) -> Array:
    """Return values ``(..., N)`` at the nodes of the whole face from those of the part's."""
    face = whole_face(interface)
    return np.ascontiguousarray(part[..., face.nodes]) if isinstance(face, WholeFace) else part


def whole_components(interface: Interface, part: Array) -> Array:
    """Return components ``(..., c, N)`` at the nodes of the whole face from those of the part's."""
    face = whole_face(interface)
    return face.components(part) if isinstance(face, WholeFace) else part


def whole_history(history: InterfaceHistory) -> InterfaceHistory:
    """Return the history of the whole face from that of the part."""
    interface = history.interface
    face = whole_face(interface) if isinstance(interface, Interface) else interface
    if not isinstance(face, WholeFace):
        return history
    force, displacement, slip = map(
        face.components, (history.force, history.displacement, history.slip)
    )
    loads = _whole_loads(face.part, history.loads)
    return InterfaceHistory(face, loads, face.sides * force, displacement, slip)


def whole_resultants(interface: Interface, resultants: Array) -> Array:
    """Return ``(P, Qx, Qy, Mx, My, Mz)`` ``(..., 6)`` of the whole face from those of the part."""
    whole = resultants
    for axis in interface.planes:
        whole = whole * (1.0 + np.array(PARITY[axis]))
    return whole


@dataclass(frozen=True)
class WholeStress:
    """Stress under the whole face, from the ``field`` of a body that is meshed in ``part``."""

    field: StressField
    part: Interface

    @property
    def body(self) -> Body:
        return self.field.body

    def at(self, points: Array, frame: Frame) -> Array:
        """Return the stress as :meth:`StressField.at`, on both sides of the planes."""
        points, signs = points.copy(), np.ones((3, len(points)))
        for axis in self.part.planes:
            side = np.sign(self.part.coordinates[:, axis].sum())
            signs[axis] = np.where(side * points[:, axis] < 0.0, -1.0, 1.0)
            points[:, axis] *= signs[axis]
        x, y, z = signs
        parity = np.stack([x * x, y * y, z * z, x * y, y * z, z * x])
        return np.asarray(parity * self.field.at(points, frame))


def _mirrored(face: Face, planes: Sequence[int]) -> tuple[Array, Indices, Indices, Array, Array]:
    """Return coordinates and facets of the whole of a face, and nodes, signs and sides.

    The last three are those of :class:`WholeFace`.
    """
    coordinates, facets = face.coordinates, face.facets
    nodes, signs, sides = np.arange(len(face)), np.ones((3, len(face))), np.ones(len(face))
    for axis in planes:
        turned = np.ones(3)
        turned[axis] = -1.0
        off, on_plane = np.flatnonzero(coordinates[:, axis]), coordinates[:, axis] == 0.0
        image = np.arange(len(coordinates))
        image[off] = len(coordinates) + np.arange(len(off))
        # Reflection reverses the orientation of facets, so their corners are listed in reverse.
        facets = np.concatenate([facets, image[facets][:, ::-1]])
        sides = np.where(on_plane, 2.0, 1.0) * sides
        signs[axis, on_plane] = 0.0  # If faces do not match, one side alone gives a value here.
        coordinates = np.concatenate([coordinates, coordinates[off] * turned[:2]])
        nodes, sides = np.append(nodes, nodes[off]), np.append(sides, sides[off])
        signs = np.concatenate([signs, signs[:, off] * turned[:, None]], axis=1)
    return coordinates, facets, nodes, signs, sides


def _held_along(normal: Array, displacements: sp.csr_matrix) -> Mask:
    """Return flags of vertices whose displacements along a ``normal`` ``(d,)`` are held."""
    count = displacements.shape[0] // len(normal)
    along = sp.kron(sp.identity(count), normal[None], format="csr") @ displacements
    return np.asarray(spl.norm(along, axis=1) <= ALONG_AXIS)


def _is_mirror(
    plane: float, levels: Sequence[Array], held: Sequence[Mask], rounding: float, nodes_2: Indices
) -> bool:
    """Return whether a plane at a level is one of symmetry, from the levels of all vertices.

    ``levels`` and ``held`` are those of both bodies' vertices, ``nodes_2`` the nodes of body 2's
    face.
    """
    heights = [level - plane for level in levels]
    on_plane = [np.abs(height) <= rounding for height in heights]
    all_heights = np.concatenate(heights)
    one_sided = np.all(all_heights >= -rounding) or np.all(all_heights <= rounding)
    all_held = all(mask[on].all() for mask, on in zip(held, on_plane, strict=True))
    elsewhere = held[1][nodes_2] & ~on_plane[1][nodes_2]
    return bool(one_sided and all_held and not elsewhere.any())


def _rounding(bodies: Sequence[Body]) -> float:
    """Return the distance up to which vertices of a plane may lie off it [mm]."""
    return ON_PLANE * max(float(np.abs(body.points).max()) for body in bodies)


def _about(
    face: Face, origin: Array, planes: Sequence[int], rounding: float
) -> tuple[Frame, Array]:
    """Return frame and coordinates of a face about an origin on ``planes``.

    Nodes on these planes have the coordinate 0.
    """
    coordinates = face.coordinates - face.frame.components(origin - face.frame.origin)[:2]
    for axis in planes:
        coordinates[np.abs(coordinates[:, axis]) <= rounding, axis] = 0.0
    return Frame(origin, face.frame.axes), coordinates


def _whole_loads(interface: Interface, loads: LoadHistory) -> LoadHistory:
    columns = whole_resultants(interface, loads.resultants).T
    P, Qx, Qy, Mx, My, Mz = map(np.ascontiguousarray, columns)
    both = 2.0 ** len(interface.planes)
    Edx, Edy = both * loads.Edx, both * loads.Edy
    return replace(loads, P=P, Qx=Qx, Qy=Qy, Mx=Mx, My=My, Mz=Mz, Edx=Edx, Edy=Edy)
