"""Stand-ins with the same displacement names, for bodies that are reduced only by the run.

They consist of unsupported masses with these names, and are used where a case is checked: their
places are right, their motion is not.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fe_models.joints.reduction import ReducedModel
from fe_models.specimens import PAD, RING
from workflow.analyses.rig.bodies.matrix_body import SMALL, MatrixBody
from workflow.analyses.specimens.case import SpecimensCase
from workflow.case.loading import load_case


def matrices_by_name(body: MatrixBody) -> ReducedModel | None:
    """Return a stand-in for large matrices, None if they keep too many unknowns."""
    matrices, wanted = body.matrices.read(), set(body.kept)
    names = [u.name for u in matrices.unknowns if u.point in wanted and u.direction != "modal"]
    return _named(names, body.modes or 0, matrices.loads.shape[1]) if body.retained else None


def specimen_by_name(file: str) -> ReducedModel | None:
    """Return a stand-in for a specimen of the case in a file, None if it keeps too many."""
    case = load_case(file, [SpecimensCase])
    counts = {PAD: (case.mesh.pad_elements + 1) ** 2, RING: case.geometry().ring_nodes}
    names = [
        f"{kind} {number} {axis}"
        for kind, count in counts.items()
        for number in range(1, count + 1)
        for axis in "xyz"
    ]
    return _named(names, case.reduction.modes)


def _named(names: Sequence[str], modes: int, loads: int = 0) -> ReducedModel | None:
    size = len(names) + modes
    if size > SMALL:
        return None
    return ReducedModel(
        *(np.arange(len(names)), np.zeros((size, size)), np.eye(size), np.zeros((size, loads))),
        *(np.zeros((len(names), modes)), np.zeros(modes)),
        names=tuple(names),
    )
