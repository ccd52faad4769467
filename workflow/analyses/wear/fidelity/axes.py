"""Axes of fidelity after the dimension: how fine each setting must be for its share of the error.

Shares are large where accuracy is costly: the cost of increments and wear steps grows with the root
of 1 / error, that of meshes in space with the fourth power of this root. The shares add up to 1,
and the errors of all axes are assumed to have the same sign. Estimates are those of the largest
depth and of the volume of either flank.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from workflow.analyses.wear.budget.lives import STEPS
from workflow.analyses.wear.case.sections import SIZES
from workflow.analyses.wear.choice import Decision
from workflow.analyses.wear.fidelity.estimate import Numbers, estimate
from workflow.analyses.wear.fidelity.probe import (
    coupled_life,
    end_life,
    life,
    plane_section,
)
from workflow.analyses.wear.increments import decide_increments
from workflow.analyses.wear.structures.dovetail.case import DovetailCase
from workflow.analyses.wear.structures.dovetail.model import section_joint
from workflow.case.changing import changed
from workflow.case.text.readable import percent

# Highest order of convergence of meshes and grids.
ORDER = 2.0
# Elements across a flank: fewer give no useful estimate, and the largest number takes seconds to
# condense in the plane. In space the time grows with the fourth power, so the mesh is never made
# finer than that of the case.
FEWEST_ELEMENTS, MOST_ELEMENTS = 7, 160
# Cells of a contact grid along one direction. Fewer hardly resolve a contact. The largest number
# holds in the plane; in space, where each doubling takes four times as long, the limit is this
# factor times the case's number. No grid is coarser than the case's by more than the last factor.
FEWEST_CELLS, MOST_STRIPS, FINER_SPACE, COARSER = 16, 512, 2, 4
# Rungs of a ladder that are probed before a choice: an order of convergence needs three.
LEAST_RUNGS = 3
# The contact solver's tolerance caused errors of at most 0.35 of itself in depth and volume, for
# tolerances from 1e-3 to 1e-6 on the flanks of two dovetails. So the tolerance is set to its share
# of the error, and to no more than the loosest measured one.
LOOSEST_TOLERANCE, LEFT_BY_TOLERANCE = 1e-3, 0.5
# Steps with an automatic tolerance of 0.1, 0.01, 0.003 and 0.001 caused errors of 1.2, 0.4, 0.23
# and 0.08 % of the largest depth on the section of the default joint, less of the volume, and 1.4,
# 0.27, 0.13 and 0.07 % where flanks carry different loads over 1e6 cycles: never more than the
# tolerance. Looser tolerances are hardly faster.
LOOSEST_STEPS = 0.1
# A drift below this is rounding of the structure's solver.
LEAST_DRIFT = 1e-4
# Relative tolerance on an error that equals its share except for rounding.
ROUNDING = 1e-9


@dataclass(frozen=True)
class FidelityAxis:
    """An approximation: its main ``entry``, its ``share`` of the accuracy and its decision.

    ``decide`` takes the case with the decisions of earlier axes, and the error that it may cause.
    """

    entry: str
    share: float
    decide: Callable[[DovetailCase, float], Decision]


# --- increments -----------------------------------------------------------------------------------


def choose_increments(case: DovetailCase, allowed: float) -> Decision:
    """Choose the increments that the cycle of the section needs."""
    return decide_increments(case, section_joint, allowed)


# --- ladders of meshes and grids ------------------------------------------------------------------


@dataclass(frozen=True)
class _Rung:
    """A setting of fineness ``size`` with its case entries ``settings``.

    ``offered`` is false for a rung that serves only as a reference.
    """

    size: int
    settings: dict[str, Any]
    offered: bool = True


@dataclass(frozen=True)
class _Climb:
    """The rung that was ``taken``, with its error, and the results of the ``probed`` rungs."""

    taken: _Rung
    error: float
    worst: str
    probed: dict[str, Any]


def choose_mesh(case: DovetailCase, allowed: float) -> Decision:
    """Choose the coarsest mesh, refined in proportion, whose section wears accurately enough."""
    climb = _climb(list(_meshes(case)), partial(_worn, plane_section(case)), allowed)
    why = _sentence(climb, allowed, "elements across the flank")
    return _decision(climb.taken.settings, why, climb.probed, allowed, climb.error)


def _meshes(case: DovetailCase) -> Iterator[_Rung]:
    across, along = case.mesh.flank_nodes
    in_space = case.structure.dimension == 3
    written = across - 1
    # Finer rungs that are not offered serve to estimate the error of the finest offered one.
    most = 4 * written if in_space else max(written, MOST_ELEMENTS)
    for elements in _doublings(written, FEWEST_ELEMENTS, most):
        factor = elements / written
        settings = {
            "mesh.flank_nodes": (1 + elements, max(3, 1 + round(factor * (along - 1)))),
            "mesh.size": case.mesh.size / factor,
        }
        yield _Rung(elements, settings, offered=elements <= written or not in_space)


def choose_grid(case: DovetailCase, allowed: float) -> Decision:
    """Choose the coarsest grids across the flank and along the slot that are accurate enough."""
    section = plane_section(case)
    across, along = case.contact.grid
    in_space = case.structure.dimension == 3
    most = FINER_SPACE * across if in_space else max(across, MOST_STRIPS)
    part = 0.5 * allowed if in_space else allowed
    climbs = [_climb_grid(across, most, part, partial(_worn, section))]
    if in_space:
        most = FINER_SPACE * along
        climbs.append(_climb_grid(along, most, part, lambda rung: end_life(section, rung.size)))
        along = climbs[-1].taken.size
    grid = climbs[0].taken.size, along
    named = dict(zip(("cells across the flank", "cells along the slot"), climbs, strict=False))
    why = "; ".join(_sentence(climb, part, name) for name, climb in named.items())
    probe = {name: climb.probed for name, climb in named.items()}
    error = sum(climb.error for climb in climbs)
    return _decision({"contact.grid": grid}, why, probe, allowed, error)


def _worn(section: DovetailCase, rung: _Rung) -> Numbers:
    return life(changed(section, rung.settings))


def _climb_grid(cells: int, most: int, allowed: float, worn: Callable[[_Rung], Numbers]) -> _Climb:
    """Climb the ladder of halves and doubles of ``cells``."""
    sizes = _doublings(cells, max(FEWEST_CELLS, cells // COARSER), most)
    return _climb([_Rung(n, {"contact.grid": (n, n)}) for n in sizes], worn, allowed)


def _doublings(count: int, fewest: int, most: int) -> list[int]:
    """Return halves and doubles of ``count``, coarse to fine, including itself."""
    sizes = [count]
    while (half := round(0.5 * sizes[0])) >= fewest:
        sizes.insert(0, half)
    while 2 * sizes[-1] <= most:
        sizes.append(2 * sizes[-1])
    return sizes


def _climb(rungs: Sequence[_Rung], worn: Callable[[_Rung], Numbers], allowed: float) -> _Climb:
    """Probe ever finer rungs until one is accurate enough, or else take the finest offered."""
    values: list[Numbers] = []
    for rung in rungs:
        values.append(worn(rung))
        if len(values) < min(LEAST_RUNGS, len(rungs)):
            continue
        steps = [1.0 / rung.size for rung in rungs[: len(values)]]
        estimated = estimate(values, steps, ORDER)
        errors = estimated.errors
        enough = [k for k, error in enumerate(errors) if rungs[k].offered and error <= allowed]
        if enough:
            break
    offered = [k for k in range(len(values)) if rungs[k].offered]
    taken = enough[0] if enough else offered[-1]
    sizes = [rung.size for rung in rungs[: len(values)]]
    probed = {"sizes": sizes, "values": values, "errors": errors}
    return _Climb(rungs[taken], errors[taken], estimated.worst(taken), probed)


def _sentence(climb: _Climb, allowed: float, unit: str) -> str:
    text = (
        f"{climb.taken.size} {unit} cause an error of {percent(climb.error)}, of "
        f"{percent(allowed)} allowed"
    )
    beyond = "" if climb.error <= allowed else ", the finest available"
    return f"{text} ({climb.worst}){beyond}"


# --- without a ladder -----------------------------------------------------------------------------


def choose_tolerance(case: DovetailCase, allowed: float) -> Decision:
    """Choose the share of the error as tolerance of the contact solver, whose error is smaller."""
    tolerance = max(min(allowed, LOOSEST_TOLERANCE), 1e-12)
    why = "its share of the error: depth and volume were within half of it"
    error = LEFT_BY_TOLERANCE * tolerance
    return _decision({"contact.tolerance": tolerance}, why, {}, allowed, error)


def choose_steps(case: DovetailCase, allowed: float) -> Decision:
    """Choose automatic implicit steps, with the share of the error as their tolerance."""
    tolerance = min(allowed, LOOSEST_STEPS)
    settings = {
        "wear.tolerance": tolerance,
        "wear.depth_tolerance": None,
        "wear.step.kind": "implicit",
        **{f"wear.step.{size}": None for size in SIZES},
    }
    why = "its share of the error, for automatic implicit steps"
    return _decision(settings, why, {}, allowed, tolerance)


def choose_drift(case: DovetailCase, allowed: float) -> Decision:
    """Choose the drift at which coupled and uncoupled probe runs would differ by the share."""
    coupling = case.coupling
    if coupling.resultants == "constant":
        why = "resultants stay those of the unworn structure, as the case says"
        return Decision("coupling.drift", coupling.drift, why)
    section = plane_section(case)
    apart = life(section)
    coupled, drift = coupled_life(section)
    # Loads updated at the end of each step lag by half a step, one step in all for a steady drift.
    effect = _effect(apart, coupled) * STEPS / (STEPS - 1)
    bounded = max(LEAST_DRIFT, min(1.0, drift * allowed / effect)) if effect > 0.0 else 1.0
    settings = {"coupling.drift": bounded, "coupling.resultants": "drift"}
    error = effect if drift <= 0.0 else min(effect, effect * bounded / drift)
    why = (
        f"drift of {percent(drift)} over the run changes depth or volume by {percent(effect)}; "
        f"allowed: {percent(allowed)}"
    )
    probe = {"apart": apart, "coupled": coupled, "drift": drift, "effect": effect}
    return _decision(settings, why, probe, allowed, error)


def _effect(apart: Numbers, coupled: Numbers) -> float:
    """Return the largest relative difference of two probe runs."""
    pair = estimate([apart, coupled], [2.0, 1.0], ORDER)
    # Of two rungs, the last error is their difference and the first is twice that.
    return pair.errors[-1]


def _decision(
    settings: dict[str, Any], why: str, probe: dict[str, Any], allowed: float, error: float
) -> Decision:
    entry, *others = settings
    also = {name: settings[name] for name in others}
    met = error <= allowed * (1.0 + ROUNDING)
    return Decision(entry, settings[entry], why, probe, also, allowed, error, met)


AXES = (
    FidelityAxis("load_path.increments", 0.18, choose_increments),
    FidelityAxis("mesh.flank_nodes", 0.38, choose_mesh),
    FidelityAxis("contact.grid", 0.12, choose_grid),
    FidelityAxis("contact.tolerance", 0.02, choose_tolerance),
    FidelityAxis("wear.tolerance", 0.18, choose_steps),
    FidelityAxis("coupling.drift", 0.12, choose_drift),
)
