"""Declarations of the results of a steady vibration."""

from __future__ import annotations

from workflow.models.vibration.amount import FORCE, ExcitationSize

AMPLITUDES = """
    amplitude | mm | {dim} seen | half the peak-to-peak motion of the reported points, the
        last being the main one; relative to the ground if it moves
    absolute_amplitude | mm | {dim} seen | half the peak-to-peak motion of the reported points,
        the last being the main one, including that of the ground
"""
MOTIONS = """
    phase | rad | {dim} | phase by which harmonic 1 of the reported point leads the force,
        or a sine at t = 0
    energy_per_cycle | N mm | {dim} | energy that the joints dissipate in a cycle
    damping | 1 | {dim} | energy lost in a cycle over 4π times the largest kinetic energy
    slip | 1 | {dim} | share of the cycle in which a joint slips, mean of those that touch at rest
    separated | 1 | {dim} | share of the cycle in which they are open
    left_out | 1 | {dim} | estimated share of the joints' vibration in harmonics not included
"""
"""Declarations of the motions along a curve, by their dimension ``dim``; absolute amplitudes only
where the ground moves."""


def linear_limits(amount: ExcitationSize) -> str:
    """Return the declaration of the linear limits under an amount: a force or a level."""
    unit, _ = amount.receptance
    size = f"amplitude of the reported point over the {amount.name}"
    size += "" if amount is FORCE else ", of harmonic 1"
    return f"""
    frequency | Hz | frequency | frequency of the force
    free | {unit} | frequency | {size}, without the joints
    stuck | {unit} | frequency | {size}, all joints stuck
"""
