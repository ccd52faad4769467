"""Layout of the results of a steady vibration."""

from __future__ import annotations

from workflow.analyses.vibration.case.excitation import FORCE, ExcitationSize
from workflow.analyses.vibration.output.outcome import (
    AT,
    BACKBONE,
    BIFURCATIONS,
    CURVE,
    DIAMETERS,
    FORCE_SWEEPS,
    FURTHER,
    HARMONICS,
    LOOPS,
    MODES,
    NODES,
    RESONANCE,
    RESPONSES,
)
from workflow.layout.declared import Declarations, Layout, declared

CONVENTION = "x(t) = sum of Re(c_k exp(i k 2 pi f t)), forces being sines at t = 0"
_LOOKED_AT = "half of the way to and fro of what is looked at"
_MOTIONS = """
    phase | rad | {dim} | of harmonic 1 of what is looked at before the force, or a sine at t = 0
    energy_per_cycle | N mm | {dim} | energy that the joints dissipate in a cycle
    damping | 1 | {dim} | energy lost in a cycle over 4π times the largest kinetic energy
    slip | 1 | {dim} | share of the cycle in which a joint slips, mean of those that touch at rest
    separated | 1 | {dim} | share of the cycle in which they are apart
    left_out | 1 | {dim} | estimated share of the joints' vibration in harmonics left out
"""
_STABILITY = """
    stability | 1 | {dim} | 1 stable, -1 unstable, 0 unknown
    multiplier | 1 | {dim} | size of the largest multiplier in a period, NaN where it is not known
    multiplier_error | 1 | {dim} | estimated, of the largest multiplier, NaN where it is not known
    unstable_multipliers | 1 | {dim} | multipliers of a small deviation in a period beyond 1, surely
"""
_AMPLITUDES = """
    amplitude | mm | {dim} seen | half of the way to and fro of what is seen, the last looked at;
        relative to the ground if it moves
    absolute_amplitude | mm | {dim} seen | half of the way to and fro of what is seen, the last
        looked at, that of the ground included
"""
# A curve may fold back, and a frequency of one motion stands below it: points, not frequencies, are
# its dimension.
_BRANCH = f"""
    frequency | Hz | point | frequency of the force, in the order of the curve
    speed | rad/s | point | of the engine, by its order
    {_AMPLITUDES.format(dim="point")}{_MOTIONS.format(dim="point")}{_STABILITY.format(dim="point")}
"""
_HARMONICS = f"""
    harmonic | 1 | harmonic | k
    displacement | mm | {{along}} harmonic place | c_k of places against the ground, {{order}}:
        {CONVENTION}
    joint_displacement | mm | {{along}} harmonic joint direction | c_k of joints, {{order}}:
        {CONVENTION}
    joint_force | N | {{along}} harmonic joint direction | c_k of what joints resist with,
        {{order}}: {CONVENTION}
"""


def layout_of(amount: ExcitationSize) -> Layout:
    """Return the layout of a case whose excitation has an amount: a force or a level."""
    response, name = f"{RESPONSES}/<response>", amount.name
    along_force = f"""
    amplitude | mm | {name} | {_LOOKED_AT}
    {_STABILITY.format(dim=name)}{_MOTIONS.format(dim=name)}"""
    unit, _ = amount.receptance
    size = f"amplitude of what is looked at over the {name}"
    size += "" if amount is FORCE else ", of harmonic 1"
    return Layout.read(f"""
linear
    frequency | Hz | frequency | frequency of the force
    free | {unit} | frequency | {size}, without the joints
    stuck | {unit} | frequency | {size}, all joints stuck
names
    places | 1 | place | whose displacements have harmonics
    joints | 1 | joint direction | of every direction of every joint: what it stretches by
{DIAMETERS}
    diameters | 1 | diameters | nodal diameters of a wave
    free | Hz | diameters mode | lowest natural frequencies, without the joints
    stuck | Hz | diameters mode | lowest natural frequencies, all joints stuck
contact
    x, y | mm | joint | of each joint on the contact plane
    gap | mm | joint | of the bodies without load
    area | mm^2 | joint | that belongs to each joint
    normal_force | N | joint | of each joint at rest
    normal_displacement | mm | joint | closing of each joint by the load at rest
{response}, {FURTHER}/<branch>{_BRANCH}
{response}/{NODES}
    slip | 1 | point joint | share of the cycle in which each joint slips, by point of the curve
    separated | 1 | point joint | share of the cycle in which each joint is apart
    energy | N mm | point joint | energy that each joint dissipates in a cycle
{response}/{RESONANCE}
    displacement | mm | sample joint direction | of each joint along x, y, and its closing, in time
    force | N | sample joint direction | of each joint along x, y and its pressure
    state | 1 | sample joint | of each joint: 0 sticks, 1 slips, 2 is apart
{response}/{LOOPS}/<loop>
    displacement | mm | point_of_loop | between the targets, or the mean of the joints, in a cycle
    force | N | point_of_loop | of all joints together along it
    expansion | N | point_of_loop | the same in the harmonics of the motion alone
{response}/{AT}
    frequency | Hz | motion | of the force; motions in the order of the curve
    {_AMPLITUDES.format(dim="motion")}{_MOTIONS.format(dim="motion")}
    error | 1 | motion | estimated error of vibration or energy lost, by harmonics and samples
{response}/{HARMONICS}/{CURVE}
    frequency | Hz | point | f, in the order of the curve
    {_HARMONICS.format(along="point", order="by point of the curve and harmonic")}
{response}/{HARMONICS}/<motion>
    frequency | Hz | | f, of the motion
    {_HARMONICS.format(along="", order="by harmonic")}
{BACKBONE}
    {name} | {amount.unit} | {name} | {amount.description}
    frequency | Hz | {name} | of phase resonance: what is driven lags the force by 90 degrees
    {along_force}
{FORCE_SWEEPS}/<sweep>
    {name} | {amount.unit} | {name} | {amount.description}, in the order of the curve
    {along_force}
{response}/{BIFURCATIONS}, {FURTHER}/<branch>/{BIFURCATIONS}{_bifurcations(amount)}
{BACKBONE}/{BIFURCATIONS}, {FORCE_SWEEPS}/<sweep>/{BIFURCATIONS}{_bifurcations(amount)}
{MODES}/<mode>
    amplitude | mm | modal_amplitude | {_LOOKED_AT}, in the order of the curve
    modal_amplitude | t^0.5 mm | modal_amplitude | norm of harmonic 1 by the mass
    frequency | Hz | modal_amplitude | of the mode
    damping | 1 | modal_amplitude | of the mode, as a share of what is critical: energy lost over
        2ω ∫ x'ᵀ M x' dt
    energy_per_cycle | N mm | modal_amplitude | energy that the joints dissipate in a cycle
    slip | 1 | modal_amplitude | share of the cycle in which a joint slips, mean of those touching
    frequency_error | 1 | modal_amplitude | estimated error by harmonics and samples
    damping_error | 1 | modal_amplitude | estimated error by harmonics and samples, of the ratio
""")


def bifurcation_columns(amount: ExcitationSize) -> Declarations:
    """Return the columns of bifurcations other than their kinds."""
    return declared(_bifurcations(amount))


def _bifurcations(amount: ExcitationSize) -> str:
    return f"""
    frequency | Hz | bifurcation | of the force
    {amount.name} | {amount.unit} | bifurcation | {amount.description}
    amplitude | mm | bifurcation | {_LOOKED_AT}
    multiplier | 1 | bifurcation | size of the one that passes the circle there
    multiplier_angle | rad | bifurcation | its angle: 0 of a fold, pi where the period doubles
    unstable_before | 1 | bifurcation | multipliers beyond the circle before, NaN where not known
    unstable_after | 1 | bifurcation | and at the point after
"""
