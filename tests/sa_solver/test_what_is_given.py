"""Input of public functions of the solvers: arrays of any kind, missing surfaces, named loads."""

import numpy as np
import pytest

from sa_solver import (
    ContactLoad,
    ContactLoadPath,
    CoupledContact,
    ElasticPair,
    Frame,
    FrictionalContact,
    Grid,
    HalfSpace,
    InputError,
    LoadHistory,
    LoopPath,
    Material,
    NormalContact,
    SubsurfaceStress,
    TangentialContact,
    march_history,
    partial_slip_curve,
)
from sa_solver.reference.hertz import HertzCylinder, HertzEllipse, HertzSphere
from tests.given import NO_NUMBERS, assert_refused, held_otherwise, spoilt

STEEL, SOFT = Material(210e3, 0.3), Material(70e3, 0.3)
ALIKE, UNLIKE = ElasticPair(STEEL, STEEL), ElasticPair(STEEL, SOFT)
GRID = Grid.covering((1.0, 0.8), (20, 16))
BALL = (GRID.x**2 + GRID.y**2) / 20.0
P = 100.0
LOADS = np.array([P, 0.0, 0.0, 0.0, 0.0, 0.0])
HALF_SPACE = HalfSpace(GRID, ALIKE)
LIMIT = 0.5 * NormalContact(HALF_SPACE).solve(BALL, P).pressure
TRACTION = np.stack([0.1 * LIMIT, 0.0 * LIMIT, LIMIT])


def advanced(height, pair=ALIKE, load=None):
    contact = FrictionalContact(HalfSpace(GRID, pair), 0.5)
    return contact.advance(contact.unloaded_state(height), height, load or ContactLoad(P=P))


# A valid field for each function, and the numbers that follow from it.
ENTRIES = {
    "normal": (BALL, lambda h: NormalContact(HALF_SPACE).solve(h, P).pressure),
    "compliance": (
        1e-9 * BALL,
        lambda d: NormalContact(HALF_SPACE).solve(BALL, P, compliance=d).pressure,
    ),
    "coupled": (
        BALL,
        lambda h: CoupledContact(HalfSpace(GRID, UNLIKE), 0.5).solve(h, None, LOADS).traction,
    ),
    "frictional": (BALL, lambda h: advanced(h).traction),
    "history": (
        BALL,
        lambda h: march_history(HALF_SPACE, h, ContactLoadPath([LOADS]), 0.5).states[-1].traction,
    ),
    "partial slip": (
        BALL,
        lambda h: partial_slip_curve(NormalContact(HALF_SPACE), h, P, tolerance=1e-8).force,
    ),
    "limit": (LIMIT, lambda q: TangentialContact(HALF_SPACE).solve(q, Qx=0.1).shear),
    "offset": (
        1e-6 * TRACTION[:2],
        lambda u: TangentialContact(HALF_SPACE).solve(LIMIT, u, Qx=10.0).shear,
    ),
    "displacement": (LIMIT, HALF_SPACE.normal),
    "shear": (TRACTION[:2], HALF_SPACE.shear),
    "all tractions": (TRACTION, HALF_SPACE.displacement),
    "depth": (TRACTION, lambda t: SubsurfaceStress(GRID, STEEL, 2).at_depth(t, 0.1)),
    "section": (TRACTION, lambda t: SubsurfaceStress(GRID, STEEL, 2).section(t, "x", 0.0, [0.1])),
    "points": (
        TRACTION,
        lambda t: SubsurfaceStress(GRID, STEEL, 2).at_points(t, [[0.01, 0.02, 0.1]]),
    ),
}
HEIGHTS = {"normal", "coupled", "frictional", "history", "partial slip"}
EVERY = pytest.mark.parametrize("entry", ENTRIES)


def assert_same(found, expected):
    """Assert equality up to errors of solvers, whose sums depend on memory alignment."""
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-6 * np.abs(expected).max())


@EVERY
def test_numbers_count_and_not_how_they_are_held(entry):
    """Lists, single precision, column order and strided views give the same results."""
    field, made = ENTRIES[entry]
    field = field.astype(np.float32).astype(np.float64)
    expected = made(field)
    for given in held_otherwise(field):
        found = made(given)
        assert type(found) is np.ndarray
        assert_same(found, expected)
    whole = np.round(field / np.abs(field).max() * 3.0)
    assert_same(made(whole.astype(int)), made(whole))


@EVERY
@pytest.mark.parametrize("kind", ["turned", "one", "complex", "text", "flags", "none", "masked"])
def test_what_is_no_field_of_numbers_is_refused(entry, kind):
    field, made = ENTRIES[entry]
    if kind == "none" and entry in ("compliance", "offset"):
        return  # They may be left out.
    if kind == "masked" and entry in HEIGHTS:
        assert np.isfinite(made(spoilt(field, kind))).all()
        return
    given = spoilt(field, kind)
    with pytest.raises(InputError):
        made(given)


@pytest.mark.parametrize("value", NO_NUMBERS)
def test_what_is_no_number_is_refused(value):
    contact = NormalContact(HALF_SPACE)
    attempts = (
        lambda: contact.solve(BALL, value),
        lambda: contact.solve(BALL, P, tolerance=value),
        lambda: TangentialContact(HALF_SPACE).solve(LIMIT, Qx=value),
        lambda: FrictionalContact(HALF_SPACE, value),
        lambda: CoupledContact(HALF_SPACE, value),
        lambda: ContactLoad(P=P, shift_x=value, Qx=0.0),
        lambda: LoopPath(P=value, amplitude=1e-3),
        lambda: partial_slip_curve(contact, BALL, value, tolerance=1e-8),
        lambda: Material(value, 0.3),
        lambda: Material(210e3, value),
        lambda: ElasticPair.from_contact_modulus(value),
        lambda: HertzSphere(value, 10.0, 1e5),
        lambda: Grid.line_contact(value, 8),
    )
    assert_refused(InputError, attempts)


@pytest.mark.parametrize(
    "attempt",
    [
        lambda: Grid.covering((1.0, 1.0), (8.0, 8.0)),  # Sizes and numbers of cells are exchanged.
        lambda: Grid.covering(1.0, (8, 8)),
        lambda: Grid.covering((1.0, 1.0), (8,)),
        lambda: Material(-210e3, 0.3),
        lambda: Material(210e3, 0.6),
        lambda: Material(210e3, 0.3, yield_stress=-1.0),
        lambda: HertzSphere(P, -10.0, 1e5),
        lambda: HertzCylinder(P, 0.0, 1e5),
        lambda: HertzEllipse(P, 10.0, -10.0, 1e5),
        lambda: Frame(np.zeros(3), np.diag([1.0, 1.0, -1.0])),
        lambda: Frame(np.zeros(3), np.diag([1.0, 1.0, 2.0])),
        lambda: LoopPath(P=P, amplitude=1e-3, by="motions"),
        lambda: LoopPath(P=P, amplitude=1e-3, axis="z"),
        lambda: FrictionalContact(HALF_SPACE, 0.5, sliding="forces"),
        lambda: march_history(HALF_SPACE, BALL, ContactLoadPath([LOADS]), 0.5, history="ful"),
        lambda: ContactLoadPath(LOADS),
        lambda: ContactLoadPath(np.empty((0, 6))),
        lambda: ContactLoadPath([LOADS], strain=np.zeros(2)),
        lambda: ContactLoad(LOADS[:3]),
        lambda: ContactLoad(LOADS, (True,)),
        lambda: ContactLoad(LOADS, Qx=1.0),
        lambda: ContactLoad(Qx=1.0),
        lambda: ContactLoad(P=P, approach=0.01),
        lambda: ContactLoad(P=P, My=1.0, tilt_y=0.0),
        lambda: NormalContact(HALF_SPACE).solve(BALL, P, start=BALL),
        lambda: LoadHistory(np.ma.array([1.0], mask=[True]), *[np.zeros(1)] * 7, sliding=[False]),
    ],
)
def test_what_has_no_meaning_is_refused(attempt):
    with pytest.raises(InputError):
        attempt()


# --- cells without a surface ----------------------------------------------------------------------


@pytest.mark.parametrize("form", [np.inf, "masked"])
@pytest.mark.parametrize("cells", [48, 96])
def test_a_disk_without_surroundings_is_a_flat_punch(form, cells):
    """The approach is δ = P / 2 a E* for a circle of the same area, and half a cell at its edge."""
    grid = Grid.covering((2.4, 2.4), (cells, cells))
    disk = np.hypot(grid.x, grid.y) < 1.0
    height = np.where(disk, 0.0, np.inf)
    if form == "masked":
        height = np.ma.array(np.zeros(grid.shape), mask=~disk)
    state = NormalContact(HalfSpace(grid, ALIKE)).solve(height, P)
    radius = np.sqrt(np.count_nonzero(disk) * grid.cell_area / np.pi)
    assert state.converged
    assert state.approach == pytest.approx(
        P / (2.0 * radius * ALIKE.contact_modulus), rel=0.6 / cells
    )
    assert np.all(state.pressure[disk] > 0.0)
    assert not state.pressure[~disk].any()
    assert np.all(np.isinf(state.gap[~disk]))
    # The punch is flat, so that the whole load moves by δ.
    assert state.elastic_energy == pytest.approx(0.5 * P * state.approach, rel=1e-7)


HOLE = np.hypot(GRID.x - 0.05, GRID.y) < 0.08


@pytest.mark.parametrize("pair", [ALIKE, UNLIKE], ids=["similar", "dissimilar"])
def test_nothing_touches_a_hole(pair):
    """A hole is like a pit one metre deep, for sheared bodies, free tilts and imposed approach."""
    pit, masked = np.where(HOLE, 1e3, BALL), np.ma.array(BALL, mask=HOLE)
    for load in (
        ContactLoad(P=P, Qx=20.0),
        ContactLoad(P=P, Mx=0.0, My=5.0),
        ContactLoad(approach=0.002),
    ):
        found, expected = (advanced(height, pair, load) for height in (masked, pit))
        assert found.converged
        scale = np.abs(expected.traction).max()
        np.testing.assert_allclose(found.traction, expected.traction, atol=1e-6 * scale)
        assert not found.traction[:, HOLE].any()
        assert np.all(np.isinf(found.gap[HOLE]))
        assert not found.slip[:, HOLE].any()


def test_a_load_beyond_all_surfaces_is_refused_unless_the_tilt_is_held():
    height = np.where(GRID.x > 0.2, BALL, np.inf)
    contact = NormalContact(HALF_SPACE)
    held = contact.solve(height, P)
    assert held.converged
    assert held.pressure.sum() * GRID.cell_area == pytest.approx(P)
    with pytest.raises(InputError, match="hold the tilt"):
        contact.solve(height, P, Mx=0.0, My=0.0)
    with pytest.raises(InputError, match="nothing can touch"):
        contact.solve(np.full(GRID.shape, np.inf), P)


# --- tilt -----------------------------------------------------------------------------------------


def test_a_ball_off_the_middle_is_held_unless_its_moments_are_given():
    """A free ball of radius 10 mm, offset by 0.1 mm, rolls by 0.01 rad.

    Its load is then in the middle.
    """
    height = ((GRID.x - 0.1) ** 2 + GRID.y**2) / 20.0
    contact = NormalContact(HALF_SPACE)
    hertz = HertzSphere(P, 10.0, ALIKE.contact_modulus)
    held, free = contact.solve(height, P), contact.solve(height, P, Mx=0.0, My=0.0)
    assert (held.tilt_x, held.tilt_y) == (0.0, 0.0)
    assert held.My == pytest.approx(-0.1 * P, rel=1e-6)
    assert held.approach == pytest.approx(hertz.approach, rel=5e-3)
    assert free.tilt_y == pytest.approx(0.01, rel=1e-6)
    for state in (
        advanced(height),
        advanced(height, UNLIKE),
        partial_slip_curve(contact, height, P, tolerance=1e-8).normal,
    ):
        moment = state.My if hasattr(state, "My") else state.resultants[4]
        assert moment == pytest.approx(-0.1 * P, rel=1e-6)
    assert LoopPath(P=P, amplitude=1e-3).moments is None
    turned = advanced(height, load=ContactLoad(P=P, Mx=0.0, My=0.0))
    assert turned.rigid[4] == pytest.approx(0.01, rel=1e-6)


def test_loads_by_name_are_those_by_place():
    by_name = ContactLoad(P=P, shift_x=1e-3, Qy=2.0, Mx=3.0, tilt_y=1e-4, strain=1e-5)
    motion = (False, True, False, False, True, False)
    by_place = ContactLoad([P, 1e-3, 2.0, 3.0, 1e-4, 0.0], motion, 1e-5)
    np.testing.assert_array_equal(by_name.values, by_place.values)
    assert by_name.motion == by_place.motion == motion
    assert by_name.strain == by_place.strain
    assert ContactLoad(P=P).motion == (False, False, False, True, True, False)
    assert ContactLoad(approach=0.1, twist=0.2).motion == (True, False, False, True, True, True)


# --- the border of the grid -----------------------------------------------------------------------


@pytest.mark.parametrize("pair", [ALIKE, UNLIKE], ids=["similar", "dissimilar"])
def test_a_contact_that_is_cut_off_has_a_message(pair):
    inside, cut = (advanced(height, pair) for height in (BALL, 1e-3 * BALL))
    assert inside.converged
    assert not inside.message
    assert cut.converged
    assert cut.border_load > 0.0
    assert "border" in cut.message
    assert "border" in NormalContact(HALF_SPACE).solve(1e-3 * BALL, P).message


def test_bodies_of_a_contact_modulus_are_identical():
    pair = ElasticPair.from_contact_modulus(1e5, poisson=0.25)
    assert pair.contact_modulus == pytest.approx(1e5, rel=1e-14)
    assert pair.similar
    assert pair.body_1.poisson == 0.25
