"""Declarations of the results of a motion, and of a joint that wears."""

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

PARAMETERS = """
    friction | 1 | energy | coefficient of friction
    stiffness | N/mm | energy | slope of the stuck joint
    residual_stiffness | N/mm | energy | slope of the sliding joint
    normal_load | N | energy | normal load
"""
"""Declarations of the parameters of a joint that evolve, in the order of reports."""
EVOLUTION = f"""
    energy | N mm | energy | energy dissipated so far in the joint
    cycles | 1 | energy | cycles so far
    energy_per_cycle | N mm | energy | energy dissipated in a cycle
    {PARAMETERS}
"""
"""Declarations of the curves over the energy that a joint has dissipated."""
