"""Layout of the results of a steady vibration."""

from __future__ import annotations

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
from workflow.layout.declared import Declarations, Layout, over
from workflow.models.vibration.amount import ExcitationSize
from workflow.models.vibration.motions import COLUMNS, SLIPS
from workflow.models.vibration.results import linear_limits

CONVENTION = "x(t) = sum of Re(c_k exp(i k 2 pi f t)), forces being sines at t = 0"
LOOKED_AT = "half the peak-to-peak motion of the reported point"


def layout_of(amount: ExcitationSize) -> Layout:
    """Return the layout of a case whose excitation has an amount: a force or a level."""
    response = f"{RESPONSES}/<response>"
    along_force = {**_stability(amount.name), **_motions(amount.name)}
    # A curve may fold back, and a frequency of one motion stands below it: points, not frequencies,
    # are its dimension.
    branch = {
        **over(
            "point",
            frequency=("Hz", "frequency of the force, in the order of the curve"),
            speed=("rad/s", "of the engine, by its order"),
        ),
        **{
            name: COLUMNS[name]._replace(dims=("point", "seen"))
            for name in ("amplitude", "absolute_amplitude")
        },
        **_motions("point"),
        **_stability("point"),
    }
    bifurcations = bifurcation_columns(amount)
    return Layout(
        {
            "linear": linear_limits(amount),
            "names": {
                **over("place", places=("1", "whose displacements have harmonics")),
                **over(
                    "joint direction",
                    joints=("1", "stretch of every direction of every joint"),
                ),
            },
            DIAMETERS: {
                **over("diameters", diameters=("1", "nodal diameters of a wave")),
                **over(
                    "diameters mode",
                    free=("Hz", f"{_OF_EACH}, without the joints"),
                    stuck=("Hz", f"{_OF_EACH}, all joints stuck"),
                ),
            },
            "contact": over(
                "joint",
                x=("mm", "of each joint on the contact plane"),
                y=("mm", "of each joint on the contact plane"),
                gap=("mm", "gap of the bodies without load"),
                area=("mm^2", "area that belongs to each joint"),
                normal_force=("N", "of each joint at rest"),
                normal_displacement=("mm", "closing of each joint by the load at rest"),
            ),
            response: branch,
            f"{response}/{NODES}": _NODES,
            f"{response}/{RESONANCE}": _CYCLE,
            f"{response}/{LOOPS}/<loop>": over(
                "point",
                displacement=("mm", "between the targets, or the mean of the joints, in a cycle"),
                force=("N", "force of all joints together along it"),
                expansion=("N", "the same force in the harmonics of the motion alone"),
            ),
            f"{response}/{AT}": {
                **over(
                    "motion",
                    frequency=("Hz", "frequency of the force; motions in the order of the curve"),
                ),
                "amplitude": branch["amplitude"]._replace(dims=("motion", "seen")),
                "absolute_amplitude": branch["absolute_amplitude"]._replace(
                    dims=("motion", "seen")
                ),
                **_motions("motion"),
                **over(
                    "motion",
                    error=(
                        "1",
                        "estimated error of vibration or energy lost, due to harmonics and samples",
                    ),
                ),
            },
            f"{response}/{HARMONICS}/{CURVE}": {
                **over("point", frequency=("Hz", "f, in the order of the curve")),
                **_harmonics("by point of the curve and harmonic", "point"),
            },
            f"{response}/{HARMONICS}/<motion>": {
                **over("", frequency=("Hz", "f, of the motion")),
                **_harmonics("by harmonic", ""),
            },
            f"{response}/{BIFURCATIONS}": bifurcations,
            BACKBONE: {
                **over(amount.name, **{amount.name: (amount.unit, amount.description)}),
                **over(
                    amount.name,
                    frequency=(
                        "Hz",
                        "phase resonance: the driven point lags the force by 90 degrees",
                    ),
                    amplitude=("mm", LOOKED_AT),
                ),
                **along_force,
            },
            f"{BACKBONE}/{BIFURCATIONS}": bifurcations,
            f"{FURTHER}/<branch>": branch,
            f"{FURTHER}/<branch>/{BIFURCATIONS}": bifurcations,
            f"{FORCE_SWEEPS}/<sweep>": {
                **over(
                    amount.name,
                    **{
                        amount.name: (
                            amount.unit,
                            f"{amount.description}, in the order of the curve",
                        )
                    },
                ),
                **over(amount.name, amplitude=("mm", LOOKED_AT)),
                **along_force,
            },
            f"{FORCE_SWEEPS}/<sweep>/{BIFURCATIONS}": bifurcations,
            f"{MODES}/<mode>": _MODE,
        }
    )


def _motions(dim: str) -> Declarations:
    """Return results of structure and joints in motions along a dimension."""
    return {
        name: column._replace(dims=(dim,))
        for name, column in COLUMNS.items()
        if column.dims == ("point",)
    }


def _stability(dim: str) -> Declarations:
    of, unknown = "of a small deviation in a period", "NaN where unknown"
    return over(
        dim,
        stability=("1", "1 stable, -1 unstable, 0 unknown"),
        multiplier=("1", f"size of the largest multiplier {of}, {unknown}"),
        multiplier_error=("1", f"estimated error of the largest multiplier, {unknown}"),
        unstable_multipliers=("1", f"number of multipliers {of} certainly beyond 1"),
    )


def bifurcation_columns(amount: ExcitationSize) -> Declarations:
    """Return the columns of bifurcations other than their kinds."""
    along = "bifurcation"
    return {
        **over(along, frequency=("Hz", "of the force")),
        **over(along, **{amount.name: (amount.unit, amount.description)}),
        **over(
            along,
            amplitude=("mm", LOOKED_AT),
            multiplier=("1", "size of the one that passes the circle there"),
            multiplier_angle=("rad", "its angle: 0 of a fold, pi where the period doubles"),
            unstable_before=(
                "1",
                "number of multipliers beyond the circle before, NaN where unknown",
            ),
            unstable_after=("1", "and at the point after"),
        ),
    }


def _harmonics(order: str, along: str) -> Declarations:
    """Return complex coefficients of motions, by harmonic and ``along`` further dimensions."""
    joints = f"{along} harmonic joint direction"
    return {
        **over("harmonic", harmonic=("1", "k")),
        **over(
            f"{along} harmonic place",
            displacement=("mm", f"c_k of places against the ground, {order}: {CONVENTION}"),
        ),
        **over(
            joints,
            joint_displacement=("mm", f"c_k of joints, {order}: {CONVENTION}"),
            joint_force=("N", f"c_k of what joints resist with, {order}: {CONVENTION}"),
        ),
    }


_OF_EACH = "lowest natural frequencies of each number of nodal diameters"
_SHARE = "share of the cycle in which each joint"
_NODES = over(
    "point joint",
    slip=("1", f"{_SHARE} slips, by point of the curve"),
    separated=("1", f"{_SHARE} is open"),
    energy=("N mm", "energy that each joint dissipates in a cycle"),
)
_CYCLE = {
    **over(
        "sample joint direction",
        displacement=("mm", "of each joint along x, y and its closing, at times of a cycle"),
        force=("N", "of each joint along x, y and its pressure"),
    ),
    **over("sample joint", state=("1", "state of each joint: 0 sticks, 1 slips, 2 is open")),
}
_RICHER = "estimated error due to harmonics and samples"
_ALONG_MODE = "modal_amplitude"
_MODE = over(
    _ALONG_MODE,
    amplitude=("mm", f"{LOOKED_AT}, in the order of the curve"),
    modal_amplitude=("t^0.5 mm", "amplitude of the mode: norm of harmonic 1 by the mass"),
    frequency=("Hz", "of the mode"),
    damping=("1", "damping ratio of the mode: energy lost over 2ω ∫ x'ᵀ M x' dt"),
    energy_per_cycle=("N mm", "energy that the joints dissipate in a cycle"),
    slip=("1", SLIPS),
    frequency_error=("1", _RICHER),
    damping_error=("1", f"{_RICHER}, of the ratio"),
)
