"""Translation of a case of two bodies into a model of them."""

from __future__ import annotations

from sa_solver.types import Grid
from workflow.analyses.contact.case import Heights, Shape
from workflow.analyses.wear.gaps import with_measured
from workflow.analyses.wear.structures.bodies.case import (
    NAME,
    LineReciprocation,
    Reciprocation,
    TwoBodiesWearCase,
)
from workflow.analyses.wear.translation import contact_of
from workflow.case.files.input_files import read_heights
from workflow.models.gaps import GapFunction, GridHeights
from workflow.models.uncoupled.body_pair import BodyPair, BodyPairSource


def body_pair(case: TwoBodiesWearCase) -> BodyPair:
    """Return the bodies of a case."""
    path, peak = case.load_path, None
    if isinstance(path, Reciprocation | LineReciprocation):
        peak = path.increments // 2  # mid-stroke, on the way there
    return BodyPair(
        gap=gap_of(case.structure, case.grid),
        size=case.size,
        loads=path.table(),
        tilt=path.tilt,
        line=case.line,
        name=NAME,
        peak=peak,
        remedy="enlarge contact.size, and contact.grid with it",
    )


def source_of(case: TwoBodiesWearCase, parts: int = 1) -> BodyPairSource:
    """Return the loads of the bodies of a case, with every increment split into ``parts``."""
    return body_pair(case).in_parts(parts).source(contact_of(case, NAME))


def gap_of(bodies: Shape | Heights, grid: Grid) -> GapFunction:
    """Return the gap [mm] of the unloaded bodies over the face that ``grid`` covers."""
    if isinstance(bodies, Heights):
        form: GapFunction = GridHeights(grid, read_heights(bodies.file))
    else:
        form = bodies.described()
    return with_measured(form, bodies.surfaces, grid)
