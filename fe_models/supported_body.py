"""Supported, loaded body condensed onto its interface nodes: S u = r + f."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, partial

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from fe_models.cyclic.cuts import Cuts
from fe_models.cyclic.recovery import SectorRecovery
from fe_models.elasticity.body import ElasticBody
from fe_models.elasticity.recovery import StressRecovery
from fe_models.interface_frames import frame_rotation, interface_displacements
from fe_models.joints.condensation import Condensed, Keep, condense_body, made_anew, renamed
from fe_models.joints.sparse_joint import SparseBody
from fe_models.loads.constraints import Constraints
from fe_models.loads.rigid_motions import rigid_body_modes, rigid_motions
from fe_models.meshes.structure_mesh import Body, Interface
from fe_models.meshes.trace import LinearTrace
from fe_models.solvers.linear_solver import prepare
from fe_models.solvers.symmetry import Mirror, halves, mirror_of_nodes
from sa_solver.types import Array, Indices

# A rigid motion is free if supports change it by less than this share.
FREE_MOTION = 1e-9


class SupportedBody:
    """Supported body whose interface displacements are in the interface frames.

    Without ``trace`` the interface displacements are those of the vertices, and the face moves
    linearly between them. With a trace, a face of second-order elements deforms as these do, and
    the interface displacements are those of the closest linear field (:class:`LinearTrace`).

    Parameters
    ----------
    elastic
        The elastic body, of dimension d.
    constraints
        Constraints that its supports impose.
    nodes
        Interface vertices ``(n,)``.
    frames
        Axes at each interface vertex ``(n, d, d)``.
    loads
        Load cases ``(d all, cases)``, which include the forces due to ``thermal`` and ``jumps``.
    imposed
        Displacements ``(d all, cases)`` that each load case imposes on nodes held by
        ``constraints``.
    loaded
        Boundaries on which tractions act.
    trace
        Linear trace of the interface.
    thermal
        Thermal expansion of the vertices ``(vertices, cases)``.
    cuts
        Cyclic cuts of the body.
    jumps
        Displacements ``(d all, cases)`` of a part of the body that cause no strain
        (:mod:`fe_models.loads.pretension`).
    own
        Part of the loads ``(d all, cases)`` that does not act from outside.

    Attributes
    ----------
    held
        Flags ``(d n,)`` of the interface displacements that are held at zero, as on a plane of
        symmetry.

    Raises
    ------
    ValueError
        If displacements of an interface node are constrained in any other way than held at zero.

    Examples
    --------
    A plane square of 1 mm slides on its foot and is pulled by 210 MPa. In plane strain its end
    moves by σ (1 - ν²) / E.

    >>> import numpy as np
    >>> from skfem import MeshTri
    >>> from fe_models import Body, Constraints, ElasticBody, SupportedBody
    >>> from sa_solver import Material
    >>> ends = {"end": lambda x: x[1] == 1.0, "foot": lambda x: x[1] == 0.0}
    >>> elastic = ElasticBody(Body("strip", MeshTri().with_boundaries(ends)), Material(210e3, 0.3))
    >>> foot, end = elastic.boundary_nodes("foot"), elastic.boundary_nodes("end")
    >>> constraints = Constraints(len(elastic.nodes), 2)
    >>> constraints.slide(foot, np.array([[0.0, 1.0], [0.0, 1.0]]))
    >>> constraints.slide(foot[:1], np.array([[1.0, 0.0]]))
    >>> pull = -elastic.pressure_load("end")[:, None]
    >>> strip = SupportedBody(elastic, constraints, end, np.tile(np.eye(2), (2, 1, 1)), pull)
    >>> _, moved = strip.respond(np.zeros(4), np.array([210.0]))
    >>> print(moved[1::2].round(9), "mm of", round(210.0 * (1.0 - 0.3**2) / 210e3, 9))
    [0.00091 0.00091] mm of 0.00091
    """

    def __init__(
        self,
        elastic: ElasticBody,
        constraints: Constraints,
        nodes: Indices,
        frames: Array,
        loads: Array,
        imposed: Array | None = None,
        loaded: Sequence[str] = (),
        trace: LinearTrace | None = None,
        thermal: Array | None = None,
        cuts: Sequence[Cuts] = (),
        jumps: Array | None = None,
        own: Array | None = None,
    ) -> None:
        self.elastic = elastic
        self._jumps = jumps
        self._own = np.zeros_like(loads) if own is None else own
        self._thermal = thermal
        self.cuts = cuts
        self.loads = loads
        self.loaded = loaded
        self.nodes = nodes
        self.trace = trace
        self._frames = frames
        self.imposed = imposed
        self.constraints = constraints
        if imposed is not None and imposed[self._dofs(nodes)].any():
            raise ValueError("a displacement is imposed on nodes of a contact face")
        self._supports = transformation = constraints.transformation()
        rows = transformation[self._dofs(nodes)]
        self.held, self._interface, blocks = interface_displacements(rows, frames)
        self._free = np.flatnonzero(~self.held)
        if trace is None:
            rotation = frame_rotation(transformation.shape[1], self._interface, blocks)
            self._transformation = (transformation @ rotation).tocsr()
            self._springs = None
        else:
            free, count = transformation.shape[1], len(self._free)
            self._interface = free + np.arange(count)
            self._transformation = sp.hstack(
                [transformation, sp.csr_matrix((elastic.size, count))], format="csr"
            )
            self._springs = trace.springs(elastic, frames, self._free)

    def condense(
        self, done: Callable[[], None] = lambda: None, keep: Keep = made_anew
    ) -> Condensed:
        """Return stiffness ``(k, k)`` and loads ``(k, cases)`` on the free interface displacements.

        ``done`` is called once when the stiffness of the body is assembled and once when it is
        condensed.
        """
        stiffness, loads = self._reduced()
        done()
        condensed = condense_body(stiffness, loads, self._interface, keep)
        done()
        return condensed if self._springs is None else self._springs.removed(*condensed)

    def uncondensed(self) -> SparseBody | None:
        """Return the body without condensing it, or None for a body with a trace."""
        if self._springs is not None:
            return None
        return SparseBody(*self._reduced(), self._interface)

    def mirror(self, axis: int) -> Mirror | None:
        """Return the mirror of the free displacements across a global ``axis``.

        Interface displacements are in the interface frames. The result is None unless nodes,
        supports and frames are symmetric; loads need not be.
        """
        free = self.constraints.free
        if free[-1] >= self.elastic.size:
            return None  # A mean over a face leaves combinations of displacements free.
        of_nodes = mirror_of_nodes(self.elastic.nodes, self.elastic.body.axes, axis)
        of_free = None if of_nodes is None else of_nodes.restricted(free)
        if of_nodes is None or of_free is None:
            return None
        if self._springs is None:
            rotation = self._transformation[free]
            return Mirror.of(rotation.T @ of_free.matrix() @ rotation)
        of_faces = of_nodes.restricted(self._dofs(self.nodes))
        if of_faces is None:
            return None
        along = sp.block_diag(list(self._frames), format="csr")[self._free]
        return Mirror.of(
            sp.block_diag([of_free.matrix(), along @ of_faces.matrix() @ along.T], format="csr")
        )

    def on_interface(self, mirror: Mirror) -> Mirror | None:
        """Return a mirror's part on the interface, or None if it maps the interface elsewhere."""
        return mirror.restricted(self._interface)

    def halves(
        self,
        mirror: Mirror,
        on_interface: Mirror,
        done: Callable[[], None] = lambda: None,
        keep: Keep = made_anew,
    ) -> list[Callable[[], Condensed]] | None:
        """Return functions that condense the symmetric and the antisymmetric displacements.

        They return what :meth:`condense` does, in the bases of ``on_interface``, the mirror of the
        interface displacements. ``done`` is called after each half. The result is None if the
        stiffness is not symmetric about the mirror.
        """
        stiffness, loads = self._reduced()
        stiffnesses = halves(stiffness, mirror)
        if stiffnesses is None:
            return None

        def condensed(part: sp.csr_matrix, basis: sp.csr_matrix, to: sp.csr_matrix) -> Condensed:
            on_faces = basis[self._interface]
            kept = np.unique(on_faces.indices)
            half = condense_body(part, basis.T @ loads, kept, keep)
            # The motions are the same, in another order and some with the opposite sign.
            half = renamed(half, (to.T @ on_faces[:, kept]).tocsr())
            if self._springs is not None:
                half = self._springs.removed(*half, to)
            done()
            return half

        parts = zip(stiffnesses, mirror.bases, on_interface.bases, strict=True)
        return [partial(condensed, *part) for part in parts]

    def recover(
        self, interface_displacement: Array, interface_forces: Array, amplitudes: Array
    ) -> Array:
        """Return all displacements ``(d all, ...)`` for given ones of the interface ``(d n, ...)``.

        The arguments may have columns.

        Parameters
        ----------
        interface_displacement
            Interface displacements; those that are held stay at zero whatever is given.
        interface_forces
            Forces on the body at the interface that belong to these displacements. They matter only
            if the body has a trace.
        amplitudes
            Amplitudes of the load cases ``(cases, ...)``.
        """
        interface_displacement = interface_displacement[self._free]
        if self._springs is not None:
            forces = interface_forces[self._free]
            interface_displacement = self._springs.ends(interface_displacement, forces)
        stiffness, loads = self._reduced()
        inner = np.setdiff1d(np.arange(stiffness.shape[0]), self._interface)
        rhs = loads[inner] @ amplitudes
        rhs -= stiffness[inner][:, self._interface] @ interface_displacement
        displacement = np.empty((stiffness.shape[0], *rhs.shape[1:]))
        displacement[self._interface] = interface_displacement
        solve = prepare(stiffness[inner][:, inner].tocsr(), self._soft_motions[inner])
        displacement[inner] = solve(rhs)
        return self._all(displacement, amplitudes)

    def respond(
        self, interface_forces: Array, amplitudes: Array, forces: Array | None = None
    ) -> tuple[Array, Array]:
        """Return all displacements and those of the interface under interface forces.

        ``interface_forces`` ``(d n, ...)``, ``amplitudes`` ``(cases, ...)`` and further nodal
        ``forces`` ``(d all, ...)`` may have columns.
        For a body that supports leave free, the result is its deformation alone; add
        :meth:`rigid_displacements` in the amounts that the contact determines.
        """
        stiffness, loads = self._reduced()
        rhs = loads @ amplitudes
        if forces is not None:
            rhs += self._transformation.T @ forces
        on_faces = interface_forces[self._free]
        if self._springs is not None:
            rhs[self._interface] += self._springs.on_ends(on_faces)
        else:
            rhs[self._interface] += on_faces
        rigid = self._rigid
        if rigid.shape[1]:
            # Spread the unbalanced load that the contact solver leaves evenly over the body, so
            # that none of it acts on the displacements that are held for the solution.
            rhs -= rigid @ (rigid.T @ rhs)
            free = np.delete(np.arange(len(rhs)), independent(rigid))
            displacement = np.zeros_like(rhs)
            displacement[free] = prepare(
                stiffness[free][:, free].tocsr(), self._soft_motions[free]
            )(rhs[free])
        else:
            displacement = prepare(stiffness, self._soft_motions)(rhs)
        return self._all(displacement, amplitudes), self._on_interface(displacement, on_faces)

    def rigid_displacements(self) -> tuple[Array, Array]:
        """Return the rigid motions that supports leave free.

        The result is the displacements of all nodes ``(d all, k)`` and those of the interface.
        """
        rigid = self._rigid
        nothing = np.zeros((len(self._free), rigid.shape[1]))
        return self._transformation @ rigid, self._on_interface(rigid, nothing)

    def _on_interface(self, displacement: Array, forces: Array) -> Array:
        """Return interface displacements ``(d n, ...)`` from the free ones, under ``forces``."""
        interface = np.zeros((len(self.held), *displacement.shape[1:]))
        moved = displacement[self._interface]
        if self._springs is not None:
            moved = self._springs.nodal(moved, forces)
        interface[self._free] = moved
        return interface

    @cached_property
    def _rigid(self) -> Array:
        """Orthonormal motions ``(free, k)`` without strain."""
        modes = sl.orth(self._soft_motions, rcond=FREE_MOTION)
        energies, shapes = np.linalg.eigh(modes.T @ (self._stiffness @ modes))
        stiff = float(np.median(self._stiffness.diagonal()))
        return np.asarray(modes @ shapes[:, energies <= FREE_MOTION * stiff])

    def at_interface(self, displacement: Array) -> Array:
        """Return the interface displacements ``(d n,)`` of all displacements ``(d all,)``."""
        interface = np.zeros(len(self.held))
        if self._springs is None:
            nodal = displacement[self._dofs(self.nodes)].reshape(len(self.nodes), -1)
            along = np.einsum("nab,nb->na", self._frames, nodal).ravel()
            interface[self._free] = along[self._free]
        else:
            interface[self._free] = self._springs.of(displacement)
        return interface

    def borne(self, forces: Array) -> tuple[Array, Array]:
        """Return points ``(m, 3)`` [mm] and the forces there of contact ``forces`` ``(n, 3)``.

        The contact forces are given at the vertices. On curved faces they are linear tractions,
        whose resultant acts at the curved face.
        """
        if self.trace is None or not self.elastic.curved:
            return self.elastic.body.points[self.nodes], forces
        tractions = spsolve(self.trace.products.tocsc(), forces)
        return self.elastic.nodes, np.asarray(self.trace.moments.T @ tractions)

    @cached_property
    def free_facets(self) -> Indices:
        """Facets of the surface without support, load or contact."""
        mesh = self.elastic.body.mesh
        touched = np.zeros(len(self.elastic.nodes), bool)
        touched[self.constraints.supported] = True
        for pair in self.cuts:
            touched[pair.on_both(self.elastic.body, touched)] = True
        touched[self.nodes] = True
        acted = [mesh.boundaries[name] for name in self.loaded]
        acted += [facets for pair in self.cuts for facets in (pair.low, pair.high)]
        facets = np.setdiff1d(mesh.boundary_facets(), np.concatenate(acted) if acted else [])
        return np.asarray(facets[~touched[mesh.facets[:, facets]].all(axis=0)], dtype=np.int64)

    @property
    def recovery(self) -> StressRecovery:
        """Recovery of the body's stress from its displacements."""
        matched = [pair for pair in self.cuts if pair.matched]
        if not matched:
            return StressRecovery(self.elastic, self.free_facets)
        return SectorRecovery(self.elastic, self.free_facets, matched)

    @property
    def rigid_modes(self) -> int:
        """Number of rigid motions that supports leave free."""
        return int(self._rigid.shape[1])

    @property
    def is_held(self) -> bool:
        """True if supports alone hold the body."""
        return self.rigid_modes == 0

    @property
    def clamped(self) -> Indices:
        """Vertices that cannot move in any direction, or only together as part of a rigid face."""
        still = np.diff(self._supports.indptr) == 0
        vertices = still.reshape(-1, self.elastic.dimension)[: self.elastic.body.mesh.nvertices]
        still, rigid = np.flatnonzero(vertices.all(axis=1)), self.constraints.rigid
        return np.union1d(still, rigid[rigid < len(vertices)])

    def load_resultants(self, amplitudes: Array, about: Array) -> Array:
        """Return force and moment ``(2, 3)`` of the applied loads about a point."""
        forces = np.zeros((len(self.elastic.nodes), 3))
        applied = self.loads @ amplitudes
        forces[:, self.elastic.body.axes] = applied.reshape(-1, self.elastic.dimension)
        arms = self.elastic.nodes - about
        return np.array([forces.sum(axis=0), np.cross(arms, forces).sum(axis=0)])

    def thermal_strain(self, amplitudes: Array) -> Array:
        """Return the thermal expansion of the vertices ``(vertices, ...)`` for given amplitudes."""
        if self._thermal is None:
            return np.zeros((self.elastic.body.mesh.nvertices, *amplitudes.shape[1:]))
        return np.asarray(self._thermal @ amplitudes)

    @property
    def acting(self) -> Array:
        """Part of the ``loads`` ``(d all, cases)`` that acts from outside the body."""
        return np.asarray(self.loads - self._own)

    def straining(self, displacements: Array, amplitudes: Array) -> Array:
        """Return displacements ``(d all, ...)`` without the ``jumps``, which cause no strain."""
        if self._jumps is None:
            return displacements
        return np.asarray(displacements - self._jumps @ amplitudes)

    @property
    def expands(self) -> bool:
        """True if any load case has thermal expansion."""
        return self._thermal is not None and bool(self._thermal.any())

    def nodal_loads(self) -> Array:
        """Return nodal forces ``(d all, cases)``, with those that imposed displacements cause."""
        if self.imposed is None:
            return self.loads
        return np.asarray(self.loads - self.elastic.stiffness @ self.imposed)

    def free_motions(self, about: Array, size: float) -> Array:
        """Return the small rigid motions that the supports leave, ``(k, 6)``, orthonormal.

        The columns are the displacement of the point ``about`` [mm] and the rotation times ``size``
        [mm], along the global axes.
        """
        motions = rigid_motions((self.elastic.nodes - about) / size, self.elastic.body.axes)
        held = motions - self._supports @ self.constraints.values(motions)
        gram = motions.T @ motions
        # A plane body has motions in its plane only.
        known = np.flatnonzero(np.diag(gram) > 0.0)
        shares, vectors = np.linalg.eigh((held.T @ held)[np.ix_(known, known)])
        free = np.zeros((int(np.sum(shares <= FREE_MOTION * gram.max())), 6))
        free[:, known] = vectors[:, : len(free)].T
        return free

    @cached_property
    def _soft_motions(self) -> Array:
        """Rigid motions restricted to the free displacements ``(free, k)``, of little energy."""
        elastic = self.elastic
        if self._springs is None:
            return rigid_body_modes(elastic.nodes, elastic.body.axes, self._transformation)
        supports = self._supports
        modes = rigid_body_modes(elastic.nodes, elastic.body.axes, supports)
        return np.concatenate([modes, self._springs.means @ (supports @ modes)])

    def _reduced(self) -> tuple[sp.csr_matrix, Array]:
        return self._stiffness, self._transformation.T @ self.nodal_loads()

    @cached_property
    def _stiffness(self) -> sp.csr_matrix:
        """Stiffness on the free displacements, with those of the interface in its frames."""
        if self._springs is None:
            t = self._transformation
            return (t.T @ self.elastic.stiffness @ t).tocsr()
        t = self._supports
        return self._springs.joined((t.T @ self.elastic.stiffness @ t).tocsr(), t)

    def _all(self, free: Array, amplitudes: Array) -> Array:
        displacement = self._transformation @ free
        return displacement if self.imposed is None else displacement + self.imposed @ amplitudes

    def _dofs(self, nodes: Indices) -> Indices:
        """Return the displacement numbers of nodes, one node after the other."""
        d = self.elastic.dimension
        return np.asarray((d * nodes[:, None] + np.arange(d)).ravel())


def interface_nodes(faces: Sequence[tuple[Interface, int]], body: Body) -> tuple[Indices, Array]:
    """Return the nodes ``(n,)`` of a body's contact ``faces``, one after the other, and their axes.

    The ``faces`` are those of :meth:`StructureMesh.faces_of`; the axes are ``(n, d, d)``.
    """
    axes = np.ix_(body.axes, body.axes)
    nodes = [interface.nodes(side) for interface, side in faces]
    frames = [np.tile(i.frame.axes[axes], (len(i.nodes(side)), 1, 1)) for i, side in faces]
    return np.concatenate(nodes), np.concatenate(frames)


def independent(motions: Array) -> Indices:
    """Return unknowns ``(k,)`` that, when held, prevent ``motions`` ``(n, k)`` in a stable way."""
    _, _, order = sl.qr(motions.T, mode="economic", pivoting=True)
    return np.asarray(order[: motions.shape[1]])
