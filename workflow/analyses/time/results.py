"""Output of a case in time: results, tables, figures and the summary."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from workflow.analyses.time.case import JointCase, RigCase, TimeCase, joules
from workflow.analyses.time.outcome import LAYOUT, State, TimeOutcome
from workflow.case.fields import in_unit_of
from workflow.messages.warning_kinds import WarningKind
from workflow.shell.analysis import Run
from workflow.shell.output.results import run_results
from workflow.shell.output.summary import finish, number_at
from workflow.shell.terminal.reporter import Reporter

TimeRun = Run[JointCase | RigCase]


def write_time_output(outcome: TimeOutcome, run: TimeRun) -> None:
    """Write all files of a finished run; the summary comes last and marks it as finished."""
    reporter = run.reporter
    with reporter.stage("results"):
        _write_results(outcome, run)
    run.draw(outcome.contents)
    summary = _summary(outcome, reporter)
    finish(run, summary, _lines(summary, outcome.case))


# --- results and tables -------------------------------------------------------------------------


def _write_results(outcome: TimeOutcome, run: TimeRun) -> None:
    """Write results, and as CSV the evolution and the curves of every state but motions."""
    case, folder = outcome.case, run.folder
    attributes = {"analysis": case.analysis, "law": case.joint.law, "seen": outcome.seen or None}
    with run_results(run, case, LAYOUT, attributes) as writer:
        writer.put_contents(outcome.contents)
        what = "parameters of the joint over the energy it has dissipated"
        writer.put_table(folder.reserve("evolution.csv", what), "evolution", outcome.evolution)
        for number, state in enumerate(outcome.states):
            place = f"states/{number:05d}"
            scalars = {k: v for k, v in state.numbers.items() if isinstance(v, int | float | list)}
            parameters = {"energy": state.energy, "cycles": state.cycles, **state.parameters}
            writer.put(place, {}, **(parameters | scalars))
            for group, curves in state.curves.items():
                if group == "motion":
                    writer.put(f"{place}/{group}", curves)
                    continue
                what = f"{group.replace('_', ' ')} at {joules(state.energy)}"
                path = folder.reserve(f"{group}_{number:05d}.csv", what)
                writer.put_table(path, f"{place}/{group}", curves)


# --- summary ------------------------------------------------------------------------------------


def _summary(outcome: TimeOutcome, reporter: Reporter) -> dict[str, Any]:
    case = outcome.case
    summary: dict[str, Any] = {
        "law": case.joint.law,
        **outcome.numbers,
        "states": [_state_summary(state) for state in outcome.states],
    }
    reported = []
    for entry in case.reported:
        computed = number_at(summary, entry.quantity)
        if computed is None:
            reporter.warn(
                WarningKind.NOT_COMPARED, f"reported: no quantity {entry.quantity} in summary.json"
            )
        comparison = {"quantity": entry.quantity, "reported": entry.value, "computed": computed}
        reported.append(comparison | {"source": entry.source})
    return summary | {"reported": reported}


def _state_summary(state: State) -> dict[str, Any]:
    cycles = {} if state.cycles is None else {"cycles": state.cycles}
    return {"energy": state.energy, **cycles, **state.parameters, **state.numbers}


def _lines(summary: dict[str, Any], case: TimeCase) -> Iterator[str]:
    """Yield lines on the results, for the end of the run."""
    for state in summary["states"]:
        yield f"  {_state_line(state)}"
    for entry, messages in zip(summary["reported"], case.reported, strict=True):
        yield (
            f"  {entry['quantity']}: {_shown(entry['computed'], messages.value)} computed, "
            f"{_shown(entry['reported'], messages.value)} reported ({entry['source']})"
        )


def _shown(value: float | None, written: float) -> str:
    """Return a value as text, in the unit that another was written in."""
    if value is None:
        return "none"
    number, unit = in_unit_of(written, value)
    return f"{number:.5g} {unit}".rstrip()


def _state_line(state: Mapping[str, Any]) -> str:
    """Return a state as one line of text."""
    parts = [f"{1e-3 * state['energy']:.5g} J"]
    if "cycles" in state:
        parts.append(f"{state['cycles']:.6g} cycles")
    parts.append(f"mu {state['friction']:.4g}, kt {1e-3 * state['stiffness']:.4g} N/um")
    if "energy_per_cycle" in state:
        parts.append(f"{state['energy_per_cycle']:.4g} mJ a cycle")
    if "stroke" in state:
        parts.append(f"stroke {1e3 * state['stroke']:.4g} um")
    for name in ("first", "second"):
        if f"{name}_frequency" in state:
            hertz, peak = state[f"{name}_frequency"], 1e-3 * state[f"{name}_peak"]
            parts.append(f"{name} peak {peak:.3g} m/s^2/N at {hertz:.4g} Hz")
    return ", ".join(parts)
