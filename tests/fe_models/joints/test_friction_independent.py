"""Structural friction compared with whole bodies in one matrix, solved by Newton's method.

The condensed joint and its splitting are compared with
:mod:`tests.fe_models.joints.monolithic`, which shares neither. Both solve the same equations, so
all tolerances are those of the solvers.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy.sparse as sp
from skfem import MeshTet

from fe_models.dovetail import dovetail_structure
from fe_models.elasticity.body import ElasticBody
from fe_models.joints import friction
from fe_models.joints.friction import FrictionalJoint
from fe_models.joints.joint import join
from fe_models.loads.constraints import Constraints
from fe_models.meshes.structure_mesh import Body
from fe_models.supported_body import SupportedBody
from sa_solver.types import Material, resultants
from tests.fe_models.joints.monolithic import (
    Monolith,
    Part,
    held,
    linear_trace,
    mean_held,
    sliding,
    whole_stiffness,
)
from tests.marks import slow

STEEL, TITANIUM = Material(200e3, 0.3, 7.8e-9), Material(115e3, 0.29, 4.43e-9)
X, Y, Z = np.eye(3)
FRICTION = 0.4
# Contact face of the block: 5 x 4 nodes on 4 x 3 mm; the plate below is wider.
LENGTH, WIDTH = 4.0, 3.0
# Curvature of the gap [1/mm]: 0.12 µm at the corners, which the first load closes in part.
CROWN = 2e-5
# This tilt and twist shake the block down in few cycles, with part of it off the plate; others
# take hundreds. Each cycle is 0.18 times as far from closed as the one before.
CLOSING, SHAKEN = {"tilt": -10.0, "twist": 0.0}, 10
# Tolerance of the comparisons; both solvers run to rounding.
AGREEMENT = 1e-6
# Relative perturbation, somewhat more than that of different processors and libraries.
ROUNDING = 1e-13


@pytest.fixture(autouse=True)
def to_rounding(monkeypatch):
    """Set the splitting's tolerance to rounding, since it is not tested here."""
    monkeypatch.setattr(friction, "TOLERANCE", 1e-11)
    monkeypatch.setattr(friction, "MAX_ITERATIONS", 5000)


# The small dovetail of the cases on an even coarser mesh: 5 x 6 nodes per flank.
SMALL = {"edge_radius": 100.0, "edge_width": 2.0, "end_radius": 600.0, "end_width": 6.0}
SMALL_PATH = {"increments": 12, "peak_at": 5}
FLANK_NODES, SIZE = (5, 6), 12.0


def block(steps, material, order):
    """Return a box on the ``steps`` of its axes; the face at z = 0 is the contact."""
    inside = lambda x: (x[0] > 0) & (x[0] < LENGTH) & (x[1] > 0) & (x[1] < WIDTH)  # noqa: E731
    mesh = MeshTet.init_tensor(*steps).with_boundaries(
        {
            "bottom": lambda x: np.isclose(x[2], steps[2][0]),
            "top": lambda x: np.isclose(x[2], steps[2][-1]),
            "contact": lambda x: np.isclose(x[2], 0.0) & inside(x),
        }
    )
    return ElasticBody(Body("block", mesh), material, order)


class BlockOnPlate:
    """Block on a held plate, free except for the contact and its mean displacement along y.

    Load cases: a pressure of 1 MPa on the block's top, a shear of 1 MPa along x, a normal traction
    of 1 MPa/mm across it, which tilts the block, and one along y, which twists it.
    """

    def __init__(self, order):
        self.plate = block(
            (np.linspace(-1, 5, 7), np.linspace(-1, 4, 6), np.linspace(-2, 0, 3)), STEEL, order
        )
        self.block = block(
            (np.linspace(0, 4, 5), np.linspace(0, 3, 4), np.linspace(0, 2, 3)), TITANIUM, order
        )
        self.order = order
        self.nodes = [self.contact_nodes(e) for e in (self.plate, self.block)]
        self.x, self.y, _ = self.block.nodes[self.nodes[1]].T - np.array([[2.0], [1.5], [0.0]])
        self.gap = CROWN * (self.x**2 + self.y**2)
        self.frames = np.tile(np.eye(3), (len(self.gap), 1, 1))
        cases = [
            (lambda x: -np.ones_like(x[0]), Z),
            (lambda x: np.ones_like(x[0]), X),
            (lambda x: x[0] - 2.0, Z),
            (lambda x: x[0] - 2.0, Y),
        ]
        pull = [self.block.traction_load("top", *case) for case in cases]
        self.loads = [np.zeros((3 * len(self.plate.nodes), len(cases))), np.stack(pull, axis=1)]
        self.top, self.top_weights = self.block.boundary_weights("top")

    @staticmethod
    def contact_nodes(elastic):
        nodes = elastic.body.vertices("contact")
        x, y, _ = elastic.nodes[nodes].T
        return nodes[np.lexsort((x, y))]

    def condensed(self):
        held_plate, guided = (Constraints(len(e.nodes)) for e in (self.plate, self.block))
        held_plate.hold(self.plate.boundary_nodes("bottom"))
        guided.zero_mean(self.top, self.top_weights, Y)
        supported = []
        for elastic, constraints, nodes, loads in zip(
            (self.plate, self.block), (held_plate, guided), self.nodes, self.loads, strict=True
        ):
            constraints.average(*elastic.midsides("contact"))
            supported.append(SupportedBody(elastic, constraints, nodes, self.frames, loads))
        return supported, join([body.condense() for body in supported])

    def monolith(self):
        parts = []
        for elastic, nodes, loads in zip(
            (self.plate, self.block), self.nodes, self.loads, strict=True
        ):
            size = 3 * len(elastic.nodes)
            if elastic is self.plate:
                equations = [held(size, elastic.boundary_nodes("bottom"))]
            else:
                equations = [mean_held(size, self.top, self.top_weights, Y)]
            if self.order == 2:
                equations.append(linear_trace(size, *elastic.midsides("contact")))
            stiffness = whole_stiffness(elastic.body.mesh, elastic.material, self.order)
            parts.append(Part(stiffness, sp.vstack(equations, format="csr"), loads, nodes))
        return Monolith(*parts, self.frames, FRICTION)

    def tops(self, displacement):
        """Return the mean displacement of the top along x, from the block's ``(3 n,)``."""
        mean = self.top_weights @ displacement.reshape(-1, 3)[self.top, 0]
        return mean / self.top_weights.sum()


def swing(values, tilt=-20.0, twist=3.0):
    """Return amplitudes under 30 MPa as shear, tilt and twist swing together."""
    return np.array([[30.0, 7.0 * a, tilt * a, twist * a] for a in values])


# The block is pressed, pulled, and moved back and forth; it partly lifts off at the ends.
PRESS = np.array([[15.0, 0.0, 0.0, 0.0], [30.0, 0.0, 0.0, 0.0]])
UP, DOWN = np.linspace(0.25, 1.0, 4), np.linspace(0.95, -1.0, 5)
PATH = np.concatenate([PRESS, swing(UP), swing(DOWN), swing(-DOWN)])
TURN = len(PRESS) + len(UP) - 1


@cache
def both(order):
    """Return the joint, its condensed bodies, and the states of both methods along the path."""
    joint = BlockOnPlate(order)
    supported, condensed = joint.condensed()
    split = list(FrictionalJoint(condensed.resolvent(), FRICTION).march(PATH, joint.gap))
    assert all(state.converged for state in split)
    monolith = joint.monolith()
    return joint, supported, monolith, split, list(monolith.march(PATH, joint.gap))


@pytest.fixture(params=[1, slow(2)], ids=["linear", "quadratic"], name="pair")
def solved_pair(request, to_rounding):
    return both(request.param)


def statuses(force):
    """Return the numbers of nodes that are open, sliding and stuck under forces ``(3, n)``."""
    closed = force[2] > 0.0
    slides = closed & (np.hypot(*force[:2]) >= FRICTION * force[2] * (1.0 - 1e-9))
    return int(np.sum(~closed)), int(np.sum(slides)), int(np.sum(closed & ~slides))


def perturbed(values, rng):
    """Return the values with their last digits changed, as by rounding on another machine."""
    return values * (1.0 + ROUNDING * rng.uniform(-1.0, 1.0, values.shape))


def test_whole_bodies_are_solved_whatever_the_rounding():
    """Check that the reference method gives the same forces from three perturbed inputs."""
    joint = BlockOnPlate(1)
    forces = []
    for seed in range(3):
        rng, monolith = np.random.default_rng(seed), joint.monolith()
        monolith.stiffness.data = perturbed(monolith.stiffness.data, rng)
        monolith.stiffness = (monolith.stiffness + monolith.stiffness.T) / 2.0
        monolith.loads = perturbed(monolith.loads, rng)
        states = monolith.march(PATH[: TURN + 1], perturbed(joint.gap, rng))
        forces.append([state.force for state in states])
    apart = np.ptp(forces, axis=0).max()
    assert 0.0 < apart < 1e4 * ROUNDING * np.abs(forces).max()


def test_path_sees_every_status(pair):
    """Check that the path has nodes of every status, so that the comparisons are meaningful."""
    _, _, _, _, whole = pair
    opened, slipping, stuck = np.array([statuses(state.force) for state in whole]).T
    assert opened.max() >= 4
    assert slipping.max() >= 4
    assert np.any((opened > 0) & (slipping > 0) & (stuck > 0))
    assert slipping[TURN + 1] == 0


def test_forces_and_slips_are_those_of_the_whole_bodies(pair):
    *_, split, whole = pair
    force = max(np.abs(state.force).max() for state in whole)
    slip = max(np.abs(state.slip).max() for state in whole)
    for one, two in zip(split, whole, strict=True):
        np.testing.assert_allclose(one.force, two.force, atol=AGREEMENT * force)
        np.testing.assert_allclose(one.slip, two.slip, atol=AGREEMENT * slip)


def test_resultants_and_energies_are_those_of_the_whole_bodies(pair):
    """Compare P, Qx, Qy, Mx, My, Mz and the energies at every increment."""
    joint, _, _, split, whole = pair
    reduced, expected = (
        np.array([resultants(s.force, joint.x, joint.y) for s in states])
        for states in (split, whole)
    )
    for column in range(6):
        scale = np.abs(expected[:, column]).max()
        np.testing.assert_allclose(reduced[:, column], expected[:, column], atol=AGREEMENT * scale)
    reduced, expected = (
        np.array([-np.sum(s.force[:2] * s.slip, axis=1) for s in states])
        for states in (split, whole)
    )
    assert expected.sum() > 0.0
    np.testing.assert_allclose(reduced, expected, atol=AGREEMENT * expected.max())


def test_load_and_contact_balance(pair):
    """Compare with the resultants of the tractions on the top; its support holds only Qy."""
    joint, _, _, split, _ = pair
    area, height = LENGTH * WIDTH, 2.0
    second = WIDTH * LENGTH**3 / 12.0
    pressure, shear, tilt, twist = PATH.T
    computed = np.array([resultants(s.force, joint.x, joint.y) for s in split]).T
    across = computed[2]
    assert np.abs(across).max() > 1.0
    expected = [
        pressure * area,
        -shear * area,
        across,
        -across * height,
        tilt * second - shear * area * height,
        -twist * second,
    ]
    np.testing.assert_allclose(computed, expected, atol=1e-8 * 30.0 * area)


def whole_displacements(supported, states, amplitudes):
    """Return all displacements of the upper body in each of the states."""
    displacements = []
    for state, amplitude in zip(states, amplitudes, strict=True):
        force = state.force.T.ravel()
        _, interface = supported[0].respond(-force, amplitude)
        displacements.append(
            supported[1].recover(interface + state.displacement.T.ravel(), force, amplitude)
        )
    return displacements


def test_slope_of_the_stuck_branch_is_that_of_a_tied_joint(pair):
    """Check that after the reversal dQ/du of the top and all contact forces are those of a bond.

    The whole bodies are bonded at the nodes that touch; the others stay open.
    """
    joint, supported, monolith, split, _ = pair
    window = slice(TURN, TURN + 2)
    tops = [joint.tops(u) for u in whole_displacements(supported, split[window], PATH[window])]
    closed = split[TURN].force[2] > 0.0
    change = PATH[TURN + 1] - PATH[TURN]
    force, u = monolith.tied(change, closed)
    shear = [state.force[0].sum() for state in split[window]]
    slope = (shear[1] - shear[0]) / (tops[1] - tops[0])
    tied = force[0].sum() / joint.tops(u[-3 * len(joint.block.nodes) :])
    assert slope == pytest.approx(tied, rel=AGREEMENT)
    largest = np.abs(force).max()
    step = split[TURN + 1].force - split[TURN].force
    np.testing.assert_allclose(step, force, atol=AGREEMENT * largest)


@pytest.mark.parametrize("order", [1, 2])
def test_slope_of_a_fully_closed_stuck_branch_is_that_of_a_bonded_block(order):
    """Check the branch after the reversal without tilt, where all twenty nodes touch."""
    joint = BlockOnPlate(order)
    supported, condensed = joint.condensed()
    path = np.concatenate([PRESS, swing([*UP, 0.98], tilt=0.0)])
    states = list(FrictionalJoint(condensed.resolvent(), FRICTION).march(path, joint.gap))
    assert statuses(states[-2].force)[1] > 0
    assert statuses(states[-1].force) == (0, 0, len(joint.gap))
    tops = [joint.tops(u) for u in whole_displacements(supported, states[-2:], path[-2:])]
    shear = [state.force[0].sum() for state in states[-2:]]
    change = path[-1] - path[-2]
    force, u = joint.monolith().tied(change, np.ones(len(joint.gap), bool))
    tied = force[0].sum() / joint.tops(u[-3 * len(joint.block.nodes) :])
    assert (shear[1] - shear[0]) / (tops[1] - tops[0]) == pytest.approx(tied, rel=AGREEMENT)


def cycle_energies(steps):
    """Return work and dissipated energy of a repeated cycle, in ``steps`` increments each way.

    The work of the loads is by the trapezoidal rule. The energy is by the same rule (which is exact
    for the elastic part) and as the increments report it. The last result is how far the cycle is
    from closed.
    """
    joint = BlockOnPlate(1)
    supported, condensed = joint.condensed()
    down = np.linspace(1.0, -1.0, steps + 1)[1:]
    there_and_back = [swing(down, **CLOSING), swing(-down, **CLOSING)]
    path = np.concatenate([PRESS, swing(UP, **CLOSING), *there_and_back * SHAKEN])
    states = list(FrictionalJoint(condensed.resolvent(), FRICTION).march(path, joint.gap))
    assert all(state.converged for state in states)
    cycle, amplitudes = states[-2 * steps - 1 :], path[-2 * steps - 1 :]
    u = whole_displacements(supported, cycle, amplitudes)
    loads = amplitudes @ joint.loads[1].T
    work = np.sum(0.5 * (loads[1:] + loads[:-1]) * np.diff(u, axis=0))
    force = np.array([state.force for state in cycle])
    relative = np.array([state.displacement for state in cycle])
    lost = -np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(relative, axis=0))
    reported = -sum(np.sum(state.force[:2] * state.slip) for state in cycle[1:])
    closure = np.abs(cycle[-1].force - cycle[0].force).max() / np.abs(force).max()
    return work, lost, reported, closure


@pytest.mark.slow
def test_work_of_a_closed_cycle_is_the_energy_lost():
    """Check that the work equals the dissipation, and that the reported energy converges to it.

    An increment reports the shear at its end times its slip, which is accurate to first order.
    """
    errors = []
    for steps in (5, 10, 20):
        work, lost, reported, closure = cycle_energies(steps)
        assert closure < AGREEMENT
        assert work > 0.0
        assert lost == pytest.approx(work, rel=AGREEMENT)
        errors.append(abs(reported / work - 1.0))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(rates > 0.8)


@pytest.fixture(scope="module")
def small_dovetail(dovetail, titanium, mission):
    """Return structure, joint, the same as whole bodies, and a load path with the moment."""
    shape = replace(dovetail, **SMALL)
    load_path = replace(mission, **SMALL_PATH)
    mesh = shape.mesh(FLANK_NODES, SIZE)
    structure = dovetail_structure(shape, mesh, titanium, titanium, load_path, 1)
    monolith = whole_dovetail(mesh, titanium, load_path)
    return structure, structure.condense(), monolith, load_path.amplitudes()


def whole_dovetail(mesh, material, mission):
    """Return independent supports and loads: a held disk, and a blade held on average."""
    disk, blade = (ElasticBody(body, material, 1) for body in mesh.bodies)
    size_1, size_2 = 3 * len(disk.nodes), 3 * len(blade.nodes)
    inner = disk.boundary_nodes("inner")
    sides, normals = disk.boundary_normals("sides")
    # Held nodes are not made to slide, too, since the equations would be dependent.
    loose = ~np.isin(sides, inner)
    supports = sp.vstack([held(size_1, inner), sliding(size_1, sides[loose], normals[loose])])
    spin = disk.centrifugal_load()
    area = blade.boundary_integral("shank_top", lambda x: np.ones_like(x[0]))
    second = blade.boundary_integral("shank_top", lambda x: x[0] ** 2)
    airfoil = mission.airfoil_mass * mission.airfoil_radius / area
    pull = blade.traction_load("shank_top", lambda x: np.full_like(x[0], airfoil), Z)
    bend = blade.traction_load("shank_top", lambda x: x[0] / second, Z)
    nodes_1, nodes_2 = (
        np.concatenate([getattr(i, name) for i in mesh.interfaces])
        for name in ("nodes_1", "nodes_2")
    )
    part_1 = Part(
        whole_stiffness(mesh.bodies[0].mesh, material, 1),
        supports.tocsr(),
        np.stack([spin, 0.0 * spin], axis=1),
        nodes_1,
    )
    part_2 = Part(
        whole_stiffness(mesh.bodies[1].mesh, material, 1),
        mean_held(size_2, *blade.boundary_weights("root_bottom"), Y),
        np.stack([pull + blade.centrifugal_load(), bend], axis=1),
        nodes_2,
    )
    frames = np.concatenate([np.tile(i.frame.axes, (len(i), 1, 1)) for i in mesh.interfaces])
    return Monolith(part_1, part_2, frames, FRICTION)


@pytest.mark.slow
def test_dovetail_is_that_of_the_whole_bodies(small_dovetail):
    """Compare forces, slips and the resultants of both flanks in a mission with a moment."""
    structure, joint, monolith, amplitudes = small_dovetail
    # At rest nothing holds the blade, and its position is arbitrary.
    amplitudes = amplitudes[:-1]
    split = list(FrictionalJoint(joint.resolvent(), FRICTION).march(amplitudes, structure.gap()))
    whole = list(monolith.march(amplitudes, structure.gap()))
    seen = np.array([statuses(state.force) for state in whole])
    assert np.all(seen.max(axis=0) >= 20)
    force = max(np.abs(state.force).max() for state in whole)
    slip = max(np.abs(state.slip).max() for state in whole)
    reduced, expected = (
        np.array([structure.interface_resultants(s) for s in states]) for states in (split, whole)
    )
    for one, two in zip(split, whole, strict=True):
        np.testing.assert_allclose(one.force, two.force, atol=AGREEMENT * force)
        np.testing.assert_allclose(one.slip, two.slip, atol=AGREEMENT * slip)
    for column in range(6):
        scale = np.abs(expected[..., column]).max()
        np.testing.assert_allclose(
            reduced[..., column], expected[..., column], atol=AGREEMENT * scale
        )


def test_stuck_branch_of_the_dovetail_is_that_of_a_tied_one(small_dovetail):
    """Compare slopes dP/dF, dQ/dF and all nodal forces past the peak with bonded flanks.

    Two increments past the peak every touching node sticks. Immediately past the peak the rims
    still creep: an eighth of the nodes, which change the slopes by less than 0.1 %.
    """
    structure, joint, monolith, amplitudes = small_dovetail
    frictional = FrictionalJoint(joint.resolvent(), FRICTION)
    peak = 4
    for turn, creeps in ((peak + 2, False), (peak, True)):
        step = -0.01 * amplitudes[turn]
        path = np.vstack([amplitudes[: turn + 1], amplitudes[turn] + step])
        *_, before, after = frictional.march(path, structure.gap())
        closed = (before.force[2] > 0.0) & (after.force[2] > 0.0)
        opened, slipping, stuck = statuses(after.force)
        assert opened + stuck >= 6 * slipping if creeps else slipping == 0
        assert stuck >= 20
        force, _ = monolith.tied(step, closed)
        tied = structure.interface_resultants(replace(after, force=force))
        change = structure.interface_resultants(after) - structure.interface_resultants(before)
        allowed = 1e-3 if creeps else AGREEMENT
        np.testing.assert_allclose(change[:, :2], tied[:, :2], rtol=allowed)
        if not creeps:
            scale = np.abs(force).max()
            np.testing.assert_allclose(after.force - before.force, force, atol=allowed * scale)
