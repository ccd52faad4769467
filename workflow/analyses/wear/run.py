"""Run of a wear case: structure, contact, wear, updated loads, output."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import cache, partial
from threading import Lock
from typing import Any

from fe_models.meshes.structure_mesh import MeshError
from fe_models.solvers.blas_threads import one_thread
from sa_solver.normal.contact import NormalContactError
from wear.contact.face_loads import FaceLoads
from wear.contact.interface import FirstContact, MotionError
from wear.coupled_state import CoupledState
from wear.steps.stepping import ContactFailure
from workflow.analyses.wear.budget.finding import ProbeResults, begin_probe_runs
from workflow.analyses.wear.case.base import FiniteElementCase, WearCase
from workflow.analyses.wear.checks.warnings import (
    warn_of_contact,
    warn_of_file,
    warn_of_structure,
    warn_of_worn_cells,
)
from workflow.analyses.wear.choice import report_choice
from workflow.analyses.wear.contact_workers import WorkerCalls, contact_workers
from workflow.analyses.wear.model import wear_model
from workflow.analyses.wear.output.outcome import Outcome
from workflow.analyses.wear.output.results import write_output
from workflow.analyses.wear.recording import FileRecorder, RunLog, prepare_loads, reported_stage
from workflow.analyses.wear.structures import structure_of
from workflow.analyses.wear.structures.resultants.case import ResultantsCase
from workflow.analyses.wear.structures.resultants.writing import marched
from workflow.analyses.wear.translation import check_section
from workflow.analyses.wear.worn.worn_structure import nonlinearity_sentence
from workflow.errors import MethodFailed, UserError
from workflow.messages.warning_kinds import WarningKind
from workflow.models.budget.budget import interface_outcomes
from workflow.models.checks.limits import check_steps
from workflow.models.checks.warnings import friction_step_warnings
from workflow.models.contact import ContactEnd, last_cycle
from workflow.models.contacts import FaceContacts
from workflow.models.loads import ContactFace, LoadSource
from workflow.models.structure import StructureLoads
from workflow.models.wear import WearModel
from workflow.shell.analysis import Run
from workflow.shell.folders.cache import DiskStore
from workflow.shell.folders.steps import RunSteps, resumable_steps
from workflow.shell.terminal.reporter import Reporter


def run_wear(run: Run[WearCase]) -> None:
    """Run a wear case to its end, from the last stored state if it is to resume."""
    folder = run.folder
    report_choice(run.choice, run.reporter, again=run.resume)
    try:
        with ExitStack() as working:
            with resumable_steps(run) as steps:
                outcome, probe_results = _compute(run, working, steps)
            with one_thread():
                write_output(outcome, probe_results, run)
    except (ContactFailure, NormalContactError, MethodFailed) as error:
        remedy = f"; the state is stored, continue with `{folder.resume_command}`"
        raise MethodFailed(f"{error}{remedy if folder.checkpoint.exists() else ''}") from error
    except MotionError as error:
        raise UserError(
            "wear.motion: the surfaces move over each other, and the wear of body 1 depends on "
            "the place (evolution.scope: local), which wear steps cannot follow; allowed: "
            "motion: neglect, or scope: global"
        ) from error
    except MeshError as error:
        raise UserError(f"{folder.case}: structure: {error}") from error


def _compute(
    run: Run[WearCase], working: ExitStack, steps: RunSteps
) -> tuple[Outcome, ProbeResults]:
    """Return the outcome of the run before its files are written, and its probe runs.

    The contacts may solve their last cycles while the stress of the structure is computed;
    ``working`` keeps the workers until these results are in.
    """
    case, reporter = run.case, run.reporter
    reporter.warn_each(case.surface_warnings())
    model = wear_model(case)
    source = model.loads(DiskStore())
    faces = meshed_faces(case, source, reporter)
    for face in faces:
        check_section(case, face)
    with reporter.stage("contact set-up"):
        contacts = model.face_contacts(source)
    in_workers = _wears_in_workers(case, source)
    alone = contacts.stages if in_workers else ()
    workers = working.enter_context(contact_workers(alone))
    prepare_loads(source, reporter)
    probe_results = begin_probe_runs(case, model, source, run.worker)
    with one_thread():
        with reported_stage(reporter, source, "structural friction", "increments"):
            unworn = source.unworn()
        if isinstance(source, StructureLoads):
            assert isinstance(case, FiniteElementCase)
            _check_structure(case, source, reporter)
        if isinstance(case, ResultantsCase):
            warn_of_file(case, reporter)
        if in_workers:
            call = WorkerCalls(workers, sum(len(history.loads) for history in unworn))
            contacts = FaceContacts.half_spaces(contacts.stages, call)
        state, first = _march(run, model, source, contacts, unworn, steps)
        states = contacts.states(state)
        answers: Callable[[], list[ContactEnd]] = partial(contacts.call, last_cycle, states)
        if in_workers:
            answers = workers.begin(last_cycle, states)  # at once, while stress is computed here
        ends = _last_cycles(answers, working, len(faces))
    interfaces = interface_outcomes(model, contacts.stages, unworn, first, states, ends, state)
    return Outcome(case, model, source, state, interfaces), probe_results


def _last_cycles(
    answers: Callable[[], list[ContactEnd]], working: ExitStack, contacts: int
) -> list[Callable[[], ContactEnd]]:
    """Return one function per contact for its last cycle, safe to call from any thread.

    The first call waits for the results of all contacts and then ends the workers.
    """

    @cache
    def reported() -> list[ContactEnd]:
        with working:  # keeps the workers until then
            return answers()

    def tell(number: int) -> ContactEnd:
        with asking:
            return reported()[number]

    asking = Lock()
    return [partial(tell, number) for number in range(contacts)]


def _wears_in_workers(case: WearCase, source: LoadSource) -> bool:
    """Return whether contacts wear in workers; line contacts are faster than starting workers."""
    method = case.contact.method
    return method == "full" or (method == "normal" and not source.line)


def _march(
    run: Run[WearCase],
    model: WearModel,
    source: LoadSource,
    contacts: FaceContacts,
    unworn: Sequence[FaceLoads],
    steps: RunSteps,
) -> tuple[CoupledState[Any], list[FirstContact]]:
    """Return the final state, and the first contacts."""
    case, reporter, settings = run.case, run.reporter, model.settings(source)
    recorder = FileRecorder(run, settings, source.peak, contacts, source, steps)
    loop = model.loop(source, contacts, (RunLog(run, contacts, source), recorder))
    state, first = loop.begin(unworn)
    check_steps(settings, model.wear.fraction, state, first)
    warn_of_contact(case, source, contacts.faces(state), first, reporter)
    with reporter.course("wear"):
        end = loop.run(state, steps)
    steps.save()
    reporter.warn_each(friction_step_warnings(contacts.stages, first, end))
    warn_of_worn_cells(case, source.peak, contacts.faces(end), reporter)
    return end, first


def _check_structure(
    case: FiniteElementCase, structure: StructureLoads, reporter: Reporter
) -> None:
    """Report warnings about the structure, and check its nonlinearity if requested."""
    reporter.log(f"loads: {marched(structure.unworn_cycle)}")
    warn_of_structure(case, structure, reporter)
    if case.friction_evolves and case.recoupling.resultants == "constant":
        reporter.warn(
            WarningKind.FRICTION_KEPT,
            "friction.evolution: the structure keeps its first coefficient (coupling.resultants: "
            "constant)",
        )
    if structure.model.nonlinearity.check:
        with reporter.stage("nonlinearity check"):
            check = structure.nonlinear_check
        reporter.say(nonlinearity_sentence(check))


def meshed_faces(case: WearCase, source: LoadSource, reporter: Reporter) -> tuple[ContactFace, ...]:
    """Return the faces of a source of loads after checking the memory that the run needs."""
    with reporter.stage("mesh"):
        faces = source.faces
    if isinstance(source, StructureLoads):
        nodes, interface_nodes = source.node_count(), source.interface_count()
        structure_of(case).memory(case, nodes, interface_nodes).check()
    return faces
