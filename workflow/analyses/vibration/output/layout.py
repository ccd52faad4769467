"""Layout of the results of a steady vibration."""

from __future__ import annotations

from workflow.layout.declared import Declarations, Layout, declared
from workflow.models.vibration.amount import ExcitationSize
from workflow.models.vibration.layout import AMPLITUDES, MOTIONS, linear_limits

CONVENTION = "x(t) = sum of Re(c_k exp(i k 2 pi f t)), forces being sines at t = 0"
_LOOKED_AT = "half the peak-to-peak motion of the reported point"
_STABILITY = """
    stability | 1 | {dim} | 1 stable, -1 unstable, 0 unknown
    multiplier | 1 | {dim} | size of the largest multiplier in a period, NaN where unknown
    multiplier_error | 1 | {dim} | estimated error of the largest multiplier, NaN where unknown
    unstable_multipliers | 1 | {dim} | number of multipliers in a period certainly beyond 1
"""
# A curve may fold back, and a frequency of one motion stands below it: points, not frequencies, are
# its dimension.
_BRANCH = f"""
    frequency | Hz | point | frequency of the force, in the order of the curve
    speed | rad/s | point | speed of the engine, by its order
    {AMPLITUDES.format(dim="point")}{MOTIONS.format(dim="point")}{_STABILITY.format(dim="point")}
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
    response, name = "responses/<response>", amount.name
    along_force = f"""
    amplitude | mm | {name} | {_LOOKED_AT}
    {_STABILITY.format(dim=name)}{MOTIONS.format(dim=name)}"""
    return Layout.read(f"""
linear{linear_limits(amount)}
names
    places | 1 | place | name of a place whose displacements have harmonics
    joints | 1 | joint direction | name of every direction of every joint, whose stretch has
        harmonics
nodal_diameters
    diameters | 1 | diameters | nodal diameters of a wave
    free | Hz | diameters mode | lowest natural frequencies, without the joints
    stuck | Hz | diameters mode | lowest natural frequencies, all joints stuck
contact
    x, y | mm | joint | place of each joint on the contact plane
    gap | mm | joint | gap of the bodies without load
    area | mm^2 | joint | area that belongs to each joint
    normal_force | N | joint | force of each joint at rest
    normal_displacement | mm | joint | closing of each joint by the load at rest
{response}, further_branches/<branch>{_BRANCH}
{response}/nodes
    slip | 1 | point joint | share of the cycle in which each joint slips, by point of the curve
    separated | 1 | point joint | share of the cycle in which each joint is open
    energy | N mm | point joint | energy that each joint dissipates in a cycle
{response}/resonance
    displacement | mm | sample joint direction | motion of each joint along x, y, and its
        closing, in time
    force | N | sample joint direction | force of each joint along x, y, and its normal force
    state | 1 | sample joint | state of each joint: 0 sticks, 1 slips, 2 is open
{response}/loops/<loop>
    displacement | mm | point_of_loop | motion between the targets, or the mean of the joints, in a
        cycle
    force | N | point_of_loop | force of all joints together along it
    expansion | N | point_of_loop | the same force in the harmonics of the motion alone
{response}/at
    frequency | Hz | motion | frequency of the force; motions in the order of the curve
    {AMPLITUDES.format(dim="motion")}{MOTIONS.format(dim="motion")}
    error | 1 | motion | estimated error of vibration or energy lost, due to harmonics and
        samples
{response}/harmonics/curve
    frequency | Hz | point | frequency f, in the order of the curve
    {_HARMONICS.format(along="point", order="by point of the curve and harmonic")}
{response}/harmonics/<motion>
    frequency | Hz | | frequency f of the motion
    {_HARMONICS.format(along="", order="by harmonic")}
backbone
    {name} | {amount.unit} | {name} | {amount.description}
    frequency | Hz | {name} | phase resonance: the driven point lags the force by 90
        degrees
    {along_force}
force_sweeps/<sweep>
    {name} | {amount.unit} | {name} | {amount.description}, in the order of the curve
    {along_force}
{response}/bifurcations, further_branches/<branch>/bifurcations{_bifurcations(amount)}
backbone/bifurcations, force_sweeps/<sweep>/bifurcations{_bifurcations(amount)}
modes/<mode>
    amplitude | mm | modal_amplitude | {_LOOKED_AT}, in the order of the curve
    modal_amplitude | t^0.5 mm | modal_amplitude | norm of harmonic 1 by the mass
    frequency | Hz | modal_amplitude | frequency of the mode
    damping | 1 | modal_amplitude | damping ratio of the mode: energy lost over
        2ω ∫ x'ᵀ M x' dt
    energy_per_cycle | N mm | modal_amplitude | energy that the joints dissipate in a cycle
    slip | 1 | modal_amplitude | share of the cycle in which a joint slips, mean of those touching
    frequency_error | 1 | modal_amplitude | estimated error due to harmonics and samples
    damping_error | 1 | modal_amplitude | estimated error due to harmonics and samples, of the ratio
""")


def bifurcation_columns(amount: ExcitationSize) -> Declarations:
    """Return the columns of bifurcations other than their kinds."""
    return declared(_bifurcations(amount))


def _bifurcations(amount: ExcitationSize) -> str:
    return f"""
    frequency | Hz | bifurcation | frequency of the force
    {amount.name} | {amount.unit} | bifurcation | {amount.description}
    amplitude | mm | bifurcation | {_LOOKED_AT}
    multiplier | 1 | bifurcation | size of the multiplier that passes the unit circle
    multiplier_angle | rad | bifurcation | angle of this multiplier: 0 at a fold, pi if the
        period doubles
    unstable_before | 1 | bifurcation | number of multipliers beyond the unit circle before, NaN
        where unknown
    unstable_after | 1 | bifurcation | number of multipliers beyond the unit circle after, NaN where
        unknown
"""
