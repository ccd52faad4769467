"""Text of a case as plain data, with the place where each entry was written."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.constructor import DuplicateKeyError
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import CollectionEndEvent, CollectionStartEvent, Event, NodeEvent
from ruamel.yaml.parser import RoundTripParser
from ruamel.yaml.reader import ReaderError

from workflow.case.fields import DOTTED, shown, unreadable
from workflow.errors import CaseError

KeyPath = tuple[str | int, ...]
# Keys that messages show unquoted.
WORD = r"\w(?:[\w -]{0,58}\w)?"

# Stands for the file of a case that was built in Python and so has no lines.
IN_PYTHON = "the case"

# Sections in which a text stands for a section with this entry only.
SHORT: dict[KeyPath, str] = {("materials",): "material"}

LARGEST_FILE = 1_000_000  # bytes; cases have a few thousand
MOST_ENTRIES = 10_000  # after expanding YAML aliases, which can grow without bound
DEEPEST = 20  # levels; a case has four
TOO_MUCH = "nested too deeply or too long for a case"
LONGEST_NUMBER = 9  # digits of a place in a list, far beyond the longest
LONGEST_REASON = 100  # characters of a reason that the YAML parser gives
KEPT = 64  # parsed texts in the cache: a sweep reads one case for each of its runs


class Source:
    """Plain data of a case, with a file line or an override for each entry.

    ``overrides`` are texts such as ``"wear.cycles=1e4"``, applied in order. Raises ``CaseError``.
    """

    def __init__(self, name: str, text: str, overrides: Iterable[str] = ()) -> None:
        self.name = name
        self._overrides: dict[KeyPath, str] = {}
        reading = _Reading(name)
        data = reading.plain(parse_yaml(text, name), (), 1)
        if data is None:
            raise CaseError(f"{_place(name, 1)}: empty; allowed: a case (see `fretscale new`)")
        if not isinstance(data, dict):
            raise CaseError(f"{_place(name, 1)}: {shown(data)}: not a case; allowed: key: value")
        self.data: dict[str, Any] = data
        self._lines = reading.lines
        for override in overrides:
            self._set(override)

    def where(self, path: KeyPath) -> tuple[int, str]:
        """Return the line of ``path``, or of what contains it, and the text that names the place.

        The line is 0 for an entry that an override has set.
        """
        for length in range(len(path), -1, -1):
            part = path[:length]
            if part in self._overrides:
                return 0, f"--set {self._overrides[part]}"
            if part in self._lines:
                return self._lines[part], _place(self.name, self._lines[part])
        return 1, _place(self.name, 1)

    def is_override(self, path: KeyPath) -> bool:
        """Return whether ``path``, or a section around it, was set by an override."""
        return self.where(path)[0] == 0

    def at(self, path: Iterable[str | int]) -> Any:
        """Return the data at ``path``; ``None`` if there is none."""
        node: Any = self.data
        for key in path:
            node = child(node, key)
        return node

    def _set(self, override: str) -> None:
        """Put ``key=value`` into the data, creating missing sections."""
        quoted = shown(override)
        written = quoted[1:].removesuffix(quoted[0])
        label = f"--set {written}"
        keys, equals, text = override.partition("=")
        if not equals or not re.fullmatch(DOTTED, keys.strip()):
            raise CaseError(f"{label}: not key=value; allowed: such as wear.cycles=1e4")
        path = split_path(keys.strip())
        if len(path) > DEEPEST:
            raise CaseError(f"{label}: {TOO_MUCH}; allowed: up to {DEEPEST} keys")
        value = _Reading(label).plain(parse_yaml(text, label), (), 1)
        path, node = self._section_of(path, written)
        if isinstance(node, dict) or child(node, path[-1]) is not None:
            node[path[-1]] = value
        else:
            raise CaseError(f"{label}: no such entry; allowed: keys joined by dots")
        # The override replaces what the file or earlier overrides gave at this path and below.
        self._lines = {p: line for p, line in self._lines.items() if p[: len(path)] != path}
        self._overrides = {p: o for p, o in self._overrides.items() if p[: len(path)] != path}
        self._overrides[path] = written

    def _section_of(self, path: KeyPath, written: str) -> tuple[KeyPath, Any]:
        """Return the path of an entry and the section or list that contains it, created if missing.

        Numbers in a path are places in lists, and keys in sections.
        """
        node: Any = self.data
        walked: KeyPath = ()
        for key in path[:-1]:
            walked = *walked, str(key) if isinstance(node, dict) else key
            if isinstance(node, dict):
                inner = node.get(str(key))
                if inner is None:
                    node[str(key)] = {}
                    self._overrides[walked] = written
                elif isinstance(inner, str) and walked[:-1] in SHORT:
                    node[str(key)] = {SHORT[walked[:-1]]: inner}
            node = child(node, key)
        last = path[-1]
        return (*walked, str(last) if isinstance(node, dict) else last), node


class _Reading:
    """Conversion of ruamel's nodes, which know their lines, to plain Python objects."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.lines: dict[KeyPath, int] = {}

    def plain(self, node: Any, path: KeyPath, line: int) -> Any:
        """Return ``node`` as dictionaries, lists and scalars, and record its lines in ``lines``."""
        self.lines[path] = line
        if len(path) > DEEPEST or len(self.lines) > MOST_ENTRIES:
            raise CaseError(f"{_place(self.name, line)}: {TOO_MUCH}")
        if isinstance(node, CommentedMap):
            return dict(self._item(key, node, path, line) for key in node)
        if isinstance(node, CommentedSeq):
            items = enumerate(node)
            return [self.plain(v, (*path, i), _line_of(node, i, line)) for i, v in items]
        for kind in (bool, int, float, str):
            if isinstance(node, kind):
                return kind(node)
        if node is None:
            return None
        raise CaseError(
            f"{_place(self.name, line)}: {dotted(path)}: a {type(node).__name__}; "
            "allowed: number, text (in quotes if it looks like a date), true, false, list, section"
        )

    def _item(self, key: Any, node: CommentedMap, path: KeyPath, line: int) -> tuple[str, Any]:
        below = _line_of(node, key, line)
        if not isinstance(key, str):
            raise CaseError(f"{_place(self.name, below)}: {shown(key)}: not a key; allowed: words")
        name = str(key)
        return name, self.plain(node[key], (*path, name), below)


def read_text(path: Path) -> str:
    """Return the text of a case file; raise ``CaseError`` if it cannot be read."""
    if wrong := unreadable(path):
        raise CaseError(f"{path}: {wrong}; allowed: a case file in YAML")
    with path.open("rb") as file:
        raw = file.read(LARGEST_FILE + 1)
    if len(raw) > LARGEST_FILE:
        raise CaseError(f"{path}: over {LARGEST_FILE} bytes; allowed: a case file in YAML")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise CaseError(f"{path}:{line}: not UTF-8; allowed: text in UTF-8") from None


class _TooMuch(MarkedYAMLError):
    """Text too large for a case, reported at once: ruamel takes minutes for a megabyte of it."""


class _Parser(RoundTripParser):
    """Parser of ruamel that stops at the limits of a case."""

    def __init__(self, loader: Any) -> None:
        super().__init__(loader)
        self._nodes = self._depth = 0

    def get_event(self) -> Event:
        event = super().get_event()
        self._nodes += isinstance(event, NodeEvent)
        self._depth += isinstance(event, CollectionStartEvent)
        self._depth -= isinstance(event, CollectionEndEvent)
        # Keys count as nodes too.
        if self._depth > DEEPEST + 1 or self._nodes > 2 * MOST_ENTRIES + 1:
            raise _TooMuch(problem_mark=event.start_mark)
        return event


@lru_cache(KEPT)
def _nodes(text: str) -> Any:
    """Return ``text`` as ruamel's nodes, cached because parsing takes 20 ms; do not change them."""
    yaml = YAML(typ="rt", pure=True)
    yaml.Parser = _Parser
    return yaml.load(text)


def parse_yaml(text: str, name: str) -> Any:
    """Return ``text`` as ruamel's nodes; in YAML 1.2 ``1e5`` is a number and ``yes`` a word."""
    try:
        return _nodes(text)
    except _TooMuch as error:
        raise CaseError(f"{_marked(error, name)}: {TOO_MUCH}") from None
    except DuplicateKeyError as error:
        key = shown(str(error.problem).partition('"')[2].partition('"')[0])
        raise CaseError(f"{_marked(error, name)}: {key}: given twice; allowed: once") from None
    except MarkedYAMLError as error:
        raise CaseError(f"{_marked(error, name)}: {_problem(error, text)}") from None
    except ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        raise CaseError(f"{_place(name, line)}: unprintable character; allowed: text") from None
    except (YAMLError, ValueError, TypeError, LookupError, AttributeError) as error:
        # Odd tags and huge numbers raise these: ruamel has no common exception for them.
        raise CaseError(f"{_place(name, 1)}: not YAML: {_one_line(error)}") from None


def _marked(error: MarkedYAMLError, name: str) -> str:
    mark = error.problem_mark or error.context_mark
    return _place(name, mark.line + 1) if mark else name


def _place(name: str, line: int) -> str:
    """Return file and line; texts that are not files have no line."""
    return name if name == IN_PYTHON or name.startswith("--set ") else f"{name}:{line}"


def _problem(error: MarkedYAMLError, text: str) -> str:
    mark = error.problem_mark or error.context_mark
    lines = text.splitlines()
    if mark is not None and mark.line < len(lines) and "\t" in lines[mark.line]:
        return "a tab; allowed: spaces"
    return f"not YAML: {_one_line(error.problem or error.context)}"


def _one_line(reason: object) -> str:
    return " ".join(str(reason).split())[:LONGEST_REASON]


def _line_of(node: CommentedMap | CommentedSeq, key: Any, otherwise: int) -> int:
    """Return the line of an entry, counted from 1; ``otherwise`` for one merged from elsewhere."""
    position = (node.lc.data or {}).get(key)
    return position[0] + 1 if position else otherwise


def child(node: Any, key: str | int) -> Any:
    """Return the entry ``key`` of a section or list; ``None`` if there is none."""
    if isinstance(node, dict):
        return node.get(str(key))
    if isinstance(node, list) and isinstance(key, int) and key < len(node):
        return node[key]
    return None


def split_path(text: str) -> KeyPath:
    """Return the keys of a dotted path; numbers are places in a list."""
    return tuple(
        int(key) if key.isdecimal() and len(key) <= LONGEST_NUMBER else key
        for key in text.split(".")
    )


def dotted(path: Iterable[str | int]) -> str:
    """Return a path for a message, keys joined by dots; odd and long keys are quoted."""
    return ".".join(
        str(key) if isinstance(key, int) or re.fullmatch(WORD, key) else shown(key) for key in path
    )
