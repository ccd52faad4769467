"""Benchmark of shear: convolutions by load and grid, times as ratios to one convolution.

A cycle of 22 increments, cold and slightly worn, counts convolutions and transforms.
"""

import time
from collections.abc import Callable, Sequence

import numpy as np
import pytest

from sa_solver.contact import FrictionalContact
from sa_solver.contact_state import ContactLoad, ContactStart, ContactState
from sa_solver.half_space.operator import HalfSpace
from sa_solver.reference.hertz import HertzSphere
from sa_solver.tangential.contact import TangentialContact
from sa_solver.transforms.padded import Transform
from sa_solver.types import Array, ElasticPair, Grid, Material

TITANIUM = Material(115e3, 0.29)
PAIR = ElasticPair(TITANIUM, TITANIUM)
SPHERE = HertzSphere(400.0, 10.0, PAIR.contact_modulus)
FRICTION = 0.7
SLIDING = FRICTION * 400.0


def seconds(action: Callable[[], object], repeat: int) -> float:
    """Return the shortest processor time of ``action`` in ``repeat`` tries."""
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
def test_convolutions_by_share_of_sliding(share: float, record: dict[str, float]) -> None:
    contact, limit = sphere(128)
    state = contact.solve(limit, Qx=share * SLIDING)
    one = np.ones((2, 128, 128))
    convolution = seconds(lambda: [contact.half_space.shear(one) for _ in range(20)], 3) / 20
    spent = seconds(lambda: contact.solve(limit, Qx=share * SLIDING), 3) / convolution
    record[f"shear, 128², Q/µP {share}: convolutions"] = state.convolutions
    record[f"shear, 128², Q/µP {share}: time in convolutions"] = spent
    assert state.converged
    assert state.convolutions <= 40


def test_convolutions_by_grid(record: dict[str, float]) -> None:
    """At Q/µP 0.75 they grow by at most half from 64 x 64 to 256 x 256; 30 at 512 x 512."""
    counts = {}
    for cells in (64, 128, 256, 512, 1024):
        contact, limit = sphere(cells)
        state = contact.solve(limit, Qx=0.75 * SLIDING)
        assert state.converged
        counts[cells] = state.convolutions
        record[f"shear, {cells}², Q/µP 0.75: convolutions"] = state.convolutions
    assert counts[128] <= 120
    assert counts[256] <= 1.5 * counts[64]
    assert counts[512] <= 30
    assert counts[1024] <= 50


def flank() -> tuple[FrictionalContact, Array, Array]:
    """Return a flank on 128 x 256 cells, its height, and loads ``(22, 6)`` that all change."""
    grid = Grid.covering((10.0, 60.0), (128, 256))
    height = np.maximum(np.abs(grid.x) - 4.0, 0.0) ** 2 / 60.0
    height = height + np.maximum(np.abs(grid.y) - 27.0, 0.0) ** 2 / 300.0
    phase = np.arange(1, 23) / 22.0 * 2.0 * np.pi
    P = np.maximum(78e3 * np.sin(0.5 * phase), 2e3)
    Q = -0.75 * FRICTION * P * np.sin(phase - 0.3)
    loads = np.stack([P, Q, 0.1 * Q, 0.0 * P, 0.3 * P, 0.5 * Q], axis=1)
    return FrictionalContact(HalfSpace(grid, PAIR), FRICTION), height, loads


def marched(
    contact: FrictionalContact,
    height: Array,
    loads: Array,
    starts: Sequence[ContactStart | None] = (None,) * 22,
) -> list[ContactState]:
    """Return the states of a cycle from rest."""
    states = [contact.unloaded_state(height)]
    for values, start in zip(loads, starts, strict=True):
        states.append(contact.advance(states[-1], height, ContactLoad(values), start))
        assert states[-1].converged
    return states[1:]


def test_a_cycle_of_22_increments(
    record: dict[str, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Normal and tangential problems of a flank, from rest, give processor seconds and counts."""
    contact, height, loads = flank()
    transforms = 0
    one_way = Transform.backward

    def counted(self: Transform, component: int, out: Array) -> None:
        nonlocal transforms
        transforms += 1
        one_way(self, component, out)

    def cycle() -> int:
        return sum(state.convolutions for state in marched(contact, height, loads))

    cycle()
    with monkeypatch.context() as patch:
        patch.setattr(Transform, "backward", counted)
        count = cycle()
    one = np.ones((2, *contact.grid.shape))
    convolution = seconds(lambda: [contact.half_space.shear(one) for _ in range(20)], 3) / 20
    spent = seconds(cycle, 2)
    record["cycle of 22 increments: convolutions"] = count
    record["cycle of 22 increments: transform pairs"] = transforms
    record["cycle of 22 increments: processor seconds"] = spent
    record["cycle of 22 increments: time in convolutions"] = spent / convolution
    assert count <= 1020
    assert spent < 3600.0 * convolution


def test_the_cycle_worn_a_little(record: dict[str, float]) -> None:
    """The cycle is repeated from its states on surfaces worn by up to 10 nm."""
    contact, height, loads = flank()
    new = marched(contact, height, loads)
    pressure = max((state.pressure for state in new), key=np.sum)
    worn = height + 1e-5 * pressure / pressure.max()
    cold = marched(contact, worn, loads)
    warm = marched(contact, worn, loads, [state.as_start for state in new])
    counts = [sum(state.convolutions for state in states) for states in (cold, warm)]
    record["cycle of 22 increments, worn, cold: convolutions"] = counts[0]
    record["cycle of 22 increments, worn, warm: convolutions"] = counts[1]
    largest = max(state.pressure.max() for state in cold)
    for one, other in zip(cold, warm, strict=True):
        np.testing.assert_allclose(one.pressure, other.pressure, atol=1e-4 * largest)
    assert counts[1] <= 0.65 * counts[0]
