"""Charts of methods that are only a part of a run, from structures to fretting parameters.

    python docs/method_charts.py [CHART ...]

`make docs-figures` draws them too. Every rung is computed here and timed in processor seconds on
one thread, which other work on the machine does not affect. The charts look like those that
`fretscale chart` draws of whole runs.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

import numpy as np
from draw_gallery import ROOT, store

from fe_models import FrettingConditions
from sa_solver import (
    ContactLoad,
    ContactLoadPath,
    ElasticPair,
    FrictionalContact,
    Grid,
    HalfSpace,
    Material,
    march_history,
)
from sa_solver.cycles.history import ACCURACY
from sa_solver.types import Array
from wear import findley
from wear.cracking.life import PlaneSearch
from workflow.analyses.specimens.model import reduced_pair
from workflow.analyses.wear.approximations.approximation import Approximation, Rung
from workflow.analyses.wear.structures.dovetail.model import dovetail_joint
from workflow.analyses.wear.translation import structure_loads
from workflow.chart.costs import RunCost
from workflow.chart.figures import axis_figure
from workflow.chart.frontier import efficient
from workflow.chart.ladder import Ladder, Point, judge
from workflow.kinds import load_case
from workflow.pictures.style import write_figures

Result = TypeVar("Result")

REQUIRED = 0.01
# Mesh sizes for each order of elements; the default order is last, and its finest mesh is the
# reference for all.
NODES = {1: (11, 21, 41, 81, 161, 321), 2: (11, 21, 41, 81, 161, 321)}
ELEMENTS = {1: (6, 10, 14, 20), 2: (6, 10, 14)}
DEFAULT_ORDER = 2
# Increments of each leg, those of the reference, and values of `contact.accuracy`.
INCREMENTS, FINEST = (1, 2, 4, 8, 16, 32, 64), 256
ACCURACIES = (0.1, 0.05, ACCURACY, 0.01, 0.005)
# Refinements of a search for the worst plane.
PLANES, HISTORIES = {0: (10, 30, 100, 300, 1000), 6: (10, 30, 100, 300)}, 300


# --- structure ----------------------------------------------------------------------------------


def structure() -> Ladder:
    """Chart the unworn cycle of the dovetail's section, on meshes of both orders."""
    axis = Approximation(
        "structure", "nodes across a flank of the dovetail's section", _nothing, order=2.0
    )
    return judge(axis, _meshes("dovetail_2d", "nodes", NODES, 81, _mission), {}, {})


def _mission(case: Any) -> dict[str, float]:
    stage = structure_loads(case, dovetail_joint)
    history = stage.unworn()[0]
    place = history.interface.coordinates[:, 0]
    order, pressure = np.argsort(place), history.pressure[stage.peak]
    return {
        "energy of a cycle": history.loads.mean_energy,
        "pressure in the middle": float(np.interp(0.0, place[order], pressure[order])),
        "largest slip": float(np.abs(history.slip[:, 0]).sum(axis=0).max()),
    }


# --- specimens ----------------------------------------------------------------------------------


def specimens() -> Ladder:
    """Chart the curved specimens, unworn under 250 N, on meshes of both orders."""
    axis = Approximation("specimens", "elements across the pad", _nothing, order=2.0)
    return judge(axis, _meshes("specimens_curved", "elements", ELEMENTS, 10, _cycle), {}, {})


def _cycle(case: Any) -> dict[str, float]:
    model, load = reduced_pair(case), case.load_path
    conditions = FrettingConditions(load.normal_forces[-1], load.stroke, case.friction.coefficient)
    cycle = model.pair.fretting_cycle(model.face.gap, conditions)
    return {
        "approach": cycle.normal.approach,
        "stuck stiffness": cycle.stick_stiffness,
        "energy of a cycle": cycle.energy,
        "lowest frequency": float(model.reduction.frequencies[0][1][0]),
    }


# --- load histories -----------------------------------------------------------------------------


def history() -> Ladder:
    """Chart a cylinder on a rigid flat, pressed, sheared by half of the friction limit, and back.

    Errors are those of the shear at the ends of the legs, summed over the cells, relative to µP.
    """
    grid = Grid.line_contact(1.2, 256)
    half_space = HalfSpace(grid, ElasticPair(Material(np.inf, 0.3), Material(115e3, 0.29)))
    contact, height = FrictionalContact(half_space, friction=0.5), grid.x**2 / 100.0
    corners = np.zeros((4, 6))
    corners[1:, 0], corners[2:, 1] = 400.0, (100.0, -100.0)

    def in_increments(count: int) -> Array:
        state, ends = contact.unloaded_state(height), []
        for before, after in pairwise(corners):
            for share in np.arange(1, count + 1) / count:
                load = ContactLoad((1.0 - share) * before + share * after)
                state = contact.advance(state, height, load)
            ends.append(state.shear)
        return np.array(ends)

    def to_accuracy(accuracy: float) -> Array:
        path = ContactLoadPath(corners[1:])
        marched = march_history(half_space, height, path, friction=0.5, accuracy=accuracy)
        return np.array([state.shear for state in marched.states])

    # Steps are of first order, so two references give the remaining error by extrapolation.
    exact = 2.0 * in_increments(FINEST) - in_increments(FINEST // 2)

    def error(shear: Array) -> float:
        apart = np.abs(shear - exact).sum(axis=(1, 2, 3)) * grid.cell_area
        return float(apart.max() / (0.5 * corners[1, 0]))

    rungs = []
    for count in INCREMENTS:
        rung = Rung(f"as given, {count} a leg", {}, 1.0 / count, "as given")
        rungs.append(_judged(rung, False, partial(in_increments, count), error))
    for accuracy in ACCURACIES:
        branch = "split to contact.accuracy"
        rung = Rung(f"{branch}, {100 * accuracy:g} %", {}, accuracy, branch)
        rungs.append(_judged(rung, accuracy == ACCURACY, partial(to_accuracy, accuracy), error))
    axis = Approximation(
        "history", "increments of unlike bodies, pressed and sheared", _nothing, order=1.0
    )
    return _ladder(axis, rungs)


# --- fretting parameters ------------------------------------------------------------------------


def planes() -> Ladder:
    """Chart Findley's parameter of random histories of 8 states: loss in the worst hundredth."""
    stress = 100.0 * np.random.default_rng(1).standard_normal((8, 6, HISTORIES))

    def search(planes: int, refinements: int) -> Array:
        return findley(stress, 0.3, PlaneSearch(planes, refinements)).value

    exact = search(4000, 12)

    def error(value: Array) -> float:
        return float(np.quantile(1.0 - value / exact, 0.99))

    rungs = []
    for refinements, counts in PLANES.items():
        for count in counts:
            branch = f"refined {refinements} times" if refinements else "a lattice alone"
            rung = Rung(f"{branch}, {count} planes", {}, count**-0.5, branch)
            own = PlaneSearch(count, refinements) == PlaneSearch()
            rungs.append(_judged(rung, own, partial(search, count, refinements), error))
    axis = Approximation(
        "planes", f"search for the worst plane, {HISTORIES} histories", _nothing, order=2.0
    )
    return _ladder(axis, rungs)


# --- all ----------------------------------------------------------------------------------------

CHARTS: Mapping[str, tuple[Callable[[], Ladder], float]] = {
    "structure": (structure, REQUIRED),
    "specimens": (specimens, REQUIRED),
    "history": (history, ACCURACY),
    "planes": (planes, REQUIRED),
}


def _nothing(case: Any) -> Any:
    """Return the case axis of a chart without cases."""
    return iter(())


def _judged(
    rung: Rung, own: bool, work: Callable[[], Result], error: Callable[[Result], float]
) -> Point:
    """Return a rung whose error is known."""
    result, seconds = _timed(work)
    wrong, cost = error(result), RunCost(seconds, 0, 0)
    return Point(rung, own, "", {}, cost, error=wrong, bound=wrong, seconds=seconds)


def _ladder(axis: Approximation, rungs: list[Point]) -> Ladder:
    """Return a ladder of such rungs, with the efficient ones marked."""
    flags = efficient([rung.seconds for rung in rungs], [rung.error for rung in rungs])
    marked = [replace(rung, by_seconds=flag) for rung, flag in zip(rungs, flags, strict=True)]
    return Ladder(axis, tuple(marked), {}, {})


def _meshes(
    name: str,
    what: str,
    meshes: Mapping[int, tuple[int, ...]],
    default: int,
    measured: Callable[[Any], dict[str, float]],
) -> list[Point]:
    """Return points of a case on each mesh; ``default`` nodes or elements are its default."""
    points: list[Point] = []
    measured(_on_mesh(name, 1, min(meshes[1]) / default))  # compiles the loops
    for order, counts in meshes.items():
        for count in counts:
            values, seconds = _timed(partial(measured, _on_mesh(name, order, count / default)))
            rung = Rung(f"order {order}, {count} {what}", {}, 1.0 / count, f"order {order}")
            own = (order, count) == (DEFAULT_ORDER, default)
            points.append(Point(rung, own, "", values, RunCost(seconds, 0, 0)))
    return points


def _on_mesh(name: str, order: int, finer: float) -> Any:
    """Return a case whose mesh is finer by a factor."""
    case: Any = load_case(ROOT / "cases" / f"{name}.yaml")
    mesh = case.mesh.model_dump(exclude_none=True) | {
        "order": order,
        "size": case.mesh.size / finer,
    }
    if "flank_nodes" in mesh:  # odd numbers make elements of either order
        halves = np.floor(0.5 * finer * np.array(mesh["flank_nodes"]))
        mesh["flank_nodes"] = (2 * halves + 1).astype(int).tolist()
    if "pad_elements" in mesh:
        mesh["pad_elements"] = round(finer * mesh["pad_elements"])
    return load_case(ROOT / "cases" / f"{name}.yaml", [f"mesh={json.dumps(mesh)}"])


def _timed(work: Callable[[], Result]) -> tuple[Result, float]:
    """Return the result of a work and its processor seconds, with nothing in the cache."""
    with TemporaryDirectory() as cache:
        os.environ["FRETSCALE_CACHE"] = cache
        began = time.process_time()
        return work(), time.process_time() - began


def main(names: list[str]) -> None:
    """Store the charts named, or all."""
    for name in names or CHARTS:
        chart, required = CHARTS[name]
        ladder = chart()
        for rung in ladder.rungs:
            error, seconds = f"{100 * rung.error:.2g} %", f"{rung.cost.seconds:.2f} s"
            print(f"{rung.name}: {error} {rung.worst}, {seconds}")  # noqa: T201
        with TemporaryDirectory() as folder:
            draw = partial(axis_figure, ladder, required)
            (picture,) = write_figures([(f"chart_{name}", draw)], Path(folder))
            store(picture, ROOT / "docs" / "figures" / picture.name)


if __name__ == "__main__":
    main(sys.argv[1:])
