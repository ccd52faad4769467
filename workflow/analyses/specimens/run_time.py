"""Run time of a case of specimens."""

from __future__ import annotations

from math import pi, prod

from workflow.analyses.specimens.case import SpecimensCase
from workflow.case.loading import load_case
from workflow.shell.run_time import FRICTIONAL, RunTime, factors, solves

# Nodes of a specimen of quadratic elements: in a cube as wide as its pad, and by its volume; factor
# by which linear ones have fewer.
PAD_NODES, VOLUME_NODES, FEWER = 19.0, 6.4, 7.0
# Time of the reduction of both specimens relative to sparse factors, for many right-hand sides.
REDUCTION = 5.0
# Cycle blocks to a worn pad under a force, and time of a block on a pad of BLOCK_NODES nodes [s].
BLOCKS, BLOCK, BLOCK_NODES = 200, 5e-3, 121
# Number of frictional contact problems on the half-space, unworn and worn.
BESIDE = 30


def run_time(case: SpecimensCase) -> RunTime:
    """Return the time of the reduction, and of the wear under every force."""
    pad = (case.mesh.pad_elements + 1) ** 2
    forces, step = len(case.load_path.normal_forces), case.wear.step.cycles
    blocks: float = BLOCKS
    if step is not None and case.wear.cycles is not None:
        blocks = case.wear.cycles / step
    worn = blocks * BLOCK * (pad / BLOCK_NODES) ** 2
    beside = solves(BESIDE, prod(case.contact.grid), FRICTIONAL)
    return RunTime(reduction(case), forces * (worn + beside))


def reduction(case: SpecimensCase) -> float:
    """Return the time of the reduction of both specimens [s]."""
    structure, mesh = case.structure, case.mesh
    volume = 0.25 * pi * structure.diameter**2 * structure.length
    nodes = PAD_NODES * mesh.pad_elements**3 + VOLUME_NODES * volume / mesh.size**3
    return REDUCTION * factors(nodes if mesh.order == 2 else nodes / FEWER)


def reduction_of(file: str) -> float:
    """Return the time of the reduction of a specimens case, 0 for a reduced body [s]."""
    if not file.endswith(".yaml"):
        return 0.0
    return reduction(load_case(file, [SpecimensCase]))
