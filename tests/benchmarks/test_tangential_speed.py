"""The bench of shear: convolutions by load and grid, times as ratios to one convolution."""

import time
from collections.abc import Callable

import numpy as np
import pytest

from sa_solver.contact import FrictionalContact
from sa_solver.contact_state import ContactLoad
from sa_solver.half_space import HalfSpace
from sa_solver.reference.hertz import HertzSphere
from sa_solver.tangential import TangentialContact
from sa_solver.types import ElasticPair, Grid, Material

TITANIUM = Material(115e3, 0.29)
PAIR = ElasticPair(TITANIUM, TITANIUM)
SPHERE = HertzSphere(400.0, 10.0, PAIR.contact_modulus)
FRICTION = 0.7
SLIDING = FRICTION * 400.0


def seconds(action: Callable[[], object], repeat: int) -> float:
    """Shortest processor time of ``action`` in ``repeat`` tries."""
    times = []
    for _ in range(repeat):
        begin = time.process_time()
        action()
        times.append(time.process_time() - begin)
    return min(times)


def sphere(cells: int) -> tuple[TangentialContact, np.ndarray]:
    grid = Grid.covering((0.76, 0.76), (cells, cells))
    limit = FRICTION * SPHERE.pressure(grid.x, grid.y)
    return TangentialContact(HalfSpace(grid, PAIR)), limit


@pytest.mark.parametrize("share", [0.01, 0.5, 0.75, 0.99, 0.999])
def test_convolutions_by_share_of_sliding(share: float) -> None:
    contact, limit = sphere(128)
    state = contact.solve(limit, Qx=share * SLIDING)
    one = np.ones((2, 128, 128))
    convolution = seconds(lambda: [contact.half_space.shear(one) for _ in range(20)], 3) / 20
    spent = seconds(lambda: contact.solve(limit, Qx=share * SLIDING), 3) / convolution
    print(
        f"\nsphere, 128 x 128, Q/µP {share}: {state.convolutions} convolutions, "
        f"{spent:.0f} times one",
        end="",
    )
    assert state.converged
    assert state.convolutions <= 60


def test_convolutions_by_grid() -> None:
    """At Q/µP 0.75: at most half as many again from 64 x 64 to 256 x 256, 40 at 512 x 512."""
    counts = {}
    for cells in (64, 128, 256, 512):
        contact, limit = sphere(cells)
        state = contact.solve(limit, Qx=0.75 * SLIDING)
        assert state.converged
        counts[cells] = state.convolutions
    print(f"\nsphere, Q/µP 0.75, two-component convolutions by cells across: {counts}", end="")
    assert counts[128] <= 120
    assert counts[256] <= 1.5 * counts[64]
    assert counts[512] <= 40


def test_a_cycle_of_22_increments() -> None:
    """Normal and tangential problems of a flank, 128 x 256, with all its resultants changing."""
    grid = Grid.covering((10.0, 60.0), (128, 256))
    height = np.maximum(np.abs(grid.x) - 4.0, 0.0) ** 2 / 60.0
    height = height + np.maximum(np.abs(grid.y) - 27.0, 0.0) ** 2 / 300.0
    half_space = HalfSpace(grid, PAIR)
    contact = FrictionalContact(half_space, FRICTION)
    phase = np.arange(1, 23) / 22.0 * 2.0 * np.pi
    P = np.maximum(78e3 * np.sin(0.5 * phase), 2e3)
    Q = -0.75 * FRICTION * P * np.sin(phase - 0.3)
    loads = np.stack([P, Q, 0.1 * Q, 0.0 * P, 0.3 * P, 0.5 * Q], axis=1)

    def cycle() -> int:
        state, convolutions = contact.apart(height), 0
        for values in loads:
            state = contact.advance(state, height, ContactLoad(values))
            assert state.converged
            convolutions += state.convolutions
        return convolutions

    counted = cycle()
    one = np.ones((2, *grid.shape))
    convolution = seconds(lambda: [half_space.shear(one) for _ in range(20)], 3) / 20
    spent = seconds(cycle, 2)
    print(
        f"\ncycle of 22 increments, 128 x 256: {spent:.2f} s, {counted} convolutions, "
        f"{spent / convolution:.0f} times one of two components",
        end="",
    )
    assert counted <= 1150
    assert spent < 3600.0 * convolution
