"""Results of a vibration case: motions under every force, and further curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from workflow.analyses.vibration.case.vibration_case import VibrationCase
from workflow.layout.declared import Arrays

Bifurcations = tuple[Mapping[str, Any], ...]


@dataclass(frozen=True)
class Curves:
    """A curve: ``arrays`` by name, with the first axis of each along the curve.

    ``numbers`` are attributes of the curve, ``bifurcations`` the points where its stability
    changes.
    """

    arrays: Arrays
    numbers: Mapping[str, Any]
    bifurcations: Bifurcations = ()


@dataclass(frozen=True)
class Answers:
    """The motions under a force at the frequencies that a case asks for.

    ``arrays`` by name have a row for each motion, by frequency and in the order of the curve.
    ``numbers`` has the values of each frequency, for the summary.
    """

    arrays: Arrays
    numbers: tuple[Mapping[str, Any], ...]


@dataclass(frozen=True)
class Response:
    """The motions under one ``force`` [N].

    ``curves`` are along the frequency and ``numbers`` for the summary. ``nodes`` are results of
    each joint along the frequency. ``resonance`` is the cycle there, for joints with places.
    ``loops`` are along a cycle, one per resolution, the finest last. ``answers`` are motions at the
    frequencies of the case, ``harmonics`` are the coefficients of motions by group, and
    ``bifurcations`` are along the curve.
    """

    force: float
    curves: Arrays
    numbers: Mapping[str, Any]
    nodes: Arrays
    resonance: Arrays | None = None
    loops: tuple[Curves, ...] = ()
    answers: Answers | None = None
    harmonics: Mapping[str, Arrays] = field(default_factory=dict)
    bifurcations: Bifurcations = ()


@dataclass(frozen=True)
class VibrationOutcome:
    """All results of a vibration case.

    ``labels`` name the observed displacements, the last of which is the main one; ``names`` are the
    places and joints with harmonics. ``linear`` are the limits with joints free and stuck, over
    frequency. ``contact`` has the places of joints and their state at rest, if they have places.
    ``backbone`` is the curve of phase resonance, ``force_sweeps`` are motions along the force, and
    ``modes`` are curves over their amplitude, if the case asks for them. ``further`` are branches
    with the same curves as responses, and ``diameters`` natural frequencies of a ring, if the body
    is a sector of one. ``numbers`` go into the summary unchanged.
    """

    case: VibrationCase
    labels: tuple[str, ...]
    names: Arrays
    responses: tuple[Response, ...]
    linear: Arrays
    numbers: Mapping[str, Any]
    contact: Arrays | None = None
    backbone: Curves | None = None
    force_sweeps: tuple[Curves, ...] = ()
    modes: tuple[Curves, ...] = ()
    further: tuple[Curves, ...] = ()
    diameters: Arrays | None = None

    @property
    def _joints(self) -> int:
        """Number of joints, 0 where none of them ever slips or separates."""
        shares = [r.nodes[name] for r in self.responses for name in ("slip", "separated")]
        return shares[0].shape[1] if any(share.any() for share in shares) else 0

    @property
    def contents(self) -> VibrationContents:
        """Description of what ``results.h5`` holds of this outcome."""
        names = [f"{number:05d}" for number in range(len(self.responses))]
        loops = (n for n, response in zip(names, self.responses, strict=True) if response.loops)
        return VibrationContents(
            responses=tuple(names),
            loops=tuple(loops),
            places=self.contact is not None,
            joints=self._joints,
            backbone=self.backbone is not None,
            at=bool(self.case.at),
            modes=tuple(f"{number:05d}" for number in range(len(self.modes))),
            engine=self.case.engine_order is not None,
            diameters=self.diameters is not None,
        )


@dataclass(frozen=True)
class VibrationContents:
    """Contents of ``results.h5`` of a vibration case.

    ``responses`` are the groups by force, ``loops`` the groups that have loops. ``places`` tells
    whether joints have places, and so a cycle at resonance; ``joints`` is the number of joints if
    any slips or separates. There may be a ``backbone``, motions ``at`` chosen frequencies, and
    ``modes`` over their amplitude; with ``engine``, frequencies have engine speeds. A ring has
    natural frequencies by nodal ``diameters``.
    """

    responses: tuple[str, ...]
    loops: tuple[str, ...]
    places: bool
    backbone: bool
    joints: int = 0
    at: bool = False
    modes: tuple[str, ...] = ()
    engine: bool = False
    diameters: bool = False


def trend(values: Sequence[float]) -> float:
    """Return 1 where values rise and never fall, -1 where they fall and never rise, else 0."""
    finite = [value for value in values if np.isfinite(value)]
    signs = {float(np.sign(after - before)) for before, after in pairwise(finite)} - {0.0}
    return signs.pop() if len(signs) == 1 else 0.0
