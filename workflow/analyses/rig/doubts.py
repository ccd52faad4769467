"""A doubt about masses, springs and frequencies of a rig: units that do not fit each other."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sa_solver.types import Array
from workflow.analyses.rig.matrix_body import MatrixBody
from workflow.analyses.rig.structure import FrictionRig, RowOfMasses, joints_of
from workflow.case.sections import Section

# Of a force at one frequency: so many times away from every mode it hardly is meant to be.
AWAY = 30.0
# In the place of a stiffness that nobody gives [N/mm].
RIGID = 1e12


def about_modes(
    path: str,
    span: tuple[float, float],
    structure: Section,
    stiffness: float = RIGID,
    shared: bool = True,
) -> Iterator[str]:
    """About a ``span`` [Hz] in which a rig has no mode, be its joints of a stiffness open or stuck.

    Some may have a ``shared`` law. Between both every mode moves as the joint slips. A reduced body
    is not looked at.
    """
    if not isinstance(structure, RowOfMasses | FrictionRig):
        return
    opened, stuck = (modes(structure, held, shared) for held in (0.0, stiffness))
    low, high = span
    if not ((opened <= high) & (stuck >= low)).any():
        shown = (", ".join(f"{f:.3g}" for f in frequencies) for frequencies in (opened, stuck))
        free, held = shown
        yield (
            f"{path}: no mode of the rig is near: they are at {free} Hz with an open joint, at "
            f"{held} Hz with a stuck one; are masses, springs and stiffness in the units meant?"
        )


def about_matrices(structure: Section, highest: float) -> Iterator[str]:
    """About matrices that are hardly meant, by their masses and frequencies.

    They are to move up to the ``highest`` one [Hz].
    """
    if isinstance(structure, MatrixBody):
        yield from structure.doubts(highest)


def _stretches(structure: RowOfMasses | FrictionRig, shared: bool) -> Array:
    """What joints stretch by ``(j, n)``."""
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
    """Natural frequencies [Hz] of the masses in a row, whose joints have a stiffness [N/mm]."""
    masses, springs = np.array(structure.masses), np.array(structure.springs)
    matrix = np.diag(springs + np.append(springs[1:], 0.0))
    matrix -= np.diag(springs[1:], 1) + np.diag(springs[1:], -1)
    for stretch in _stretches(structure, shared):
        matrix += stiffness * np.outer(stretch, stretch)
    # Over the smallest mass, so that no slipped exponent overflows.
    least = masses.min()
    scale = np.sqrt(least / masses)
    squares = np.linalg.eigvalsh(scale[:, None] * matrix * scale)
    frequencies: Array = np.sqrt(np.maximum(squares, 0.0)) / np.sqrt(least) / (2.0 * np.pi)
    return frequencies
