"""Natural frequencies of a ring, by nodal diameters, where a case has one of its sectors."""

from __future__ import annotations

import numpy as np

from fe_models.dynamics.rig import natural_frequencies
from fe_models.dynamics.rings.sector import CyclicSector
from sa_solver.types import Array
from workflow.layout.declared import Arrays
from workflow.models.rig.rig_model import MOST_FREQUENCIES


def frequencies_by_diameters(sector: CyclicSector, stuck: Array) -> Arrays:
    """Return natural frequencies ``(d, m)`` with joints free and as ``stuck`` ``(j, d, d)``."""
    most = range(sector.ring.sectors // 2 + 1)
    models = [sector.at(number) for number in most]
    free, held = (
        np.array([natural_frequencies(model, springs)[:MOST_FREQUENCIES] for model in models])
        for springs in (0.0, stuck)
    )
    return {"diameters": np.array(most), "free": free, "stuck": held}
