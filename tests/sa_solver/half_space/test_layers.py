"""Layered bodies: waves, influence coefficients, stress, and contacts on coatings."""

import itertools

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import jv

from sa_solver import (
    ContactLoad,
    ElasticPair,
    FrictionalContact,
    Grid,
    HalfSpace,
    InputError,
    Layer,
    Material,
    NormalContact,
    SubsurfaceStress,
)
from sa_solver.half_space.cell_means import CellIntegrals
from sa_solver.half_space.hankel import WaveNumbers
from sa_solver.half_space.influence import X, Y, Z
from sa_solver.half_space.layers import body_compliances, split, wave_stress
from sa_solver.reference.hertz import HertzSphere
from tests.oracles.coated_block import sphere_on_coating
from tests.oracles.elastic_layer import softness
from tests.oracles.layered_column import column, column_compliances

slow = pytest.mark.slow

STEEL = Material(200e3, 0.3)
RIGID = Material(np.inf, 0.3)
BODIES = {
    "soft": Material(200e3, 0.3, layers=(Layer(0.05, 50e3, 0.4),)),
    "stiff on soft": Material(100e3, 0.3, layers=(Layer(0.05, 500e3, 0.2), Layer(0.1, 20e3, 0.35))),
    "on a rigid body": Material(np.inf, 0.3, layers=(Layer(0.05, 50e3, 0.4),)),
}
COMPONENTS = list(itertools.product((X, Y, Z), repeat=2))
GRIDS = {"area": Grid.covering((1.0, 0.6), (20, 12)), "line": Grid.line_contact(1.0, 20)}


def all_compliances(body, wave_numbers):
    found = body_compliances(body, np.asarray(wave_numbers))
    return np.array([found.normal, found.along, found.across, found.coupling])


@pytest.mark.parametrize("wave_number", [1.0, 20.0, 100.0])
@pytest.mark.parametrize("body", BODIES.values(), ids=BODIES)
def test_waves_move_the_surface_as_the_energy_says(body, wave_number):
    by_energy = column_compliances(body, wave_number)
    assert all_compliances(body, [wave_number])[:, 0] == pytest.approx(by_energy, rel=1e-7)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.5])
def test_a_layer_on_a_rigid_base_is_meijers(poisson):
    body, k = Material(np.inf, 0.3, layers=(Layer(0.2, 1e3, poisson),)), np.geomspace(1e-2, 1e3, 60)
    alone = 2.0 * (1.0 - poisson**2) / 1e3
    assert all_compliances(body, k)[0] == pytest.approx(
        alone * softness(0.2 * k, poisson), rel=1e-9
    )


@pytest.mark.parametrize("depth", [0.02, 0.0499, 0.11, 0.3])
def test_stress_below_a_wave_is_that_of_the_strain(depth):
    body, k = BODIES["stiff on soft"], 12.0
    _, layer, _ = split(body, depth)
    shear = 0.5 * layer.young / (1.0 + layer.poisson)
    lame = 2.0 * shear * layer.poisson / (1.0 - 2.0 * layer.poisson)
    (a, w, v), (da, dw, dv) = strains(body, k, depth)
    dilatation = dw - k * a
    by_strain = np.array(
        [
            lame * dilatation - 2.0 * shear * k * a,
            lame * dilatation,
            lame * dilatation + 2.0 * shear * dw,
            shear * (da + k * w),
        ]
    )
    # The wave of pressure is cos ks, that of shear -sin ks, which is ahead of it.
    found = wave_stress(body, depth, np.array([k]))
    assert found.pressed[:, 0] == pytest.approx(by_strain[:, 1], rel=2e-4, abs=1e-5)
    assert found.sheared[:, 0] == pytest.approx(
        [-1, -1, -1, 1] * by_strain[:, 0], rel=2e-4, abs=1e-5
    )
    assert found.across[:, 0] == pytest.approx([shear * dv[2], shear * k * v[2]], rel=2e-4)


def strains(body, k, depth):
    """Return (a, w, v) and their slopes ``(3, 3)`` under ts, tz and tt at a depth."""
    basis, moved = column(body, k)
    step = 2e-5
    near = np.array([[depth - step, depth + step]])
    values = np.array([basis.interpolator(one)(near) for one in moved]).reshape(3, 3, 2)
    return values.mean(axis=2).T, (np.diff(values, axis=2)[:, :, 0] / (2.0 * step)).T


def layers_like(material):
    """Return the ``material`` with layers of its own material."""
    like = [Layer(h, material.young, material.poisson) for h in (0.03, 0.1)]
    return Material(material.young, material.poisson, layers=like)


@pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)
def test_layers_of_the_bodys_own_material_change_nothing(grid):
    other = Material(70e3, 0.2)
    plain = HalfSpace(grid, ElasticPair(STEEL, other))
    layered = HalfSpace(grid, ElasticPair(layers_like(STEEL), layers_like(other)))
    for row, column_ in COMPONENTS:
        scale = np.abs(plain.symbol(row, row)).max()
        difference = layered.symbol(row, column_) - plain.symbol(row, column_)
        assert np.abs(difference).max() < 1e-12 * scale


@pytest.mark.parametrize("depth", [0.0, 0.02, 0.03, 0.08, 0.2])
@pytest.mark.parametrize("body", [1, 2])
@pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)
def test_stress_in_layers_of_the_bodys_own_material(grid, body, depth):
    traction = np.random.default_rng(1).uniform(-1.0, 1.0, (3, *grid.shape))
    plain, layered = (
        SubsurfaceStress(grid, material, body).at_depth(traction, depth)
        for material in (STEEL, layers_like(STEEL))
    )
    assert layered == pytest.approx(plain, abs=1e-10)


def coated(thickness, share, poisson=0.3):
    return Material(200e3, 0.3, layers=(Layer(thickness, share * 200e3, poisson),))


@pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)
@pytest.mark.parametrize("component", [(X, X), (Y, Y), (Z, Z), (X, Z)])
def test_thin_layers_tend_to_the_body_below_with_their_thickness(grid, component):
    plain = HalfSpace(grid, ElasticPair(RIGID, STEEL)).symbol(*component)
    away = [
        np.abs(HalfSpace(grid, ElasticPair(RIGID, coated(h, 0.5))).symbol(*component) - plain).max()
        for h in (2e-4, 1e-4)
    ]
    assert away[0] / away[1] == pytest.approx(2.0, rel=0.02)


@pytest.mark.parametrize("component", [(X, X), (Y, Y), (Z, Z)])
def test_thick_layers_tend_to_their_own_material(component):
    """Over a grid of size L the body below adds a constant, and then (L/h)²."""
    grid = GRIDS["area"]
    alone = HalfSpace(grid, ElasticPair(RIGID, Material(100e3, 0.3)))
    traction = np.zeros((3, *grid.shape))
    traction[component[0], 8:12, 5:7] = 1.0
    expected = alone.displacement(traction)[component[0]]
    away = []
    for thickness in (20.0, 40.0):
        half_space = HalfSpace(grid, ElasticPair(RIGID, coated(thickness, 0.5)))
        change = half_space.displacement(traction)[component[0]] - expected
        away.append(np.ptp(change))
    assert away[0] / away[1] == pytest.approx(8.0, rel=0.05)


def test_hankel_transforms_are_those_of_quadrature():
    waves = WaveNumbers(0.1, 0.3)
    k = waves.values
    for order, r in itertools.product((0, 1, 2, 3), (0.02, 0.3, 5.0)):
        found = waves.transform(np.exp(-0.2 * k) / (1.0 + 0.3 * k), order)(np.array(r))
        by_quadrature, _ = quad(
            lambda q, n=order, r=r: np.exp(-0.2 * q) / (1.0 + 0.3 * q) * jv(n, q * r),
            *(0.0, 150.0),
            limit=4000,
            epsabs=1e-12,
        )
        assert found == pytest.approx(by_quadrature, rel=1e-8, abs=1e-9)


@pytest.mark.parametrize("cells", [7, 400])
@pytest.mark.parametrize("odd", [False, True])
def test_means_over_cells_are_exact(cells, odd):
    edges, smooth = np.linspace(-0.05, 3.0, cells + 1), 0.1
    integrals = CellIntegrals(edges, smooth, odd)
    x = integrals.points
    found = integrals.weights @ (x**odd / (x**2 + 0.2**2))
    whole = 0.5 * np.log(edges**2 + 0.04) if odd else np.arctan(edges / 0.2) / 0.2
    assert found == pytest.approx(np.diff(whole), rel=1e-9)


@pytest.mark.parametrize(
    "share", [0.25, 4.0, pytest.param(0.5, marks=slow), pytest.param(2.0, marks=slow)]
)
def test_a_sphere_on_a_coating_is_that_of_finite_elements(share):
    radius, load = 10.0, 100.0
    hertz = HertzSphere(load, radius, ElasticPair(RIGID, STEEL).contact_modulus)
    scale = hertz.contact_radius
    body = coated(scale, share)
    approach, rings, pressure = sphere_on_coating(body, radius, load, scale)
    grid = Grid.covering((3.2 * scale, 3.2 * scale), (129, 129))
    half_space = HalfSpace(grid, ElasticPair(RIGID, body))
    state = NormalContact(half_space).solve((grid.x**2 + grid.y**2) / (2.0 * radius), P=load)
    # The finite elements are 3e-4 off with as many rings.
    assert state.approach == pytest.approx(approach, rel=1e-3)
    middle = (rings > 0.2 * scale) & (rings < 0.5 * scale)
    along = np.interp(rings[middle], grid.x[64:, 0], state.pressure[64:, 64])
    assert along == pytest.approx(pressure[middle], rel=2e-3)


@pytest.mark.parametrize("share", [0.2, 5.0])
def test_a_coating_costs_no_more_convolutions(share):
    grid = Grid.covering((1.0, 1.0), (64, 64))
    rough = np.random.default_rng(3).normal(0.0, 2e-4, grid.shape)
    height = (grid.x**2 + grid.y**2) / 20.0 + rough
    counts = []
    for body in (STEEL, coated(0.2, share)):
        half_space = HalfSpace(grid, ElasticPair(STEEL, body))
        NormalContact(half_space).solve(height, P=100.0)
        counts.append(half_space.count)
    assert counts[1] <= 1.3 * counts[0]


def test_the_periodic_half_space_has_the_compliances_of_its_waves():
    grid, body = Grid.covering((1.0, 0.5), (16, 8)), coated(0.05, 3.0)
    half_space = HalfSpace(grid, ElasticPair(body, body), periodic=True)
    k = 2.0 * np.pi
    normal, along, across, _ = 2.0 * all_compliances(body, [k])[:, 0] / k
    wave = np.cos(k * grid.x) * np.ones(grid.shape)
    assert half_space.normal(wave) == pytest.approx(normal * wave, rel=1e-10, abs=1e-15)
    moved = half_space.shear(np.stack([wave, wave]))
    assert moved == pytest.approx(np.stack([along * wave, across * wave]), rel=1e-10, abs=1e-15)


def test_a_coated_body_sheared_on_a_plain_one_keeps_its_balances():
    grid, load, friction = Grid.covering((0.6, 0.6), (24, 24)), 60.0, 0.5
    pair = ElasticPair(STEEL, coated(0.1, 0.4, 0.2))
    contact = FrictionalContact(HalfSpace(grid, pair), friction)
    height = (grid.x**2 + grid.y**2) / 20.0
    state = contact.unloaded_state(height)
    for share in (0.0, 0.3, 0.6, 0.0, -0.6):
        values = np.array([load, share * friction * load, 0.0, 0.0, 0.0, 0.0])
        state = contact.advance(state, height, ContactLoad(values))
        assert state.converged
        assert state.resultants[:2] == pytest.approx(values[:2], abs=1e-5 * load)
        held = np.hypot(*state.shear) - friction * state.pressure
        assert held.max() < 1e-5 * state.pressure.max()
        assert state.energy.sum() >= 0.0


def test_the_jump_of_stress_at_an_interface():
    """Above and below it, σzz and σzx agree and the strain εxx does too."""
    grid, body = Grid.line_contact(1.0, 40), coated(0.1, 0.25, 0.4)
    traction = np.zeros((3, 40, 1))
    traction[0, 15:25], traction[2, 10:30] = 30.0, 100.0
    stress = SubsurfaceStress(grid, body, 2)
    above, below = (stress.at_depth(traction, z)[:, :, 0] for z in (0.1, np.nextafter(0.1, 1.0)))
    assert above[[2, 5]] == pytest.approx(below[[2, 5]], abs=1e-6)
    strains_xx = [
        (s[0] - nu * (s[1] + s[2])) / young
        for s, young, nu in ((above, 50e3, 0.4), (below, 200e3, 0.3))
    ]
    assert strains_xx[0] == pytest.approx(strains_xx[1], abs=1e-10)
    assert np.abs(above[0] - below[0]).max() > 5.0


def test_a_rigid_body_below_layers_has_no_stress():
    stress = SubsurfaceStress(GRIDS["line"], BODIES["on a rigid body"], 2)
    traction = np.ones((3, 20, 1))
    assert np.isfinite(stress.at_depth(traction, 0.05)).all()
    with pytest.raises(InputError, match="rigid"):
        stress.at_depth(traction, 0.06)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (lambda: Layer(0.0, 1e3, 0.3), "thickness"),
        (lambda: Layer(np.inf, 1e3, 0.3), "thickness"),
        (lambda: Layer(0.1, np.inf, 0.3), "Young"),
        (lambda: Layer(0.1, 1e3, 0.6), "Poisson"),
        (lambda: Material(1e3, 0.3, layers=Layer(0.1, 1e3, 0.3)), "layers"),
        (lambda: Material(1e3, 0.3, layers=[0.1]), "layers"),
    ],
)
def test_nonsense_is_refused(given, said):
    with pytest.raises(InputError, match=said):
        given()
