"""Loads of a vibration case on its rig, and the displacement of the ground in a motion."""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from fe_models.dynamics.periodic.harmonics import ComplexArray
from fe_models.dynamics.periodic.load import PeriodicLoad
from fe_models.dynamics.rig import unit_force
from sa_solver.types import Array
from workflow.analyses.rig.place_names import place_names_of
from workflow.analyses.rig.places import Moved
from workflow.analyses.vibration.case.excitation import (
    GroundDisplacement,
    VibrationExcitation,
    waves_of,
)
from workflow.errors import EntryError
from workflow.models.rig.rig_model import RigModel
from workflow.models.vibration.amount import LEVEL
from workflow.models.vibration.excitation import Driving, MovingGround

# Share that rounding leaves of forces which cancel each other.
CANCELLED = 1e-12


def driving_of(excitation: VibrationExcitation | None, rig: RigModel, highest: int) -> Driving:
    """Return the excitation of a rig; without an excitation in the case, that of its driven place.

    Records are used up to the ``highest`` harmonic. Raises EntryError for places and directions
    that the rig does not have.
    """
    if excitation is None:
        return Driving.sine(rig.driven)
    return _driven_by(excitation, rig, highest)


def _driven_by(excitation: VibrationExcitation, rig: RigModel, highest: int) -> Driving:
    size = len(rig.model.mass)
    waves: defaultdict[int, ComplexArray] = defaultdict(lambda: np.zeros(size, dtype=complex))
    # Sum of the sizes of all parts of harmonic 1, even where they cancel each other.
    parts = 0.0
    inertial: defaultdict[int, ComplexArray] = defaultdict(lambda: np.zeros(size, dtype=complex))
    for number, force in enumerate(excitation.forces):
        shape = _shape(rig, force, f"excitation.forces.{number}")
        waves[force.harmonic] += force.wave * shape
        parts += abs(force.wave) * float(np.linalg.norm(shape)) * (force.harmonic == 1)
    for number, record in enumerate(excitation.records):
        shape = _shape(rig, record, f"excitation.records.{number}")
        for order, wave in waves_of(record, highest):
            waves[order] += wave * shape
            parts += abs(wave) * float(np.linalg.norm(shape)) * (order == 1)
    ground = []
    for number, motion in enumerate(excitation.base):
        if not rig.translations:
            raise EntryError(
                f"excitation.base.{number}",
                "the reduced body is held inside and does not move with the ground as a whole; "
                "allowed: a body reduced with the points that hold it, or forces",
            )
        if motion.direction not in rig.translations:
            raise EntryError(
                f"excitation.base.{number}.direction",
                f"{motion.direction}: the structure does not move in this direction; allowed: "
                f"{', '.join(rig.translations)}",
            )
        along = rig.translations[motion.direction]
        wave = complex(-1j * motion.amplitude * np.exp(1j * motion.phase))
        accelerated = not isinstance(motion, GroundDisplacement)
        if accelerated:
            waves[motion.harmonic] -= wave * along.inertia
        else:
            inertial[motion.harmonic] += wave * along.inertia
        ground.append(MovingGround(motion.harmonic, wave, accelerated, along.rigid))
    if not excitation.base and float(np.linalg.norm(waves[1])) <= CANCELLED * parts:
        raise EntryError(
            "excitation",
            "the parts of harmonic 1 cancel, so nothing drives at the frequency; allowed: parts "
            "that do not cancel",
        )
    load = PeriodicLoad(dict(waves), inertial=dict(inertial))
    return Driving(load, tuple(ground), LEVEL, tuple(excitation.left_out(highest)))


def _shape(rig: RigModel, place: Moved, key: str) -> Array:
    """Return forces ``(n,)`` of 1 N at a place."""
    shares = place_names_of(rig).shared(place, key)
    return np.sum([share * unit_force(rig.model, name) for name, share in shares], axis=0)
