"""The papers' rig at the frequencies of its parameters, and reduced bodies in rigs."""

import numpy as np
import pytest
import scipy.linalg as sl
import scipy.sparse as sp

from fe_models.dynamics.rig import (
    Link,
    RigError,
    lumped_rig,
    modal_damping,
    natural_frequencies,
    reduced_rig,
)
from fe_models.joints.reduction import reduce_body
from tests.oracles.two_mass_rig import two_mass_rig

THESIS = two_mass_rig((21.152e-3, 1.189e-3), (1.3469e3, 273e3), 1e-3)
PAPER_C = two_mass_rig((21.2e-3, 1.2e-3), (1.4e3, 273e3), 1e-3)


def test_the_thesis_rig_is_free_at_39_hz_and_stuck_at_214():
    """The closed form of two masses gives 39.08 Hz, and 214 Hz with kt 45 N/µm (400 is printed)."""
    free, stuck = natural_frequencies(THESIS), natural_frequencies(THESIS, 45e3)
    assert free[0] == pytest.approx(39.08, abs=0.005)
    assert stuck[0] == pytest.approx(214.4, abs=0.05)


@pytest.mark.parametrize(
    ("held", "first", "second"),
    [
        (0.0, 39.8, 2468.0),
        (0.88e3, 50.8, None),
        (27.3e3, 173.0, 2576.0),
        # Worn: kt(2800 J).
        (27.3e3 * (1.0 + 1.32 * np.exp(-150.0 / 2800.0)), 244.0, 2707.0),
    ],
)
def test_the_rig_of_paper_c(held, first, second):
    """The printed parameters give the stated values to their digits."""
    frequencies = natural_frequencies(PAPER_C, held)
    assert frequencies[0] == pytest.approx(first, abs=0.5 if first > 100.0 else 0.06)
    if second is not None:
        assert frequencies[1] == pytest.approx(second, abs=1.0)


def test_two_masses_are_the_roots_of_their_characteristic_equation():
    (m1, m2), (k1, k2), k3 = (21.2e-3, 1.2e-3), (1.4e3, 273e3), 45e3
    sum_ = (k1 + k2) / m1 + (k2 + k3) / m2
    product = ((k1 + k2) * (k2 + k3) - k2**2) / (m1 * m2)
    root = np.sqrt(0.25 * sum_**2 - product)
    squares = np.array([product / (0.5 * sum_ + root), 0.5 * sum_ + root])
    frequencies = natural_frequencies(PAPER_C, k3)
    np.testing.assert_allclose(frequencies, np.sqrt(squares) / (2.0 * np.pi), rtol=1e-12)
    np.testing.assert_allclose(
        natural_frequencies(PAPER_C, np.array([[[k3]]])), frequencies, rtol=1e-12
    )


@pytest.mark.parametrize("ratio", [1e-3, np.array([0.01, 0.2])])
def test_every_mode_is_damped_by_its_ratio(ratio):
    """Complex eigenvalues of the first-order system, with the joint free, give the ratios."""
    rig = two_mass_rig((21.2e-3, 1.2e-3), (1.4e3, 273e3), ratio)
    inverse = np.linalg.inv(rig.mass)
    first_order = np.block(
        [[np.zeros((2, 2)), np.eye(2)], [-inverse @ rig.stiffness, -inverse @ rig.damping]]
    )
    values = np.linalg.eigvals(first_order)
    values = values[np.argsort(np.abs(values))][::2]
    angular = 2.0 * np.pi * natural_frequencies(rig)
    np.testing.assert_allclose(np.abs(values), angular, rtol=1e-9)
    np.testing.assert_allclose(-values.real / np.abs(values), ratio * np.ones(2), rtol=1e-7)


def test_a_rigid_motion_is_not_damped():
    chain = lumped_rig({"a": 1.0, "b": 2.0}, {Link("b", "a"): 5.0}, [[Link("a")]], 0.1)
    np.testing.assert_allclose(chain.damping @ np.ones(2), 0.0, atol=1e-7)
    assert chain.damping[0, 0] > 0.1


def bar(elements):
    """Return a bar of unit mass and stiffness per element, free at both ends."""
    stiffness, mass = (np.zeros((elements + 1,) * 2) for _ in range(2))
    for start in range(elements):
        place = slice(start, start + 2)
        stiffness[place, place] += [[1e3, -1e3], [-1e3, 1e3]]
        mass[place, place] += np.array([[2e-3, 1e-3], [1e-3, 2e-3]]) / 6.0
    return sp.csr_matrix(stiffness), sp.csr_matrix(mass)


def test_a_reduced_body_in_a_rig_vibrates_as_the_full_one():
    """With all modes kept, ground - spring - holder - spring - bar agrees to rounding.

    A joint joins the far end of the bar to its near end: a joint between two displacements.
    """
    stiffness, mass = bar(6)
    full = reduce_body(stiffness, mass, np.array([6, 0]), modes=4)
    masses, springs = {"holder": 0.02, "near": 1e-3}, {Link("holder"): 50.0}
    springs[Link("near", "holder")] = 700.0
    joints = [[Link("far", "near")], [Link("near")]]
    rig = reduced_rig(full, ("far", "near"), joints, masses, springs, 0.01)
    assert rig.names == ("far", "near", "mode 1", "mode 2", "mode 3", "mode 4", "holder")
    K, M = (np.pad(matrix.toarray(), (0, 1)) for matrix in (stiffness, mass))
    M[7, 7] += 0.02
    M[0, 0] += 1e-3
    K[7, 7] += 50.0 + 700.0
    K[0, 0] += 700.0
    K[0, 7] = K[7, 0] = -700.0
    # The joints' tangents.
    K += 300.0 * np.outer(*[np.eye(8)[6] - np.eye(8)[0]] * 2) + 20.0 * np.outer(*[np.eye(8)[0]] * 2)
    wanted = np.sqrt(sl.eigh(K, M, eigvals_only=True)) / (2.0 * np.pi)
    frequencies = natural_frequencies(rig, np.array([300.0, 20.0]))
    # One of the five inner modes is neglected: the lowest frequencies are as accurate as with all.
    np.testing.assert_allclose(frequencies[:3], wanted[:3], rtol=2e-3)
    assert np.all(frequencies >= wanted[:7] * (1.0 - 1e-12))


def test_joints_of_three_directions_are_rows_one_after_the_other():
    masses = dict.fromkeys(("x", "y", "z"), 1.0)
    joint = [Link("x"), Link("y", "z"), Link("z")]
    rig = lumped_rig(masses, {}, [joint, joint])
    assert rig.connection.shape == (6, 3)
    np.testing.assert_array_equal(rig.connection[:3], [[1, 0, 0], [0, 1, -1], [0, 0, 1]])


def test_invalid_rigs_are_refused():
    with pytest.raises(RigError, match="give every point mass"):
        lumped_rig({"a": 0.0}, {Link("a"): 1.0}, [])
    with pytest.raises(RigError, match=r"damping ratio -0\.1"):
        modal_damping(np.eye(2), np.eye(2), -0.1)
    with pytest.raises(RigError, match="different numbers of directions"):
        lumped_rig({"a": 1.0}, {}, [[Link("a")], [Link("a"), Link("a")]])
    stiffness, mass = bar(6)
    with pytest.raises(RigError, match="to itself"):
        Link("a", "a")
    with pytest.raises(RigError, match="no mass"):
        reduced_rig(reduce_body(stiffness, None, np.array([0, 6])), ("a", "b"), [])
    with pytest.raises(RigError, match="1 names for 2"):
        reduced_rig(reduce_body(stiffness, mass, np.array([0, 6])), ("a",), [])
    with pytest.raises(RigError, match="same name"):
        reduced_rig(reduce_body(stiffness, mass, np.array([0, 6])), ("a", "a"), [])
