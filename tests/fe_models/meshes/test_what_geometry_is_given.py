"""What public functions of geometries are given: places of any kind, and sizes that are none."""

import numpy as np
import pytest

from fe_models.geometry import Dovetail, Specimen, read_bodies
from fe_models.meshes.structure_mesh import MeshError
from tests.given import NO_NUMBERS, assert_refused, held_otherwise, spoilt

SECTION = {
    "flank_angle": np.radians(45.0),
    "flank_length": 3.0,
    "edge_radius": 20.0,
    "edge_width": 1.0,
    "neck_width": 8.0,
    "neck_fillet": 2.0,
    "root_depth": 5.0,
    "shank_height": 10.0,
    "slot_length": 20.0,
    "slot_fillet": 2.0,
    "slot_clearance": 1.0,
    "lug_height": 5.0,
    "disk_height": 20.0,
    "rim_radius": 300.0,
    "blades": 60,
}
JOINT, STRIPS = Dovetail(**SECTION), Specimen(radii=(128.0, 64.0))
X, Y = np.array([-0.5, 0.0, 1.75, 2.0]), np.array([0.25, 0.5, 0.0, -1.0])

# Of each entry a good field, and the numbers that it makes of it.
ENTRIES = {
    "across a flank": (X, lambda x: JOINT.flank_gap(x, Y, side=1)),
    "along a flank": (Y, lambda y: Dovetail(**SECTION, skew=0.125).flank_gap(X, y, side=-1)),
    "along a strip": (X, lambda x: STRIPS.gap(x, Y)),
    "across a strip": (Y, lambda y: STRIPS.gap(X, y)),
    "radii": (np.array([128.0, 64.0]), lambda radii: Specimen(radii=radii).gap(X, Y)),
}
EVERY = pytest.mark.parametrize("entry", ENTRIES)


@EVERY
def test_numbers_count_and_not_how_they_are_held(entry):
    field, made = ENTRIES[entry]
    expected = made(field)
    for given in held_otherwise(field):
        found = made(given)
        assert type(found) is np.ndarray
        np.testing.assert_array_equal(found, expected)
    whole = np.rint(field)
    np.testing.assert_array_equal(made(whole.astype(int)), made(whole))


def test_places_are_those_of_rows_and_columns():
    """As a grid has them: each column beside each row."""
    for gap in (STRIPS.gap, lambda x, y: JOINT.flank_gap(x, y, side=1)):
        rows = np.stack([gap(x, Y) for x in X])
        np.testing.assert_array_equal(gap(X[:, None], Y[None]), rows)


@EVERY
@pytest.mark.parametrize("kind", ["complex", "text", "flags", "none", "masked", "missing", "short"])
def test_what_is_no_field_of_numbers_is_refused(entry, kind):
    field, made = ENTRIES[entry]
    if kind == "none" and entry == "radii":
        return  # of flat strips
    given = spoilt(field, kind)
    with pytest.raises(MeshError):
        made(given)


@pytest.mark.parametrize("value", NO_NUMBERS)
def test_what_is_no_number_is_refused(value):
    attempts = (
        *(lambda name=name: Dovetail(**SECTION | {name: value}) for name in SECTION),
        lambda: Dovetail(**SECTION, skew=value),
        lambda: Dovetail(**SECTION, end_width=value),
        lambda: Specimen(diameter=value),
        lambda: Specimen(ring_distance=value),
        lambda: Specimen(pad_elements=value),
        lambda: Specimen(ring_nodes=value),
        lambda: STRIPS.mesh(size=value),
        lambda: STRIPS.mesh(growth=value),
        lambda: JOINT.mesh((9, 9), size=value),
        lambda: JOINT.mesh((9, 9), size=4.0, notch=value),
        lambda: JOINT.mesh((value, 9), size=4.0),
        lambda: read_bodies("plate.step", size=value),
    )
    assert_refused(MeshError, attempts)


@pytest.mark.parametrize(
    "attempt",
    [
        lambda: STRIPS.gap(100.0, 0.0),  # where there is no strip
        lambda: STRIPS.mesh(size=0.0),
        lambda: JOINT.flank_frame(0),
        lambda: JOINT.flank_gap(X, Y, side=2),
        lambda: JOINT.mesh(9, size=4.0),
        lambda: JOINT.mesh((9.5, 9), size=4.0),
        lambda: JOINT.mesh((1, 9), size=4.0),
        lambda: JOINT.mesh((9, 9), size=4.0, dimension=1),
        lambda: JOINT.mesh((9, 9), size=4.0, order=3),
        lambda: JOINT.mesh((10, 9), size=4.0, order=2),  # an element has three nodes on an edge
        lambda: Dovetail(**SECTION | {"blades": 1}),
        lambda: read_bodies("plate.inp", unit="metre"),
        lambda: read_bodies("plate.step", size=-1.0),
    ],
)
def test_what_has_no_meaning_is_refused(attempt):
    with pytest.raises(MeshError):
        attempt()
