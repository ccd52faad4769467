"""Error budget of a wear model: the parts of the error of every contact, together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from fe_models.solvers.blas_threads import one_thread
from sa_solver.transforms.threads import run_parallel
from sa_solver.types import Array
from wear.contact.face_loads import FaceLoads
from wear.contact.interface import FirstContact, InterfaceContact, InterfaceState
from wear.contact.tractions import CycleTractions
from wear.coupled_state import CoupledState, Observer, observed
from workflow.models.budget.names import PRESSURES, WORN
from workflow.models.budget.outcome import InterfaceOutcome
from workflow.models.budget.parts import PARTS, ContactErrors, ErrorByResult, ResultError
from workflow.models.budget.probe_models import Probed, ProbeModels, late, scaled
from workflow.models.contact import ContactEnd, FaceContact, FaceState, Wear, last_cycle
from workflow.models.loads import LoadSource
from workflow.models.structure_model import StructureStore
from workflow.models.uncoupled.body_pair import BodyPair
from workflow.models.wear import WearModel

# Powers of energy and pressure in a fretting parameter: Ruiz's is work times tension, that of
# Smith, Watson and Topper stress times strain, that of Findley a stress.
POWERS = {"ruiz": (1, 1), "smith_watson_topper": (0, 2), "findley": (0, 1)}


@dataclass(frozen=True)
class ErrorBudget:
    """Estimated errors of the main results of a wear model.

    Parameters
    ----------
    contacts : mapping of str to mapping of str to ResultError
        For each contact face, the error of each result by its parts.
    failures : mapping of str to str
        Parts that are unknown because their probe run failed, with the reason.
    """

    contacts: Mapping[str, Mapping[str, ResultError]]
    failures: Mapping[str, str] = field(default_factory=dict)

    def __str__(self) -> str:
        return "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        """Yield a table for each contact, with a line for each result."""
        for name, errors in self.contacts.items():
            parts = dict.fromkeys(part for error in errors.values() for part in error.parts)
            columns = [*parts, "total"]
            yield _row(name, columns)
            for result, error in errors.items():
                yield _row(result, [_text(error, column) for column in columns])
        for part, failure in self.failures.items():
            yield f"{part}: unknown, because a probe run failed: {failure}"


def _row(name: str, cells: Sequence[str]) -> str:
    return f"{name:<18}" + "".join(f"{cell:>11}" for cell in cells)


def _text(error: ResultError, part: str) -> str:
    """Return a part in percent, with a sign if it is known; a dash if the run has no such part."""
    numbers = error.numbers
    if part not in numbers:
        return "-"
    value = numbers[part]
    if value is None:
        return "unknown"
    return f"{100.0 * value:+.2f} %" if part in error.signed else f"{100.0 * value:.2f} %"


def error_budget(
    model: WearModel,
    observers: Sequence[Observer] = (),
    start: CoupledState[Any] | None = None,
    store: StructureStore | None = None,
) -> ErrorBudget:
    """Compute the wear of a model and estimate the error of its main results.

    Short probe runs on other meshes and grids find the errors due to these; the run itself
    knows the others. They are the errors that ``fretscale run`` writes to ``summary.json``.

    Parameters
    ----------
    model : WearModel
        The model.
    observers : sequence of Observer
        Called while the run goes on, such as :class:`fretscale.Progress`.
    start : CoupledState, optional
        State of an earlier run of the same model to resume from. After a run that has ended,
        such as that of a :class:`fretscale.Checkpoint`, only the errors are computed.
    store : StructureStore, optional
        Storage of condensed structures between runs.

    Returns
    -------
    ErrorBudget
        Its ``contacts`` have, by face and by result (``depth``, ``volume``, ``peak_pressure``,
        ``worn_peak_pressure`` and, with a parameter of fretting life, ``life``), the relative
        error by its ``parts`` and their ``total``: above 0 the result is too large, where the
        sign of a part is known (``signed``). A part is None if it is unknown. Printed, it is a
        table.

    Raises
    ------
    InputError
        The model does not fit together, or ``start`` is of another model.
    MethodFailed, ContactFailure
        A solver did not converge.

    Examples
    --------
    A ball that wears a flat, on few cells:

    >>> import fretscale
    >>> from sa_solver import Material
    >>> from wear import EnergyLaw
    >>> ball = fretscale.BodyPair(
    ...     gap=lambda x, y: (x**2 + y**2) / (2 * 10.0),
    ...     size=(0.6, 0.6),
    ...     loads=fretscale.LoadTable.stroke(P=50.0, stroke=0.02),
    ... )
    >>> titanium, law = Material(115e3, 0.29), EnergyLaw(1e-8)
    >>> contact = fretscale.Contact((32, 32), (titanium, titanium), (law, law), friction=0.6)
    >>> model = fretscale.WearModel(ball, contact, fretscale.Wear(cycles=5e3))
    >>> budget = fretscale.error_budget(model)
    >>> print(list(budget.contacts["interface"]["depth"].parts))
    ['increments', 'grid', 'steps', 'solver']
    """
    source = model.loads(store)
    source.prepare()
    with one_thread():
        unworn = source.unworn()
        contacts = model.face_contacts(source)
        loop = model.loop(source, contacts, observers)
        state, first = model.begin(loop, unworn, start)
        end = loop.run(state)
        states = contacts.states(end)
        ends = [partial(_same, of_face) for of_face in contacts.call(last_cycle, states)]
        interfaces = interface_outcomes(model, contacts.stages, unworn, first, states, ends, end)
        with observed(observers, "error budget"):
            probed = Probed()
            if not by_nodes(model, source):
                probes = ProbeModels.of(model, source)
                probed = probes.probed(source, lambda probe: probe.loads(store))
            errors = errors_of_contacts(model, source, end, interfaces, probed)
    return ErrorBudget(errors, probed.failures)


def _same(end: ContactEnd) -> ContactEnd:
    return end


def by_nodes(model: WearModel, source: LoadSource) -> bool:
    """Return whether the nodes of the structure wear, for which there are no probe runs."""
    return any(model.contact(face.face.name).method == "nodes" for face in source.faces)


def interface_outcomes(
    model: WearModel,
    stages: Sequence[FaceContact],
    unworn: Sequence[FaceLoads],
    first: Sequence[FirstContact],
    states: Sequence[FaceState],
    ends: Sequence[Any],
    end: CoupledState[Any],
) -> list[InterfaceOutcome]:
    """Return the outcome of every contact, from its columns and the state of the loop at the end.

    ``ends`` are functions that return the last cycle of each contact.
    """
    finer = partial(finer_cycles, model)
    columns = zip(stages, unworn, first, states, ends, strict=True)
    return [
        InterfaceOutcome(*column, end.cycles, end.kinetics[:, number], finer)
        for number, column in enumerate(columns)
    ]


def finer_cycles(model: WearModel, state: InterfaceState) -> list[CycleTractions] | None:
    """Return the unworn cycle and that on the surfaces of ``state``, in twice as many increments.

    Returns None where loads between increments, or slips due to friction, are unknown. Raises
    ContactFailure.
    """
    bodies = model.structure
    if not isinstance(bodies, BodyPair) or model.contact(bodies.name).method != "full":
        return None
    settings = model.contact(bodies.name)
    source = bodies.in_parts(2).source(settings)
    (face,), (loads,) = source.faces, source.unworn()
    contact = FaceContact(face, settings, model.wear, InterfaceContact).contact
    unworn, first = contact.begin(loads, model.wear.cycles)
    worn = replace(unworn, surfaces=state.surfaces, energy=state.energy, starts={}, start=None)
    return [contact.unworn_tractions(loads, first), contact.tractions(worn)]


def errors_of_contacts(
    model: WearModel,
    source: LoadSource,
    state: CoupledState[Any],
    interfaces: Sequence[InterfaceOutcome],
    probed: Probed,
) -> dict[str, dict[str, ResultError]]:
    """Return the errors of the main results by interface, each by its sources."""
    by_part = dict(probed.errors)
    if "coupling" in by_part:
        lag = late(probed.rate, followed(model.wear, state))
        by_part["coupling"] = {
            name: scaled(numbers, lag) for name, numbers in by_part["coupling"].items()
        }
    contacts = {
        contact.stage.name: ContactErrors(
            model,
            source,
            contact,
            {part: by_name[contact.stage.name] for part, by_name in by_part.items()},
        )
        for contact in interfaces
    }
    errors = run_parallel([partial(errors_of, contact) for contact in contacts.values()])
    return dict(zip(contacts, errors, strict=True))


def errors_of(contact: ContactErrors) -> dict[str, ResultError]:
    """Return the errors of the results of one contact."""
    parts: dict[str, ErrorByResult] = {}
    for name, part in PARTS.items():
        if (by_result := part.errors(contact)) is not None:
            parts[name] = by_result
    errors = {result: _error(parts, result) for result in (*WORN, *PRESSURES)}
    stress = contact.model.stress
    if stress is not None and stress.parameter in POWERS:
        of_work, of_stress = POWERS[stress.parameter]
        work, pressure = errors["depth"].parts, errors["worn_peak_pressure"].parts
        errors["life"] = ResultError(
            {part: _sum(of_work, work[part], of_stress, pressure.get(part, 0.0)) for part in work}
        )
    return errors


def _error(parts: dict[str, ErrorByResult], result: str) -> ResultError:
    """Return the error of a result, without the sign of parts whose sign is unknown."""
    known = {part: by_result[result] for part, by_result in parts.items() if result in by_result}
    signed = frozenset(part for part in PARTS if result in PARTS[part].signed)
    return ResultError(
        {
            part: value if value is None or part in signed else abs(value)
            for part, value in known.items()
        },
        signed,
    )


def _sum(n: int, first: float | None, m: int, second: float | None) -> float | None:
    """Return ``n`` times one part plus ``m`` times another, or None if one of them is unknown."""
    if (n and first is None) or (m and second is None):
        return None
    return n * abs(first or 0.0) + m * abs(second or 0.0)


def followed(wear: Wear, state: CoupledState[Any]) -> Array:
    """Return shares of the run's cycles from one structural solution to the next, or the end."""
    solved = {
        "constant": np.zeros(len(state.cycles), dtype=bool),
        "every": np.ones(len(state.cycles), dtype=bool),
        "drift": state.drift > wear.drift,
    }[wear.resultants]
    end = float(state.cycles[-1])
    shares = np.diff([0.0, *state.cycles[solved], end]) / end if end > 0.0 else np.ones(1)
    return np.asarray(shares[shares > 0.0])
