"""A rig with joints in time: the model of a motion under any force."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fe_models.dynamics.excitation import ExcitationForce
from fe_models.dynamics.motion import Motion, Start
from fe_models.dynamics.transient.newmark import TimeStepControl, integrate
from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.steps import COMPUTED, Steps
from sa_solver.types import Array
from wear.coupled_state import Observer, check_observers, observed
from workflow.errors import MethodFailed, ModelWarning
from workflow.layout.declared import declared
from workflow.messages.warning_kinds import WarningKind
from workflow.models.checks.limits import MOST_RECORDED, MOST_TIME_STEPS, check_count
from workflow.models.rig.laws import Laws
from workflow.models.rig.layout import CURVES
from workflow.models.rig.rig_model import RigModel

if TYPE_CHECKING:
    import xarray as xr

# Error by time steps, as a share of the largest displacement, from which a warning is given.
LARGEST_ERROR = 0.05
# Tolerance on the difference of two recorded times, for rounding.
ROUNDING = 1e-9


@dataclass(frozen=True)
class MotionModel:
    """A rig whose joints have laws, moved by a force from a state on.

    The joints hold their static load at the beginning, and displacements count from there.

    Parameters
    ----------
    rig : RigModel
        The structure, with its driven and its observed places.
    law : law of :mod:`wear.joints`
        The law of each joint, or a :class:`wear.joints.MixedLaw` of several.
    force : ExcitationForce
        Such as :class:`fe_models.dynamics.HarmonicForce`, on the driven places of the rig.
    duration : float
        How long the motion lasts [s].
    control : TimeStepControl
        Length of the time steps, and tolerance of the joints' equilibrium.
    start : Start, optional
        State at the beginning, at rest unless given.

    Examples
    --------
    A mass on a spring with a friction joint is driven at 50 Hz for 5 cycles:

    >>> import fretscale
    >>> from fe_models.dynamics import HarmonicForce, Link, TimeStepControl, lumped_rig
    >>> from wear.joints import Jenkins
    >>> mass = lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]], damping_ratio=0.01)
    >>> rig = fretscale.RigModel.of(mass, driven={"m": 1.0}, observed=["m"])
    >>> law = Jenkins(stiffness=1e3, friction=0.5, normal_load=20.0)
    >>> force = HarmonicForce(rig.driven, amplitude=100.0, frequency=50.0)
    >>> model = fretscale.MotionModel(rig, law, force, 0.1, TimeStepControl(1e-4))
    >>> motion = model.run()
    >>> print(motion["displacement"].dims, motion.attrs["step_error"] < 0.01)
    ('time', 'seen') True
    """

    rig: RigModel
    law: Laws
    force: ExcitationForce
    duration: float
    control: TimeStepControl
    start: Start | None = None

    def __post_init__(self) -> None:
        checks.instances(
            self,
            rig=RigModel,
            law=Laws,
            force=ExcitationForce,
            control=TimeStepControl,
            start=Start | None,
        )
        checks.numbers(self, "duration", above=0.0)
        count, size = self.duration / self.control.step, len(self.rig.model.names)
        longer = "give a longer step or a shorter duration"
        check_count("time steps", count, MOST_TIME_STEPS, longer)
        if self.control.every > np.ceil(count):
            raise InputError(
                f"a row every {self.control.every} of {np.ceil(count):g} time steps: none is "
                "recorded after the first; give a smaller every"
            )
        recorded = count / self.control.every * size
        check_count(
            "recorded displacements", recorded, MOST_RECORDED, f"{longer}, or a larger every"
        )
        longest = self.force.longest_step
        if self.control.step > (1.0 + ROUNDING) * longest:
            raise InputError(
                f"a time step of {self.control.step:g} s does not resolve the force: give one of "
                f"at most {longest:g} s"
            )

    def motion(
        self, steps: Steps = COMPUTED, reached: Callable[[float], None] = lambda share: None
    ) -> Motion:
        """Return the motion; ``reached`` is called at times with the share of it that is done.

        Raises MethodFailed for a motion that was not found to its end.
        """
        pulled = self.rig.with_preload(self.law, self.force)
        motion = integrate(
            self.rig.model,
            self.law,
            pulled,
            self.duration,
            self.control,
            self.start,
            steps,
            reached,
        )
        if not motion.converged:
            raise MethodFailed(motion.message)
        return motion

    def run(self, observers: Sequence[Observer] = (), steps: Steps = COMPUTED) -> xr.Dataset:
        """Compute the motion, and return it over the time.

        Parameters
        ----------
        observers : sequence of Observer
            Entered for the motion, and called with the share of it that is done, such as
            :class:`fretscale.Progress`.
        steps : Steps
            Runner of the steps. :meth:`fretscale.Checkpoint.steps` stores them, so that an
            interrupted run can resume.

        Returns
        -------
        xarray.Dataset
            Excitation, observed displacements and accelerations, force of the joints and energy
            that they dissipate. Attributes are the estimated error by the time steps and the error
            of the energy balance, both relative.

        Warns
        -----
        ModelWarning
            The time steps are too long for the motion, or nothing moves.

        Raises
        ------
        MethodFailed
            The motion was not found to its end.
        """
        check_observers(observers)
        import xarray as xr

        def reached(share: float) -> None:
            for observer in observers:
                observer.reached(share)

        with observed(observers, "motion"):
            motion = self.motion(steps, reached)
        if motion.error > LARGEST_ERROR:
            text = (
                f"the time steps cause an error of {100.0 * motion.error:.1f} % of the largest "
                "displacement: take shorter ones"
            )
            warnings.warn(ModelWarning(WarningKind.LONG_TIME_STEPS, text), stacklevel=2)
        if not (motion.displacement.any() or self.force.value(motion.times).any()):
            text = f"nothing moves: the force is 0 for all of the {self.duration:g} s"
            warnings.warn(ModelWarning(WarningKind.NO_FORCE, text), stacklevel=2)
        curves, described = curves_of(self.rig, self.force, motion), declared(CURVES)
        return xr.Dataset(
            {name: described[name].variable(values) for name, values in curves.items()},
            coords={"seen": list(self.rig.labels)},
            attrs={
                "step_error": motion.error,
                "balance_error": motion.energies.balance_error,
                "largest_displacement": float(np.abs(curves["displacement"][:, -1]).max()),
            },
        )


def curves_of(rig: RigModel, force: ExcitationForce, motion: Motion) -> dict[str, Array]:
    """Return the values of a motion over its times, as :data:`CURVES` describes them."""
    return {
        "time": motion.times,
        "excitation": force.value(motion.times),
        "displacement": motion.displacement @ rig.seen.T,
        "acceleration": motion.acceleration @ rig.seen.T,
        "joint_force": rig.loop(motion)[1],
        "dissipated": motion.energies.joints.sum(axis=1),
    }
