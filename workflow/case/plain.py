"""Numbers in base units as one would say them: 115 GPa, 4430 kg/m³, 50 µm, 6000 rpm."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePath

from workflow.case.readable import everyday_unit, pretty, suited_unit
from workflow.case.sections import Section, quantities_of
from workflow.case.units import to_base

# Moments are said in other units than energies, which have the same base unit: from so much on.
MOMENT, SAID_FROM, SAID_IN = "N*mm", 1e3, "N*m"

# Numbers from here on are grouped by thousands.
GROUPED = 1e4


def plain(number: float, unit: str | None, digits: int = 6) -> str:
    """A number in the base unit ``unit`` as it is said; of other units as it is."""
    size, name = said_in(number, unit)
    return f"{number / size:.{digits}g} {name}".rstrip()


def times(number: float) -> str:
    """How often, such as cycles: 1,080,000, or 2500."""
    grouped = "," if abs(number) >= GROUPED else ""
    return f"{number:{grouped}.0f}" if number == round(number) else f"{number:{grouped}.6g}"


def counted(number: int, thing: str) -> str:
    """So many of a thing: 1 run, 3 runs."""
    return f"{number} {thing}" if number == 1 else f"{number} {thing}s"


def listed(things: Sequence[str]) -> str:
    """Several things in a sentence: a, b and c."""
    *before, last = things
    return f"{', '.join(before)} and {last}" if before else last


def between(low: float, high: float, unit: str | None) -> str:
    """Two numbers in the unit of the larger one."""
    size, name = said_in(max(low, high, key=abs), unit)
    return f"{low / size:.6g} to {high / size:.6g} {name}".rstrip()


def said_in(number: float, unit: str | None) -> tuple[float, str]:
    """Size, in the base unit, and name of the unit that a number is said in."""
    if unit is None or unit == "1":
        return 1.0, ""
    if unit == MOMENT:
        name = SAID_IN if abs(number) >= SAID_FROM else unit
    else:
        name = suited_unit(number, unit)
    return (1.0 if name == unit else to_base(f"1 {name}", unit)), pretty(name)


def entries(section: Section, left_out: Sequence[str] = ()) -> str:
    """The quantities of a section that are given, in a line."""
    texts = []
    for name, quantity in quantities_of(type(section)).items():
        value = getattr(section, name)
        numbers = value if isinstance(value, tuple) else (value,)
        if name in left_out or not numbers or not all(isinstance(n, float) for n in numbers):
            continue
        said = [_of_entry(name, number, quantity.unit) for number in numbers]
        text = f"({', '.join(said)})" if isinstance(value, tuple) else said[0]
        texts.append(f"{name.replace('_', ' ')} {text}")
    return ", ".join(texts)


def shape_in_words(section: Section) -> str:
    """The shape that a section gives, with its sizes or the file that it is in."""
    shape, file = getattr(section, "shape", ""), getattr(section, "file", None)
    sizes = entries(section) if file is None else f"of {PurePath(file).name}"
    return f"{shape.replace('_', ' ')}{' ' if file else ', '}{sizes}".rstrip(", ")


def _of_entry(name: str, number: float, unit: str | None) -> str:
    """A number of an entry, which by its ``name`` may have a unit that it is always said in."""
    if unit and (everyday := everyday_unit(unit, name)):
        return f"{number / to_base(f'1 {everyday}', unit):.6g} {pretty(everyday)}"
    return plain(number, unit)


def alike(title: str, texts: dict[str, str]) -> list[tuple[str, str]]:
    """Rows of a ``title``, one for all whose text is the same: those of blade and disk, say."""
    names: dict[str, list[str]] = {}
    for name, text in texts.items():
        names.setdefault(text, []).append(name)
    return [(title, f"{' and '.join(of)}: {text}") for text, of in names.items()]


def of_bodies(title: str, section: Section) -> list[tuple[str, str]]:
    """Rows of a ``title`` with the quantities of every body that a ``section`` has."""
    bodies = {name: getattr(section, name) for name in type(section).model_fields}
    texts = {
        name: told_of_body(body) if isinstance(body, Section) else body
        for name, body in bodies.items()
        if isinstance(body, Section | str)
    }
    return alike(title, {name: text for name, text in texts.items() if text})


def told_of_body(body: Section) -> str:
    """The quantities of a body, a known material with its name."""
    name = getattr(body, "material", None)
    return ", ".join(text for text in (name, entries(body)) if text)


def shares(share: float) -> str:
    """A share in per cent."""
    return f"{100.0 * share:.3g} %"
