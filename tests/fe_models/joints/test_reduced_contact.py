"""Contact of the reduced pair, compared with Hertz, Mindlin and the coupled march."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as sl
from scipy.optimize import nnls
from scipy.spatial import cKDTree

from fe_models.geometry.specimens import Specimen
from fe_models.joints.reduced_contact import FrettingConditions, ReducedPair, masing_loop
from fe_models.loads.constraints import Constraints
from fe_models.meshes.structure_mesh import Face
from fe_models.solvers.complementarity import complementary
from sa_solver.errors import InputError
from sa_solver.half_space.influence import rectangle_influence
from sa_solver.reference.mindlin import ShearedSphere
from sa_solver.types import ElasticPair, Frame, Material
from tests.reduced_pads import ALPHA, FRICTION, SOLVER, STROKE, coarse_pads, pad_stiffnesses


@pytest.fixture(scope="module")
def specimens():
    """Return a coarse pair: the pad with its curved gap, and the stiffness of both bodies there."""
    return coarse_pads()


@pytest.fixture(scope="module")
def pair(specimens):
    face, stiffness = specimens
    return ReducedPair.from_stiffness(face, *stiffness)


@pytest.fixture(scope="module")
def flat(pair):
    return np.zeros(len(pair.face))


@pytest.fixture(scope="module")
def curved(pair):
    return pair.face.gap


def conditions(force=17.0):
    return FrettingConditions(force, STROKE, FRICTION)


def worn_evenly(pair, gap):
    """Return a shape that has worn until nearly all nodes lose the same, α times energy."""
    for _ in range(60):
        cycle = pair.fretting_cycle(gap, conditions())
        per_force = 2.0 * ALPHA * FRICTION * cycle.cycle_slip / pair.areas
        block = 0.5 * pair.stable_cycles(cycle.normal, per_force)
        gap = gap + block * per_force * cycle.normal.force
    return gap


class TestComplementary:
    @pytest.mark.parametrize("seed", range(6))
    def test_against_nonnegative_least_squares(self, seed):
        rng = np.random.default_rng(seed)
        root = rng.standard_normal((30, 30))
        compliance, offset = root @ root.T + 0.1 * np.eye(30), rng.standard_normal(30)
        factor = sl.cholesky(compliance, lower=True)
        expected, _ = nnls(factor.T, -sl.solve_triangular(factor, offset, lower=True))
        solution = complementary(compliance, offset)
        assert solution.converged
        np.testing.assert_allclose(solution.force, expected, atol=1e-8 * expected.max())
        np.testing.assert_allclose(solution.gap * solution.force, 0.0, atol=1e-12)

    @pytest.mark.parametrize("first", [0, 7, 29])
    def test_start_does_not_matter(self, first):
        rng = np.random.default_rng(3)
        root = rng.standard_normal((30, 30))
        compliance, offset = root @ root.T + 0.1 * np.eye(30), rng.standard_normal(30)
        guess = np.arange(30) <= first
        one, two = (complementary(compliance, offset, 5.0, start) for start in (guess, None))
        assert one.converged
        assert two.converged
        np.testing.assert_allclose(one.force, two.force, atol=1e-9)
        np.testing.assert_allclose(one.force.sum(), 5.0, rtol=1e-12)
        residual = offset + compliance @ one.force - one.level
        np.testing.assert_allclose(residual, one.gap, atol=1e-9)
        assert residual.min() > -1e-9


# A sphere on a half-space instead of the specimens, with ν = 0, for which Mindlin is exact.
SOFT = Material(100e3, 0.0)
SPHERE = ShearedSphere(40.0, 50.0, SOFT, SOFT, 0.5)


@pytest.fixture(scope="module")
def half_space():
    """Return a half-space with nodes 1/10 of the contact radius apart, each loading a square."""
    count, step = 27, 0.1 * SPHERE.contact.contact_radius
    line = step * (np.arange(count) - count // 2)
    x, y = (part.ravel() for part in np.meshgrid(line, line, indexing="ij"))
    place = np.arange(count * count).reshape(count, count)
    corners = [place[:-1, :-1], place[1:, :-1], place[:-1, 1:], place[1:, 1:]]
    a, b, c, d = (corner.ravel() for corner in corners)
    facets = np.concatenate([np.stack([a, b, d], axis=1), np.stack([a, d, c], axis=1)])
    face = Face("sphere", Frame(np.zeros(3), np.eye(3)), np.stack([x, y], axis=1), facets)
    edges = step * (np.arange(2 * count) - count + 0.5)
    apart = np.arange(count)[:, None] - np.arange(count) + count - 1
    compliance = np.zeros((count**2, 3, count**2, 3))
    for axis in range(3):
        influence = rectangle_influence(edges, edges, ElasticPair(SOFT, SOFT), axis, axis)
        block = influence[apart[:, None, :, None], apart[None, :, None, :]] / step**2
        compliance[:, axis, :, axis] = block.reshape(count**2, count**2)
    return ReducedPair(face, compliance)


@pytest.fixture(scope="module")
def pressed(half_space):
    return half_space.normal(SPHERE.contact.gap(*half_space.face.coordinates.T), SPHERE.load)


class TestSphere:
    def test_hertz(self, pressed):
        assert pressed.converged
        np.testing.assert_allclose(pressed.force.sum(), SPHERE.load, rtol=SOLVER)
        # Second order in the node's distance over the contact radius, 1/10.
        assert pressed.approach == pytest.approx(SPHERE.contact.approach, rel=5e-3)
        assert pressed.pressure.max() == pytest.approx(SPHERE.contact.peak_pressure, rel=1e-2)
        # Whole nodes: first order, half a node's distance on the radius.
        assert pressed.area == pytest.approx(np.pi * SPHERE.contact.contact_radius**2, rel=0.1)

    def test_mindlin(self, half_space, pressed):
        forces = SPHERE.sliding_force * np.array([0.2, 0.5, 0.9])
        displacements = np.array([SPHERE.displacement(force) for force in forces])
        curve = half_space.virgin_curve(pressed, displacements, SPHERE.friction)
        assert curve.converged
        np.testing.assert_allclose(curve.force, forces, rtol=1e-2)
        stuck = 1.0 / SPHERE.tangential_compliance
        assert curve.stick_stiffness == pytest.approx(stuck, rel=1e-2)

    def test_energy_of_a_loop(self, half_space, pressed):
        force = 0.9 * SPHERE.sliding_force
        state = half_space.tangential(pressed, SPHERE.displacement(force), SPHERE.friction)
        energy = 4.0 * np.abs(state.shear) @ state.slip
        assert energy == pytest.approx(SPHERE.loop_energy(state.force), rel=4e-2)


class TestPair:
    def test_compliance_is_the_sum_of_both_bodies(self, pair, specimens):
        """Compare with one dense system of two held, glued pads under a relative displacement."""
        _, (first, second) = specimens
        rng = np.random.default_rng(0)
        relative = rng.standard_normal(len(first))
        # u_2 - u_1 = w, S_1 u_1 = -f, S_2 u_2 = f.
        lower = np.linalg.solve(first + second, -second @ relative)
        force = second @ (lower + relative)
        apart = pair.compliance.reshape(first.shape) @ force
        np.testing.assert_allclose(apart, relative, atol=1e-8)

    def test_x_and_y_are_alike(self, pair):
        points = pair.face.coordinates
        swapped = cKDTree(points).query(points[:, ::-1])[1]
        block = pair.block(0)[np.ix_(swapped, swapped)]
        np.testing.assert_allclose(block, pair.block(1), atol=1e-9 * block.max())
        pressed = pair.normal(pair.face.gap, 87.0)
        stiffness = [pair.stick_stiffness(pressed, axis) for axis in (0, 1)]
        assert stiffness[0] == pytest.approx(stiffness[1], rel=SOLVER)

    def test_uncoupled_stiffness_of_the_source(self, pair):
        """Check that A_zz⁻¹ is K_zz - K_zt K_tt⁻¹ K_tz (eq. 23, with both tangents)."""
        count = len(pair.face)
        K = np.linalg.inv(pair.compliance.reshape(3 * count, 3 * count))
        normal = np.arange(2, 3 * count, 3)
        tangential = np.setdiff1d(np.arange(3 * count), normal)
        K_zt = K[np.ix_(normal, tangential)]
        K_z = K[np.ix_(normal, normal)] - K_zt @ np.linalg.solve(
            K[np.ix_(tangential, tangential)], K_zt.T
        )
        np.testing.assert_allclose(K_z @ pair.block(2), np.eye(count), atol=1e-8)

    def test_contact_conditions(self, pair, curved):
        pressed = pair.normal(curved, 17.0)
        assert pressed.converged
        assert 0.0 < pressed.area < 0.5
        exact = curved + pair.block(2) @ pressed.force - pressed.approach
        np.testing.assert_allclose(pressed.gap, exact, atol=SOLVER * pressed.approach)
        np.testing.assert_allclose(pressed.force.sum(), 17.0, rtol=SOLVER)

    def test_curve_from_stick_to_sliding(self, pair, curved):
        pressed = pair.normal(curved, 87.0)
        curve = pair.virgin_curve(pressed, np.linspace(0.0, 0.5 * STROKE, 200), FRICTION)
        assert curve.converged
        # Smaller forces would be lost in rounding, as differences from the limit.
        small = pair.tangential(pressed, 1e-6, FRICTION)
        assert small.force == pytest.approx(1e-6 * curve.stick_stiffness, rel=SOLVER)
        assert curve.friction == pytest.approx(FRICTION, rel=SOLVER)
        slopes = np.diff(curve.force) / np.diff(curve.displacement)
        assert np.all(np.diff(slopes) < 1e-6 * curve.stick_stiffness)
        # Masing's rule needs slip that only grows.
        slip = np.array([state.slip for state in curve.states])
        assert np.diff(slip, axis=0).min() > -1e-12
        stiffest = curve.secant_stiffness(1e-3)
        assert stiffest == pytest.approx(curve.stick_stiffness, rel=SOLVER)
        assert curve.secant_stiffness(0.9) < 0.95 * stiffest

    def test_area_of_the_loop_is_the_energy_of_the_nodes(self, pair, curved):
        pressed = pair.normal(curved, 87.0)
        errors = []
        for points in (200, 400):
            curve = pair.virgin_curve(pressed, np.linspace(0.0, 0.5 * STROKE, points), FRICTION)
            last = curve.states[-1]
            energy = 4.0 * np.abs(last.shear) @ last.slip
            errors.append(abs(masing_loop(curve).energy / energy - 1.0))
        # The curve is interpolated linearly between its points: second order.
        assert errors[1] < 0.4 * errors[0] < 1e-3

    def test_loop_is_closed_and_odd(self, pair, flat):
        pressed = pair.normal(flat, 17.0)
        curve = pair.virgin_curve(pressed, np.linspace(0.0, 0.5 * STROKE, 50), FRICTION)
        loop = masing_loop(curve)
        assert loop.displacement[0] == loop.displacement[-1] == 0.5 * STROKE
        np.testing.assert_allclose(loop.force[[0, -1]], curve.force[-1], rtol=SOLVER)
        half = len(loop.force) // 2
        np.testing.assert_allclose(loop.force[: half + 1], -loop.force[half:], atol=1e-9)

    def test_what_cannot_be_solved(self, pair, flat):
        with pytest.raises(ValueError, match="above 0"):
            pair.normal(flat, 0.0)
        with pytest.raises(ValueError, match="0 or more"):
            pair.tangential(pair.normal(flat, 1.0), -1e-3, FRICTION)


class TestCoupled:
    """The same cycle marched with shear in both directions and pressure, without Masing's rule."""

    STEPS = 16

    def test_forces_are_in_balance(self, pair, curved):
        cycle = pair.coupled_cycle(curved, conditions(87.0), self.STEPS)
        assert cycle.converged
        normal = [state.force[2].sum() for state in cycle.states]
        np.testing.assert_allclose(normal, 87.0, rtol=1e-5)
        sliding = cycle.states[0].force
        assert -sliding[0].sum() == pytest.approx(FRICTION * 87.0, rel=1e-5)
        assert abs(sliding[1].sum()) < 1e-3

    def test_cycle_is_closed(self, pair, curved):
        cycle = pair.coupled_cycle(curved, conditions(17.0), self.STEPS)
        assert cycle.loop.displacement[0] == cycle.loop.displacement[-1] == 0.5 * STROKE
        first, last = cycle.states[0].force, cycle.states[-1].force
        np.testing.assert_allclose(last, first, atol=1e-5 * first.max())

    def test_datum_of_the_gap_does_not_matter(self, pair, curved):
        near, far = (
            pair.coupled_cycle(curved + lift, conditions(), 2).loop.force for lift in (0.0, 1.0)
        )
        np.testing.assert_allclose(far, near, atol=1e-5 * near.max())

    def test_stuck_stiffness(self, pair, flat):
        """Check 1ᵀH'1 along x, which is stiffer than with the other directions free."""
        small = replace(conditions(), stroke=2e-6)
        cycle = pair.coupled_cycle(flat, small, 1)
        slope = np.ptp(cycle.loop.force) / np.ptp(cycle.loop.displacement)
        exact = pair.joint().stiffness[::3, ::3].sum()
        assert slope == pytest.approx(exact, rel=1e-3)
        uncoupled = pair.stick_stiffness(pair.normal(flat, 17.0))
        assert uncoupled < exact < 1.01 * uncoupled

    @pytest.mark.parametrize("shape", ["flat", "curved", "worn"])
    @pytest.mark.parametrize("force", [17.0, 250.0])
    def test_uncoupled_method(self, pair, flat, curved, shape, force):
        """Check the cost of the source's assumptions: 1 % of force, 4 % of a node's peak force."""
        gap = {"flat": flat, "curved": curved, "worn": worn_evenly(pair, flat)}[shape]
        cycle = pair.coupled_cycle(gap, conditions(force), self.STEPS)
        assert cycle.converged
        pressed = pair.normal(gap, force)
        curve = pair.virgin_curve(pressed, np.linspace(0.0, 0.5 * STROKE, 1000), FRICTION)
        loop = masing_loop(curve)
        fall = slice(0, 2 * self.STEPS + 1)
        expected = np.interp(
            -cycle.loop.displacement[fall], -loop.displacement[:1000], loop.force[:1000]
        )
        assert np.abs(expected - cycle.loop.force[fall]).max() < 1e-2 * FRICTION * force
        pressures = np.array([state.force[2] for state in cycle.states])
        assert np.abs(pressures - pressed.force).max() < 4e-2 * pressed.force.max()
        contact = pair.fretting_cycle(gap, conditions(force))
        energy = np.abs(contact.tangential.shear) * contact.cycle_slip
        np.testing.assert_allclose(cycle.energy, energy, atol=5e-3 * energy.max())
        assert cycle.energy.sum() == pytest.approx(loop.energy, rel=2e-3)


class TestStability:
    @pytest.mark.parametrize(("share", "grows"), [(0.95, False), (1.05, True)])
    def test_errors_of_shape_grow_beyond_the_limit(self, pair, flat, share, grows):
        """Check a small error of shape on the steady state, along the stiffest direction."""
        gap = worn_evenly(pair, flat)

        def loss(shape):
            """Return the loss of both bodies per cycle, and the longest stable block."""
            cycle = pair.fretting_cycle(shape, conditions())
            per_force = 2.0 * ALPHA * FRICTION * cycle.cycle_slip / pair.areas
            limit = pair.stable_cycles(cycle.normal, per_force)
            return per_force * cycle.normal.force, limit

        steady, limit = loss(gap)
        step = share * limit
        error = np.random.default_rng(0).standard_normal(len(flat))
        sizes = []
        for _ in range(60):
            error *= 1e-9 / np.linalg.norm(error)
            change = step * (loss(gap + error)[0] - steady)
            error = error + change - (error + change).mean()
            sizes.append(np.linalg.norm(error) / 1e-9)
        # Uniform depths vanish by design; the largest other factor is |1 - 2 share|.
        assert (sizes[-1] > 1.0) == grows
        if grows:
            assert sizes[-1] == pytest.approx(2.0 * share - 1.0, rel=0.02)

    def test_a_pair_that_does_not_slide_has_no_limit(self, pair, flat):
        cycle = pair.fretting_cycle(flat, replace(conditions(), stroke=0.0))
        assert pair.stable_cycles(cycle.normal, cycle.cycle_slip) == np.inf

    def test_a_single_node_has_no_limit(self, pair, flat):
        """Check that its gap changes nothing, whatever the rounding of its compliance."""
        for node in range(len(flat)):
            gap = np.where(np.arange(len(flat)) == node, 0.0, 1.0)
            alone = pair.normal(gap, 1.0)
            assert np.count_nonzero(alone.touching) == 1
            assert pair.stable_cycles(alone, np.ones(len(flat))) == np.inf


@pytest.mark.slow
class TestRig:
    """The specimens of the rig on the default mesh, 121 nodes."""

    @pytest.fixture(scope="class")
    @staticmethod
    def rigs():
        specimen = Specimen(radii=(1000.0, 50.0))
        mesh = specimen.mesh()
        pairs = {}
        average = Constraints.average

        def but_the_ring(constraints, nodes, parents):
            if len(nodes) != specimen.ring_nodes:
                average(constraints, nodes, parents)

        for tied in (True, False):
            with pytest.MonkeyPatch.context() as patch:
                if not tied:
                    patch.setattr(Constraints, "average", but_the_ring)
                pads = pad_stiffnesses(specimen, mesh)
            pairs[tied] = ReducedPair.from_stiffness(mesh.interfaces[0], *pads)
        return pairs

    def test_stiffness_of_flat_pads(self, rigs):
        """Check about twice the measured 50 N/µm; less if the ring's points are held."""
        for tied, low, high in ((True, 95e3, 100e3), (False, 84e3, 88e3)):
            pressed = rigs[tied].normal(np.zeros(121), 17.0)
            assert low < rigs[tied].stick_stiffness(pressed) < high


def test_what_has_no_meaning_is_refused(pair, flat):
    normal = pair.normal(flat, 17.0)
    for attempt in (
        lambda: pair.normal(np.ma.array(flat, mask=flat == 0.0), 17.0),
        lambda: pair.normal(np.where(flat == 0.0, np.inf, flat), 17.0),
        lambda: pair.normal(flat[1:], 17.0),
        lambda: pair.normal(flat, 0.0),
        lambda: pair.tangential(normal, -0.01, FRICTION),
        lambda: pair.tangential(normal, 0.01, -FRICTION),
        lambda: FrettingConditions(np.nan, STROKE, FRICTION),
        lambda: FrettingConditions(17.0, STROKE, -FRICTION),
    ):
        with pytest.raises(InputError):
            attempt()
    assert pair.normal(flat.tolist(), 17.0).approach == normal.approach
