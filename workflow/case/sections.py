"""What every kind of case is made of: the base of all sections, and those that all kinds share.

Each field carries its description, with the base unit in brackets, and an example as one would
write it. JSON schema, template and error messages are made from these; nothing is said twice.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, get_args

from pydantic import BaseModel, ConfigDict, Field, StrictBool, field_validator
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

from sa_solver.types import Material as ElasticMaterial
from workflow.case.fields import Entry, Path, Quantity, Text, Whole

# Limits are wide: they catch a forgotten unit or a slipped exponent, not an unusual machine.
Length = Annotated[float, Quantity("mm", above=0.0, at_most=1e4)]
RoundingRadius = Annotated[float, Quantity("mm", above=0.0, at_most=1e6)]  # nearly flat is fine
Stress = Annotated[
    float, Quantity("MPa", above=0.0, at_most=2e6, range_text="above 0 and at most 2000 GPa")
]
GridCells = Annotated[int, Whole(8, 4096)]
Title = Annotated[str, Text()]
DottedPath = Annotated[str, Path()]
Tolerance = Annotated[float, Quantity("1", at_least=1e-12, at_most=1e-3)]


def entry(description: str, example: object = None, **settings: Any) -> Any:
    """A field with its description and, for a leaf, an example as one would write it."""
    examples = None if example is None else [example]
    return Field(description=description, examples=examples, **settings)


def disagreement(message: str, *keys: str) -> PydanticCustomError:
    """Entries that are fine one by one but not together; the first key is the one to look at."""
    return PydanticCustomError("disagreement", "{message}", {"message": message, "keys": keys})


class Section(BaseModel):
    """A section of a case: frozen, every key known, every number finite."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class ElasticBody(Section):
    """Base of the materials of a case."""

    def elastic(self) -> ElasticMaterial:
        """The same material as the solvers take it; no yield stress is an infinite one."""
        given = {k: v for k, v in self.model_dump().items() if v is not None}
        return ElasticMaterial(**given)


class Friction(Section):
    """Coulomb friction."""

    coefficient: Annotated[float, Quantity("1", at_least=0.0, at_most=2.0)] = entry(
        "shear over pressure when slipping [1]", 0.4
    )


class Output(Section):
    """What is written beside summary and results."""

    paraview: StrictBool = entry("files for ParaView", True, default=True)
    figures: StrictBool = entry("charts", True, default=True)


class Expectation(Section):
    """A value the run must reproduce, checked by ``fretscale verify``."""

    quantity: DottedPath = entry("path into summary.json", "intrados.depth")
    value: Annotated[float, Quantity(None)] = entry("in base units or with any unit", "12 um")
    tolerance: Annotated[float, Quantity("1", at_least=0.0, at_most=1.0)] = entry(
        "relative to the value [1]", "1 %"
    )
    source: Title = entry("where the value comes from", "closed form")
    exact: StrictBool = entry(
        "whether finer and finer grids go to the value, to all digits given: what `chart` needs",
        False,
        default=False,
    )


class OutputWithoutFields(Output):
    """What is written beside summary and results, of a case that has no fields."""

    paraview: StrictBool = entry("files for ParaView: there are none", False, default=False)

    @field_validator("paraview")
    @classmethod
    def _has_no_fields(cls, paraview: bool) -> bool:
        if paraview:
            raise PydanticCustomError(
                "entry", "true: such a case has nothing to show in ParaView; allowed: false"
            )
        return paraview


# The sections of a case, of whatever kind, in the order in which they are written.
SCENE_ORDER = (
    *("title", "analysis", "structure", "materials", "friction", "load_path", "mesh"),
    *("joint", "evolution", "drive", "excitation", "energies", "ageing", "integration"),
    *("forces", "frequencies", "mass", "resolution", "continuation", "force_sweeps", "backbone"),
    *("nonlinearity", "reduction", "contact", "wear", "coupling", "accuracy", "fidelity"),
    *("loops", "stress", "output", "assumed", "reported", "expect"),
)


class Scene(Section):
    """Base of all kinds of case."""

    def require_entries(self, paths: tuple[str, ...]) -> None:
        """Raise unless each of the dotted ``paths`` of ``assumed`` leads to an entry."""
        for index, path in enumerate(paths):
            if not _has(self, path):
                raise disagreement(
                    f"'{path}': no such entry in a case of this kind; "
                    "allowed: dotted paths such as structure or friction.coefficient",
                    f"assumed.{index}",
                )


def _has(node: object, path: str) -> bool:
    """Whether ``path`` leads from ``node`` to an entry."""
    for key in path.split("."):
        if isinstance(node, BaseModel) and key in type(node).model_fields:
            node = getattr(node, key)
        elif isinstance(node, tuple) and key.isdecimal() and int(key) < len(node):
            node = node[int(key)]
        else:
            return False
    return True


def sections_of(annotation: object) -> Iterator[type[Section]]:
    """The section models an annotation admits: none for a leaf, several for a union of kinds."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        yield annotation
    for argument in get_args(annotation):
        yield from sections_of(argument)


def entries_of(model: type[BaseModel]) -> dict[str, FieldInfo]:
    """The fields of a model, in the order in which they are written."""
    fields = model.model_fields
    if not issubclass(model, Scene):
        return dict(fields)
    return {name: fields[name] for name in SCENE_ORDER if name in fields}


def entry_of(field: FieldInfo) -> Entry | None:
    """The quantity, whole number or text of a leaf field; ``None`` for sections and choices."""
    parts = [*field.metadata, field.annotation]
    while parts:
        part = parts.pop(0)
        if isinstance(part, Entry):
            return part
        parts += [*getattr(part, "__metadata__", ()), *get_args(part)]
    return None


def quantities_of(model: type[Section]) -> dict[str, Quantity]:
    """The quantities among the fields of ``model``, by name."""
    entries = {name: entry_of(field) for name, field in model.model_fields.items()}
    return {name: found for name, found in entries.items() if isinstance(found, Quantity)}
