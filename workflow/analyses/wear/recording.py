"""Observers of a wear run: its log with times and warnings, and the files of its jumps.

The coupled loop (:mod:`wear.coupled`) calls them but does not depend on them.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any

from sa_solver.types import Array
from wear.coupled_state import CoupledState, Observer
from wear.schedule import CoupledSettings
from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.checks.warnings import warn_of_many_jumps
from workflow.analyses.wear.worn.bolts import stored_tensions
from workflow.analyses.wear.worn.contact_loops import stored_loops
from workflow.case.text.plain import counted
from workflow.case.text.readable import percent
from workflow.models.checks.warnings import growth_warnings, instability_warnings
from workflow.models.contacts import FaceContacts
from workflow.models.loads import LoadSource
from workflow.models.progress import ReportsProgress
from workflow.models.structure import StructureLoads
from workflow.shell.analysis import Run
from workflow.shell.folders.steps import RunSteps
from workflow.shell.terminal.reporter import Reporter

# Number of jumps above which the run warns.
MANY_JUMPS = 300


@contextmanager
def reported_stage(reporter: Reporter, working: object, name: str, of: str) -> Iterator[None]:
    """Run a stage in which the ``working`` object reports how many items are done.

    ``of`` names the items. Objects that report no progress, such as other sources of loads, have no
    long computations.
    """
    with reporter.stage(name, of) as reported, ExitStack() as stack:
        if isinstance(working, ReportsProgress):
            stack.enter_context(working.reporting_to(reported))
        yield


def prepare_loads(source: LoadSource, reporter: Reporter) -> None:
    """Prepare the loads in a stage of their own; a structure is condensed or factorised."""
    with reported_stage(reporter, source, "condensation", "steps"):
        source.prepare()
    if isinstance(source, StructureLoads) and source.sparse:
        reporter.say(
            "joint: sparse factors, since full matrices do not fit into memory: the same results, "
            "but cycles with friction take longer"
        )


@dataclass(frozen=True)
class RunLog(Observer):
    """Log of the loop: times of its parts, progress, and warnings."""

    run: Run[WearCase]
    contacts: FaceContacts
    source: LoadSource

    def stage(self, name: str) -> AbstractContextManager[object]:
        working = self.source if name == "structural friction" else self.contacts.call
        return reported_stage(self.run.reporter, working, name, "increments")

    def jump_started(self, state: CoupledState[Any], cycles: float) -> None:
        step = self.run.case.wear.step
        if step.kind == "explicit" and step.fraction is None:
            faces = self.contacts.faces(state)
            self.run.reporter.warn_each(instability_warnings(faces, cycles))

    def jump_finished(self, before: CoupledState[Any], after: CoupledState[Any]) -> None:
        if self.run.case.contact.method != "nodes":
            self.run.reporter.warn_each(growth_warnings(self.contacts.faces(after)))
        drift, cost = after.drift[-1], after.cost - before.cost
        if after.solutions > before.solutions:
            self.run.reporter.log(f"drift {percent(drift)}: loads computed again")
        depths = ", ".join(f"{depth * 1e3:.3f}" for depth in after.kinetics[-1, :, :2].ravel())
        self.run.reporter.log(
            f"jump {after.jump}: {after.cycles[-1]:.6g} cycles, depths {depths} um, "
            f"{counted(cost.steps, 'step')}, {counted(cost.contact_solves, 'contact problem')}, "
            f"{cost.convolutions} convolutions, drift {percent(drift)}"
        )

    def remaining(self, state: CoupledState[Any], jumps: int) -> None:
        reporter, done, total = self.run.reporter, state.jump, state.jump + jumps
        if done == MANY_JUMPS:
            warn_of_many_jumps(self.run.case.wear, state, jumps, reporter)
        at = f"jump {done} of about {total}, {state.cycles[-1]:.4g} cycles"
        reporter.reached(done / total, at)


@dataclass(frozen=True)
class FileRecorder(Observer):
    """Writer of the fields at ``peak`` load after every jump, as files of the run's ``steps``."""

    run: Run[WearCase]
    settings: CoupledSettings
    peak: int
    contacts: FaceContacts
    source: LoadSource
    steps: RunSteps

    def begin(self, state: CoupledState[Any]) -> None:
        if self.run.kept is None:
            self.record(state)

    def jump_finished(self, before: CoupledState[Any], after: CoupledState[Any]) -> None:
        self.record(after)

    def record(self, state: CoupledState[Any]) -> None:
        """Write the fields of this jump."""
        faces, loops = self.contacts.faces(state), self._loops(state)
        with self.run.reporter.stage("checkpoints"):
            recorded = self.contacts.fields(state, self.peak)
            arrays: dict[str, Array] = {}
            for (stage, of_face), fields in zip(faces, recorded, strict=True):
                name = stage.name
                for body, height in enumerate(stage.on_grid(of_face).heights, start=1):
                    arrays[f"surfaces/{name}/body_{body}"] = height
                arrays |= {f"contact/{name}/{k}": field for k, field in vars(fields).items()}
            arrays |= loops | stored_tensions(self.source, faces)
            self.steps.record(state.jump, arrays, {"cycles": float(state.cycles[-1])})

    def _loops(self, state: CoupledState[Any]) -> dict[str, Array]:
        """Return the tangential loops on the present surfaces, if they are due."""
        loops = self.run.case.loops.described()
        if loops is None or not loops.due(state.jump, self.settings.ended(state)):
            return {}
        with self.run.reporter.stage("tangential loops"):
            found = self.contacts.loops(state, self.peak, loops)
        return stored_loops([stage.name for stage in self.contacts.stages], found)
