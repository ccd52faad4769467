"""Bolts of a wear run: their tension over a cycle, and its loss as the contacts wear."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from sa_solver.types import Array
from wear.contact.face_loads import FaceLoads
from workflow.layout.declared import Arrays
from workflow.models.contact import WornFaces
from workflow.models.loads import LoadSource
from workflow.models.structure import StructureLoads
from workflow.shell.output.results import ResultsWriter

# Group of the results, and dataset in the file of a jump.
BOLTS, TENSION = "bolts", "bolts/tension"


def stored_tensions(source: LoadSource, faces: WornFaces) -> dict[str, Array]:
    """Return the tensions ``(bolts, t)`` under the last solved loads of all faces, by dataset."""
    if not isinstance(source, StructureLoads) or not source.bolts:
        return {}
    return {TENSION: source.tensions([state.loads for _, state in faces])}


class BoltTensions:
    """Tensions ``(bolts, t)`` [N] of the bolts of ``stage`` over its unworn and its worn cycle."""

    def __init__(self, stage: StructureLoads, worn: Sequence[FaceLoads]) -> None:
        self._stage = stage
        cycles: Mapping[str, Sequence[FaceLoads]] = {"unworn": stage.unworn(), "worn": worn}
        self.moments = {
            moment: stage.tensions([face.loads for face in faces])
            for moment, faces in cycles.items()
        }

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(bolt.name for bolt in self._stage.bolts)

    def write(self, writer: ResultsWriter, jumps: Sequence[Arrays]) -> None:
        """Write tensions over both cycles, and those kept with every jump at peak load.

        Tensions of a jump are those of the last solved loads; the last one is that of the worn
        cycle.
        """
        if not self.names:
            return
        peak = self._stage.peak
        # The last ones are on the last surfaces, whatever the coupling.
        kept = [*(arrays[TENSION] for arrays in jumps[:-1]), self.moments["worn"]]
        for number, name in enumerate(self.names):
            cycles = {
                f"tension_{moment}": tensions[number] for moment, tensions in self.moments.items()
            }
            after_jumps = np.array([tensions[number, peak] for tensions in kept])
            writer.put(f"{BOLTS}/{name}", cycles | {"tension": after_jumps})

    def summary(self) -> dict[str, Any]:
        """Return the tensions of each bolt by name; empty without bolts."""
        if not self.names:
            return {}
        bolts = {}
        for number, bolt in enumerate(self._stage.bolts):
            reported = {m: self._of(tensions[number]) for m, tensions in self.moments.items()}
            before, after = reported["unworn"]["peak"], reported["worn"]["peak"]
            shortening = {} if bolt.force is None else {"shortening": self._shortening(number)}
            lost = {"lost": 1.0 - after / before} if before else {}
            bolts[bolt.name] = {**shortening, "tension": reported, **lost}
        return {BOLTS: bolts}

    def sentences(self) -> Iterator[str]:
        """Yield a sentence on each bolt's tension at peak load, unworn and worn."""
        per = "/mm" if self._stage.line else ""
        for name, numbers in self.summary().get(BOLTS, {}).items():
            before, after = (numbers["tension"][m]["peak"] for m in ("unworn", "worn"))
            lost = f", {numbers['lost']:.3g} of it lost" if "lost" in numbers else ""
            yield f"{name}: tension {before:.4g} -> {after:.4g} N{per} at peak load{lost}"

    def _shortening(self, number: int) -> float:
        return float(self._stage.shortenings[number])

    def _of(self, tension: Array) -> dict[str, float]:
        ends = {"least": tension.min(), "largest": tension.max()}
        return {name: float(n) for name, n in {"peak": tension[self._stage.peak], **ends}.items()}
