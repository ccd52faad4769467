"""Benchmark of half-space contacts other than spheres of similar bodies.

It covers rough surfaces, dissimilar bodies, large grids, and the first solve of a process.
Convolutions and iterations are counts; seconds are processor seconds on one thread.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time

import numpy as np
import pytest

from sa_solver.contact import FrictionalContact
from sa_solver.contact_state import ContactLoad, ContactState
from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.contact import NormalContact
from sa_solver.reference.hertz import HertzSphere
from sa_solver.types import Array, ElasticPair, Grid, Material

TITANIUM = Material(115e3, 0.29)
ALIKE = ElasticPair(TITANIUM, TITANIUM)
RIGID_FLAT = ElasticPair(Material(np.inf, 0.3), TITANIUM)
CELLS = 256
# Rough surfaces: Hurst's exponent, the shortest wave in cells, and the height over the approach of
# the smooth body. The harsh one has all waves of the grid.
SPECTRA = {"smooth": (0.8, 16.0, 0.1), "harsh": (0.3, 2.0, 0.1)}
LONGEST = 0.25  # wave, over the width of the grid
# Share of the largest depth that wear takes between a cold and a warm solve.
WORN = 0.02
# Allowed: convolutions cold and warm; iterations, and time over that of alike bodies.
# Of the 22 warm ones of the harsh surface 12 find the set (a tenth of its cells change), 10 take
# the residual from 1e-4 to 1e-8; with 5 cells of 4082 changed it takes 12. Those of unlike
# bodies are on a box of 96 x 96 cells, in units of the whole grid.
ROUGH, UNLIKE, RATIO = (60, 25), 25, 4.0
# Allowed for 2048 x 2048 cells: convolutions and memory [GB].
LARGEST, LARGEST_MEMORY = 20, 6.0
FIRST = 0.3  # seconds of the first solve


def sphere(cells: int, pair: ElasticPair, share: float = 0.6) -> tuple[HalfSpace, Array, float]:
    """Return half-space, height [mm] and load [N] of a sphere that fills ``share`` of the grid."""
    hertz = HertzSphere(400.0, 10.0, pair.contact_modulus)
    width = 2.0 * hertz.contact_radius / share
    grid = Grid.covering((width, width), (cells, cells))
    return HalfSpace(grid, pair), hertz.gap(grid.x, grid.y), hertz.load


def roughness(grid: Grid, hurst: float, shortest: float) -> Array:
    """Return a self-affine field of root mean square 1, without waves below ``shortest`` cells."""
    noise = np.fft.fft2(np.random.default_rng(0).standard_normal(grid.shape))
    wave = np.hypot(*np.meshgrid(*(np.fft.fftfreq(n) for n in grid.shape), indexing="ij"))
    # Exponent of the amplitude; the power spectrum of heights has twice that.
    falls = np.maximum(wave, 1.0 / (LONGEST * grid.shape[0])) ** -(1.0 + hurst)
    falls[wave > 1.0 / shortest] = 0.0
    field = np.fft.ifft2(noise * falls).real
    return np.asarray(field / field.std())


@pytest.mark.parametrize("spectrum", SPECTRA)
def test_rough_surfaces(spectrum: str, record: dict[str, float]) -> None:
    """A rough sphere is solved from a cold start, and from a warm one after a little wear."""
    hurst, shortest, height = SPECTRA[spectrum]
    half_space, gap, load = sphere(CELLS, ALIKE)
    contact = NormalContact(half_space)
    smooth = contact.solve(gap, load)
    gap = gap + height * smooth.approach * roughness(half_space.grid, hurst, shortest)
    cold = contact.solve(gap, load)
    worn = gap + WORN * cold.approach * cold.pressure / cold.pressure.max()
    warm = contact.solve(worn, load, start=cold.start)
    assert cold.converged
    assert warm.converged
    name = f"{spectrum} roughness, {CELLS}²"
    record[f"{name}, share of cells in contact"] = float((cold.pressure > 0.0).mean())
    record[f"{name}, cold: convolutions"] = cold.convolutions
    record[f"{name}, warm: convolutions"] = warm.convolutions
    assert cold.convolutions <= ROUGH[0]
    assert warm.convolutions <= ROUGH[1]


def sheared(pair: ElasticPair, cells: int) -> tuple[ContactState, ContactState, float]:
    """Return a sphere pressed, then sheared by 0.75 µP; and the seconds of both, best of three."""
    half_space, height, load = sphere(cells, pair)
    contact, times = FrictionalContact(half_space, 0.5), []
    for _ in range(3):
        begin = time.process_time()
        pressed = contact.advance(
            contact.unloaded_state(height), height, ContactLoad(load * np.eye(6)[0])
        )
        force = load * np.array([1.0, 0.375, 0.0, 0.0, 0.0, 0.0])
        moved = contact.advance(pressed, height, ContactLoad(force))
        times.append(time.process_time() - begin)
    return pressed, moved, min(times)


def test_unlike_bodies(record: dict[str, float]) -> None:
    """Solving pressure and shear together is compared with similar bodies in the same run."""
    *_, alike = sheared(ALIKE, 128)
    pressed, moved, spent = sheared(RIGID_FLAT, 128)
    assert pressed.converged
    assert moved.converged
    record["unlike bodies, sphere 128², pressed: convolutions"] = pressed.convolutions
    record["unlike bodies, sphere 128², sheared: convolutions"] = moved.convolutions
    record["unlike bodies, sphere 128²: time over alike bodies"] = spent / alike
    assert max(pressed.convolutions, moved.convolutions) <= UNLIKE
    assert spent <= RATIO * alike


def in_a_process(function: str) -> dict[str, float]:
    """Return the output of a function of this file in a fresh process."""
    code = f"import json; from {__name__} import {function}; print(json.dumps({function}()))"
    code = f"import sys; sys.path.insert(0, {sys.path[0]!r}); {code}"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    found: dict[str, float] = json.loads(done.stdout)
    return found


def first_solve() -> dict[str, float]:
    """Return seconds of the first solve of this process at 256², and of the next, without imports.

    The compiler, which the first solves do without, is not counted
    (:mod:`sa_solver.transforms.passes`).
    """
    small, gap, load = sphere(16, ALIKE)
    NormalContact(small).solve(gap, load)
    half_space, height, load = sphere(CELLS, ALIKE)
    contact, times = NormalContact(half_space), []
    for _ in range(2):
        begin = time.process_time()
        contact.solve(height, load)
        times.append(time.process_time() - begin)
    return {"first": times[0], "next": times[1]}


def test_the_first_solve(record: dict[str, float]) -> None:
    found = in_a_process("first_solve")
    record[f"first Hertz solve, {CELLS}²: processor seconds"] = found["first"]
    record[f"next Hertz solve, {CELLS}²: processor seconds"] = found["next"]
    assert found["first"] <= FIRST


def largest_grid() -> dict[str, float]:
    """Solve a sphere on 2048²: convolutions to 1e-6 and 1e-8, seconds, and peak memory [GB]."""
    half_space, height, load = sphere(2048, ALIKE)
    contact = NormalContact(half_space)
    rough = contact.solve(height, load, tolerance=1e-6)
    begin = time.process_time()
    state = contact.solve(height, load)
    seconds = time.process_time() - begin
    memory = 1024e-9 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {
        "rough": rough.convolutions,
        "convolutions": state.convolutions,
        "seconds": seconds,
        "memory": memory,
    }


def test_a_large_grid(record: dict[str, float]) -> None:
    found = in_a_process("largest_grid")
    record["normal contact, 2048², residual 1e-6: convolutions"] = found["rough"]
    record["normal contact, 2048²: convolutions"] = found["convolutions"]
    record["normal contact, 2048²: processor seconds"] = found["seconds"]
    record["normal contact, 2048²: memory of the process [GB]"] = found["memory"]
    assert found["convolutions"] <= LARGEST
    assert found["memory"] <= LARGEST_MEMORY
