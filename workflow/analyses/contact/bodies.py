"""Input of the contact solver from a case of two bodies: materials, half-space and bulk strain."""

from __future__ import annotations

from sa_solver.half_space.operator import HalfSpace
from sa_solver.types import Array, ElasticPair, Grid, Material
from workflow.analyses.contact.case import BodiesCase, LineContactCase, elastic
from workflow.analyses.contact.load_table import LoadTable


def half_space_of(case: BodiesCase, grid: Grid) -> HalfSpace:
    """Return both bodies as half-spaces, or half-planes, on ``grid``."""
    pair = ElasticPair(*bodies_of(case))
    datum = case.contact.datum if isinstance(case, LineContactCase) else None
    return HalfSpace(grid, pair, datum=datum)


def bodies_of(case: BodiesCase) -> tuple[Material, Material]:
    """Return the materials of body 1 and body 2."""
    return elastic(case.materials.body_1), elastic(case.materials.body_2)


def bulk_strain(table: LoadTable, bodies: tuple[Material, Material]) -> Array:
    """Return the strain of body 2 less that of body 1 along x by bulk stress, ``(n,)``.

    The strain of each is σ (1 - ν²) / E: stress along x, no strain along y.
    """
    first, second = (
        table[f"bulk_stress_{number}"] * (1.0 - body.poisson**2) / body.young
        for number, body in enumerate(bodies, start=1)
    )
    return second - first
