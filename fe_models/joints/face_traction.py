"""Traction on a contact face as a field, to load other meshes of the same bodies."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator
from scipy.sparse.linalg import spsolve

from fe_models.elasticity.body import ElasticBody
from fe_models.meshes.structure_mesh import Interface
from sa_solver.types import Array

# Degree up to which the traction is integrated over an element's facet. It is linear on facets
# several times as small, which no degree integrates exactly.
DEGREE = 8


@dataclass(frozen=True)
class FaceTraction:
    """Traction on body 2 at an ``interface``, linear between its nodes; body 1 has the opposite.

    Attributes
    ----------
    interface
        The contact face.
    nodal
        Traction at its nodes ``(k, 3, n)`` [MPa] in the frame of the interface, in ``k`` states.

    Examples
    --------
    A block that 3 MPa press over 1 mm² is loaded on a finer mesh with the same force:

    >>> import numpy as np
    >>> from skfem import MeshTet
    >>> from fe_models import Body, ElasticBody
    >>> from fe_models.joints.face_traction import FaceTraction
    >>> from fe_models.meshes.structure_mesh import matched_interface
    >>> from sa_solver import Frame, Material
    >>> mesh = MeshTet().refined(1).with_boundaries({"contact": lambda x: x[2] == 0.0})
    >>> upper, lower = Body("upper", mesh), Body("lower", mesh.mirrored((0.0, 0.0, 1.0)))
    >>> frame = Frame(np.zeros(3), np.eye(3))
    >>> face = matched_interface("contact", lower, upper, "contact", frame)
    >>> pressed = np.zeros((1, 3, len(face)))
    >>> pressed[0, 2] = 3.0 * face.nodal_areas
    >>> fine = MeshTet().refined(2).with_boundaries({"contact": lambda x: x[2] == 0.0})
    >>> block = ElasticBody(Body("upper", fine), Material(210e3, 0.3), 2)
    >>> load = FaceTraction.of(face, pressed).load(block, 2, whole=True)
    >>> print(load.reshape(-1, 3, 1).sum(axis=0).ravel().round(9))
    [0. 0. 3.]
    """

    interface: Interface
    nodal: Array

    @classmethod
    def of(cls, interface: Interface, forces: Array) -> FaceTraction:
        """Return the traction of nodal forces on body 2 ``(k, 3, n)`` [N].

        Forces of a face that is not weighted are tractions times areas. The linear traction between
        these has moments that differ from those of the forces, less the finer the mesh. A traction
        that is linear over the whole face takes the difference off.
        """
        products = _products(interface)
        if interface.weighted:
            rows = forces.reshape(-1, len(interface))
            solved = spsolve(products, rows.T).reshape(len(interface), -1)
            return cls(interface, np.asarray(solved.T.reshape(forces.shape)))
        areas = interface.nodal_areas
        nodal = np.divide(forces, areas, out=np.zeros_like(forces), where=areas > 0.0)
        terms = _terms(interface, *interface.coordinates.T)
        weights = products @ terms.T
        missing = forces @ terms.T - nodal @ weights
        return cls(interface, nodal + _linear(missing, terms @ weights) @ terms)

    def smoothed(self, axis: int) -> FaceTraction:
        """Return the traction smoothed along an ``axis`` of the frame, 0 or 1.

        It changes by its second derivative times the squared length of the facets over six, which
        is what the mean over a node's function changes it by. Forces and moments stay.
        """
        interface = self.interface
        places = interface.coordinates[interface.facets]
        if interface.line:
            length = np.diff(places[:, :, 0], axis=1)
            slopes = np.array([-1.0, 1.0]) / length
        else:
            edges = np.linalg.inv(places[:, 1:] - places[:, :1])[:, axis]
            slopes = np.column_stack([-edges.sum(axis=1), edges])
        spread = interface.facet_sizes * np.ptp(places[:, :, axis], axis=1) ** 2 / 6.0
        values = spread[:, None, None] * slopes[:, :, None] * slopes[:, None, :]
        stiffness = _assembled(interface, values)
        terms = _terms(interface, *interface.coordinates.T)
        products = _products(interface)
        areas = np.asarray(products.sum(axis=0)).ravel()
        change = -np.stack([(stiffness @ of.T).T / areas for of in self.nodal])
        weights = products @ terms.T
        shares = _linear(change @ weights, terms @ weights)
        return FaceTraction(interface, self.nodal + change - shares @ terms)

    def with_smoothed(self) -> FaceTraction:
        """Return the traction with further states: all smoothed along each axis of the face."""
        axes = (0,) if self.interface.line else (0, 1)
        parts = [self.nodal, *(self.smoothed(axis).nodal for axis in axes)]
        return FaceTraction(self.interface, np.concatenate(parts))

    def at(self, x: Array, y: Array) -> Array:
        """Return the traction ``(k, 3, p)`` [MPa] at places ``(p,)`` of the frame [mm].

        Beyond the face it is that of the closest node.
        """
        if self.interface.line:
            order = np.argsort(self.interface.coordinates[:, 0])
            along = self.interface.coordinates[order, 0]
            found = np.array([np.interp(x, along, row) for row in self._rows[order].T])
        else:
            places = np.stack([x, y], axis=1)
            linear, nearest = self._interpolators
            found = linear(places)
            beyond = np.isnan(found[:, 0])
            if beyond.any():
                found[beyond] = nearest(places[beyond])
            found = found.T
        return np.asarray(found.reshape(*self.nodal.shape[:2], len(x)))

    @cached_property
    def _rows(self) -> Array:
        """Traction at the nodes ``(n, 3 k)``."""
        return self.nodal.reshape(-1, len(self.interface)).T

    @cached_property
    def _interpolators(self) -> tuple[LinearNDInterpolator, NearestNDInterpolator]:
        """Interpolators over the face, linear between the nodes and of the closest one."""
        places = self.interface.coordinates
        return LinearNDInterpolator(places, self._rows), NearestNDInterpolator(places, self._rows)

    def load(self, elastic: ElasticBody, number: int, whole: bool) -> Array:
        """Return nodal forces ``(size, k)`` of the traction on body ``number``, 1 or 2.

        The body has a boundary with the name of the interface, which is the ``whole`` face or a
        part of it. For ``whole`` see :meth:`on_points`.
        """
        points, areas, weights = elastic.facet_rule(self.interface.name, DEGREE)
        traction = self.on_points(points, areas, number, whole)[:, list(elastic.body.axes)]
        nodal = [(weights @ of_state.T).ravel() for of_state in traction]
        return np.stack(nodal, axis=1)

    def on_points(self, points: Array, areas: Array, number: int, whole: bool) -> Array:
        """Return the traction ``(k, 3, p)`` [MPa] on body ``number``, along the global axes.

        If the ``points`` ``(3, p)`` with their ``areas`` ``(p,)`` are those of the ``whole`` face,
        a traction linear over the face is added, so that force and moments are those of the field,
        however coarse the points are.
        """
        frame = self.interface.frame
        x, y, _ = frame.axes @ (points - frame.origin[:, None])
        traction = self.at(x, y)
        if whole:
            terms = _terms(self.interface, x, y)
            at_nodes = _terms(self.interface, *self.interface.coordinates.T)
            exact = self.nodal @ (_products(self.interface) @ at_nodes.T)
            missing = exact - (traction * areas) @ terms.T
            traction = traction + _linear(missing, (terms * areas) @ terms.T) @ terms
        sign = 1.0 if number == 2 else -1.0
        return np.asarray(sign * np.einsum("ab,map->mbp", frame.axes, traction))


def _terms(interface: Interface, x: Array, y: Array) -> Array:
    """Return the linear functions 1, x and y ``(3, p)``; a line contact has no y."""
    return np.array([np.ones_like(x), x] if interface.line else [np.ones_like(x), x, y])


def _linear(moments: Array, products: Array) -> Array:
    """Return the factors of the terms whose sum has these ``moments`` ``(..., 3)``.

    ``products`` are the integrals of products of the terms.
    """
    return np.asarray(np.linalg.solve(products, moments[..., None])[..., 0])


def _products(interface: Interface) -> sp.csc_matrix:
    """Return ∫ φ_i φ_k dA of the linear functions of the nodes ``(n, n)`` [mm²]."""
    corners = interface.facets.shape[1]
    shares = (1.0 + np.eye(corners)) / (corners * (corners + 1))
    return _assembled(interface, interface.facet_sizes[:, None, None] * shares)


def _assembled(interface: Interface, values: Array) -> sp.csc_matrix:
    """Return the sum ``(n, n)`` of matrices ``(m, corners, corners)`` of the facets."""
    rows = np.broadcast_to(interface.facets[:, :, None], values.shape)
    columns = np.broadcast_to(interface.facets[:, None, :], values.shape)
    places = rows.ravel(), columns.ravel()
    return sp.csc_matrix((values.ravel(), places), shape=(len(interface),) * 2)
