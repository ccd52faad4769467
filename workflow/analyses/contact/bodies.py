"""Input of the contact solver from a case of two bodies: materials and half-space."""

from __future__ import annotations

from sa_solver.half_space.operator import HalfSpace
from sa_solver.types import ElasticPair, Grid, Material
from workflow.analyses.contact.case import BodiesCase, LineContactCase, elastic


def half_space_of(case: BodiesCase, grid: Grid) -> HalfSpace:
    """Return both bodies as half-spaces, or half-planes, on ``grid``."""
    pair = ElasticPair(*bodies_of(case))
    datum = case.contact.datum if isinstance(case, LineContactCase) else None
    return HalfSpace(grid, pair, datum=datum, periodic=case.contact.periodic)


def bodies_of(case: BodiesCase) -> tuple[Material, Material]:
    """Return the materials of body 1 and body 2."""
    return elastic(case.materials.body_1), elastic(case.materials.body_2)
