"""Linear elasticity of one body with scikit-fem: stiffness, loads, stress."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from skfem import (
    Basis,
    BilinearForm,
    Element,
    ElementTetP1,
    ElementTetP2,
    ElementTriP1,
    ElementTriP2,
    FacetBasis,
    LinearForm,
)
from skfem.helpers import grad

from fe_models.meshes.halving import moments_on_halves
from fe_models.meshes.isoparametric import INTEGRATED, facet_normals, mapping_of
from fe_models.meshes.structure_mesh import Body, in_space, mesh_edges
from sa_solver.errors import InputError
from sa_solver.half_space.stress import principal_stresses
from sa_solver.half_space.subsurface_influence import INDICES
from sa_solver.types import Array, Indices, Material

# Direction of the rotor axis, the global Y, and the origin that it goes through.
ROTOR, ORIGIN = np.array([0.0, 1.0, 0.0]), np.zeros(3)
# Finite elements by dimension and order.
ELEMENTS = {
    (3, 1): ElementTetP1,
    (3, 2): ElementTetP2,
    (2, 1): ElementTriP1,
    (2, 2): ElementTriP2,
}


class ElasticBody:
    """Elastic body of one material, with displacements numbered ``dimension node + component``.

    Triangles are in plane strain; their forces are per length. Vertices are the first nodes; with
    elements of ``order`` 2 the midside nodes follow. Elements of order 2 are curved if the body has
    midside nodes (:mod:`fe_models.meshes.isoparametric`). If it has ``elements`` of second order,
    all nodes are vertices of its mesh.

    Attributes
    ----------
    node_order
        2 if midside nodes follow the vertices of the body's mesh, else 1.
    curved
        Whether midside nodes that follow the vertices are off the middles of their edges.

    Raises
    ------
    ValueError
        If a body with elements of second order is given another order.

    Examples
    --------
    A cube of 1 mm³ is stretched by ε in one direction only. Its stress, and the force on a face,
    are (λ + 2 G) ε.

    >>> import numpy as np
    >>> from skfem import MeshTet
    >>> from fe_models import Body, ElasticBody
    >>> from sa_solver import Material
    >>> steel = Material(young=210e3, poisson=0.3)
    >>> cube = ElasticBody(Body("cube", MeshTet().refined(1)), steel)
    >>> stretched = (1e-3 * cube.nodes * [0.0, 0.0, 1.0]).ravel()
    >>> exact = 1e-3 * (steel.lame + 2.0 * steel.shear_modulus)
    >>> forces = (cube.stiffness @ stretched).reshape(-1, 3)
    >>> force = forces[cube.nodes[:, 2] == 1.0, 2].sum()
    >>> print(f"{cube.stress(stretched)[2].mean():.3f} MPa, {force:.3f} N of {exact:.3f}")
    282.692 MPa, 282.692 N of 282.692
    """

    def __init__(self, body: Body, material: Material, order: int = 1) -> None:
        self.body = body
        self.material = material
        self.order = order
        if body.elements is not None and order != 2:
            raise ValueError(f"{body.name} has elements of second order, not of order {order}")
        if material.layers:
            raise InputError(
                f"{body.name} has layers, which its elements leave out: give its own material alone"
            )
        self.dimension = body.mesh.dim()
        self.node_order = order if body.elements is None else 1
        self.curved = self.node_order == 2 and body.midsides is not None
        # The body whose mesh has the elements, with boundaries of the same names.
        self._of = body if body.elements is None else body.elements
        self._mapped = order == 2 and self._of.midsides is not None
        self._element = ELEMENTS[self.dimension, order]
        self._basis = self.basis()

    def basis(self, degree: int | None = None) -> Basis:
        """Return the basis of the displacements, with quadrature exact up to a ``degree``.

        The degree holds on straight elements.
        """
        if not self._mapped:
            return Basis(self._of.mesh, self._element(), intorder=degree)
        mapping = mapping_of(self._of)
        intorder = max(INTEGRATED, degree or 0)
        basis = Basis(self._of.mesh, self._element(), mapping, intorder)
        # The cached Jacobians of all elements are not needed any more.
        vars(mapping).pop("_cache", None)
        return basis

    @property
    def nodes(self) -> Array:
        """Node coordinates in space ``(n, 3)`` [mm]; Y is 0 in the plane."""
        return in_space(self._basis.doflocs.T)

    @property
    def element_nodes(self) -> Indices:
        """Nodes of the elements of the body's mesh ``(k, elements)``, midside nodes included."""
        if self.body.elements is not None:
            return np.asarray(self.body.mesh.t)
        return np.asarray(self._basis.element_dofs)

    @property
    def size(self) -> int:
        """Number of displacements."""
        return int(self.dimension * self._basis.N)

    @cached_property
    def stiffness(self) -> sp.csr_matrix:
        """Stiffness matrix ``(size, size)`` [N/mm].

        Its blocks of two nodes are λ F + G Fᵀ + G tr(F) with F_ab = ∫ ∂a φi ∂b φj. Summing these by
        pairs of nodes takes a third of the time of scikit-fem's scalar forms, which take a tenth of
        the time of its vector form. The matrix has entries between all components of nodes that
        share an element, whatever the shape of the elements.
        """
        sums, d = _NodePairs(np.asarray(self._basis.element_dofs)), self.dimension
        gradients = [np.asarray(field.grad) for (field,) in self._basis.basis]
        weights = self._basis.dx
        if self.order == 1:
            # Gradients are constant in the element, so one point is enough.
            gradients = [gradient[..., :1] for gradient in gradients]
            weights = weights.sum(axis=1, keepdims=True)
        forms = np.empty((d, d, len(sums.columns)))
        for a, b in np.ndindex(d, d):
            weighted = [gradient[a] * weights for gradient in gradients]
            forms[a, b] = sums.of(
                [np.einsum("eq,eq->e", one, two[b]) for one in weighted for two in gradients]
            )
        lame, shear = self.material.lame, self.material.shear_modulus
        blocks = lame * forms + shear * forms.swapaxes(0, 1)
        blocks[range(d), range(d)] += shear * np.trace(forms)
        by_pair = np.ascontiguousarray(np.moveaxis(blocks, -1, 0))
        return sp.bsr_matrix((by_pair, sums.columns, sums.pointers), (self.size,) * 2).tocsr()

    @cached_property
    def mass(self) -> sp.csr_matrix:
        """Consistent mass matrix ``(size, size)`` [t]."""
        scalar = BilinearForm(lambda u, v, w: u * v).assemble(self._basis)
        identity = sp.identity(self.dimension)
        return sp.kron(self.material.density * scalar, identity, format="csr")

    def body_load(self, force: Callable[[Array], Array]) -> Array:
        """Return forces ``(size,)`` of a force per volume [N/mm³].

        ``force`` maps points ``(3, ...)`` to values ``(3, ...)``.
        """
        points = _spatial(np.asarray(self._basis.global_coordinates()))
        density = force(points)
        forms = [
            LinearForm(lambda v, w: w.f * v).assemble(self._basis, f=density[axis])
            for axis in self.body.axes
        ]
        return np.stack(forms, axis=1).ravel()

    def centrifugal_load(self, axis: Array = ROTOR, through: Array = ORIGIN) -> Array:
        """Return forces ``(size,)`` of 1 rad/s about a unit ``axis`` ``through`` a point [N s²]."""
        radial = self.material.density * (np.eye(3) - np.outer(axis, axis))
        return self.body_load(
            lambda x: np.einsum("ab,b...->a...", radial, x - through[:, None, None])
        )

    def traction_load(
        self, boundary: str, traction: Callable[[Array], Array], direction: Array
    ) -> Array:
        """Return forces ``(size,)`` of a traction on a named boundary.

        ``traction`` gives its magnitude at points ``(3, ...)`` [MPa], ``direction`` ``(3,)`` its
        direction.
        """
        basis = self._facet_basis(boundary)
        size = traction(_spatial(np.asarray(basis.global_coordinates())))
        load = LinearForm(lambda v, w: w.f * v).assemble(basis, f=size)
        return np.outer(load, direction[list(self.body.axes)]).ravel()

    def facet_rule(self, boundary: str, degree: int) -> tuple[Array, Array, sp.csr_matrix]:
        """Return integration points of a boundary ``(3, p)`` [mm], their areas, and nodal weights.

        The areas ``(p,)`` [mm²] integrate up to a ``degree``. The weights ``(nodes, p)`` [mm²] give
        nodal forces from tractions at the points.
        """
        basis = self._facet_basis(boundary, degree=degree)
        points = _spatial(np.asarray(basis.global_coordinates()))
        areas = np.asarray(basis.dx)
        places = np.arange(areas.size).reshape(areas.shape)
        values, rows, columns = [], [], []
        for nodes, (field,) in zip(basis.element_dofs, basis.basis, strict=True):
            values.append((np.asarray(field) * areas).ravel())
            rows.append(np.repeat(nodes, areas.shape[1]))
            columns.append(places.ravel())
        parts = (np.concatenate(part) for part in (values, rows, columns))
        value, row, column = parts
        shape = (len(self.nodes), areas.size)
        weights = sp.csr_matrix((value, (row, column)), shape=shape)
        return points.reshape(3, -1), areas.ravel(), weights

    def nodal_density_load(self, density: Array) -> Array:
        """Return forces ``(size,)`` of a force per volume, linear between the vertices.

        ``density`` is ``(vertices, 3)`` [N/mm³].
        """
        linear = self._vertex_basis
        form = LinearForm(lambda v, w: w.f * v)
        loads = [
            form.assemble(self._basis, f=linear.interpolate(density[:, axis]))
            for axis in self.body.axes
        ]
        return np.stack(loads, axis=1).ravel()

    def nodal_density(self, loads: Array) -> Array:
        """Return the force per volume ``(vertices, 3)`` [N/mm³] of nodal forces ``(size,)``.

        It is the mean of the forces over the elements at each vertex, so that forces on a surface
        are spread into the body. A constant force per volume is exact.
        """
        mesh = self.body.mesh
        nodal = loads.reshape(-1, self.dimension)
        forces = nodal[: mesh.nvertices].copy()
        if self.node_order == 2:
            # A linear function has half of its ends' values at a midside node.
            for end in mesh_edges(mesh).T:
                np.add.at(forces, end, 0.5 * nodal[mesh.nvertices :])
        linear = self._basis.with_element(ELEMENTS[self.dimension, 1]())
        volumes = LinearForm(lambda v, w: 1.0 * v).assemble(linear)
        return np.array(in_space(forces / volumes[:, None]))

    def thermal_load(self, strain: Array) -> Array:
        """Return forces ``(size,)`` of an expansion ``(vertices,)``, linear between the vertices.

        They are ∫ (3 λ + 2 G) θ div φ_i, in plane strain too (:mod:`fe_models.elasticity.thermal`).
        """
        pressure = 3.0 * self.material.lame + 2.0 * self.material.shear_modulus
        held = self._vertex_basis.interpolate(pressure * strain)
        forms = [
            LinearForm(lambda v, w, a=a: w.held * grad(v)[a]).assemble(self._basis, held=held)
            for a in range(self.dimension)
        ]
        return np.stack(forms, axis=1).ravel()

    def pressure_load(self, boundary: str) -> Array:
        """Return forces ``(size,)`` of a pressure of 1 MPa on a named boundary, into the body."""
        return -_normal_integrals(self._facet_basis(boundary)).ravel()

    def boundary_integral(self, boundary: str, integrand: Callable[[Array], Array]) -> float:
        """Return the integral over a named boundary of a function of points ``(3, ...)``."""
        points, areas = self.boundary_points(boundary)
        return float(np.sum(integrand(points) * areas))

    def boundary_points(self, boundary: str) -> tuple[Array, Array]:
        """Return integration points ``(3, p)`` [mm] of a named boundary and their areas."""
        basis = self._facet_basis(boundary)
        points = _spatial(np.asarray(basis.global_coordinates()))
        return points.reshape(3, -1), np.asarray(basis.dx).ravel()

    def boundary_weights(self, boundary: str) -> tuple[Indices, Array]:
        """Return the nodes of a boundary and the area of each, so that Σ w u = ∫ u dA."""
        weights = LinearForm(lambda v, w: 1.0 * v).assemble(self._facet_basis(boundary))
        nodes = self.boundary_nodes(boundary)
        return nodes, weights[nodes]

    def boundary_nodes(self, boundary: str) -> Indices:
        """Return the nodes on a named boundary, midside nodes included."""
        # scikit-fem's method for this would number the edges of the mesh, which takes a second.
        mesh = self.body.mesh
        vertices = np.unique(mesh.facets[:, mesh.boundaries[boundary]])
        return np.append(vertices, np.sort(self.midsides(boundary)[0]))

    def boundary_normals(
        self, boundary: str, whole: Callable[[Array], Array] = lambda integrals: integrals
    ) -> tuple[Indices, Array]:
        """Return the nodes of a boundary and the outward unit normal at each, ``(n, dimension)``.

        ``whole`` maps the integrals of normals ``(nodes, dimension)`` to those of a boundary that
        continues beyond the body, as in the next sector of a wheel. For straight elements only the
        vertices have integrals.
        """
        mesh = self.body.mesh
        normals = np.zeros((len(self.nodes), self.dimension))
        if self.curved:
            facets = mesh.boundaries[boundary]
            at_nodes = facet_normals(self.body, facets)[..., self.body.axes]
            np.add.at(normals, self.body.facet_nodes(facets), at_nodes)
            normals = whole(normals)
        else:
            linear = ELEMENTS[self.dimension, 1]()
            basis = FacetBasis(mesh, linear, facets=mesh.boundaries[boundary])
            normals[: mesh.nvertices] = _normal_integrals(basis)
            normals = whole(normals)
            middle, parents = self.midsides(boundary)
            normals[middle] = normals[parents].sum(axis=1)
        nodes = self.boundary_nodes(boundary)
        return nodes, normals[nodes] / np.linalg.norm(normals[nodes], axis=1, keepdims=True)

    def facet_nodes(self, facets: Indices) -> Indices:
        """Return the nodes of facets by their numbers, ``(m, k)``: corners, then midside nodes.

        The midside nodes are those between corners 0 and 1, in space also 1 and 2, and 2 and 0.
        """
        mesh = self.body.mesh
        corners: Indices = mesh.facets[:, facets].T
        if self.node_order == 1:
            return corners
        if self.dimension == 2:
            return np.column_stack([corners, self._basis.facet_dofs[0, facets]])
        edges = mesh.f2e[:, facets].T
        ends = mesh.edges[:, edges]
        middles = []
        for opposite in (2, 0, 1):
            away = np.all(ends != corners[None, :, opposite, None], axis=0)
            middles.append(self._basis.edge_dofs[0, edges[away]])
        return np.column_stack([corners, *middles])

    def midsides(self, boundary: str) -> tuple[Indices, Indices]:
        """Return a boundary's midside nodes ``(n,)`` and the ends of their edges ``(n, 2)``."""
        if self.node_order == 1:
            return np.empty(0, np.int64), np.empty((0, 2), np.int64)
        mesh = self.body.mesh
        facets = mesh.boundaries[boundary]
        if self.dimension == 2:
            return self._basis.facet_dofs[0, facets], mesh.facets[:, facets].T
        edges = np.unique(mesh.f2e[:, facets])
        return self._basis.edge_dofs[0, edges], mesh.edges[:, edges].T

    def linear_moments(
        self, boundary: str, vertices: Indices
    ) -> tuple[sp.csr_matrix, sp.csr_matrix]:
        """Return ∫ φ_i φ_k dA and ∫ φ_i N_j dA, φ linear and N the elements' functions [mm²].

        They are integrated over the facets of a boundary whose corners are all among ``vertices``
        ``(m,)``. The matrices are ``(v, v)`` for all vertices and ``(v, n)`` for all vertices and
        nodes.
        """
        mesh = self._of.mesh
        facets = np.asarray(mesh.boundaries[boundary])
        facets = facets[np.isin(mesh.facets[:, facets], vertices).all(axis=0)]
        if self.body.elements is not None:
            return moments_on_halves(self._of, facets)
        linear = ELEMENTS[self.dimension, 1]()
        # The degree makes products of linear functions and the elements' functions exact.
        tests, trials = (
            self._facet_basis(facets, element, 1 + self.order)
            for element in (linear, self._element())
        )
        product = BilinearForm(lambda u, v, w: u * v)
        return product.assemble(tests).tocsr(), product.assemble(trials, tests).tocsr()

    @property
    def _vertex_basis(self) -> Basis:
        """Basis of fields with values at the vertices of the body's mesh."""
        if self.body.elements is not None:
            return self._basis
        return self._basis.with_element(ELEMENTS[self.dimension, 1]())

    def stress(self, displacement: Array) -> Array:
        """Return the mean Cauchy stress of each element ``(6, elements)`` [MPa].

        ``displacement`` is ``(size,)``. Components are ordered xx, yy, zz, xy, yz, zx of the global
        axes.
        """
        weights = self._basis.dx / self._basis.dx.sum(axis=1, keepdims=True)
        gradient = np.zeros((3, 3, weights.shape[0]))
        for u, axis in zip(displacement.reshape(-1, self.dimension).T, self.body.axes, strict=True):
            field = np.asarray(self._basis.interpolate(u).grad)
            gradient[axis, list(self.body.axes)] = np.einsum("aeq,eq->ae", field, weights)
        return self.cauchy(gradient)

    def cauchy(self, gradient: Array) -> Array:
        """Return the Cauchy stress ``(6, n)`` [MPa] of gradients ∂u_a/∂x_b ``(3, 3, n)``."""
        strain = 0.5 * (gradient + gradient.transpose(1, 0, 2))
        trace = strain[0, 0] + strain[1, 1] + strain[2, 2]
        lame, shear = self.material.lame, self.material.shear_modulus
        return components(lame * trace * np.eye(3)[:, :, None] + 2.0 * shear * strain)

    def _facet_basis(
        self,
        boundary: str | Indices,
        element: Element | None = None,
        degree: int | None = None,
    ) -> FacetBasis:
        """Return the basis on a boundary, given by name or facets.

        It is that of the displacements unless another ``element`` is given.
        """
        mesh, mapping = self._of.mesh, None
        if self._mapped:
            mapping, degree = mapping_of(self._of), max(INTEGRATED, degree or 0)
        facets = mesh.boundaries[boundary] if isinstance(boundary, str) else boundary
        return FacetBasis(mesh, element or self._element(), mapping, degree, facets=facets)


class _NodePairs:
    """Pairs of nodes that share an element, in row order, with sums over the elements of each pair.

    ``nodes`` are those of the elements ``(k, m)``. ``columns`` and ``pointers`` are those of a
    sparse matrix in which every node has a row.
    """

    def __init__(self, nodes: Indices) -> None:
        k, elements = nodes.shape
        size = int(nodes.max()) + 1
        pairs = (nodes.astype(np.int64)[:, None] * size + nodes).ravel()
        order = np.argsort(pairs, kind="stable")
        ordered = pairs[order]
        first = np.flatnonzero(np.diff(ordered, prepend=-1))
        rows, self.columns = np.divmod(ordered[first], size)
        self.pointers = np.searchsorted(rows, np.arange(size + 1))
        added = np.ones(len(order)), order, np.append(first, len(order))
        self._sum = sp.csr_matrix(added, shape=(len(first), k * k * elements))

    def of(self, values: Sequence[Array]) -> Array:
        """Return sums ``(pairs,)`` of ``k²`` arrays ``(m,)``, one per pair of element nodes."""
        return np.asarray(self._sum @ np.concatenate(values))


def _normal_integrals(basis: FacetBasis) -> Array:
    """Return ∫ n φi dA ``(nodes, dimension)`` over the facets of a basis, n the outward normal."""
    forms = [
        LinearForm(lambda v, w, axis=axis: w.n[axis] * v).assemble(basis)
        for axis in range(basis.mesh.dim())
    ]
    return np.stack(forms, axis=1)


def _spatial(points: Array) -> Array:
    """Return points ``(3, ...)`` from those of scikit-fem ``(dimension, ...)``."""
    return np.moveaxis(in_space(np.moveaxis(points, 0, -1)), -1, 0)


def maximum_principal(stress: Array) -> Array:
    """Return the largest principal stress of components ``(6, ...)``."""
    return principal_stresses(stress)[0]


def tensors(stress: Array) -> Array:
    """Return tensors ``(3, 3, n)`` of components ``(6, n)``."""
    xx, yy, zz, xy, yz, zx = stress
    return np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])


def components(tensors: Array) -> Array:
    """Return components ``(6, n)`` of symmetric tensors ``(3, 3, n)``."""
    return tensors[tuple(np.transpose(INDICES))]
