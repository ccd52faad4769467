"""Natural frequencies of a ring, by nodal diameters, where a case has one of its sectors."""

from __future__ import annotations

import numpy as np

from fe_models.dynamics.rig import natural_frequencies
from fe_models.dynamics.rings.sector import CyclicSector
from sa_solver.types import Array
from workflow.models.rig.rig_model import MOST_FREQUENCIES
from workflow.shell.output.dataset import Dataset

OF_EACH = "lowest natural frequencies of each number of nodal diameters"


def frequencies_by_diameters(sector: CyclicSector, stuck: Array) -> dict[str, Dataset]:
    """Return natural frequencies ``(d, m)`` with joints free and as ``stuck`` ``(j, d, d)``."""
    most = range(sector.ring.sectors // 2 + 1)
    models = [sector.at(number) for number in most]
    free, held = (
        np.array([natural_frequencies(model, springs)[:MOST_FREQUENCIES] for model in models])
        for springs in (0.0, stuck)
    )
    return {
        "diameters": Dataset(np.array(most), "1", "nodal diameters of a wave"),
        "free": Dataset(free, "Hz", f"{OF_EACH}, without the joints"),
        "stuck": Dataset(held, "Hz", f"{OF_EACH}, all joints stuck"),
    }
