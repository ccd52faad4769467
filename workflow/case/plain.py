"""Numbers in base units as one would say them: 115 GPa, 4430 kg/m^3, 50 um, 6000 rpm."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

from workflow.case.sections import Section, quantities_of

# Units by the base unit that they are said for: the least number of base units to be said in them,
# and the size of one, in base units, smallest first.
SAID_IN: dict[str, tuple[tuple[float, float, str], ...]] = {
    "mm": ((0.0, 1e-3, "um"), (0.1, 1.0, "mm"), (1e4, 1e3, "m")),
    "MPa": ((0.0, 1e-3, "kPa"), (0.5, 1.0, "MPa"), (1e4, 1e3, "GPa")),
    "N": ((0.0, 1.0, "N"), (1e4, 1e3, "kN")),
    "N/mm": ((0.0, 1.0, "N/mm"), (1e4, 1e3, "kN/mm")),
    "N*mm": ((0.0, 1.0, "N*mm"), (1e3, 1e3, "N*m")),
    "t": ((0.0, 1e-6, "g"), (5e-5, 1e-3, "kg")),
    "t/mm^3": ((0.0, 1e-12, "kg/m^3"),),
    "1/MPa": ((0.0, 1e-12, "um^3/J"),),
    "rad": ((0.0, pi / 180.0, "deg"),),
    "rad/s": ((0.0, pi / 30.0, "rpm"),),
    "s": ((0.0, 1e-6, "us"), (1e-3, 1e-3, "ms"), (1.0, 1.0, "s")),
}


def plain(number: float, unit: str | None, digits: int = 6) -> str:
    """A number in the base unit ``unit`` as it is said; of other units as it is."""
    size, name = said_in(number, unit)
    return f"{number / size:.{digits}g} {name}".rstrip()


def counted(number: int, thing: str) -> str:
    """So many of a thing: 1 run, 3 runs."""
    return f"{number} {thing}" if number == 1 else f"{number} {thing}s"


def between(low: float, high: float, unit: str | None) -> str:
    """Two numbers in the unit of the larger one."""
    size, name = said_in(max(low, high, key=abs), unit)
    return f"{low / size:.6g} to {high / size:.6g} {name}".rstrip()


def said_in(number: float, unit: str | None) -> tuple[float, str]:
    """Size, in the base unit, and name of the unit that a number is said in."""
    if unit is None or unit == "1":
        return 1.0, ""
    said = SAID_IN.get(unit, ((0.0, 1.0, unit),))
    if number == 0.0 and unit in [name for _, _, name in said]:
        return 1.0, unit
    _, size, name = next(row for row in reversed(said) if row[0] <= abs(number))
    return size, name


def entries(section: Section, left_out: Sequence[str] = ()) -> str:
    """The quantities of a section that are given, in a line."""
    texts = []
    for name, quantity in quantities_of(type(section)).items():
        value = getattr(section, name)
        numbers = value if isinstance(value, tuple) else (value,)
        if name in left_out or not numbers or not all(isinstance(n, float) for n in numbers):
            continue
        said = [plain(number, quantity.unit) for number in numbers]
        text = f"({', '.join(said)})" if isinstance(value, tuple) else said[0]
        texts.append(f"{name.replace('_', ' ')} {text}")
    return ", ".join(texts)


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
        name: _of_body(body) if isinstance(body, Section) else body
        for name, body in bodies.items()
        if isinstance(body, Section | str)
    }
    return alike(title, {name: text for name, text in texts.items() if text})


def _of_body(body: Section) -> str:
    """The quantities of a body, a known material with its name."""
    name = getattr(body, "material", None)
    return ", ".join(text for text in (name, entries(body)) if text)


def shares(share: float) -> str:
    """A share in per cent."""
    return f"{100.0 * share:.3g} %"
