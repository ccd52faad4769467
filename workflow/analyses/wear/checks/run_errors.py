"""Warnings about estimated errors of a wear run that exceed the requested accuracy."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wear.steps.step_errors import root_mean_square
from workflow.analyses.wear.approximations.registry import REMEDIES
from workflow.analyses.wear.budget.report import Budget, warning_of
from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.case.sections import Duration
from workflow.analyses.wear.structures import structure_of
from workflow.case.text.readable import percent
from workflow.messages.warning_kinds import WarningKind
from workflow.models.budget.outcome import InterfaceOutcome
from workflow.shell.terminal.reporter import Reporter

# Largest error of the peak pressure due to steps without a warning.
PEAK = 0.1
# Fewest increments of a cycle with moving surfaces. With fewer, the worn peak pressure is too
# large: on a cylinder that moves over a third of its scar, 4, 8, 16 and 32 increments caused errors
# of 110, 60, 20 and 10 %.
FEW_INCREMENTS = 32

# Factors by which advice shortens steps and drifts, and tightens tolerances. Errors of first order
# fall to a quarter; the length of automatic steps is about proportional to the root of their
# tolerance.
SHORTER, STRICTER = 4.0, 10.0


def warn_of_errors(
    case: WearCase,
    contacts: Sequence[InterfaceOutcome],
    budget: Budget,
    drift: float,
    reporter: Reporter,
) -> None:
    """Warn of results beyond the case's accuracy, and of steps beyond their tolerance.

    ``drift`` is the largest one found after a jump. Too few increments of surfaces that move over
    each other cause a warning as well, because no estimate includes their error.
    """
    for contact in contacts:
        name, state, shorter = contact.stage.name, contact.state, shorter_steps(case.wear, contact)
        _warn_of_steps(case.wear, contact, shorter, reporter)
        settings = {**REMEDIES, **structure_of(case).settings(case), "steps": shorter}
        settings |= _of_link_and_coupling(case, shorter, drift)
        if beyond := warning_of(name, budget[name], case.accuracy, settings):
            reporter.warn(*beyond)
        fewest = min(mission.stop - mission.start for mission in state.loads.missions)
        if len(state.paths) and fewest < FEW_INCREMENTS:
            reporter.warn(
                WarningKind.FALSE_EDGES,
                f"{name}: the bodies move over each other in only {fewest} increments per cycle "
                "and wear false edges into each other: the worn peak pressure is too large, by a "
                f"fifth with 16 increments and more with fewer; take {FEW_INCREMENTS}",
            )


def shorter_steps(wear: Duration, contact: InterfaceOutcome) -> str:
    """Return the setting that makes the steps of a finished run shorter.

    Automatic steps follow their tolerance. On moving surfaces they are shorter than it requires
    (:meth:`wear.steps.stepping.WearingContact.comparable_cycles`), so that it has no effect; steps
    of second order make lower edges there.
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
    """Return the settings, not in use yet, that reduce the errors of link and coupling.

    A ``coupling.drift`` above the largest ``drift`` found would have no effect.
    """
    coupling, every = case.recoupling, "coupling.resultants: every"
    reached = min(coupling.drift, drift) / SHORTER
    settings = {
        "constant": every,
        "drift": f"coupling.drift: {100.0 * reached:.2g} %" if reached > 0.0 else every,
        "every": shorter,
    }
    advice = {"coupling": settings[coupling.resultants]}
    if case.contact.link == "half_space":
        advice["link"] = "contact.link: corrected"
    return advice


def _warn_of_steps(
    wear: Duration, contact: InterfaceOutcome, shorter: str, reporter: Reporter
) -> None:
    estimate, name = contact.step_error, contact.stage.name
    if estimate is None:
        return
    error, allowed = max(estimate["depth"], estimate["volume"]), wear.tolerance
    if wear.depth_tolerance is not None:
        depths = contact.state.surfaces.depths
        allowed = wear.depth_tolerance / max(root_mean_square(d, d) for d in depths)
    if wear.step.automatic and error > allowed:
        reporter.warn(
            WarningKind.LONG_WEAR_STEPS,
            f"{name}: wear steps cause an estimated error of {percent(error)} of depth and volume, "
            f"above wear.tolerance ({percent(allowed)}): take shorter steps ({shorter})",
        )
    if estimate["pressure"] > PEAK:
        reporter.warn(
            WarningKind.LONG_WEAR_STEPS,
            f"{name}: wear steps cause an estimated error of {percent(estimate['pressure'])} of "
            "the worn peak pressure and of what follows from it (fretting life): take shorter "
            f"steps ({shorter})",
        )
