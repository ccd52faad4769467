"""Base of all loads on the bodies of a user's mesh."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

from pydantic import AfterValidator
from pydantic_core import PydanticCustomError

from workflow.case.fields import Quantity, Text
from workflow.case.sections import Section, entry
from workflow.case.text.plain import entries

Name = Annotated[str, Text()]
Factor = Annotated[float, Quantity("1", at_least=-1e6, at_most=1e6)]
Coordinate = Annotated[float, Quantity("mm", at_least=-1e6, at_most=1e6)]
Component = Annotated[float, Quantity("1", at_least=-1e6, at_most=1e6)]


def _directed(components: tuple[float, ...]) -> tuple[float, ...]:
    if not any(components):
        raise PydanticCustomError("entry", "no direction; allowed: a vector that is not zero")
    return components


Direction = Annotated[tuple[Component, Component, Component], AfterValidator(_directed)]

# Entries for the place of a load, with the preposition of each.
PLACES = (("group", "on"), ("body", "of"), ("axis", "about"), ("through", "through"), ("at", "at"))
KINDS = (
    "pressure, force, moment, displacement, remote_displacement, rotation, acceleration, "
    "temperature, nodal_temperature, pretension or shortening"
)


class MeshLoad(Section):
    """Base of all loads."""

    kind: str  # first in the section; each load narrows it to its own name
    path: tuple[Factor, ...] = entry(
        "factor of the load at the end of each leg of load_path; linear from 0 [1]", [1.0, 0.0]
    )

    @property
    def text(self) -> str:
        """The load in a line: kind, size, place and factors of the legs."""
        return f"{self.sized}, times {in_brackets(self.path)} at the ends of legs"

    @property
    def sized(self) -> str:
        """Kind, size and place of the load, as text."""
        kind = self.kind.replace("_", " ")
        sizes = entries(self, ("path", "axis", "through", "at"))
        what = sizes if sizes.startswith(kind) else f"{kind}, {sizes}"
        return f"{' '.join([what, *self.places])}{self.how}"

    @property
    def places(self) -> Iterator[str]:
        """Places where the load acts, in words."""
        for name, word in PLACES:
            if getattr(self, name, None) is not None:
                yield f"{word} {in_brackets(getattr(self, name))}"

    @property
    def how(self) -> str:
        """How the load acts at its place, after a comma."""
        return ", rigid" if getattr(self, "tie", None) == "rigid" else ""

    @property
    def ties(self) -> bool:
        """True if the load holds nodes, or ties them to each other."""
        return getattr(self, "tie", None) == "rigid"

    @property
    def contents(self) -> bytes:
        """Contents of the load's files, by which two loads are compared."""
        return b""


def in_brackets(value: str | tuple[float, ...]) -> str:
    """Return a name unchanged, numbers in brackets."""
    return value if isinstance(value, str) else f"({', '.join(f'{n:g}' for n in value)})"
