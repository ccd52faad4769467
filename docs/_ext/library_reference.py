"""Reference of the libraries, generated from their public names when the pages are built.

There is a page for every library. The public names of a package (its ``__all__``) appear in the
groups and the order of its docstring, followed by further classes that they take or return.
Signatures have the types as they are written in the source. Nothing is written by hand.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Iterator, Sequence
from functools import cache, cached_property, partial
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages
from types import ModuleType
from typing import TYPE_CHECKING, Any

import fretscale
from docutils import nodes
from sphinx.util.inspect import TypeAliasForwardRef

if TYPE_CHECKING:
    from sphinx.application import Sphinx
    from sphinx.environment import BuildEnvironment

# The packages of each page, with their subjects.
LIBRARIES = {
    "sa_solver": {"sa_solver": "contact mechanics"},
    "wear": {
        "wear": "laws, contacts that wear, kinetics",
        "wear.fitting": "parameters from measurements",
        "wear.joints": "joint laws",
    },
    "fe_models": {
        "fe_models": "structures",
        "fe_models.dynamics": "structures that vibrate",
        "fe_models.geometry": "meshes",
        "fe_models.matrices": "matrices of other programs",
    },
}
PAGES = "reference/libraries/"
NAME = re.compile(r"[A-Za-z_]\w*")
# Patterns of a group in the docstring of a package, and of the names that begin its items.
GROUP = re.compile(r"^(?P<title>[A-Z].*)\n(?=    - ``)", re.MULTILINE)
ITEM = re.compile(r"^ *- (?P<names>``\w+``(?:,\s+``\w+``)*)", re.MULTILINE)
# Pattern of a default value whose representation is not source code.
NAMELESS = re.compile(r"<[^<>]*(?:<[^<>]*>[^<>]*)*>")


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the writing of the pages, before Sphinx looks for sources, and text processing."""
    # Sphinx shows the names of `autodoc_type_aliases` within other types by their repr.
    TypeAliasForwardRef.__repr__ = lambda self: self.name
    app.connect("builder-inited", lambda app: write_pages(Path(app.srcdir) / "reference"))
    app.connect("autodoc-process-signature", as_written)
    held: dict[str, list[str]] = {}
    app.connect("autodoc-process-docstring", partial(as_it_stands, held), priority=100)
    app.connect("autodoc-process-docstring", with_links)
    app.connect("autodoc-process-docstring", partial(put_back, held), priority=900)
    app.connect("missing-reference", name_of_ours)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


# --- pages --------------------------------------------------------------------------------------


def write_pages(folder: Path) -> None:
    """Write a page for every library; unchanged pages keep their modification time."""
    folder = folder / "libraries"
    folder.mkdir(parents=True, exist_ok=True)
    for library, packages in LIBRARIES.items():
        page, text = folder / f"{library}.rst", "\n\n".join(_blocks(packages)) + "\n"
        if not page.exists() or page.read_text(encoding="utf-8") != text:
            page.write_text(text, encoding="utf-8")


def _blocks(packages: dict[str, str]) -> Iterator[str]:
    """Yield the blocks of a page, which is about its first package; every class appears once."""
    lines, placed = "=-~", set[type]()
    for number, (name, about) in enumerate(packages.items()):
        package, below = import_module(name), lines[min(number, 1) :]
        yield _heading(f"{name}: {about}", below[0])
        yield f".. automodule:: {name}\n   :no-members:"
        for title, names in groups(package):
            yield from _section(title, below[1], [f"{name}.{public}" for public in names])
        back = sorted(others(package) - placed, key=lambda cls: (cls.__module__, cls.__name__))
        placed.update(back)
        paths = [f"{cls.__module__}.{cls.__name__}" for cls in back]
        yield from _section(f"What else {name} takes and gives back", below[1], paths)


def _section(title: str, line: str, paths: Sequence[str]) -> Iterator[str]:
    if title and paths:
        yield _heading(title, line)
    for path in paths:
        yield _directive(path)


def _heading(title: str, line: str) -> str:
    return f"{title}\n{line * len(title)}"


def _directive(path: str) -> str:
    """Return the directive that documents a public name with all its members."""
    module, _, name = path.rpartition(".")
    value = getattr(import_module(module), name)
    if not isinstance(value, type):
        return f".. autofunction:: {path}"
    if issubclass(value, BaseException):
        # An error that `fretscale` exports as well is indexed on the page of that package.
        elsewhere = "\n   :no-index:" if getattr(fretscale, name, None) is value else ""
        return f".. autoexception:: {path}\n   :no-members:{elsewhere}"
    called = "\n   :special-members: __call__" if "__call__" in vars(value) else ""
    return f".. autoclass:: {path}\n   :members:\n   :inherited-members: tuple{called}"


def groups(package: ModuleType) -> list[tuple[str, list[str]]]:
    """Return the public names by the groups of the package's docstring; a title may be empty."""
    text = package.__doc__ or ""
    starts = [(match.start(), match["title"]) for match in GROUP.finditer(text)] or [(0, "")]
    ends = [start for start, _ in starts[1:]] + [len(text)]
    found = [
        (
            title,
            [
                name
                for item in ITEM.finditer(text[start:end])
                for name in NAME.findall(item["names"])
            ],
        )
        for (start, title), end in zip(starts, ends, strict=True)
    ]
    listed = [name for _, names in found for name in names]
    assert sorted(listed) == list(package.__all__), f"{package.__name__}: its text misses a name"
    return found


# --- further classes that are taken and returned ------------------------------------------------


def others(package: ModuleType) -> set[type]:
    """Return the non-public classes of the library that public names take, contain or return."""
    library, public = package.__name__.partition(".")[0], _public()
    kept: dict[str, list[type]] = {}
    for cls in _classes(library):
        kept.setdefault(cls.__name__, []).append(cls)
    values = [getattr(package, name) for name in package.__all__]
    names = {
        name for value in values for text in _annotations(value) for name in NAME.findall(text)
    }
    found = {cls for name in names for cls in kept.get(name, ()) if _is_record(cls)}
    return {cls for cls in found if cls not in public and not cls.__name__.startswith("_")}


def _is_record(cls: type) -> bool:
    return dataclasses.is_dataclass(cls) or getattr(cls, "_is_protocol", False)


def _public() -> set[object]:
    packages = [import_module(name) for names in LIBRARIES.values() for name in names]
    return {getattr(package, name) for package in packages for name in package.__all__}


def _classes(library: str) -> Iterator[type]:
    """Yield all classes of a library, where they are defined."""
    for module in _modules(library):
        for value in vars(module).values():
            if isinstance(value, type) and value.__module__ == module.__name__:
                yield value


def _modules(library: str) -> Iterator[ModuleType]:
    package = import_module(library)
    for info in walk_packages(package.__path__, f"{library}."):
        yield import_module(info.name)


def _annotations(value: object) -> Iterator[str]:
    """Yield the annotations of a function, or of the fields and documented methods of a class."""
    if not isinstance(value, type):
        yield from map(str, getattr(value, "__annotations__", {}).values())
        return
    for cls in value.__mro__:
        if cls.__module__.partition(".")[0] not in LIBRARIES:
            continue
        yield from map(str, vars(cls).get("__annotations__", {}).values())
        for name, member in vars(cls).items():
            if name == "__init__" or not name.startswith("_"):
                yield from _annotations(_function(member))


def _function(member: object) -> Any:
    """Return the function behind a method or a property."""
    if isinstance(member, property):
        return member.fget
    if isinstance(member, cached_property):
        return member.func
    return getattr(member, "__func__", member)


# --- signatures and links -----------------------------------------------------------------------


def as_written(
    app: Sphinx, what: str, name: str, value: Any, options: Any, signature: str, returns: str
) -> tuple[str, str] | None:
    """Return the signature with annotations and defaults as they are in the source."""
    if what not in ("class", "function", "method") or not callable(value):
        return None
    if getattr(value, "_is_protocol", False):
        return "", ""  # a protocol is never instantiated
    found, module = inspect.signature(value), value.__module__
    parameters = list(found.parameters.values())
    if what == "method" and parameters and parameters[0].name in ("self", "cls"):
        parameters = parameters[1:]
    result = "" if what == "class" else _linked(found.return_annotation, module)
    return f"({', '.join(_parameters(parameters, module))})", result


def _parameters(parameters: Sequence[inspect.Parameter], module: str) -> Iterator[str]:
    """Yield each parameter as source code."""
    named_only = False
    for parameter in parameters:
        if parameter.kind is parameter.KEYWORD_ONLY and not named_only:
            yield "*"
        named_only = parameter.kind in (parameter.VAR_POSITIONAL, parameter.KEYWORD_ONLY)
        name = str(parameter.replace(annotation=parameter.empty, default=parameter.empty))
        annotation, default = _linked(parameter.annotation, module), ""
        if parameter.default is not parameter.empty:
            default = f" = {NAMELESS.sub('...', repr(parameter.default))}"
        yield f"{name}{annotation and ': '}{annotation}{default}"


def _linked(annotation: object, module: str) -> str:
    """Return an annotation of a module with the full names of documented classes."""
    if annotation is inspect.Signature.empty:
        return ""
    if not isinstance(annotation, str):
        annotation = str(getattr(annotation, "__name__", annotation))
    return NAME.sub(lambda match: _path(match.group(), module), str(annotation))


def _path(name: str, module: str) -> str:
    """Return where a class of this name, known to a module or its library, is documented."""
    known = vars(import_module(module)).get(name)
    library = module.partition(".")[0]
    for cls, path in _documented().items():
        alike = cls.__name__ == name and path.startswith(f"{library}.")
        if cls is known or (known is None and alike):
            return path
    return name


@cache
def _documented() -> dict[type, str]:
    """Return the classes that have a place on the pages, with their names there."""
    found: dict[type, str] = {}
    for names in LIBRARIES.values():
        for package in map(import_module, names):
            found |= {cls: f"{cls.__module__}.{cls.__name__}" for cls in others(package)}
            values = {name: getattr(package, name) for name in package.__all__}
            for name, value in values.items():
                if isinstance(value, type):
                    found[value] = f"{package.__name__}.{name}"
    return found


def as_it_stands(
    held: dict[str, list[str]],
    app: Sphinx,
    what: str,
    name: str,
    value: Any,
    options: Any,
    lines: list[str],
) -> None:
    """Preserve the lines of indented blocks after a colon, and the docstrings of properties.

    The docstrings of properties are hidden from napoleon, which would take the text before a colon
    for a type.
    """
    for number, pair in enumerate(zip(lines, lines[2:], strict=False)):
        line, following = pair
        apart = line.endswith(":") and not line.endswith("::") and not lines[number + 1]
        indent = len(following) - len(following.lstrip())
        if apart and indent > len(line) - len(line.lstrip()):
            lines[number] = f"{line}:"
    if what == "property":
        held[name] = list(lines)


def put_back(held: dict[str, list[str]], *reported: Any) -> None:
    """Restore the docstring of a property; ``reported`` are the arguments of the Sphinx event."""
    _, _, name, _, _, lines = reported
    if name in held:
        lines[:] = held.pop(name)


def with_links(
    app: Sphinx, what: str, name: str, value: Any, options: Any, lines: list[str]
) -> None:
    """Link public names in the docstring of a package to their documentation."""
    if what == "module" and name.startswith(tuple(LIBRARIES)):
        public = "|".join(value.__all__)
        lines[:] = [
            re.sub(rf"``({public})``", rf":py:obj:`\1 <{name}.\1>`", line) for line in lines
        ]


def name_of_ours(
    app: Sphinx, env: BuildEnvironment, node: nodes.Element, text: nodes.TextElement
) -> nodes.Node | None:
    """Return names without a place on the pages as plain text: foreign types and private names."""
    if node.get("refdomain") != "py":
        return None
    if isinstance(text, nodes.literal):
        here = node.get("refdoc", "").startswith(PAGES)
        return text if here and node["reftarget"].rpartition(".")[2] in _names() else None
    return text


@cache
def _names() -> set[str]:
    """Return all names that modules of the libraries define, and the members of classes."""
    found: set[str] = set()
    for library in LIBRARIES:
        found.update(*(vars(module) for module in _modules(library)))
        found.update(*(vars(cls) for cls in _classes(library)))
    return found
