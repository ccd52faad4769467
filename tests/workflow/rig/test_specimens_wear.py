"""Tests of wear of reduced specimens in cycle blocks, by every law; and of the rig's specimens."""

import numpy as np
import pytest

from fe_models.geometry.specimens import Specimen
from fe_models.joints.reduced_contact import FrettingConditions, ReducedPair
from tests.reduced_pads import ALPHA, FRICTION, SOLVER, STROKE, coarse_pads, pad_stiffnesses
from wear.contact.nodes import NodalState
from wear.laws import EnergyLaw
from wear.steps.marching import rest
from wear.steps.steppers import ExplicitStepper, StabilityError
from workflow.analyses.specimens.case import SpecimensCase
from workflow.errors import CaseError
from workflow.kinds import load_case
from workflow.models.specimens.wear import FrettedPair, wear_in_cycle_blocks


@pytest.fixture(scope="module")
def pair():
    """Return a coarse pair of crossed strips."""
    face, pads = coarse_pads()
    return ReducedPair.from_stiffness(face, *pads)


@pytest.fixture(scope="module")
def flat(pair):
    return np.zeros(len(pair.face))


@pytest.fixture(scope="module")
def curved(pair):
    return pair.face.gap


def worn(
    pair,
    gap,
    cycles,
    force=17.0,
    laws=(ALPHA, ALPHA),
    stepper=ExplicitStepper(0.5),  # noqa: B008 - frozen
    stroke=STROKE,
):
    """Return the states at all blocks."""
    fretted = FrettedPair(
        pair, tuple(map(EnergyLaw, laws)), FrettingConditions(force, stroke, FRICTION)
    )
    return wear_in_cycle_blocks(fretted, gap, stepper, lambda block: rest(cycles, block.cycles))


class TestWear:
    def test_volume_is_alpha_times_energy(self, pair, curved):
        *_, last = worn(pair, curved, 1e5, laws=(ALPHA, 3.0 * ALPHA))
        assert last.cycles == 1e5
        assert last.contact.converged
        volumes = last.depths @ pair.areas
        np.testing.assert_allclose(volumes, [ALPHA * last.energy, 3.0 * ALPHA * last.energy])
        np.testing.assert_allclose(
            last.state.surfaces.gap, curved + last.depths.sum(axis=0), rtol=1e-12
        )

    def test_cycles_scale_with_the_wear_coefficients(self, pair, curved):
        *_, slow = worn(pair, curved, 1e5)
        *_, fast = worn(pair, curved, 1e4, laws=(20.0 * ALPHA, 0.0))
        np.testing.assert_allclose(fast.state.surfaces.gap, slow.state.surfaces.gap, rtol=1e-9)

    def test_flat_pads_wear_to_an_even_pressure(self, pair, flat):
        first, *_, last = worn(pair, flat, 1e6)
        assert first.contact.normal.pressure.max() > 3.0 * 17.0
        # Steady: every node loses the same depth, so p varies as 1/slip, by elastic parts of it.
        wear = last.wear[0]
        np.testing.assert_allclose(wear, wear.mean(), rtol=1e-6)
        np.testing.assert_allclose(last.contact.normal.pressure, 17.0, rtol=0.03)
        assert last.contact.friction == pytest.approx(FRICTION, rel=SOLVER)

    def test_curved_pads_grow_into_contact(self, pair, curved):
        states = list(worn(pair, curved, 1e6, 87.0))
        areas = np.array([s.contact.normal.area for s in states])
        stiffness = np.array([s.contact.stick_stiffness for s in states])
        assert areas[0] < 0.6
        assert areas[-1] == pytest.approx(1.0)
        assert np.all(np.diff(areas) > -1e-12)
        assert np.all(np.diff(stiffness) > -1e-6)
        assert stiffness[-1] > 1.4 * stiffness[0]

    def test_shorter_blocks_converge_at_first_order(self, pair, curved):
        depths = []
        for block in (1600.0, 800.0, 400.0, 25.0):
            *_, last = worn(pair, curved, 16e3, stepper=ExplicitStepper(cycles=block))
            depths.append(last.depths[0])
        errors = [np.abs(depth - depths[-1]).max() for depth in depths[:-1]]
        assert np.all(np.divide(errors[:-1], errors[1:]) > 1.6)

    def test_too_long_a_block_is_refused(self, pair, flat):
        first = next(worn(pair, flat, 1e6))
        block = ExplicitStepper(cycles=1.5 * first.stable_cycles)
        with pytest.raises(StabilityError, match="take at most"):
            list(worn(pair, flat, 1e6, stepper=block))

    def test_stationary_pair_does_not_wear(self, pair, flat):
        first, last = worn(pair, flat, 1e4, stroke=0.0)
        assert first.stable_cycles == np.inf
        assert not last.depths.any()
        assert last.energy == 0.0


class TestLaws:
    """Laws of wear cases, compared with rates computed by hand from slips and pressures."""

    @pytest.fixture
    @staticmethod
    def laws(dovetail_path):
        def read(*overrides):
            case = load_case(dovetail_path.with_name("specimens_coarse.yaml"), overrides)
            assert isinstance(case, SpecimensCase)
            return case.laws

        return read

    @pytest.fixture
    @staticmethod
    def unworn(pair, curved):
        conditions = FrettingConditions(87.0, STROKE, FRICTION)

        def rates(laws, state=None):
            """Return the depths worn in a cycle, and pressure and slip of that cycle."""
            fretted = FrettedPair(pair, laws, conditions)
            state = state or NodalState.unworn(curved)
            wear, cycle = fretted.contact_at(state).wear(state), fretted.cycle_at(state).contact
            return np.stack(wear), cycle.normal.pressure, cycle.cycle_slip

        return rates

    def test_energy_is_the_default(self, laws, unworn):
        wear, pressure, slip = unworn(laws("wear.body_2.coefficient=3000 um^3/J"))
        expected = np.outer([1.5e-9, 3e-9], FRICTION * pressure * slip)
        np.testing.assert_allclose(wear, expected, rtol=1e-12)
        assert wear.any()

    def test_archard(self, laws, unworn):
        body = "{law: archard, coefficient: 2e-6, hardness: 4 GPa}"
        wear, pressure, slip = unworn(laws(f"wear.body_1={body}"))
        np.testing.assert_allclose(wear[0], 2e-6 / 4000.0 * pressure * slip, rtol=1e-12)
        np.testing.assert_allclose(wear[1], 1.5e-9 * FRICTION * pressure * slip, rtol=1e-12)

    def test_energy_amplitude(self, laws, unworn):
        """The amplitude is a quarter of the path that a node slides in a cycle."""
        wear, pressure, slip = unworn(
            laws("wear.law=energy_amplitude", "wear.reference_amplitude=5 um")
        )
        expected = 1.5e-9 * slip / 4.0 / 5e-3 * FRICTION * pressure * slip
        np.testing.assert_allclose(wear, [expected, expected], rtol=1e-12)

    @pytest.mark.parametrize("scope", ["local", "global"])
    def test_coefficient_that_changes_with_energy(self, laws, unworn, pair, curved, scope):
        """The coefficient follows its table, locally or uniformly."""
        table = f"{{scope: {scope}, energy: [0, 500], factor: [1, 3]}}"
        changing = laws(f"wear.body_1.evolution={table}")
        fretted = FrettedPair(pair, changing, FrettingConditions(87.0, STROKE, FRICTION))
        state = NodalState.unworn(curved)
        state = fretted.contact_at(state).explicit_step(state, 40.0).state
        wear, pressure, slip = unworn(changing, state)
        surfaces = state.surfaces
        dissipated = surfaces.work_1 if scope == "local" else state.energy
        factor = np.interp(dissipated, [0.0, 500.0], [1.0, 3.0])
        assert np.all(factor < 3.0)
        assert np.max(factor) > 1.05
        np.testing.assert_allclose(
            wear[0], factor * 1.5e-9 * FRICTION * pressure * slip, rtol=1e-12
        )
        np.testing.assert_allclose(wear[1], 1.5e-9 * FRICTION * pressure * slip, rtol=1e-12)

    def test_nothing_wears_below_a_threshold(self, laws, pair, curved):
        """V = α (ΣEd - Ed_th) holds in blocks whose end is not known beforehand."""
        threshold = 400.0
        with_threshold = laws(
            *(f"wear.body_{n}.evolution={{scope: global, threshold: {threshold}}}" for n in (1, 2))
        )
        fretted = FrettedPair(pair, with_threshold, FrettingConditions(87.0, STROKE, FRICTION))
        states = list(
            wear_in_cycle_blocks(
                fretted, curved, ExplicitStepper(0.5), lambda block: rest(2e4, block.cycles)
            )
        )
        assert states[0].stable_cycles == np.inf
        end = states[-1]
        assert end.energy > 2.0 * threshold
        volumes = end.depths @ pair.areas
        np.testing.assert_allclose(volumes, 1.5e-9 * (end.energy - threshold), rtol=1e-9)
        for state in states:
            assert state.depths.any() == (state.energy > threshold)

    def test_reported_cycles_want_a_constant_coefficient(self, laws):
        reported = "wear.reported=[{normal_force: 60 N, steady: stiffness, cycles: 1e5}]"
        assert laws(reported)
        for other in (
            "wear.body_1={law: archard, coefficient: 1e-6, hardness: 4 GPa}",
            "wear.body_2.evolution={scope: global, energy: [0, 1], factor: [1, 2]}",
        ):
            with pytest.raises(CaseError, match="archard"):
                laws(reported, other)


@pytest.mark.slow
class TestRig:
    """Specimens of the rig on the default mesh, 121 nodes; α of 1500 µm³/J for either body."""

    @pytest.fixture(scope="class")
    @staticmethod
    def rig():
        specimen = Specimen(radii=(1000.0, 50.0))
        mesh = specimen.mesh()
        return ReducedPair.from_stiffness(mesh.interfaces[0], *pad_stiffnesses(specimen, mesh))

    def test_flat_pads(self, rig):
        """Pressure becomes uniform in some 1e4 cycles; the secant falls, as edges slip earlier."""
        states = list(worn(rig, np.zeros(121), 1.5e5))
        cycles = np.array([s.cycles for s in states])
        peaks = np.array([s.contact.normal.pressure.max() for s in states]) / 17.0
        assert 1e4 < cycles[np.argmax(peaks < 1.2)] < 1e5
        curves = [
            rig.virgin_curve(s.contact.normal, np.linspace(0.0, 1e-3, 1000), FRICTION)
            for s in (states[0], states[-1])
        ]
        before, after = (curve.secant_stiffness(0.5) for curve in curves)
        assert 0.9 * before < after < 0.97 * before

    def test_curved_pads(self, rig):
        """The steady stiffness is reached after cycles ~ 1/F, at nearly the same energy."""
        steady, energies = {}, {}
        for force, cycles in ((17.0, 4e6), (87.0, 1e6), (150.0, 6e5), (250.0, 4e5)):
            states = list(worn(rig, rig.face.gap, cycles, force))
            stiffness = np.array([s.contact.stick_stiffness for s in states])
            assert stiffness[-1] == pytest.approx(96.0e3, rel=0.01)
            at = int(np.argmax(stiffness > 0.99 * stiffness[-1]))
            steady[force], energies[force] = states[at].cycles, states[at].energy
        assert 2e6 < steady[17.0] < 3.5e6
        assert steady[17.0] > steady[87.0] > steady[150.0] > steady[250.0]
        assert steady[17.0] / steady[87.0] == pytest.approx(87.0 / 17.0, rel=0.1)
        assert max(energies.values()) < 1.5 * min(energies.values())
