"""A wear case, the main road: structure, contact, wear, back to the structure, output."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fe_models.mesh import MeshError
from sa_solver.normal import NormalContactError
from sa_solver.types import Array, resultant_change
from wear.stepping import ContactFailure
from workflow.analyses.wear import checkpoint
from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.checkpoint import KINETICS, RunState, kinetics_row
from workflow.analyses.wear.contact_loops import kept_loops, loops_due
from workflow.analyses.wear.contact_stage import (
    ContactStage,
    CycleTractions,
    FirstContact,
    StageSettings,
)
from workflow.analyses.wear.contact_workers import contact_workers
from workflow.analyses.wear.fidelity.choosing import say
from workflow.analyses.wear.interface_state import InterfaceState, Spent
from workflow.analyses.wear.load_source import FaceLoads, LoadSource
from workflow.analyses.wear.results import Outcome, write_output
from workflow.analyses.wear.structure import condensation_memory
from workflow.analyses.wear.structure_stage import StructureStage
from workflow.analyses.wear.structures import structure_of
from workflow.analyses.wear.warnings import warn_of_contact, warn_of_growth, warn_of_structure
from workflow.analyses.wear.worn_structure import nonlinearity_sentence
from workflow.errors import MethodFailed, UserError
from workflow.shell.analysis import Run
from workflow.shell.folder import OutputFolder
from workflow.shell.processes import Workers
from workflow.shell.reporter import Reporter
from workflow.shell.store import write_arrays

# Jumps that add up to the cycles of the run but for rounding leave no jump over.
ROUNDING = 1e-9
# Jumps of a run whose explicit steps are too short to be recorded one by one.
RECORDS = 10
# How near to a stop a run must come: a jump that is to reach it is cut short to do so.
AT_STOP = 1e-3


def run_wear(run: Run[WearCase]) -> None:
    """Run a wear case to its end, from its last whole jump if it is to resume."""
    folder = run.folder
    say(run.choice, run.reporter)
    try:
        outcome = WearRun(run.case, folder, run.reporter).execute(run.resume)
        write_output(outcome, run)
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
        self._source = structure_of(case).source(case)

    def execute(self, resume: bool) -> Outcome:
        """Run to the end."""
        self._reporter.say(f"{'resume' if resume else 'run'}: {self._case.title}")
        # Read first, so that a damaged one is told before anything is computed.
        resumed = resume and self._folder.checkpoint.exists()
        kept = checkpoint.load(self._folder.checkpoint) if resumed else None
        source = self._source
        with self._reporter.stage("mesh"):
            faces = source.faces
        if isinstance(source, StructureStage):
            condensation_memory(source.node_count(), source.interface_count()).check()
        settings = [StageSettings(self._case, face) for face in faces]
        with contact_workers(settings) as workers:
            with self._reporter.stage("condensation"):
                source.prepare()
            with self._reporter.stage("structural friction"):
                unworn = source.unworn()
            if isinstance(source, StructureStage):
                warn_of_structure(source, self._reporter)
                if self._case.friction.evolution and self._case.recoupling.resultants == "constant":
                    self._reporter.warn(
                        "friction.evolution: the structure keeps its first coefficient "
                        "(coupling.resultants: constant)"
                    )
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
        return Outcome(self._case, source, stages, state, unworn, first, worn)

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
            spent=sum((own.spent for _, own in begun), Spent()),
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
        cycles, spent = self._jump_cycles(state), Spent()
        # The run ends at a stop if it comes to that.
        left, count = max(cycles, min(self._left(state), self._to_stop(state))), len(self._stages)
        while True:
            with self._reporter.stage("wear"):
                jumped = self._workers.call(
                    "jump", state.interfaces, [cycles] * count, [left] * count
                )
            spent = sum((own for _, own in jumped), spent)
            interfaces = tuple(own for own, _ in jumped)
            shorter = cycles * self._share_to_stop(state, interfaces)
            if shorter == cycles or cycles <= 1.0:
                break
            cycles = max(1.0, shorter)
        state = replace(state, interfaces=interfaces, spent=state.spent + spent)
        warn_of_growth(self._stages, state, self._reporter)
        state, drift = self._follow_drift(state)
        state = state.record(float(state.cycles[-1]) + cycles, self._areas, drift)
        depths = ", ".join(f"{own * 1e3:.3f}" for own in state.kinetics[-1, :, :2].ravel())
        self._reporter.log(
            f"jump {state.jump}: {state.cycles[-1]:.6g} cycles, depths {depths} um, "
            f"{spent.steps} steps, {spent.contact_solves} contact problems, "
            f"{spent.convolutions} convolutions, drift {drift:.2%}"
        )
        self.keep(state)
        return state

    def _jump_cycles(self, state: RunState) -> float:
        """Cycles of the next jump, by the case's measure at the present rates."""
        step, left = self._case.wear.step, self._left(state)
        if step.cycles is not None:
            cycles = step.cycles
        elif step.depth is not None:
            cycles = _quotient(step.depth, self._depth_rate(state))
        elif step.volume is not None:
            cycles = _quotient(step.volume, self._volume_rate(state))
        elif step.fraction is not None:
            cycles = self._case.wear.cycles / RECORDS
        else:
            # The steps that are left, all of one length: none of them is a mere remainder.
            proposed = min(own.next_cycles for own in state.interfaces)
            cycles = left / max(1.0, np.ceil(left / proposed * (1.0 - ROUNDING)))
        if step.kind == "explicit" and step.fraction is None:
            self._warn_of_instability(state, cycles)
        cycles = min(cycles, self._to_stop(state))
        return left if cycles > left * (1.0 - ROUNDING) else float(cycles)

    def _left(self, state: RunState) -> float:
        """Cycles to the end of the run."""
        return self._case.wear.cycles - float(state.cycles[-1])

    def _to_stop(self, state: RunState) -> float:
        """Cycles to the nearest stop at the present rates."""
        stop, worn = self._case.wear.stop, _worn(state.kinetics[-1])
        to_depth = to_volume = np.inf
        if stop.depth is not None:
            to_depth = _quotient(stop.depth - worn.depth, self._depth_rate(state))
        if stop.volume is not None:
            to_volume = _quotient(stop.volume - worn.volume, self._volume_rate(state))
        return max(1.0, min(to_depth, to_volume))

    def _share_to_stop(self, before: RunState, interfaces: tuple[InterfaceState, ...]) -> float:
        """Share of a jump at which it came to a stop that it went past; else 1."""
        rows = zip(interfaces, self._areas, strict=True)
        after = _worn(np.array([kinetics_row(own, area) for own, area in rows]))
        worn, stop, share = _worn(before.kinetics[-1]), self._case.wear.stop, 1.0
        for limit, then, now in (
            (stop.depth, worn.depth, after.depth),
            (stop.volume, worn.volume, after.volume),
        ):
            if limit is not None and now > limit * (1.0 + AT_STOP):
                share = min(share, (limit - then) / (now - then))
        return share

    def _depth_rate(self, state: RunState) -> float:
        return max(own.depth_rate for own in state.interfaces)

    def _volume_rate(self, state: RunState) -> float:
        return sum(own.volume_rate for own in state.interfaces)

    def _warn_of_instability(self, state: RunState, cycles: float) -> None:
        pairs = zip(self._stages, state.interfaces, strict=True)
        stable = min(stage.stable_cycles(own) for stage, own in pairs)
        if cycles > stable:
            self._reporter.warn(
                f"explicit wear steps above {stable:.3g} cycles amplify the grid's roughness "
                "(wear.step): use implicit steps or smaller ones"
            )

    def _ended(self, state: RunState) -> bool:
        wear, worn = self._case.wear, _worn(state.kinetics[-1])
        reached = 1.0 - AT_STOP
        return bool(
            state.cycles[-1] >= wear.cycles * (1.0 - ROUNDING)
            or (wear.stop.depth is not None and worn.depth >= wear.stop.depth * reached)
            or (wear.stop.volume is not None and worn.volume >= wear.stop.volume * reached)
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
        if coupling.resultants == "drift" and drift <= coupling.drift:
            return state, drift
        with self._reporter.stage("structural friction"):
            depths, friction = self._depths(state.interfaces), self._friction(state.interfaces)
            histories = self._source.worn(depths, friction)
        self._reporter.log(f"drift {drift:.2%}: resultants computed again")
        triples = zip(self._stages, state.interfaces, histories, strict=True)
        return replace(
            state,
            interfaces=tuple(stage.follow(own, history) for stage, own, history in triples),
            solved_resultants=probe,
            solutions=state.solutions + 1,
        ), drift

    def _probe(self, interfaces: tuple[InterfaceState, ...]) -> Array:
        return self._source.probe(self._depths(interfaces), self._friction(interfaces))

    def _friction(self, interfaces: tuple[InterfaceState, ...]) -> list[float] | None:
        """Coefficients of friction of the interfaces, where they change."""
        friction = self._case.friction
        if friction.evolution is None:
            return None
        return [friction.at(own.energy) for own in interfaces]

    def _depths(self, interfaces: tuple[InterfaceState, ...]) -> list[Array]:
        return [s.nodal_depth(own) for s, own in zip(self._stages, interfaces, strict=True)]

    @property
    def _areas(self) -> list[float]:
        return [stage.grid.cell_area for stage in self._stages]

    def _loops(self, state: RunState) -> dict[str, Array]:
        """Tangential loops on the present surfaces, where they are due."""
        if not loops_due(self._case.loops, state.jump, self._ended(state)):
            return {}
        with self._reporter.stage("tangential loops"):
            peaks = [self._source.peak] * len(self._stages)
            found = self._workers.call("loop", state.interfaces, peaks)
        return kept_loops([stage.name for stage in self._stages], found)

    def keep(self, state: RunState) -> None:
        """Write the fields of this jump, then the state that the next one starts from."""
        loops = self._loops(state)
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
            write_arrays(self._folder.jump(state.jump), arrays | loops, attributes)
            checkpoint.save(self._folder.checkpoint, state)


class _Worn(NamedTuple):
    """Largest depth of either body [mm] and volume of all [mm³]."""

    depth: float
    volume: float


def _worn(kinetics: Array) -> _Worn:
    """Of a row of kinetics ``(interfaces, 5)``."""
    last = dict(zip(KINETICS, kinetics.T, strict=True))
    depth = max(last["depth_1"].max(), last["depth_2"].max())
    return _Worn(float(depth), float((last["volume_1"] + last["volume_2"]).sum()))


def _quotient(limit: float, rate: float) -> float:
    """Cycles to a limit; all that remain where nothing wears."""
    return limit / rate if rate > 0.0 else np.inf
