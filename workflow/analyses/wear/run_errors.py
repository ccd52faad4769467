"""Errors that a wear run knows of, warned of where they are more than was asked for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wear.steps.step_errors import root_mean_square
from workflow.analyses.wear.budget.report import Budget, warning_of
from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.case.sections import Duration
from workflow.analyses.wear.outcome import InterfaceOutcome
from workflow.analyses.wear.structure import SETTINGS
from workflow.analyses.wear.structures import structure_of
from workflow.shell.reporter import Reporter

# What steps may leave of the peak pressure: more may be edges that only long steps wear.
PEAK = 0.1
# Increments of a cycle of surfaces that move over each other, fewer than which leave the worn peak
# pressure a fifth too large and more: on a cylinder over a third of its scar 4, 8, 16 and 32 left
# 110, 60, 20 and 10 %.
FEW_INCREMENTS = 32


# How many times shorter steps and smaller drifts to take where they leave too much: what those of
# first order leave falls to a quarter. The length of automatic steps goes with about the root of
# their tolerance.
SHORTER, STRICTER = 4.0, 10.0


def warn_of_errors(
    case: WearCase,
    contacts: Sequence[InterfaceOutcome],
    budget: Budget,
    drift: float,
    reporter: Reporter,
) -> None:
    """Results farther off than the case's accuracy, and steps than was asked for.

    ``drift`` is the largest that was found after a jump. And few increments of surfaces that move
    over each other, which no estimate knows of.
    """
    for contact in contacts:
        name, state, shorter = contact.stage.name, contact.state, shorter_steps(case.wear, contact)
        _warn_of_steps(case.wear, contact, shorter, reporter)
        settings = {**SETTINGS, **structure_of(case).settings(case), "steps": shorter}
        settings |= _of_link_and_coupling(case, shorter, drift)
        if beyond := warning_of(name, budget[name], case.accuracy, settings):
            reporter.warn(beyond)
        fewest = min(mission.stop - mission.start for mission in state.loads.missions)
        if len(state.paths) and fewest < FEW_INCREMENTS:
            reporter.warn(
                f"{name}: the bodies move over each other in {fewest} increments a cycle: they "
                "wear edges into each other at which the worn peak pressure is too large, by a "
                f"fifth with 16 and more with fewer; take {FEW_INCREMENTS}"
            )


def shorter_steps(wear: Duration, contact: InterfaceOutcome) -> str:
    """Return the setting that makes the steps of a finished run shorter.

    Automatic ones follow their tolerance. On surfaces that move over each other they are shorter
    than it asks for (:meth:`wear.steps.stepping.WearingContact.comparable_cycles`), so that it does
    nothing, and those of second order leave edges less high.
    """
    step, moving = wear.step, len(contact.state.paths) > 0
    if step.depth is not None:
        return f"wear.step.depth: {step.depth / SHORTER:.2g} mm"
    if step.volume is not None:
        return f"wear.step.volume: {step.volume / SHORTER:.2g} mm^3"
    if step.automatic and not moving:
        if wear.depth_tolerance is not None:
            return f"wear.depth_tolerance: {wear.depth_tolerance / STRICTER:.2g} mm"
        return f"wear.tolerance: {100.0 * wear.tolerance / STRICTER:.2g} %"
    cycles = float(np.diff(contact.cycles).max(initial=1.0)) / SHORTER
    kind = "second_order" if moving else step.kind
    return f"wear.step: {{kind: {kind}, cycles: {max(cycles, 1.0):.2g}}}"


def _of_link_and_coupling(case: WearCase, shorter: str, drift: float) -> dict[str, str]:
    """Return the settings, not in use yet, that make the errors of link and coupling smaller.

    A smaller ``coupling.drift`` does nothing above the largest ``drift`` that was found.
    """
    coupling, every = case.recoupling, "coupling.resultants: every"
    reached = min(coupling.drift, drift) / SHORTER
    settings = {
        "constant": every,
        "drift": f"coupling.drift: {100.0 * reached:.2g} %" if reached > 0.0 else every,
        "every": shorter,
    }
    told = {"coupling": settings[coupling.resultants]}
    if case.contact.link == "half_space":
        told["link"] = "contact.link: corrected"
    return told


def _warn_of_steps(
    wear: Duration, contact: InterfaceOutcome, shorter: str, reporter: Reporter
) -> None:
    left, name = contact.step_error, contact.stage.name
    if left is None:
        return
    error, asked = max(left["depth"], left["volume"]), wear.tolerance
    if wear.depth_tolerance is not None:
        depths = contact.state.surfaces.depths
        asked = wear.depth_tolerance / max(root_mean_square(d, d) for d in depths)
    if wear.step.automatic and error > asked:
        reporter.warn(
            f"{name}: wear steps leave an estimated error of {error:.2%} of depth and volume "
            f"where {asked:.2%} was asked for (wear.tolerance): take shorter steps ({shorter})"
        )
    if left["pressure"] > PEAK:
        reporter.warn(
            f"{name}: wear steps leave an estimated error of {left['pressure']:.0%} of the "
            "peak pressure on the worn surfaces, and of what follows from it (fretting life): "
            f"take shorter steps ({shorter})"
        )
