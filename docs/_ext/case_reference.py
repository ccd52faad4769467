"""Reference of case entries, generated from the models of the cases when the pages are built.

There is a page for every kind of case. Entries are listed under their section, and under each
variant of a section that has several: path, meaning with base unit, allowed values, default and
example. Nothing is written by hand: a new entry appears on its page with the next build.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from workflow.case.sections import Case, Section, entries_of, entry_of, sections_of
from workflow.case.text.explain import KINDS_ARE_NAMED_BY
from workflow.kinds import kinds

if TYPE_CHECKING:
    from sphinx.application import Sphinx

DEEPEST = 4  # level of headings; deeper sections list their entries under the last one


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the writing of the pages before Sphinx looks for sources."""
    app.connect("builder-inited", lambda app: write_pages(Path(app.srcdir) / "reference" / "cases"))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def write_pages(folder: Path) -> None:
    """Write a page for every kind of case; unchanged pages keep their modification time."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, model in kinds().items():
        page, text = folder / f"{name}.md", case_page(name, model)
        if not page.exists() or page.read_text(encoding="utf-8") != text:
            page.write_text(text, encoding="utf-8")


def case_page(name: str, model: type[Case]) -> str:
    """Return the page of one kind of case, in MyST."""
    words = " ".join((model.__doc__ or "").split())
    head = [f"# `{name}`", words, f"A commented case: `fretscale new {name} my.yaml`."]
    return "\n\n".join([*head, *section_blocks(model, "", 2)]) + "\n"


def section_blocks(model: type[Section], path: str, level: int) -> Iterator[str]:
    """Yield the entries of a section and its subsections as blocks of text."""
    inner = []
    for name, field in entries_of(model).items():
        full = f"{path}.{name}" if path else name
        if list(sections_of(field.annotation)):
            inner.append((full, field))
        else:
            yield leaf(full, field)
    for full, field in inner:
        yield from subsection_blocks(full, field, level)


def subsection_blocks(path: str, field: FieldInfo, level: int) -> Iterator[str]:
    """Yield a subsection, once for each of its variants."""
    models, marks = list(sections_of(field.annotation)), "#" * min(level, DEEPEST)
    many = "[]" if is_list(field.annotation) else ""
    yield f"{marks} `{path}{many}`"
    yield " ".join([sentence(field.description), *section_notes(field)])
    for model in models:
        if len(models) > 1:
            yield f"{'#' * min(level + 1, DEEPEST)} `{path}{many}` with {distinguished(model)}"
            yield " ".join((model.__doc__ or "").split())
        yield from section_blocks(model, path + many, level + 1 + (len(models) > 1))


def section_notes(field: FieldInfo) -> Iterator[str]:
    """Yield the notes on a section as a whole."""
    if entry := entry_of(field):
        yield f"Or {plain(entry.allowed)}."
    if words := list(words_in(field.annotation)):
        yield f"Or the word {', '.join(words)}."
    if not field.is_required() and field.default in (None, ()):
        yield "Optional."


def distinguished(model: type[Section]) -> str:
    """Return which entry selects this variant of a section."""
    named = [name for name in KINDS_ARE_NAMED_BY if name in model.model_fields]
    chosen = [f"`{name}: {word}`" for name in named for word in _word(model, name)]
    return " and ".join(chosen) or f"entries of {model.__name__}"


def _word(model: type[Section], name: str) -> tuple[str, ...]:
    """Return the only allowed word of entry ``name`` in this variant; none if it has a choice."""
    words = get_args(model.model_fields[name].annotation)
    return words if len(words) == 1 else ()


def leaf(path: str, field: FieldInfo) -> str:
    """Return one entry as an item of a definition list."""
    notes = [
        f"Allowed: {allowed(field)}." if allowed(field) else "",
        default(field),
        example(field),
    ]
    reported = " ".join(note for note in notes if note)
    return f"`{path}`\n: {sentence(field.description)}\n\n  {reported}"


def allowed(field: FieldInfo) -> str:
    """Return the allowed values of an entry."""
    annotation, entry = field.annotation, entry_of(field)
    words = ", ".join(f"`{word}`" for word in words_in(annotation))
    if annotation is bool:
        words = "`true`, `false`"
    texts = [plain(entry.allowed) if entry else "", words]
    text = ", or ".join(text for text in texts if text)
    return f"a list; each {text}" if is_list(annotation) and entry else text


def default(field: FieldInfo) -> str:
    """Return the value of an entry that is not given."""
    if field.is_required():
        return "Must be given."
    value = field.get_default(call_default_factory=True)
    if value is None or value == () or isinstance(value, BaseModel):
        return "Optional."
    return f"Default: `{written(value)}`."


def example(field: FieldInfo) -> str:
    """Return an example of an entry; entries with a choice of words need none."""
    if not field.examples or not entry_of(field):
        return ""
    return f"Example: `{written(field.examples[0])}`."


def words_in(annotation: object) -> Iterator[str]:
    """Yield the words of fixed choices in an annotation, at any depth except in sections."""
    if get_origin(annotation) is Literal:
        yield from (written(word) for word in get_args(annotation))
    else:
        for argument in get_args(annotation):
            yield from words_in(argument)


def is_list(annotation: object) -> bool:
    """Return whether an entry is a list, if it is given."""
    return get_origin(annotation) is tuple or any(is_list(a) for a in get_args(annotation))


def written(value: Any) -> str:
    """Return a value as a case file has it."""
    if isinstance(value, str):
        return value
    return json.dumps(value, ensure_ascii=False, default=str)


def sentence(text: str | None) -> str:
    """Return a description of a model as a sentence; words of a case in it keep their case."""
    return f"{plain(text or '')}."


def plain(text: str) -> str:
    """Return a text escaped so that Markdown shows it unchanged."""
    for sign in "\\*_<>$[]|":
        text = text.replace(sign, f"\\{sign}")
    return text
