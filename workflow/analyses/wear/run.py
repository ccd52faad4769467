"""A wear case, the main road: structure, contact, wear, back to the structure, output."""

from __future__ import annotations

from collections.abc import Sequence

from fe_models.mesh import MeshError
from sa_solver.normal import NormalContactError
from wear.coupled import CoupledSettings, CoupledState, CoupledWear, JumpSize, Stop
from wear.interface import CycleTractions, FaceLoads, FirstContact, MotionError
from wear.stepping import ContactFailure
from workflow.analyses.wear import checkpoint
from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.contact_stage import ContactStage, StageSettings
from workflow.analyses.wear.contact_workers import ContactProcesses, contact_workers
from workflow.analyses.wear.fidelity.choosing import say
from workflow.analyses.wear.recording import Recorder, RunLog
from workflow.analyses.wear.results import Outcome, write_output
from workflow.analyses.wear.structure_stage import StructureStage
from workflow.analyses.wear.structures import structure_of
from workflow.analyses.wear.warnings import warn_of_contact, warn_of_structure
from workflow.analyses.wear.worn_structure import nonlinearity_sentence
from workflow.errors import MethodFailed, UserError
from workflow.shell.analysis import Run
from workflow.shell.folder import OutputFolder
from workflow.shell.reporter import Reporter

# Jumps of a run whose explicit steps are too short to be recorded one by one.
RECORDS = 10


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
    except MotionError as error:
        raise UserError(
            "wear.motion: the surfaces move over each other, and that of body 1 changes from place "
            "to place (evolution.scope: local), which no wear step follows; allowed: motion: "
            "neglect, or scope: global"
        ) from error
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
            nodes, interface_nodes = source.node_count(), source.interface_count()
            structure_of(self._case).memory(self._case, nodes, interface_nodes).check()
        settings = [StageSettings(self._case, face) for face in faces]
        with contact_workers(settings) as workers:
            with self._reporter.stage("condensation"):
                source.prepare()
            with self._reporter.stage("structural friction"):
                unworn = source.unworn()
            if isinstance(source, StructureStage):
                self._look_at(source)
            with self._reporter.stage("contact set-up"):
                stages = [ContactStage(own) for own in settings]
            contacts = ContactProcesses(stages, workers)
            state, first = self._march(unworn, contacts, kept)
            worn: list[CycleTractions] = []
            if self._case.stress.wanted:
                with self._reporter.stage("stress under the contacts"):
                    worn = contacts.tractions(state.interfaces)
        return Outcome(self._case, source, stages, state, unworn, first, worn)

    def _march(
        self,
        unworn: Sequence[FaceLoads],
        contacts: ContactProcesses,
        kept: CoupledState | None,
    ) -> tuple[CoupledState, list[FirstContact]]:
        """The state at the end, from ``kept`` or from unworn surfaces; and the first contact."""
        case, source, reporter = self._case, self._source, self._reporter
        settings = coupled_settings(case)
        log = RunLog(case, contacts.stages, reporter)
        recorder = Recorder(
            case, settings, source.peak, contacts, self._folder, reporter, kept is not None
        )
        loop = CoupledWear(settings, source, contacts, (log, recorder))
        state, first = loop.begin(unworn)
        warn_of_contact(case, source.peak, contacts.stages, state, first, reporter)
        end = kept or state
        with reporter.jumps(settings.cycles, float(end.cycles[-1])) as bar:
            for end in loop.march(end):  # noqa: B020 - each from the one before
                bar(float(end.cycles[-1]), end.jump)
        return end, first

    def _look_at(self, structure: StructureStage) -> None:
        """Warnings about the structure, and the check of its nonlinearity."""
        case, reporter = self._case, self._reporter
        warn_of_structure(structure, reporter)
        if case.friction.evolution and case.recoupling.resultants == "constant":
            reporter.warn(
                "friction.evolution: the structure keeps its first coefficient "
                "(coupling.resultants: constant)"
            )
        if structure.model.nonlinearity.check:
            with reporter.stage("nonlinearity check"):
                check = structure.nonlinear_check
            reporter.say(nonlinearity_sentence(check))


def coupled_settings(case: WearCase) -> CoupledSettings:
    """How far a run goes and when its structure is solved again, as the loop takes it."""
    wear, step, coupling = case.wear, case.wear.step, case.recoupling
    cycles = step.cycles if step.fraction is None else wear.cycles / RECORDS
    return CoupledSettings(
        cycles=wear.cycles,
        jump=JumpSize(cycles, step.depth, step.volume),
        stop=Stop(wear.stop.depth, wear.stop.volume),
        resultants=coupling.resultants,
        drift=coupling.drift,
        friction=None if case.friction.evolution is None else case.friction.at,
    )
