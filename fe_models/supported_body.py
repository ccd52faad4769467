"""A supported, loaded body, condensed onto its interface nodes: S u = r + f."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, partial

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import spsolve

from fe_models.cyclic.cuts import Cuts
from fe_models.cyclic.recovery import SectorRecovery
from fe_models.elasticity.body import ElasticBody
from fe_models.elasticity.recovery import StressRecovery
from fe_models.joints.condensation import Condensed, Keep, condense_body, made_anew, renamed
from fe_models.loads.constraints import Constraints
from fe_models.loads.rigid_motions import rigid_body_modes, rigid_motions
from fe_models.meshes.structure_mesh import Body, Interface
from fe_models.meshes.trace import LinearTrace
from fe_models.solvers.linear_solver import prepare
from fe_models.solvers.symmetry import Mirror, halves, mirror_of_nodes
from sa_solver.types import Array, Indices

# A rigid motion that supports change by less than this share of itself is free.
FREE_MOTION = 1e-9
# A direction this close to an axis of the interface frame [rad] is along it: mesh files keep six
# digits, and normals are differences of them.
ALONG_AXIS = 1e-3
TIED = (
    "a support or a tied load ties nodes of a contact face to others, as a mean over a boundary "
    "that meets the face does; name a boundary away from it"
)


class SupportedBody:
    """A supported body whose interface displacements are in the interface frames.

    ``nodes`` ``(n,)`` are its interface vertices and ``frames`` ``(n, d, d)`` the axes at each, d
    the dimension; ``loads`` ``(d all, cases)`` its load cases, and ``imposed`` ``(d all, cases)``
    displacements that each imposes on nodes that ``constraints`` hold; ``loaded`` are boundaries
    with tractions on them; ``thermal`` ``(vertices, cases)`` expansions of the vertices and
    ``jumps`` ``(d all, cases)`` shifts of a part of the body, which strain nothing
    (:mod:`fe_models.loads.pretension`). The forces of both are among the loads; ``own`` ``(d all,
    cases)`` are those of the loads that do not act from outside. ``held`` ``(d n,)`` marks the
    interface displacements that are held at zero, as on a plane of symmetry. Raises ValueError if
    those of an interface node are constrained in any other way.

    Without ``trace`` the interface displacements are those of the vertices, which move the face
    linearly between them. With it, a face of second-order elements moves as these do, and the
    interface displacements are of the linear field next to its own (:class:`LinearTrace`).

    Examples
    --------
    A plane square of 1 mm that slides on its foot and is pulled by 210 MPa: in plane strain its end
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
        self.held, self._interface, blocks = _interface_displacements(rows, frames)
        self._free = np.flatnonzero(~self.held)
        if trace is None:
            rotation = _rotation(transformation.shape[1], self._interface, blocks)
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
        """Stiffness ``(k, k)`` and loads ``(k, cases)`` on the interface displacements not held.

        ``done`` is called with the stiffness of the body known, and with that of its interface.
        """
        stiffness, loads = self._reduced()
        done()
        condensed = condense_body(stiffness, loads, self._interface, keep)
        done()
        return condensed if self._springs is None else self._springs.removed(*condensed)

    def mirror(self, axis: int) -> Mirror | None:
        """The mirror across a global ``axis`` of the displacements that supports leave.

        Those of the interface are in its frames. None unless nodes, supports and frames have it;
        loads need not.
        """
        free = self.constraints.free
        if free[-1] >= self.elastic.size:
            return None  # means of a face leave combinations of its nodes, not these, free
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
        """What a mirror of all displacements does to the interface's; None if it leaves them."""
        return mirror.restricted(self._interface)

    def halves(
        self,
        mirror: Mirror,
        on_interface: Mirror,
        done: Callable[[], None] = lambda: None,
        keep: Keep = made_anew,
    ) -> list[Callable[[], Condensed]] | None:
        """What condenses symmetric, and what antisymmetric displacements, as :meth:`condense`.

        The coordinates are those of the bases of ``on_interface``, the mirror there. ``done`` is
        called after each half. None if the stiffness is not its own mirror image.
        """
        stiffness, loads = self._reduced()
        stiffnesses = halves(stiffness, mirror)
        if stiffnesses is None:
            return None

        def condensed(part: sp.csr_matrix, basis: sp.csr_matrix, to: sp.csr_matrix) -> Condensed:
            on_faces = basis[self._interface]
            kept = np.unique(on_faces.indices)
            half = condense_body(part, basis.T @ loads, kept, keep)
            # The same motions, in another order and some with the opposite sign.
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
        """All displacements ``(d all, ...)`` for given interface displacements ``(d n, ...)``.

        These, the forces and ``amplitudes`` ``(cases, ...)`` may have columns. Those that are held
        stay at zero, whatever is given. ``interface_forces`` are the forces on the body there,
        which must be those of the displacements; where these are of the vertices themselves,
        nothing depends on them.
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

    def respond(self, interface_forces: Array, amplitudes: Array) -> tuple[Array, Array]:
        """All displacements and the interface's under interface forces.

        ``interface_forces`` ``(d n, ...)`` and ``amplitudes`` ``(cases, ...)`` may have columns.
        A body that supports leave free moves so far as the forces deform it, and by
        :meth:`rigid_displacements` as contact alone says.
        """
        stiffness, loads = self._reduced()
        rhs = loads @ amplitudes
        forces = interface_forces[self._free]
        rhs[self._interface] += forces if self._springs is None else self._springs.on_ends(forces)
        rigid = self._rigid
        if rigid.shape[1]:
            # What the contact solver leaves of the balance goes into the body evenly, and nothing
            # into the displacements that are held meanwhile.
            rhs -= rigid @ (rigid.T @ rhs)
            free = np.delete(np.arange(len(rhs)), _independent(rigid))
            displacement = np.zeros_like(rhs)
            displacement[free] = prepare(
                stiffness[free][:, free].tocsr(), self._soft_motions[free]
            )(rhs[free])
        else:
            displacement = prepare(stiffness, self._soft_motions)(rhs)
        return self._all(displacement, amplitudes), self._on_interface(displacement, forces)

    def rigid_displacements(self) -> tuple[Array, Array]:
        """All displacements ``(d all, k)`` and the interface's of the motions left by supports."""
        rigid = self._rigid
        nothing = np.zeros((len(self._free), rigid.shape[1]))
        return self._transformation @ rigid, self._on_interface(rigid, nothing)

    def _on_interface(self, displacement: Array, forces: Array) -> Array:
        """Interface displacements ``(d n, ...)`` of those that supports leave, under forces."""
        interface = np.zeros((len(self.held), *displacement.shape[1:]))
        moved = displacement[self._interface]
        if self._springs is not None:
            moved = self._springs.nodal(moved, forces)
        interface[self._free] = moved
        return interface

    @cached_property
    def _rigid(self) -> Array:
        """Orthonormal motions ``(free, k)`` that strain nothing."""
        modes = sl.orth(self._soft_motions, rcond=FREE_MOTION)
        energies, shapes = np.linalg.eigh(modes.T @ (self._stiffness @ modes))
        stiff = float(np.median(self._stiffness.diagonal()))
        return np.asarray(modes @ shapes[:, energies <= FREE_MOTION * stiff])

    def at_interface(self, displacement: Array) -> Array:
        """Interface displacements ``(d n,)`` of all displacements ``(d all,)``."""
        interface = np.zeros(len(self.held))
        if self._springs is None:
            nodal = displacement[self._dofs(self.nodes)].reshape(len(self.nodes), -1)
            along = np.einsum("nab,nb->na", self._frames, nodal).ravel()
            interface[self._free] = along[self._free]
        else:
            interface[self._free] = self._springs.of(displacement)
        return interface

    def borne(self, forces: Array) -> tuple[Array, Array]:
        """Places ``(m, 3)`` [mm] and forces there of contact ``forces`` ``(n, 3)`` on the vertices.

        On curved faces these are linear tractions, whose resultant acts where the faces are.
        """
        if self.trace is None or not self.elastic.curved:
            return self.elastic.body.points[self.nodes], forces
        tractions = spsolve(self.trace.products.tocsc(), forces)
        return self.elastic.nodes, np.asarray(self.trace.moments.T @ tractions)

    @cached_property
    def free_facets(self) -> Indices:
        """Facets of the surface on which nothing acts: no support, load or contact."""
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
        """How its stress is found from displacements."""
        matched = [pair for pair in self.cuts if pair.matched]
        if not matched:
            return StressRecovery(self.elastic, self.free_facets)
        return SectorRecovery(self.elastic, self.free_facets, matched)

    @property
    def is_held(self) -> bool:
        """Whether supports alone hold the body."""
        return self._rigid.shape[1] == 0

    @property
    def clamped(self) -> Indices:
        """Vertices that cannot move in any direction, or not without others: of rigid faces."""
        still = np.diff(self._supports.indptr) == 0
        vertices = still.reshape(-1, self.elastic.dimension)[: self.elastic.body.mesh.nvertices]
        still, rigid = np.flatnonzero(vertices.all(axis=1)), self.constraints.rigid
        return np.union1d(still, rigid[rigid < len(vertices)])

    def load_resultants(self, amplitudes: Array, about: Array) -> Array:
        """Force and moment ``(2, 3)`` of the applied loads about a point."""
        forces = np.zeros((len(self.elastic.nodes), 3))
        applied = self.loads @ amplitudes
        forces[:, self.elastic.body.axes] = applied.reshape(-1, self.elastic.dimension)
        arms = self.elastic.nodes - about
        return np.array([forces.sum(axis=0), np.cross(arms, forces).sum(axis=0)])

    def thermal_strain(self, amplitudes: Array) -> Array:
        """Expansion of the vertices ``(vertices, ...)`` at ``amplitudes`` ``(cases, ...)``."""
        if self._thermal is None:
            return np.zeros((self.elastic.body.mesh.nvertices, *amplitudes.shape[1:]))
        return np.asarray(self._thermal @ amplitudes)

    @property
    def acting(self) -> Array:
        """Those of the ``loads`` that act from outside ``(d all, cases)``: not the body's own."""
        return np.asarray(self.loads - self._own)

    def straining(self, displacements: Array, amplitudes: Array) -> Array:
        """What of displacements ``(d all, ...)`` strains the body: all but its ``jumps``."""
        if self._jumps is None:
            return displacements
        return np.asarray(displacements - self._jumps @ amplitudes)

    @property
    def expands(self) -> bool:
        """Whether a load case heats the body, or cools it."""
        return self._thermal is not None and bool(self._thermal.any())

    def nodal_loads(self) -> Array:
        """Forces ``(d all, cases)`` of load cases; of an imposed displacement the body's own."""
        if self.imposed is None:
            return self.loads
        return np.asarray(self.loads - self.elastic.stiffness @ self.imposed)

    def free_motions(self, about: Array, size: float) -> Array:
        """Small rigid motions that the supports leave, ``(k, 6)``, orthonormal.

        Columns: displacement of the point ``about`` [mm] and rotation times ``size`` [mm], along
        the global axes.
        """
        motions = rigid_motions((self.elastic.nodes - about) / size, self.elastic.body.axes)
        held = motions - self._supports @ self.constraints.values(motions)
        gram = motions.T @ motions
        # Motions along the plane of a plane body are the only ones it knows.
        known = np.flatnonzero(np.diag(gram) > 0.0)
        shares, vectors = np.linalg.eigh((held.T @ held)[np.ix_(known, known)])
        free = np.zeros((int(np.sum(shares <= FREE_MOTION * gram.max())), 6))
        free[:, known] = vectors[:, : len(free)].T
        return free

    @cached_property
    def _soft_motions(self) -> Array:
        """What is left of the rigid motions ``(free, k)``: motions of little energy."""
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
        """On the displacements that supports leave, those of the interface in its frames."""
        if self._springs is None:
            t = self._transformation
            return (t.T @ self.elastic.stiffness @ t).tocsr()
        t = self._supports
        return self._springs.joined((t.T @ self.elastic.stiffness @ t).tocsr(), t)

    def _all(self, free: Array, amplitudes: Array) -> Array:
        displacement = self._transformation @ free
        return displacement if self.imposed is None else displacement + self.imposed @ amplitudes

    def _dofs(self, nodes: Indices) -> Indices:
        """Displacements of nodes, one node after the other."""
        d = self.elastic.dimension
        return np.asarray((d * nodes[:, None] + np.arange(d)).ravel())


def interface_nodes(faces: Sequence[tuple[Interface, int]], body: Body) -> tuple[Indices, Array]:
    """Nodes ``(n,)`` of a body's contact ``faces``, one after the other, and their axes.

    The ``faces`` are those of :meth:`StructureMesh.faces_of`, the axes ``(n, d, d)``.
    """
    axes = np.ix_(body.axes, body.axes)
    nodes = [interface.nodes(side) for interface, side in faces]
    frames = [np.tile(i.frame.axes[axes], (len(i.nodes(side)), 1, 1)) for i, side in faces]
    return np.concatenate(nodes), np.concatenate(frames)


def _independent(motions: Array) -> Indices:
    """Unknowns ``(k,)`` that hold ``motions`` ``(n, k)`` when they are held: far from singular."""
    _, _, order = sl.qr(motions.T, mode="economic", pivoting=True)
    return np.asarray(order[: motions.shape[1]])


def _interface_displacements(
    rows: sp.csr_matrix, frames: Array
) -> tuple[NDArray[np.bool_], Indices, Sequence[Array] | Array]:
    """Which displacements in the frames are held, and what the others are, from their rows of T.

    The others of a node are a square matrix times as many free displacements: those matrices, and
    all these free displacements one node after the other. Raises ValueError if an interface node
    has a displacement that is neither free nor zero.
    """
    d = frames.shape[1]
    counts = np.diff(rows.indptr).reshape(-1, d)
    if np.all(counts == 1) and np.all(rows.data == 1.0):
        own = rows.indices.astype(np.int64)
        if len(np.unique(own)) == len(own) and np.all(np.diff(own.reshape(-1, d)) > 0):
            # Nothing holds or ties them, as on most faces.
            return np.zeros(len(own), bool), own, frames
    held, used, blocks = [], [], []
    for node, frame in enumerate(frames):
        entries = slice(rows.indptr[d * node], rows.indptr[d * (node + 1)])
        columns, place = np.unique(rows.indices[entries], return_inverse=True)
        local = np.zeros((d, len(columns)))
        local[np.repeat(np.arange(d), counts[node]), place] = rows.data[entries]
        local = frame @ local
        zero = np.linalg.norm(local, axis=1) <= ALONG_AXIS
        if len(columns) > np.sum(~zero):
            raise ValueError(TIED)
        if len(columns) < np.sum(~zero):
            raise ValueError(
                "nodes of a contact face are held along a direction that is no axis of the "
                "contact's frame; turn its x along or across that direction"
            )
        held.append(zero)
        used.append(columns)
        blocks.append(local[~zero])
    interface = np.concatenate(used).astype(np.int64)
    if len(np.unique(interface)) < len(interface):
        raise ValueError(TIED)
    return np.concatenate(held), interface, blocks


def _rotation(size: int, interface: Indices, blocks: Sequence[Array] | Array) -> sp.csr_matrix:
    """Free displacements from ones that are ``blocks`` ``(k, k)`` times them at each node.

    ``interface`` are those of all the nodes, one after the other; frames are such blocks.
    """
    others = np.setdiff1d(np.arange(size), interface)
    if isinstance(blocks, np.ndarray):
        # All of one size, and at once.
        by_node = interface.reshape(len(blocks), -1)
        rows = [np.repeat(by_node, by_node.shape[1], axis=1).ravel()]
        columns = [np.tile(by_node, by_node.shape[1]).ravel()]
        inverses = [np.linalg.inv(blocks).ravel()]
    else:
        nodes = np.split(interface, np.cumsum([len(block) for block in blocks])[:-1])
        rows = [np.repeat(dofs, len(dofs)) for dofs in nodes]
        columns = [np.tile(dofs, len(dofs)) for dofs in nodes]
        inverses = [np.linalg.inv(block).ravel() for block in blocks]
    values = np.concatenate([*inverses, np.ones(len(others))])
    places = np.concatenate([*rows, others]), np.concatenate([*columns, others])
    return sp.csr_matrix((values, places), shape=(size, size))
