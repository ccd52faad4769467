"""What pydantic finds wrong, as one line: place, key, what is wrong, what is allowed."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from typing import Any, get_args

from pydantic_core import ErrorDetails

from workflow.case.fields import shown
from workflow.case.schema import Case, Section, sections_of
from workflow.case.source import KeyPath, Source, child, dotted, split_path

KINDS_ARE_NAMED_BY = ("kind", "law")  # keys that choose between sections

# What to say about pydantic's own errors, in the words of a case.
SENTENCES = {
    "literal_error": "not known; allowed: {expected}",
    "bool_type": "not a switch; allowed: true or false",
    "model_type": "not a section; allowed: entries below it, as key: value",
    "model_attributes_type": "not a section; allowed: entries below it, as key: value",
    "tuple_type": "not a list; allowed: such as [a, b]",
    "too_long": "too long; allowed: a list of {max_length}",
}


def lines_about(source: Source, errors: Iterable[ErrorDetails]) -> list[str]:
    """The lines of text about ``errors``, in the order of the file."""
    errors = list(errors)
    unknown = [_path(source, details) for details in errors if details["type"] == "extra_forbidden"]
    meant = {(*path[:-1], near) for path in unknown if (near := _nearest(source, path))}
    # A misspelt key is unknown and its right spelling missing; one line is enough.
    told = [d for d in errors if d["type"] != "missing" or _path(source, d) not in meant]
    return [line for _, line in sorted({_line_about(source, details) for details in told})]


def _line_about(source: Source, details: ErrorDetails) -> tuple[int, str]:
    """Line number, for sorting, and the line of text about one error."""
    path, message = _explain(source, details)
    number, place = source.where(path)
    key = dotted(path)
    if not key or place.startswith(f"--set {key}="):
        return number, f"{place}: {message}"
    return number, f"{place}: {key}: {message}"


def _explain(source: Source, details: ErrorDetails) -> tuple[KeyPath, str]:
    """Path of the entry to look at, and the sentence about it."""
    kind, value = details["type"], shown(details["input"])
    context: dict[str, Any] = details.get("ctx", {})
    path = _path(source, details)
    match kind:
        case "entry":
            return path, details["msg"]
        case "disagreement":
            return _disagreeing(source, path, context["keys"]), details["msg"]
        case "missing":
            return _missing(source, path)
        case "extra_forbidden":
            return path, _unknown(source, path)
        case "union_tag_not_found" | "union_tag_invalid":
            return _wrong_kind(source, path, context["discriminator"].strip("'"))
    sentence = SENTENCES[kind].format(**context) if kind in SENTENCES else details["msg"]
    return path, f"{value}: {sentence}"


def _disagreeing(source: Source, path: KeyPath, keys: Sequence[str]) -> KeyPath:
    """The entry to point at: one that an override has set, else the first."""
    paths = [(*path, *split_path(key)) for key in keys]
    overridden = [p for p in paths if source.is_override(p)]
    return (overridden or paths or [path])[0]


def _missing(source: Source, path: KeyPath) -> tuple[KeyPath, str]:
    *parent, key = path
    if isinstance(key, int):
        return tuple(parent), f"a list of {key}: too short; allowed: such as [a, b]"
    models = models_at(source, parent)
    field = next(m.model_fields[key] for m in models if key in m.model_fields)
    example = f", such as {field.examples[0]}" if field.examples else ""
    return path, f"missing; allowed: {field.description}{example}"


def _unknown(source: Source, path: KeyPath) -> str:
    near = _nearest(source, path)
    if near:
        return f"unknown key; did you mean '{near}'?"
    return f"unknown key; allowed: {', '.join(_known(source, path))}"


def _nearest(source: Source, path: KeyPath) -> str | None:
    """The known key that an unknown one at ``path`` resembles most."""
    near = difflib.get_close_matches(str(path[-1]), _known(source, path), n=1)
    return near[0] if near else None


def _known(source: Source, path: KeyPath) -> list[str]:
    """Every key allowed beside the one at ``path``."""
    models = models_at(source, path[:-1])
    return list(dict.fromkeys(name for model in models for name in model.model_fields))


def _wrong_kind(source: Source, path: KeyPath, key: str) -> tuple[KeyPath, str]:
    """A missing or unknown choice between kinds of section."""
    models = models_at(source, path)
    known = [kind for model in models for kind in get_args(model.model_fields[key].annotation)]
    value = source.at((*path, key))
    wrong = "missing" if value is None else f"{shown(value)}: not known"
    return (*path, key), f"{wrong}; allowed: {', '.join(known)}"


def models_at(source: Source, path: Iterable[str | int]) -> list[type[Section]]:
    """The models for the section at ``path``: of the kind it names, or of all kinds."""
    models: list[type[Section]] = [Case]
    node: Any = source.data
    for key in path:
        node = child(node, key)
        if isinstance(key, str):
            fields = [m.model_fields[key] for m in models if key in m.model_fields]
            models = [section for f in fields for section in sections_of(f.annotation)]
        models = [m for m in models if _is_kind(m, node)] or models
    return models


def _is_kind(model: type[Section], node: Any) -> bool:
    """Whether the kind or law that ``node`` names is that of ``model``."""
    choices = [name for name in KINDS_ARE_NAMED_BY if name in model.model_fields]
    return all(
        child(node, name) in get_args(model.model_fields[name].annotation) for name in choices
    )


def _path(source: Source, details: ErrorDetails) -> KeyPath:
    """Where an error is, without the kinds that pydantic puts in where it chose a section."""
    path: list[str | int] = []
    node: Any = source.data
    tag_seen = False
    loc = details["loc"]
    named = details["type"] in ("missing", "extra_forbidden")  # then the last part is a key
    for index, key in enumerate(loc):
        is_kind = key in [child(node, name) for name in KINDS_ARE_NAMED_BY]
        if is_kind and not tag_seen and not (named and index == len(loc) - 1):
            tag_seen = True
            continue
        path.append(key)
        node, tag_seen = child(node, key), False
    return tuple(path)
