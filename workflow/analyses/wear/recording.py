"""What looks on while a wear run goes: its log with times and warnings, and the files of its jumps.

The coupled loop (:mod:`wear.coupled`) knows nothing of them.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass

from sa_solver.types import Array
from wear.coupled import CoupledSettings, CoupledState, Observer, Stage
from workflow.analyses.wear import checkpoint
from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.contact_loops import kept_loops, loops_due
from workflow.analyses.wear.contact_stage import ContactStage
from workflow.analyses.wear.contact_workers import ContactProcesses
from workflow.analyses.wear.warnings import warn_of_growth, warn_of_instability
from workflow.shell.folder import OutputFolder
from workflow.shell.reporter import Reporter
from workflow.shell.store import write_arrays

# What a run calls the parts of the loop.
STAGES: dict[Stage, str] = {
    "first cycle": "contact, first cycle",
    "wear": "wear",
    "probe": "drift probe",
    "loads": "structural friction",
}


@dataclass(frozen=True)
class RunLog(Observer):
    """Times the parts of the loop, and says how far it has got and what to beware of."""

    case: WearCase
    stages: list[ContactStage]
    reporter: Reporter

    def stage(self, name: Stage) -> AbstractContextManager[None]:
        return self.reporter.stage(STAGES[name])

    def jumping(self, state: CoupledState, cycles: float) -> None:
        step = self.case.wear.step
        if step.kind == "explicit" and step.fraction is None:
            warn_of_instability(self.stages, state, cycles, self.reporter)

    def jumped(self, before: CoupledState, after: CoupledState) -> None:
        warn_of_growth(self.stages, after, self.reporter)
        drift, spent = after.drift[-1], after.spent - before.spent
        if after.solutions > before.solutions:
            self.reporter.log(f"drift {drift:.2%}: resultants computed again")
        depths = ", ".join(f"{own * 1e3:.3f}" for own in after.kinetics[-1, :, :2].ravel())
        self.reporter.log(
            f"jump {after.jump}: {after.cycles[-1]:.6g} cycles, depths {depths} um, "
            f"{spent.steps} steps, {spent.contact_solves} contact problems, "
            f"{spent.convolutions} convolutions, drift {drift:.2%}"
        )


@dataclass(frozen=True)
class Recorder(Observer):
    """Writes the fields of every jump, and after them the state that the next one starts from.

    Fields are those at ``peak`` load. A run that is ``resumed`` has those of its first state.
    """

    case: WearCase
    settings: CoupledSettings
    peak: int
    contacts: ContactProcesses
    folder: OutputFolder
    reporter: Reporter
    resumed: bool

    def begin(self, state: CoupledState) -> None:
        if not self.resumed:
            self.keep(state)

    def jumped(self, before: CoupledState, after: CoupledState) -> None:
        self.keep(after)

    def keep(self, state: CoupledState) -> None:
        """Write the fields of this jump, then the state."""
        loops = self._loops(state)
        with self.reporter.stage("checkpoints"):
            recorded = self.contacts.fields(state.interfaces, self.peak)
            arrays: dict[str, Array] = {}
            names = self.contacts.names
            for name, own, fields in zip(names, state.interfaces, recorded, strict=True):
                body_1, body_2 = own.surfaces.heights
                arrays[f"surfaces/{name}/body_1"] = body_1
                arrays[f"surfaces/{name}/body_2"] = body_2
                arrays |= {f"contact/{name}/{k}": field for k, field in vars(fields).items()}
            attributes = {"cycles": float(state.cycles[-1])}
            write_arrays(self.folder.jump(state.jump), arrays | loops, attributes)
            checkpoint.save(self.folder.checkpoint, state)

    def _loops(self, state: CoupledState) -> dict[str, Array]:
        """Tangential loops on the present surfaces, where they are due."""
        if not loops_due(self.case.loops, state.jump, self.settings.ended(state)):
            return {}
        with self.reporter.stage("tangential loops"):
            found = self.contacts.loops(state.interfaces, self.peak)
        return kept_loops(self.contacts.names, found)
