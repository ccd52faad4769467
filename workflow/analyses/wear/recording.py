"""Observers of a wear run: its log with times and warnings, and the files of its jumps.

The coupled loop (:mod:`wear.coupled`) calls them but does not depend on them.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass

from sa_solver.types import Array
from wear.coupled import CoupledSettings, CoupledState, Observer, Stage
from workflow.analyses.wear import checkpoint
from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.checks.warnings import warn_of_growth, warn_of_instability
from workflow.analyses.wear.worn.bolts import kept_tensions
from workflow.analyses.wear.worn.contact_loops import kept_loops
from workflow.case.text.plain import counted
from workflow.case.text.readable import percent
from workflow.models.contacts import FaceContacts
from workflow.models.loads import LoadSource
from workflow.models.progress import ReportsProgress
from workflow.shell.analysis import Run
from workflow.shell.folders import steps
from workflow.shell.folders.store import write_arrays
from workflow.shell.terminal.reporter import Reporter


@contextmanager
def reported_stage(reporter: Reporter, working: object, name: str, of: str) -> Iterator[None]:
    """Run a stage in which the ``working`` object reports how many items are done.

    ``of`` names the items. Objects that report no progress, such as other sources of loads, have no
    long computations.
    """
    with reporter.stage(name, of) as told, ExitStack() as stack:
        if isinstance(working, ReportsProgress):
            stack.enter_context(working.reporting_to(told))
        yield


@dataclass(frozen=True)
class RunLog(Observer):
    """Log of the loop: times of its parts, progress, and warnings."""

    run: Run[WearCase]
    contacts: FaceContacts
    source: LoadSource

    def stage(self, name: Stage) -> AbstractContextManager[object]:
        working = self.source if name == "structural friction" else self.contacts
        return reported_stage(self.run.reporter, working, name, "increments")

    def jumping(self, state: CoupledState, cycles: float) -> None:
        step = self.run.case.wear.step
        if step.kind == "explicit" and step.fraction is None:
            warn_of_instability(self.contacts.stages, state, cycles, self.run.reporter)

    def jumped(self, before: CoupledState, after: CoupledState) -> None:
        if self.run.case.contact.method != "nodes":
            warn_of_growth(self.contacts.stages, after, self.run.reporter)
        drift, spent = after.drift[-1], after.spent - before.spent
        if after.solutions > before.solutions:
            self.run.reporter.log(f"drift {percent(drift)}: loads computed again")
        depths = ", ".join(f"{depth * 1e3:.3f}" for depth in after.kinetics[-1, :, :2].ravel())
        self.run.reporter.log(
            f"jump {after.jump}: {after.cycles[-1]:.6g} cycles, depths {depths} um, "
            f"{counted(spent.steps, 'step')}, {counted(spent.contact_solves, 'contact problem')}, "
            f"{spent.convolutions} convolutions, drift {percent(drift)}"
        )


@dataclass
class FileRecorder(Observer):
    """Writer of the fields of every jump and, from time to time, of the state for a restart.

    Fields are those at ``peak`` load. ``jumps`` are the digests of the jump files, starting with
    those of a resumed run. :mod:`workflow.shell.folders.steps` limits the share of time for writing
    states; the last state is written whatever ends the march, within :meth:`kept`.
    """

    run: Run[WearCase]
    settings: CoupledSettings
    peak: int
    contacts: FaceContacts
    jumps: list[str]
    source: LoadSource

    def __post_init__(self) -> None:
        self._unsaved: CoupledState | None = None
        # Time when the last state was written, and how long that took [s].
        self._saved, self._cost = time.perf_counter(), steps.FIRST_SAVE

    @contextmanager
    def kept(self) -> Iterator[None]:
        """March within this context; its last state is written unless a disk error ends it."""
        try:
            yield
        except OSError:
            raise
        except BaseException:
            self._save()
            raise
        self._save()

    def begin(self, state: CoupledState) -> None:
        if not self.jumps:
            self.keep(state)

    def jumped(self, before: CoupledState, after: CoupledState) -> None:
        self.keep(after)

    def keep(self, state: CoupledState) -> None:
        """Write the fields of this jump, then the state if it is due."""
        loops = self._loops(state)
        with self.run.reporter.stage("checkpoints"):
            recorded = self.contacts.fields(state.interfaces, self.peak)
            arrays: dict[str, Array] = {}
            stages = self.contacts.stages
            for stage, interface, fields in zip(stages, state.interfaces, recorded, strict=True):
                name = stage.name
                for body, height in enumerate(stage.on_grid(interface).heights, start=1):
                    arrays[f"surfaces/{name}/body_{body}"] = height
                arrays |= {f"contact/{name}/{k}": field for k, field in vars(fields).items()}
            attributes = {"cycles": float(state.cycles[-1])}
            path = self.run.folder.jump(state.jump)
            arrays |= loops | kept_tensions(self.source, state)
            self.jumps.append(write_arrays(path, arrays, attributes))
        self._unsaved = state
        if time.perf_counter() - self._saved >= self._cost / steps.SHARE:
            self._save()

    def _save(self) -> None:
        """Write the state of the last recorded jump, unless it is written already."""
        if self._unsaved is None:
            return
        begun = time.perf_counter()
        with self.run.reporter.stage("checkpoints"):
            checkpoint.keep(self.run, self._unsaved, self.jumps)
        self._unsaved, self._saved = None, time.perf_counter()
        self._cost = self._saved - begun

    def _loops(self, state: CoupledState) -> dict[str, Array]:
        """Return the tangential loops on the present surfaces, if they are due."""
        loops = self.run.case.loops.described()
        if loops is None or not loops.due(state.jump, self.settings.ended(state)):
            return {}
        with self.run.reporter.stage("tangential loops"):
            found = self.contacts.loops(state.interfaces, self.peak, loops)
        return kept_loops(self.contacts.names, found)
