"""Numbers of a run of specimens, in base units."""

from __future__ import annotations

from typing import Any

import numpy as np

from fe_models.joints.reduced_contact import ReducedPair
from sa_solver.types import Array
from workflow.analyses.specimens.case import Reported
from workflow.analyses.specimens.half_space import BulkCompliance, HalfSpaceState
from workflow.analyses.specimens.outcome import LoadOutcome, SpecimensOutcome, SpecimensState
from workflow.models.specimens.wear import BlockState

# A quantity is steady while it stays within this value of its last one: relative to the stiffness,
# and to the mean pressure.
STEADY = 0.02
# The slope of the loop is taken up to this share of the sliding force: most nodes still stick.
SLOPE_SHARE = 0.5
# A quantity that becomes steady after this share of the run might change in a longer one.
LATE = 0.8


def frequencies(outcome: SpecimensOutcome) -> dict[str, Any]:
    """Return natural frequencies of each free specimen [Hz]."""
    return {
        f"body_{number}": {"full": full.tolist(), "reduced": reduced.tolist()}
        for number, (full, reduced) in enumerate(outcome.model.reduction.frequencies, 1)
    }


def explanation(outcome: SpecimensOutcome) -> list[str]:
    """Return sentences on where specimens and half-space differ, and why."""
    bulk, first = outcome.bulk, outcome.loads[0]
    (stiff_z, stiff_x), (half_z, half_x) = bulk.specimens, bulk.half_space
    ring = outcome.model.model.specimen.ring_distance
    unworn, beside = first.kept[0].block.contact.normal, first.half_space[0]
    shares = [edge_share(outcome.model.pair, p) for p in (unworn.pressure, beside.nodal_pressure)]
    softer = (
        ": they lack the material that a half-space has around the strips"
        if bulk.tangential > 0.0
        else ""
    )
    held = f": held {ring:g} mm from the pad, where a half-space yields"
    stiffer = held if bulk.normal < 0.0 else ""
    sentences = [
        f"with the pad tied along x, the specimens have {0.001 * stiff_x:.4g} N/um and a "
        f"half-space {0.001 * half_x:.4g}, so that the specimens' compliance differs by "
        f"{1000000.0 * bulk.tangential:.3g} nm/N{softer}",
        f"with the pad tied along z, they have {0.001 * stiff_z:.4g} and {0.001 * half_z:.4g} "
        f"N/um, a difference of {1000000.0 * bulk.normal:.3g} nm/N{stiffer}",
        f"at {first.force:g} N, unworn, {unworn.area:.3g} mm^2 touch on the specimens, in whole "
        f"nodes, and {beside.area:.3g} mm^2 on the half-space, in whole cells",
    ]
    if max(shares) > 0.0:
        sentences.append(
            f"there the border of the pad carries {shares[0]:.3g} times the mean pressure on the "
            f"specimens and {shares[1]:.3g} times on the half-space"
        )
    return sentences


def tied_pad(bulk: BulkCompliance) -> dict[str, Any]:
    """Return the stiffness of the tied pad, specimens and half-space, and the bulk compliance."""
    rows = zip(bulk.specimens, bulk.half_space, (bulk.normal, bulk.tangential), strict=True)
    keys = "specimens", "half_space", "bulk_compliance"
    return {
        name: dict(zip(keys, row, strict=True))
        for name, row in zip(("normal", "tangential"), rows, strict=True)
    }


def load_summary(outcome: SpecimensOutcome, load: LoadOutcome) -> dict[str, Any]:
    """Return all numbers under one normal force."""
    end, areas = load.blocks[-1], outcome.model.pair.areas
    steady = steady_states(outcome.model.pair, load.blocks)
    return {
        "normal_force": load.force,
        "cycles": end.cycles,
        "cycle_blocks": len(load.blocks) - 1,
        "energy": end.energy,
        "volumes": (end.depths @ areas).tolist(),
        "depths": end.depths.max(axis=1).tolist(),
        "unworn": _state_summary(outcome, load, 0),
        "worn": _state_summary(outcome, load, -1),
        "steady": {
            name: {"cycles": state.cycles, "energy": state.energy} for name, state in steady.items()
        },
        "coupled_cycle": {
            **_uncoupled("energy", *load.marched.energy),
            **_uncoupled("secant_stiffness", *load.marched.secant_stiffness),
            "pressure_change": load.marched.pressure_change,
        },
    }


def _uncoupled(name: str, marched: float, uncoupled: float) -> dict[str, float]:
    """Return a quantity of the coupled cycle, with its value in the uncoupled one."""
    difference = float(uncoupled / marched - 1.0) if marched else 0.0
    return {name: marched, f"{name}_uncoupled": uncoupled, f"{name}_difference": difference}


def _state_summary(outcome: SpecimensOutcome, load: LoadOutcome, place: int) -> dict[str, Any]:
    """Return numbers of specimens and half-space on one shape; ``place`` is 0 or -1."""
    state, beside = load.kept[place], load.half_space[place]
    contact, areas = state.block.contact, outcome.model.pair.areas
    normal = contact.normal
    return {
        # With all nodes in contact stuck, and as the slope of the loop.
        "stick_stiffness": contact.stick_stiffness,
        "secant_stiffness": state.curve.secant_stiffness(SLOPE_SHARE),
        "area": normal.area,
        "approach": normal.approach,
        "peak_pressure": float(normal.pressure.max()),
        "edge_pressure_share": edge_share(outcome.model.pair, normal.pressure),
        "pressure_deviation": pressure_deviation(areas, normal.pressure),
        "friction": contact.friction,
        "energy_per_cycle": contact.energy,
        "half_space": _beside(outcome, state, beside),
    }


def _beside(
    outcome: SpecimensOutcome, state: SpecimensState, beside: HalfSpaceState
) -> dict[str, float]:
    """Return numbers of the half-space, the misfit of its link, and differences of its fields."""
    areas, contact = outcome.model.pair.areas, state.block.contact
    shear = contact.tangential.shear / areas
    return {
        "stick_stiffness": beside.stick_stiffness,
        "area": beside.area,
        "approach": beside.approach,
        **({} if beside.misfit is None else {"link_misfit": beside.misfit}),
        "peak_pressure": float(beside.pressure.max()),
        "edge_pressure_share": edge_share(outcome.model.pair, beside.nodal_pressure),
        "energy_per_cycle": beside.energy,
        "pressure_difference": _difference(areas, contact.normal.pressure, beside.nodal_pressure),
        "shear_difference": _difference(areas, shear, beside.nodal_shear),
    }


def pressure_deviation(areas: Array, pressure: Array) -> float:
    """Return the root mean square of p/mean - 1 over the pad, 0 for uniform pressure."""
    mean = np.average(pressure, weights=areas)
    return float(np.sqrt(np.average((pressure / mean - 1.0) ** 2, weights=areas)))


def edge_share(pair: ReducedPair, pressure: Array) -> float:
    """Return the mean pressure of the nodes on the border of the pad over that of the pad."""
    place = np.abs(pair.face.coordinates)
    border = np.any(place > place.max(axis=0) * (1.0 - 1e-9), axis=1)
    on_border = np.average(pressure[border], weights=pair.areas[border])
    return float(on_border / np.average(pressure, weights=pair.areas))


def _difference(areas: Array, field: Array, other: Array) -> float:
    """Return the root mean square of the difference of two nodal fields over that of the first."""
    size = float(np.sum(areas * field**2))
    return float(np.sqrt(np.sum(areas * (field - other) ** 2) / size)) if size else 0.0


def steady_states(pair: ReducedPair, blocks: tuple[BlockState, ...]) -> dict[str, BlockState]:
    """Return the first states from which stiffness and pressure evenness stay within ``STEADY``."""
    stiffness = np.array([state.contact.stick_stiffness for state in blocks])
    pressures = (state.contact.normal.pressure for state in blocks)
    deviation = np.array([pressure_deviation(pair.areas, pressure) for pressure in pressures])
    return {
        "stiffness": blocks[_settled(stiffness / stiffness[-1])],
        "pressure": blocks[_settled(deviation)],
    }


def _settled(values: Array) -> int:
    """Return the first place from which all values are near the last one."""
    away = np.flatnonzero(np.abs(values - values[-1]) > STEADY)
    return int(away[-1]) + 1 if len(away) else 0


def collapse(loads: list[dict[str, Any]]) -> dict[str, float] | None:
    """Return the ratio of largest to smallest cycles, and energy, until stiffness is steady.

    Returns None if the stiffness is steady from the start under some force.
    """
    steady = [load["steady"]["stiffness"] for load in loads]
    if min(state["energy"] for state in steady) == 0.0:
        return None
    values = {key: [state[key] for state in steady] for key in ("cycles", "energy")}
    return {key: max(those) / min(those) for key, those in values.items()}


def reported_summary(
    reported: Reported, loads: list[dict[str, Any]], coefficients: tuple[float, float]
) -> dict[str, Any]:
    """Return the wear coefficients with which the pair becomes steady after the reported cycles.

    Shape and energy depend only on cycles times coefficients. The coefficients are None if the
    unworn pair is steady.
    """
    (load,) = [load for load in loads if load["normal_force"] == reported.normal_force]
    cycles = load["steady"][reported.steady]["cycles"]
    ratio = cycles / reported.cycles
    return {
        "normal_force": reported.normal_force,
        "steady": reported.steady,
        "cycles_reported": reported.cycles,
        "cycles_computed": cycles,
        "coefficients": [ratio * coefficient for coefficient in coefficients] if ratio else None,
    }


def late(load: dict[str, Any]) -> bool:
    """Return whether a quantity becomes steady so late that it may change in a longer run."""
    end = load["cycles"]
    return any(state["cycles"] > LATE * end > 0.0 for state in load["steady"].values())
