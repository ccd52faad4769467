"""Harmonics that a resolution neglects: their estimated share in the vibration of the joints."""

from __future__ import annotations

import numpy as np

from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.periodic.receptance import Receptance
from fe_models.dynamics.rings.travelling_wave import WaveReceptance, transfer_of
from sa_solver.types import Array

# Neglected harmonics are examined up to this multiple of the highest one, and at least up to this
# harmonic.
EXAMINED_MULTIPLE, EXAMINED_AT_LEAST = 2, 63


class NeglectedHarmonics:
    """Response of the joints in the harmonics that a resolution neglects.

    Parameters
    ----------
    resolution
        Harmonics that are kept, and samples of a period.
    structures
        The structure with its joints free, and with its joints stuck.
    directions
        Number of directions of each joint.
    """

    def __init__(
        self,
        resolution: Resolution,
        structures: tuple[Receptance | WaveReceptance, ...],
        directions: int,
    ) -> None:
        self._kept, self._directions = resolution, directions
        self._resolution = examined(resolution)
        self._numbers = np.array(self._resolution.harmonics)
        self._transfers = [transfer_of(self._resolution, of, directions) for of in structures]

    def sizes(self, samples: Array, frequency: float) -> Array:
        """Return the norm [mm] of the joints' response in each harmonic 0, 1, 2, ...

        The neglected harmonics of the joints' forces act on the structure, once with its joints
        free and once with its joints stuck. The larger response counts, because a harmonic may meet
        a mode of either structure. The norms of the kept harmonics are 0.

        Parameters
        ----------
        samples
            Samples ``(t, j, d)`` [N] of the joints' forces over a period.
        frequency
            Frequency [Hz].
        """
        neglected = self._resolution
        force = (neglected.weights @ samples.reshape(neglected.samples, -1)).reshape(
            neglected.size, -1, self._directions
        )
        by_structure = []
        for transfer in self._transfers:
            steady = transfer.steady(2.0 * np.pi * frequency * self._numbers)
            motion = steady.respond(transfer.modal(force.transpose(1, 0, 2)))
            by_structure.append(neglected.sizes(transfer.shaped(transfer.at_joints(motion))))
        sizes = np.zeros(self._numbers[-1] + 1)
        sizes[self._numbers] = np.maximum(*by_structure)
        sizes[list(self._kept.harmonics)] = 0.0
        return sizes


def examined(resolution: Resolution) -> Resolution:
    """Return the neglected harmonics up to a limit, and the highest harmonic that is kept."""
    kept = resolution.harmonics
    highest = min(
        (resolution.samples - 1) // 2, max(EXAMINED_MULTIPLE * kept[-1], EXAMINED_AT_LEAST)
    )
    others = set(range(highest + 1)).difference(kept[:-1])
    return Resolution(tuple(sorted(others)), resolution.samples)
