"""Masing's rule against an independent model: parallel sliders, elastic and perfectly plastic."""

import numpy as np
import pytest

from sa_solver.reference.masing import superpose

STIFFNESS = np.linspace(0.2, 3.0, 40)
LIMIT = np.linspace(0.1, 4.0, 40) ** 2


def first_loading(displacement: float) -> float:
    return float(np.sum(np.clip(STIFFNESS * displacement, -LIMIT, LIMIT)))


def march(displacements: list[float]) -> float:
    """Return the force of the sliders after a path, where each slider keeps its own slip."""
    force, at = np.zeros(40), 0.0
    for displacement in displacements:
        force = np.clip(force + STIFFNESS * (displacement - at), -LIMIT, LIMIT)
        at = displacement
    return float(force.sum())


@pytest.mark.parametrize(
    "path",
    [
        [4.0],
        [4.0, -1.0],
        [4.0, -4.0, 2.0],
        [4.0, -2.0, 1.0, 3.0],  # continued in the same direction
        [4.0, -2.0, 1.0, -2.5],  # closes the inner loop
        [4.0, -2.0, 5.0],  # beyond the first peak
        [4.0, -6.0],  # beyond the first peak on the other side
        [4.0, -6.0, 5.0, -5.0, 5.0, 0.0],
        [2.0, 1.0, 1.5, 1.2, 4.0, -1.0, -3.0],
        [0.0, 3.0, 3.0, -1.0],
    ],
)
def test_superposition_remembers_what_sliders_do(path):
    assert superpose(first_loading, path) == pytest.approx(march(path), abs=1e-12)


def test_random_paths():
    generator = np.random.default_rng(3)
    for _ in range(50):
        path = list(generator.uniform(-6.0, 6.0, 12))
        assert superpose(first_loading, path) == pytest.approx(march(path), abs=1e-11)


def test_arrays_and_an_empty_history():
    two = superpose(lambda x: np.array([first_loading(x), x]), [4.0, -2.0])
    assert two == pytest.approx([march([4.0, -2.0]), -2.0])
    with pytest.raises(ValueError, match="at least one load"):
        superpose(first_loading, [])
