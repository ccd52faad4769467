"""Numbers in base units as readable text: 115 GPa, 4430 kg/m³, 50 µm, 6000 rpm."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePath

from workflow.case.sections import Section, quantities_of
from workflow.case.text.readable import everyday_unit, pretty, suited_unit
from workflow.case.units import to_base

# Moments and energies share a base unit; from DISPLAY_FROM on, a value is shown as a moment.
MOMENT, DISPLAY_FROM, DISPLAY_UNITS = "N*mm", 1e3, "N*m"

# Size from which numbers are grouped by thousands.
GROUPED = 1e4


def plain(number: float, unit: str | None, digits: int = 6) -> str:
    """Return a number in the base unit ``unit`` as text in a readable unit, where there is one."""
    size, name = display_unit(number, unit)
    return f"{number / size:.{digits}g} {name}".rstrip()


def times(number: float) -> str:
    """Return a count, for example of cycles, as text: 1,080,000, or 2500."""
    grouped = "," if abs(number) >= GROUPED else ""
    return f"{number:{grouped}.0f}" if number == round(number) else f"{number:{grouped}.6g}"


def counted(number: int, thing: str) -> str:
    """Return a number with its noun in the right form: 1 run, 3 runs."""
    return f"{number} {thing}" if number == 1 else f"{number} {thing}s"


def listed(things: Sequence[str]) -> str:
    """Return several things joined for a sentence: a, b and c."""
    *before, last = things
    return f"{', '.join(before)} and {last}" if before else last


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the rows of a table as lines, with columns as wide as their longest cell."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]


def between(low: float, high: float, unit: str | None) -> str:
    """Return a range as text, both numbers in the unit of the larger one."""
    size, name = display_unit(max(low, high, key=abs), unit)
    return f"{low / size:.6g} to {high / size:.6g} {name}".rstrip()


def display_unit(number: float, unit: str | None) -> tuple[float, str]:
    """Return size, in the base unit, and name of the unit in which a number is shown."""
    if unit is None or unit == "1":
        return 1.0, ""
    if unit == MOMENT:
        name = DISPLAY_UNITS if abs(number) >= DISPLAY_FROM else unit
    else:
        name = suited_unit(number, unit)
    return (1.0 if name == unit else to_base(f"1 {name}", unit)), pretty(name)


def entries(section: Section, left_out: Sequence[str] = ()) -> str:
    """Return the quantities that a section gives, as one line."""
    texts = []
    for name, quantity in quantities_of(type(section)).items():
        value = getattr(section, name)
        numbers = value if isinstance(value, tuple) else (value,)
        if name in left_out or not numbers or not all(isinstance(n, float) for n in numbers):
            continue
        printed = [_of_entry(name, number, quantity.unit) for number in numbers]
        text = f"({', '.join(printed)})" if isinstance(value, tuple) else printed[0]
        texts.append(f"{name.replace('_', ' ')} {text}")
    return ", ".join(texts)


def shape_in_words(section: Section) -> str:
    """Return the shape of a section, with its sizes or the name of its file."""
    shape, file = getattr(section, "shape", ""), getattr(section, "file", None)
    sizes = entries(section) if file is None else f"of {PurePath(file).name}"
    return f"{shape.replace('_', ' ')}{' ' if file else ', '}{sizes}".rstrip(", ")


def _of_entry(name: str, number: float, unit: str | None) -> str:
    """Return a number of an entry as text; some names of entries imply a fixed unit."""
    if unit and (everyday := everyday_unit(unit, name)):
        return f"{number / to_base(f'1 {everyday}', unit):.6g} {pretty(everyday)}"
    return plain(number, unit)


def merged_rows(title: str, texts: dict[str, str]) -> list[tuple[str, str]]:
    """Return rows called ``title``, one for all names with the same text, such as two bodies."""
    names: dict[str, list[str]] = {}
    for name, text in texts.items():
        names.setdefault(text, []).append(name)
    return [(title, f"{' and '.join(of)}: {text}") for text, of in names.items()]


def of_bodies(title: str, section: Section) -> list[tuple[str, str]]:
    """Return rows called ``title`` with the quantities of every body in a ``section``."""
    bodies = {name: getattr(section, name) for name in type(section).model_fields}
    texts = {
        name: body_text(body) if isinstance(body, Section) else body
        for name, body in bodies.items()
        if isinstance(body, Section | str)
    }
    return merged_rows(title, {name: text for name, text in texts.items() if text})


def body_text(body: Section) -> str:
    """Return the quantities of a body, after the name of its material if it has one."""
    name = getattr(body, "material", None)
    return ", ".join(text for text in (name, entries(body)) if text)


def shares(share: float) -> str:
    """Return a share in per cent, as text."""
    return f"{100.0 * share:.3g} %"
