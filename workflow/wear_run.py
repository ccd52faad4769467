"""A wear case, the main road: structure, contact, wear, back to the structure, output."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fe_models.mesh import MeshError
from sa_solver.normal import NormalContactError
from sa_solver.types import Array, resultant_change
from wear.stepping import ContactFailure
from workflow import checkpoint
from workflow.case import WearCase
from workflow.checkpoint import KINETICS, RunState
from workflow.contact_stage import (
    ContactStage,
    CycleTractions,
    FirstContact,
    InterfaceState,
    StageSettings,
)
from workflow.errors import MethodFailed, UserError
from workflow.folder import OutputFolder
from workflow.load_source import FaceLoads, LoadSource
from workflow.memory import check_memory
from workflow.output import Outcome, write_output
from workflow.reporter import Reporter
from workflow.sources import load_source
from workflow.store import write_arrays
from workflow.structure_output import nonlinearity_sentence
from workflow.structure_stage import StructureStage
from workflow.warnings import warn_of_contact, warn_of_growth, warn_of_structure
from workflow.workers import Workers, contact_workers

# Jumps that add up to the cycles of the run but for rounding leave no jump over.
ROUNDING = 1e-9


def run_wear(case: WearCase, folder: OutputFolder, reporter: Reporter, resume: bool) -> None:
    """Run a wear case to its end, from its last whole jump if it is to ``resume``."""
    try:
        WearRun(case, folder, reporter).execute(resume)
    except (ContactFailure, NormalContactError, MethodFailed) as error:
        remedy = f"; the state is kept, see `fretscale resume {folder.root}`"
        raise MethodFailed(f"{error}{remedy if folder.checkpoint.exists() else ''}") from error
    except MeshError as error:
        raise UserError(f"{folder.case}: structure: {error}") from error


class WearRun:
    """One run of a wear case."""

    def __init__(self, case: WearCase, folder: OutputFolder, reporter: Reporter) -> None:
        self._case = case
        self._folder = folder
        self._reporter = reporter
        self._source = load_source(case)

    def execute(self, resume: bool) -> None:
        """Run to the end and write everything."""
        self._reporter.say(f"{'resume' if resume else 'run'}: {self._case.title}")
        # Read first, so that a damaged one is told before anything is computed.
        resumed = resume and self._folder.checkpoint.exists()
        kept = checkpoint.load(self._folder.checkpoint) if resumed else None
        source = self._source
        with self._reporter.stage("mesh"):
            faces = source.faces
        if isinstance(source, StructureStage):
            check_memory(self._case, source.node_count(), source.interface_count())
        settings = [StageSettings(self._case, face) for face in faces]
        with contact_workers(settings) as workers:
            with self._reporter.stage("condensation"):
                source.prepare()
            with self._reporter.stage("structural friction"):
                unworn = source.unworn()
            if isinstance(source, StructureStage):
                warn_of_structure(source, self._reporter)
                self._check_nonlinearity(source)
            with self._reporter.stage("contact set-up"):
                stages = [ContactStage(own) for own in settings]
            loop = WearLoop(self._case, self._folder, self._reporter, source, stages, workers)
            state, first = loop.begin(unworn)
            warn_of_contact(self._case, source.peak, stages, state, first, self._reporter)
            if kept is None:
                loop.keep(state)
            state = loop.advance(kept or state)
            worn: list[CycleTractions] = []
            if self._case.stress.wanted:
                with self._reporter.stage("stress under the contacts"):
                    worn = workers.call("tractions", state.interfaces)
        outcome = Outcome(self._case, source, stages, state, unworn, first, worn)
        write_output(outcome, self._folder, self._reporter)

    def _check_nonlinearity(self, source: StructureStage) -> None:
        if not source.model.nonlinearity.check:
            return
        with self._reporter.stage("nonlinearity check"):
            check = source.nonlinear_check
        self._reporter.say(nonlinearity_sentence(check))


class WearLoop:
    """Jumps of all interfaces side by side, with a checkpoint after each."""

    def __init__(
        self,
        case: WearCase,
        folder: OutputFolder,
        reporter: Reporter,
        source: LoadSource,
        stages: list[ContactStage],
        workers: Workers,
    ) -> None:
        self._case = case
        self._folder = folder
        self._reporter = reporter
        self._source = source
        self._stages = stages
        self._workers = workers

    def begin(self, unworn: Sequence[FaceLoads]) -> tuple[RunState, list[FirstContact]]:
        """State before the first jump, and the contact of the first cycle."""
        with self._reporter.stage("contact, first cycle"):
            begun = self._workers.call("begin", unworn)
        interfaces = tuple(own for own, _ in begun)
        count = len(self._stages)
        state = RunState(
            interfaces=interfaces,
            cycles=np.empty(0),
            kinetics=np.empty((0, count, len(KINETICS))),
            drift=np.empty(0),
            solved_resultants=self._probe(interfaces),
            solutions=1,
        )
        return state.record(0.0, self._areas, 0.0), [first for _, first in begun]

    def advance(self, state: RunState) -> RunState:
        """Jump until the cycles are over or a stop is reached."""
        total = self._case.wear.cycles
        with self._reporter.jumps(total, float(state.cycles[-1])) as progress:
            while not self._ended(state):
                state = self._jump(state)
                progress.update(float(state.cycles[-1]), state.jump)
        return state

    def _jump(self, state: RunState) -> RunState:
        cycles = self._jump_cycles(state)
        with self._reporter.stage("wear"):
            jumped = self._workers.call("jump", state.interfaces, [cycles] * len(self._stages))
        state = replace(state, interfaces=tuple(own for own, _ in jumped))
        warn_of_growth(self._stages, state, self._reporter)
        state, drift = self._follow_drift(state)
        state = state.record(float(state.cycles[-1]) + cycles, self._areas, drift)
        convolutions = sum(spent for _, spent in jumped)
        self._reporter.log(
            f"jump {state.jump}: {state.cycles[-1]:.6g} cycles, depths "
            f"{np.array2string(state.kinetics[-1, :, :2] * 1e3, precision=3)} um, "
            f"{convolutions} convolutions, drift {drift:.2%}"
        )
        self.keep(state)
        return state

    def _jump_cycles(self, state: RunState) -> float:
        """Cycles of the next jump, by the case's measure at the present rates."""
        step = self._case.wear.step
        if step.cycles is not None:
            cycles = step.cycles
        elif step.depth is not None:
            cycles = _quotient(step.depth, max(own.depth_rate for own in state.interfaces))
        else:
            assert step.volume is not None
            cycles = _quotient(step.volume, sum(own.volume_rate for own in state.interfaces))
        if step.kind == "explicit":
            self._warn_of_instability(state, cycles)
        left = self._case.wear.cycles - float(state.cycles[-1])
        return left if cycles > left * (1.0 - ROUNDING) else cycles

    def _warn_of_instability(self, state: RunState, cycles: float) -> None:
        pairs = zip(self._stages, state.interfaces, strict=True)
        stable = min(stage.stable_cycles(own) for stage, own in pairs)
        if cycles > stable:
            self._reporter.warn(
                f"explicit wear steps above {stable:.3g} cycles amplify the grid's roughness "
                "(wear.step): use implicit steps or smaller ones"
            )

    def _ended(self, state: RunState) -> bool:
        wear = self._case.wear
        depth = state.kinetics[-1, :, :2].max()
        volume = state.kinetics[-1, :, 2:4].sum()
        return bool(
            state.cycles[-1] >= wear.cycles * (1.0 - ROUNDING)
            or (wear.stop.depth is not None and depth >= wear.stop.depth)
            or (wear.stop.volume is not None and volume >= wear.stop.volume)
        )

    def _follow_drift(self, state: RunState) -> tuple[RunState, float]:
        """Solve the structure again where its resultants have drifted too far."""
        coupling = self._case.recoupling
        if coupling.resultants == "constant":
            return state, 0.0
        with self._reporter.stage("drift probe"):
            probe = self._probe(state.interfaces)
        sizes = np.array([stage.grid.size for stage in self._stages])
        drift = float(np.abs(resultant_change(probe, state.solved_resultants, sizes)).max())
        if drift <= coupling.drift:
            return state, drift
        with self._reporter.stage("structural friction"):
            histories = self._source.worn(self._depths(state.interfaces))
        self._reporter.log(f"drift {drift:.2%}: resultants computed again")
        pairs = zip(state.interfaces, histories, strict=True)
        return replace(
            state,
            interfaces=tuple(replace(own, loads=h.loads, slip=h.slip) for own, h in pairs),
            solved_resultants=probe,
            solutions=state.solutions + 1,
        ), drift

    def _probe(self, interfaces: tuple[InterfaceState, ...]) -> Array:
        return self._source.probe(self._depths(interfaces))

    def _depths(self, interfaces: tuple[InterfaceState, ...]) -> list[Array]:
        return [s.nodal_depth(own) for s, own in zip(self._stages, interfaces, strict=True)]

    @property
    def _areas(self) -> list[float]:
        return [stage.grid.cell_area for stage in self._stages]

    def keep(self, state: RunState) -> None:
        """Write the fields of this jump, then the state that the next one starts from."""
        with self._reporter.stage("checkpoints"):
            peaks = [self._source.peak] * len(self._stages)
            recorded = self._workers.call("peak_fields", state.interfaces, peaks)
            arrays: dict[str, Array] = {}
            for stage, own, fields in zip(self._stages, state.interfaces, recorded, strict=True):
                body_1, body_2 = own.surfaces.heights
                arrays[f"surfaces/{stage.name}/body_1"] = body_1
                arrays[f"surfaces/{stage.name}/body_2"] = body_2
                arrays |= {f"contact/{stage.name}/{name}": field for name, field in fields.items()}
            attributes = {"cycles": float(state.cycles[-1])}
            write_arrays(self._folder.jump(state.jump), arrays, attributes)
            checkpoint.save(self._folder.checkpoint, state)


def _quotient(limit: float, rate: float) -> float:
    """Cycles to a limit; all that remain where nothing wears."""
    return limit / rate if rate > 0.0 else np.inf
