"""Runs of vibration cases whose half-space contact wears: motion and wear in turn.

Wear steps take their slips from the rig's motion on the surfaces at their beginning, and the motion
at their end is known too. The error estimate of the steps thus covers the change of the motion, and
sets their length.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from fe_models.dynamics.periodic.harmonics import Resolution
from sa_solver.cycles.tangential_loop import TangentialLoop
from sa_solver.steps import Steps
from wear.contact.moving import LARGE_STROKE
from wear.joints.jenkins import Jenkins
from wear.steps.marching import SubcyclingStepper
from wear.steps.steppers import first_cycles
from wear.steps.stepping import WearState
from workflow.analyses.rig.building import row_of_masses
from workflow.analyses.vibration.case.load import driving_of
from workflow.analyses.vibration.following import VibrationRun
from workflow.analyses.vibration.output.loops import closed
from workflow.analyses.vibration.output.outcome import Response
from workflow.analyses.vibration_wear.case import VibrationWearCase
from workflow.analyses.vibration_wear.output.outcome import (
    VibrationWearOutcome,
    WornRig,
    step_error,
)
from workflow.analyses.vibration_wear.states import responses_to_all, worn_states
from workflow.analyses.vibration_wear.vibrating_contact import ContactCycle, VibratingContact
from workflow.analyses.wear.structures.bodies.case import BodiesWearCase
from workflow.analyses.wear.translation import wear_of
from workflow.case.loading import load_case
from workflow.case.text.plain import counted, shares
from workflow.layout.declared import Arrays
from workflow.messages.warning_kinds import WarningKind
from workflow.models.vibration.structure import VibratingStructure
from workflow.shell.few_cells import check_cells
from workflow.shell.terminal.reporter import Reporter

# Share of the motion of full slip, at which loops in partial slip are compared.
PARTIAL = 0.5


def wear_half_space(
    case: VibrationWearCase, reporter: Reporter, steps: Steps
) -> VibrationWearOutcome:
    """Return the outcome of a run.

    Raises UserError where contact or rig cannot be built as the case describes them. Errors of
    contact problems and motions without a solution pass through.
    """
    bodies = load_case(case.contact.file, [BodiesWearCase])
    rig, wear = row_of_masses(case.structure, case.mass or 1), case.wear
    resolution = Resolution(case.harmonics, case.resolution.samples)
    driving = driving_of(case.excitation, rig, case.resolution.harmonics[-1])
    contact = VibratingContact(bodies, rig, driving, case.wearing, wear.frequency, resolution)
    stepper = SubcyclingStepper(wear_of(bodies).stepper(), contact.steady_friction_cycles, steps)
    with reporter.stage("contact, first cycle"):
        state = contact.unworn()
        first = first_cycles(contact.wearing(state), state, wear.cycles[-1])
        state = replace(state, next_cycles=first)
    describe = _Description(case, contact, reporter, steps)
    of_contact = stepper, state, contact.wearing, contact.grid.cell_area
    states = worn_states(wear.cycles, *of_contact, describe, reporter, steps)
    return VibrationWearOutcome(case, states, grid=contact.grid)


@dataclass(frozen=True)
class _Description:
    """A callable that builds the description of a state."""

    case: VibrationWearCase
    contact: VibratingContact
    reporter: Reporter
    steps: Steps

    def __call__(self, state: WearState, cycles: float, steps: int) -> WornRig:
        """Return the contact after a number of ``cycles``, and the rig on it.

        ``steps`` is the number of wear steps since the last state.
        """
        cycle = self.contact.at(state)
        with self.reporter.stage("half-space loops"):
            amplitudes = 0.5 * cycle.stroke, PARTIAL * cycle.full_slip
            loop, partly = (
                self.steps("half-space loop", partial(self.contact.loop, cycle, amplitude))
                for amplitude in amplitudes
            )
        numbers = {"cycles": cycles, "steps": steps} | self._numbers(cycle)
        numbers["loop_error"] = _energy_error(cycle, loop)
        numbers["partial_loop_error"] = _energy_error(cycle, partly)
        self._warn(cycle, worn=cycles > 0.0)
        numbers["error"], responses, linear = self._responses(cycle)
        self.reporter.log(
            f"{cycles:g} cycles: {counted(steps, 'step')}, "
            f"stiffness {numbers['stiffness']:.5g} N/mm, stroke {numbers['stroke']:.4g} mm"
        )
        return WornRig(cycles, numbers | linear, _fields(cycle, loop), responses)

    def _responses(self, cycle: ContactCycle) -> tuple[float, tuple[Response, ...], dict[str, Any]]:
        """Return the error of the cycle's motion, the responses to all forces, and frequencies.

        The frequencies are the natural ones with joints free, stuck and sliding.
        """
        load, friction, rig = self.contact.load, cycle.friction, self.contact.rig
        stiffness = cycle.slipping.stiffness
        case = self.case.with_joint(load, friction, stiffness)
        resolution = Resolution(case.harmonics, case.resolution.samples)
        problem = self.contact.problem(cycle.sliders, resolution)
        model = VibratingStructure(
            rig, Jenkins(stiffness, friction, load), problem, self.contact.driving
        )
        run = VibrationRun(case, model, self.reporter, self.steps)
        error, responses = responses_to_all(run, cycle.motion)
        return error, responses, {"free": rig.free(), **rig.modes(model.law)}

    def _numbers(self, cycle: ContactCycle) -> dict[str, Any]:
        surfaces, normal = cycle.state.surfaces, cycle.slipping.normal
        area = self.contact.grid.cell_area
        return {
            "energy": cycle.state.energy,
            "volume": float(surfaces.depth.sum()) * area,
            "depth": float(surfaces.depth.max()),
            "area": float(np.count_nonzero(normal.pressure)) * area,
            "peak_pressure": float(normal.pressure.max()),
            "step_error": step_error(cycle.state),
            "friction": cycle.friction,
            "stiffness": cycle.slipping.stiffness,
            "full_slip": cycle.full_slip,
            "stroke": cycle.stroke,
            "energy_per_cycle": float(cycle.by_slider.sum()),
            "sliders": len(cycle.by_slider),
            "adjusted": cycle.adjusted,
        }

    def _warn(self, cycle: ContactCycle, worn: bool) -> None:
        settings, grid = self.contact.settings, self.contact.grid
        pressure = cycle.slipping.normal.pressure
        check_cells("the contact", settings, grid, pressure, self.reporter, worn=worn)
        if cycle.slipping.normal.touches_border:
            self.reporter.warn(
                WarningKind.CONTACT_AT_BORDER,
                "the contact reaches the border of its grid: enlarge contact.size of its case",
            )
        pressed = cycle.slipping.normal.pressure.any(axis=1)
        width = float(np.count_nonzero(pressed)) * self.contact.grid.pitch[0]
        if cycle.stroke > LARGE_STROKE * width:
            self.reporter.warn(
                WarningKind.MOTION_NEGLECTED,
                f"the stroke exceeds {shares(LARGE_STROKE)} of the contact's width: the result "
                "neglects that the surfaces move over each other",
            )


def _energy_error(cycle: ContactCycle, loop: TangentialLoop) -> float:
    """Return the excess energy of the sliders over the full tangential problem, relative."""
    by_sliders = float(cycle.sliders.loop_energy(loop.amplitude).sum())
    larger = max(by_sliders, loop.energy)
    return (by_sliders - loop.energy) / larger if larger > 0.0 else 0.0


def _fields(cycle: ContactCycle, loop: TangentialLoop) -> dict[str, Arrays]:
    displacement, force = loop.cycle
    moved, pulled = cycle.displacement, cycle.motion.cycle.samples[:, 0, 0]
    return {
        "contact": _contact_fields(cycle),
        "sliders": _sliders(cycle),
        "loop": {"displacement": closed(moved), "force": closed(pulled)},
        "half_space_loop": {"displacement": displacement, "force": force},
    }


def _contact_fields(cycle: ContactCycle) -> Arrays:
    """Return fields of the grid."""
    normal, surfaces = cycle.slipping.normal, cycle.state.surfaces
    return {
        "pressure": normal.pressure,
        "gap": np.maximum(normal.gap, 0.0) * (normal.pressure == 0.0),
        "depth_1": surfaces.depth_1,
        "depth_2": surfaces.depth_2,
        "onset": cycle.friction * cycle.slipping.onset,
        "path": cycle.path,
        "energy": cycle.energy,
    }


def _sliders(cycle: ContactCycle) -> Arrays:
    """Return the sliders that represent the contact in the rig, ``(n,)`` each."""
    slipping = cycle.slipping
    return {
        "reach": cycle.friction * slipping.reach,
        "stiffness": slipping.slider_stiffness,
        "normal_load": slipping.slider_load,
        "energy": cycle.by_slider,
    }
