"""Error budget of a finished run, with its probe runs in a worker process."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from sa_solver.types import Progress, unseen
from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.output.outcome import Outcome
from workflow.models.budget.budget import by_nodes, errors_of_contacts
from workflow.models.budget.parts import ResultError
from workflow.models.budget.probe_models import Probed, ProbeModels
from workflow.models.loads import LoadSource
from workflow.models.structure import StructureLoads
from workflow.models.wear import WearModel
from workflow.shell.folders.cache import DiskStore
from workflow.shell.processes import WorkerProcess
from workflow.shell.terminal.reporter import Reporter

ProbeResults = Callable[[Progress], Probed]


def error_budget(
    outcome: Outcome, reporter: Reporter, probe_results: ProbeResults
) -> dict[str, dict[str, ResultError]]:
    """Return the errors of the main results by interface, each by its sources."""
    with reporter.stage("error budget", "probe runs") as progress:
        probed = probe_results(progress)
        for part, failure in probed.failures.items():
            reporter.log(f"error budget: {part} unknown, because a probe run failed: {failure}")
        return errors_of_contacts(
            outcome.model, outcome.source, outcome.state, outcome.interfaces, probed
        )


def begin_probe_runs(
    case: WearCase, model: WearModel, source: LoadSource, worker: WorkerProcess
) -> ProbeResults:
    """Return a function for the errors from probe runs; none if the case requests no probe runs.

    Probe runs start at once in a worker process, unless this needs a copy of a large structure:
    then they start when the function is called.
    """
    if case.error_budget == "known" or by_nodes(model, source):
        return lambda _: Probed()
    probes = ProbeModels.of(model, source)
    arguments = probes, source if probes.same else None
    if probes.same and not (source.line and isinstance(source, StructureLoads)):
        return partial(_probed, *arguments)
    answer = worker.begin(_probed, *arguments)
    return lambda _: answer()


def _probed(probes: ProbeModels, source: LoadSource | None, progress: Progress = unseen) -> Probed:
    """Return the errors from the probe runs; ``source`` is that of the model of the run."""
    return probes.probed(source, lambda model: model.loads(DiskStore()), progress)
