"""A vibration case whose contact wears: motion, wear, motion, and the responses on the way.

Wear steps take their slips from the rig's motion on the surfaces before them, and know the motion
on those after them: their error estimate covers what the motion changes, and sets their length.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from fe_models.dynamics.harmonics import Resolution
from sa_solver.tangential_loop import TangentialLoop
from wear.joints.jenkins import Jenkins
from wear.moving import LARGE_STROKE
from wear.steppers import SubcyclingStepper, advance_cycles, first_cycles
from wear.stepping import WearState
from workflow.analyses.rig.building import row_of_masses
from workflow.analyses.rig.rig_model import RigModel
from workflow.analyses.vibration.model import VibrationModel
from workflow.analyses.vibration.outcome import Response
from workflow.analyses.vibration.response import closed, response_under
from workflow.analyses.vibration_wear.case import VibrationWearCase
from workflow.analyses.vibration_wear.outcome import (
    CONTACT,
    HALF_SPACE,
    LOOP,
    SLIDERS,
    VibrationWearOutcome,
    WornState,
    depth_fields,
    path_field,
    wearing_loop,
)
from workflow.analyses.vibration_wear.vibrating_contact import Rubbing, Shaking, VibratingContact
from workflow.analyses.wear.contact_stage import stepper_of
from workflow.analyses.wear.structures.bodies.case import BodiesWearCase
from workflow.case.loading import load_named
from workflow.errors import UserError
from workflow.shell.dataset import Dataset
from workflow.shell.reporter import Reporter

# Of the motion at which all of the contact slides: where loops in partial slip are compared.
PARTIAL = 0.5


def wear_half_space(case: VibrationWearCase, reporter: Reporter) -> VibrationWearOutcome:
    """All that is kept of a run.

    Raises UserError where contact or rig cannot be what the case says, and what contact problems
    and motions raise that are not found.
    """
    bodies = contact_case(case.contact.file)
    rig = row_of_masses(case.structure, case.mass or 1)
    own, wear = case.resolution, case.wear
    resolution = Resolution(tuple(own.harmonics), own.samples)
    contact = VibratingContact(bodies, rig, Shaking(wear.force, wear.frequency, resolution))
    stepper = SubcyclingStepper(stepper_of(bodies.wear), contact.alike_cycles)
    total, done = wear.cycles[-1], 0.0
    with reporter.stage("contact, first cycle"):
        state = contact.unworn()
        first = first_cycles(contact.wearing(state), state, total)
        state = replace(state, next_cycles=first)
    keeper = _Keeper(case, rig, contact, reporter)
    states = [keeper.keep(state, 0.0, 0)]
    with reporter.jumps(total, 0.0) as progress:
        for cycles in wear.cycles:
            with reporter.stage("wear"):
                left = total - done
                worn = advance_cycles(stepper, state, cycles - done, left, contact.wearing)
            state, done = worn.state, cycles
            states.append(keeper.keep(state, cycles, worn.spent.steps))
            progress(cycles, len(states) - 1)
    return VibrationWearOutcome(case, tuple(states), grid=contact.grid)


def contact_case(file: str) -> BodiesWearCase:
    """The wear case of the contact. Raises UserError where it cannot be that of a rig."""
    what = "wear of two bodies over an area"
    case = load_named("contact.file", file, [BodiesWearCase], what)
    for number in (1, 2):
        if case.material(number) != case.material(1):
            raise UserError(
                f"contact.file: {file}: materials that are not alike, whose pressure follows the "
                "shear; allowed: the same material twice"
            )
    if case.friction.at(0.0) == 0.0:
        raise UserError(f"contact.file: {file}: no friction; allowed: a coefficient above 0")
    step = case.wear.step
    if not step.automatic:
        raise UserError(
            f"contact.file: {file}: wear.step of a given size; allowed: implicit or second_order "
            "steps, whose length follows from wear.tolerance"
        )
    return case


class _Keeper:
    """Finds what is kept of a state."""

    def __init__(
        self, case: VibrationWearCase, rig: RigModel, contact: VibratingContact, reporter: Reporter
    ) -> None:
        self._case, self._rig, self._contact, self._reporter = case, rig, contact, reporter

    def keep(self, state: WearState, cycles: float, steps: int) -> WornState:
        """The contact after so many cycles, in ``steps`` since the last, and the rig on it."""
        rubbing = self._contact.at(state)
        with self._reporter.stage("half-space loops"):
            loop = self._contact.loop(rubbing, 0.5 * rubbing.stroke)
            partial = self._contact.loop(rubbing, PARTIAL * rubbing.full_slip)
        numbers = {"cycles": cycles, "steps": steps} | self._numbers(rubbing)
        numbers["loop_error"] = _energy_error(rubbing, loop)
        numbers["partial_loop_error"] = _energy_error(rubbing, partial)
        self._warn(rubbing)
        responses, linear = self._responses(rubbing)
        self._reporter.log(
            f"{cycles:g} cycles: {steps} steps, stiffness {numbers['stiffness']:.5g} N/mm, "
            f"stroke {numbers['stroke']:.4g} mm"
        )
        return WornState(cycles, numbers | linear, _fields(rubbing, loop), responses)

    def _responses(self, rubbing: Rubbing) -> tuple[tuple[Response, ...], dict[str, Any]]:
        """The responses to all forces, and natural frequencies."""
        load, friction = self._contact.load, rubbing.friction
        stiffness = rubbing.slipping.stiffness
        case = self._case.with_joint(load, friction, stiffness)
        resolution = Resolution(case.harmonics, case.resolution.samples)
        problem = self._contact.problem(rubbing.sliders, resolution)
        model = VibrationModel(self._rig, Jenkins(stiffness, friction, load), problem)
        with self._reporter.stage("response"):
            found = [response_under(case, model, own, self._reporter)[0] for own in case.forces]
        return tuple(found), {"free": self._rig.free(), **self._rig.modes(model.law)}

    def _numbers(self, rubbing: Rubbing) -> dict[str, Any]:
        surfaces, normal = rubbing.state.surfaces, rubbing.slipping.normal
        area = self._contact.grid.cell_area
        return {
            "energy": rubbing.state.energy,
            "volume": float(surfaces.depth.sum()) * area,
            "depth": float(surfaces.depth.max()),
            "area": float(np.count_nonzero(normal.pressure)) * area,
            "peak_pressure": float(normal.pressure.max()),
            "friction": rubbing.friction,
            "stiffness": rubbing.slipping.stiffness,
            "full_slip": rubbing.full_slip,
            "stroke": rubbing.stroke,
            "energy_per_cycle": float(rubbing.by_slider.sum()),
            "sliders": len(rubbing.by_slider),
            "adjusted": rubbing.adjusted,
            "left_out": rubbing.motion.left_out,
        }

    def _warn(self, rubbing: Rubbing) -> None:
        warn, tolerance = self._reporter.warn, self._case.resolution.tolerance
        if rubbing.slipping.normal.touches_border:
            warn("the contact reaches the border of its grid: enlarge contact.size of its case")
        pressed = rubbing.slipping.normal.pressure.any(axis=1)
        width = float(np.count_nonzero(pressed)) * self._contact.grid.pitch[0]
        if rubbing.stroke > LARGE_STROKE * width:
            warn(
                f"the stroke is more than {LARGE_STROKE:.0%} of the contact's width: that the "
                "surfaces move over each other is neglected"
            )
        if tolerance is not None and rubbing.motion.left_out > tolerance:
            warn(
                f"the motion that wears leaves out harmonics of {rubbing.motion.left_out:.1e}, "
                "above resolution.tolerance: raise resolution.harmonics, those to begin with"
            )


def _energy_error(rubbing: Rubbing, loop: TangentialLoop) -> float:
    """By how much the sliders lose more in a loop than the whole tangential problem, relative."""
    own = float(rubbing.sliders.loop_energy(loop.amplitude).sum())
    larger = max(own, loop.energy)
    return (own - loop.energy) / larger if larger > 0.0 else 0.0


def _fields(rubbing: Rubbing, loop: TangentialLoop) -> dict[str, dict[str, Dataset]]:
    displacement, force = loop.cycle
    pull = "between them, of the whole tangential problem"
    return {
        CONTACT: _contact_fields(rubbing),
        SLIDERS: _slider_fields(rubbing),
        LOOP: wearing_loop(
            closed(rubbing.displacement), closed(rubbing.motion.cycle.samples[:, 0, 0])
        ),
        HALF_SPACE: {
            "displacement": Dataset(displacement, "mm", "of the bodies, as far to and fro"),
            "force": Dataset(force, "N", pull),
        },
    }


def _contact_fields(rubbing: Rubbing) -> dict[str, Dataset]:
    """Fields of the grid."""
    normal, surfaces = rubbing.slipping.normal, rubbing.state.surfaces
    gap = np.maximum(normal.gap, 0.0) * (normal.pressure == 0.0)
    sticks = "motion of the joint from rest up to which each cell sticks"
    return {
        "pressure": Dataset(normal.pressure, "MPa", "at rest"),
        "gap": Dataset(gap, "mm", "at rest"),
        **depth_fields(surfaces.depth_1, surfaces.depth_2),
        "onset": Dataset(rubbing.friction * rubbing.slipping.onset, "mm", sticks),
        "path": path_field(rubbing.path),
        "energy": Dataset(rubbing.energy, "N/mm", "per area, in such a cycle"),
    }


def _slider_fields(rubbing: Rubbing) -> dict[str, Dataset]:
    """The sliders that the contact is to the rig, ``(n,)`` each."""
    slipping = rubbing.slipping
    reach = rubbing.friction * slipping.reach
    lost = "that it dissipates in a cycle under the force that wears"
    return {
        "reach": Dataset(reach, "mm", "motion at which each slider gives way"),
        "stiffness": Dataset(slipping.slider_stiffness, "N/mm", "of its spring"),
        "normal_load": Dataset(slipping.slider_load, "N", "that presses it"),
        "energy": Dataset(rubbing.by_slider, "N mm", lost),
    }
