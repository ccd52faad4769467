"""Results of a steady vibration as a tree of labelled arrays."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fe_models.dynamics.curves.forced_response import ResponseBranch
from fe_models.dynamics.curves.motion_recorder import Accuracy
from fe_models.dynamics.periodic.cycle_energy import damping_ratio
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from sa_solver.types import Array
from workflow.layout.declared import declared
from workflow.messages.warning_kinds import Notice, WarningKind
from workflow.models.vibration.layout import AMPLITUDES, MOTIONS, linear_limits
from workflow.models.vibration.motions import amplitudes_of, peaks_inside
from workflow.models.vibration.structure import VibratingStructure

if TYPE_CHECKING:
    import xarray as xr

# Error of a motion, due to harmonics and samples, that gives a warning.
LARGEST_ERROR = 0.05
CURVE = declared(f"""
    frequency | Hz | point | frequency of the force, in the order of the curve
    {AMPLITUDES.format(dim="point")}{MOTIONS.format(dim="point")}
""")


@dataclass(frozen=True)
class ForcedResponse:
    """The motions along a curve under one force, with their columns, and the resonance."""

    branch: ResponseBranch
    columns: Mapping[str, Array]
    resonance: HarmonicSolution

    @property
    def error(self) -> float:
        """Largest estimated error of a motion, by harmonics and samples."""
        every = (*self.branch.solutions, self.resonance)
        return max(motion.error.largest for motion in every if motion.error is not None)

    @property
    def problem(self) -> HarmonicBalance:
        """The equations at the resolution of the resonance."""
        return self.branch.problem.with_resolution(self.resonance.resolution)

    def faults(self, accuracy: Accuracy | None) -> Iterator[Notice]:
        """Return what makes the curve or its resonance wrong though all solvers converge.

        Motions are to have the ``accuracy``, or errors below :data:`LARGEST_ERROR` without one.
        """
        if self.branch.message:
            yield Notice(WarningKind.CURVE_ENDS, self.branch.message)
        if not peaks_inside(self.columns["amplitude"][:, -1]):
            text = "no resonance: the largest motion is at an end of the curve"
            yield Notice(WarningKind.NO_RESONANCE, text)
        if accuracy is None and self.error > LARGEST_ERROR:
            yield Notice(
                WarningKind.INACCURATE_MOTION,
                f"the motion has an error of {self.error:.1e}: give an accuracy, or a resolution "
                "with more harmonics and samples",
            )
        if accuracy is not None and self.error > accuracy.tolerance:
            yield Notice(
                WarningKind.INACCURATE_MOTION,
                f"the motion has an error of {self.error:.1e} at the finest resolution, above the "
                f"tolerance {accuracy.tolerance:g}: allow higher harmonics and more samples in the "
                "accuracy",
            )


@dataclass(frozen=True)
class VibrationResults:
    """Results of a structure within a span of frequencies [Hz]: its responses by their names."""

    structure: VibratingStructure
    frequencies: tuple[float, float]
    responses: Mapping[str, ForcedResponse]

    def tree(self) -> xr.DataTree:
        """Return the results as a tree of labelled arrays."""
        import xarray as xr

        groups = {name: self._response(response) for name, response in self.responses.items()}
        natural = {f"natural_{name}": of for name, of in self.structure.natural.items()}
        return xr.DataTree.from_dict(
            {"/": xr.Dataset(attrs=natural), "linear": self._limits(), **groups}
        )

    def _limits(self) -> xr.Dataset:
        """Return the linear limits over the frequency."""
        import xarray as xr

        limits, amount = self.structure.linear(self.frequencies), self.structure.driving.amount
        described = declared(linear_limits(amount))
        variables = {name: described[name].variable(array) for name, array in limits.items()}
        return xr.Dataset(variables).set_coords("frequency")

    def _response(self, response: ForcedResponse) -> xr.Dataset:
        import xarray as xr

        branch, resonance = response.branch, response.resonance
        return xr.Dataset(
            {name: CURVE[name].variable(array) for name, array in response.columns.items()},
            coords={
                "frequency": CURVE["frequency"].variable(branch.frequencies),
                "seen": list(self.structure.rig.labels),
            },
            attrs={
                "resonance": resonance.frequency,
                "amplitude": float(amplitudes_of(self.structure, resonance)[-1]),
                "damping": damping_ratio(response.problem, resonance),
                "error": response.error,
            },
        )
