"""A rig with joints under a periodic force: the model of a steady vibration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

from fe_models.dynamics.periodic.harmonics import Resolution
from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.steps import COMPUTED, Steps
from wear.coupled_state import Observer, check_observers, observed
from workflow.errors import warn_each
from workflow.messages.warning_kinds import Notice
from workflow.models.rig.laws import Laws
from workflow.models.rig.rig_model import RigModel
from workflow.models.vibration.excitation import Driving
from workflow.models.vibration.motions import motion_columns
from workflow.models.vibration.results import ForcedResponse, VibrationResults
from workflow.models.vibration.structure import VibratingStructure
from workflow.models.vibration.sweep import FrequencySweep

if TYPE_CHECKING:
    import xarray as xr

ODD = (1, 3, 5, 7, 9, 11, 13, 15)
"""Harmonics of a motion unless others are given."""


@dataclass(frozen=True)
class VibrationModel:
    """A rig with joints under a periodic force of several amplitudes, over the frequency.

    Parameters
    ----------
    rig : RigModel
        The structure, with its driven and its observed places.
    law : law of :mod:`wear.joints`
        The law of each joint, or a :class:`wear.joints.MixedLaw` of several.
    forces : tuple of float
        Amplitudes of the force [N], or levels of the excitation ``driving``.
    sweep : FrequencySweep
        The span of frequencies.
    resolution : Resolution
        Harmonics of the motion, and samples of the joints' forces in a period. Contacts, and joints
        that are not symmetric, need harmonic 0.
    driving : Driving, optional
        The excitation at level 1; without it a sine at the driven places of the rig.
    normal_load : float
        Load [N] that presses together the two bodies of a rig that has them.

    Examples
    --------
    A mass on a spring with a friction joint, which sticks under a small force and slides under a
    large one:

    >>> import fretscale
    >>> from fe_models.dynamics import Link, lumped_rig
    >>> from wear.joints import Jenkins
    >>> mass = lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]], damping_ratio=0.01)
    >>> rig = fretscale.RigModel.of(mass, driven={"m": 1.0}, observed=["m"])
    >>> law = Jenkins(stiffness=1e3, friction=0.5, normal_load=20.0)
    >>> sweep = fretscale.FrequencySweep(140.0, 250.0)
    >>> results = fretscale.VibrationModel(rig, law, (0.1, 100.0), sweep).run()
    >>> for force in ("0.1 N", "100 N"):
    ...     print(force, f"{results[force].attrs['resonance']:.0f} Hz")
    0.1 N 225 Hz
    100 N 159 Hz
    """

    rig: RigModel
    law: Laws
    forces: tuple[float, ...]
    sweep: FrequencySweep
    resolution: Resolution = field(default_factory=lambda: Resolution(ODD, 256))
    driving: Driving | None = None
    normal_load: float = 0.0

    def __post_init__(self) -> None:
        checks.instances(
            self,
            rig=RigModel,
            law=Laws,
            sweep=FrequencySweep,
            resolution=Resolution,
            driving=Driving | None,
        )
        forces = checks.array("VibrationModel.forces", self.forces, (None,))
        if not len(forces) or not (forces > 0.0).all():
            raise InputError(
                f"VibrationModel.forces is {checks.shown(self.forces)}: give one or more, each "
                "above 0"
            )
        checks.settle(self, forces=tuple(forces.tolist()))
        checks.numbers(self, "normal_load", least=0.0)
        if self.normal_load and self.rig.pressing is None:
            raise InputError(
                f"VibrationModel.normal_load = {self.normal_load:g} N: the rig has no two bodies "
                "that it presses together; give the load to the law of the joints"
            )

    @cached_property
    def structure(self) -> VibratingStructure:
        """The rig with its joints and its excitation, ready to be solved."""
        driving = self.driving or Driving.sine(self.rig.driven)
        return VibratingStructure.of(self.rig, self.law, driving, self.resolution, self.normal_load)

    def response(
        self, force: float, steps: Steps = COMPUTED, observers: Sequence[Observer] = ()
    ) -> ForcedResponse:
        """Return the curve under a force and its resonance.

        The ``observers`` get the share of the span, on a logarithmic scale, behind each new point.
        """

        def watch(frequency: float) -> None:
            share = self.sweep.share(frequency)
            for observer in observers:
                observer.reached(share)

        branch = self.sweep.curve(self.structure, force, steps, watch)
        columns = motion_columns(self.structure, branch.problem, branch.solutions)
        amplitudes = columns["amplitude"][:, -1]
        resonance = self.sweep.resonance(self.structure, branch, amplitudes, steps)
        return ForcedResponse(branch, columns, resonance)

    def run(self, observers: Sequence[Observer] = (), steps: Steps = COMPUTED) -> xr.DataTree:
        """Compute the motions under every force, and return them.

        Parameters
        ----------
        observers : sequence of Observer
            Entered for each curve, and called after its points, such as
            :class:`fretscale.Progress`.
        steps : Steps
            Runner of the steps. :meth:`fretscale.Checkpoint.steps` stores them, so that an
            interrupted run can resume.

        Returns
        -------
        xarray.DataTree
            A group for each force, by its name such as ``10 N``, with the frequency, amplitude,
            damping and error of the resonance as attributes, and a group ``linear`` with the limits
            of joints free and stuck. Attributes of the tree are natural frequencies [Hz].

        Warns
        -----
        ModelWarning
            A curve ends before the span does, has no resonance, or has an error above the accuracy
            of the sweep, or above 5 % without one.

        Raises
        ------
        MethodFailed
            The joints do not balance the static load, or there is no motion under a force.
        """
        check_observers(observers)
        names = list(map(self.structure.driving.amount.as_text, self.forces))
        if len(set(names)) < len(names):
            raise InputError(
                f"VibrationModel.forces are {', '.join(names)}, which are names of results: give "
                "each once"
            )
        responses = {}
        for name, force in zip(names, self.forces, strict=True):
            with observed(observers, name):
                responses[name] = self.response(force, steps, observers)
            faults = responses[name].faults(self.sweep.accuracy)
            warn_each(Notice(kind, f"{name}: {text}") for kind, text in faults)
        return VibrationResults(self.structure, self.sweep.span, responses).tree()
