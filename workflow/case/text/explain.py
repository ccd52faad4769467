"""Validation errors of pydantic as one line each: place, key, what is wrong, what is allowed."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from typing import Any, get_args

from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from workflow.case.fields import shown
from workflow.case.sections import KINDS_ARE_NAMED_BY, Section, sections_of
from workflow.case.source import KeyPath, Source, child, dotted, split_path
from workflow.case.text.writing import scalar

# The key of KINDS_ARE_NAMED_BY that a section inherits from the section around it.
INHERITED = "law"

# Largest number of lines about one text: the same mistake is often repeated in many places.
MOST_LINES = 20

# Sentences that replace pydantic's own messages, in the terms of a case.
SENTENCES = {
    "literal_error": "not known; allowed: {expected}",
    "bool_type": "not a switch; allowed: true or false",
    "model_type": "not a section; allowed: entries below it, as key: value",
    "model_attributes_type": "not a section; allowed: entries below it, as key: value",
    "tuple_type": "not a list; allowed: a list",
    "too_long": "too long; allowed: a list of {max_length}",
    "too_short": "too short; allowed: a list of at least {min_length}",
}
LISTS = ("tuple_type", "too_long", "too_short")


class Explanation:
    """Explanations of the validation errors of one text, read as one kind of case."""

    def __init__(self, source: Source, case: type[Section]) -> None:
        self.source, self.case = source, case

    def lines(self, errors: Sequence[ErrorDetails]) -> list[str]:
        """Return the lines about ``errors`` in the order of the file, ``MOST_LINES`` at most."""
        errors = [details for details in errors if not _only_follows(details)]
        by_line = sorted(errors, key=lambda details: self.source.where(self._path(details))[0])
        errors, left = by_line[:MOST_LINES], len(by_line[MOST_LINES:])
        unknown = [
            self._path(details) for details in errors if details["type"] == "extra_forbidden"
        ]
        meant = {(*path[:-1], near) for path in unknown if (near := self._nearest(path))}
        # A misspelt key is reported as unknown and its right spelling as missing; one line is
        # enough.
        reported = [d for d in errors if d["type"] != "missing" or self._path(d) not in meant]
        lines = [line for _, line in sorted({self._line_about(details) for details in reported})]
        return [*lines, f"{self.source.name}: and {left} more errors"] if left else lines

    def _line_about(self, details: ErrorDetails) -> tuple[int, str]:
        """Return the line number, for sorting, and the line of text about one error."""
        path, message = self._explain(details)
        number, place = self.source.where(path)
        key = dotted(path)
        if not key or place.startswith(f"--set {key}="):
            return number, f"{place}: {message}"
        return number, f"{place}: {key}: {message}"

    def _explain(self, details: ErrorDetails) -> tuple[KeyPath, str]:
        """Return the path of the entry to look at, and the sentence about the error."""
        kind, value = details["type"], shown(details["input"])
        context: dict[str, Any] = details.get("ctx", {})
        path = self._path(details)
        match kind:
            case "entry":
                return path, details["msg"]
            case "disagreement":
                return self._disagreeing(path, context["keys"]), details["msg"]
            case "missing":
                return self._missing(path, details["input"])
            case "extra_forbidden":
                return path, self._unknown(path)
            case "union_tag_not_found" | "union_tag_invalid":
                return self._wrong_kind(path, context["discriminator"].strip("'"))
        sentence = SENTENCES[kind].format(**context) if kind in SENTENCES else details["msg"]
        example = self._example(path) if kind in LISTS else ""
        return path, f"{value}: {sentence}{example}"

    def _disagreeing(self, path: KeyPath, keys: Sequence[str]) -> KeyPath:
        """Return the path of the entry to point at: one set by an override, else the first."""
        paths = [(*path, *split_path(key)) for key in keys]
        overridden = [p for p in paths if self.source.is_override(p)]
        return (overridden or paths or [path])[0]

    def _missing(self, path: KeyPath, given: Any) -> tuple[KeyPath, str]:
        """Return the place and the sentence, which is the same for all missing items of a list."""
        *parent, key = path
        if isinstance(key, int):
            place = tuple(parent)
            longer = f"a longer one{self._example(place)}"
            return place, f"a list of {len(given)}: too short; allowed: {longer}"
        field = self._field_at(path)
        assert field is not None
        return path, f"missing; allowed: {field.description}{self._example(path)}"

    def _field_at(self, path: KeyPath) -> FieldInfo | None:
        *parent, key = path
        models = self._models_at(parent)
        fields = [m.model_fields[key] for m in models if key in m.model_fields]
        return fields[0] if fields else None

    def _example(self, path: KeyPath) -> str:
        """Return an example of the entry at a path, or the keys of the section at that path."""
        field = self._field_at(path)
        if field is None:
            return ""
        if field.examples:
            hinted = "such as" in (field.description or "")
            return "" if hinted else f", such as {scalar(field.examples[0])}"
        sections = list(sections_of(field.annotation))
        if not sections:
            return ""
        fields = sections[0].model_fields
        asked = [name for name, below in fields.items() if below.is_required()] or list(fields)
        return f", with {', '.join(asked)} below it"

    def _unknown(self, path: KeyPath) -> str:
        for model in self._models_at(path[:-1]):
            if hinted := model.refused.get(str(path[-1])):
                return hinted
        near = self._nearest(path)
        if near:
            return f"unknown key; did you mean '{near}'?"
        return f"unknown key; allowed: {', '.join(self._known(path))}"

    def _nearest(self, path: KeyPath) -> str | None:
        """Return the known key that resembles the unknown key at ``path`` most."""
        near = difflib.get_close_matches(str(path[-1]), self._known(path), n=1)
        return near[0] if near else None

    def _known(self, path: KeyPath) -> list[str]:
        """Return all keys that are allowed in the section that contains ``path``."""
        models = self._models_at(path[:-1])
        return list(dict.fromkeys(name for model in models for name in model.model_fields))

    def _wrong_kind(self, path: KeyPath, key: str) -> tuple[KeyPath, str]:
        """Explain a missing or unknown choice between kinds of section."""
        models = self._models_at(path)
        known = [kind for model in models for kind in get_args(model.model_fields[key].annotation)]
        value = self.source.at((*path, key))
        wrong = "missing" if value is None else f"{shown(value)}: not known"
        return (*path, key), f"{wrong}; allowed: {', '.join(known)}"

    def _models_at(self, path: Iterable[str | int]) -> list[type[Section]]:
        """Return the models for the section at ``path``: of the kind it names, or of all kinds."""
        node: Any = self.source.data
        models: list[type[Section]] = [self.case]
        for key in path:
            node = _within(node, key)
            if isinstance(key, str):
                fields = [m.model_fields[key] for m in models if key in m.model_fields]
                models = [section for f in fields for section in sections_of(f.annotation)]
            fitting = [m for m in models if _is_kind(m, node)]
            # Where kinds are known by their keys, the first is chosen, as in reading a case.
            models = fitting[:1] if fitting and fitting[0].known_by else fitting or models
        return models

    def _path(self, details: ErrorDetails) -> KeyPath:
        """Return the path of an error without the kinds that pydantic inserts."""
        path: list[str | int] = []
        node: Any = self.source.data
        tag_seen = False
        loc, last = details["loc"], len(details["loc"]) - 1
        # For these errors the last part is a key, even if it has the same name as a kind.
        named = details["type"] in ("missing", "extra_forbidden", "entry")
        for index, key in enumerate(loc):
            is_kind = key in [child(node, name) for name in KINDS_ARE_NAMED_BY]
            if is_kind and not tag_seen and not (named and index == last):
                tag_seen = True
                continue
            # A tag that fretscale adds, such as (section).
            if isinstance(key, str) and key.startswith("(") and not (named and index == last):
                continue
            path.append(key)
            node, tag_seen = _within(node, key), False
        return tuple(path)


def _only_follows(details: ErrorDetails) -> bool:
    """Return whether a list is too short only because of wrong items, which are reported."""
    given = details["input"]
    if details["type"] != "too_short" or not isinstance(given, list | tuple):
        return False
    return len(given) >= details.get("ctx", {})["min_length"]


def _within(node: Any, key: str | int) -> Any:
    """Return the entry ``key`` of a section; a section without a law inherits that of ``node``."""
    inner = child(node, key)
    law = child(node, INHERITED)
    return {INHERITED: law} | inner if law is not None and isinstance(inner, dict) else inner


def _is_kind(model: type[Section], node: Any) -> bool:
    """Return whether ``node`` names the kind or law of ``model``, or has a key that only it has."""
    if model.known_by:
        return isinstance(node, dict) and bool(model.known_by & node.keys())
    choices = [name for name in KINDS_ARE_NAMED_BY if name in model.model_fields]
    return all(
        child(node, name) in get_args(model.model_fields[name].annotation) for name in choices
    )
