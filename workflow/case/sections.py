"""Base classes of all cases and their sections, and the sections that all kinds of case share.

Each field carries its description, with the base unit in brackets, and an example as a user would
write it. JSON schema, template and error messages are generated from these.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Annotated, Any, ClassVar, Literal, Self, get_args

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    GetJsonSchemaHandler,
    StrictBool,
    field_validator,
    model_validator,
)
from pydantic.fields import FieldInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError

from sa_solver.types import Material as ElasticMaterial
from workflow.case.fields import (
    Entry,
    File,
    Formats,
    Path,
    Quantity,
    Rows,
    ScalarOrList,
    Text,
    Whole,
    shown,
    split_dataset,
)
from workflow.case.materials import MATERIALS, near
from workflow.case.source import Source
from workflow.errors import EntryError, UserError
from workflow.messages.warning_kinds import Notice

# Limits are wide: they catch a forgotten unit or a slipped exponent, not an unusual machine.
Length = Annotated[float, Quantity("mm", above=0.0, at_most=1e4)]
RoundingRadius = Annotated[float, Quantity("mm", above=0.0, at_most=1e6)]  # nearly flat is fine
Stress = Annotated[
    float, Quantity("MPa", above=0.0, at_most=2e6, range_text="above 0 and at most 2000 GPa")
]
GridCells = Annotated[int, Whole(8, 4096)]
# Cells along x and y: of a contact that may be a line contact, and of a line contact. One number
# alone means a line contact.
FaceCells = Annotated[tuple[GridCells, Annotated[int, Rows(8, 4096)]], ScalarOrList((1,))]
LineCells = Annotated[tuple[GridCells, Annotated[int, Whole(1, 1)]], ScalarOrList((1,))]
# Formats of figures; the first is the default.
FIGURE_FORMATS = "png", "svg", "pdf"
Title = Annotated[str, Text()]
DottedPath = Annotated[str, Path()]
Tolerance = Annotated[float, Quantity("1", at_least=1e-12, at_most=1e-3)]

# Keys that choose between sections.
KINDS_ARE_NAMED_BY = ("kind", "law", "shape", "scope")


def entry(description: str, example: object = None, **settings: Any) -> Any:
    """Return a field with its description and, for a leaf, an example as a user would write it."""
    examples = None if example is None else [example]
    return Field(description=description, examples=examples, **settings)


def disagreement(message: str, *keys: str) -> PydanticCustomError:
    """Return the error about entries that are valid one by one but not together.

    The first of ``keys`` is the entry to look at.
    """
    return PydanticCustomError("disagreement", "{message}", {"message": message, "keys": keys})


@contextmanager
def in_its_place() -> Iterator[None]:
    """Turn an EntryError into an error at the entry that it names."""
    try:
        yield
    except EntryError as error:
        raise disagreement(error.message, error.key) from error


@contextmanager
def at_entry(key: str) -> Iterator[None]:
    """Turn an error about a file into an error at the entry that names the file."""
    try:
        yield
    except UserError as error:
        raise disagreement(str(error), key) from error


def one_of(*keys: str) -> dict[str, Any]:
    """Return the JSON schema of sections that have at least one of these keys."""
    return {"anyOf": [{"required": [key]} for key in keys]}


def together(*keys: str) -> dict[str, Any]:
    """Return the JSON schema of sections that have all of these keys if they have one of them."""
    return {
        "allOf": [
            {
                "if": {"properties": {key: {"not": {"type": "null"}}}, "required": [key]},
                "then": {"required": [other for other in keys if other != key]},
            }
            for key in keys
        ]
    }


class Section(BaseModel):
    """Section of a case: frozen, with known keys and finite numbers only."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    # Whether a template fills in optional entries that most cases give.
    filled_in: ClassVar[bool] = True
    # Keys that distinguish it from other kinds of the same section, where no word names the kind.
    known_by: ClassVar[frozenset[str]] = frozenset()
    # Further optional entries that a template fills in here.
    also_filled_in: ClassVar[tuple[str, ...]] = ()
    # Conditions in the JSON schema, besides those of the entries: see ``one_of`` and ``together``.
    in_schema: ClassVar[Mapping[str, Any]] = {}
    # Keys that users of other kinds of case may try here, and the answer to them.
    refused: ClassVar[Mapping[str, str]] = {}


class MaterialName(Text):
    """Name of a known material."""

    allowed = "a name that `fretscale materials` lists"

    def json_schema(self) -> dict[str, Any]:
        return {"enum": list(MATERIALS)}


class ElasticSection(Section):
    """Base of the materials of a case: given by name, by numbers, or both."""

    refused: ClassVar[Mapping[str, str]] = {
        "density": "nothing here depends on mass; allowed: leave it out",
        "layers": "layers do not wear; allowed: with `analysis: contact`",
    }

    material: Annotated[str, MaterialName()] | None = entry(
        "one of `fretscale materials`, for all properties that are not given here",
        "Ti-6Al-4V",
        default=None,
    )

    @model_validator(mode="before")
    @classmethod
    def _named(cls, data: Any) -> Any:
        """Fill in the values of a material known by its name, which may be given alone."""
        given = data if isinstance(data, dict) else {}
        if data is None or isinstance(data, str | int | float):
            data = {"material": data}
        if not isinstance(data, dict) or data.get("material") is None:
            return data
        name = data["material"]
        if not isinstance(name, str) or name not in MATERIALS:
            meant = near(str(name))
            hint = f", did you mean '{meant}'?" if meant else ""
            raise disagreement(
                f"{shown(name)}: unknown material{hint}; allowed: {MaterialName.allowed}, or a "
                "section with young and poisson",
                *(["material"] if "material" in given else []),
            )
        known = MATERIALS[name].in_base_units().items()
        filled = {k: v for k, v in known if k in cls.model_fields and data.get(k) is None}
        return data | filled

    @classmethod
    def __get_pydantic_json_schema__(
        cls, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        reference = handler(schema)
        section = handler.resolve_ref_schema(reference)
        alone = dict(section)
        section.clear()
        numbers = alone.pop("required")
        alone["anyOf"] = [{"required": ["material"]}, {"required": numbers}]
        section |= {"anyOf": [MaterialName().json_schema(), alone]}
        return reference

    def elastic(self) -> ElasticMaterial:
        """Return the material for the solvers; no yield stress becomes an infinite one."""
        given = self.model_dump(exclude={"material", "layers"})
        return ElasticMaterial(**{k: v for k, v in given.items() if v is not None})


class Friction(Section):
    """Coulomb friction."""

    coefficient: Annotated[float, Quantity("1", at_least=0.0, at_most=2.0)] = entry(
        "shear over pressure when slipping [1]", 0.4
    )


class Output(Section):
    """Files that are written in addition to summary and results."""

    paraview: StrictBool = entry("files for ParaView", True, default=True)
    figures: Annotated[bool | tuple[str, ...], Formats(FIGURE_FORMATS)] = entry(
        "charts: true (png), false, or one or a list of png, svg and pdf", True, default=True
    )
    report: StrictBool = entry("report.html: everything on one page", True, default=True)

    @property
    def figure_formats(self) -> tuple[str, ...]:
        """Formats in which figures are written; none if figures are switched off."""
        if isinstance(self.figures, tuple):
            return self.figures
        return FIGURE_FORMATS[:1] if self.figures else ()


class Expectation(Section):
    """Value that the run must reproduce, checked by ``fretscale verify``."""

    quantity: DottedPath = entry("path in summary.json", "intrados.depth")
    value: Annotated[float, Quantity(None)] = entry(
        "value with its unit, in which `verify` shows it; a bare number is in base units", "12 um"
    )
    tolerance: Annotated[float, Quantity("1", at_least=0.0, at_most=1.0)] = entry(
        "tolerance relative to the value; for a value 0 in its unit [1]", "1 %"
    )
    kind: Literal["printed", "closed_form", "independent", "earlier"] = entry(
        "printed (by a publication, in numbers or words), closed_form (a formula, a balance or a "
        "limit), independent (another method) or earlier (our own result, to detect changes)",
        "closed_form",
    )
    source: Title = entry("publication, formula, method or run", "V = α µ P 2s N")
    exact: StrictBool = entry(
        "whether finer grids converge to the value, to all digits given: `chart` needs it",
        False,
        default=False,
    )


class MeasuredHeadings(Section):
    """Headings of a measured table, without their units."""

    at: Title | None = entry("heading of the places, if not at", "energy", default=None)
    values: Title | None = entry(
        "heading of the measured values, if not values; with _deviation added, of their deviations",
        "mu",
        default=None,
    )


MeasuredNumbers = tuple[Annotated[float, Quantity(None)], ...]


class Measured(Section):
    """Measured points, shown together with a curve of the results."""

    also_filled_in: ClassVar[tuple[str, ...]] = "at", "values"

    curve: Title = entry(
        "title of the curve, as `fretscale compare` draws it; its beginning is enough if "
        "there is only one such curve",
        "friction of the joint",
    )
    file: Annotated[str, File((".csv",))] | None = entry(
        "CSV instead of at and values: headings with units, path from the folder of the case",
        "measured.csv",
        default=None,
    )
    columns: MeasuredHeadings = entry("headings of the file", default=MeasuredHeadings())
    at: MeasuredNumbers = entry("places with units, instead of a file", ["0 J", "2 kJ"], default=())
    values: MeasuredNumbers = entry("measured values there", [0.34, 0.37], default=())
    deviation: Annotated[float, Quantity(None, above=0.0)] | None = entry(
        "standard deviation of every value, with its unit; without it there is no chi²",
        0.02,
        default=None,
    )
    relative_deviation: Annotated[float, Quantity("1", above=0.0, at_most=10.0)] | None = entry(
        "deviation as a share of each value, instead of deviation [1]", "5 %", default=None
    )
    source: Title = entry("author and publication", "Li 2020, fig. 15")

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        if (self.file is None) == (not self.at and not self.values):
            raise disagreement("allowed: a file, or at and values", "file", "at")
        if len(self.at) != len(self.values):
            raise disagreement(
                f"{len(self.values)} for {len(self.at)} places; allowed: as many as in at", "values"
            )
        if self.deviation is not None and self.relative_deviation is not None:
            raise disagreement("given with deviation; allowed: one of them", "relative_deviation")
        if self.relative_deviation is not None and 0.0 in self.values:
            raise disagreement(
                "a share of 0 means nothing; allowed: deviation", "relative_deviation"
            )
        return self


class OutputWithoutFields(Output):
    """Files that are written in addition to summary and results, for a case without fields."""

    paraview: StrictBool = entry("files for ParaView: this case has none", False, default=False)

    @field_validator("paraview")
    @classmethod
    def _has_no_fields(cls, paraview: bool) -> bool:
        if paraview:
            raise PydanticCustomError(
                "entry", "true: such a case has nothing to show in ParaView; allowed: false"
            )
        return paraview


# Order in which the sections that several kinds of case have are written. Those of one kind only
# come before the sections of LAST, in the order in which the kind declares them.
FIRST = (
    *("title", "analysis", "structure", "materials", "friction", "load_path", "mesh"),
    *("joint", "evolution", "drive", "excitation", "energies", "ageing", "integration"),
    *("forces", "frequencies", "mass", "resolution", "continuation", "force_sweeps", "backbone"),
    *("nonlinearity", "reduction", "contact", "wear", "coupling"),
    *("accuracy", "error_budget", "fidelity", "loops", "stress"),
)
LAST = ("output", "assumed", "reported", "measured", "expect")
# Entries on which no computed number depends.
ASIDE = ("title", *LAST)


class Case(Section, ABC):
    """Base of all kinds of case, with what the commands need of each of them."""

    # What a case of this kind is about, in one plain line.
    about: ClassVar[str]

    title: Title = entry("one line", "Ball on a flat, pressed and sheared")
    analysis: str = entry("kind of analysis", "contact")
    structure: Section = entry("loaded structure")
    output: Output = entry("files written with summary and results", default=Output())
    assumed: tuple[DottedPath, ...] = entry(
        "inputs that are assumed because the source does not print them",
        ["structure"],
        default=(),
    )
    measured: tuple[Measured, ...] = entry(
        "measured points to show with curves of the results", default=()
    )
    expect: tuple[Expectation, ...] = entry("values the run must reproduce", default=())

    @classmethod
    def suits(cls, source: Source) -> bool:
        """Return whether the source means this kind and not another one of its analysis.

        This decides where the kinds of structure do not distinguish the cases. May raise CaseError.
        """
        return True

    @property
    @abstractmethod
    def question(self) -> str:
        """Question that a run answers in one sentence, and the loads in another one."""

    @abstractmethod
    def outline(self) -> list[tuple[str, str]]:
        """Return what would run, in a few rows of name and text."""

    def plausibility_warnings(self) -> Iterator[Notice]:
        """Yield a warning for each combination of entries that is possible but implausible.

        Each text begins with one of the entries. Warnings about single entries are in
        :mod:`workflow.case.plausibility`.
        """
        yield from ()

    @property
    def cores(self) -> int:
        """Number of processes of a run that compute at the same time."""
        return 1

    @model_validator(mode="after")
    def _assumed_exist(self) -> Self:
        for index, path in enumerate(self.assumed):
            if not _has(self, path):
                raise disagreement(
                    f"{shown(path)}: no such entry in a case of this kind; "
                    "allowed: dotted paths such as structure or friction.coefficient",
                    f"assumed.{index}",
                )
        return self


def _has(node: object, path: str) -> bool:
    """Return whether ``path`` leads from ``node`` to an entry."""
    for key in path.split("."):
        if isinstance(node, BaseModel) and key in type(node).model_fields:
            node = getattr(node, key)
        elif isinstance(node, tuple) and key.isdecimal() and int(key) < len(node):
            node = node[int(key)]
        else:
            return False
    return True


def sections_of(annotation: object) -> Iterator[type[Section]]:
    """Yield the section models that an annotation admits: none for a leaf, several for a union."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        yield annotation
    for argument in get_args(annotation):
        yield from sections_of(argument)


def entries_of(model: type[BaseModel]) -> dict[str, FieldInfo]:
    """Return the fields of a model, in the order in which they are written."""
    fields = model.model_fields
    if not issubclass(model, Case):
        return dict(fields)
    others = [name for name in fields if name not in (*FIRST, *LAST)]
    return {name: fields[name] for name in (*FIRST, *others, *LAST) if name in fields}


def words_of(model: type[Section], *path: str) -> tuple[str, ...]:
    """Return the words that an entry of a fixed choice admits, such as ``structure.kind``."""
    *sections, name = path
    models: list[type[Section]] = [model]
    for section in sections:
        models = [
            m for parent in models for m in sections_of(parent.model_fields[section].annotation)
        ]
    words = [w for parent in models for w in get_args(parent.model_fields[name].annotation)]
    return tuple(dict.fromkeys(words))


def entry_of(field: FieldInfo) -> Entry | None:
    """Return the quantity, whole number or text of a leaf field; None for sections and choices."""
    parts = [*field.metadata, field.annotation]
    while parts:
        part = parts.pop(0)
        if isinstance(part, Entry):
            return part
        parts += [*getattr(part, "__metadata__", ()), *get_args(part)]
    return None


def files_of(section: BaseModel) -> Iterator[str]:
    """Yield the files that the entries of a section name, at any depth."""
    for name, field in type(section).model_fields.items():
        value = getattr(section, name)
        for item in value if isinstance(value, tuple) else (value,):
            if isinstance(item, BaseModel):
                yield from files_of(item)
            elif item is not None and isinstance(entry_of(field), File):
                yield split_dataset(item)[0]


def quantities_of(model: type[Section]) -> dict[str, Quantity]:
    """Return the quantities among the fields of ``model``, by name."""
    entries = {name: entry_of(field) for name, field in model.model_fields.items()}
    return {name: quantity for name, quantity in entries.items() if isinstance(quantity, Quantity)}
