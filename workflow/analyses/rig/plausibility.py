"""Plausibility warnings about masses, springs and frequencies of a rig: units that do not fit."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sa_solver.types import Array
from workflow.analyses.rig.bodies.matrix_body import MatrixBody
from workflow.analyses.rig.structure import FrictionRig, RowOfMasses, joints_of
from workflow.case.sections import Section
from workflow.messages.warning_kinds import Notice, WarningKind

# A force at one frequency that is this many times away from every mode is hardly intended.
AWAY = 30.0
# Stiffness of a stuck joint whose stiffness is not given [N/mm].
RIGID = 1e12


def about_modes(
    path: str,
    span: tuple[float, float],
    structure: Section,
    stiffness: float = RIGID,
    shared: bool = True,
) -> Iterator[Notice]:
    """Warn if a rig has no mode in a ``span`` [Hz], with its joints neither open nor stuck.

    ``stiffness`` [N/mm] is that of the stuck joints, and some joints may have a ``shared`` law. As
    the joint slips, every mode moves between these two limits. Reduced bodies are not checked.
    """
    if not isinstance(structure, RowOfMasses | FrictionRig):
        return
    opened, stuck = (modes(structure, held, shared) for held in (0.0, stiffness))
    low, high = span
    if not ((opened <= high) & (stuck >= low)).any():
        shown = (", ".join(f"{f:.3g}" for f in frequencies) for frequencies in (opened, stuck))
        free, held = shown
        yield Notice(
            WarningKind.NO_MODE_NEAR,
            f"{path}: no mode of the rig is near: they are at {free} Hz with an open joint and at "
            f"{held} Hz with a stuck one; are the units of masses, springs and stiffness right?",
        )


def about_matrices(structure: Section, highest: float) -> Iterator[Notice]:
    """Warn about matrices with implausible masses or frequencies.

    ``highest`` is the highest frequency of the motion [Hz].
    """
    if isinstance(structure, MatrixBody):
        yield from structure.plausibility_warnings(highest)


def _stretches(structure: RowOfMasses | FrictionRig, shared: bool) -> Array:
    """Return the rows ``(j, n)`` that map displacements to the stretches of the joints."""
    unit = np.eye(len(structure.masses))
    if isinstance(structure, FrictionRig):
        return unit[-1:]
    ends = [(joint.points, joint.against) for joint in joints_of(structure, shared)]
    return np.array(
        [
            unit[int(second[1:]) - 1] - (0.0 if first is None else unit[int(first[1:]) - 1])
            for second, first in ends
        ]
    )


def modes(structure: RowOfMasses | FrictionRig, stiffness: float, shared: bool = True) -> Array:
    """Return natural frequencies [Hz] of masses in a row whose joints have a stiffness [N/mm]."""
    masses, springs = np.array(structure.masses), np.array(structure.springs)
    matrix = np.diag(springs + np.append(springs[1:], 0.0))
    matrix -= np.diag(springs[1:], 1) + np.diag(springs[1:], -1)
    for stretch in _stretches(structure, shared):
        matrix += stiffness * np.outer(stretch, stretch)
    # Scaled by the smallest mass, so that a slipped exponent does not cause an overflow.
    least = masses.min()
    scale = np.sqrt(least / masses)
    squares = np.linalg.eigvalsh(scale[:, None] * matrix * scale)
    frequencies: Array = np.sqrt(np.maximum(squares, 0.0)) / np.sqrt(least) / (2.0 * np.pi)
    return frequencies
