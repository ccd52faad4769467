"""Uniformity of a contact along y, which decides whether one section can represent all.

A case in two dimensions (``structure.dimension: 2``) computes the middle section in plane strain
under the mean load per length. A run in three dimensions shows how accurate this would be: how much
P, slip and worn area change along y, and how far the mean load per length is from that in the
middle. Pressure and slip are the structure's, wear is the half-space's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe_models.meshes.transfer import FaceTransfer
from fe_models.structure import InterfaceHistory
from sa_solver.cycles.increments import friction_work
from sa_solver.types import Array
from workflow.case.text.plain import shares
from workflow.case.text.readable import percent
from workflow.models.contact import FaceContact, FaceState, WornFaces
from workflow.models.loads import LoadSource
from workflow.models.structure import StructureLoads

# A value in the middle below this share of the largest is rounding.
ROUNDING = 1e-9
# Largest relative deviation from the middle at which sections count as equal: a few per cent.
ALIKE = 0.05
# Share of the length, around the middle, for deviations: the ends always differ.
MIDDLE = 0.5


@dataclass(frozen=True)
class Sections:
    """Loads and slip of the sections of a contact, per length, ``(ny,)`` along y.

    ``P`` and ``Qx`` [N/mm] are those of the increment of peak load, ``energy`` [N mm/mm] is
    dissipated in a mean cycle and ``slip`` [mm] is the mean path of the nodes in it, weighted by
    their pressure at peak load.
    """

    P: Array
    Qx: Array
    energy: Array
    slip: Array

    @property
    def middle(self) -> dict[str, float]:
        """Every quantity in the middle."""
        return {name: _middle(values) for name, values in vars(self).items()}


def sections(
    transfer: FaceTransfer, history: InterfaceHistory, peak: int, friction: float
) -> Sections:
    """Return the sections of a structure's contact, one per row of the transfer's grid."""
    grid = transfer.grid
    covered = transfer.covered.reshape(grid.shape) / grid.pitch[1]

    def per_length(nodal: Array) -> Array:
        total: Array = np.sum(transfer.to_cells(nodal) * covered, axis=0)
        return total

    traction = history.force / history.interface.nodal_areas
    pressure = traction[peak, 2]
    loads, limit = history.loads, friction * traction[:, 2]
    path = loads.share @ np.hypot(history.slip[:, 0], history.slip[:, 1])
    normal = per_length(pressure)
    work = friction_work(limit, history.slip, loads.P > 0.0, loads.missions)
    weighted = per_length(pressure * path)
    slip = np.divide(weighted, normal, out=np.zeros_like(normal), where=normal > 0.0)
    return Sections(normal, per_length(traction[peak, 0]), per_length(loads.share @ work), slip)


@dataclass(frozen=True)
class Uniformity:
    """Uniformity of a contact along y.

    ``pressure`` (P per length), ``slip`` and ``wear`` (worn area) are the largest deviations from
    the middle over the ``MIDDLE`` share of the length, relative to the middle.
    ``share_of_length_within`` is the share of the length, around the middle, over which all three
    deviate by at most ``ALIKE``; ``mean_load`` is the mean P per length over that in the middle.
    ``uniform`` says whether one section represents the middle: similar sections extend to either
    side at least by the width of the face, and the mean load is that of the middle within
    ``ALIKE``.
    """

    pressure: float
    slip: float
    wear: float
    share_of_length_within: float
    mean_load: float
    uniform: bool

    def sentence(self, name: str) -> str:
        """Return a sentence for the log."""
        text = (
            f"{name}: sections differ by less than {shares(ALIKE)} over the middle "
            f"{percent(self.share_of_length_within)} of the length"
        )
        if not self.uniform:
            return f"{text}: too uneven for a model in two dimensions"
        extra = self.mean_load - 1.0
        more = "more" if extra >= 0.0 else "less"
        return (
            f"{text}: a model in two dimensions gives the middle, with {percent(abs(extra))} "
            f"{more} load"
        )


def uniformities(source: LoadSource, faces: WornFaces) -> dict[str, Uniformity]:
    """Return the uniformity of every loaded contact of a 3D structure, by interface."""
    if not isinstance(source, StructureLoads) or source.line:
        return {}
    return {
        stage.name: result
        for (stage, state), history in zip(faces, source.unworn(), strict=True)
        if (result := uniformity(stage, history, state, source.peak)) is not None
    }


def uniformity(
    stage: FaceContact, history: InterfaceHistory, state: FaceState, peak: int
) -> Uniformity | None:
    """Return the uniformity of unworn contact and wear so far; None without load in the middle."""
    carried = sections(stage.transfer, history, peak, stage.settings.friction(0.0))
    if _middle(carried.P) <= 0.0:
        return None
    worn = np.sum(stage.on_grid(state).depth, axis=0)
    deviations = [_deviation(values) for values in (carried.P, carried.slip, worn)]
    y = np.abs(stage.grid.y.ravel())
    half = 0.5 * stage.grid.size[1]
    inner = y <= MIDDLE * half
    apart = y[np.max(deviations, axis=0) > ALIKE]
    reach = float(apart.min()) - 0.5 * stage.grid.pitch[1] if apart.size else half
    mean_load = float(carried.P.mean()) / _middle(carried.P)
    uniform = reach >= stage.grid.size[0] and abs(mean_load - 1.0) <= ALIKE
    pressure, slip, wear = (float(deviation[inner].max()) for deviation in deviations)
    return Uniformity(pressure, slip, wear, reach / half, mean_load, uniform)


def _deviation(values: Array) -> Array:
    """Return the relative difference from the middle ``(ny,)``; from the largest if that is 0."""
    middle = _middle(values)
    largest = float(np.abs(values).max())
    scale = abs(middle) if abs(middle) > ROUNDING * largest else largest
    deviation: Array = np.abs(values - middle) / scale if scale > 0.0 else np.zeros_like(values)
    return deviation


def _middle(values: Array) -> float:
    """Return the mean of the one or two rows next to y = 0."""
    count = len(values)
    return float(values[(count - 1) // 2 : count // 2 + 1].mean())
