"""Description of an approximation: its settings from coarse to fine, and its error estimate."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from workflow.case.sections import Case

if TYPE_CHECKING:
    from workflow.analyses.wear.choice import Decision

Settings = Mapping[str, Any]
"""Values of a case by their dotted entries."""


@dataclass(frozen=True)
class Rung:
    """One setting: ``name`` identifies it on its ladder, ``branch`` is the line that it belongs to.

    ``step`` goes to zero with the error, in any unit; None where nothing converges. ``of_limit`` is
    the ratio of an explicit step to its stability limit.
    """

    name: str
    settings: Settings = field(default_factory=dict)
    step: float | None = None
    branch: str = ""
    of_limit: float | None = None

    @property
    def overrides(self) -> tuple[str, ...]:
        """Settings as ``--set`` takes them."""
        return overrides_of(self.settings)


@dataclass(frozen=True)
class Remedy:
    """The ``setting`` that reduces a ``part`` of the error budget."""

    part: str
    setting: str


@dataclass(frozen=True)
class Approximation:
    """A named approximation of the model or of its numerical solution.

    Attributes
    ----------
    name, what
        Name of the approximation, for ``--axis``, and what it is.
    ladder
        Yields the settings of a case from coarse to fine; the last is the reference for all.
    entries
        Entries of which a case with this approximation has one; the first is its main setting.
    order
        Highest order of convergence that an estimate assumes; None for a choice whose last rung is
        right by definition.
    closed_form
        Whether the ladder ends at an exact solution where there is one.
    moves_states
        Whether the rungs compute different increments.
    sections
        Whether the middle of the faces is compared, per length.
    decide
        Chooses the cheapest setting of a dovetail, given the case with earlier decisions and the
        error that the setting may cause; None if ``fidelity: auto`` keeps the setting.
    remedy
        What reduces its part of the error budget, if the budget has one.
    """

    name: str
    what: str
    ladder: Callable[[Case], Iterator[Rung]]
    entries: tuple[str, ...] = ()
    order: float | None = None
    closed_form: bool = False
    moves_states: bool = False
    sections: bool = False
    decide: Callable[[Any, float], Decision] | None = None
    remedy: Remedy | None = None

    def rungs(self, case: Case) -> Iterator[Rung]:
        """Return the settings of a case from coarse to fine, none if it lacks the entries."""
        if all(entry_at(case, entry) is None for entry in self.entries):
            return iter(())
        return self.ladder(case)


def entry_at(case: Case, path: str) -> Any:
    """Return the entry at a dotted path, None where this kind of case has none."""
    node: Any = case
    for key in path.split("."):
        node = getattr(node, key, None)
    return node


def overrides_of(settings: Settings) -> tuple[str, ...]:
    """Return settings as ``--set`` takes them."""
    return tuple(f"{entry}={_text(value)}" for entry, value in settings.items())


def _text(value: Any) -> str:
    """Return a value as YAML in one line."""
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key}: {_text(inner)}' for key, inner in value.items())}}}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return f"[{', '.join(map(_text, value))}]"
    return "null" if value is None else str(value)
