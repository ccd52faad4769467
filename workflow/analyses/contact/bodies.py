"""What the contact solver takes of a case of two bodies: materials, half-space and bulk strain."""

from __future__ import annotations

import numpy as np

from sa_solver.half_space import HalfSpace
from sa_solver.types import Array, ElasticPair, Grid, Material
from workflow.analyses.contact.case import BodiesCase, Body, LineContactCase
from workflow.analyses.contact.load_table import LoadTable

RIGID = Material(young=np.inf, poisson=0.0)


def half_space_of(case: BodiesCase, grid: Grid) -> HalfSpace:
    """Both bodies as half-spaces, or half-planes, on ``grid``."""
    pair = ElasticPair(*bodies_of(case))
    datum = case.contact.datum if isinstance(case, LineContactCase) else None
    return HalfSpace(grid, pair, datum=datum)


def bodies_of(case: BodiesCase) -> tuple[Material, Material]:
    """Materials of body 1 and body 2."""
    return _material(case.materials.body_1), _material(case.materials.body_2)


def _material(body: Body) -> Material:
    return RIGID if body == "rigid" else body.elastic()


def bulk_strain(table: LoadTable, bodies: tuple[Material, Material]) -> Array:
    """Strain of body 2 less that of body 1 along x by bulk stress, ``(n,)``.

    σ (1 - ν²) / E each: stress along x, no strain along y.
    """
    first, second = (
        table[f"bulk_stress_{number}"] * (1.0 - body.poisson**2) / body.young
        for number, body in enumerate(bodies, start=1)
    )
    return second - first
