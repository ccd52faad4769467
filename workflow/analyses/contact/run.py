"""Runs of contact cases: two bodies followed along their path of loads."""

from __future__ import annotations

import numpy as np

from sa_solver.contact_state import ContactState
from sa_solver.cycles.history import ContactLoadPath, History, HistoryError, march_history
from sa_solver.errors import ContactProblemError
from workflow.analyses.contact.bodies import bodies_of, half_space_of
from workflow.analyses.contact.case import BodiesCase, surface_warnings
from workflow.analyses.contact.output.results import (
    ContactOutcome,
    ContactRun,
    write_contact_output,
    write_contact_results,
)
from workflow.case.text.readable import percent
from workflow.errors import MethodFailed, UserError
from workflow.messages.warning_kinds import WarningKind
from workflow.models.checks.warnings import yield_warnings
from workflow.shell.few_cells import check_cells
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.terminal.reporter import Reporter


def run_contact(run: ContactRun) -> None:
    """Run a contact case to its end.

    Raises MethodFailed at an increment that does not converge or that no contact can carry; the
    increments before it are written. Raises UserError where ``contact.history`` does not suit the
    path, or the contact is smaller than the cells.
    """
    outcome, ended = _march(run.case, run.folder, run.reporter)
    if outcome.history.states:
        _warn(outcome, run.reporter)
    if ended is not None:
        kept = ""
        if outcome.history.states:
            write_contact_results(outcome, run)
            kept = f"; the increments so far are in {run.folder.results}"
        raise MethodFailed(f"{ended}{kept}") from ended
    _check_grid(outcome, run.reporter)
    write_contact_output(outcome, run)


def _march(
    case: BodiesCase, folder: OutputFolder, reporter: Reporter
) -> tuple[ContactOutcome, MethodFailed | None]:
    """Return the outcome of the path, and the error that ended it early, or None."""
    grid, table = case.contact.centred(), case.load_path.table()
    reporter.warn_each(surface_warnings(case.structure, grid))
    height, half_space = case.structure.gap_on(grid), half_space_of(case, grid)
    strain = table.bulk_strain(bodies_of(case))
    passed: dict[int, ContactState] = {}
    cost: list[int] = []
    ended: MethodFailed | None = None
    with reporter.course("contact"), reporter.stage("contact"):

        def keep(row: int, state: ContactState, share: float) -> None:
            if row in passed:
                passed.clear()  # the path is followed anew, in shorter increments
            passed[row] = state
            cost.append(state.convolutions)
            reporter.reached(share, f"increment {row + 1} of {len(table)}")
            reporter.log(
                f"increment {row + 1}: residual {state.residual:.1e}, "
                f"{state.convolutions} convolutions"
            )

        try:
            history = march_history(
                half_space,
                height,
                ContactLoadPath(table.imposed, table.is_motion, strain),
                case.friction.coefficient,
                history=case.contact.history,
                tolerance=case.contact.tolerance,
                hardness=case.contact.hardness,
                factor=case.friction.factor(),
                accuracy=case.contact.accuracy,
                progress=keep,
            )
        except HistoryError as error:
            raise UserError(f"{folder.case}: contact.history: {error}") from error
        except ContactProblemError as error:
            reached = max(passed, default=-1) + 1
            ended = MethodFailed(f"after increment {reached} of {len(table)}: {error}")
            ended.__cause__ = error
            history = History(list(passed.values()), list(passed), "full", "ended early")
        else:
            last, row = history.states[-1], history.indices[-1] + 1
            if not last.converged:
                ended = MethodFailed(
                    f"increment {row} of {len(table)} did not converge: {last.message}"
                )
    return ContactOutcome(case, grid, height, table, strain, history, sum(cost)), ended


def _check_grid(outcome: ContactOutcome, reporter: Reporter) -> None:
    """Raise UserError where even the largest contact is a point on the grid."""
    pressures = [state.traction[2] for state in outcome.history.states]
    largest = max(pressures, key=np.count_nonzero)
    settings = outcome.case.contact
    check_cells("the contact", settings, outcome.grid, largest, reporter, fixed=False)


def _warn(outcome: ContactOutcome, reporter: Reporter) -> None:
    """Warn of long increments, contacts cut off by the grid, and pressures above yield.

    Where yield is followed by a hardness, nothing is said about it.
    """
    states = outcome.history.states
    _warn_of_increments(outcome, reporter)
    if any(state.border_load > 0.0 for state in states):
        reporter.warn(
            WarningKind.CONTACT_AT_BORDER,
            "the contact touches the border of its grid and is cut off there: raise contact.size",
        )
    if outcome.case.contact.hardness is None:
        highest = max(float(state.traction[2].max()) for state in states)
        reporter.warn_each(yield_warnings(highest, bodies_of(outcome.case)))


def _warn_of_increments(outcome: ContactOutcome, reporter: Reporter) -> None:
    """Warn of long increments, by the errors of shear and energy that they cause."""
    history, case = outcome.history, outcome.case
    accuracy = case.contact.accuracy
    if history.error is None or history.energy_error is None:
        return
    place = case.load_path.place(history.error_at)
    left = []
    if history.energy_error > accuracy:
        left.append(f"{percent(history.energy_error)} of the dissipated energy")
    if history.error > accuracy:
        left.append(
            f"{percent(history.error)} of µP in the shear (largest at increment "
            f"{history.error_at + 1})"
        )
    if not left:
        return
    shorter = f"take more increments ({place}) or raise contact.accuracy"
    if history.method != "full":
        shorter = "take all increments (contact.history: full)"
    elif case.contact.history == "full":
        shorter = (
            f"take contact.history: auto, which splits increments, or more increments ({place})"
        )
    reporter.warn(
        WarningKind.LONG_INCREMENTS,
        f"the increments of the load cause errors of about {' and '.join(left)}, above "
        f"contact.accuracy of {percent(accuracy)}: {shorter}",
    )
