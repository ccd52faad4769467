"""What a vibration case has found: the motions under every force, and their backbone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from sa_solver.types import Array
from workflow.analyses.vibration.case import VibrationCase

# Groups of a response, beside its own curves.
NODES, RESONANCE, LOOPS = "nodes", "resonance", "loops"
# Motions along the force at a frequency.
FORCE_SWEEPS = "force_sweeps"


@dataclass(frozen=True)
class Curves:
    """Datasets by the names of :data:`DATASETS`, the first axis of each along the curve.

    ``numbers`` are attributes beside them.
    """

    values: Mapping[str, Array]
    numbers: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Response:
    """The motions under one ``force`` [N].

    ``curves`` along the frequency, ``numbers`` for the summary; of joints with places ``nodes``,
    along the frequency too, and ``resonance``, along the cycle there; ``loops``, along a cycle, by
    the resolutions in which they were found, the finest last.
    """

    force: float
    curves: Mapping[str, Array]
    numbers: Mapping[str, Any]
    nodes: Mapping[str, Array] | None = None
    resonance: Mapping[str, Array] | None = None
    loops: tuple[Curves, ...] = ()


@dataclass(frozen=True)
class VibrationOutcome:
    """Everything a vibration case has found.

    ``labels`` of what is seen, the last of which is looked at. ``linear`` are the limits of joints
    that are free and stuck, over frequency; ``contact`` is where joints are and how they rest, if
    they have places; ``backbone`` the curve of phase resonance and ``force_sweeps`` motions along
    the force, if they were asked for. ``numbers`` go
    into the summary as they are.
    """

    case: VibrationCase
    labels: tuple[str, ...]
    responses: tuple[Response, ...]
    linear: Mapping[str, Array]
    numbers: Mapping[str, Any]
    contact: Mapping[str, Array] | None = None
    backbone: Curves | None = None
    force_sweeps: tuple[Curves, ...] = ()


def trend(values: Sequence[float]) -> float:
    """1 where values rise and never fall, -1 where they fall and never rise, else 0."""
    finite = [value for value in values if np.isfinite(value)]
    signs = {float(np.sign(after - before)) for before, after in pairwise(finite)} - {0.0}
    return signs.pop() if len(signs) == 1 else 0.0


# Unit and description of every dataset, by group and name.
DATASETS: dict[str, dict[str, tuple[str, str]]] = {
    "responses": {
        "frequency": ("Hz", "frequency of the force, in the order of the curve"),
        "amplitude": ("mm", "half of the way to and fro of what is seen, the last looked at"),
        "phase": ("rad", "of harmonic 1 of what is looked at before the force"),
        "energy_per_cycle": ("N mm", "energy that the joints dissipate in a cycle"),
        "damping": ("1", "energy lost in a cycle over 4π times the largest kinetic energy"),
        "slip": (
            "1",
            "share of the cycle in which a joint slips, mean of those that touch at rest",
        ),
        "separated": ("1", "share of the cycle in which they are apart"),
        "left_out": ("1", "estimated share of the joints' vibration in harmonics left out"),
    },
    NODES: {
        "slip": ("1", "share of the cycle in which each joint slips, by point of the curve"),
        "separated": ("1", "share of the cycle in which each joint is apart"),
        "energy": ("N mm", "energy that each joint dissipates in a cycle"),
    },
    RESONANCE: {
        "displacement": ("mm", "of each joint along x, y and its closing, at times of a cycle"),
        "force": ("N", "of each joint along x, y and its pressure"),
        "state": ("1", "of each joint: 0 sticks, 1 slips, 2 is apart"),
    },
    LOOPS: {
        "displacement": ("mm", "between the targets, or the mean of the joints, in a cycle"),
        "force": ("N", "of all joints together along it"),
        "expansion": ("N", "the same in the harmonics of the motion alone"),
    },
    "contact": {
        "x": ("mm", "of each joint on the contact plane"),
        "y": ("mm", "of each joint on the contact plane"),
        "gap": ("mm", "of the bodies without load"),
        "area": ("mm^2", "that belongs to each joint"),
        "normal_force": ("N", "of each joint at rest"),
        "normal_displacement": ("mm", "closing of each joint by the load at rest"),
    },
    "backbone": {
        "force": ("N", "amplitude of the force"),
        "frequency": ("Hz", "of phase resonance: what is driven lags the force by 90 degrees"),
        "amplitude": ("mm", "half of the way to and fro of what is looked at"),
        "damping": ("1", "energy lost in a cycle over 4π times the largest kinetic energy"),
        "energy_per_cycle": ("N mm", "energy that the joints dissipate in a cycle"),
        "slip": (
            "1",
            "share of the cycle in which a joint slips, mean of those that touch at rest",
        ),
    },
    FORCE_SWEEPS: {
        "force": ("N", "amplitude of the force, in the order of the curve"),
        "amplitude": ("mm", "half of the way to and fro of what is looked at"),
        "phase": ("rad", "of harmonic 1 of what is looked at before the force"),
        "damping": ("1", "energy lost in a cycle over 4π times the largest kinetic energy"),
        "energy_per_cycle": ("N mm", "energy that the joints dissipate in a cycle"),
        "slip": ("1", "share of the cycle in which a joint that touches at rest slips, their mean"),
        "left_out": ("1", "estimated share of the joints' vibration in harmonics left out"),
    },
    "linear": {
        "frequency": ("Hz", "frequency of the force"),
        "free": ("mm/N", "amplitude of what is looked at over the force, without the joints"),
        "stuck": ("mm/N", "amplitude of what is looked at over the force, all joints stuck"),
    },
}
