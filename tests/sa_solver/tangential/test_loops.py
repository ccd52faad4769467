"""Loops by numpy and compiled loops give the same digits."""

import subprocess
import sys

import numpy as np
import pytest

from sa_solver.transforms import kernels
from sa_solver.transforms import passes as loops

MATRIX = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])
TURNED = np.array([False, False, True])
STRAIGHT = np.zeros(2, bool)


def spectrum(*shape):
    """Return complex numbers of all signs, in rows with spare numbers at their ends."""
    parts = np.random.default_rng(shape).standard_normal((*shape[:-1], shape[-1] + 4, 2))
    return parts.view(complex)[..., : shape[-1], 0]


def arguments(rows, columns):
    """Return each loop with arguments for it."""
    rng = np.random.default_rng(rows)
    cells = np.flatnonzero(rng.random(rows * columns) < 0.3)
    tensors, some = rng.standard_normal((4, len(cells))), rng.standard_normal((3, len(cells)))
    flat, fields = rng.standard_normal((3, rows * columns)), rng.standard_normal((6, rows, columns))
    two, four = (
        np.exp(-2j * np.pi / rows * np.arange(p)[:, None] * np.arange(rows // p)) for p in (2, 4)
    )
    whole, couple = spectrum(3, rows, columns), spectrum(2, rows, columns)
    yield "multiply_spectrum", (whole[0], fields[0])
    yield "multiply_spectra", (whole, fields, MATRIX, TURNED, TURNED)
    yield "multiply_spectra", (couple, fields, MATRIX[:2, :2].copy(), STRAIGHT, STRAIGHT)
    yield "multiply_spectra", (couple, fields, MATRIX[:1, 1:].copy(), STRAIGHT, TURNED[2:])
    yield "split_in_two", (whole[0], two)
    yield "join_two", (whole[0], two)
    yield "split_in_four", (whole[0], four)
    yield "join_four", (whole[0], four)
    yield "tensor_product", (*fields[:3], fields[3:5], np.empty((2, rows, columns)))
    yield "add_scaled", (fields[:2], fields[3:5], 0.37)
    yield "spread_product", (tensors, some, cells, flat)
    yield "gather_product", (tensors, flat, cells, some)
    yield "add_product", (tensors, some, some[::-1].copy())


@pytest.mark.parametrize("shape", [(8, 5), (256, 129)])
def test_numpy_and_the_compiled_loop_give_the_same_digits(shape, monkeypatch):
    """A single block and several blocks are tested."""
    compared = zip(arguments(*shape), arguments(*shape), arguments(*shape), strict=True)
    for (name, by_numpy), (_, later), (_, compiled) in compared:
        monkeypatch.setattr(loops, "PAYS", np.inf)
        getattr(loops, name)(*by_numpy)
        monkeypatch.setattr(loops, "PAYS", 0)
        getattr(loops, name)(*later)
        getattr(kernels, name)(*compiled)
        for first, second, expected in zip(by_numpy, later, compiled, strict=True):
            assert np.array_equal(first, expected), name
            assert np.array_equal(second, expected), name


def test_a_short_solution_does_not_load_the_compiler():
    code = """
import sys
import numpy as np
from sa_solver import ContactLoad, ElasticPair, FrictionalContact, Grid, HalfSpace, Material
steel, grid = Material(210e3, 0.3), Grid.covering((1.0, 1.0), (16, 16))
contact = FrictionalContact(HalfSpace(grid, ElasticPair(steel, Material(70e3, 0.3))), 0.5)
height = 0.05 * (grid.x**2 + grid.y**2)
load = ContactLoad(np.array([100.0, 20.0, 0.0, 0.0, 0.0, 0.0]))
pressed = contact.advance(contact.unloaded_state(height), height, load)
assert pressed.converged
assert "numba" not in sys.modules
"""
    subprocess.run([sys.executable, "-c", code], check=True)
