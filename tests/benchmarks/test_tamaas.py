"""Comparison with Tamaas: Hertz contact, not periodic, one thread, equal residual.

A sphere whose contact radius is 0.6 of the grid's half width. Tamaas (``pip install tamaas``, used
here only) solves with Polonsky and Keer's conjugate gradients and its zero-padded operator. Both
results are judged by our residuals, on our operator; Tamaas's tolerance is the loosest that meets
the bound. Times are medians of processor seconds of several runs; set-up is reported separately.

It must be run alone, as by `make bench`: where MKL is loaded (the structural tests load it), its
transforms replace the FFTW that Tamaas ships with and make it three times faster.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from statistics import median
from typing import Any

import numpy as np
import pytest

from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.contact import NormalContact
from sa_solver.normal.problem import contact_residuals
from sa_solver.normal.state import NormalState
from sa_solver.reference.hertz import HertzSphere
from sa_solver.transforms import passes as loops
from sa_solver.types import Array, ElasticPair, Grid, Material

RESIDUAL = 1e-6
TITANIUM = Material(115e3, 0.29)
PAIR = ElasticPair(TITANIUM, TITANIUM)
SPHERE = HertzSphere(400.0, 10.0, PAIR.contact_modulus)
CONTACT_SHARE = 0.6
PAYS = loops.PAYS
GOAL = 12.0


def seconds(action: Callable[[], object], runs: int) -> float:
    """Return the median processor time of ``action``."""
    times = []
    for _ in range(runs):
        begin = time.process_time()
        action()
        times.append(time.process_time() - begin)
    return median(times)


def sphere(cells: int) -> tuple[Grid, Array]:
    width = 2.0 * SPHERE.contact_radius / CONTACT_SHARE
    grid = Grid.covering((width, width), (cells, cells))
    return grid, SPHERE.gap(grid.x, grid.y)


def residual_of(half_space: HalfSpace, height: Array, pressure: Array) -> float:
    """Return penetration or complementarity, with the approach that makes Σ p g vanish."""
    moved = half_space.normal(pressure)
    lifted = height + moved
    approach = np.vdot(lifted, pressure) / pressure.sum()
    return max(contact_residuals(pressure, moved, lifted - approach))


def tamaas_solve(grid: Grid, height: Array, tolerance: float) -> Array:
    tm = pytest.importorskip("tamaas", reason="pip install tamaas")
    tm.initialize(1)
    tm.set_log_level(tm.LogLevel.error)
    model = tm.ModelFactory.createModel(tm.model_type.basic_2d, list(grid.size), list(grid.shape))
    model.E, model.nu = PAIR.contact_modulus, 0.0
    tm.ModelFactory.registerNonPeriodic(model, "dcfft")
    method = tm.PolonskyKeerRey
    solver = method(model, -height, tolerance, method.pressure, method.pressure)
    solver.setIntegralOperator("dcfft")
    solver.max_iter = 5000
    solver.solve(SPHERE.load / (grid.size[0] * grid.size[1]))
    return np.array(model.traction)


@pytest.mark.parametrize(("cells", "runs"), [(256, 7), (512, 3), (1024, 3)])
def test_faster_than_tamaas(
    cells: int, runs: int, record: dict[str, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("tamaas", reason="pip install tamaas")
    if "pypardiso" in sys.modules:
        pytest.skip("to be run alone: MKL's transforms would serve Tamaas")
    grid, height = sphere(cells)
    contact = NormalContact(HalfSpace(grid, PAIR))

    def solve() -> object:
        return contact.solve(height, SPHERE.load, tolerance=RESIDUAL)

    # As the first of a process, which does without compiled loops.
    with monkeypatch.context() as patch:
        patch.setattr(loops, "PAYS", PAYS)
        patch.setattr(loops, "passed", 0)
        first = seconds(solve, 1)
    cold = contact.solve(height, SPHERE.load, tolerance=RESIDUAL)
    worn = height + 0.02 * cold.approach * cold.pressure / cold.pressure.max()
    warm = contact.solve(worn, SPHERE.load, tolerance=RESIDUAL, start=cold.start)
    assert residual_of(contact.half_space, height, cold.pressure) <= 1.5 * RESIDUAL
    for tolerance in (4e-6, 2e-6, 1e-6, 5e-7):
        theirs = tamaas_solve(grid, height, tolerance)
        if residual_of(contact.half_space, height, theirs) <= RESIDUAL:
            break
    scale = cold.pressure.max()
    np.testing.assert_allclose(theirs, cold.pressure, atol=0.02 * scale)
    ours_time = seconds(solve, 2 * runs)
    their_time = seconds(lambda: tamaas_solve(grid, height, tolerance), runs)
    convolution = seconds(lambda: contact.half_space.normal(cold.pressure), 2 * runs)
    ratio = their_time / ours_time
    name = f"Hertz, {cells}², residual {RESIDUAL:g}"
    record[f"{name}: ms"] = 1e3 * ours_time
    record[f"{name}: ms of set-up, once"] = 1e3 * (first - ours_time)
    record[f"{name}: time in convolutions"] = ours_time / convolution
    record[f"{name}, cold: convolutions"] = cold.convolutions
    record[f"{name}, warm: convolutions"] = warm.convolutions
    record[f"{name}: Tamaas's time over ours"] = ratio
    record[f"{name}: Tamaas's time over ours, set-up included"] = their_time / first
    record[f"{name}: tolerance of Tamaas"] = tolerance
    assert ratio >= GOAL


def test_convolutions_hardly_grow_with_the_grid(record: dict[str, float]) -> None:
    """They grow by at most half from 128² to 1024² cells, at 1e-8, including coarser grids."""
    counts = []
    for cells in (128, 256, 512, 1024):
        grid, height = sphere(cells)
        state = NormalContact(HalfSpace(grid, PAIR)).solve(height, SPHERE.load)
        assert state.converged
        counts.append(state.convolutions)
        record[f"Hertz, {cells}², residual 1e-8: convolutions"] = state.convolutions
    assert max(counts) <= 1.5 * counts[0]


def rough_patch(cells: int) -> tuple[Grid, Array]:
    """Return a periodic rough surface with waves of 4 cells and more, and a slope of 0.2."""
    along = np.fft.fftfreq(cells, 1 / cells)[:, None], np.fft.rfftfreq(cells, 1 / cells)
    wave_number = np.hypot(*along)
    size = np.where((wave_number >= 2) & (wave_number <= 32), np.maximum(wave_number, 1) ** -1.8, 0)
    phase = np.exp(2j * np.pi * np.random.default_rng(1).random(wave_number.shape))
    height = np.fft.irfft2(size * phase, s=(cells, cells))
    grid = Grid.covering((1.0, 1.0), (cells, cells))
    return grid, 0.2 * height / np.hypot(*np.gradient(height, *grid.pitch)).std()


def periodic_model(grid: Grid, modulus: float) -> Any:
    """Return Tamaas's model of a periodic half-space with the contact ``modulus``."""
    tm = pytest.importorskip("tamaas", reason="pip install tamaas")
    tm.initialize(1)
    tm.set_log_level(tm.LogLevel.error)
    model = tm.ModelFactory.createModel(tm.model_type.basic_2d, list(grid.size), list(grid.shape))
    model.E, model.nu = modulus, 0.0
    return model


def test_a_periodic_rough_patch_has_the_contact_of_tamaas() -> None:
    """Both have the same discrete problem: cells in contact are equal, pressures to 1e-6."""
    tm = pytest.importorskip("tamaas", reason="pip install tamaas")
    (grid, height), mean = rough_patch(128), 0.02 * PAIR.contact_modulus
    ours = NormalContact(HalfSpace(grid, PAIR, periodic=True)).solve(height, mean, tolerance=1e-9)
    model = periodic_model(grid, PAIR.contact_modulus)
    solver = tm.PolonskyKeerRey(model, -height, 1e-13)
    solver.max_iter = 5000
    solver.solve(mean)
    theirs = np.array(model.traction)
    assert 0.05 < (theirs > 0.0).mean() < 0.9
    assert np.count_nonzero((theirs > 0.0) != (ours.pressure > 0.0)) <= 1
    np.testing.assert_allclose(ours.pressure, theirs, atol=1e-6 * theirs.max())


@pytest.mark.parametrize("hardness", [0.17, 0.035])
def test_a_rough_patch_that_yields_is_that_of_tamaas(
    hardness: float, record: dict[str, float]
) -> None:
    """The same cells touch and yield, pressures to 1e-6; the hardness is over E*.

    Tamaas bounds the pressure by projected steps, which need a modulus of 1.
    """
    tm = pytest.importorskip("tamaas", reason="pip install tamaas")
    (grid, height), mean = rough_patch(128), 0.02
    limit = hardness * PAIR.contact_modulus
    contact = NormalContact(HalfSpace(grid, PAIR, periodic=True))

    def solve() -> NormalState:
        return contact.solve(height, mean * PAIR.contact_modulus, hardness=limit, tolerance=1e-9)

    model = periodic_model(grid, 1.0)
    solver = tm.KatoSaturated(model, -height, 1e-12, hardness)
    solver.max_iter = 2000
    their_time = seconds(lambda: solver.solve(mean), 1)
    ours, ratio = solve(), their_time / seconds(solve, 3)
    theirs = np.array(model.traction) * PAIR.contact_modulus
    np.testing.assert_array_equal(theirs > 1e-6 * limit, ours.pressure > 0.0)
    np.testing.assert_array_equal(theirs > (1.0 - 1e-6) * limit, ours.flattening > 0.0)
    np.testing.assert_allclose(ours.pressure, theirs, atol=1e-6 * limit)
    record[f"rough, 128², hardness {hardness:g} E*: Tamaas's time over ours"] = ratio
