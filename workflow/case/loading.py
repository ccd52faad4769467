"""A case file to a ``Case``, or to the lines that say why not."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pydantic import ValidationError

from workflow.case.explain import lines_about
from workflow.case.schema import Case
from workflow.case.source import Source, read_text
from workflow.errors import CaseError


def load_case(path: str | Path, overrides: Sequence[str] = ()) -> Case:
    """The case in file ``path``, with ``overrides`` such as ``"wear.cycles=1e4"`` on top.

    Raises ``CaseError`` with one line ``file:line: key: what is wrong; allowed: ...`` for each
    thing wrong, ``--set key=value`` in the place of file and line where an override is at fault.
    """
    return parse_case(read_text(Path(path)), str(path), overrides)


def parse_case(text: str, name: str, overrides: Sequence[str] = ()) -> Case:
    """As ``load_case``, from ``text``; ``name`` stands for the file in messages."""
    source = Source(name, text, overrides)
    try:
        return Case.model_validate(source.data)
    except ValidationError as error:
        raise CaseError("\n".join(lines_about(source, error.errors()))) from None
