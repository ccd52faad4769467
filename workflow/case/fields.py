"""Kinds of entry in a case, such as quantities, whole numbers and texts, with their validation.

They are written as annotations, ``Annotated[float, Quantity("mm", above=0)]``, so that the rest
of the program sees a plain ``float`` in base units.
"""

from __future__ import annotations

import math
import os
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path as Pathname
from typing import Annotated, Any, Literal, Self, get_args

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from workflow.case import units
from workflow.errors import UserError

# Files that hold several arrays, with the name of one array after a colon.
OF_SEVERAL = r"(.*\.(?:h5|hdf5|npz|mat|op4|pch|bdf)):(.*)"
DOTTED = r"[\w-]+(\.[\w-]+)*"
NO_CONTEXT: Mapping[str, Any] = {}
NOT_OF_KIND = "not a file of this kind"
Auto = Literal["auto"]  # Type of an entry whose value is chosen before the run.
AUTO: Auto = "auto"
LONGEST_SHOWN = 60  # Length of a wrong value in a message, which must stay one readable line.


def shown(value: object) -> str:
    """Return ``value`` as text for a one-line message."""
    if isinstance(value, dict):
        return "a section"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}"
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return str(value).lower()
    # Python refuses to print whole numbers of thousands of digits.
    text = "a huge number" if isinstance(value, int) and abs(value) > 1e300 else repr(value)
    return text if len(text) <= LONGEST_SHOWN else text[:LONGEST_SHOWN] + "..."


class Entry(ABC):
    """Annotation that validates one value; ``allowed`` is a sentence about accepted values."""

    @property
    @abstractmethod
    def allowed(self) -> str: ...

    @abstractmethod
    def parse(self, value: object) -> Any: ...

    @abstractmethod
    def json_schema(self) -> dict[str, Any]: ...

    def refusal(self, value: object, wrong: str) -> PydanticCustomError:
        """Return the error about a value: the value, what is wrong with it, what is allowed."""
        message = f"{shown(value)}: {wrong}; allowed: {self.allowed}"
        return PydanticCustomError("entry", "{message}", {"message": message})

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.parse)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return self.json_schema()


class Written(float):
    """Number in base units that remembers the ``text`` it was written as, with its unit."""

    def __new__(cls, number: float, text: str = "") -> Self:
        written = super().__new__(cls, number)
        written.text = text
        return written

    text: str

    @property
    def unit(self) -> str:
        """Unit that the number was written in."""
        return units.split(self.text)[1]


def in_unit_of(written: float, number: float) -> tuple[float, str]:
    """Return ``number`` in the unit of ``written``, with the unit; as it is for a bare number."""
    if not isinstance(written, Written):
        return number, ""
    return number / units.to_base(f"1 {written.unit}", None), written.unit


@dataclass(frozen=True)
class Quantity(Entry):
    """Number in the base unit ``unit``, given as a bare number or as text with any compatible unit.

    ``unit`` is ``"1"`` for a ratio, and ``None`` for any dimension: the number then remembers how
    it was written. The limits are in the base unit; ``range_text`` states them in everyday units
    where these differ.
    """

    unit: str | None
    above: float = -math.inf
    at_least: float = -math.inf
    below: float = math.inf
    at_most: float = math.inf
    range_text: str = ""

    @property
    def allowed(self) -> str:
        text = self.range_text or self._range()
        if self.unit is None:
            return text
        if self.unit == "1":
            return f"{text}, as a bare number or in %"
        if self.range_text:
            return f"{text} (a bare number is in {self.unit})"
        return text

    def _range(self) -> str:
        unit = "" if self.unit in (None, "1") else f" {self.unit}"
        lower = f"above {self.above:g}{unit}" if self.above > -math.inf else ""
        lower = f"at least {self.at_least:g}{unit}" if self.at_least > -math.inf else lower
        upper = f"below {self.below:g}{unit}" if self.below < math.inf else ""
        upper = f"at most {self.at_most:g}{unit}" if self.at_most < math.inf else upper
        return " and ".join(part for part in (lower, upper) if part) or f"any number{unit}"

    def contains(self, number: float) -> bool:
        """Return whether ``number``, in the base unit, is within the limits."""
        return self.above < number < self.below and self.at_least <= number <= self.at_most

    def parse(self, value: object) -> float:
        number = self._number(value)
        if self.unit is None and isinstance(value, str):
            number = Written(number, value)
        if not math.isfinite(number):
            raise self.refusal(value, "not a finite number")
        if not self.contains(number):
            raise self.refusal(value, "out of range")
        return number

    def _number(self, value: object) -> float:
        if isinstance(value, str):
            try:
                return units.to_base(value, self.unit)
            except units.UnitError as error:
                raise self.refusal(value, str(error)) from error
            except ArithmeticError as error:
                raise self.refusal(value, "out of range") from error
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.refusal(value, "not a number")
        try:
            return float(value)
        except OverflowError as error:
            raise self.refusal(value, "out of range") from error

    def json_schema(self) -> dict[str, Any]:
        limits = {
            "exclusiveMinimum": self.above,
            "minimum": self.at_least,
            "exclusiveMaximum": self.below,
            "maximum": self.at_most,
        }
        finite = {name: limit for name, limit in limits.items() if math.isfinite(limit)}
        number = {"type": "number", **finite}
        pattern = units.ABOVE_ZERO_WITH_UNIT if self.above >= 0.0 else units.WITH_UNIT
        return {"anyOf": [number, {"type": "string", "pattern": pattern}]}


def quantity_of_option(text: str, quantity: Quantity, option: str) -> float:
    """Return the text after an option of a command, with or without a unit, as a number.

    Raises UserError, which names the option.
    """
    value: float | str = text
    with suppress(ValueError):
        value = float(text)
    try:
        return quantity.parse(value)
    except PydanticCustomError as error:
        raise UserError(f"{option} {error.message()}") from error


@dataclass(frozen=True)
class Whole(Entry):
    """Whole number from ``at_least`` to ``at_most``."""

    at_least: int
    at_most: int

    @property
    def allowed(self) -> str:
        if self.at_least == self.at_most:
            return str(self.at_least)
        return f"a whole number from {self.at_least} to {self.at_most}"

    def parse(self, value: object) -> int:
        if isinstance(value, bool) or not isinstance(value, int):
            raise self.refusal(value, "not a whole number")
        if not self.at_least <= value <= self.at_most:
            raise self.refusal(value, "out of range")
        return int(value)

    def json_schema(self) -> dict[str, Any]:
        return {"type": "integer", "minimum": self.at_least, "maximum": self.at_most}


@dataclass(frozen=True)
class Rows(Whole):
    """Number of cells of a grid along y: 1 in a line contact."""

    @property
    def allowed(self) -> str:
        return f"1 in a line contact, or {super().allowed}"

    def parse(self, value: object) -> int:
        return 1 if value == 1 and type(value) is int else super().parse(value)

    def json_schema(self) -> dict[str, Any]:
        return {"anyOf": [{"const": 1}, super().json_schema()]}


class OrAuto:
    """Annotation of ``X | Auto``: accepts a value of the annotated type X, or the word auto."""

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        def parse(value: object, chosen: Callable[[object], Any]) -> Any:
            if isinstance(value, str) and value != AUTO:
                message = f"{shown(value)}: not known; allowed: {AUTO}, or whole numbers"
                raise PydanticCustomError("entry", "{message}", {"message": message})
            return AUTO if value == AUTO else chosen(value)

        inner = handler.generate_schema(get_args(source)[0])
        return core_schema.no_info_wrap_validator_function(parse, inner)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return {"anyOf": [handler(schema), {"const": AUTO}]}


@dataclass(frozen=True)
class ScalarOrList:
    """Annotation of a list whose first value may be given alone; ``rest`` then follows it."""

    rest: tuple[int, ...] = ()

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self._listed, handler(source))

    def _listed(self, value: object) -> object:
        numbers = int | float if self.rest else int | float | str
        if isinstance(value, numbers) and not isinstance(value, bool):
            return (value, *self.rest)
        return value

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        listed = handler(schema)
        alone = listed["prefixItems"][0] if "prefixItems" in listed else listed["items"]
        return {"anyOf": [alone, listed]}


@dataclass(frozen=True)
class Ascending:
    """Annotation of a list of numbers that ascend; messages say that ``allowed`` ones do."""

    allowed: str

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_after_validator_function(self._checked, handler(source))

    def _checked(self, numbers: tuple[float, ...]) -> tuple[float, ...]:
        if any(after <= before for before, after in pairwise(numbers)):
            message = f"not ascending; allowed: {self.allowed}"
            raise PydanticCustomError("entry", "{message}", {"message": message})
        return numbers


@dataclass(frozen=True)
class Formats(Entry):
    """Formats of files out of ``choices``: true for the first, false for none, one, or several.

    One or several formats become a tuple.
    """

    choices: tuple[str, ...]

    @property
    def allowed(self) -> str:
        return f"true or false, or of {', '.join(self.choices)} one or a list"

    def parse(self, value: object) -> bool | tuple[str, ...]:
        if isinstance(value, bool):
            return value
        given = [value] if isinstance(value, str) else value
        if not isinstance(given, list | tuple) or not given:
            raise self.refusal(value, "no format")
        for each in given:
            if each not in self.choices:
                raise self.refusal(each, "no such format")
        if len(set(given)) < len(given):
            raise self.refusal(value, "a format given twice")
        return tuple(given)

    def json_schema(self) -> dict[str, Any]:
        one = {"enum": list(self.choices)}
        several = {"type": "array", "items": one, "minItems": 1, "uniqueItems": True}
        return {"anyOf": [{"type": "boolean"}, one, several]}


@dataclass(frozen=True)
class Word(Entry):
    """One of several ``words``, for items of lists, where a literal type cannot be used."""

    words: tuple[str, ...]

    @property
    def allowed(self) -> str:
        return ", ".join(self.words)

    def parse(self, value: object) -> str:
        if value not in self.words:
            raise self.refusal(value, "none of these words")
        return str(value)

    def json_schema(self) -> dict[str, Any]:
        return {"enum": list(self.words)}


@dataclass(frozen=True)
class Text(Entry):
    """One line of printable text."""

    allowed = "one line of text"

    def parse(self, value: object) -> str:
        if not isinstance(value, str):
            raise self.refusal(value, "not text, put it in quotes if it is meant to be")
        if not value.strip():
            raise self.refusal(value, "empty")
        if not value.isprintable():
            raise self.refusal(value, "has line breaks or unprintable characters")
        return value

    def json_schema(self) -> dict[str, Any]:
        return {"type": "string", "minLength": 1}


@dataclass(frozen=True)
class Value(Entry):
    """Any value that an entry of a case can have."""

    @property
    def allowed(self) -> str:
        return "a number, text, a switch, or a list of them"

    def parse(self, value: object) -> Any:
        if isinstance(value, list | tuple) and value:
            return tuple(self.parse(item) for item in value)
        if isinstance(value, bool | str):
            return value
        if isinstance(value, int | float) and is_finite(value):
            return value
        raise self.refusal(value, "not the value of an entry")

    def json_schema(self) -> dict[str, Any]:
        return {}


AnyValue = Annotated[Any, Value()]


def is_finite(number: float) -> bool:
    """Return whether a number is finite as a float, for whole numbers of any length too."""
    try:
        return math.isfinite(number)
    except OverflowError:
        return False


@dataclass(frozen=True)
class Path(Entry):
    """Keys joined by dots, such as ``wear.blade.coefficient``; items of a list by their number."""

    allowed = "keys joined by dots, such as wear.blade.coefficient"

    def parse(self, value: object) -> str:
        if not isinstance(value, str) or not re.fullmatch(DOTTED, value):
            raise self.refusal(value, "not a dotted path")
        return value

    def json_schema(self) -> dict[str, Any]:
        return {"type": "string", "pattern": f"^{DOTTED}$"}


@dataclass(frozen=True)
class File(Entry):
    """Existing file, given relative to the folder of the case and stored as its absolute path.

    A dataset of a file with several is named after a colon: ``gaps.h5:scan/gap``. The folder is the
    entry ``folder`` of the validation context.
    """

    endings: tuple[str, ...]

    @property
    def allowed(self) -> str:
        return f"a file {', '.join(self.endings)}, as seen from the folder of the case"

    def wrong_name(self, name: str) -> str:
        """Return why a file of this name is refused; empty if it is accepted."""
        return "" if name.endswith(self.endings) else NOT_OF_KIND

    def parse(self, value: object, context: Mapping[str, Any] = NO_CONTEXT) -> str:
        if not isinstance(value, str):
            raise self.refusal(value, "not a file name")
        name, dataset = split_dataset(value)
        if wrong := self.wrong_name(name) if value.isprintable() else NOT_OF_KIND:
            raise self.refusal(value, wrong)
        folder = context.get("folder", "")
        path = os.path.abspath(os.path.join(folder, name))  # noqa: PTH100, PTH118
        if wrong := unreadable(Pathname(path)):
            raise self.refusal(value, wrong)
        return f"{path}:{dataset}" if dataset else path

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        def parse(value: object, info: ValidationInfo) -> str:
            return self.parse(value, info.context or NO_CONTEXT)

        return core_schema.with_info_plain_validator_function(parse)

    def json_schema(self) -> dict[str, Any]:
        return {"type": "string", "minLength": 1}


def unreadable(path: Pathname) -> str:
    """Return why a file cannot be read, empty if it can; reading a pipe or device would block."""
    try:
        if path.is_dir():
            return "a directory"
        if path.exists() and not path.is_file():
            return "not a file: a pipe or a device"
        with path.open("rb") as file:
            file.read(1)
    except FileNotFoundError:
        return "no such file"
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the name
        return f"cannot be read ({getattr(error, 'strerror', None) or error})"
    return ""


def split_dataset(text: str) -> tuple[str, str]:
    """Return file and dataset of ``file.h5:dataset``; the dataset is empty if none is named."""
    match = re.fullmatch(OF_SEVERAL, text, re.DOTALL)
    return (match[1], match[2]) if match else (text, "")
