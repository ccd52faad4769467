"""Benchmark of counted work (iterations, convolutions), with times as ratios within one run.

``make bench`` prints a line per measure and appends it to ``record.csv`` in this folder, so that
a change of speed can be seen in the history. Seconds on shared machines say little: the record
holds counts, and times relative to one zero-padded convolution or one product with the joint's
matrix, measured in the same run.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from fe_models.dovetail import Mission, dovetail_structure
from fe_models.joints.friction import FrictionalJoint
from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.contact import NormalContact
from sa_solver.types import ElasticPair, Grid, Material
from workflow.kinds import load_case

CASE = load_case(Path(__file__).parents[2] / "cases" / "dovetail.yaml")
TITANIUM = Material(115e3, 0.29, 4.43e-9)


def seconds(action: Callable[[], object], repeat: int) -> float:
    """Return the shortest time of ``action`` in ``repeat`` tries."""
    times = []
    for _ in range(repeat):
        begin = time.perf_counter()
        action()
        times.append(time.perf_counter() - begin)
    return min(times)


def test_contact_of_the_default_flank(record: dict[str, float]) -> None:
    """The contact is solved at peak load on 128 x 256 cells, cold, and warm after wear."""
    dovetail = CASE.structure.geometry()
    grid = Grid.covering(dovetail.flank_size(), (128, 256))
    contact = NormalContact(HalfSpace(grid, ElasticPair(TITANIUM, TITANIUM)))
    gap = dovetail.flank_gap(grid.x, grid.y, 1)
    load, moment = 78e3, 43e3
    cold = contact.solve(gap, load, My=moment)
    worn = gap + 1e-5 * cold.pressure / cold.pressure.mean()
    warm = contact.solve(worn, load, My=moment, start=cold.start)
    assert cold.converged
    assert warm.converged
    one = seconds(lambda: contact.half_space.normal(cold.pressure), 20)
    record["contact, cold: convolutions"] = cold.convolutions
    record["contact, warm: convolutions"] = warm.convolutions
    spent = seconds(lambda: contact.solve(worn, load, My=moment, start=cold.start), 5)
    record["contact, warm: time in convolutions"] = spent / one


def test_friction_of_the_default_joint(record: dict[str, float]) -> None:
    """The two missions give iterations, and the time of one over that of its matrix product."""
    dovetail = CASE.structure.geometry()
    mission = Mission(**CASE.load_path.missions()[0])
    mesh = dovetail.mesh(CASE.mesh.flank_nodes, CASE.mesh.size)
    structure = dovetail_structure(dovetail, mesh, TITANIUM, TITANIUM, mission, 1)
    resolvent = structure.condense().resolvent()
    joint = FrictionalJoint(resolvent, CASE.friction.coefficient)
    vector = np.ones(len(resolvent.inverse))
    product = seconds(lambda: resolvent.inverse @ vector, 20)
    begin = time.perf_counter()
    solution = structure.solve_cycle(
        joint, mission.amplitudes(), structure.gap(), CASE.friction.coefficient
    )
    spent = time.perf_counter() - begin
    assert solution.converged
    record["friction, two missions: iterations"] = solution.iterations
    record["friction, iteration: time in matrix products"] = spent / solution.iterations / product
