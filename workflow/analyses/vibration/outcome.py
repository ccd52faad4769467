"""What a vibration case has found: the motions under every force, and their backbone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from workflow.analyses.vibration.case import VibrationCase
from workflow.shell.dataset import Datasets

# Groups of a response, beside its own curves.
NODES, RESONANCE, LOOPS = "nodes", "resonance", "loops"
# Motions at the frequencies that a case asks for, and what is known of motions by their harmonics.
AT, HARMONICS = "at", "harmonics"
# Natural frequencies by nodal diameters.
DIAMETERS = "nodal_diameters"
# What a ring is, in the summary.
RING = "ring"
# Branches that no end of the frequencies leads to.
FURTHER = "further_branches"
# Where stability changes along a curve, and what is known of each.
BIFURCATIONS = "bifurcations"
Bifurcations = tuple[Mapping[str, Any], ...]
# Motions along the force at a frequency.
FORCE_SWEEPS = "force_sweeps"
# Modes over their amplitude.
MODES = "modes"


@dataclass(frozen=True)
class Curves:
    """``datasets`` by name, the first axis of each along the curve.

    ``numbers`` are attributes beside them, ``bifurcations`` those of the curve.
    """

    datasets: Datasets
    numbers: Mapping[str, Any]
    bifurcations: Bifurcations = ()


@dataclass(frozen=True)
class Answers:
    """The motions under a force at the frequencies that a case asks for.

    ``datasets`` by name, a row for each motion, by frequency and in the order of the curve.
    ``numbers`` are those of each frequency, for the summary.
    """

    datasets: Datasets
    numbers: tuple[Mapping[str, Any], ...]


@dataclass(frozen=True)
class Response:
    """The motions under one ``force`` [N].

    ``curves`` along the frequency, ``numbers`` for the summary; ``nodes``, what each joint does
    along the frequency too, and of joints with places ``resonance``, along the cycle there;
    ``loops``, along a cycle, by
    the resolutions in which they were found, the finest last; ``answers`` at the frequencies
    asked for; ``harmonics`` of motions, by what they are of; ``bifurcations`` along the curve.
    """

    force: float
    curves: Datasets
    numbers: Mapping[str, Any]
    nodes: Datasets
    resonance: Datasets | None = None
    loops: tuple[Curves, ...] = ()
    answers: Answers | None = None
    harmonics: Mapping[str, Datasets] = field(default_factory=dict)
    bifurcations: Bifurcations = ()


@dataclass(frozen=True)
class VibrationOutcome:
    """Everything a vibration case has found.

    ``labels`` of what is seen, the last of which is looked at; ``names`` of the places and joints
    whose harmonics there are. ``linear`` are the limits of joints
    that are free and stuck, over frequency; ``contact`` is where joints are and how they rest, if
    they have places; ``backbone`` the curve of phase resonance and ``force_sweeps`` motions along
    the force, if they were asked for, ``modes`` curves over their amplitude; ``further`` branches,
    as the responses; ``diameters`` natural frequencies of a ring, if the body is a sector of one.
    ``numbers`` go into the summary as they are.
    """

    case: VibrationCase
    labels: tuple[str, ...]
    names: Datasets
    responses: tuple[Response, ...]
    linear: Datasets
    numbers: Mapping[str, Any]
    contact: Datasets | None = None
    backbone: Curves | None = None
    force_sweeps: tuple[Curves, ...] = ()
    modes: tuple[Curves, ...] = ()
    further: tuple[Curves, ...] = ()
    diameters: Datasets | None = None

    @property
    def _joints(self) -> int:
        """How many there are, 0 where none of them ever slips or is apart."""
        shares = [r.nodes[name].values for r in self.responses for name in ("slip", "separated")]
        return shares[0].shape[1] if any(share.any() for share in shares) else 0

    @property
    def contents(self) -> Contents:
        """What ``results.h5`` holds of it."""
        names = [f"{number:05d}" for number in range(len(self.responses))]
        loops = (n for n, response in zip(names, self.responses, strict=True) if response.loops)
        return Contents(
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
class Contents:
    """What ``results.h5`` of a vibration case holds.

    ``responses`` by force, and those of them with ``loops``. Of joints with ``places`` there is the
    cycle at resonance; so many ``joints`` slip or are apart at times. There may be a ``backbone``,
    motions ``at`` chosen frequencies, and ``modes`` over their amplitude; frequencies may be those
    of an ``engine``. A ring has natural frequencies by nodal ``diameters``.
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
    """1 where values rise and never fall, -1 where they fall and never rise, else 0."""
    finite = [value for value in values if np.isfinite(value)]
    signs = {float(np.sign(after - before)) for before, after in pairwise(finite)} - {0.0}
    return signs.pop() if len(signs) == 1 else 0.0
