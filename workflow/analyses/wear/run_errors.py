"""Errors that a wear run knows of: what its steps and its increments leave, told and warned of."""

from __future__ import annotations

from collections.abc import Sequence

from wear.steppers import root_mean_square
from workflow.analyses.wear.case.sections import Duration
from workflow.analyses.wear.outcome import InterfaceOutcome
from workflow.shell.reporter import Reporter

# What steps and increments may leave of depth and volume where nobody has asked for less, and of
# the peak pressure.
UNASKED, PEAK = 0.05, 0.1
# Increments of a cycle of surfaces that move over each other, fewer than which leave the worn peak
# pressure a fifth too large and more: on a cylinder over a third of its scar 4, 8, 16 and 32 left
# 110, 60, 20 and 10 %.
FEW_INCREMENTS = 32


def warn_of_errors(
    wear: Duration, contacts: Sequence[InterfaceOutcome], reporter: Reporter
) -> None:
    """Steps and increments that leave more than was asked for, or may pass without being asked."""
    for contact in contacts:
        _warn_of_steps(wear, contact, reporter)
        left, name, state = contact.increments_error, contact.stage.name, contact.state
        fewest = min(mission.stop - mission.start for mission in state.loads.missions)
        if len(state.paths) and fewest < FEW_INCREMENTS:
            reporter.warn(
                f"{name}: the bodies move over each other in {fewest} increments a cycle: they "
                "wear edges into each other at which the worn peak pressure is too large, by a "
                f"fifth with 16 and more with fewer; take {FEW_INCREMENTS}"
            )
        if left is not None and max(left.values()) > UNASKED:
            reporter.warn(
                f"{name}: the increments of the cycle leave an estimated error of "
                f"{max(left.values()):.1%} of depth and energy where {UNASKED:.0%} may pass: "
                "divide the cycle into more of them"
            )


def _warn_of_steps(wear: Duration, contact: InterfaceOutcome, reporter: Reporter) -> None:
    left, name = contact.step_error, contact.stage.name
    if left is None:
        return
    error, asked = max(left["depth"], left["volume"]), UNASKED
    if wear.step.automatic:
        asked = wear.tolerance
        if wear.depth_tolerance is not None:
            depths = contact.state.surfaces.depths
            asked = wear.depth_tolerance / max(root_mean_square(d, d) for d in depths)
    if error > asked:
        what = "was asked for (wear.tolerance)" if wear.step.automatic else "may pass"
        reporter.warn(
            f"{name}: wear steps leave an estimated error of {error:.2%} of depth and volume "
            f"where {asked:.2%} {what}: try wear.step.kind: second_order, or shorter steps"
        )
    if left["pressure"] > PEAK:
        reporter.warn(
            f"{name}: wear steps leave an estimated error of {left['pressure']:.0%} of the "
            "peak pressure on the worn surfaces, and of what follows from it (fretting life): "
            "try wear.step.kind: second_order, or shorter steps"
        )


def left_sentence(contact: InterfaceOutcome) -> str:
    """What wear steps and increments leave, where it is known."""
    sentence, steps, increments = "", contact.step_error, contact.increments_error
    if steps is not None:
        sentence = (
            f"; wear steps leave {max(steps['depth'], steps['volume']):.1%} of depth and volume, "
            f"{steps['pressure']:.1%} of the peak pressure"
        )
    if increments is not None:
        sentence += f"; increments leave {max(increments.values()):.1%} of depth and energy"
    return sentence
