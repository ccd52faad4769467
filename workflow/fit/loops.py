"""``fit: joint_law``: a joint law from measured loops, fitted to all steps of equal stroke."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sa_solver.types import Array
from wear.fitting import FitError, LoopData, fit, loop_data, loop_problem
from wear.fitting.loop_samples import MOST_LOOPS
from wear.joints.measured.loop_record import MeasuredLoopError
from wear.joints.measured.measured_loops import ALIKE, MeasuredLoops, measure_loops
from workflow.case.files.loop_file import account, read_loop_file
from workflow.errors import UserError
from workflow.fit.fitting import DISPLACEMENT, JOINT_UNITS, Fitted, FittedSeries, solved
from workflow.fit.measured import MeasuredColumn
from workflow.fit.schema import FREE, FitInput, LoopFitSection, LoopMeasurement
from workflow.messages.warning_kinds import Notice, WarningKind
from workflow.pictures.scales import TO_MICRONS


def fit_loops(given: FitInput, file: LoopFitSection) -> Fitted:
    """Fit a joint law to loops; raise as :func:`workflow.fit.running.run_fit`."""
    entries = file.joint.model_dump(exclude={"law"})
    # NaN stands for the normal load of each record.
    entries["normal_load"] = np.nan if file.joint.normal_load is None else entries["normal_load"]
    held = {key: float(value) for key, value in entries.items() if value != FREE}
    names = [_loop_name(file, number) for number in range(1, len(file.measurements) + 1)]
    loops: list[LoopData] = []
    reported, plausibility_warnings = [], list[Notice]()
    for name, one in zip(names, file.measurements, strict=True):
        measured = _measured(one)
        steps = _fitted_steps(measured)
        try:
            loops += [loop_data(name, step, MOST_LOOPS // len(steps)) for step in steps]
        except MeasuredLoopError as error:
            raise UserError(f"{one.file}: {error}") from error
        reported.append(f"{Path(one.file).name}: {account(measured)}")
        plausibility_warnings += [
            Notice(kind, f"{Path(one.file).name}: {text}")
            for kind, text in _warnings_about(measured, len(steps))
        ]
    try:
        problem = loop_problem(loops, file.joint.law, held)
        fitted = fit(problem.problem)
    except FitError as error:
        raise UserError(f"{given.name}: {error}") from error
    series = [
        FittedSeries(
            name,
            "N",
            _loop_column([loop for loop in loops if loop.name == name], one.file, number),
            DISPLACEMENT,
            lambda _, name=name: lambda values: problem.record(name, values),  # type: ignore[misc]
        )
        for number, (name, one) in enumerate(zip(names, file.measurements, strict=True))
    ]
    asked = [unknown for unknown in problem.problem.unknowns if not unknown.nuisance]
    return solved(
        given,
        fitted,
        [_loop_path(one.name) for one in asked],
        series,
        plausibility_warnings,
        reported,
    )


def _measured(one: LoopMeasurement) -> MeasuredLoops:
    """Return the loops of a record; raise UserError if it has none."""
    names = {k: v for k, v in one.columns.model_dump().items() if v is not None}
    record = read_loop_file(Path(one.file), names)
    columns = (record.get("normal_load"), record.get("time"))
    try:
        return measure_loops(record["displacement"], record["force"], *columns)
    except MeasuredLoopError as error:
        raise UserError(f"{one.file}: {error}") from error


def _fitted_steps(measured: MeasuredLoops) -> list[MeasuredLoops]:
    """Return all steps of a record, or some of them from the first to the last."""
    steps = measured.steps
    count = min(len(steps), MOST_LOOPS)
    return [steps[place] for place in np.linspace(0, len(steps) - 1, count).round().astype(int)]


def _warnings_about(measured: MeasuredLoops, fitted: int) -> list[Notice]:
    """Return warnings about steps of a record that no single law can describe."""
    steps, plausibility_warnings = measured.steps, list[Notice]()
    if fitted < len(steps):
        plausibility_warnings.append(
            Notice(
                WarningKind.DATA_LEFT_OUT,
                f"{fitted} of {len(steps)} steps of similar loops are fitted, from the first to "
                "the last",
            )
        )
    strokes = np.array([step.stroke.mean() for step in steps])
    forces = np.array([step.force.mean() for step in steps])
    energies = np.array([step.energy.mean() for step in steps])
    loads = np.array([step.normal_load.mean() for step in steps])
    same = np.abs(np.diff(strokes)) <= ALIKE * strokes[1:]
    same &= ~(np.abs(np.diff(loads)) > ALIKE * loads[1:])
    if same.any():
        first = int(np.flatnonzero(same)[0])
        last = first + 1 + int(np.flatnonzero(same)[-1]) - first
        plausibility_warnings.append(
            Notice(
                WarningKind.CHANGING_LOOPS,
                f"loops of one stroke change, from {forces[first]:.4g} N and {energies[first]:.4g} "
                f"mJ to {forces[last]:.4g} N and {energies[last]:.4g} mJ: the joint wears or runs "
                "in, and one law is a mean of its states; fit parts of the record separately",
            )
        )
    return plausibility_warnings


def _loop_name(file: LoopFitSection, number: int) -> str:
    return "force" if len(file.measurements) == 1 else f"force_{number}"


def _loop_column(loops: Sequence[LoopData], file: str, number: int) -> MeasuredColumn:
    """Return the loops of a record as a column, with places named by stroke and displacement."""
    name = Path(file).name
    places = tuple(
        f"{name}, stroke of {2.0 * TO_MICRONS * loop.amplitude:.3g} um, at {TO_MICRONS * x:.3g} um"
        for loop in loops
        for x in loop.displacement
    )
    motion = np.concatenate([loop.displacement for loop in loops])
    loads: Array = np.repeat(
        [loop.normal_load for loop in loops], [len(loop.force) for loop in loops]
    )
    force = np.concatenate([loop.force for loop in loops])
    files = np.full(len(force), number)
    return MeasuredColumn(motion, force, None, {"normal_load": loads}, places, files)


def _loop_path(name: str) -> tuple[str, str]:
    """Return path and unit of a parameter of :func:`loop_problem`."""
    of, _, parameter = name.rpartition(".")
    return (f"{of}.{parameter}", "N") if of else (f"joint.{name}", JOINT_UNITS.get(name, "1"))
