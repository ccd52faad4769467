"""Declarations of the results of a motion."""

from __future__ import annotations

CURVES = """
    time | s | time | time
    excitation | N | time | force of the excitation
    displacement | mm | time seen | displacements of the reported points
    acceleration | mm/s^2 | time seen | accelerations of the reported points
    joint_force | N | time | force of the joint, or the sum of several, resisting
    dissipated | N mm | time | energy that the joint has dissipated since the beginning
"""
"""Declarations of the curves of a motion."""
