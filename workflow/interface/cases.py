"""Cases from files, dictionaries and other cases."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from workflow import kinds
from workflow.case.plausibility import plausibility_warnings_of
from workflow.case.sections import Case
from workflow.case.source import IN_PYTHON, dotted
from workflow.case.text.leaves import taken
from workflow.case.text.writing import dump_case
from workflow.errors import CaseError
from workflow.shell.output.measured import check_measured

AnyCase = str | os.PathLike[str] | Mapping[str, Any] | Case
"""Case: the path of its file, its entries as nested dictionaries, or a loaded case."""

# Replaces the dots of a path where it is the name of an argument.
BETWEEN = "__"


def load_case(case: AnyCase, /, **overrides: Any) -> Case:
    """Read and check a case.

    A dictionary has the entries of a case file; values are numbers in the base units (N, mm, s,
    MPa, tonne) or texts with a unit, and relative file names start from the current folder. An
    override is an entry with ``__`` for each dot: ``wear__cycles=1e6`` corresponds to
    ``--set wear.cycles=1e6`` on the command line. Entries of lists, and entries whose names are not
    Python names, are passed as ``**{"load_path.0.P": "2 kN"}``.

    Returns the frozen case, with its entries as attributes in base units. Raises
    :class:`CaseError` with a line for each error, as on the command line.

    Examples
    --------
    >>> import fretscale
    >>> case = fretscale.load_case("cases/sphere_normal.yaml", friction__coefficient=0.6)
    >>> case.friction.coefficient
    0.6
    >>> try:
    ...     fretscale.load_case({"analysis": "fretting"})
    ... except fretscale.CaseError as error:
    ...     print(error)
    the case: analysis: 'fretting': not known; allowed: wear, contact, time, vibration
    """
    changes = [f"{key.replace(BETWEEN, '.')}={_text(value)}" for key, value in overrides.items()]
    if isinstance(case, str | os.PathLike):
        return kinds.load_case(os.fspath(case), changes)
    if isinstance(case, Mapping):
        return kinds.parse_case(json.dumps(_plain(case)), IN_PYTHON, changes)
    if type(case) in kinds.kinds(getattr(case, "analysis", None)).values():
        return kinds.parse_case(dump_case(case), IN_PYTHON, changes) if changes else case
    raise CaseError(
        f"{IN_PYTHON}: of type {type(case).__name__}; allowed: the path of a file, a dictionary, "
        "a case"
    )


@dataclass(frozen=True)
class Check:
    """Summary of what a case would run.

    ``title`` is the title of the case and ``outline`` has rows of name and text on what would run.
    ``memory`` is an upper estimate of the memory [bytes]. ``seconds`` is the order of magnitude of
    the run time [s]; ``time`` is the same as text, with what cannot be known before the run.
    ``plausibility_warnings`` name values that are probably mistakes.

    Examples
    --------
    Fields of the summary; printed, it is the output of ``fretscale check``:

    >>> import fretscale
    >>> checked = fretscale.check("cases/sphere_normal.yaml")
    >>> print(checked.title, checked.outline[1], checked.plausibility_warnings)
    Sphere pressed on a flat (Hertz) ('load path', '1 increment of P') ()
    """

    title: str
    outline: tuple[tuple[str, str], ...]
    memory: float
    seconds: float
    time: str
    plausibility_warnings: tuple[str, ...]

    def __str__(self) -> str:
        memory = f"up to {self.memory / 1e9:.1f} GB"
        rows = *self.outline, ("memory", memory), ("time", self.time)
        lines = [f"  {name:<10} {text}" for name, text in rows]
        return "\n".join(
            [self.title, *lines, *(f"warning: {warning}" for warning in self.plausibility_warnings)]
        )


def check(case: AnyCase, /, **overrides: Any) -> Check:
    """Return what a case would run, with its memory and run time, without computing anything.

    Takes the arguments of :func:`load_case`. Raises :class:`CaseError`, or :class:`OutOfMemory`
    where the machine has too little memory.

    Examples
    --------
    >>> import fretscale
    >>> checked = fretscale.check("cases/sphere_normal.yaml")
    >>> checked.seconds < 60.0
    True
    """
    loaded = load_case(case, **overrides)
    analysis = kinds.analysis_of(loaded)
    check_measured(loaded, analysis.curves, analysis.layout(loaded))
    memory, time = analysis.memory(loaded), analysis.run_time(loaded)
    memory.check()
    outline, plausibility_warnings = (
        (*loaded.outline(), *taken(loaded)),
        tuple(map(str, plausibility_warnings_of(loaded))),
    )
    return Check(
        loaded.title, outline, memory.required, time.seconds, time.text, plausibility_warnings
    )


def _text(value: object) -> str:
    """Return a value as a user would write it after ``--set key=``."""
    return value if isinstance(value, str) else json.dumps(_plain(value))


def _plain(value: Any, path: tuple[str | int, ...] = ()) -> Any:
    """Return a value with JSON types only; raise :class:`CaseError` for other types."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, Mapping):
        return {str(key): _plain(below, (*path, str(key))) for key, below in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(below, (*path, number)) for number, below in enumerate(value)]
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if hasattr(value, "tolist"):  # arrays and numbers of numpy
        return _plain(value.tolist(), path)
    raise CaseError(
        f"{IN_PYTHON}: {dotted(path)}: of type {type(value).__name__}; "
        "allowed: number, text, True, False, list, dictionary"
    )
