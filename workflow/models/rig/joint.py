"""A friction joint alone that is driven at a stroke and ages by the energy it dissipates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Protocol

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array
from wear.joints.ageing import EnergyPerCycle, LongTest, long_test, steady_stroke
from wear.joints.evolution import JointEvolution
from wear.joints.law import march_joints
from workflow.layout.declared import declared
from workflow.models.rig.laws import Laws, LineLaw
from workflow.models.rig.layout import EVOLUTION, PARAMETERS

if TYPE_CHECKING:
    import xarray as xr

PARAMETER_NAMES = tuple(declared(PARAMETERS))
# Points of a loop: those of a cosine over a cycle, dense at the reversals.
LOOP_POINTS = 720
# Cycles in which a loop settles from rest. From the second one on, cycles repeat for every law but
# Bouc-Wen's, which takes a few more where it hardly slides.
SETTLING = 20
# Points of the evolution over the energy: evenly spaced, and as many evenly in the logarithm from
# this share on, as friction changes within a few cycles.
CURVE_POINTS, CURVE_BEGIN = 101, 1e-6
CURVES = declared(EVOLUTION)
LOOPS = declared("""
    dissipated | N mm | state | energy dissipated before the loop
    displacement | mm | state point | displacement of the joint in a cycle
    force | N | state point | force that resists it
""")


@dataclass(frozen=True)
class WearingJoint:
    """A friction joint alone, driven at a constant stroke, whose parameters change as it wears.

    The parameters depend on the energy that the joint has dissipated. Cycles are passed by jumps in
    energy (:func:`wear.joints.long_test`).

    Parameters
    ----------
    law : law of :mod:`wear.joints`
        Law with the initial parameters, such as :class:`wear.joints.BoucWen`.
    evolution : JointEvolution
        Change of the parameters with the energy (:class:`wear.joints.JointEvolution`).
    stroke : float
        Motion of the joint, peak to peak [mm].
    cycles : float, optional
        Length of the test in cycles; give either this or ``energy``.
    energy : float, optional
        Dissipated energy at which the test ends [N mm].
    tolerance : float
        Relative error of the cycles that jumps may cause.

    Examples
    --------
    The friction of a joint rises to twice its value within about 1 J, and each cycle dissipates
    4 µN (A - µN/kt):

    >>> import fretscale
    >>> from wear.joints import ExponentialEvolution, Jenkins, JointEvolution
    >>> law = Jenkins(stiffness=1e4, friction=0.4, normal_load=60.0)
    >>> evolution = JointEvolution(friction=ExponentialEvolution(final=2.0, rate=-1e-3))
    >>> joint = fretscale.WearingJoint(law, evolution, stroke=0.02, cycles=1e5)
    >>> results = joint.run(energies=[0.0])
    >>> friction = results["friction"].values[[0, -1]]
    >>> print([f"{4.0 * 60.0 * mu * (0.01 - 60.0 * mu / 1e4):.4f}" for mu in friction])
    ['0.7296', '0.9984']
    >>> print(results["energy_per_cycle"].values[[0, -1]].round(4), results["loops/force"].dims)
    [0.7296 0.9984] ('state', 'point')
    """

    law: LineLaw
    evolution: JointEvolution
    stroke: float
    cycles: float | None = None
    energy: float | None = None
    tolerance: float = 1e-4

    def __post_init__(self) -> None:
        checks.instances(self, law=LineLaw, evolution=JointEvolution)
        for parameter in fields(self.law):
            checks.number(
                f"{parameter.name} of WearingJoint.law", getattr(self.law, parameter.name)
            )
        checks.numbers(self, "stroke", "cycles", "energy", "tolerance", above=0.0)
        if (self.cycles is None) == (self.energy is None):
            raise InputError("a joint is driven for a number of cycles or to an energy: give one")

    @property
    def amplitude(self) -> float:
        """Half of the stroke [mm]."""
        return 0.5 * self.stroke

    @property
    def energy_per_cycle(self) -> EnergyPerCycle:
        """Energy of a cycle as a function of the energy dissipated before it [N mm]."""
        return steady_stroke(self.law, self.evolution, self.amplitude)

    def at(self, energy: float) -> LineLaw:
        """Return the law after a dissipated ``energy`` [N mm]."""
        return self.evolution.at(self.law, energy)

    def parameters(self, energy: float) -> dict[str, float]:
        """Return the parameters after a dissipated ``energy`` [N mm], by name."""
        return parameters_of(self.at(energy))

    def test(self) -> LongTest:
        """Return the energy against the cycles of the test. Raises AgeingError."""
        return ageing_test(
            self.energy_per_cycle, self.cycles, self.energy, self.tolerance, self.evolution.breaks
        )

    def run(self, energies: Sequence[float] = ()) -> xr.DataTree:
        """Compute the test, and return the joint over the energy that it has dissipated.

        Parameters
        ----------
        energies : sequence of float
            Energies at which a loop is wanted in addition to that at the end [N mm].

        Returns
        -------
        xarray.DataTree
            Cycles, energy per cycle and parameters over the energy, and a group ``loops`` with
            displacement and force at each of the ``energies`` and at the end. An attribute is the
            error of the cycles by jumps.

        Raises
        ------
        InputError
            An energy is beyond the end of the test.
        AgeingError
            The joint never dissipates the energy, or its energy per cycle is not smooth enough.
        """
        import xarray as xr

        test = self.test()
        last = test.final_energy if self.energy is None else self.energy
        wanted = checks.array("energies", energies, (None,))
        if ((wanted < 0.0) | (wanted > last)).any():
            raise InputError(f"energies outside the test, which ends at {last:g} N mm")
        states = np.append(wanted, last)
        displacement, force, _ = zip(
            *(steady_loop(self.at(energy), self.amplitude) for energy in states.tolist()),
            strict=True,
        )
        loops = {"dissipated": states, "displacement": displacement, "force": force}
        curves = evolution_curve(self, last, test, self.energy_per_cycle)
        return xr.DataTree.from_dict(
            {
                "/": xr.Dataset(
                    {name: CURVES[name].variable(values) for name, values in curves.items()},
                    attrs={"cycles_error": test.error},
                ),
                "loops": xr.Dataset(
                    {name: LOOPS[name].variable(np.array(array)) for name, array in loops.items()}
                ),
            }
        )


class JointOverEnergy(Protocol):
    """Protocol of a joint whose parameters depend on its dissipated energy."""

    def parameters(self, energy: float) -> dict[str, float]:
        """Return the parameters after a dissipated ``energy`` [N mm], by name."""
        ...


def parameters_of(law: object) -> dict[str, float]:
    """Return the parameters of a law that may evolve, by name."""
    return {name: float(getattr(law, name)) for name in PARAMETER_NAMES if hasattr(law, name)}


def ageing_test(
    energy_per_cycle: EnergyPerCycle,
    cycles: float | None,
    energy: float | None,
    tolerance: float,
    breaks: Sequence[float],
) -> LongTest:
    """Return a long test to a number of cycles or to an energy. Raises AgeingError."""
    return long_test(
        energy_per_cycle,
        np.inf if cycles is None else cycles,
        until=np.inf if energy is None else energy,
        tolerance=tolerance,
        breaks=breaks,
    )


def steady_loop(law: Laws, amplitude: float) -> tuple[Array, Array, float]:
    """Return a settled cycle between ± ``amplitude`` [mm]: displacement, force, and energy.

    The cycle begins and ends at a reversal; the energy is the dissipated one.
    """
    phase = np.linspace(0.0, 2.0 * np.pi, LOOP_POINTS + 1)
    moved = amplitude * np.cos(phase)[:, None, None]
    settling = np.array([amplitude, *[-amplitude, amplitude] * SETTLING])[:, None, None]
    begin = np.zeros((1, 1))
    settled = march_joints(law, law.rest(1), begin, settling)
    cycle = march_joints(law, settled.state, settling[-1], moved)
    return moved[:, 0, 0], cycle.force[:, 0, 0], float(cycle.dissipated.sum())


def evolution_curve(
    joint: JointOverEnergy,
    last: float,
    test: LongTest | None = None,
    rate: EnergyPerCycle | None = None,
) -> dict[str, Array]:
    """Return parameters over the energy up to the ``last``, with cycles if the joint is aged.

    Cycles come with the energy per cycle.
    """
    energy = np.array([0.0])
    if last > 0.0:
        even = np.linspace(0.0, last, CURVE_POINTS)
        energy = np.union1d(even, np.geomspace(CURVE_BEGIN * last, last, CURVE_POINTS)[:-1])
    parameters = [joint.parameters(dissipated) for dissipated in energy.tolist()]
    curve = {"energy": energy}
    if test is not None and rate is not None:
        per_cycle = np.array([rate(dissipated) for dissipated in energy.tolist()])
        curve |= {"cycles": test.cycles_at(energy), "energy_per_cycle": per_cycle}
    return curve | {
        name: np.array([values[name] for values in parameters]) for name in parameters[0]
    }
