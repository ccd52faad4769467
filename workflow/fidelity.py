"""The cheapest model that meets the accuracy that a case asks for (``fidelity: auto``).

Every axis along which a model can be cheaper is a function here that looks at the case, probes if
it must, and returns a decision. Axes are decided one after the other, each on the case that the
earlier ones left.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any, TypeVar

from workflow.case import Case, DovetailCase
from workflow.case.sections import Section
from workflow.folder import OutputFolder
from workflow.reporter import Reporter

# Kept among what a run needs until it is finished, so that one that is resumed knows it.
RECORD = "fidelity.json"


@dataclass(frozen=True)
class Decision:
    """What one axis chose: ``value`` of the dotted ``entry``, ``why``, and the ``probe``'s numbers.

    Probes are those that the case's accuracy was held against.
    """

    entry: str
    value: Any
    why: str
    probe: dict[str, Any] = field(default_factory=dict)


Chosen = TypeVar("Chosen", bound=Section)
Axis = Callable[[DovetailCase], Decision]


def choose(case: Case) -> tuple[Case, dict[str, Any] | None]:
    """The case to run, and a record of what was chosen and why; None where nothing is to choose."""
    if not isinstance(case, DovetailCase) or case.fidelity == "fixed":
        return case, None
    begin = time.perf_counter()
    decisions = []
    for axis in _axes():
        decision = axis(case)
        case = _changed(case, decision.entry.split("."), decision.value)
        decisions.append(decision)
    return case, {
        "accuracy": case.accuracy,
        "chosen": {decision.entry: decision.value for decision in decisions},
        "decisions": [asdict(decision) for decision in decisions],
        "seconds": round(time.perf_counter() - begin, 2),
    }


def _axes() -> tuple[Axis, ...]:
    # Imported here: a case whose settings stand as written needs no finite elements for this.
    from workflow.dimension import choose_dimension

    return (choose_dimension,)


def _changed(section: Chosen, path: list[str], value: Any) -> Chosen:
    """The section with another value of an entry; the axes know which values go together."""
    name, *rest = path
    if rest:
        value = _changed(getattr(section, name), rest, value)
    return section.model_copy(update={name: value})


def keep(folder: OutputFolder, record: dict[str, Any] | None) -> None:
    """Keep the record with the run until it is finished."""
    if record is not None:
        (folder.jumps / RECORD).write_text(json.dumps(record), encoding="utf-8")


def kept(folder: OutputFolder) -> dict[str, Any] | None:
    """The record of a run that is not finished yet; None where nothing was chosen."""
    path = folder.jumps / RECORD
    record: dict[str, Any] | None = None
    if path.exists():
        record = json.loads(path.read_text(encoding="utf-8"))
    return record


def say(record: dict[str, Any] | None, reporter: Reporter) -> None:
    """What was chosen and why, a line for each axis."""
    for decision in record["decisions"] if record else ():
        reporter.say(f"fidelity: {decision['entry']}: {decision['value']}: {decision['why']}")
