"""Sector in a travelling wave, against the whole ring, which is assembled here."""

from dataclasses import replace

import numpy as np
import pytest

from fe_models.dynamics.curves.nonlinear_mode import LinearMode
from fe_models.dynamics.curves.phase_resonance import PhaseResonance, along_phase_resonance
from fe_models.dynamics.damping import damped
from fe_models.dynamics.model import DynamicModel
from fe_models.dynamics.periodic.cycle_energy import energy_lost
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonics import HarmonicBalanceError, Resolution
from fe_models.dynamics.periodic.load import PeriodicLoad
from fe_models.dynamics.periodic.resolution_error import resolution_error
from fe_models.dynamics.rig import Link, RigError, lumped_rig, natural_frequencies
from fe_models.dynamics.rings.sector import Ring, lumped_sector, reduced_sector
from fe_models.dynamics.stability.floquet import Floquet
from fe_models.joints.reduction import ReducedModel
from tests.marks import slow
from wear.joints.friction_contact import FrictionContact
from wear.joints.jenkins import Jenkins
from wear.joints.periodic.march import PeriodicMarch

SECTORS, ORDER = 5, 2
# The same times in every sector: 2/5 of a period later.
SAMPLES, HARMONICS = 640, (0, 1, 2, 3, 4, 5, 7)
SLIDER = Jenkins(stiffness=2e3, friction=0.5, normal_load=10.0)
# Disk and blade point of each sector: the disk joins the sectors, and blades rub on each other.
MASSES = {"disk": 1e-3, "blade": 2e-3}
SPRINGS = {Link("disk"): 1e3, Link("blade", "disk"): 3e3, Link("next disk", "disk"): 1e3}
JOINTS = [[Link("next blade", "blade")], [Link("disk")]]
MORE = {"loss_factor": 0.01, "mass_factor": 2.0}
BETWEEN = 0.02
# Harmonic 5 has no nodal diameter: all sectors move in phase.
WAVES = {1: np.array([0.0, -1j]), 2: np.array([0.0, 0.3]), 5: np.array([0.1, 0.1j])}
STATIC = np.array([0.0, 3.0])


def later(sector, harmonic):
    return np.exp(-2j * np.pi * harmonic * ORDER * sector / SECTORS)


def of_all(waves, static):
    """Return the load on all sectors, given that on the first."""
    waves = {
        h: np.concatenate([wave * later(i, h) for i in range(SECTORS)]) for h, wave in waves.items()
    }
    return PeriodicLoad(waves, static=np.tile(static, SECTORS))


def blades():
    """Return a sector of blades, and the ring of all sectors."""
    sector = lumped_sector(MASSES, SPRINGS, JOINTS, Ring(SECTORS, ORDER), 0.01)
    dashpot = {Link("next blade", "blade"): BETWEEN}
    sector = replace(sector, model=damped(sector.model, dashpots=dashpot, **MORE))

    def at(name, place):
        point = name.removeprefix("next ")
        return f"{point} {(place + (point != name)) % SECTORS}"

    def placed(link, place):
        first = None if link.first is None else at(link.first, place)
        return Link(at(link.second, place), first)

    every = range(SECTORS)
    ring = lumped_rig(
        {f"{name} {i}": mass for i in every for name, mass in MASSES.items()},
        {placed(link, i): stiffness for i in every for link, stiffness in SPRINGS.items()},
        [[placed(link, i) for link in joint] for i in every for joint in JOINTS],
        0.01,
    )
    dashpots = {placed(Link("next blade", "blade"), i): BETWEEN for i in every}
    return sector, damped(ring, dashpots=dashpots, **MORE)


@pytest.fixture(scope="module")
def wave_and_ring():
    return balances(*blades())


def balances(sector, ring):
    """Return the problems of the sector in a wave, and of the whole ring."""
    march, resolution = PeriodicMarch(SLIDER), Resolution(HARMONICS, SAMPLES)
    load = PeriodicLoad(WAVES, static=STATIC)
    return (
        HarmonicBalance.of_sector(sector, march, load, resolution),
        HarmonicBalance(ring, march, of_all(WAVES, STATIC), resolution),
    )


def test_blades_that_rub_move_as_those_of_the_whole_ring(wave_and_ring):
    wave, ring = wave_and_ring
    for frequency in (100.0, 150.0):
        one, every = (problem.solve(frequency, 15.0) for problem in wave_and_ring)
        assert (one.cycle.states == 1).any(axis=0).all(), "both joints slip"
        moved = np.hstack(
            [
                one.motion * np.array([later(i, h) for h in HARMONICS])[:, None]
                for i in range(SECTORS)
            ]
        )
        assert np.abs(every.motion - moved).max() < 1e-10 * np.abs(moved).max()
        lost = SECTORS * energy_lost(wave, one)
        assert lost == pytest.approx(energy_lost(ring, every), rel=1e-10)
        # The work of the forces is independent of how energies are computed.
        forces = 15.0 * np.array([WAVES.get(h, np.zeros(2)) for h in HARMONICS])
        work = np.pi * np.array(HARMONICS) @ (one.motion.conj() * forces).imag.sum(axis=1)
        assert SECTORS * work == pytest.approx(lost, rel=2e-3)
        of_one, of_every = resolution_error(wave, one), resolution_error(ring, every)
        assert of_one.largest == pytest.approx(of_every.largest, rel=1e-2)
        assert one.left_out == pytest.approx(every.left_out, rel=1e-6)


def test_slopes_of_a_wave_are_those_by_differences(wave_and_ring):
    wave, _ = wave_and_ring
    unknowns = 1e-3 * np.random.default_rng(1).normal(size=wave.size)
    along = np.random.default_rng(2).normal(size=wave.size)
    step, at = 1e-8, wave.evaluate(unknowns, 120.0, 15.0, "frequency")
    near = [wave.evaluate(unknowns + s * step * along, 120.0, 15.0, "force") for s in (-1.0, 1.0)]
    by_differences = (near[1].residual - near[0].residual) / (2.0 * step)
    assert np.allclose(at.jacobian @ along, by_differences, rtol=1e-5, atol=1e-5)
    faster, slower = (wave.evaluate(unknowns, 120.0 + s, 15.0, "force") for s in (1e-4, -1e-4))
    slope = (faster.residual - slower.residual) / 2e-4
    assert np.allclose(at.slope, slope, rtol=1e-5, atol=1e-9 * np.abs(slope).max())
    stronger = wave.evaluate(unknowns, 120.0, 16.0, "force")
    assert np.allclose(stronger.slope, stronger.residual - at.residual, rtol=1e-9, atol=1e-15)


def test_phase_resonance_is_that_of_all_sectors(wave_and_ring):
    wave, ring = wave_and_ring
    blade, start = np.array([0.0, 1.0]), wave.solve(160.0, 15.0)
    equations = PhaseResonance.near(wave, start, blade)
    unknowns = np.append(start.coefficients.ravel(), 0.01 * equations.scale)
    along = np.random.default_rng(3).normal(size=len(unknowns))
    near = [equations(unknowns + s * 1e-9 * along, 15.0).residual for s in (-1.0, 1.0)]
    product = equations(unknowns, 15.0).jacobian @ along
    assert np.allclose(product, (near[1] - near[0]) / 2e-9, rtol=1e-4, atol=1e-4)
    backbone = along_phase_resonance(wave, start, (14.5, 15.5), blade)
    assert not backbone.message
    for motion in backbone.solutions[:: len(backbone.solutions) - 1]:
        every = ring.solve(motion.frequency, motion.force)
        assert every.amplitude(1) == pytest.approx(-abs(every.amplitude(1)), rel=1e-6)


@pytest.mark.parametrize("frequency", [100.0, slow(150.0)])
def test_stability_is_that_of_all_sectors(frequency):
    sector, ring = blades()
    # A loss factor is not defined in time.
    sector = replace(sector, model=replace(sector.model, structural=None))
    problems = balances(sector, replace(ring, structural=None))
    one, every = (
        Floquet(problem).stability(problem.solve(frequency, 15.0)) for problem in problems
    )
    assert one.verdict == every.verdict == "stable"
    assert np.allclose(np.abs(one.multipliers), np.abs(every.multipliers), atol=1e-8)


def test_equal_motion_of_all_sectors_moves_no_joint_between_them():
    sector = lumped_sector(MASSES, SPRINGS, JOINTS[:1], Ring(SECTORS, ORDER), 0.01)
    load = PeriodicLoad({1: np.array([0.0, -1j])}, static=STATIC)
    resolution = Resolution((0, 1, 3), 256)
    motion = HarmonicBalance.of_sector(sector, PeriodicMarch(SLIDER), load, resolution).solve(
        150.0, 15.0
    )
    assert motion.converged
    # Springs join the ground to the disk, and the disk to the blade.
    assert motion.amplitude(1, harmonic=0) == pytest.approx(3.0 / 1e3 + 3.0 / 3e3, rel=1e-9)


def test_a_ring_too_large_has_no_verdict():
    sector = lumped_sector({"a": 1e-3}, {Link("a"): 1e3}, [[Link("a")]], Ring(300, 7), 0.01)
    load = PeriodicLoad({1: np.ones(1)})
    problem = HarmonicBalance.of_sector(sector, PeriodicMarch(SLIDER), load, Resolution((1,), 64))
    stability = Floquet(problem).stability(problem.solve(100.0, 1.0))
    assert stability.verdict == "unknown"
    assert "300 modes" in stability.message


# --- three directions, on a rotated ring ---------------------------------------------------------

AXES = "xyz"
HEAVY = 2e-3
HELD = np.array([[4e3, 500.0, 0.0], [500.0, 3e3, 200.0], [0.0, 200.0, 5e3]])
CONTACT = FrictionContact(stiffness=2e3, normal_stiffness=3e3, normal_load=20.0, friction=0.3)


def turned(sector):
    angle = 2.0 * np.pi * sector / SECTORS
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def test_shrouds_that_touch_move_as_those_of_the_whole_ring():
    """Blades of one mass each have fixed axes; contacts close along y of the first."""
    names = [f"tip {axis}" for axis in AXES]
    kept = np.arange(3)
    body = ReducedModel(
        kept, HELD, HEAVY * np.eye(3), np.zeros((3, 0)), np.zeros((3, 0)), np.zeros(0)
    )
    joint = [Link(f"tip {axis}", f"next tip {axis}") for axis in "xzy"]
    sector = reduced_sector(
        body, names, [joint], Ring(SECTORS, ORDER, axis="z"), damping_ratio=0.02
    )
    every = range(SECTORS)
    stiffness, connection = np.zeros((3 * SECTORS,) * 2), np.zeros((3 * SECTORS,) * 2)
    for i in every:
        # Axes of the sector, and the directions of its x, z, y among those of all.
        rows, after = slice(3 * i, 3 * i + 3), slice(3 * ((i + 1) % SECTORS), None)
        after = slice(after.start, after.start + 3)
        stiffness[rows, rows] = turned(i) @ HELD @ turned(i).T
        directions = turned(i).T[[0, 2, 1]]
        connection[rows, rows] += directions
        connection[rows, after] -= directions
    mass = HEAVY * np.eye(3 * SECTORS)
    squares, shapes = np.linalg.eigh(stiffness / HEAVY)
    damping = HEAVY * shapes @ np.diag(0.04 * np.sqrt(squares)) @ shapes.T
    ring = DynamicModel(mass, damping, stiffness, connection, ("",) * (3 * SECTORS))
    march, resolution = PeriodicMarch(CONTACT), Resolution((0, 1, 2, 3), 640)
    wave = np.array([1.0, 1j, 0.4])
    # This load presses the shrouds together; the same load everywhere does not.
    one = HarmonicBalance.of_sector(
        sector, march, PeriodicLoad({1: wave}, static=_balancing(sector.at(0))), resolution
    )
    loads = {1: np.concatenate([turned(i) @ wave * later(i, 1) for i in every])}
    static = np.concatenate([turned(i) @ _balancing(sector.at(0)) for i in every])
    whole = HarmonicBalance(ring, march, PeriodicLoad(loads, static=static), resolution)
    found, all_found = one.solve(210.0, 25.0), whole.solve(210.0, 25.0)
    assert found.converged
    assert all_found.converged
    assert set(np.unique(found.cycle.states)) == {0, 1, 2}, "they stick, slip and part"
    scale = np.abs(found.motion).max()
    for i in every:
        shift = np.array([later(i, h) for h in (0, 1, 2, 3)])[:, None]
        moved = shift * found.motion @ turned(i).T
        assert np.abs(all_found.motion[:, 3 * i : 3 * i + 3] - moved).max() < 1e-8 * scale


def _balancing(model):
    """Return the load that balances contacts which are pressed and have not moved."""
    force = CONTACT.respond(CONTACT.rest(1), np.zeros((1, 3))).force
    return force.ravel() @ model.connection


def test_a_sector_cut_through_its_disk_has_the_frequencies_of_the_whole_one():
    """Three masses of a rim, the last of which is the first of the next sector."""
    chain = 1e3 * np.array([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    names = [f"{point} {axis}" for axis in "xy" for point in ("left", "middle", "right")]
    stiffness = np.kron(np.diag([1.0, 0.5]), chain) + 200.0 * np.eye(6)
    mass = 1e-3 * np.diag([0.5, 1.0, 0.5] * 2)
    empty = np.zeros((6, 0))
    body = ReducedModel(np.arange(6), stiffness, mass, empty, empty, np.zeros(0))
    ring = Ring(SECTORS, 1, ties={"right x": "left x", "right y": "left y"})
    sector = reduced_sector(body, names, [], ring)
    found = np.sort(
        np.concatenate([natural_frequencies(sector.at(shift)) for shift in range(SECTORS)])
    )
    # A ring of twice as many masses, in which both springs hold the masses at the cuts.
    count = 2 * SECTORS
    ground = np.diag([400.0, 200.0] * SECTORS)
    around = 2.0 * np.eye(count) - np.roll(np.eye(count), 1, 0) - np.roll(np.eye(count), -1, 0)
    squares = [np.linalg.eigvalsh((share * 1e3 * around + ground) / 1e-3) for share in (1.0, 0.5)]
    expected = np.sort(np.sqrt(np.concatenate(squares))) / (2.0 * np.pi)
    assert np.allclose(found, expected, rtol=1e-10)


def test_invalid_uses_of_a_wave_are_refused():
    sector, _ = blades()
    load = PeriodicLoad({1: np.array([0.0, 1.0])})
    wave = HarmonicBalance.of_sector(sector, PeriodicMarch(SLIDER), load, Resolution((1,), 64))
    for use in (lambda: LinearMode.of(wave, 1), lambda: wave.uniform_receptance):
        with pytest.raises(HarmonicBalanceError, match="only its responses"):
            use()
    with pytest.raises(RigError, match="2 sectors or more"):
        Ring(1, 1)
    with pytest.raises(RigError, match="give x, y, z"):
        Ring(4, 1, axis="w")
    with pytest.raises(RigError, match="right x: give one of the sector's"):
        lumped_sector({"a": 1.0}, {}, [], Ring(4, 1, ties={"right x": "a"}))
