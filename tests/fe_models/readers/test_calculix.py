"""Bonded bodies by CalculiX on the same mesh, with the same ties."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve
from scipy.spatial import cKDTree
from skfem import MeshTet

import fe_models.elasticity.body
from fe_models.elasticity.body import ElasticBody
from fe_models.joints.mortar import mortar_interface
from fe_models.loads.constraints import Constraints
from fe_models.meshes.structure_mesh import Body, StructureMesh, matched_interface
from fe_models.meshes.trace import LinearTrace
from fe_models.motion import deformation
from fe_models.structure import Structure
from fe_models.supported_body import SupportedBody, interface_nodes
from sa_solver.types import Frame, Material
from tests.fe_models.readers.calculix import Job, needs_ccx, stresses_of

pytestmark = [pytest.mark.slow, needs_ccx]

STEEL, TITANIUM = Material(200e3, 0.3), Material(115e3, 0.29)
FRAME = Frame(np.array([1.0, 1.0, 1.5]), np.eye(3))
PRESSURE, PULL = 40.0, 25.0


def blocks(order, curved=False, matching=True, shake=0.15):
    """Return a block on another, of irregular tetrahedra with edges bent by up to 5 %."""
    rng = np.random.default_rng(5)
    if matching:
        bodies = split(box((4, 4, 6), (0.0, 3.5), rng, shake), 1.5)
    else:
        bodies = box((3, 4, 3), (0.0, 1.5), rng, shake), box((5, 3, 3), (1.5, 3.5), rng, shake)
    made = []
    for name, mesh, ends in zip(("lower", "upper"), bodies, ((0.0, 1.5), (3.5, 1.5)), strict=True):
        named = mesh.with_boundaries(
            {
                "end": lambda x, z=ends[0]: x[2] == z,
                "joint": lambda x, z=ends[1]: x[2] == z,
                "side": lambda x: x[0] == 2.0,
            }
        )
        body = Body(name, named)
        made.append(replace(body, midsides=bent(body)) if curved else body)
    return [ElasticBody(b, m, order) for b, m in zip(made, (STEEL, TITANIUM), strict=True)]


def box(counts, heights, rng, shake):
    """Return a box of 2 mm x 2 mm between two heights, with inner nodes off their grid."""
    ends = ((0.0, 2.0), (0.0, 2.0), heights)
    steps = [np.linspace(*end, n + 1) for end, n in zip(ends, counts, strict=True)]
    mesh = MeshTet.init_tensor(*steps)
    points = mesh.p.copy()
    for axis, step in enumerate(steps):
        # A plane at 1.5 mm stays plane, so that the bodies can be cut there.
        flat = np.isin(mesh.p[axis], (step[0], step[-1], 1.5 if axis == 2 else np.nan))
        points[axis, ~flat] += rng.uniform(-shake, shake, (~flat).sum()) * (step[1] - step[0])
    if len(steps[2]) == 7:
        level = steps[2][np.argmin(np.abs(steps[2] - 1.5))]
        points[2, mesh.p[2] == level] = 1.5
    return MeshTet(points, mesh.t)


def split(mesh, height):
    """Return the parts of a mesh below and above a height that its elements do not cross."""
    below = mesh.p[2, mesh.t].mean(axis=0) < height
    parts = []
    for chosen in (below, ~below):
        used, cells = np.unique(mesh.t[:, chosen], return_inverse=True)
        parts.append(MeshTet(mesh.p[:, used].copy(), cells.reshape(4, -1)))
    return parts


def bent(body):
    """Return midside points moved off their edges' middles by a smooth field of both bodies."""
    middle = body.mesh.p[:, body.mesh.edges].mean(axis=1).T
    return middle + 0.03 * np.sin(5.0 * middle[:, [1, 2, 0]] + [0.3, 1.1, 2.0])


def structure_of(bodies, matching):
    """Return both bodies: the lower one held at its end, the upper one loaded."""
    lower, upper = bodies
    order = lower.order
    if matching:
        face = matched_interface("joint", lower.body, upper.body, "joint", FRAME)
    else:
        face = mortar_interface("joint", lower.body, "joint", upper.body, "joint", FRAME)
    held, free = (Constraints(len(body.nodes), 3) for body in bodies)
    held.hold(lower.boundary_nodes("end"))
    loads = [np.zeros((lower.size, 1)), applied(upper)[:, None]]
    supported = [
        SupportedBody(
            body,
            constraints,
            *interface_nodes([(face, side)], body.body),
            load,
            trace=LinearTrace.of(body, {"joint": face.nodes(side)}),
        )
        for side, (body, constraints, load) in enumerate(
            zip(bodies, (held, free), loads, strict=True), start=1
        )
    ]
    mesh = StructureMesh((lower.body, upper.body), (face,)).weighted(order)
    return Structure(mesh, tuple(supported))


def applied(upper):
    pull = upper.traction_load("end", lambda x: PULL * np.ones(x.shape[1:]), np.eye(3)[0])
    return PRESSURE * (upper.pressure_load("end") + upper.pressure_load("side")) + pull


def bonded(structure):
    """Return displacements of both bodies without any relative displacement."""
    joint = structure.condense()
    loads = joint.resolvent().loads[:, 0]
    force, nothing = loads.reshape(-1, 3).T, np.zeros((3, len(loads) // 3))
    return deformation(structure, force, nothing, np.ones(1))


def relation(structure):
    """Return C of the bond between the bodies: Σ_j C_ij u_j = 0 over the nodes of both."""
    (face,) = structure.mesh.interfaces
    parts = []
    for side, body in enumerate(structure.bodies, start=1):
        nodes = face.nodes(side)
        if body.trace is None:
            linear = sp.identity(len(body.elastic.nodes), format="csr")[nodes].toarray()
        else:
            products = body.trace.products.toarray()
            linear = np.linalg.solve(products, body.trace.moments.toarray())
        parts.append(linear)
    under = parts[0] if face.projection is None else face.projection @ parts[0]
    return np.hstack([-under, parts[1]])


def compare(bodies, displacements, answer):
    """Return the largest differences of displacements and stresses, relative to the largest."""
    ours = np.concatenate([u.reshape(-1, 3) for u in displacements])
    theirs = np.concatenate(answer.displacements)
    moved = np.abs(ours - theirs).max() / np.abs(theirs).max()
    pairs = [
        (stresses_of(body, u).reshape(6, -1), found.reshape(6, -1))
        for body, u, found in zip(bodies, displacements, answer.stresses, strict=True)
    ]
    own, found = (np.hstack(part) for part in zip(*pairs, strict=True))
    return moved, np.abs(own - found).max() / np.abs(found).max()


@pytest.fixture
def as_calculix(monkeypatch):
    """Use four integration points in curved tetrahedra, too, as C3D10 does."""
    monkeypatch.setattr(fe_models.elasticity.body, "INTEGRATED", 2)


# Displacements in a .dat file have seven digits, and the largest one here is about 2.
DIGITS = 1e-6


@pytest.mark.parametrize("matching", [True, False])
@pytest.mark.parametrize(("order", "curved"), [(1, False), (2, False), (2, True)])
def test_bonded_bodies(tmp_path, as_calculix, order, curved, matching):
    """Compare a condensed joint that does not open or slide with the same ties in CalculiX."""
    bodies = blocks(order, curved, matching)
    structure = structure_of(bodies, matching)
    job = Job(bodies)
    job.hold(0, bodies[0].boundary_nodes("end"))
    job.tie(relation(structure))
    job.load(1, applied(bodies[1]))
    moved, stress = compare(bodies, bonded(structure), job.run(tmp_path))
    assert moved < DIGITS
    assert stress < DIGITS


def one_body(bodies):
    """Return displacements of both bodies with shared nodes on their faces."""
    lower, upper = bodies
    nodes = [body.boundary_nodes("joint") for body in bodies]
    distance, partner = cKDTree(lower.nodes[nodes[0]]).query(upper.nodes[nodes[1]])
    assert distance.max() < 1e-12
    tied = Constraints(len(lower.nodes) + len(upper.nodes), 3)
    tied.hold(lower.boundary_nodes("end"))
    free = np.setdiff1d(np.arange(3 * (len(lower.nodes) + len(upper.nodes))), held_of(lower))
    columns = np.arange(lower.size + upper.size).reshape(-1, 3)
    columns[len(lower.nodes) + nodes[1]] = columns[nodes[0][partner]]
    _, columns = np.unique(columns.ravel(), return_inverse=True)
    ones = np.ones(len(columns))
    t = sp.csr_matrix((ones, (np.arange(len(columns)), columns)))
    stiffness = t.T @ sp.block_diag([lower.stiffness, upper.stiffness]) @ t
    load = t.T @ np.concatenate([np.zeros(lower.size), applied(upper)])
    unknown = np.unique(columns[free])
    displacement = np.zeros(t.shape[1])
    displacement[unknown] = spsolve(stiffness[unknown][:, unknown].tocsc(), load[unknown])
    return np.split(t @ displacement, [lower.size])


def held_of(lower):
    return (3 * lower.boundary_nodes("end")[:, None] + np.arange(3)).ravel()


def shared(bodies):
    """Return C of nodes that coincide, midside nodes included."""
    lower, upper = bodies
    nodes = [body.boundary_nodes("joint") for body in bodies]
    partner = cKDTree(lower.nodes[nodes[0]]).query(upper.nodes[nodes[1]])[1]
    c = np.zeros((len(partner), len(lower.nodes) + len(upper.nodes)))
    c[np.arange(len(c)), nodes[0][partner]] = -1.0
    c[np.arange(len(c)), len(lower.nodes) + nodes[1]] = 1.0
    return c


@pytest.mark.parametrize("curved", [False, True])
def test_second_order_bodies_of_shared_nodes(tmp_path, as_calculix, curved):
    """Compare the elements alone, without a joint; the pressure is CalculiX's own."""
    bodies = blocks(2, curved)
    job = Job(bodies)
    job.hold(0, bodies[0].boundary_nodes("end"))
    job.tie(shared(bodies))
    if curved:
        job.load(1, applied(bodies[1]))
    else:
        pull = applied(bodies[1]) - PRESSURE * sum(map(bodies[1].pressure_load, ("end", "side")))
        job.load(1, pull)
        job.press(1, "end", PRESSURE)
        job.press(1, "side", PRESSURE)
    moved, stress = compare(bodies, one_body(bodies), job.run(tmp_path))
    assert moved < DIGITS
    assert stress < DIGITS


def test_what_differs_by_choice(monkeypatch):
    """Measure the effect of our integration points and of ties by linear functions.

    The values are for four elements across a face, with edges bent by 5 %, relative to the largest
    displacement.
    """
    bodies = blocks(2, curved=True)
    whole, tied = (
        np.concatenate(u) for u in (one_body(bodies), bonded(structure_of(bodies, True)))
    )
    monkeypatch.setattr(fe_models.elasticity.body, "INTEGRATED", 2)
    few = np.concatenate(one_body(blocks(2, curved=True)))
    assert 1e-3 < np.abs(few - whole).max() / np.abs(whole).max() < 3e-3
    assert 1e-3 < np.abs(tied - whole).max() / np.abs(whole).max() < 1e-2
